"""What is printed: HTML that is escaped once, and coordinates."""

import numpy as np

from cdsm.support.format import coordinates, key
from cdsm.support.markup import element, row


def test_text_is_escaped_and_elements_are_not_escaped_again() -> None:
    cell = element("td", "a < b & c", data_cdsm='"x"', class_="wide")
    assert cell == '<td data-cdsm="&quot;x&quot;" class="wide">a &lt; b &amp; c</td>'
    assert element("tr", cell, "<") == f"<tr>{cell}&lt;</tr>"
    assert row("th", ["<", "2"]) == "<tr><th>&lt;</th><th>2</th></tr>"


def test_coordinates_and_keys_name_what_they_hold() -> None:
    assert coordinates(np.array([0.0, 1.0 / 3.0, 1e-9])) == "(0, 0.3333, 1e-09)"
    assert coordinates([-1e-9, 1.0, -0.004], "z.2f") == "(0.00, 1.00, 0.00)"
    assert key("margin", "N m/rad") == "margin_Nm_per_rad"
    assert key("margin", "N m/rad or N/m") == "margin_Nm_per_rad_or_N_per_m"

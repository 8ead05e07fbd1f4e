"""What is printed: HTML that is escaped once, and coordinates."""

import numpy as np

import cdsm
from cdsm.support.format import coordinates, key
from cdsm.support.markup import element, row
from tests.support.arms import random_arm, random_posture


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


def test_large_values_are_short() -> None:
    pose = random_posture(random_arm(4, 3), 1)
    segments = sum(len(cable.sites) - 1 + (cable.lead > 0.0) for cable in pose.arm.cables)
    names, count = ", ".join(pose.arm.cables.names[:4]), len(pose.arm.cables)
    assert repr(pose.arm.cables) == f"<{count} cables: {names}, and {count - 4} more>"
    assert repr(pose.arm.cables[:2]).startswith("(Cable(")  # a slice is a tuple
    expected = f"<{segments} segments of {count} cables, {segments - count} holes>"
    assert repr(pose.segments) == str(pose.segments.chains) == expected


def test_tolerances_print_what_is_not_the_default() -> None:
    assert repr(cdsm.Tolerances()) == "Tolerances()"
    made = cdsm.Tolerances(
        rigidity=0.05, lead=[cdsm.Tolerance.within(1e-3, "triangular", of="cable1_*")]
    )
    assert repr(made).startswith("Tolerances(rigidity=Tolerance(standard=0.05, correlation=1.0), ")
    assert "lead=(Tolerance(standard=0.0004" in repr(made)
    assert "distribution='triangular', of='cable1_*'" in repr(made)
    assert eval(repr(made), vars(cdsm)) == made
    varying = cdsm.Tolerance(np.array([0.1, 0.05]), tensions=np.array([10.0, 90.0]))
    assert "standard=array([0.1 , 0.05]), tensions=array([10., 90.])" in repr(varying)


def test_values_of_many_fields_are_one_line_at_the_prompt() -> None:
    arm = random_arm(4, 3)
    geometry = arm.geometry
    assert repr(geometry) == f"<Geometry {geometry}>"
    assert "\n" not in repr(geometry)
    K = cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 20.0))
    assert repr(K.report().self_check) == "<SelfCheck: 7 of 7 comparisons agree>"
    problem = cdsm.DesignProblem(
        arm=cdsm.presets.virtual_prototype(),
        variables=[cdsm.Variable("hole_radius", 0.02, 0.03)],
        objectives=[cdsm.Objective("motor_force")],
        postures=np.zeros((1, 10)),
    )
    assert repr(problem) == "<DesignProblem virtual_prototype: 1 variable, 1 load>"

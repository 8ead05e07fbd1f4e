"""Text of numbers: units sized to the number."""

import math

import numpy as np
import pytest

import cdsm
from cdsm.support.format import stiffness_text
from cdsm.sweeps.summary import curve_lines
from tests.support.arms import readme_geometry


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((3214.6,), "3.215 N/mm"),
        ((0.6738,), "0.6738 N/m"),
        ((99.9,), "99.9 N/m"),
        ((100.0,), "0.1 N/mm"),
        ((0.5, 20e3), "0.0005 to 20 N/mm"),
        ((math.inf,), "inf N/mm"),
    ],
)
def test_stiffness_is_read_in_the_unit_for_its_size(values: tuple[float, ...], text: str) -> None:
    assert stiffness_text(*values) == text


def test_prints_and_tables_of_a_soft_arm_are_in_newtons_per_metre() -> None:
    soft = cdsm.LinearElasticity(100.0)
    pose = cdsm.Manipulator(readme_geometry(), soft, gravity=(0, 0, 0)).at(np.full(8, 0.05))
    reach = cdsm.stiffness_range(pose, "z", 0.01, 0.02)
    assert f"{reach.low:.4g} to {reach.high:.4g} N/m (" in str(reach)
    rows = cdsm.sweep(pose.arm, pose.q[None], minimum=[0.01, 0.02], outputs=["along"])
    assert "along z [N/m]" in curve_lines(rows.isel(pose=0))[0]
    along = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 0.01)).along("z")
    assert f"{along:.4g}" in curve_lines(rows.isel(pose=0))[1]

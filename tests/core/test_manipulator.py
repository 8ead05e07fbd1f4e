"""Manipulator: joint limits, and lengths in another unit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
)

ARM = random_arm(1, 3)
_ROOT = Path(__file__).parents[2]


def test_angles_beyond_their_limits_are_an_error_with_data() -> None:
    arm = mixed_arm()
    q = np.array([0.0, 2.0, 0.0, -0.41, 0.0])
    with pytest.raises(cdsm.InvalidInput) as caught:
        arm.at(q)
    for part in (
        "joint1_2 = 114.6°",
        "joint3_1 = -23.49°",
        "to 22.92°",
        "check_limits=False",
    ):
        assert part in str(caught.value)
    assert np.isfinite(arm.at(q, check_limits=False).tip).all()


def test_angles_at_their_limits_are_inside_even_through_degrees() -> None:
    for sign in (-1.0, 1.0):
        ARM.at(sign * ARM.upper)
        ARM.at(np.deg2rad(np.rad2deg(sign * ARM.upper)))
    with pytest.raises(cdsm.InvalidInput):
        ARM.at(ARM.upper + 1e-6)


_MASS = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
)
_RAIL = """<robot name="rail"><link name="floor"/><link name="car">{mass}</link>
<link name="hand">{mass}</link>
<joint name="way" type="prismatic"><parent link="floor"/><child link="car"/><axis xyz="1 0 0"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="grip" type="revolute"><parent link="car"/><child link="hand"/><axis xyz="0 0 1"/>
<origin xyz="{x} 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""


def _rail(x: float = 0.1, site: float = 0.01, lead: float = 0.2, tip: str = "hand") -> None:
    """Build an arm of length ``x`` [m] with a cable through ``site``, behind ``lead`` [m]."""
    sites = cdsm.Site("floor", (0.0, 0.02, 0.0)), cdsm.Site("hand", (site, 0.01, 0.0))
    cable = cdsm.Cable(name="pull", sites=sites, elasticity=STEEL, lead=lead)
    arm = cdsm.Manipulator.from_urdf(_RAIL.format(x=x, mass=_MASS), [cable], tip=tip)
    arm.with_gravity("y").with_friction(0.1)  # which say nothing again


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"x": 100.0}, "rail: the arm is 100 m: it looks as if lengths are in mm"),
        ({"x": 1e-4}, "rail: the arm is 0.0001 m long: it looks as if lengths are in another unit"),
        ({"site": 10.0}, "rail: a site of pull is 10 m: it looks as if lengths are in mm"),
        ({"lead": 50.0}, "rail: the lead of pull is 50 m: it looks as if lengths are in mm"),
    ],
)
def test_lengths_in_another_unit_are_doubted_once(given: dict[str, Any], said: str) -> None:
    with pytest.warns(cdsm.CdsmWarning) as told:
        _rail(**given)
    (warning,) = told
    assert said in str(warning.message)


def test_tip_that_no_joint_moves_is_doubted_once(recwarn: pytest.WarningsRecorder) -> None:
    _rail(tip="floor")
    said = "rail: no joint moves its tip floor, so its stiffness is infinite; give another link"
    assert [said in str(warning.message) for warning in recwarn.list] == [True]


@pytest.mark.filterwarnings("error:.*looks as if:cdsm.CdsmWarning")
@pytest.mark.parametrize(
    "path",
    [*_ROOT.glob("urdf/*.toml"), *_ROOT.glob("examples/a*.toml")],
    ids=lambda path: path.stem,
)
def test_lengths_of_arms_that_people_know_are_not_doubted(path: Path) -> None:
    cdsm.Manipulator.read(path, STEEL)

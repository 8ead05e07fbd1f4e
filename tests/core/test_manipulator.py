"""Manipulator: joint limits, the order of joints, and lengths in another unit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import paper
from tests.support.arms import STEEL, mixed_arm, random_arm, random_posture

ARM = random_arm(1, 3)


def test_angles_beyond_their_limits_are_an_error_with_data() -> None:
    arm = mixed_arm()
    q = np.array([0.0, 2.0, 0.0, -0.41, 0.0])
    with pytest.raises(cdsm.InvalidInput) as caught:
        arm.at(q)
    for part in ("joint1_2 = 114.6°", "joint3_1 = -23.49°", "to 22.92°", "check_limits=False"):
        assert part in str(caught.value)
    assert np.isfinite(arm.at(q, check_limits=False).tip).all()


def test_angles_at_their_limits_are_inside_even_through_degrees() -> None:
    for sign in (-1.0, 1.0):
        ARM.at(sign * ARM.upper)
        ARM.at(np.deg2rad(np.rad2deg(sign * ARM.upper)))
    with pytest.raises(cdsm.InvalidInput):
        ARM.at(ARM.upper + 1e-6)


def test_other_order_of_joints_permutes_everything() -> None:
    pose = random_posture(mixed_arm(), 5)
    arm, names = pose.arm, pose.arm.joint_names
    turned = cdsm.Manipulator.from_urdf(
        arm.urdf, arm.cables, tip="tool0", joint_names=names[::-1], gravity=arm.gravity
    ).at(pose.q[::-1])
    assert turned.arm.joint_names == names[::-1]
    np.testing.assert_array_equal(turned.tip, pose.tip)
    np.testing.assert_array_equal(turned.jacobian, pose.jacobian[:, ::-1])
    np.testing.assert_array_equal(turned.length_jacobian, pose.length_jacobian[:, ::-1])
    np.testing.assert_array_equal(turned.gravity_torque, pose.gravity_torque[::-1])
    np.testing.assert_array_equal(turned.gravity_stiffness, pose.gravity_stiffness[::-1, ::-1])


def test_experimental_prototype_controls_one_cable_of_each_pair_by_force() -> None:
    arm = paper.experimental_prototype(series_stiffness=1890.0, tool_length=0.15)
    assert [cable.control for cable in arm.cables] == ["position", "force"] * 3
    assert {cable.series_stiffness for cable in arm.cables} == {1890.0}
    assert [link.length for link in arm.geometry.links] == [0.1, 0.1, 0.15]
    np.testing.assert_allclose(np.rad2deg(arm.upper), 30.0)


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
        ({"x": 100.0}, "the arm is 100 m: "),
        ({"x": 1e-4}, "0.0001 m long"),
        ({"site": 10.0}, "a site of pull is 10 m"),
        ({"lead": 50.0}, "the lead of pull is 50 m"),
        ({"tip": "floor"}, "no joint moves its tip floor"),
    ],
)
def test_lengths_in_another_unit_and_tips_at_rest_are_doubted_once(
    given: dict[str, Any], said: str
) -> None:
    with pytest.warns(cdsm.CdsmWarning) as told:
        _rail(**given)
    assert [said in str(each.message) for each in told].count(True) == 1


@pytest.mark.filterwarnings("error:.*looks as if:cdsm.CdsmWarning")
def test_lengths_of_arms_that_people_know_are_not_doubted() -> None:
    root = Path(__file__).parents[2]
    for path in (*root.glob("urdf/*.toml"), *root.glob("examples/a*.toml")):
        cdsm.Manipulator.read(path, STEEL)

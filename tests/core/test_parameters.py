"""An arm as a function of parameters by name."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

import cdsm
from tests.support.arms import readme_geometry
from tests.support.foreign import crab

GEOMETRY = readme_geometry(joints=2, hole_radius=[0.025, 0.02])
ARM = cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(48e3), gravity="-y").with_friction(0.1)


def test_nothing_changed_is_the_same_arm() -> None:
    every = ("friction", "rigidity", "lead", "hole_radius@1", "hole_radius@2", "disk_offset@1")
    parameters = cdsm.ArmParameters(ARM, (*every, "link_length", "link_mass@2"))
    same = parameters(**parameters.present)
    assert same.geometry.cables == GEOMETRY.cables
    assert same.cables == ARM.cables
    assert same.at([0.1] * 4).gravity_torque == pytest.approx(ARM.at([0.1] * 4).gravity_torque)


def test_cables_of_a_robot_have_parameters() -> None:
    robot, (first, *_) = crab(), crab().cables.names
    parameters = cdsm.ArmParameters(robot, ("friction", "rigidity", f"spring@{first}"))
    arm = parameters(friction=0.2, rigidity=0.5, **{f"spring@{first}": 2e4})
    rough = crab(cdsm.LinearElasticity(1.5e4)).with_friction(0.2)
    assert arm.cables[1:] == rough.cables[1:]
    assert arm.cables[0] == replace(rough.cables[0], series_stiffness=2e4)


def test_each_parameter_is_where_it_says() -> None:
    names = ("friction@2", "rigidity", "spring@1", "lead@2", "hole_radius@1", "link_mass")
    arm = cdsm.ArmParameters(ARM, names)(
        **{"friction@2": 0.3, "rigidity": 0.5, "spring@1": 2e4, "lead@2": 0.4},
        **{"hole_radius@1": 0.03, "link_mass": 0.2},
    )
    first, second = arm.cables[0], arm.cables[3]
    assert [site.friction for site in first.sites[:-1]] == [0.1]
    assert {site.friction for site in second.sites[:-1]} == {0.3}
    assert (first.series_stiffness, second.series_stiffness) == (2e4, math.inf)
    assert (first.lead, second.lead) == (0.3, 0.4)
    assert all(cable.elasticity == cdsm.LinearElasticity(24e3) for cable in arm.cables)
    assert len({id(cable.elasticity) for cable in arm.cables}) == 1  # computed together
    radii = [math.hypot(*site.position[1:]) for site in second.sites]
    assert radii == pytest.approx([0.03, 0.03, 0.02, 0.02])
    assert [link.mass for link in arm.geometry.links] == [0.2, 0.2]
    assert arm.gravity.tolist() == ARM.gravity.tolist()


def test_a_cable_has_parameters_of_its_own() -> None:
    names = ("phase@1", "hole_angle@cable2_1", "lead@cable2_1", "friction@cable1_2")
    parameters = cdsm.ArmParameters(ARM, names)
    assert parameters.present["phase@1"] == 0.0
    assert parameters.present["lead@cable2_1"] == 0.3
    values = {"phase@1": 0.1, "hole_angle@cable2_1": 0.2, "lead@cable2_1": 0.5}
    arm = parameters(**values, **{"friction@cable1_2": 0.3})
    routes, old = arm.geometry.cables, GEOMETRY.cables
    assert routes[0].angle == pytest.approx(old[0].angle + 0.1)
    assert (routes[3].angle, routes[3].lead, routes[4].lead) == (0.2, 0.5, 0.3)
    y, z = arm.cables[3].sites[0].position[1:]
    assert math.atan2(z, y) == pytest.approx(0.2)
    assert arm.cables[1].sites[0].friction == 0.3 != arm.cables[0].sites[0].friction


def test_one_radius_of_all_holes_is_that_of_the_geometry() -> None:
    geometry = cdsm.ArmParameters(ARM, ("hole_radius",))(hole_radius=0.03).geometry
    assert geometry.hole_radius == 0.03
    assert geometry.hole_radii == (0.03, 0.03)


SECTION = {"length": 0.1, "disks": 3, "hole_angles": [0.0, 2.0, 4.0], "hole_radius": 0.006}
ROD = cdsm.Manipulator(
    cdsm.Geometry.backbone(sections=[SECTION], bending_stiffness=0.01, poisson=0.25),
    cdsm.LinearElasticity(48e3),
)


SPRUNG = cdsm.Manipulator(
    readme_geometry(joints=2, joint_stiffness=[2.0, 1.0], bending_stiffness=5.0),
    cdsm.LinearElasticity(48e3),
)


def test_motors_and_springs_have_parameters() -> None:
    names = ("joint_stiffness@2", "bending_stiffness@1", "slack@cable2_1", "gain")
    parameters = cdsm.ArmParameters(SPRUNG, names)
    assert [*parameters.present.values()] == [1.0, 5.0, 0.0, 1.0]
    arm = parameters(**dict(zip(names, (3.0, 6.0, 1e-3, 0.9), strict=True)))
    assert [joint.stiffness for joint in arm.geometry.joints] == [2.0, 3.0]
    own = dict(zip(arm.springs.joints, arm.springs.stiffness, strict=True))
    assert (own["joint1_1"], own["joint2_1"], own["joint2_2"]) == (2.0, 3.0, 3.0)
    assert [link.bending_stiffness for link in arm.geometry.links] == [6.0, 5.0]
    assert [cable.slack for cable in arm.cables] == [0.0] * 3 + [1e-3, 0.0, 0.0]
    assert {cable.gain for cable in arm.cables} == {0.9}


def test_a_backbone_has_one_stiffness_or_one_per_gap() -> None:
    softer = cdsm.ArmParameters(ROD, ("bending_stiffness@2",))(**{"bending_stiffness@2": 0.005})
    ratio = softer.springs.stiffness / ROD.springs.stiffness
    of_gap = ["gap2" in name for name in ROD.springs.joints]
    assert ratio == pytest.approx([0.5 if each else 1.0 for each in of_gap])  # twist as well


def test_slack_and_gain_change_what_a_pull_takes_in() -> None:
    pull, loose = 0.004, -0.05
    changed = cdsm.ArmParameters(ROD, ("slack", "gain"))(slack=1e-3, gain=0.5)
    tip = cdsm.forward_statics(changed, pull=[pull, loose, loose]).pose.tip
    same = cdsm.forward_statics(ROD, pull=[0.5 * pull - 1e-3, loose, loose]).pose.tip
    assert tip == pytest.approx(same, abs=1e-9)
    none = cdsm.forward_statics(changed, pull=[1e-3, loose, loose])
    assert not none.tension.any()


def test_files_hold_slack_and_gain(tmp_path: Path) -> None:
    arm = cdsm.ArmParameters(ROD, ("slack@cable3_2", "gain"))(**{"slack@cable3_2": 1e-3, "gain": 2})
    path = arm.write(tmp_path / "ARM.toml")
    assert cdsm.Manipulator.read(path) == arm != ROD
    all_slack = cdsm.Manipulator.read(path, changes={"slack": 2e-3})
    assert [cable.slack for cable in all_slack.cables] == [2e-3, 1e-3, 2e-3]
    with pytest.raises(cdsm.FileError, match=r"slack: -0\.002 m given"):
        cdsm.Manipulator.read(path, changes={"slack": -2e-3})


@pytest.mark.parametrize(
    ("arm", "names", "said"),
    [
        (ARM, ("hole_radus",), "hole_radus"),
        (ARM, ("hole_radius@3",), "joints 1 to 2"),
        (ARM, ("hole_radius@x",), "joints 1 to 2"),
        (ARM, ("lead@1", "lead"), "lead: frees lead of a joint twice"),
        (ARM, ("lead@2", "lead@cable2_1"), "twice"),
        (ARM, ("phase", "hole_angle@cable2_1"), "twice"),
        (ARM, ("lead@cable9_1",), "cable9_1"),
        (ARM, ("bending_stiffness",), "no backbone"),
        (ROD, ("joint_stiffness",), "free the bending_stiffness"),
        (ROD, ("slack@2",), "no cable that ends there"),
        (SPRUNG.with_springs({"joint1_1": 4.0}), ("joint_stiffness",), "springs of the arm"),
        (
            cdsm.Manipulator.from_urdf(ARM.urdf, ARM.cables, tip="tool0"),
            ("lead",),
            "its cables have friction",
        ),
    ],
)
def test_names_that_free_nothing_or_twice_are_refused(
    arm: cdsm.Manipulator, names: tuple[str, ...], said: str
) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.ArmParameters(arm, names)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("rigidity", -1.0, "-1"),
        ("spring", 0.0, "0 N/m"),
        ("hole_radius", -1.0, "hole_radius: -1 m"),
        ("friction", -0.1, "friction"),
        ("slack", -1e-3, r"cable1_1.*slack: -0\.001 m"),
        ("lead", 0.1, "lead"),  # not free
    ],
)
def test_bad_values_are_refused(name: str, value: float, said: str) -> None:
    free = ("rigidity", "spring", "hole_radius", "friction", "slack")
    with pytest.raises(cdsm.CdsmError, match=said):
        cdsm.ArmParameters(ARM, free)(**{name: value})

"""An arm as a function of parameters by name."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.parameters import NEWTON, PARAMETERS, Parameter, Unit, attribute
from tests.support.arms import readme_geometry
from tests.support.foreign import crab
from tests.support.pulleys import finger

GEOMETRY = readme_geometry(joints=2, hole_radius=[0.025, 0.02])
ARM = cdsm.Manipulator(GEOMETRY, cdsm.LinearElasticity(48e3), gravity="-y").with_friction(0.1)


DRIVEN = ARM.with_motors(
    [
        cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": -0.012}, stiffness=20.0),
        cdsm.Motor("m2", {"cable2_1": 0.012, "cable2_2": -0.012}, stiffness=30.0),
        cdsm.Motor("m3", {"cable2_3": 0.012}),
    ]
)


def test_nothing_changed_is_the_same_arm() -> None:
    every = ("friction", "rigidity", "lead", "hole_radius@1", "hole_radius@2", "disk_offset@1")
    parameters = cdsm.ArmParameters(ARM, (*every, "link_length", "link_mass@2"))
    same = parameters(**parameters.present)
    assert same.geometry.cables == GEOMETRY.cables
    assert same.cables == ARM.cables
    assert same.at([0.1] * 4).gravity_torque == pytest.approx(ARM.at([0.1] * 4).gravity_torque)


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("where", ["", "@2", "@cable2_1"])
def test_an_arm_with_its_own_numbers_is_equal(name: str, where: str) -> None:
    """Also where joints have numbers of their own: equal radii are one radius of the geometry."""
    at = where if where != "@cable2_1" or "cables" in PARAMETERS[name].kinds else "@1"
    at = at.replace("@", "@m") if "motors" in PARAMETERS[name].kinds else at
    special = {"bending_stiffness": SPRUNG, "exponent": WITH_LAWS, "motor_stiffness": DRIVEN}
    if name == "pulley_radius":  # of an arm from a URDF, whose cables have names alone
        special[name] = finger()
        at = where and "@cable2"
    arm = special.get(name, ARM)
    arm = arm.with_cables([replace(cable, series_stiffness=2e4) for cable in arm.cables])
    parameters = cdsm.ArmParameters(arm, (f"{name}{at}",))
    if len({*parameters.values(f"{name}{at}")}) == 1:
        assert parameters(**parameters.present) == arm


def test_equal_radii_are_one_radius_of_the_geometry(tmp_path: Path) -> None:
    own = cdsm.ArmParameters(ARM, ("hole_radius@1", "hole_radius@2"))
    arm = own(**{"hole_radius@1": 0.02, "hole_radius@2": 0.02})
    assert arm == cdsm.ArmParameters(ARM, ("hole_radius",))(hole_radius=0.02)
    assert arm.geometry.hole_radius == 0.02
    assert [joint.hole_radius for joint in arm.geometry.joints] == [None, None]
    assert "hole_radius = 0.02" in arm.write(tmp_path / "ARM.toml").read_text(encoding="utf-8")


COMPLIANCE = Parameter(
    unit=Unit("m/N"),
    kinds=("cables",),
    get=lambda cable: 1.0 / cable.series_stiffness,
    set=lambda cable, value: replace(cable, series_stiffness=1.0 / value),
    is_relative=True,
)


def test_a_row_for_cables_is_known_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One row: it is set, written, identified and designed, and has a tolerance."""
    monkeypatch.setitem(PARAMETERS, "compliance", COMPLIANCE)
    monkeypatch.setitem(PARAMETERS, "maximum", attribute("cables", "maximum", NEWTON))
    soft = [replace(cable, series_stiffness=2e4) for cable in ARM.cables]
    arm = cdsm.Manipulator(GEOMETRY, cables=soft)
    parameters = cdsm.ArmParameters(arm, ("compliance", "maximum@cable2_1"))
    assert parameters.unit("compliance") == ("mm/N", 1e-3)
    assert parameters.present == {"compliance": 5e-5, "maximum@cable2_1": math.inf}
    changed = parameters(**{"compliance": 1e-4, "maximum@cable2_1": 90.0})
    assert {cable.series_stiffness for cable in changed.cables} == {1e4}
    assert changed.cables["cable2_1"].maximum == 90.0
    path = arm.write(tmp_path / "ARM.toml")
    bounded = cdsm.Manipulator.read(path, changes={"maximum": 90.0})
    assert bounded == cdsm.ArmParameters(arm, ("maximum",))(maximum=90.0)

    # identification
    pull = np.full(6, 20.0)
    along = cdsm.stiffness(changed.at([0.1] * 4), pull).along("z")
    test = cdsm.Measurement(along, "z", (0.1,) * 4, tuple(pull), std=1e-3 * along)
    free = cdsm.ArmParameters(arm, ("compliance",))
    found = cdsm.identify(free, [test], {"compliance": (1e-5, 1e-3)}, start={"compliance": 5e-5})
    assert found.values[0] == pytest.approx(1e-4, rel=1e-6)

    # design
    problem = cdsm.DesignProblem(
        arm=arm,
        variables=[cdsm.Variable("compliance", 1e-5, 1e-3)],
        objectives=[cdsm.Objective("mass")],
        postures=[[0.1] * 4],
    )
    assert problem.arm_of([1e-4]) == free(compliance=1e-4)
    assert problem.start == pytest.approx([5e-5])

    # tolerances: 1/k has the relative error of k
    pose = arm.at([0.1] * 4)
    budgets = [
        cdsm.uncertainty(pose, pull, cdsm.Tolerances(**{name: 0.05}), direction="z")
        for name in ("compliance", "spring")
    ]
    assert budgets[0].measurand.inputs.labels["compliance"] == arm.cables.names
    np.testing.assert_allclose(
        budgets[0].sensitivities["compliance"], -budgets[1].sensitivities["spring"], rtol=1e-4
    )
    assert "compliance" in str(budgets[0])
    assert "5 %" in str(budgets[0])


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
    assert len(arm.laws.held) == 1  # computed together
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


LAW = cdsm.SpringLaw.power(stiffness=0.6, exponent=0.7, scale=0.03)
WITH_LAWS = cdsm.Manipulator(
    readme_geometry(joints=2, joint_stiffness=LAW), cdsm.LinearElasticity(48e3)
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
        (ARM, ("lead@1", "lead"), "lead: changes a number that lead@1 changes too"),
        (ARM, ("lead@2", "lead@cable2_1"), "lead@2 changes too"),
        (ARM, ("phase", "hole_angle@cable2_1"), "phase changes too"),
        (ARM, ("lead@cable9_1",), "cable9_1"),
        (ARM, ("bending_stiffness",), "no backbone"),
        (ROD, ("joint_stiffness",), "free the bending_stiffness"),
        (ROD, ("slack@2",), "no cable that ends there"),
        (SPRUNG.with_springs({"joint1_1": 4.0}), ("joint_stiffness",), "its springs are not"),
        (
            cdsm.Manipulator.from_urdf(ARM.urdf, ARM.cables, tip="tool0"),
            ("lead",),
            "its cables have .*friction",
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

"""Where an arm comes to rest from what its motors do, and how stiff it is there."""

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.statics import continuation
from cdsm.statics.pieces import next_on_piece
from cdsm.support.values import Array
from tests.support.arms import readme_geometry

LAW = cdsm.LinearElasticity(2e4)
TENSION = np.array([8.0, 0.0, 3.0])
WRENCH = np.array([0.3, 0.2, -0.1, 0.01, 0.0, 0.02])


def section() -> cdsm.Manipulator:
    """Eight universal joints with springs, moved by the three cables of the last one."""
    geometry = readme_geometry(
        joints=8, link_length=0.05, base_length=0.02, disk_offset=0.01, hole_radius=0.01,
        link_mass=0.01, lead=0.1, joint_stiffness=0.5, joint_limit=1.0,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, LAW)
    return arm.with_cables([each for each in arm.cables if each.name.startswith("cable8")])


ARM = section()


@pytest.mark.parametrize(
    ("given", "motors"),
    [({"tension": TENSION}, "tension"), ({"pull": [0.004, -0.01, 0.0]}, "locked")],
)
def test_compliance_is_the_derivative_of_forward_statics(given: Any, motors: str) -> None:
    solve = partial(cdsm.forward_statics, ARM, **given)
    rest = solve(wrench=WRENCH)
    assert (rest.motors, rest.branch) == (motors, 1.0)
    assert abs(rest.residual).max() < 1e-10
    assert (motors == "tension") == (not rest.stiffness.cable_stiffness.any())

    def tip(wrench: Array) -> Array:
        return np.asarray(solve(wrench=wrench, start=rest.pose.q).pose.tip[:3, 3])

    C, errors = rest.compliance[:3, :3], []
    for h in (2e-2, 1e-2):
        steps = h * np.eye(6)[:3]
        moved = [(tip(WRENCH + e) - tip(WRENCH - e)) / (2.0 * h) for e in steps]
        errors.append(abs(np.transpose(moved) - C).max() / abs(C).max())
    assert errors[1] < 1e-2
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_motors_that_hold_lengths_are_stiffer_than_those_that_hold_tensions() -> None:
    pull = np.array([0.004, 0.001, 0.0])
    straight = ARM.at(np.zeros(ARM.nv)).cable_lengths
    one = cdsm.forward_statics(ARM, pull=pull)
    other = cdsm.forward_statics(ARM, rest_lengths=straight - pull)
    np.testing.assert_allclose(one.pose.q, other.pose.q, atol=1e-9)
    held = cdsm.forward_statics(ARM, tension=TENSION)
    for rest in (one, held):  # motors locked there stay there
        locked = cdsm.equilibrium(rest.pose, rest.tension)
        np.testing.assert_allclose(locked.pose.q, rest.pose.q, atol=1e-9)
        assert rest.report().passed
        assert (rest.neutral, rest.verdict.is_held) == (False, True)
    assert locked.along("z") > 2.0 * held.along("z")


@pytest.mark.parametrize("solver", ["daqp", "osqp"])
def test_fewer_cables_than_joints_balance_where_the_arm_rests(solver: str) -> None:
    """16 balances for three tensions, of which three are independent."""
    random, q = np.random.default_rng(0), []
    given = random.uniform(1.0, 8.0, (8, 3))
    for F in given:
        pose = cdsm.forward_statics(ARM, tension=F, wrench=WRENCH).pose
        least = cdsm.distribute_tension(pose, wrench=WRENCH, solver=solver)
        np.testing.assert_allclose(least.values, F, rtol=1e-6)
        q.append(pose.q)
    batch = cdsm.distribute_tensions(ARM, q, wrench=WRENCH)
    np.testing.assert_allclose(batch.values, given, rtol=1e-6)
    with pytest.raises(cdsm.InfeasibleTension, match="only where they come to rest"):
        cdsm.distribute_tension(ARM.at(1.1 * q[0]), wrench=WRENCH, solver=solver)


@pytest.mark.parametrize("what", ["tension", "rest_lengths", "pull"])
def test_cables_that_a_dict_does_not_name_are_loose(what: str) -> None:
    rest = cdsm.forward_statics(ARM, tension=[4.0, 0.0, 0.0])
    left = rest.pose.cable_lengths[0] / (1.0 + 4.0 / 2e4)
    straight = ARM.at(np.zeros(ARM.nv)).cable_lengths[0]
    own = {"tension": 4.0, "rest_lengths": left, "pull": straight - left}
    given: Any = {what: {ARM.cables.names[0]: own[what]}}
    found = cdsm.forward_statics(ARM, **given)
    np.testing.assert_allclose(found.tension, [4.0, 0.0, 0.0], atol=1e-7)
    np.testing.assert_allclose(found.pose.q, rest.pose.q, atol=1e-8)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "none given"),
        ({"pull": {"cable9_1": 0.0}}, "cable9_1"),
        ({"pull": {"cable8_1": math.nan}}, "pull.'cable8_1'.: nan"),
        ({"tension": TENSION, "pull": TENSION}, "tension and pull given"),
        ({"tension": [1.0, 2.0]}, r"\(3,\) needed"),
        ({"tension": [-1.0, 0.0, 0.0]}, "cables only pull"),
        ({"pull": [1.0, 0.0, 0.0]}, "leaves -0.53 m of cable8_1"),
    ],
)
def test_what_cannot_be_solved_is_named(given: Any, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.forward_statics(ARM, **given)
    first, *others = ARM.cables
    forced = ARM.with_cables([replace(first, control="force"), *others])
    with pytest.raises(cdsm.InvalidInput, match="pull: cable8_1 has control='force'"):
        cdsm.forward_statics(forced, pull=[0.0, 0.0, 0.0])
    loose = ARM.with_springs(dict.fromkeys(ARM.joint_names[:-1], 1.0))
    with pytest.raises(cdsm.EquilibriumError, match=r"nothing holds joint8_2.*with_springs\(\)"):
        cdsm.forward_statics(loose, tension=TENSION)


FORCE = np.array([0.0, 0.1, -0.2])
GIVEN = ({"tension": TENSION}, {"pull": [0.006, -0.02, -0.02]}, {"pull": [0.004, 0.001, 0.0]})


def test_a_free_angle_that_is_unstable_under_the_weight_is_named() -> None:
    """A rod that stands on its hinge: k (q − q_0) = m g l/2 sin q has a root on either side."""
    k, weight = 2.0, 2.2
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, link_length=0.1, base_length=0.02, disk_offset=0.01, hole_radius=0.01,
        link_mass=weight / (9.81 * 0.05), joint_stiffness=k, rest_angle=-0.1, joint_limit=1.5,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, LAW, gravity=(-9.81, 0.0, 0.0))
    message = r"-5\.73° of joint1.* unstable under its weight.*2\.189 N m/rad from the 2 N m/rad"
    with pytest.raises(cdsm.EquilibriumError, match=message) as caught:
        cdsm.forward_statics(arm, tension=np.zeros(len(arm.cables)))
    assert "start=" in str(caught.value)
    assert "too weak" not in str(caught.value)
    rest = cdsm.forward_statics(arm, tension=np.zeros(len(arm.cables)), start=[-1.0])
    q = rest.pose.q[0]
    assert q < -0.5
    assert k * (q + 0.1) == pytest.approx(weight * math.sin(q), rel=1e-9)
    assert rest.stiffness.joint[0, 0] == pytest.approx(k - weight * math.cos(q), rel=1e-9)
    assert rest.stable


@pytest.mark.parametrize("given", GIVEN, ids=("tension", "slack", "pull"))
@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_weights_hang_on_an_arm_whose_motors_go_on(
    given: dict[str, object], friction: float
) -> None:
    arm = ARM.with_friction(friction)
    solve = partial(cdsm.forward_statics, arm, **given)  # type: ignore[arg-type]
    rest = solve()
    loaded = solve(wrench=[*FORCE, 0.0, 0.0, 0.0])
    test = cdsm.weight_test(rest.pose, rest, FORCE, steps=2)
    free = solve(wrench=[*FORCE, 0.0, 0.0, 0.0], friction=False).pose.tip[:3, 3]
    moved = free - solve(friction=False).pose.tip[:3, 3]
    np.testing.assert_allclose(test.states[-1].pose.tip[:3, 3], free, atol=1e-9)
    history = cdsm.load_cycle(rest.pose, rest, [[*FORCE, 0.0, 0.0, 0.0]])
    if friction == 0.0:
        np.testing.assert_allclose(history.displacement[-1], moved, atol=1e-9)
        assert test.left_reference is False
    else:
        assert history.dissipated[0] > 0.0
        assert 0.0 < np.linalg.norm(history.displacement[-1]) < np.linalg.norm(moved)
        far = np.linalg.norm(history.displacement[-1])
        np.testing.assert_allclose(history.tip[-1], loaded.pose.tip[:3, 3], atol=1e-2 * far)
    with pytest.raises(cdsm.InvalidInput, match="of another posture"):
        cdsm.weight_test(loaded.pose, rest, FORCE)


def test_motors_pull_a_sprung_arm_as_forward_statics_says() -> None:
    pull = np.array([0.006, -0.004, 0.0])
    begin = cdsm.forward_statics(ARM, pull=np.zeros(3))
    history = cdsm.load_cycle(begin.pose, begin, np.zeros((3, 6)), motors=[pull, pull / 2, pull])
    for k, part in enumerate((1.0, 0.5, 1.0)):
        rest = cdsm.forward_statics(ARM, pull=part * pull)
        np.testing.assert_allclose(history.tip[k], rest.pose.tip[:3, 3], atol=1e-9)
    assert abs(history.dissipated).max() < 1e-12
    rough = ARM.with_friction(0.2)
    loop = np.outer([0.5, 1.0, 0.5, 0.0] * 3, [0.006, -0.004, 0.0])
    slow = cdsm.load_cycle(
        rough.at(begin.pose.q), begin.tension, np.zeros((12, 6)), motors=loop, substeps=16
    )
    np.testing.assert_allclose(slow.tip[11], slow.tip[7], atol=1e-6)  # the loop is closed
    assert (slow.dissipated[4:] >= 0.0).all()
    assert slow.dissipated[8:].sum() == pytest.approx(slow.dissipated[4:8].sum(), rel=1e-2)
    assert slow.dissipated[8:].sum() > 1e-5
    assert np.linalg.norm(slow.tip[6] - slow.tip[4]) > 1e-5  # hysteresis at half the pull


def test_motors_that_hold_tensions_need_no_law_below_its_domain() -> None:
    arm = cdsm.presets.virtual_prototype()
    arm = arm.with_springs(dict.fromkeys(arm.joint_names, 30.0))
    assert arm.cables[0].elasticity.low > 1.0
    for F in (50.0, 1.0):
        rest = cdsm.forward_statics(arm, tension=np.full(15, F))
        np.testing.assert_array_equal(rest.tension, F)
        assert not rest.stiffness.cable_stiffness.any()
        assert "stable" in str(rest.stiffness)
        load = [0.0, 0.0, -0.1, 0.0, 0.0, 0.0]
        history = cdsm.load_cycle(rest.pose, rest, [load])
        moved = cdsm.forward_statics(arm, tension=rest.tension, wrench=load)
        np.testing.assert_allclose(history.tip[0], moved.pose.tip[:3, 3], atol=1e-9)


def test_backbone_with_all_bends_at_their_stops_is_told_in_one_line() -> None:
    """The tip can move as the rod twists; along the bent rod it is locked, and has no number."""
    sizes = {"length": 0.3, "disks": 8, "hole_angles": [0.0, 2.1, 4.2], "hole_radius": 0.01}
    geometry = cdsm.Geometry.backbone(sections=[sizes], bending_stiffness=0.02)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))
    rest = cdsm.forward_statics(arm, tension=[400.0, 0.0, 0.0])
    assert len(rest.at_limit) == 32
    assert rest.verdict.status is cdsm.Status.AT_STOP
    assert rest.verdict.heading.startswith("all 32 bends are at their stops")
    lines = str(rest).splitlines()
    assert sum("stop" in line and "on the way" not in line for line in lines) == 1
    assert any("those joints fixed: (locked, " in line for line in lines)


def test_an_arm_that_one_cable_swings_to_its_stops_is_followed_in_few_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its cables are stiff, and nothing else is: without their direction hundreds were needed."""
    steps = list[float]()

    def counted(model: Any, here: Any, share: float) -> Any:
        steps.append(share)
        return next_on_piece(model, here, share)

    monkeypatch.setattr(continuation, "next_on_piece", counted)
    arm = cdsm.Manipulator(readme_geometry(joints=2), cdsm.RopeElasticity("7x7", 0.8e-3, 390.0))
    rest = cdsm.forward_statics(arm, pull={"cable1_1": 1e-3})
    assert rest.stiffness.is_stable
    assert abs(rest.residual).max() < 1e-8
    assert len(steps) < 100

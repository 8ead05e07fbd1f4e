"""Where motors that move several cables count: loads, cycles, batches, exports, and refusals."""

import json
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.statics.load_cycle import LoadHistory
from cdsm.support.values import Array
from tests.support.motors import BENT, changed, spooled

SOFT = cdsm.LinearElasticity(2e4)
DOWN = np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0])
RIGID: dict[str, object] = {"stiffness": np.inf}
TORQUE: dict[str, object] = {"control": "torque", "stiffness": np.inf}
NEEDED = "needs its own assembly at this posture: 8 motors for 12 cables"


def pulled(arm: cdsm.Manipulator, minimum: float = 60.0) -> tuple[cdsm.Posture, cdsm.Tension]:
    pose = arm.at(BENT)
    return pose, cdsm.distribute_tension(pose, minimum)


def test_batches_are_single_postures_also_with_cables_at_0_newton() -> None:
    for arm, minimum in ((spooled(20.0, SOFT), 60.0), (spooled(20.0, SOFT), 0.0)):
        q = np.array([s * BENT for s in (0.3, -0.2, 0.4)])
        poses = [arm.at(row) for row in q]
        F = np.array([cdsm.distribute_tension(pose, minimum).values for pose in poses])
        names = ("passive", "joint", "along", "compliance", "slack", "margin")
        batch = cdsm.evaluate(arm, q, F, outputs=names, direction=["z", "-z"])
        for i, pose in enumerate(poses):
            K = cdsm.stiffness(pose, F[i])
            size = abs(K.joint).max()
            np.testing.assert_allclose(batch["passive"][i], K.passive, rtol=0, atol=1e-12 * size)
            np.testing.assert_allclose(batch["joint"][i], K.joint, rtol=0, atol=1e-12 * size)
            np.testing.assert_allclose(batch["compliance"][i], K.compliance, rtol=1e-8, atol=1e-10)
            along = [K.along("z"), K.along("-z")]
            np.testing.assert_allclose(batch["along"][i], along, rtol=1e-9)
            assert bool(batch["slack"][i]) == bool(K.slack) == (minimum == 0.0)


def test_weight_and_load_cycle_end_at_the_equilibrium_of_motors_that_yield() -> None:
    for arm in (spooled(20.0), changed(spooled(20.0), {"m2b": TORQUE, "m3": RIGID})):
        pose, pull = pulled(arm)
        rest = cdsm.equilibrium(pose, pull, DOWN)
        test = cdsm.weight_test(pose, pull, DOWN[:3], steps=2)
        np.testing.assert_allclose(test.states[-1].pose.q, rest.pose.q, rtol=0, atol=1e-9)
        history = cdsm.load_cycle(pose, pull, [DOWN / 2.0, DOWN, 0.0 * DOWN])
        np.testing.assert_allclose(history.angles[1], rest.pose.q, rtol=0, atol=1e-8)
        np.testing.assert_allclose(history.angles[2], pose.q, rtol=0, atol=1e-8)
        K = history.stiffness(1)
        assert K.friction == "frictionless"
        np.testing.assert_allclose(K.tension, rest.tension, rtol=0, atol=1e-5)


def test_equilibrium_says_by_how_far_motors_yield() -> None:
    arm = spooled(20.0)
    pose, pull = pulled(arm)
    rest = cdsm.equilibrium(pose, pull, DOWN)
    B = arm.motors.matrix
    torque = B.T @ (rest.tension - pull.values)
    np.testing.assert_allclose(torque, -20.0 * rest.motor_turns, rtol=0, atol=1e-11)
    assert abs(np.rad2deg(abs(rest.motor_turns).max()) - 0.2) < 0.15
    assert "motors yield: m1 by " in str(rest)
    numbers: Any = json.loads(json.dumps(rest.to_dict()))
    assert list(numbers["motor_yield_rad"]) == list(arm.motors.names)
    rigid = cdsm.equilibrium(*pulled(spooled()), DOWN)
    assert not rigid.motor_turns.any()
    assert "motors yield" not in str(rigid)


def test_turns_of_motors_are_commands_of_a_load_cycle() -> None:
    arm = spooled(elasticity=SOFT)
    pose, pull = pulled(arm)
    turn = np.array([0.05, 0.0, -0.02, 0.0, 0.0, 0.03, 0.0, 0.0])
    history = cdsm.load_cycle(pose, pull, [0.0 * DOWN], motors=[turn])
    np.testing.assert_allclose(history.motors[0], arm.motors.matrix @ turn, rtol=0, atol=1e-15)
    plain = arm.with_motors([])
    F = cdsm.distribute_tension(plain.at(BENT), 60.0)
    wire = [arm.motors.matrix @ turn]
    same = cdsm.load_cycle(plain.at(BENT), F, [0.0 * DOWN], motors=wire)
    np.testing.assert_array_equal(history.angles, same.angles)
    with pytest.raises(cdsm.InvalidInput, match=r"motors: shape \(1, 12\) given, \(1, 8\) needed"):
        cdsm.load_cycle(pose, pull, [0.0 * DOWN], motors=wire)


def assembly_kept(arm: cdsm.Manipulator, history: LoadHistory, before: Array) -> float:
    """Largest change of Nᵀ l_0 in a history [m], of cables with one rest length each."""
    F = history.segment_tensions[:, history.reference.segments.chains.start[:-1]]
    worst = 0.0
    for k in range(len(F)):
        after = arm.laws.original_lengths(history.pose(k).cable_lengths, F[k])
        worst = max(worst, float(abs(arm.motors.fixed.T @ (after - before)).max()))
    return worst


def test_a_load_cycle_with_rigid_motors_keeps_the_assembly() -> None:
    arm = spooled(elasticity=SOFT)
    pose, pull = pulled(arm)
    before = arm.laws.original_lengths(pose.cable_lengths, pull.values)
    turns = np.array([[0.05, 0, -0.02, 0, 0, 0.03, 0, 0], [0, 0.02, 0, 0, 0, 0, 0.04, 0]])
    history = cdsm.load_cycle(pose, pull, [DOWN, DOWN / 2.0], motors=turns)
    assert assembly_kept(arm, history, before) < 1e-14
    free = cdsm.load_cycle(
        *pulled(arm.with_motors([])), [DOWN], motors=[np.linspace(0.0, 1e-4, 12)]
    )
    assert assembly_kept(arm, free, before) > 1e-6


def test_mujoco_model_of_rigid_motors_says_which_commands_belong_together() -> None:
    arm = spooled()
    pose, pull = pulled(arm)
    text = cdsm.to_mjcf(arm, pose, pull)
    plain = arm.with_motors([])
    alone = cdsm.to_mjcf(plain, plain.at(BENT), pull.values)
    line = next(line for line in text.splitlines() if "motors     8 motors" in line)
    assert "m1 (cable1_1 +12 mm, cable1_2 -12 mm): holds its angle" in line
    rest = [row for row in text.splitlines() if row != line]
    assert rest == alone.splitlines()
    with pytest.raises(cdsm.InvalidInput, match="m1, m1b, m2, m2b, and 4 more yields, and a model"):
        cdsm.to_mjcf(spooled(20.0), *pulled(spooled(20.0)))


def test_results_say_that_tensions_need_an_assembly_of_their_own() -> None:
    pose, pull = pulled(spooled())
    K = cdsm.stiffness(pose, pull)
    for result in (pull, K):
        assert any(NEEDED in warning for warning in result.warnings)
        assert NEEDED in str(result)
        numbers: Any = result.to_dict()
        assert any(NEEDED in warning for warning in numbers["warnings"])
    assert K.verdict.is_held
    assert K.verdict.word == "stable"
    assert "8 motors for 12 cables: m1 (cable1_1 +12 mm, cable1_2 -12 mm): holds" in str(K)
    assert not cdsm.stiffness(pose, pull.values).warnings  # tensions that somebody brings
    own = spooled().with_motors([])
    K = cdsm.stiffness(*pulled(own))
    assert not K.warnings
    assert "drives" not in K.to_dict()
    assert "motor" not in str(K)


def test_what_the_motors_are_stands_in_print_and_json() -> None:
    K = cdsm.stiffness(*pulled(changed(spooled(20.0), {"m2": TORQUE})))
    assert "holds its angle by 20 N m/rad" in str(K)
    assert "(frictionless, rigid links, motors that yield, tangent)" in str(K)
    drives: Any = K.to_dict()["drives"]
    assert drives["m1"] == {
        "cables_m_per_rad": {"cable1_1": 0.012, "cable1_2": -0.012},
        "stiffness_Nm_per_rad": 20.0,
        "control": "position",
    }
    assert drives["m2"]["stiffness_Nm_per_rad"] is None
    assert drives["m2"]["control"] == "torque"


def test_gradient_of_the_stiffness_knows_motors_that_yield() -> None:
    for arm in (spooled(20.0), changed(spooled(20.0), {"m2b": TORQUE})):
        pose, pull = pulled(arm)
        gradient = cdsm.stiffness_gradient(cdsm.stiffness(pose, pull))
        step = 1e-2
        for c in (0, 4, 10):
            e = step * np.eye(12)[c]
            up, down = (cdsm.stiffness(pose, pull.values + s * e) for s in (1.0, -1.0))
            size = abs(gradient.joint[c]).max()
            joint = (up.joint - down.joint) / (2.0 * step)
            assert abs(joint - gradient.joint[c]).max() < 1e-6 * size
            for value, slope in (
                ((up.along("z") - down.along("z")), gradient.along("z")[c]),
                ((up.margin - down.margin), gradient.margin[c]),
            ):
                assert abs(value / (2.0 * step) - slope) < 1e-5 * abs(slope) + 1e-7


SHARED = "tensions of 12 cables are not free: 8 motors move them"


def test_what_needs_free_tensions_is_refused_by_name() -> None:
    arm = spooled()
    pose = arm.at(BENT)
    force = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    calls = {
        "plan": lambda: cdsm.plan_stiffness(pose, "z", 4e3),
        "range": lambda: cdsm.stiffness_range(pose, "z", 10.0, 100.0),
        "path": lambda: cdsm.plan_path(arm, "z", 4e3, angles=[BENT, BENT]),
        "saturation": lambda: cdsm.saturation(pose, "z"),
        "force_polytope": lambda: cdsm.force_polytope(pose, 10.0, 100.0),
        "payload": lambda: cdsm.payload(pose, "-z", 10.0, 100.0),
        "critical_tension": lambda: cdsm.critical_tension(pose),
        "critical_load": lambda: cdsm.critical_load(pose, force),
        "tensions": lambda: cdsm.distribute_tensions(arm, [BENT]),
        "batch": lambda: cdsm.evaluate(arm, [BENT], minimum=10.0, outputs=("joint",)),
    }
    for name, call in calls.items():
        with pytest.raises(cdsm.InvalidInput, match=SHARED):
            call()
        assert name  # the one that fails is in the report of pytest
    plain = arm.with_motors([])
    plan = cdsm.plan_path(plain, "z", 3.4e3, 30.0, angles=[BENT, 0.9 * BENT])
    with pytest.raises(cdsm.InvalidInput, match=f"plant: {SHARED}"):
        cdsm.track(plan, plant=cdsm.QuasiStaticPlant(arm))


def one_by_one(stiffness: float) -> cdsm.Manipulator:
    """A motor of 12 mm for each cable."""
    plain = spooled().with_motors([])
    names = plain.cables.names
    return plain.with_motors([cdsm.Motor(f"m{c}", {c: 0.012}, stiffness) for c in names])


def test_a_motor_for_each_cable_leaves_tensions_free() -> None:
    arm = one_by_one(np.inf)
    plain = arm.with_motors([])
    for pose in (arm.at(BENT), plain.at(BENT)):
        assert not cdsm.distribute_tension(pose, 60.0).warnings
    found, expected = (cdsm.plan_stiffness(a.at(BENT), "z", 3.8e3, 50.0) for a in (arm, plain))
    np.testing.assert_array_equal(found.tension.values, expected.tension.values)
    with pytest.raises(cdsm.InvalidInput, match="yields, and plans know rigid motors only"):
        cdsm.plan_stiffness(one_by_one(20.0).at(BENT), "z", 3.8e3, 50.0)


def test_friction_with_motors_that_yield_is_refused_and_answered_with_rigid_ones() -> None:
    rough = spooled().with_friction(0.1)
    pose, pull = pulled(rough)
    plain = rough.with_motors([])
    F = cdsm.distribute_tension(plain.at(BENT), 60.0)
    K = cdsm.stuck_stiffness(pose, pull)
    np.testing.assert_array_equal(K.joint, cdsm.stuck_stiffness(plain.at(BENT), F).joint)
    test = cdsm.weight_test(pose, pull, DOWN[:3])
    same = cdsm.weight_test(plain.at(BENT), F, DOWN[:3])
    np.testing.assert_array_equal(test.displacement, same.displacement)
    soft = spooled(20.0).with_friction(0.1)
    pose, pull = pulled(soft)
    assert cdsm.stiffness(pose, pull).is_stable  # without friction, as its model says
    assert "without the friction" in cdsm.equilibrium(pose, pull).history
    for call in (
        lambda: cdsm.stuck_stiffness(pose, pull),
        lambda: cdsm.breakaway(pose, pull, "z"),
        lambda: cdsm.rest_band(pose, pull, "z"),
        lambda: cdsm.load_cycle(pose, pull, [DOWN]),
        lambda: cdsm.weight_test(pose, pull, DOWN[:3]),
    ):
        with pytest.raises(cdsm.InvalidInput, match=r"m1, m1b.* yields: friction in the holes"):
            call()


def test_an_arm_that_falls_since_a_motor_yields_is_told_so() -> None:
    K = cdsm.stiffness(*pulled(changed(spooled(), {"m1": TORQUE})))
    assert not K.is_stable
    assert "with rigid motors in place of m1 it would be stable" in K.warnings[0]
    assert cdsm.stiffness(*pulled(spooled())).is_stable
    weak = changed(spooled(elasticity=cdsm.LinearElasticity(300.0)), {"m1": TORQUE})
    K = cdsm.stiffness(*pulled(weak, 300.0))
    assert not K.is_stable
    assert "rigid motors" not in K.warnings[0]

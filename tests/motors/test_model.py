"""K_eff of motors that move several cables: closed forms, limits, and the Hessian of the energy."""

import numpy as np
import pytest

import cdsm
from cdsm.statics.equilibrium import settled
from cdsm.statics.locked_arm import LockedArm
from cdsm.support.values import Array
from cdsm.yielding import Yielding
from tests.support.motors import BENT, changed, pairs, spooled

RNG = np.random.default_rng(3)
SOFT = cdsm.LinearElasticity(2e4)
NO_LOAD = np.zeros(6)


def yielding(B: Array, k_m: Array) -> Yielding:
    return Yielding(tuple(map(str, range(B.shape[1]))), B, k_m)


@pytest.mark.parametrize(
    ("k_m", "expected"), [(0.0, 0.0), (5.0, 6.486486), (1e3, 23.680316), (1e12, 24.0)]
)
def test_pair_on_a_spool_turns_a_pulley_joint_as_springs_in_series(
    k_m: float, expected: float
) -> None:
    R, r, k = 0.02, 0.015, 3e4
    motors = yielding(np.array([[r], [-r]]), np.array([k_m]))
    J = np.array([[-R], [R]])
    K = (J.T @ motors.effective(np.array([k, k])) @ J)[0, 0]
    assert abs(K - 2.0 * k * R**2 * k_m / (k_m + 2.0 * k * r**2)) < 1e-12 * 24.0
    assert abs(K - expected) < 5e-7


def test_both_forms_of_the_stiffness_agree_and_torque_held_motors_take_it_away() -> None:
    k = RNG.uniform(1e4, 5e4, 12)
    B = RNG.normal(size=(12, 5)) * 0.01
    k_m = RNG.uniform(1.0, 10.0, 5)
    K = yielding(B, k_m).effective(k)
    other = np.linalg.inv(np.diag(1.0 / k) + B @ np.diag(1.0 / k_m) @ B.T)
    assert abs(K - other).max() < 1e-14 * abs(K).max()
    np.testing.assert_allclose(
        yielding(B, k_m).transmission(k) * k, K, rtol=0, atol=1e-13 * k.max()
    )
    held = yielding(B, np.zeros(5)).effective(k)
    assert abs(B.T @ held).max() < 1e-11  # of 500 N/rad
    nearly_rigid = yielding(B, np.full(5, 1e9)).effective(k)
    assert 1e-9 < abs(nearly_rigid - np.diag(k)).max() / k.max() < 1e-7
    own = np.eye(12)
    series = np.diag(1.0 / (1.0 / k + 1.0 / 2e4))
    assert abs(yielding(own, np.full(12, 2e4)).effective(k) - series).max() < 1e-10
    assert abs(yielding(own, np.zeros(12)).effective(k)).max() < 1e-10


def test_slope_of_the_stiffness_is_that_of_each_cable_through_the_transmission() -> None:
    arm = spooled(20.0)
    motors = arm.motors.yielding
    assert motors is not None
    k = RNG.uniform(1e4, 5e4, 12)
    d = 1e-5 * RNG.normal(size=12) * k
    P = motors.transmission(k)
    difference = (motors.effective(k + d) - motors.effective(k - d)) / 2.0
    slope = P @ np.diag(d) @ P.T
    assert abs(difference - slope).max() < 1e-10 * abs(slope).max()


def coupled(arm: cdsm.Manipulator) -> cdsm.Manipulator:
    """Six motors that each move all cables, by 5 N m/rad."""
    radii = np.random.default_rng(8).normal(size=(6, 12)) * 0.01
    return arm.with_motors(
        [
            cdsm.Motor(f"m{i}", dict(zip(arm.cables.names, row.tolist(), strict=True)), 5.0)
            for i, row in enumerate(radii, start=1)
        ]
    )


TORQUE: dict[str, object] = {"control": "torque", "stiffness": np.inf}
CASES = {
    "rigid": (spooled(), 12.50),
    "pairs": (spooled(20.0), 6.49),
    "coupled spools": (coupled(spooled()), None),
    "one torque": (changed(spooled(), {"m1": TORQUE}), -4.08),
    "all torques": (changed(spooled(), {f"m{j}": TORQUE for j in range(1, 5)}), -4.14),
    "mixed": (
        changed(
            spooled(),
            {
                "m1": TORQUE,
                "m1b": {"stiffness": 20.0},
                "m2b": {"stiffness": 20.0},
                "m3": TORQUE,
                "m4": {"stiffness": 5.0},
                "m4b": {"stiffness": 5.0},
            },
        ),
        -4.09,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_stiffness_is_the_derivative_of_the_torque(name: str) -> None:
    arm, lowest = CASES[name]
    pose = arm.at(BENT)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0))
    model = LockedArm(pose, K.tension, NO_LOAD)
    np.testing.assert_allclose(model.at_pose(pose).stiffness, K.joint, rtol=0, atol=1e-10)
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        columns = [
            (model.at(BENT + h * e).residual - model.at(BENT - h * e).residual) / (2.0 * h)
            for e in np.eye(8)
        ]
        errors.append(abs(np.array(columns).T - K.joint).max() / abs(K.joint).max())
    assert errors[-1] < 1e-4
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (abs(rates - 2.0) < 0.02).all()
    assert abs(K.joint - K.joint.T).max() < 1e-14 * abs(K.joint).max()
    if lowest is not None:
        assert abs(K.margin - lowest) < 0.005


def test_along_falls_as_motors_yield() -> None:
    along = {}
    for name in ("rigid", "pairs"):
        pose = CASES[name][0].at(BENT)
        along[name] = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0)).along("z")
    assert abs(along["rigid"] / 1e3 - 3.72) < 0.005
    assert abs(along["pairs"] / 1e3 - 2.57) < 0.005


def test_rigid_motors_give_the_bits_of_a_motor_for_each_cable() -> None:
    arm = spooled()
    plain = arm.with_motors([])
    pull = cdsm.distribute_tension(plain.at(BENT), 60.0)
    for other in (arm, arm.with_motors([cdsm.Motor("m", {"cable1_1": 1.0})])):
        again = cdsm.distribute_tension(other.at(BENT), 60.0)
        np.testing.assert_array_equal(again.values, pull.values)
        K = cdsm.stiffness(other.at(BENT), again)
        np.testing.assert_array_equal(K.joint, cdsm.stiffness(plain.at(BENT), pull).joint)
        rest = cdsm.equilibrium(other.at(BENT), again, (0.0, 0.0, -3.0, 0.0, 0.0, 0.0))
        np.testing.assert_array_equal(
            rest.pose.q, cdsm.equilibrium(plain.at(BENT), pull, rest.wrench).pose.q
        )
    np.testing.assert_array_equal(plain.motors.matrix, np.eye(12))
    assert plain.motors.names == plain.cables.names


def test_motor_per_cable_is_its_series_spring_and_a_torque_is_a_tension() -> None:
    plain = spooled(elasticity=SOFT).with_motors([])
    F = cdsm.distribute_tension(plain.at(BENT), 60.0).values
    radii = [(name, 0.01 * (i + 1)) for i, name in enumerate(plain.cables.names)]
    motors = [cdsm.Motor(f"m{name}", {name: r}, 4e3 * r**2) for name, r in radii]
    driven = plain.with_motors(motors)
    k = 1.0 / (1.0 / cdsm.stiffness(plain.at(BENT), F).cable_stiffness + 1.0 / 4e3)
    J = plain.at(BENT).length_jacobian
    K = cdsm.stiffness(driven.at(BENT), F)
    np.testing.assert_allclose(K.passive, (J.T * k) @ J, rtol=0, atol=1e-12 * K.passive.max())
    np.testing.assert_allclose(np.diag(K.motor_compliance), 1.0 / 4e3, rtol=1e-14)
    np.testing.assert_allclose(
        np.linalg.inv(np.diag(1.0 / K.cable_stiffness) + K.motor_compliance),
        K.wire_stiffness,
        rtol=1e-12,
        atol=1e-9,
    )
    torque = [cdsm.Motor(f"m{name}", {name: r}, control="torque") for name, r in radii]
    held = cdsm.stiffness(plain.with_motors(torque).at(BENT), F)
    assert abs(held.passive).max() < 1e-10  # of 40 N m/rad: as with control="force"
    assert np.isinf(np.diag(held.motor_compliance)).all()


def test_compliance_is_the_derivative_of_the_rest() -> None:
    pose = spooled(20.0).at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    C = cdsm.stiffness(pose, pull).compliance[:3, 2]
    errors = []
    for f in (0.4, 0.2, 0.1):
        up, down = (
            cdsm.equilibrium(pose, pull, (0.0, 0.0, s * f, 0.0, 0.0, 0.0)).pose.tip[:3, 3]
            for s in (1.0, -1.0)
        )
        errors.append(abs((up - down) / (2.0 * f) - C).max() / abs(C).max())
    assert errors[0] < 1e-5
    assert (abs(np.log2(np.divide(errors[:-1], errors[1:])) - 2.0) < 0.05).all()


@pytest.mark.parametrize("name", ["pairs", "mixed", "coupled spools"])
def test_energy_torque_and_stiffness_of_the_report_agree(name: str) -> None:
    pose = CASES[name][0].at(BENT)
    report = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0)).report()
    verdicts = {row.name: row.verdict for row in report.comparisons}
    assert {"passive", "joint", "passive torque", "batch"} <= verdicts.keys()
    assert set(verdicts.values()) == {"agrees"}


@pytest.mark.parametrize("name", ["rigid", "pairs"])
def test_shares_add_up(name: str) -> None:
    pose = CASES[name][0].at(BENT)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 60.0))
    for u in "xyz":
        assert abs(K.shares(u).total - K.along(u)) < 1e-10 * K.along(u)


def test_cables_at_0_newton_of_motors_that_yield_only_pull() -> None:
    """The one-sided stiffness is what the rest measures with a small force to each side."""
    pose = spooled(20.0, SOFT).at(0.3 * BENT)
    F = cdsm.distribute_tension(pose, 0.0).values.copy()
    K = cdsm.stiffness(pose, F)
    assert K.slack
    sides = []
    for u in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)):
        force = 1e-4 * np.array([*u, 0.0, 0.0, 0.0])
        model = LockedArm(pose, F, -K.residual @ np.linalg.pinv(pose.jacobian) * 0.0 + NO_LOAD)
        before = settled(model, pose).state.pose.tip[:3, 3]
        after = settled(model.under(force), pose).state.pose.tip[:3, 3]
        measured = 1e-4 / float((after - before) @ u)
        sides.append(K.along(u))
        assert abs(sides[-1] / measured - 1.0) < 1e-3
        shares = K.shares(u)
        assert abs(shares.total / sides[-1] - 1.0) < 1e-9
    assert abs(sides[0] / sides[1] - 1.0) > 1e-3


def test_arms_with_motors_are_equal_by_them_and_survive_pickling() -> None:
    import pickle

    arm = spooled(20.0)
    again = pickle.loads(pickle.dumps(arm))
    assert again == arm == spooled(20.0)
    assert again != spooled(21.0)
    assert again != arm.with_motors([])
    assert hash(arm.motors.given[0]) == hash(again.motors.given[0])
    np.testing.assert_array_equal(again.motors.matrix, arm.motors.matrix)
    assert pairs(arm)[0].cables == {"cable1_1": 0.012, "cable1_2": -0.012}

"""Motors that are fewer than cables: what they can hold, and where the arm comes to rest."""

import json
import warnings
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.statics.equilibrium import settled
from cdsm.statics.locked_arm import LockedArm
from cdsm.support.values import Array
from tests.support.motors import BENT, changed, spooled

SOFT = cdsm.LinearElasticity(2e4)
HALF = 0.5 * BENT
TORQUE: dict[str, object] = {"control": "torque", "stiffness": np.inf}


def assembled(arm: cdsm.Manipulator, minimum: float) -> Any:
    """The arm assembled straight, with the least tensions from ``minimum`` [N] on."""
    straight = arm.at(np.zeros(arm.nv))
    return arm.assemble(straight, cdsm.distribute_tension(straight, minimum))


def arms() -> dict[int, cdsm.Manipulator]:
    """Two cables of a joint on one spool: of all joints, of three of them, of none."""
    eight = spooled(elasticity=SOFT)
    return {8: eight, 9: eight.with_motors(eight.motors.given[:6]), 12: eight.with_motors([])}


EXPECTED = {
    (8, 5.0): (42.9, 127.0),
    (8, 30.0): (66.9, 153.5),
    (8, 60.0): (95.8, 185.2),
    (9, 5.0): (5.0, 126.3),
    (9, 30.0): (5.0, 152.3),
    (9, 60.0): (5.0, 183.5),
    (12, 5.0): (5.0, 17.1),
    (12, 60.0): (5.0, 17.1),
}


@pytest.mark.parametrize(("motors", "minimum"), EXPECTED)
def test_least_tensions_of_an_assembly(motors: int, minimum: float) -> None:
    arm = arms()[motors]
    assembly = assembled(arm, minimum)
    pose = arm.at(HALF)
    pull = cdsm.distribute_tension(pose, 5.0, assembly=assembly)
    assert len(arm.motors) == motors
    ends = pull.values.min(), pull.values.max()
    np.testing.assert_allclose(ends, EXPECTED[motors, minimum], rtol=0, atol=0.05)
    assert abs(pull.residual).max() < 1e-12
    after = arm.laws.original_lengths(pose.cable_lengths, pull.values)
    kept = arm.motors.fixed.T @ (after - assembly.free_lengths)
    assert abs(kept).max(initial=0.0) < 1e-15
    assert pull.commands is not None
    np.testing.assert_allclose(
        after, assembly.free_lengths - arm.motors.matrix @ pull.commands, rtol=0, atol=1e-15
    )
    assert not pull.warnings
    if motors == 12:
        free = cdsm.distribute_tension(pose, 5.0).values
        np.testing.assert_allclose(pull.values, free, rtol=0, atol=1e-9)


def test_tensions_of_an_assembly_are_the_least_ones() -> None:
    """No change of the commands that keeps balance and bounds lowers ‖F‖."""
    arm = arms()[9]
    assembly = assembled(arm, 30.0)
    pose = arm.at(HALF)
    pull = cdsm.distribute_tension(pose, 5.0, assembly=assembly)
    assert pull.commands is not None
    F, G = assembly.slopes(assembly.driven(pull.commands), pose.cable_lengths)
    np.testing.assert_array_equal(F, pull.values)
    step = 1e-6
    for m, e in enumerate(np.eye(9)):
        up, down = (
            assembly.slopes(assembly.driven(pull.commands + s * step * e), pose.cable_lengths)[0]
            for s in (1.0, -1.0)
        )
        np.testing.assert_allclose((up - down) / (2.0 * step), G[:, m], rtol=1e-6, atol=1e-2)
    _, _, basis = np.linalg.svd(pose.length_jacobian.T @ G)
    way = G @ basis[-1]  # 9 motors, 8 joints: one way is free
    assert abs(way @ pose.length_jacobian).max() < 1e-9 * abs(way).max()
    tight = pull.values < 5.0 + 1e-6
    better = -np.sign(way @ pull.values) * way
    assert tight.any()
    assert (better[tight] < 0.0).any()


@pytest.mark.parametrize("stiffness", [np.inf, 20.0])
@pytest.mark.parametrize("law", ["linear", "strand"])
def test_forward_statics_comes_to_rest_where_the_tensions_hold(stiffness: float, law: str) -> None:
    arm = spooled(stiffness) if law == "strand" else spooled(stiffness, SOFT)
    assembly = assembled(arm, 60.0)
    pull = cdsm.distribute_tension(arm.at(HALF), 5.0, assembly=assembly)
    assert pull.commands is not None
    rest = cdsm.forward_statics(arm, motors=pull.commands, assembly=assembly)
    np.testing.assert_allclose(rest.pose.q, HALF, rtol=0, atol=1e-10)
    np.testing.assert_allclose(rest.tension, pull.values, rtol=0, atol=1e-6)
    assert rest.stable
    np.testing.assert_array_equal(rest.reference_tension, assembly.tension)
    home = cdsm.forward_statics(arm, motors={}, assembly=assembly)
    np.testing.assert_allclose(home.pose.q, 0.0, rtol=0, atol=1e-12)
    named = dict(zip(arm.motors.names, pull.commands.tolist(), strict=True))
    again = cdsm.forward_statics(arm, motors=named, assembly=assembly)
    np.testing.assert_array_equal(again.pose.q, rest.pose.q)


def derivative(rest_at: Any, h: float) -> Array:
    """∂q/∂command (nv, M) by central differences of 8 motors."""
    columns = [(rest_at(h * e) - rest_at(-h * e)) / (2.0 * h) for e in np.eye(8)]
    return np.array(columns).T


@pytest.mark.parametrize("stiffness", [np.inf, 20.0])
def test_posture_follows_commands_as_the_formula_says(stiffness: float) -> None:
    """−K_θ⁻¹ J_Lᵀ P diag(k (1 + ε)) B, with P = 1 of rigid motors: differences at the rate h²."""
    arm = spooled(stiffness, SOFT)
    pose = arm.at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    assembly = arm.assemble(pose, pull)
    K = cdsm.stiffness(pose, pull)
    stretch = pose.cable_lengths / assembly.free_lengths
    driven = (K.cable_stiffness * stretch)[:, None] * arm.motors.matrix
    if arm.motors.yielding is not None:
        driven = arm.motors.yielding.transmission(K.cable_stiffness) @ driven
    expected = -np.linalg.solve(K.joint, pose.length_jacobian.T @ driven)

    def rest_at(turn: Array) -> Array:
        rest = cdsm.forward_statics(arm, motors=turn, assembly=assembly, start=BENT)
        return np.asarray(rest.pose.q)

    errors = [
        abs(derivative(rest_at, h) - expected).max() / abs(expected).max()
        for h in (2e-2, 1e-2, 5e-3)
    ]
    assert errors[-1] < 1e-4
    assert (abs(np.log2(np.divide(errors[:-1], errors[1:])) - 2.0) < 0.02).all()


def test_rest_lengths_are_commands_of_rigid_motors() -> None:
    arm = spooled(elasticity=SOFT)
    pose = arm.at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    assembly = arm.assemble(pose, pull)
    turn = np.array([0.02, -0.01, 0.0, 0.0, 0.01, 0.0, 0.0, 0.03])
    by_motors = cdsm.forward_statics(arm, motors=turn, assembly=assembly, start=BENT)
    lengths = assembly.free_lengths - arm.motors.matrix @ turn
    by_lengths = cdsm.forward_statics(arm, rest_lengths=lengths, start=BENT)
    np.testing.assert_allclose(by_motors.pose.q, by_lengths.pose.q, rtol=0, atol=1e-13)


def test_a_motor_takes_its_torque_as_command() -> None:
    arm = changed(spooled(20.0, SOFT), {"m2b": TORQUE})
    pose = arm.at(BENT)
    assembly = arm.assemble(pose, cdsm.distribute_tension(pose, 60.0))
    m = arm.motors.names.index("m2b")
    held = assembly.commands[m]
    assert abs(held - 0.012 * assembly.tension[5]) < 1e-12
    for torque in (held, 1.1 * held):
        rest = cdsm.forward_statics(arm, motors={"m2b": torque}, assembly=assembly)
        assert abs(0.012 * rest.tension[5] - torque) < 1e-11
    assert abs(rest.pose.q - BENT).max() > 1e-4
    model = LockedArm(pose, assembly.tension, np.zeros(6))
    here = settled(model, pose).state.pose.q  # held as it is: the same rest
    same = cdsm.forward_statics(arm, motors={}, assembly=assembly)
    np.testing.assert_allclose(same.pose.q, here, rtol=0, atol=1e-10)
    assert "m2b 0.79" in str(rest)
    numbers: Any = json.loads(json.dumps(rest.to_dict()))
    assert list(numbers["motor_torque_Nm"]) == ["m2b"]
    assert set(numbers["motor_turn_rad"]) == set(arm.motors.names) - {"m2b"}
    pull = cdsm.distribute_tension(arm.at(0.9 * BENT), 5.0, assembly=assembly)
    assert pull.commands is not None
    assert abs(pull.commands[m] - 0.012 * pull.values[5]) < 1e-11
    back = cdsm.forward_statics(arm, motors=pull.commands, assembly=assembly, start=0.9 * BENT)
    np.testing.assert_allclose(back.pose.q, 0.9 * BENT, rtol=0, atol=1e-10)


def test_motors_of_single_cables_take_wire_or_a_tension() -> None:
    plain = cdsm.Manipulator(spooled().geometry, SOFT)
    cables = [*plain.cables]
    cables[2] = cdsm.Cable(cables[2].name, cables[2].sites, SOFT, lead=0.3, control="force")
    arm = plain.with_cables(cables)
    pose = arm.at(HALF)
    pull = cdsm.distribute_tension(pose, 40.0)
    assembly = arm.assemble(pose, pull)
    np.testing.assert_allclose(assembly.commands[[2, 3]], [pull.values[2], 0.0])
    rest = cdsm.forward_statics(arm, motors={"cable1_3": 42.0, "cable1_1": 1e-4}, assembly=assembly)
    assert rest.tension[2] == 42.0
    wires = assembly.free_lengths.copy()
    wires[0] -= 1e-4
    assert abs(rest.stiffness.free_lengths[0] - wires[0]) < 1e-15
    numbers: Any = rest.to_dict()
    assert numbers["motor_tension_N"] == {"cable1_3": 42.0}
    assert numbers["motor_wire_m"]["cable1_1"] == 1e-4


def test_friction_follows_rigid_motors_from_the_assembly() -> None:
    arm = spooled(elasticity=SOFT).with_friction(0.05)
    assembly = assembled(arm, 60.0)
    turn = {"m1": 0.1, "m3": -0.05}
    rest = cdsm.forward_statics(arm, motors=turn, assembly=assembly)
    assert rest.path is not None
    assert rest.history.startswith("with friction: driven from even tensions in 8 steps; ")
    assert rest.to_dict()["motor_turn_rad"]["m1"] == 0.1  # type: ignore[index]
    smooth = cdsm.forward_statics(arm, motors=turn, assembly=assembly, friction=False)
    off = abs(rest.pose.q - smooth.pose.q).max()
    assert 1e-4 < off < 0.05
    nearly = spooled(elasticity=SOFT).with_friction(1e-6)
    close = cdsm.forward_statics(nearly, motors=turn, assembly=assembled(nearly, 60.0))
    assert abs(close.pose.q - smooth.pose.q).max() < 1e-3 * off
    soft = spooled(20.0, SOFT).with_friction(0.05)
    with pytest.raises(cdsm.InvalidInput, match=r"m1, m1b.* yields: friction in the holes"):
        cdsm.forward_statics(soft, motors=turn, assembly=assembled(soft, 60.0))
    cdsm.forward_statics(soft, motors=turn, assembly=assembled(soft, 60.0), friction=False)


def test_what_no_motor_can_give_is_said() -> None:
    arm = arms()[8]
    assembly = assembled(arm, 5.0)
    pose = arm.at(-BENT)
    wire = assembly.missing_wire(pose)
    assert abs(arm.motors.matrix.T @ wire).max() < 1e-16
    longer = pose.cable_lengths - assembly.posture.cable_lengths
    B = arm.motors.matrix
    left = longer - B @ np.linalg.lstsq(B, longer)[0]
    np.testing.assert_allclose(wire, left, rtol=0, atol=1e-15)
    with pytest.raises(cdsm.InfeasibleTension) as error:
        cdsm.distribute_tension(pose, 50.0, maximum=100.0, assembly=assembly)
    text = str(error.value)
    assert text.startswith("8 motors cannot hold this posture within the bounds of the tensions")
    assert "no motor can give the" in text
    assert "Assemble the arm at higher tensions" in text
    assert error.value.binding
    few = arm.with_motors([cdsm.Motor("all", dict.fromkeys(arm.cables.names[:6], 0.01))])
    assert len(few.motors) == 7
    with pytest.raises(cdsm.InvalidInput, match="7 motors cannot hold 8 joints at any posture"):
        cdsm.distribute_tension(few.at(HALF), 5.0, assembly=assembled(few, 60.0))


def test_bad_commands_and_assemblies_are_named() -> None:
    arm = changed(spooled(elasticity=SOFT), {"m1b": TORQUE})
    other = spooled()
    pose = arm.at(HALF)
    assembly = assembled(arm, 60.0)
    cases: list[tuple[Any, str]] = [
        (lambda: arm.assemble(other.at(HALF), np.ones(12)), "pose: is of another arm"),
        (
            lambda: arm.assemble(pose, -np.ones(12)),
            "tension: -1 N given for cable1_1; cables only pull",
        ),
        (lambda: arm.assemble(pose, np.ones(3)), "tension: shape"),
        (
            lambda: arm.assemble(pose, cdsm.distribute_tension(arm.at(0.0 * HALF), 5.0)),
            "tension: is of another posture",
        ),
        (
            lambda: cdsm.distribute_tension(other.at(HALF), 5.0, assembly=assembly),
            "assembly: is of another arm",
        ),
        (
            lambda: cdsm.distribute_tension(pose, 5.0, assembly=np.ones(3)),  # type: ignore[arg-type]
            "assembly: .* a Assembly is needed",
        ),
        (
            lambda: cdsm.forward_statics(arm, pull=np.zeros(12), motors={}, assembly=assembly),
            "give exactly one of tension, rest_lengths, pull, motors; pull and motors given",
        ),
        (
            lambda: cdsm.forward_statics(arm, pull=np.zeros(12)),
            "pull: m1b holds a torque, no length: give --motors with its torque, or, in Pyt",
        ),
        (
            lambda: cdsm.forward_statics(spooled(), pull={"cable1_1": 1e-3}),
            "pull: lengths of 12 cables are not free: 8 motors move them. .* give --motors,",
        ),
        (
            lambda: cdsm.forward_statics(arm, tension=np.ones(12)),
            "tension: tensions of 12 cables are not free: 8 motors move them. Give --motors, turns",
        ),
        (
            lambda: cdsm.forward_statics(other, rest_lengths=np.ones(12), assembly=assembly),
            "assembly: belongs to motors=, and rest_lengths is given",
        ),
        (
            lambda: cdsm.forward_statics(arm, motors={"cable1_1": 0.1}, assembly=assembly),
            "no motor is called 'cable1_1'.* A cable that shares a motor has none of its own",
        ),
        (
            lambda: cdsm.forward_statics(arm, motors={"m1b": -0.1}, assembly=assembly),
            "motors: -0.1 N m for m1b, whose cables only pull: 0 or more is possible",
        ),
        (
            lambda: cdsm.forward_statics(arm, motors={"m1": 50.0}, assembly=assembly),
            r"motors: leave -0\.2771 m of cable1_1, which is 0\.3229 m long\. Take in less, or",
        ),
        (
            lambda: cdsm.forward_statics(arm, motors=np.zeros(12), assembly=assembly),
            r"motors: shape \(12,\) given",
        ),
    ]
    for call, message in cases:
        with pytest.raises(cdsm.InvalidInput, match=message):
            call()


def test_turns_in_degrees_are_doubted() -> None:
    arm = spooled(elasticity=SOFT)
    assembly = assembled(arm, 60.0)
    commands = np.zeros(len(arm.motors))
    commands[2] = 15.0  # of 12 mm
    said = r"m2 turned by 15 rad moves 180 mm of cable2_1\. Degrees\? np\.deg2rad\(15\) is 0\.2618"
    with pytest.warns(cdsm.CdsmWarning, match=said):
        cdsm.forward_statics(arm, motors=commands, assembly=assembly)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cdsm.forward_statics(arm, motors={"m2": 0.2618}, assembly=assembly)
        thin = arm.with_motors([cdsm.Motor("worm", {"cable2_1": 0.0002, "cable2_2": -0.0002})])
        cdsm.forward_statics(thin, motors={"worm": 15.0}, assembly=assembled(thin, 60.0))


def test_an_assembly_prints_and_exports() -> None:
    assembly = assembled(spooled(elasticity=SOFT), 60.0)
    assert "8 motors for 12 cables" in str(assembly)
    numbers: Any = assembly.to_dict()
    assert list(numbers["free_lengths_m"]) == list(assembly.posture.arm.cables.names)
    pull = cdsm.distribute_tension(assembly.posture.arm.at(HALF), 5.0, assembly=assembly)
    assert "motors: m1 " in str(pull)
    exported: Any = pull.to_dict()
    assert list(exported["motor_turn_rad"]) == list(assembly.posture.arm.motors.names)
    assert not cdsm.stiffness(assembly.posture.arm.at(HALF), pull.values).warnings


def test_least_assembly_for_several_postures_is_the_root_of_one_number() -> None:
    """Five of 20 postures within 7° need 168 N at assembly for 5 N in each of 12 cables."""
    arm = arms()[8]
    draws = np.random.default_rng(7)
    postures = [arm.at(draws.uniform(-0.12, 0.12, 8)) for _ in range(20)]

    def feasible(minimum: float) -> bool:
        assembly = assembled(arm, minimum)
        for pose in postures:
            try:
                cdsm.distribute_tension(pose, 5.0, assembly=assembly)
            except cdsm.InfeasibleTension:
                return False
        return True

    assert not feasible(167.5)
    assert feasible(168.7)

"""Springs whose torque is no straight line: the laws alone, and arms that have them."""

import copy
import dataclasses
import pickle
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import cdsm
from cdsm.batch import solution
from cdsm.statics.locked_arm import LockedArm
from cdsm.support.values import Array
from tests.springs import test_coupling
from tests.support.arms import readme_geometry
from tests.support.differences import assert_second_order, central_difference, gravity_energy

DEGREES = np.deg2rad([5, 10, 15, 20, 25, 27, 30])
TORQUES = 1e-3 * np.array([41.5, 65.9, 83.0, 104.7, 129.1, 134.2, 147.5])  # of a measured hinge
POWER = cdsm.SpringLaw.power(stiffness=0.56, exponent=0.74, scale=np.deg2rad(2.0))
TABLE = cdsm.SpringLaw.table(DEGREES, TORQUES)


def arctan(x: Array) -> Array:
    return np.asarray(0.1 * np.arctan(5.0 * x))


FUNCTION = cdsm.SpringLaw.function(arctan)
LAWS = {
    "power": POWER,
    "stiffening": cdsm.SpringLaw.power(stiffness=0.9, exponent=1.5, scale=0.1),
    "table": TABLE,
    "two-sided": cdsm.SpringLaw.table([-0.3, -0.1, 0.0, 0.2, 0.3], [-0.2, -0.1, 0.0, 0.1, 0.3]),
    "function": FUNCTION,
    "given": cdsm.SpringLaw.function(
        arctan,
        lambda x: 0.5 / (1.0 + 25.0 * x**2),
        lambda x: 0.1 * x * np.arctan(5.0 * x) - 0.01 * np.log1p(25.0 * x**2),
    ),
    "moved": POWER.at_angle(0.1),
    "scaled": FUNCTION.scaled(3.0),
}
X = np.linspace(-0.7, 0.7, 2801)
SIZES: dict[str, Any] = {"link_length": 0.03, "base_length": 0.03, "disk_offset": 0.008}
SIZES |= {"hole_radius": 0.012, "joint_limit": np.deg2rad(29.4), "cables_per_joint": 2}


def hinges(stiffness: Any, joints: int = 4, **more: Any) -> cdsm.Manipulator:
    """Hinges that turn about different axes."""
    sizes = {"twist": 0.6, "spread": np.deg2rad(2.0), "link_mass": 0.01, **SIZES, **more}
    geometry = cdsm.Geometry.hinged(joints=joints, joint_stiffness=stiffness, **sizes)
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e4))


MIXED = hinges([POWER, 0.3, TABLE, FUNCTION], rest_angle=[0.0, 0.0, 0.02, 0.0])
Q = np.array([0.1, -0.2, 0.07, 0.3])


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_torque_is_the_slope_of_the_energy_and_stiffness_that_of_the_torque(
    law: cdsm.SpringLaw,
) -> None:
    h = 1e-5
    energy, torque = ((f(X + h) - f(X - h)) / (2.0 * h) for f in (law.energy, law.torque))
    assert abs(energy - law.torque(X)).max() < 1e-9 * abs(law.torque(X)).max() + 2e-10
    off = np.sort(abs(torque - law.stiffness(X)) / law.stiffness(X))
    assert off[-20] < 5e-8  # at the points of a table its tangent has corners
    assert off[-1] < (1e-3 if "table" in repr(law) else 5e-8)
    assert law.stiffness(X).min() > 0.0
    assert float(law.energy(law.angle)) == 0.0
    assert float(law.torque(law.angle)) == 0.0


def test_laws_of_one_side_are_odd_and_go_on_straight() -> None:
    for law in (POWER, TABLE, FUNCTION):
        np.testing.assert_allclose(law.torque(X), -law.torque(-X), rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(TABLE.torque(DEGREES), TORQUES, rtol=1e-14)
    end = TABLE.stiffness(DEGREES[-1])
    np.testing.assert_allclose(TABLE.stiffness([0.6, -0.7]), end, rtol=1e-14)
    flat = cdsm.SpringLaw.table([0.1, 0.2, 0.3], [0.1, 0.2, 0.201])  # PCHIP would end level
    np.testing.assert_allclose(flat.stiffness([0.3, 0.5]), 0.1 * 0.001 / 0.1, rtol=1e-9)
    below = cdsm.SpringLaw.table(-DEGREES[::-1], -TORQUES[::-1])
    np.testing.assert_allclose(below.torque(X), TABLE.torque(X), rtol=1e-13, atol=1e-17)


def test_the_tangent_at_rest_of_a_power_law_is_k_and_far_away_the_torque_is_a_power() -> None:
    assert float(POWER.stiffness(0.0)) == 0.56
    far = np.array([10.0, 20.0])
    assert np.log2(np.divide(*POWER.torque(far)[::-1])) == pytest.approx(0.74, abs=1e-5)


def test_exponent_one_is_a_number_to_the_last_digit() -> None:
    law = cdsm.SpringLaw.power(stiffness=0.3, exponent=1.0, scale=0.1, angle=0.05)
    one, other = hinges(law), hinges(0.3, rest_angle=0.05)
    F = np.linspace(5.0, 9.0, 8)
    K, linear = (cdsm.stiffness(arm.at(Q), F) for arm in (one, other))
    np.testing.assert_array_equal(K.joint, linear.joint)
    np.testing.assert_array_equal(K.residual, linear.residual)
    assert one.springs.energy(Q) == other.springs.energy(Q)
    names = ("joint", "along", "residual")
    a, b = (cdsm.evaluate(arm, Q[None], F, None, names, direction="z") for arm in (one, other))
    for name in names:
        np.testing.assert_array_equal(a[name], b[name])
    # and by its formulas
    np.testing.assert_allclose(law.torque(X), 0.3 * (X - 0.05), rtol=1e-15)
    np.testing.assert_allclose(law.stiffness(X), 0.3, rtol=1e-15)
    np.testing.assert_allclose(law.energy(X), 0.15 * (X - 0.05) ** 2, rtol=1e-14)


@pytest.mark.parametrize("name", ["power", "function", "moved", "two-sided"])
def test_stiffness_is_the_hessian_of_the_potential(name: str) -> None:
    """Of the energy of cables, weight, load and springs; also where joints follow others."""
    law = LAWS[name]
    for arm in (
        hinges(law),
        cdsm.Manipulator(
            readme_geometry(**SIZES, joints=3, joint_stiffness=law, coupled=True),
            cdsm.LinearElasticity(1e4),
        ),
    ):
        q = 0.12 + 0.15 * np.arange(arm.nv) / arm.nv
        pose = arm.at(q)
        F = np.linspace(5.0, 20.0, len(arm.cables))
        K = cdsm.stiffness(pose, F, [0.1, 0.2, -0.1, 0.0, 0.0, 0.0])

        def potential(q: Array, arm: Any = arm, pose: Any = pose, K: Any = K) -> Array:
            there = arm.at(q, check_limits=False)
            longer = there.cable_lengths - pose.cable_lengths
            cables = K.tension @ longer + 0.5 * K.cable_stiffness @ longer**2
            work = K.wrench[:3] @ there.tip[:3, 3]
            every = q if arm.body.coupling is None else np.tile(q, 3)
            springs = law.energy(every).sum()
            return np.array(cables + gravity_energy(there) - work + springs)

        assert_second_order(potential, K.joint, q, order=2, step=2.0**-9, tolerance=2e-6)
        assert {check.verdict for check in K.report().comparisons} == {"agrees"}
        assert any(K.springs.ravel() != 0.0)


def residual_of(model: LockedArm) -> Callable[[Array], Array]:
    return lambda q: model.at(q).residual


def test_thirteen_measured_hinges_under_one_tendon() -> None:
    """K against differences, at the rate 2; tips far from those of springs of the 25° secant."""
    sizes = {**SIZES, "joint_stiffness": POWER, "link_mass": 0.01, "twist": 0.0}
    geometry = cdsm.Geometry.hinged(joints=13, spread=np.deg2rad(2.0), **sizes)
    ends = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(1e4))[-2:]
    arm = cdsm.Manipulator(geometry, cables=ends, gravity=(9.81, 0, 0))
    secant = float(POWER.torque(np.deg2rad(25.0))) / np.deg2rad(25.0)
    linear = arm.with_springs(dict.fromkeys(arm.joint_names, secant))
    for F, apart, lowest in (([2.0, 0.0], 15.0, 0.399), ([6.0, 0.0], 34.1, 0.241)):
        rest = cdsm.forward_statics(arm, tension=F)
        model = LockedArm(rest.pose, np.array(F), np.zeros(6), tension_held=True)
        state = model.at(rest.pose.q)
        assert abs(state.residual).max() < 1e-12
        off = []
        for h in (4e-3, 2e-3, 1e-3):
            slope = central_difference(residual_of(model), rest.pose.q, h)
            off.append(abs(slope - state.stiffness).max())
        np.testing.assert_allclose(np.log2(np.divide(off[:-1], off[1:])), 2.0, atol=0.01)
        assert off[-1] < 5e-5 * abs(state.stiffness).max()
        other = cdsm.forward_statics(linear, tension=F)
        moved = 1e3 * np.linalg.norm(rest.pose.tip[:3, 3] - other.pose.tip[:3, 3])
        assert moved == pytest.approx(apart, abs=0.1)
        assert np.linalg.eigvalsh(state.stiffness)[0] == pytest.approx(lowest, abs=1e-3)


@pytest.mark.parametrize("outputs", [("joint", "along"), ("joint", "margin", "springs", "along")])
def test_a_batch_is_many_single_postures(outputs: tuple[str, ...]) -> None:
    robot = test_coupling.ARM.with_springs({"a": POWER, "b": TABLE.at_angle(0.1), "c": 0.5, "d": 1})
    rng = np.random.default_rng(0)
    for arm in (MIXED, robot):
        q = rng.uniform(-0.25, 0.25, (70, arm.nv))
        for kernels in (solution.numpy_kernels, solution.compiled_kernels):
            with pytest.MonkeyPatch.context() as patched:
                patched.setattr(solution, "choose_kernels", lambda *_, made=kernels: made())
                names = (*outputs, "tension", "residual")
                rows = cdsm.evaluate(arm, q, None, None, names, minimum=2.0, direction="z")
            for i in (0, 33, 69):
                pull = cdsm.distribute_tension(arm.at(q[i]), 2.0)
                K = cdsm.stiffness(arm.at(q[i]), pull)
                np.testing.assert_allclose(rows["tension"][i], pull.values, rtol=1e-9)
                assert rows["along"][i] == pytest.approx(K.along("z"), rel=1e-9)
                for name in {*outputs} - {"along"}:
                    value = getattr(K, name)
                    near = 1e-11 * np.max(abs(value))
                    np.testing.assert_allclose(rows[name][i], value, rtol=0.0, atol=near)


def test_followers_rest_where_their_springs_balance() -> None:
    springs: dict[str, Any] = {"a": POWER.at_angle(0.2), "b": TABLE, "c": 0.5, "d": (1.0, 0.3)}
    arm = test_coupling.ARM.with_springs(springs)
    rest = arm.springs.rest
    assert abs(arm.springs.torque(rest)[0]) < 1e-15
    assert rest[1] == pytest.approx(0.3)
    linear = test_coupling.ARM.with_springs(springs | {"a": (0.56, 0.2), "b": 0.5})
    assert abs(rest[0] - linear.springs.rest[0]) > 0.01
    alone = test_coupling.ARM.with_springs({"b": TABLE}).springs.rest
    np.testing.assert_allclose(alone, [-0.1 / 0.7, 0.0], atol=1e-15)
    # forward statics begin there
    home = cdsm.forward_statics(arm.with_gravity((0, 0, 0)), tension=np.zeros(5))
    np.testing.assert_allclose(home.pose.q, rest, atol=1e-12)


def test_files_copies_and_changes_keep_laws(tmp_path: Path) -> None:
    arm = hinges([POWER, 0.3, TABLE.at_angle(0.1), LAWS["two-sided"]])
    override = arm.with_springs({"joint1": TABLE, "joint2": POWER, "joint3": (0.2, 0.1)})
    for each in (arm, override):
        assert cdsm.Manipulator.read(each.write(tmp_path / "ARM.toml")) == each
        assert cdsm.Geometry.from_toml(each.geometry.to_toml()) == each.geometry
        for again in (pickle.loads(pickle.dumps(each)), copy.deepcopy(each)):
            assert again == each
            assert again.springs.energy(Q) == each.springs.energy(Q)
        assert each.with_gravity("-y").springs.given == each.springs.given
    assert arm != override
    assert cdsm.SpringLaw.power(**POWER.shape.arguments) == POWER
    assert POWER.at_angle(0.1) != POWER
    assert POWER.with_exponent(0.75) != POWER
    assert hash(TABLE) == hash(cdsm.SpringLaw.table(DEGREES, TORQUES))
    assert eval(repr(TABLE.at_angle(0.1)), {"SpringLaw": cdsm.SpringLaw}) == TABLE.at_angle(0.1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        POWER.angle = 1.0  # type: ignore[misc]
    # keys of a file, as people write them
    path = tmp_path / "ARM.toml"
    text = arm.with_springs({}).write(path).read_text(encoding="utf-8")
    table = text[text.index("[springs]") : text.index("[[geometry.joints]]")].partition("\n\n")[0]
    laws = "joint1 = {stiffness = 0.56, exponent = 0.74, scale = 0.035}\n"
    laws += "joint2 = {angles = [0.1, 0.2], torques = [0.05, 0.08]}"
    path.write_text(text.replace(table, f"[springs]\n{laws}"), encoding="utf-8")
    read = cdsm.Manipulator.read(path, changes={"springs": {"joint1": {"exponent": 0.5}}})
    assert read.springs.given["joint1"] == cdsm.SpringLaw.power(
        stiffness=0.56, exponent=0.5, scale=0.035
    )
    assert read.springs.given["joint2"] == cdsm.SpringLaw.table([0.1, 0.2], [0.05, 0.08])
    for key, value, said in (
        ("exponent", -1, r"springs\.joint1\.exponent: -1 given"),
        ("scales", 1, r"springs\.joint1\.scales: is not a key .* did you mean 'scale'"),
        ("stiffness", 0, r"springs\.joint1\.stiffness: 0 N m/rad given"),
    ):
        with pytest.raises(cdsm.FileError, match=said):
            cdsm.Manipulator.read(path, changes={"springs": {"joint1": {key: value}}})
    with pytest.raises(cdsm.FileError, match=r"springs\.joint2\.torques: .* they must rise"):
        cdsm.Manipulator.read(path, changes={"springs": {"joint2": {"torques": [0.05, 0.04]}}})


def test_a_function_stays_in_python(tmp_path: Path) -> None:
    for arm, named in (
        (hinges(FUNCTION), "joint 1"),
        (hinges(0.3).with_springs({"joint2": FUNCTION}), "joint2"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=f"{named}: .* Python code, which no file"):
            arm.write(tmp_path / "ARM.toml")
    assert pickle.loads(pickle.dumps(hinges(FUNCTION))) == hinges(FUNCTION)


def falling(x: Array) -> Array:
    return np.asarray(np.sin(4.0 * x))


BAD: tuple[tuple[Callable[[], Any], str], ...] = (
    (lambda: cdsm.SpringLaw.power(stiffness=1.0, exponent=0.0, scale=0.1), "exponent: 0 given"),
    (lambda: cdsm.SpringLaw.power(stiffness=1.0, exponent=-0.5, scale=0.1), "exponent: -0.5"),
    (lambda: cdsm.SpringLaw.power(stiffness=1.0, exponent=np.nan, scale=0.1), "exponent: nan"),
    (lambda: cdsm.SpringLaw.power(stiffness=0.0, exponent=0.5, scale=0.1), "stiffness: 0 N m"),
    (lambda: cdsm.SpringLaw.power(stiffness=1.0, exponent=0.5, scale=0.0), "scale: 0 given"),
    (lambda: cdsm.SpringLaw.table([0.1], [0.2]), "angles: 1 points beside rest"),
    (lambda: cdsm.SpringLaw.table([0.0, 0.1], [0.0, 0.2]), "angles: 1 points beside rest"),
    (lambda: cdsm.SpringLaw.table([0.2, 0.1], [0.1, 0.2]), "angles: 0.2 and then 0.1"),
    (lambda: cdsm.SpringLaw.table([0.1, 0.1], [0.1, 0.2]), "angles: 0.1 and then 0.1"),
    (lambda: cdsm.SpringLaw.table([0.1, 0.2], [0.2, 0.1]), "torques: 0.2 and then 0.1 .* rise"),
    (lambda: cdsm.SpringLaw.table([0.1, 0.2], [-0.2, 0.1]), "torques: -0.2 given at the angle 0"),
    (lambda: cdsm.SpringLaw.table([0.1, np.nan], [0.1, 0.2]), r"angles: entry \[1\] is nan"),
    (lambda: cdsm.SpringLaw.table([0.1, 0.2, 0.3], [0.1, 0.2]), "torques: shapes"),
    (lambda: cdsm.SpringLaw.function(3.0), "torque: 3.0 given"),  # type: ignore[arg-type]
    (lambda: cdsm.SpringLaw.function(lambda x: x + 1.0), "torque: .* 1 at rest"),
    (lambda: cdsm.SpringLaw.function(lambda x: 1.0), "torque: .* shape"),
    (lambda: cdsm.SpringLaw.function(lambda x: x / 0.0 * np.inf), "torque: "),
    (lambda: cdsm.SpringLaw.function(lambda x: x if x > 0 else -x), "use np.where"),
    (lambda: hinges(cdsm.SpringLaw.function(falling)), r"springs\['joint1'\]: .* does not rise"),
    (lambda: hinges(cdsm.SpringLaw.function(arctan, lambda x: 1.0 + 0.0 * x)), "stiffness adds up"),
    (lambda: hinges(cdsm.SpringLaw.function(arctan, None, lambda x: x**2)), "energy differs"),
    (lambda: hinges(POWER.at_angle(0.1), rest_angle=0.2), "rest_angle: 0.2 given beside a law"),
    (lambda: POWER.scaled(0.0), "factor: 0 given"),
    (lambda: TABLE.with_exponent(0.5), "exponent: .* has none"),
)


@pytest.mark.parametrize(("make", "said"), BAD)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_no_spring_is_named(make: Callable[[], Any], said: str) -> None:
    with pytest.raises((cdsm.InvalidInput, cdsm.GeometryError), match=said):
        make()


def test_angles_in_degrees_are_doubted() -> None:
    with pytest.warns(cdsm.CdsmWarning, match="looks as if it is in degrees"):
        cdsm.SpringLaw.power(stiffness=1.0, exponent=0.5, scale=2.0)
    with pytest.warns(cdsm.CdsmWarning, match="looks as if it is in degrees"):
        cdsm.SpringLaw.table([10.0, 20.0], [0.1, 0.2])


def test_a_tangent_that_no_point_tells_is_said() -> None:
    """Where a straight arm's stiffness is printed; bent beyond the points, nothing is said."""
    straight = cdsm.stiffness(hinges(POWER).at(np.zeros(4)), np.full(8, 5.0))
    said = "within 2° of rest, the scale of the law, which was given and not found: the tangent"
    assert any(said in text for text in straight.warnings)
    assert "0.56 N m/rad" in str(straight)
    table = cdsm.stiffness(hinges(TABLE).at(np.zeros(4)), np.full(8, 5.0))
    assert "within 5° of rest, the first point of the table" in str(table)
    assert "the first point of the table" in " ".join(str(table.report()).split())
    bent = cdsm.stiffness(hinges(POWER).at(np.full(4, 0.1)), np.full(8, 5.0))
    assert "of rest" not in str(bent)
    for quiet in (FUNCTION, LAWS["two-sided"], POWER.with_exponent(1.0)):
        K = cdsm.stiffness(hinges(quiet).at(np.zeros(4)), np.full(8, 5.0))
        assert "of rest" not in str(K)
    assert straight.verdict.status is cdsm.Status.UNBALANCED  # a note is no verdict


def test_mujoco_has_the_tangent_at_the_posture() -> None:
    """Its torque there and the slope of it are those of the law; beyond, those of the tangent."""
    pose = MIXED.at(Q)
    pull = cdsm.distribute_tension(pose, 2.0)
    text = cdsm.to_mjcf(MIXED, pose, pull)
    assert "joint1, joint3, joint4 have laws: in the model, stiffness and springref" in text
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for step in (0.0, 1e-3, 2e-3):
        data.qpos[:] = Q + step
        mujoco.mj_forward(model, data)
        off = abs(-data.qfrc_spring - MIXED.springs.torque(Q + step)).max()
        assert off <= max(1e-16, 40.0 * step**2)
    data.qpos[:] = Q
    mujoco.mj_forward(model, data)
    assert abs(data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator).max() < 1e-12
    assert "springs " not in cdsm.to_mjcf(hinges(0.3))


def test_uncertain_laws_are_laws_of_other_arms() -> None:
    """Relative torques by the batch, exponents by arms built anew."""
    arm = hinges(POWER)
    pull = cdsm.distribute_tension(arm.at(Q), 2.0)

    def along(law: cdsm.SpringLaw) -> float:
        return cdsm.stiffness(hinges(law).at(Q), pull.values).along("z")

    for name, change in (
        ("joint_stiffness", lambda x: POWER.scaled(1.0 + x)),
        ("exponent", lambda x: POWER.with_exponent(0.74 + x)),
    ):
        tolerances = cdsm.Tolerances(**{name: 0.05})
        budget = cdsm.uncertainty(arm.at(Q), pull, tolerances, direction="z")
        slope = abs(along(change(1e-4)) - along(change(-1e-4))) / 2e-4
        assert budget.standard_uncertainty == pytest.approx(0.05 * slope, rel=1e-4)
    drawn = cdsm.monte_carlo(
        arm.at(Q), pull, cdsm.Tolerances(joint_stiffness=0.05), direction="z", draws=500
    )
    assert drawn.standard_uncertainty == pytest.approx(
        0.05 * abs(along(POWER.scaled(1.0001)) - along(POWER.scaled(0.9999))) / 2e-4, rel=0.1
    )


def test_stiffness_and_exponent_are_found_from_measurements() -> None:
    truth = hinges(cdsm.SpringLaw.power(stiffness=0.7, exponent=0.6, scale=np.deg2rad(2.0)))
    poses = ([0.1, -0.2, 0.05, 0.3], [0.3, 0.2, -0.3, 0.1], [-0.1, 0.1, 0.1, -0.4])
    pull = tuple(np.full(8, 5.0).tolist())
    tests = []
    for q in poses:
        for u in ("y", "z"):
            k = cdsm.stiffness(truth.at(q), pull).along(u)
            tests.append(cdsm.Measurement(k, u, tuple(q), pull, std=1e-3 * k))
    model = cdsm.ArmParameters(hinges(POWER), ("joint_stiffness", "exponent"))
    assert model.present == {"joint_stiffness": 0.56, "exponent": 0.74}
    free = {"joint_stiffness": (0.2, 2.0), "exponent": (0.3, 1.5)}
    found = cdsm.identify(model, tests, free, progress=False)
    np.testing.assert_allclose(found.values, [0.7, 0.6], rtol=1e-4)
    softer = cdsm.ArmParameters(hinges(TABLE), ("joint_stiffness",))
    k = softer.present["joint_stiffness"]
    twice = softer(joint_stiffness=2.0 * k)
    np.testing.assert_allclose(twice.springs.torque(Q), 2.0 * hinges(TABLE).springs.torque(Q))
    with pytest.raises(cdsm.InvalidInput, match=r"exponent: .* no joints there whose spring is"):
        cdsm.ArmParameters(hinges(TABLE), ("exponent",))


def test_friction_weights_and_modes_know_laws() -> None:
    arm = hinges(POWER, lead=0.1)
    F = np.array([6.0, 3.0, 6.0, 3.0, 6.0, 3.0, 6.0, 3.0])
    free = cdsm.forward_statics(arm, tension=F, wrench=[0, 0, -0.2, 0, 0, 0])
    apart = []
    for mu in (0.004, 0.002):
        rough = cdsm.forward_statics(arm.with_friction(mu), tension=F, wrench=[0, 0, -0.2, 0, 0, 0])
        apart.append(np.linalg.norm(rough.pose.tip[:3, 3] - free.pose.tip[:3, 3]))
    assert apart[1] < 0.7 * apart[0] < 1e-3
    assert abs(free.residual).max() < 1e-10
    pull = cdsm.distribute_tension(arm.at(Q), 3.0)
    K = cdsm.stiffness(arm.at(Q), pull)
    light = cdsm.weight_test(arm.at(Q), pull, [0, 0, -1e-4, 0, 0, 0][:3])
    assert light.stiffness == pytest.approx(K.along("z"), rel=1e-4)
    M = arm.body.mass_matrix(Q)
    expected = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K.joint)).real.min()) / (2 * np.pi)
    assert cdsm.modes(K).frequencies[0] == pytest.approx(expected)


def test_an_arm_that_its_laws_do_not_hold_is_told_the_tangent_at_rest() -> None:
    """Not that of the linear spring: at rest a law with a small scale is stiff."""
    weak = cdsm.SpringLaw.power(stiffness=1e-3, exponent=0.5, scale=0.01)
    with pytest.raises(cdsm.EquilibriumError, match=r"from the 0\.001 N m/rad of the springs"):
        cdsm.forward_statics(
            hinges(weak, joints=1, link_mass=1.0).with_gravity("-x"), tension=np.zeros(2)
        )


WRENCHES: tuple[Any, ...] = ([0, 0, -0.3, 0, 0, 0], {"link2": [0, 0, -0.4, 0, 0, 0]})


@pytest.mark.parametrize("wrench", WRENCHES)
@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("coupled", [False, True])
def test_laws_with_friction_loads_on_links_and_followers(
    coupled: bool, friction: float, wrench: Any
) -> None:
    """Each answers, or is refused by name."""
    sizes = {**SIZES, "joints": 3, "cables_per_joint": 3, "link_mass": 0.05, "lead": 0.05}
    geometry = readme_geometry(**sizes, joint_stiffness=POWER, coupled=coupled)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e4)).with_friction(friction)
    F = np.full(len(arm.cables), 3.0)
    F[0] = 5.0
    rest = cdsm.forward_statics(arm, tension=F, wrench=wrench)
    assert rest.verdict.is_firm
    assert rest.verdict.status is not cdsm.Status.UNBALANCED
    # the laws are in its K_θ: three joints follow each angle
    alike = 3.0 if coupled else 1.0
    expected = alike * np.diag(POWER.stiffness(rest.pose.q))
    np.testing.assert_allclose(rest.stiffness.springs, expected, rtol=1e-12)
    bare = arm.with_springs({}).at(rest.pose.q, check_limits=False)
    here = cdsm.stiffness(rest.pose, F, wrench)
    torque = here.residual - cdsm.stiffness(bare, F, wrench).residual
    np.testing.assert_allclose(torque, alike * POWER.torque(rest.pose.q), atol=1e-13)
    if not isinstance(wrench, dict):
        rows = cdsm.evaluate(arm, rest.pose.q[None], F, wrench, ("joint",), check_limits=False)
        near = 1e-11 * abs(here.joint).max()
        np.testing.assert_allclose(rows["joint"][0], here.joint, rtol=0.0, atol=near)
    with pytest.raises(cdsm.InvalidInput, match="history") if friction else nullcontext():
        again = cdsm.forward_statics(arm, tension=F, wrench=wrench, start=rest.pose.q)
        np.testing.assert_allclose(again.pose.q, rest.pose.q, atol=1e-9)


def test_designs_and_plans_take_laws() -> None:
    arm = hinges(POWER, joints=3)
    pose = arm.at(Q[:3])
    problem = cdsm.DesignProblem(
        arm=arm,
        variables=[cdsm.Variable("exponent", 0.5, 1.5), cdsm.Variable("joint_stiffness", 0.2, 2.0)],
        objectives=[cdsm.Objective("along", direction="z")],
        postures=[pose.q],
    )
    law = cdsm.SpringLaw.power(stiffness=0.9, exponent=1.2, scale=np.deg2rad(2.0))
    made = problem.arm_of([1.2, 0.9]).springs.given["joint2"]
    assert isinstance(made, cdsm.SpringLaw)
    np.testing.assert_allclose(made.torque(X), law.torque(X), rtol=1e-12)
    assert problem.start == pytest.approx([0.74, 0.56])
    span = cdsm.stiffness_range(pose, "z", 2.0, 60.0)
    target = (span.low + span.high) / 2.0
    plan = cdsm.plan_stiffness(pose, "z", target, 2.0, 60.0)
    K = cdsm.stiffness(pose, plan.tension)
    assert K.along("z") == pytest.approx(target, rel=1e-6)
    assert abs(K.residual).max() < 1e-10

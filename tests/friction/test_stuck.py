"""Stuck and sliding stiffness, against potentials and torques made from lengths alone."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import brentq

import cdsm
from cdsm import presets
from cdsm.friction.capstan import assemble_segments
from cdsm.paper import law_of_stretched_length
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order, gravity_energy
from tests.support.rough import blocks, rough, segment_lengths

EA = 226e3
LAW = cdsm.LinearElasticity(EA)
ARMS = ["universal-1", "universal-3", "hinged-4", "mixed"]
SPRING = 3e4
SOFT = 5e3
"""EA [N] where tensions have to stay positive over the steps of differences."""


def plain_arm(name: str) -> cdsm.Manipulator:
    kind, _, joints = name.partition("-")
    return arms.mixed_arm() if kind == "mixed" else arms.random_arm(3, int(joints), kind)


def posed(name: str, friction: Any, **changes: Any) -> tuple[cdsm.Posture, Array, Array]:
    """A posture, tensions and a force of an arm with friction."""
    arm = rough(plain_arm(name), friction, **{"elasticity": LAW, **changes})
    return arms.random_posture(arm, 11), arms.random_tension(arm, 4), arms.random_wrench(4, False)


def some(c: int, i: int) -> float:
    """Friction in two of three holes."""
    return 0.0 if (c + i) % 3 == 0 else 0.1


def everywhere(c: int, i: int) -> float:
    return 0.1


def sliding(pose: cdsm.Posture, F: Array, signs: ArrayLike, wrench: Array) -> cdsm.Stiffness:
    """Stiffness while cables slide where a sign is not 0; F (C,) [N] are the motors' tensions.

    The tension beyond such a hole is that before it times exp(±μ φ).
    """
    chains = pose.segments.chains
    steps = np.zeros(len(chains.segments))
    steps[chains.hole + 1] = np.asarray(signs) * pose.segments.grip
    total = np.cumsum(steps)
    T = (F * np.exp(-total[chains.start[:-1]]))[chains.cable] * np.exp(total)
    return assemble_segments(pose, T, np.asarray(signs) != 0, wrench, "sliding")


@pytest.mark.parametrize("friction", [everywhere, some])
@pytest.mark.parametrize("name", ARMS)
def test_stuck_stiffness_is_the_hessian_of_clamped_segments(name: str, friction: Any) -> None:
    """Each block of segments without friction between them is a spring clamped at its ends."""
    pose, F, wrench = posed(name, friction, series_stiffness=SPRING)
    K = cdsm.stuck_stiffness(pose, F, wrench)
    cable = pose.segments.chains.cable
    parts = blocks(pose.arm, lambda c, i: friction(c, i) == 0.0)
    start = segment_lengths(pose)

    def total(q: Array) -> Array:
        moved = pose.arm.at(q, check_limits=False)
        lengths, energy = segment_lengths(moved), 0.0
        for block in parts:
            tension, L0 = F[cable[block[0]]], start[block].sum()
            first = block[0] == 0 or cable[block[0] - 1] != cable[block[0]]
            soft = 1.0 / SPRING if first else 0.0
            rest = (L0 - tension * soft) / (1.0 + tension / EA)
            k = 1.0 / (rest / EA + soft)
            longer = lengths[block].sum() - L0
            energy += tension * longer + k * longer**2 / 2.0
        return np.array(energy + gravity_energy(moved) - wrench[:3] @ moved.tip[:3, 3])

    assert_second_order(total, K.joint, pose.q, order=2, step=2.0**-6, size=100.0, tolerance=5e-9)
    np.testing.assert_array_equal(K.joint, K.active + K.passive + K.gravity + K.load)
    np.testing.assert_allclose(K.joint, K.joint.T, rtol=0.0, atol=1e-14 * abs(K.joint).max())


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("control", ["position", "force"])
def test_without_friction_it_is_the_frictionless_stiffness(name: str, control: str) -> None:
    pose, F, wrench = posed(name, 0.0, control=control, series_stiffness=SPRING)
    wrench = arms.random_wrench(4)
    expected = cdsm.stiffness(pose, F, wrench)
    for found in (
        cdsm.stuck_stiffness(pose, F, wrench),
        sliding(pose, F, np.ones(len(pose.segments.wrap)), wrench),
    ):
        size = abs(expected.joint).max()
        for term in ("active", "passive", "gravity", "load", "joint"):
            np.testing.assert_allclose(
                getattr(found, term), getattr(expected, term), rtol=0, atol=1e-13 * size
            )
        np.testing.assert_array_equal(found.tension, expected.tension)
        np.testing.assert_allclose(found.residual, expected.residual, atol=1e-12)
        assert found.along("z") == pytest.approx(expected.along("z"), rel=1e-10)


@pytest.mark.parametrize("control", ["position", "force"])
@pytest.mark.parametrize("name", ["universal-3", "hinged-4", "mixed"])
def test_sliding_stiffness_is_the_derivative_of_the_torque(name: str, control: str) -> None:
    """The tensions at each posture come from one equation per block: no wire is lost."""
    soft_law = cdsm.LinearElasticity(SOFT)
    pose, F, wrench = posed(
        name, 0.15, control=control, series_stiffness=SPRING, elasticity=soft_law
    )
    chains = pose.segments.chains
    rng = np.random.default_rng(8)
    signs = rng.integers(-1, 2, len(chains.hole))
    holes = zip(chains.cable[chains.hole].tolist(), chains.site.tolist(), strict=True)
    by_site = dict(zip(holes, signs.tolist(), strict=True))
    parts = blocks(pose.arm, lambda c, i: by_site[c, i] != 0)
    K = sliding(pose, F, signs, wrench)
    assert K.segment_tension is not None
    soft = np.zeros(len(chains.cable))
    soft[np.flatnonzero(np.diff(chains.cable, prepend=-1))] = 1.0 / SPRING

    def natural(lengths: Array, tension: Array) -> Array:
        return np.asarray((lengths - soft * tension) / (1.0 + tension / SOFT))

    held = natural(segment_lengths(pose), K.segment_tension)
    before = dict(zip(chains.hole + 1, range(len(chains.hole)), strict=True))

    def torque(q: Array) -> Array:
        moved = pose.arm.at(q, check_limits=False)
        segments, lengths = moved.segments, segment_lengths(moved)
        T = np.empty(len(lengths))
        for block in parts:
            holes = [before[s] for s in block[1:]]
            steps = 0.15 * signs[holes] * segments.wrap[holes]
            ratio = np.exp(np.cumsum(np.insert(steps, 0, 0.0)))

            def lost(first: float, block: list[int] = block, ratio: Array = ratio) -> float:
                T[block] = first * ratio
                return float((natural(lengths, T)[block] - held[block]).sum())

            at = K.segment_tension[block[0]]  # type: ignore[index]
            if control == "force" and soft[block[0]]:
                T[block] = at * ratio
            else:
                lost(brentq(lost, 0.2 * at, 5.0 * at, xtol=1e-14, rtol=1e-15))
        torque = T @ segments.length_jacobian + moved.gravity_torque - moved.jacobian.T @ wrench
        return np.asarray(torque)

    assert_second_order(torque, K.joint, pose.q, step=2.0**-11, size=10.0, tolerance=1e-8)
    np.testing.assert_allclose(K.residual, torque(pose.q), atol=1e-12)
    assert abs(K.passive - K.passive.T).max() > 1e-4 * abs(K.passive).max()
    shares = K.shares("y")
    assert shares.total == pytest.approx(K.along("y"), rel=1e-10)


@pytest.mark.parametrize(
    "seeds",
    [range(60), pytest.param(range(20_000), marks=pytest.mark.long)],
    ids=["few", "many"],
)
def test_stuck_arms_are_never_softer(seeds: range) -> None:
    """By Cauchy and Schwarz K_stuck − K is positive semidefinite for every arm."""
    for seed in seeds:
        rng = np.random.default_rng([seed, 19])
        joints, kind = int(rng.integers(1, 6)), ("universal", "hinged")[seed % 2]
        plain = arms.random_arm(seed, joints, kind, (LAW, presets.STRAND_1X19)[seed % 5 == 0])
        mu = rng.uniform(-0.2, 0.5, (len(plain.cables), 20)).round(3).clip(0.0)
        arm = rough(
            plain,
            lambda c, i, mu=mu: float(mu[c, i]),
            series_stiffness=10.0 ** rng.uniform(3.5, 6.0) if seed % 3 else np.inf,
            control="force" if seed % 7 == 0 else "position",
        )
        pose = arm.at(rng.uniform(-0.9, 0.9, arm.nv) * arm.upper)
        F = rng.uniform(5.0, 300.0, len(arm.cables))
        stuck = cdsm.stuck_stiffness(pose, F).joint
        values = np.linalg.eigvalsh(stuck - cdsm.stiffness(pose, F).joint)
        assert values[0] >= -1e-12 * np.linalg.norm(stuck, 2), seed


def test_lead_and_motor_control_do_not_count_while_cables_stick() -> None:
    F = np.linspace(40.0, 120.0, 15)
    poses = [arms.prototype(LAW, lead=lead, friction=0.1)[0] for lead in (0.0, 0.1, 0.3)]
    forced = [replace(c, control="force", series_stiffness=1e3) for c in poses[-1].arm.cables]
    poses += [poses[-1].arm.with_cables(forced).at(poses[-1].q)]
    K, *others = [cdsm.stuck_stiffness(pose, F).joint for pose in poses]
    for other in others:
        np.testing.assert_allclose(other, K, rtol=1e-12, atol=1e-12 * abs(K).max())


STUCK_POSE, STUCK_F, _ = posed("mixed", 0.1)
STRAND_POSE, _, _ = posed("mixed", 0.1, elasticity=presets.STRAND_1X19)
ASKED: dict[str, Any] = {
    "stuck_stiffness": cdsm.stuck_stiffness,
    "breakaway": lambda pose, F: cdsm.breakaway(pose, F, "z"),
    "rest_band": lambda pose, F: cdsm.rest_band(pose, F, "z"),
}


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize(
    ("pose", "tension", "error", "said"),
    [
        (3, STUCK_F, cdsm.InvalidInput, "pose: 3 given"),
        (STUCK_POSE, [1.0, 2.0], cdsm.InvalidInput, r"tension: shape \(2,\)"),
        (STUCK_POSE, -STUCK_F, cdsm.InvalidInput, "given for cable1_1; cables only pull"),
        (STRAND_POSE, 0.0 * STUCK_F + 0.5, cdsm.ElasticityRangeError, "cable1_1"),
    ],
)
def test_bad_input_is_named(
    asked: str, pose: Any, tension: Any, error: type[cdsm.CdsmError], said: str
) -> None:
    with pytest.raises(error, match=said):
        ASKED[asked](pose, tension)


def test_what_needs_the_frictionless_stiffness_and_no_direction_are_refused() -> None:
    for use in (cdsm.stiffness_gradient, cdsm.Stiffness.report):
        with pytest.raises(cdsm.InvalidInput, match="cables are stuck; give a frictionless K"):
            use(cdsm.stuck_stiffness(STUCK_POSE, STUCK_F))
    for ask in (cdsm.breakaway, cdsm.rest_band):
        with pytest.raises(cdsm.InvalidInput, match="direction: is the zero vector"):
            ask(STUCK_POSE, STUCK_F, (0.0, 0.0, 0.0))


NUMBERS = {
    # lead, bound, law: frictionless and stuck along x, y, z [N/mm]
    (0.0, 15.0): ((11.2, 11.4, 12.0), (25.8, 25.5, 26.0)),
    (0.0, 50.0): ((52.8, 52.4, 55.5), (109.0, 98.5, 103.0)),
    (0.0, 120.0): ((95.5, 93.8, 98.8), (196.0, 174.0, 181.0)),
    (0.3, 50.0): ((15.4, 12.9, 14.3), (109.0, 98.5, 103.0)),
}


@pytest.mark.parametrize("case", NUMBERS)
def test_numbers_of_the_virtual_prototype(case: tuple[float, float]) -> None:
    """An independent program, with the stretched length and another member of Eq. 19's family.

    At 15 N the two laws differ by 0.7 %; the original lengths raise all numbers by 3 to 4 %.
    """
    lead, bound = case
    strand = presets.STRAND_1X19
    for law, off in ((law_of_stretched_length(strand), 0.014), (strand, 0.05)):
        arm = presets.virtual_prototype(law, lead=lead, friction=0.1)
        pose = arm.at(np.full(10, np.deg2rad(10.0)))
        pull = cdsm.distribute_tension(pose, minimum=bound)
        free, stuck = cdsm.stiffness(pose, pull), cdsm.stuck_stiffness(pose, pull)
        for K, expected in zip((free, stuck), NUMBERS[case], strict=True):
            found = [K.along(axis) / 1000.0 for axis in "xyz"]
            np.testing.assert_allclose(found, expected, rtol=off)

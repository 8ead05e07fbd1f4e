"""Cables that stick and slide on pulleys and in sheaths: capstan, torques by hand, derivatives."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Sheath, Site
from cdsm.friction.capstan_kernels import Wire, solve_chains
from cdsm.support.values import Array
from tests.support.pulleys import Link, arm_of, finger

EA = 2e4
WIRE = cdsm.LinearElasticity(EA)
PLANAR = [
    Link("l1", "base", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Link("l2", "l1", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0)),
]
MU = 0.2
FIRST = Pulley("l1", (0.0, 0.0, 0.0), (0.0, -1.0, 0.0), 0.008, friction=MU)
SECOND = Pulley("l1", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0), 0.006, friction=MU)
TWO = [Site("base", (0.0, 0.0, 0.004)), FIRST, SECOND, Site("l2", (0.02, 0.0, -0.003))]


def _rough_finger(mu: float) -> cdsm.Manipulator:
    """The finger beside its planes, with friction in all holes and on all pulleys."""
    arm = finger(plane=False).with_friction(mu)
    return arm.with_cables(
        [
            replace(
                cable,
                sites=tuple(
                    replace(element, friction=mu) if isinstance(element, Pulley) else element
                    for element in cable.sites
                ),
            )
            for cable in arm.cables
        ]
    )


@pytest.mark.parametrize("turns", [0, 1])
@pytest.mark.parametrize("angle", [30.0, 90.0, 180.0, 260.0])
def test_a_post_holds_what_a_capstan_holds(angle: float, turns: int) -> None:
    """T₂/T₁ = e^{μβ} for β from 30° to 620°, whole turns included."""
    hinge = [Link("phalanx", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    post = Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.006, turns=turns, friction=0.15)
    path = [Site("base", (-0.03, -0.006, 0.0)), post, Site("phalanx", (0.03, -0.006, 0.0))]
    segments = arm_of(hinge, path).at(np.deg2rad([angle])).segments
    held = np.prod(segments.ratio)
    assert held == pytest.approx(np.exp(0.15 * (np.deg2rad(angle) + 2.0 * np.pi * turns)))


def test_a_bearing_holds_less_than_a_post() -> None:
    """ln(T₂/T₁) = 2 atanh(ρ sin(Φ/2)), with ρ = μ_bearing r_bearing/r."""
    hinge = [Link("phalanx", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
    pulley = Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.006, bearing=0.05)
    path = [Site("base", (-0.03, -0.006, 0.0)), pulley, Site("phalanx", (0.03, -0.006, 0.0))]
    arm = arm_of(hinge, path)
    for angle in (45.0, 90.0, 180.0, 220.0):
        segments = arm.at(np.deg2rad([angle])).segments
        half = np.deg2rad(angle) / 2.0
        assert np.log(segments.ratio[0]) == pytest.approx(2.0 * np.arctanh(0.05 * np.sin(half)))
        ahead, behind = (arm.at(np.deg2rad([angle]) + h).segments.grip for h in (1e-6, -1e-6))
        slope = segments.chains.friction * segments.wrap_jacobian[:, 0]
        assert slope == pytest.approx((ahead - behind) / 2e-6, abs=1e-8)


def test_unequal_tensions_turn_the_link_of_a_post() -> None:
    """Torque of the free pieces on the links behind each joint, summed by hand."""
    arm = arm_of(PLANAR, TWO, elasticity=WIRE)
    pose = arm.at([0.4, -0.5])
    segments = pose.segments
    np.testing.assert_allclose(np.rad2deg(pose.wraps.angle), [39.3, 24.96], atol=0.01)
    T = 10.0 * np.exp(-np.append(0.0, np.cumsum(segments.grip)))
    np.testing.assert_allclose(T, [10.0, 8.718, 7.991], atol=1e-3)
    torque = -T @ segments.length_jacobian
    np.testing.assert_allclose(torque, [0.08, -0.04794362], rtol=0.0, atol=1e-8)
    smooth = -10.0 * pose.length_jacobian[0]
    np.testing.assert_allclose(smooth, [0.08, -0.06], rtol=0.0, atol=1e-12)


def _steps(arm: cdsm.Manipulator, q: Array, value: Any) -> Array:
    h = 1e-6
    columns = [
        (value(arm.at(q + e).segments) - value(arm.at(q - e).segments)) / (2.0 * h)
        for e in h * np.eye(arm.nv)
    ]
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("abduction", [0.0, 8.0])
def test_segments_add_up_and_have_the_derivatives_of_their_differences(abduction: float) -> None:
    arm = _rough_finger(0.1)
    q = np.deg2rad([abduction, 12.0, 8.0, 10.0])
    pose = arm.at(q)
    segments = pose.segments
    start = segments.chains.start[:-1]
    lengths = np.add.reduceat(segments.lengths, start)
    np.testing.assert_allclose(lengths, pose.cable_lengths, rtol=0.0, atol=1e-15)
    jacobians = np.add.reduceat(segments.length_jacobian, start)
    np.testing.assert_allclose(jacobians, pose.length_jacobian, rtol=0.0, atol=1e-15)
    F = np.linspace(5.0, 20.0, 9)
    active = segments.active(F[segments.chains.cable])
    np.testing.assert_allclose(active, cdsm.stiffness(pose, F).active, rtol=0.0, atol=1e-12)
    parts = segments.tension_stiffness(F[segments.chains.cable]).sum(axis=0)
    np.testing.assert_allclose(parts, active, rtol=0.0, atol=1e-12)
    J = _steps(arm, q, lambda at: at.lengths)
    np.testing.assert_allclose(segments.length_jacobian, J, rtol=0.0, atol=2e-10)
    W = _steps(arm, q, lambda at: at.wrap)
    np.testing.assert_allclose(segments.wrap_jacobian, W, rtol=0.0, atol=1e-7)


def test_the_active_term_of_unequal_tensions_is_the_derivative_of_their_torque() -> None:
    arm = _rough_finger(0.1)
    q = np.deg2rad([6.0, 12.0, 8.0, 10.0])
    segments = arm.at(q).segments
    T = np.linspace(5.0, 20.0, segments.lengths.size)
    K = _steps(arm, q, lambda at: T @ at.length_jacobian)
    np.testing.assert_allclose(segments.active(T), K, rtol=0.0, atol=1e-7)


def test_a_post_with_much_friction_is_divided() -> None:
    """Beyond μβ = 0.3 a post is several holes, whose grips add up to its own."""
    counts = []
    for mu in (0.1, 0.6, 1.5):
        path = [TWO[0], replace(FIRST, friction=mu), Site("l2", (0.02, 0.0, 0.002))]
        pose = arm_of(PLANAR, path, elasticity=WIRE).at([0.2, 0.3])
        segments = pose.segments
        counts.append(segments.grip.size)
        assert segments.grip.sum() == pytest.approx(mu * pose.wraps.angle[0])
        assert segments.lengths.sum() == pytest.approx(pose.cable_lengths[0], abs=1e-15)
        assert segments.lengths.min() > 0.0
    assert counts[0] < counts[1] < counts[2]


def test_a_lifted_pulley_keeps_its_segments_and_has_no_friction() -> None:
    arm = arm_of(PLANAR, TWO, elasticity=WIRE)
    touching = arm.at([0.4, -0.5]).segments
    pose = arm.at([1.4, -1.2])
    assert not pose.wraps.touches.any()
    lifted = pose.segments
    assert lifted.lengths.size == touching.lengths.size
    np.testing.assert_array_equal(lifted.ratio, 1.0)
    np.testing.assert_allclose(lifted.lengths, pose.cable_lengths[0] / 3.0)


def test_a_cable_stuck_on_a_post_is_stiffer() -> None:
    arm = arm_of(PLANAR, TWO, elasticity=WIRE, lead=0.2)
    pose = arm.at([0.4, -0.5])
    stuck = cdsm.stuck_stiffness(pose, [20.0]).joint
    free = cdsm.stiffness(pose, [20.0]).joint
    assert np.linalg.eigvalsh(stuck - free).max() > 0.0
    assert np.linalg.eigvalsh(stuck - free).min() > -1e-9


def _pulled(x: float, pieces: int) -> tuple[float, float]:
    """Loss and stretch of a sheath of 1 m after a slow pull, x = μφ, and 0.5 m of cable behind."""
    sheath = Sheath(1.0, wrap=2.0, friction=x / 2.0, pieces=pieces)
    path = [sheath, Site("base", (0.0, 0.0, 0.0)), Site("base", (0.5, 0.0, 0.0))]
    path.append(Site("l1", (0.01, 0.0, 0.0)))
    segments = arm_of(PLANAR, path, elasticity=WIRE).at([0.0, 0.0]).segments
    length, ratio = segments.lengths, segments.ratio
    S = length.size
    rest, T = length / (1.0 + 1e-9 / EA), np.full(S, 1e-9)
    for _ in range(200):
        rest = rest - 2e-5 * np.eye(S)[0]
        ones, zero = np.ones(S), np.zeros(S)
        wire = Wire(length, rest, ones, np.full(S, 1.0 / EA), zero, zero, ratio)
        T, slip, _ = solve_chains(np.array([0, S]), np.array([np.nan]), wire, T)
        rest = rest - slip
        rest[1:] += slip[:-1]
    inside = length[: pieces + 1]
    return float(T[-1] / T[0]), float(T[: pieces + 1] @ inside / T[0])


@pytest.mark.parametrize("x", [0.1, 0.314, 1.0])
def test_a_sheath_loses_and_stretches_as_the_capstan_says(x: float) -> None:
    """Loss e^{−μφ} for any number of pieces; stretch (1 − e^{−x})/x within 0.13 % from 8 on."""
    loss, stretch = _pulled(x, 8)
    assert loss == pytest.approx(np.exp(-x), rel=1e-9)
    assert stretch == pytest.approx((1.0 - np.exp(-x)) / x, rel=1.4e-3)


def test_a_sheath_along_the_arm_exerts_no_torque() -> None:
    path = [Site("base", (0.0, 0.01, 0.0)), Site("base", (0.02, 0.01, 0.0))]
    path += [Sheath(0.1, friction=0.1, wrap=1.0), Site("l2", (0.0, 0.01, 0.0))]
    path += [Site("l2", (0.02, 0.01, 0.0))]
    pose = arm_of(PLANAR, path).at([0.3, 0.4])
    np.testing.assert_array_equal(pose.length_jacobian, 0.0)
    assert pose.cable_lengths[0] == pytest.approx(0.02 + 0.1 + 0.02)
    segments = pose.segments
    np.testing.assert_array_equal(segments.length_jacobian, 0.0)
    assert segments.lengths.sum() == pytest.approx(0.14)
    assert segments.grip.sum() == pytest.approx(0.1)


@pytest.mark.parametrize("options", [{"friction": 0.1}, {"bearing": 0.1}])
def test_smooth_pulleys_have_no_friction(options: dict[str, float]) -> None:
    with pytest.raises(cdsm.InvalidInput, match="smooth pulley on l1 has friction"):
        Pulley("l1", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.01, groove=False, **options)


def test_statics_with_friction_run_over_pulleys() -> None:
    """A weight that is put on and taken off leaves the finger elsewhere: friction has a history."""
    springs = {f"to_l{k}": 1.0 for k in range(4)}
    arm = _rough_finger(0.1).with_springs(springs)
    pose = arm.at(np.deg2rad([0.0, 12.0, 8.0, 10.0]))
    pull = cdsm.distribute_tension(pose, minimum=5.0)
    loads = np.zeros((4, 6))
    loads[:, 2] = [-0.25, -0.5, -0.25, 0.0]
    cycle = cdsm.load_cycle(pose, pull, loads, substeps=2)
    tips = np.array([cycle.pose(load).tip[2, 3] for load in cycle.load])
    assert tips[1] < tips[0] < pose.tip[2, 3]
    assert tips[2] < tips[0]  # friction keeps it down

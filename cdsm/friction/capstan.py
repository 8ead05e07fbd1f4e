"""Tensions, slips, tangent and stiffness of cables at a posture: chains of segments."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied
from cdsm.cable import Cable
from cdsm.cable_laws import group_by_law
from cdsm.motors import refuse_rough
from cdsm.posture import Posture
from cdsm.pulleys.wrapped_segments import STRAIGHT
from cdsm.routing import Indices
from cdsm.stiffness_matrix import FrictionState, Stiffness, assemble_stiffness
from cdsm.support.values import Array, Flags, frozen, total
from cdsm.tension import Tension
from cdsm.wires.elasticity import Elasticity

_STEPS = 60  # most Newton steps: linear laws need one, strands 3 to 6
_UNDAMPED = 20  # full Newton steps; later ones are shortened, since full ones may cycle at a kink
_SLACK = 1e-6  # tension [N] that stands for zero in a shortened step
_HELD = 1e12  # largest ratio of two tensions at a hole in which the cable is held
_CONVERGED = 1e-9  # relative change that ends the iteration; the error is about its square


class ChainState(NamedTuple):
    """State of all cables at a posture, after wire has slipped through holes: (S,) each."""

    tension: Array  # T [N]
    rest_length: Array  # a: length of the wire in the segment without strain [m]
    slip: Array  # rest length [m] that moved to the next segment
    slides: NDArray[np.bool_]  # whether the cable slides in the hole to the next segment
    stretch: Array  # 1 + ε [-]
    compliance: Array  # −∂a/∂T at constant length [m/N]


class ChainProblem:
    """Model of all cables as chains of segments: their laws, series springs and motors.

    It computes the tensions of the segments from their lengths, with friction in the holes between
    them. A force-controlled motor keeps the tension of the first segment; a position-controlled one
    keeps the wire. The series spring belongs to the first segment. Outside the domain of its law a
    segment has the rigidity at the nearest end. A cable without tension is slack.

    Args:
        cables: Cables of the arm.
        start: First segment of each cable; the last entry is the number of segments (C+1,).

    Attributes:
        laws: Each law with the indices of its cables.
    """

    def __init__(self, cables: tuple[Cable, ...], start: Indices) -> None:
        self._start = start
        self._cable = np.repeat(np.arange(len(cables)), np.diff(start))
        size = self._cable.size
        first = start[:-1]
        self._spring = np.zeros(size)
        self._unloaded = np.zeros(size)
        self._spring[first] = [1.0 / cable.series_stiffness for cable in cables]
        self._unloaded[first] = [cable.elasticity.rest for cable in cables]
        self._base = np.ones(size)
        self._softness = np.zeros(size)
        self._curved: list[tuple[Elasticity, Indices]] = []
        self.laws = list(group_by_law(enumerate(cables)).items())
        for law, group in self.laws:
            segments = np.flatnonzero(np.isin(self._cable, group))
            if law.constant_rigidity is None:
                self._curved.append((law, segments))
            else:
                self._softness[segments] = 1.0 / law.constant_rigidity

    def settle(
        self,
        length: Array,
        rest_length: Array,
        ratio: Array,
        forced: Array,
        near: Array,
        ways: NDArray[np.int8] | None = None,
    ) -> ChainState:
        """Compute the tensions and slips of all segments when their lengths become ``length``.

        ``length`` (S,) [m] are the new lengths, ``rest_length`` (S,) [m] those before wire slips.
        ``ratio`` (S,) is exp(μ φ) of the hole to the next segment. ``forced`` (C,) [N] is the
        tension of force-controlled motors, NaN for others. The search starts at ``near`` (S,) [N].

        ``ways`` (S,) says in which holes the cables slide, whatever friction demands: 1 towards the
        end of the cable, where T_{j+1} = ρ_j T_j, −1 towards its motor, 0 in none.
        """
        from cdsm.friction.capstan_kernels import Wire, solve_chains  # imports numba

        growth = np.ones(length.size)  # of T along cables that slide; over it they are even
        if ways is not None:
            growth, ratio = self._growth(ratio, ways)
        T = near
        for step in range(_STEPS):
            base, softness = self._strain(T)
            parts = length, rest_length, base, softness * growth, self._spring, self._unloaded
            wire = Wire(*parts, ratio)
            even, slip, slides = solve_chains(self._start, forced, wire, T / growth)
            new = even * growth
            if not self._curved or (abs(new - T) <= _CONVERGED * np.maximum(new, 1.0)).all():
                break
            T = new if step < _UNDAMPED else self._shortened(T, new, length, rest_length)
        stretch = base + softness * new
        taken = (length - self._spring * (new - self._unloaded)) / stretch
        after = rest_length - slip
        after[1:] += slip[:-1]
        first = self._start[:-1]
        supplied = ~np.isnan(forced)
        after[first[supplied]] = taken[first[supplied]]
        slack = (new == 0.0) & ~supplied[self._cable]
        if slack.any():  # the wire of a slack cable moves freely: it spreads evenly over segments
            surplus = np.add.reduceat(after, first) / np.add.reduceat(taken, first)
            after = np.where(slack, taken * surplus[self._cable], after)
        compliance = (self._spring + taken * softness) / stretch
        return ChainState(new, after, slip, slides, stretch, compliance)

    def _growth(self, ratio: Array, ways: NDArray[np.int8]) -> tuple[Array, Array]:
        """Return T (S,) over that of the first segment, and ratios (S,) of holes, slid or held."""
        steps = np.append(0.0, (ways * np.log(ratio))[:-1])
        steps[self._start[:-1]] = 0.0
        total = np.cumsum(steps)
        total -= total[self._start[:-1]][self._cable]
        held = (ways == 0) & (ratio > 1.0)
        return np.exp(total), np.where(held, _HELD, 1.0)

    def rest_lengths(self, length: Array, tension: Array) -> Array:
        """Compute the rest lengths (S,) [m] from lengths (S,) [m] and tensions (S,) [N]."""
        base, softness = self._strain(tension)
        wire = length - self._spring * (tension - self._unloaded)
        return np.asarray(wire / (base + softness * tension))

    def potential(self, tension: Array) -> Array:
        """Compute P = T (1 + ε) − ∫ T dε (S,) [N] at ``tension`` T; P is T but for the strain.

        Wire that slips to the next segment dissipates the difference of P, per rest length.
        """
        base, softness = self._strain(tension)
        energy = self._softness * tension**2 / 2.0
        for law, group in self._curved:
            T = tension[group]
            inside = np.clip(tension[group], law.low, law.high)
            energy[group] = law.energy(inside) + softness[group] * (T**2 - inside**2) / 2.0
        return np.asarray(tension * (base + softness * tension) - energy)

    def _shortened(self, T: Array, new: Array, length: Array, rest_length: Array) -> Array:
        """Return the tensions (S,) between ``T`` and ``new``, by ln T, of the least Σ D_j."""
        T = np.maximum(T, _SLACK)
        step = np.log(np.maximum(new, _SLACK) / T)
        low = 0.0
        high = 1.0
        for _ in range(5):
            middle = (low + high) / 2.0
            there = T * np.exp(middle * step)
            rise = (rest_length - self.rest_lengths(length, there)) @ step
            low, high = (middle, high) if rise < 0.0 else (low, middle)
        return np.asarray(T * np.exp(high * step))

    def _strain(self, tension: Array) -> tuple[Array, Array]:
        """Linearise 1 + ε ≈ base + softness · T at ``tension`` (S,): base, softness [1/N]."""
        if not self._curved:
            return self._base, self._softness
        base = self._base.copy()
        softness = self._softness.copy()
        for law, group in self._curved:
            inside = np.clip(tension[group], law.low, law.high)
            strain, rigidity = law.evaluate(inside)
            softness[group] = 1.0 / rigidity
            base[group] += strain - inside / rigidity
        return base, softness


def chain_tangent(
    start: Indices, forced: NDArray[np.bool_], chain: ChainState, gradient: Array, turning: Array
) -> Array:
    """Compute ∂T/∂θ (S, nv) [N/rad] of the segments in a state.

    A block is a run of segments joined by holes in which the cable slides; a is its first segment.
    Within it, T_j = T_a exp(Σ ± μ φ) over the holes between, with + where T rises, and wire is
    conserved. With g = ∂l/∂θ, ψ_j = Σ ± μ ∂φ/∂θ and the compliance κ = −∂a/∂T,

        ∂ln T_a/∂θ = Σ_j (g_j/(1 + ε_j) − κ_j T_j ψ_j)/Σ_j κ_j T_j,
        ∂T_j/∂θ = T_j (∂ln T_a/∂θ + ψ_j).

    A ``forced`` motor (C,) keeps T_a of the first block. Slack cables stay slack. ``start`` (C+1,)
    is as in :class:`ChainProblem`, ``gradient`` is g (S, nv), ``turning`` (S, nv) is μ ∂φ/∂θ of the
    hole to the next segment.
    """
    T = chain.tension
    begins = np.append(True, ~chain.slides[:-1])
    begins[start[:-1]] = True
    block = np.cumsum(begins) - 1
    first = np.flatnonzero(begins)
    up = np.where(begins[1:], 0.0, np.sign(np.diff(T)))
    psi = np.zeros_like(gradient)
    np.cumsum(up[:, None] * turning[:-1], axis=0, out=psi[1:])
    psi -= psi[first][block]
    weight = chain.compliance * T
    pull = np.add.reduceat(gradient / chain.stretch[:, None] - weight[:, None] * psi, first)
    total = np.add.reduceat(weight, first)
    free = total > 0.0
    free[block[start[:-1][forced]]] = False
    common = np.where(free, 1.0 / np.where(free, total, 1.0), 0.0)[:, None] * pull
    return np.asarray(T[:, None] * (common[block] + psi))


def can_stick(pose: Posture) -> Flags:
    """Return in which holes a cable can stick (P,): those with friction where the cable bends."""
    segments = pose.segments
    return np.asarray((segments.chains.friction > 0.0) & (segments.wrap > STRAIGHT))


def assemble_segments(
    pose: Posture,
    tension: Array,
    sliding: Flags,
    wrench: Applied,
    friction: FrictionState,
    distribution: Tension | None = None,
) -> Stiffness:
    """Compute the stiffness from checked tensions T (S,) [N] of the segments.

    ``sliding`` (P,) marks the holes in which cables slide. Raises ElasticityRangeError if a tension
    is outside the domain of its law.
    """
    refuse_rough(pose.arm.motors, pose.arm.has_friction, "friction")
    if pose.arm.motors.yielding is not None:  # without friction
        F = frozen(tension[pose.segments.chains.start[:-1]])
        k = pose.arm.laws.stiffness(pose.cable_lengths, F)
        return assemble_stiffness(pose, F, wrench, k, distribution)
    segments = pose.segments
    laws = pose.segments.chains.laws
    chains = segments.chains
    length = segments.lengths
    k = laws.stiffness(length, tension)
    # (1 + ε) of the wire: the spring in series is part of the length
    rest_length = laws.original_lengths(length, tension)
    stretch = (length - laws.series * (tension - laws.rest)) / rest_length
    compliance = np.divide(1.0, k * stretch, out=np.zeros_like(k), where=k > 0.0)
    slides = np.zeros(length.size, dtype=np.bool_)
    slides[chains.hole] = sliding | ~can_stick(pose)
    turning = np.zeros_like(segments.length_jacobian)
    turning[chains.hole] = chains.friction[:, None] * segments.wrap_jacobian
    T = np.where(tension > 0.0, tension, 1e-100)  # a slack segment would have no weight
    state = ChainState(T, rest_length, np.zeros_like(T), slides, stretch, compliance)
    forced = k[chains.start[:-1]] == 0.0
    gradient = chain_tangent(chains.start, forced, state, segments.length_jacobian, turning)
    passive = segments.length_jacobian.T @ gradient
    active = segments.active(tension)
    if friction == "stuck":
        passive = (passive + passive.T) / 2.0  # symmetric but for rounding
    F = frozen(tension[chains.start[:-1]])
    k = pose.arm.laws.stiffness(pose.cable_lengths, F)
    frictionless = assemble_stiffness(pose, F, wrench, k, distribution)
    terms = {**frictionless.terms, "active": active, "passive": frozen(passive)}
    return replace(
        frictionless,
        terms=terms,
        joint=frozen(total([*terms.values()])),
        friction=friction,
        segment_tension=frozen(tension),
        tension_gradient=frozen(gradient),
    )

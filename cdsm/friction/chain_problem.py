"""Compute tensions, slips and energies of cables at a posture; a cable is a chain of segments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm._former.chain_problem import chain_tangent, solve_chains
from cdsm._former.tree import Indices
from cdsm.cable import Cable
from cdsm.support.values import Array
from cdsm.wires.elasticity import Elasticity

_ITERATIONS = 60
"""Largest number of Newton steps. Arms with linear laws need one, with strands 3 to 6."""

_UNDAMPED = 20
"""Number of full Newton steps. Later steps are shortened, since full ones may cycle at a kink."""

_HALVINGS = 5
"""Number of bisections that find the length of a shortened Newton step."""

_SLACK = 1e-6
"""Tension [N] that stands for zero in a shortened Newton step."""

_CONVERGED = 1e-9
"""Relative change of the tensions that ends the iteration.

The remaining error is about ten times its square. The relative rounding of a tension is about
1e-16 EA/T, so changes below 1e-13 may never occur.
"""


class ChainSolution(NamedTuple):
    """State of all cables at a posture, after wire has slipped through holes.

    Each field has one value per segment (S,).
    """

    tension: Array  # T [N]
    natural: Array  # a: natural length of the wire in the segment, its length at zero strain [m]
    slip: Array  # natural length [m] that moved to the next segment
    slides: NDArray[np.bool_]  # whether the cable slides in the hole to the next segment
    stretch: Array  # 1 + ε [-]
    compliance: Array  # −∂a/∂T at constant length [m/N]


class ChainProblem:
    """Model of all cables as chains of segments: their laws, series springs and motors.

    It computes the tensions of the segments from their lengths, with friction in the holes between
    them. A force-controlled motor keeps the tension of the first segment constant; a
    position-controlled motor keeps the length of wire constant. The series spring belongs to the
    first segment. Outside the domain of its law a segment has the rigidity at the nearest end of
    the domain. A cable whose tension is zero is slack.

    Args:
        cables: Cables of the arm.
        start: First segment of each cable; the last entry is the number of segments (C+1,).
        tension: F (C,) [N]; needed only if ``unstrained`` is False.
        unstrained: Whether ε is the strain of the law. If not, ε is this strain minus the strain at
            ``tension``. A natural length is the length at ε = 0.

    Attributes:
        laws: Each law with the indices of its cables.
    """

    def __init__(
        self, cables: tuple[Cable, ...], start: Indices, tension: Array, unstrained: bool
    ) -> None:
        self._start = start
        self._cable = np.repeat(np.arange(len(cables)), np.diff(start))
        size, first = self._cable.size, start[:-1]
        self._spring, self._rest = np.zeros(size), np.zeros(size)
        self._spring[first] = [1.0 / cable.series_stiffness for cable in cables]
        self._rest[first] = [cable.elasticity.rest for cable in cables]
        self._base, self._softness = np.ones(size), np.zeros(size)
        self._curved: list[tuple[Elasticity, Indices]] = []
        by_law: dict[Elasticity, list[int]] = {}
        for c, cable in enumerate(cables):
            by_law.setdefault(cable.elasticity, []).append(c)
        self.laws = list(by_law.items())
        for law, of in self.laws:
            segments = np.flatnonzero(np.isin(self._cable, of))
            if law._constant is None:
                self._curved.append((law, segments))
            else:
                self._softness[segments] = 1.0 / law._constant
        if not unstrained:
            F = tension[self._cable]
            base, softness = self._strain(F)
            self._base = self._base - (base + softness * F - 1.0)

    def settle(
        self, length: Array, natural: Array, ratio: Array, forced: Array, near: Array
    ) -> ChainSolution:
        """Compute the tensions and slips of all segments when their lengths become ``length``.

        ``length`` (S,) [m] are the new lengths, ``natural`` (S,) [m] the natural lengths before
        wire slips. ``ratio`` (S,) is exp(μ φ) of the hole between a segment and the next one, 1 for
        the last segment of a cable. ``forced`` (C,) [N] is the tension of force-controlled motors,
        NaN for others. The search for the tensions starts at ``near`` (S,) [N].
        """
        T = near
        for attempt in range(_ITERATIONS):
            base, softness = self._strain(T)
            new, slip, slides = solve_chains(
                self._start,
                forced,
                length,
                natural,
                base,
                softness,
                self._spring,
                self._rest,
                ratio,
                T,
            )
            if not self._curved or (abs(new - T) <= _CONVERGED * np.maximum(new, 1.0)).all():
                break
            T = new if attempt < _UNDAMPED else self._shortened(T, new, length, natural)
        stretch = base + softness * new
        wire = (length - self._spring * (new - self._rest)) / stretch
        compliance = (self._spring + wire * softness) / stretch
        after = natural - slip
        after[1:] += slip[:-1]
        first = self._start[:-1]
        supplied = ~np.isnan(forced)
        after[first[supplied]] = wire[first[supplied]]
        slack = (new == 0.0) & ~supplied[self._cable]
        if slack.any():  # the wire of a slack cable moves freely: it spreads evenly over segments
            surplus = np.add.reduceat(after, first) / np.add.reduceat(wire, first)
            after = np.where(slack, wire * surplus[self._cable], after)
        return ChainSolution(new, after, slip, slides, stretch, compliance)

    def natural(self, length: Array, tension: Array) -> Array:
        """Compute the natural lengths (S,) [m] from lengths (S,) [m] and tensions (S,) [N]."""
        base, softness = self._strain(tension)
        wire = length - self._spring * (tension - self._rest)
        return np.asarray(wire / (base + softness * tension))

    def tangent(
        self, chain: ChainSolution, forced: Array, gradient: Array, friction_gradient: Array
    ) -> Array:
        """Compute ∂T/∂θ (S, nv) [N/rad] of the cables in the state ``chain``.

        ``forced`` (C,) [N] is the tension of force-controlled motors, NaN for others. ``gradient``
        (S, nv) [m/rad] is ∂l/∂θ of the lengths, ``friction_gradient`` (S, nv) [1/rad] is μ ∂φ/∂θ of
        the hole to the next segment. See :func:`~cdsm._former.chain_problem.chain_tangent`.
        """
        return chain_tangent(
            self._start,
            forced,
            chain.stretch,
            chain.compliance,
            chain.tension,
            chain.slides,
            gradient,
            friction_gradient,
        )

    def _shortened(self, T: Array, new: Array, length: Array, natural: Array) -> Array:
        """Return tensions (S,) [N] on the way from ``T`` to ``new``: a shortened Newton step.

        They approximately minimise Σ D_j(ln T_j) on the straight line from ln ``T`` to ln ``new``.
        The solution of the chain minimises the same convex sum, of which
        :mod:`cdsm._former.chain_problem` defines the terms D_j. ``length`` and ``natural`` (S,) are
        in [m].
        """
        T = np.maximum(T, _SLACK)
        step = np.log(np.maximum(new, _SLACK) / T)
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            rise = (natural - self.natural(length, T * np.exp(middle * step))) @ step
            low, high = (middle, high) if rise < 0.0 else (low, middle)
        return np.asarray(T * np.exp(high * step))

    def stored(self, natural: Array, tension: Array) -> float:
        """Compute the stored energy [J] of segments and series springs.

        ``natural`` (S,) [m] are natural lengths, ``tension`` (S,) [N] the tensions of the segments.
        The energy is zero if each tension is the smallest one in the domain of its law.
        """
        spring = self._spring @ (tension**2 - self._rest**2) / 2.0
        return float(natural @ self._energy(tension) + spring)

    def potential(self, tension: Array) -> Array:
        """Compute P = T (1 + ε) − ∫ T dε (S,) [N] at ``tension`` T.

        P is the work of a motor that takes in wire, per natural length. Wire that slips from one
        segment to the next dissipates the difference of their P, per natural length. To first order
        in the strain ε, P is T.
        """
        base, softness = self._strain(tension)
        return np.asarray(tension * (base + softness * tension) - self._energy(tension))

    def _strain(self, tension: Array) -> tuple[Array, Array]:
        """Linearise the strain at ``tension`` (S,) [N]: 1 + ε ≈ base + softness · T.

        Returns base (S,) [-] and softness (S,) [1/N].
        """
        if not self._curved:
            return self._base, self._softness
        base, softness = self._base.copy(), self._softness.copy()
        for law, of in self._curved:
            inside, rigidity = _within(law, tension[of])
            softness[of] = 1.0 / rigidity
            base[of] += law.strain(inside) - inside / rigidity
        return base, softness

    def _energy(self, tension: Array) -> Array:
        """Compute ∫ T dε (S,) [N] from the smallest tensions in the domains of the laws."""
        energy = self._softness * tension**2 / 2.0
        for law, of in self._curved:
            T, (inside, rigidity) = tension[of], _within(law, tension[of])
            energy[of] = law.energy(inside) + (T**2 - inside**2) / (2.0 * rigidity)
        return energy


def _within(law: Elasticity, tension: Array) -> tuple[Array, Array]:
    """Return ``tension`` clipped to the domain of ``law``, and the rigidities EA there [N]."""
    inside = np.clip(tension, law.low, law.high)
    return inside, law.rigidity(inside)

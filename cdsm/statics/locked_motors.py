"""Cables whose motors are locked: tension over length, and how it goes on where a law ends."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.elasticity import Elasticity, rising_root
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array, frozen

_BEYOND = 1e-9
"""Tensions this part beyond the end of a law are rounding: of an arm that started there."""


class _Springs(NamedTuple):
    """The position-controlled cables of one law; arrays over them.

    Attributes:
        law: Their elasticity.
        held: Which cables of the arm they are.
        free_length: l_0 [m].
        series: Compliance of spring or drive [m/N].
        low: Tension where the law begins [N].
    """

    law: Elasticity
    held: slice | NDArray[np.intp]
    free_length: Array
    series: Array
    low: float

    def elongation(self, F: Array) -> Array:
        """Δl [m] from the low end of the law."""
        wire = self.free_length * self.law.strain(F)
        return np.asarray(wire + (F - self.low) * self.series)

    def compliance(self, F: Array) -> Array:
        """dΔl/dF [m/N]."""
        return np.asarray(self.free_length / self.law.rigidity(F) + self.series)


class _Ends(NamedTuple):
    """How such cables go on before and after their law; arrays over them.

    Attributes:
        start: L where the law begins [m].
        span: Elongation from there to its end [m].
        low: Tension where it begins [N].
        high: Tension where it ends [N].
        before: Stiffness below [N/m].
        after: Stiffness above [N/m].
    """

    start: Array
    span: Array
    low: Array
    high: Array
    before: Array
    after: Array


class LockedCables:
    """Tension F(L) of the cables of an arm, each motor left as it is at a reference.

    A position-controlled cable keeps its original length l_0: its elongation is that at the
    reference plus the change of its length. A force-controlled one keeps its tension. Below the
    tension where its law begins a cable goes on with the stiffness it has there, down to zero, from
    where on it is slack; above the law's end it goes on with the stiffness it has there. Both are
    for iterates to pass through: :meth:`require_domains` refuses them as answers.

    Args:
        arm: The arm.
        lengths: L at the reference (C,) [m].
        tension: F at the reference (C,) [N]; of position-controlled cables inside their laws.

    Attributes:
        free_length: l_0 (C,) [m].

    Raises:
        ElasticityRangeError: A law gives no strain, or a series spring stretches by so much more
            than the cable is long that no wire explains its tension; names the cables.
        InvalidInput: An elasticity of the user's own gives no finite strain.
    """

    def __init__(self, arm: Manipulator, lengths: Array, tension: Array) -> None:
        self._arm = arm
        self._tension = tension
        self._groups = []
        self.free_length = arm._model.laws.original_lengths(lengths, tension)
        for law, held in arm._model.laws.held:
            series = arm._model.laws.series[held]
            springs = _Springs(law, held, self.free_length[held], series, law.domain.low)
            try:
                ends = _ends(springs, lengths[held], tension[held])
            except ElasticityRangeError as error:
                raise arm._model.laws.naming(error, held) from None
            self._groups.append((springs, ends))

    def pull(self, lengths: Array, near: Array) -> tuple[Array, Array]:
        """Tension F (C,) [N] and tangent stiffness k (C,) [N/m] at the lengths L (C,) [m].

        ``near`` (C,) [N] is F at lengths near these, to start from.
        """
        tension, stiffness = self._tension.copy(), np.zeros(lengths.size)
        for springs, (start, span, low, high, before, after) in self._groups:
            held = springs.held
            elongation = lengths[held] - start
            inside = np.minimum(np.maximum(elongation, 0.0), span)
            F, compliance = rising_root(
                inside, near[held], low, high, springs.elongation, springs.compliance
            )
            k = 1.0 / compliance
            excess = elongation - inside
            if np.count_nonzero(excess):
                k = np.where(excess == 0.0, k, np.where(excess < 0.0, before, after))
                F = np.maximum(F + k * excess, 0.0)
                k[(F == 0.0) & (excess < 0.0)] = 0.0
            tension[held], stiffness[held] = F, k
        return frozen(tension), frozen(stiffness)

    def require_domains(self, tension: Array) -> None:
        """Refuse tensions (C,) [N] of which the laws of their cables say nothing.

        Zero is no such tension where the law begins at zero: the cable is slack.

        Raises:
            ElasticityRangeError: Names the cables.
        """
        names = [cable.name for cable in self._arm.cables]
        for springs, _ in self._groups:
            domain, F = springs.law.domain, tension[springs.held]
            outside = (domain.low * (1.0 - _BEYOND) > F) | (domain.high * (1.0 + _BEYOND) < F)
            if np.count_nonzero(outside):
                where = np.arange(tension.size)[springs.held][outside].tolist()
                raise ElasticityRangeError(
                    f"at the equilibrium; the elasticity is defined on {domain}, and says neither "
                    "how a cable goes slack below it nor how it yields above. Change the tensions "
                    "or the load, or use an elasticity that covers them.",
                    F[outside].tolist(),
                    where,
                    [names[c] for c in where],
                )


def _ends(springs: _Springs, lengths: Array, tension: Array) -> _Ends:
    """From the law, and L and F at the reference."""
    domain, size = springs.law.domain, tension.shape
    first, last = np.full(size, domain.first), np.full(size, domain.high)
    softest = springs.compliance(first)
    if (softest <= 0.0).any():
        which = np.flatnonzero(softest <= 0.0).tolist()
        raise ElasticityRangeError(
            "stretches the series spring by more than the whole cable is long, so that no wire is "
            "left. Give the cable a lead that holds its spring, a stiffer spring or less tension.",
            tension[which].tolist(),
            which,
        )
    before = 1.0 / softest
    after, span = np.zeros(size), last
    if math.isfinite(domain.high):
        after, span = 1.0 / springs.compliance(last), springs.elongation(last)
    elongation = springs.elongation(tension)
    if not np.isfinite([elongation, before, after]).all() or np.isnan(span).any():
        raise InvalidInput(
            "elasticity", f"{springs.law!r} gives strains or rigidities that are not finite."
        )
    return _Ends(lengths - elongation, span, first, last, before, after)

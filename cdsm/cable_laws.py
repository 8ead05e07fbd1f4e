"""Stiffness, tension bounds and original lengths of all cables of an arm, from their laws EA(F)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.errors import ElasticityRangeError
from cdsm.support.values import Array, frozen
from cdsm.wires.elasticity import Elasticity, newton_in_bracket

Selection = slice | NDArray[np.intp]

_HUGE = 1e12  # no tension [N] is beyond


def group_by_law(cables: Iterable[tuple[int, Cable]]) -> dict[Elasticity, list[int]]:
    """Return the indices of numbered cables by their law, in their order."""
    groups: dict[Elasticity, list[int]] = {}
    for c, cable in cables:
        groups.setdefault(cable.elasticity, []).append(c)
    return groups


class CableLaws:
    """Elasticities of all C cables of an arm.

    A locked motor keeps the original length l_0 of its wire, and a wire under tension is
    ℓ = l_0 (1 + ε) long: its stiffness EA/l_0 is EA (1 + ε)/ℓ. Arrays are checked and not negative.
    ElasticityRangeError names the cables whose tension is outside their law.

    Args:
        cables: Cables of the arm, or its segments.
        whole: Whether they are whole cables: a series spring that stretches by more than the whole
            cable leaves no wire, which :meth:`stiffness` refuses. The spring in the first segment
            of a cable may be longer than this segment.

    Attributes:
        held: Each distinct law of the position-controlled cables, with the indices of its cables.
        nonlinear: The entries of ``held`` whose law is not linear.
        series: 1/k_series of all cables (C,) [m/N].
        rest: Tension (C,) [N] at which wire strain and spring elongation are zero.
        constant: EA (C,) [N] of position-controlled cables with a linear law; 0 for all others.
        linear: Whether a cable is one of these (C,), as 1 or 0: EA (1 + ε) is then EA + F.
        low: Lower ends (C,) [N] of the domains of the laws; 0 where a motor controls the force.
        high: Upper ends (C,) [N]; inf where a motor controls the force, which needs no law.
    """

    def __init__(self, cables: tuple[Cable, ...], *, whole: bool = True) -> None:
        self._cables = cables
        locked = [(c, cable) for c, cable in enumerate(cables) if cable.control == "position"]
        # usually all cables have one law, and a slice is faster than indices
        self.held = [
            (law, slice(None) if len(group) == len(cables) else np.array(group))
            for law, group in group_by_law(locked).items()
        ]
        self._least = frozen(np.array([cable.minimum for cable in cables]))
        self._most = frozen(np.array([cable.maximum for cable in cables]))
        self.series = frozen(1.0 / np.array([cable.series_stiffness for cable in cables]))
        self.rest = frozen(np.array([cable.elasticity.rest for cable in cables]))
        self.nonlinear = [(law, group) for law, group in self.held if law.constant_rigidity is None]
        constant = np.zeros(len(cables))
        linear = np.zeros(len(cables))
        for law, group in self.held:
            if law.constant_rigidity is not None:
                constant[group] = law.constant_rigidity
                linear[group] = 1.0
        self._sprung = whole and bool(self.series.any())
        self._may_fail = self._sprung or bool(self.nonlinear)
        self.constant = frozen(constant)
        self.linear = frozen(linear)
        self.low = np.zeros(len(cables))
        self.high = np.full(len(cables), np.inf)
        for law, group in self.held:
            self.low[group] = law.low
            self.high[group] = law.high
        frozen(self.low)
        frozen(self.high)

    def narrowed(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the tension bounds ``low``, ``high`` (…, C) [N], narrowed to the cables' own."""
        return frozen(np.maximum(low, self._least)), frozen(np.minimum(high, self._most))

    def stiffness(self, lengths: Array, tension: Array) -> Array:
        """Compute 1/(l_0/EA(F) + 1/k_series) (C,) [N/m] at L and F (C,); 0: force-controlled."""
        k = self.stiffness_of(lengths, tension, self.rigidities(tension))
        if self._may_fail and k.min() < 0.0:
            for law, group in self.nonlinear:
                self._evaluate(law, group, tension[group])
            self.require_wire(self.original_lengths(lengths, tension), tension)
        return frozen(k)

    def stiffness_of(
        self, lengths: Array, tension: Array, rigidities: Array, series: Array | None = None
    ) -> Array:
        """Compute the same (…, C) from EA (1 + ε) (…, C), as :meth:`rigidities` gives it.

        It is −1 where a tension is outside its law, or a spring leaves no wire. ``series`` replaces
        the arm's own 1/k_series.
        """
        series = self.series if series is None else series
        wire = lengths - series * (tension - self.rest)
        with np.errstate(divide="ignore"):
            k = np.where(rigidities > 0.0, 1.0 / (wire / rigidities + series), rigidities)
        if self._sprung:
            k[(rigidities > 0.0) & (wire <= 0.0)] = -1.0
        return k

    def require_wire(self, original_lengths: Array, tension: Array) -> None:
        """Raise ElasticityRangeError if l_0 (C,) [m] of a cable under F (C,) [N] is 0 or less."""
        lost = np.flatnonzero(original_lengths <= 0.0)
        if lost.size:
            problem = "stretches the series spring by more than the whole cable: no wire is left. "
            problem += "Give the cable a longer lead, a stiffer spring or less tension."
            error = ElasticityRangeError(problem, tension[lost].tolist(), lost.tolist())
            raise self.naming(error, slice(None))

    def largest_tensions(self, lengths: Array) -> Array:
        """Compute the tensions (C,) [N] at which springs leave no wire of cables of length L.

        They are inf for cables without a spring and for force-controlled ones.
        """
        locked = [cable.control == "position" for cable in self._cables]
        with np.errstate(divide="ignore"):
            return np.where(locked, self.rest + lengths / self.series, np.inf)

    def rigidities(self, tension: Array) -> Array:
        """Compute EA (1 + ε) (…, C) [N] at F (…, C): 0: force-controlled; −1: outside, or NaN."""
        rigidity = self.constant + self.linear * tension
        for law, group in self.nonlinear:
            F = tension[..., group]
            inside = (law.low <= F) & (law.high >= F)
            stretch, EA = self._evaluate(law, group, np.where(inside, F, law.low))
            rigidity[..., group] = np.where(inside, EA * stretch, -1.0)
        return frozen(rigidity)

    def original_lengths(self, lengths: Array, tension: Array) -> Array:
        """Compute l_0 (C,) [m] of cables of length L (C,) [m] under tension F (C,) [N].

        L includes the series spring, so l_0 is negative if the spring stretches by more than L. A
        force-controlled cable has no l_0: its entry is L.
        """
        wire = np.array(lengths)
        for law, group in self.held:
            wire[group] -= self.series[group] * (tension[group] - self.rest[group])
            wire[group] /= self._evaluate(law, group, tension[group])[0]
        return frozen(wire)

    def stretched(self, tension: Array, free_length: Array, longer: Array) -> tuple[Array, Array]:
        """Compute tensions (C,) [N] and energies (C,) [J] of cables that became longer.

        Position-controlled cables with the original lengths l_0 (C,) [m] and the tensions F_0 (C,)
        [N], the ``tension``, become ``longer`` (C,) [m]; the others keep their tensions. The energy
        is ∫ F dL from F_0 on. Raises ElasticityRangeError if a tension F_0 is outside its law.
        """
        F = np.array(tension)
        energy = tension * longer
        for law, group in self.held:
            start = law.require_inside(tension[group])
            F[group], energy[group] = _stretch(
                law, start, free_length[group], self.series[group], longer[group]
            )
        return F, energy

    def stiffness_slope(self, tension: Array, stiffness: Array) -> Array:
        """Compute dk/dF (C,) [1/m] at a constant posture, at which l_0 changes with F.

        F (C,) [N] is ``tension``, k (C,) [N/m] the ``stiffness`` of each cable at F. With R =
        EA (1 + ε) and the spring's share of the compliance of the cable, s = k/k_series,

            dk/dF = k (s/R + (1 − s) R′/R),      R′ = EA′ (1 + ε) + 1.
        """
        slope = np.zeros_like(stiffness)
        for law, group in self.held:
            stretch, EA = self._evaluate(law, group, tension[group])
            share = stiffness[group] * self.series[group]
            rise = law.slope_at(tension[group], EA) * stretch + 1.0
            slope[group] = stiffness[group] * (share + (1.0 - share) * rise) / (EA * stretch)
        return frozen(slope)

    def _evaluate(self, law: Elasticity, group: Selection, tension: Array) -> tuple[Array, Array]:
        """Compute 1 + ε and EA [N] of the cables ``group``."""
        try:
            strain, EA = law.evaluate(law.require_inside(tension))
        except ElasticityRangeError as error:
            raise self.naming(error, group) from None
        return 1.0 + strain, EA

    def naming(self, error: ElasticityRangeError, group: Selection) -> ElasticityRangeError:
        """Return a copy of a law's error at the cables ``group`` that also names the cables."""
        outside = np.arange(len(self._cables))[group][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)


class LockedLaw(NamedTuple):
    """The n position-controlled cables with one law, in their order; arrays are (n,)."""

    law: Elasticity
    cables: Selection
    rest_length: Array  # [m]
    series: Array  # compliance of the springs [m/N]
    start: Array  # a tension F_0 [N]
    strain: Array  # of the wire at F_0
    length: Array  # of the cable at F_0 [m]

    def elongation(self, F: Array) -> tuple[Array, Array]:
        """Compute the elongation from F_0 to F [m], and its slope [m/N]."""
        inside = np.minimum(np.maximum(F, self.law.low), self.law.high)
        strain, EA = self.law.evaluate(inside)
        slope = self.rest_length / EA + self.series
        wire = self.rest_length * (strain - self.strain)
        return wire + (inside - self.start) * self.series + (F - inside) * slope, slope

    def continued_tension(self, lengths: Array) -> tuple[Array, Array]:
        """Compute F [N], also below 0 N, and dL/dF [m/N] at lengths L [m]."""
        wanted = lengths - self.length
        ends = np.full((2, lengths.size), [[-_HUGE], [_HUGE]])

        def error(F: Array) -> tuple[Array, Array]:
            reached, slope = self.elongation(F)
            return reached - wanted, slope

        return newton_in_bracket(error, self.start, *ends)


def _stretch(
    law: Elasticity, start: Array, free_length: Array, series: Array, longer: Array
) -> tuple[Array, Array]:
    """Compute F (n,) [N] and ∫ F dL (n,) [J] of n cables of one law, ``longer`` than at ``start``.

    Beyond the law, they have the tensions of its ends.
    """

    def elongation(F: Array) -> tuple[Array, Array]:
        strain, EA = law.evaluate(F)
        return free_length * strain + series * F, free_length / EA + series

    wanted = elongation(start)[0] + longer

    def excess(F: Array) -> tuple[Array, Array]:
        reached, slope = elongation(F)
        return reached - wanted, slope

    F, _ = newton_in_bracket(excess, start, *np.full((2, start.size), [[law.low], [law.high]]))
    wire = free_length * (law.energy(F) - law.energy(start))
    return F, wire + series * (F**2 - start**2) / 2.0

"""Stiffness, tension bounds and original lengths of all cables of an arm, from their laws EA(F)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.errors import ElasticityRangeError
from cdsm.support.values import Array, frozen
from cdsm.wires.elasticity import Elasticity

OriginalLength = Literal["unstrained", "stretched"]

_STEP = 1e-5  # relative step of the finite difference of the slope of EA (1 + ε)


class CableLaws:
    """Elasticities of all cables of an arm; C is the number of cables.

    A locked motor keeps the original length l_0 of its wire constant. Under tension the length of
    the wire is ℓ = l_0 (1 + ε). The stiffness EA/l_0 is therefore EA (1 + ε)/ℓ.

    Args:
        cables: Cables of the arm.
        original_length: Original length of a wire of length ℓ and strain ε. ``"unstrained"``:
            ℓ/(1 + ε); ``"stretched"``: ℓ, as in the paper.

    Attributes:
        held: Each distinct law of the position-controlled cables, with the indices of its cables.
        series: 1/k_series of all cables (C,) [m/N].
        rest: Tension (C,) [N] at which wire strain and spring elongation are zero.
        constant: EA (C,) [N] of position-controlled cables with a linear law; 0 for all others.
        linear: Factor b (C,) [-] in EA (1 + ε) = EA + b F of these cables: 1 if ``original_length``
            is unstrained, 0 if it is stretched. It is 0 for all other cables.
        nonlinear: The entries of ``held`` whose law is not linear; their EA is computed at each
            tension.
    """

    def __init__(self, cables: tuple[Cable, ...], original_length: OriginalLength) -> None:
        self._cables = cables
        self._unstrained = original_length == "unstrained"
        by_law: dict[Elasticity, list[int]] = {}
        for c, cable in enumerate(cables):
            if cable.control == "position":
                by_law.setdefault(cable.elasticity, []).append(c)
        # usually all cables have one law, and a slice is faster than indices
        count = len(self._cables)
        self.held = [
            (law, slice(None) if len(of) == count else np.array(of)) for law, of in by_law.items()
        ]
        self._least = frozen(np.array([cable.minimum for cable in self._cables]))
        self._most = frozen(np.array([cable.maximum for cable in self._cables]))
        self._bounded = bool(self._least.any() or np.isfinite(self._most).any())
        series = np.array([cable.series_stiffness for cable in self._cables])
        self.series = frozen(1.0 / series)
        self.rest = frozen(np.array([cable.elasticity.rest for cable in self._cables]))
        # constant EA of linear laws; all other laws are evaluated at each tension
        self.nonlinear, constant, linear = [], np.zeros(count), np.zeros(count)
        for law, of in self.held:
            if law._constant is None:
                self.nonlinear.append((law, of))
            else:
                constant[of], linear[of] = law._constant, float(self._unstrained)
        self.constant, self.linear = frozen(constant), frozen(linear)

    def narrowed(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the tension bounds ``low``, ``high`` (…, C) [N], narrowed to the cables' own."""
        if not self._bounded:
            return low, high
        return frozen(np.maximum(low, self._least)), frozen(np.minimum(high, self._most))

    def stiffness(self, lengths: Array, tension: Array) -> Array:
        """Compute the diagonal of K_L (C,) [N/m]: 1/(l_0/EA(F) + 1/k_series).

        Force-controlled cables have the stiffness 0. ``lengths`` is L (C,) [m] and ``tension`` is
        F (C,) [N], both checked and not negative.
        """
        rigidity = self._rigidity(tension) if self.nonlinear else self.constant
        stretched = rigidity + self.linear * tension  # EA (1 + ε), 0 of force-controlled cables
        wire = lengths - self.series * (tension - self.rest)
        with np.errstate(divide="ignore"):
            return frozen(np.where(stretched > 0.0, 1.0 / (wire / stretched + self.series), 0.0))

    def _rigidity(self, tension: Array) -> Array:
        """Compute EA (1 + ε) (C,) [N] at F (C,) [N]; for linear laws only its constant part, EA."""
        rigidity = self.constant.copy()
        for law, held in self.nonlinear:
            try:
                rigidity[held] = self._stretched(law, law._inside(tension[held]))
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
        return rigidity

    def rigidities(self, tension: Array) -> Array:
        """Compute EA (1 + ε) (b, C) [N] of b postures at F (b, C) [N]; −1 outside the laws.

        Entries of force-controlled cables are 0. NaN counts as outside.
        """
        rigidity = self.constant + self.linear * tension
        for law, held in self.nonlinear:
            F = tension[:, held]
            inside = (law.low <= F) & (law.high >= F)
            found = self._stretched(law, np.where(inside, F, law.low))
            rigidity[:, held] = np.where(inside, found, -1.0)
        return frozen(rigidity)

    def _stretched(self, law: Elasticity, tension: Array) -> Array:
        """Compute EA (1 + ε) [N] at F [N] of any shape; EA if the original length is stretched."""
        strain, rigidity = law._evaluate(tension)
        return rigidity * (1.0 + strain) if self._unstrained else rigidity

    def original_lengths(self, lengths: Array, tension: Array) -> Array:
        """Compute l_0 (C,) [m] of cables of length L (C,) [m] under tension F (C,) [N].

        The cable length includes the series spring. l_0 is therefore negative if the spring
        stretches by more than the length of the cable. A force-controlled cable has no l_0: its
        entry is L.
        """
        wire = np.array(lengths)
        for law, held in self.held:
            F = tension[held]
            wire[held] -= self.series[held] * (F - self.rest[held])
            if self._unstrained:
                try:
                    wire[held] /= 1.0 + law._evaluate(law._inside(F))[0]
                except ElasticityRangeError as error:
                    raise self.naming(error, held) from None
        return frozen(wire)

    def slopes(self, tension: Array, stiffness: Array) -> tuple[Array, Array]:
        """Compute dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] at a constant posture.

        F (C,) [N] is ``tension``, and k (C,) [N/m] is ``stiffness``, that of each cable at F. The
        cable length is constant, so l_0 changes with F. A prime is d/dF, R = EA (1 + ε) and
        G = R′/R. The wire's share of the compliance of the cable is w = 1 − k/k_series. Then

            k′ = k A,  k″ = k (A² + A′),  A = (1 − w)/R + w G,
            A′ = (1 − w) (A/R − G/R − A G) + w G′.

        G′ is computed by finite differences and has about five correct digits.
        """
        first, second = np.zeros_like(stiffness), np.zeros_like(stiffness)
        for law, held in self.held:
            F, k = tension[held], stiffness[held]
            step = _STEP * np.maximum(F, 1.0)
            beside = np.where(F + step <= law.high, F + step, F - step)
            both = np.stack([F, beside])
            try:
                slopes = law.rigidity_slope(both)
                R = self._stretched(law, F)  # inside: rigidity_slope has looked
                if self._unstrained:  # (EA (1 + ε))′ = EA′ (1 + ε) + 1
                    slopes = slopes * (1.0 + law.strain(both)) + 1.0
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
            G, spring = slopes[0] / R, k * self.series[held]
            bend = (slopes[1] - slopes[0]) / (beside - F) / R - G**2
            A = spring / R + (1.0 - spring) * G
            first[held] = k * A
            change = spring * (A / R - G / R - A * G) + (1.0 - spring) * bend
            second[held] = k * (A**2 + change)
        return frozen(first), frozen(second)

    def naming(
        self, error: ElasticityRangeError, held: slice | NDArray[np.intp]
    ) -> ElasticityRangeError:
        """Return a copy of a law's error that also names the cables whose tension caused it.

        ``held`` are the indices, among all cables, of the cables to which the law was applied.
        """
        outside = np.arange(len(self._cables))[held][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)

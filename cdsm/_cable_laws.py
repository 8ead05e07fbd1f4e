"""The cables of an arm, law by law: how stiff they are, and what they may carry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdsm._checks import LARGEST, SMALLEST, Array, frozen
from cdsm._stiffness_kernels import cable_stiffness
from cdsm.cable import Cable
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.errors import ElasticityRangeError, InvalidInput

_STEP = 1e-5
"""Relative step of the difference of dEA/dF."""


class CableLaws:
    """What the stiffness of cables needs, gathered once.

    Args:
        cables: Those of an arm.

    Attributes:
        held: Each law of the position-controlled cables, and which cables have it.
        series: 1/k_series of all cables (C,) [m/N].
    """

    def __init__(self, cables: tuple[Cable, ...]) -> None:
        self._cables = cables
        held = [c for c, cable in enumerate(self._cables) if cable.control == "position"]
        by_law: dict[object, list[int]] = {}
        for c in held:
            by_law.setdefault(_key(self._cables[c].elasticity), []).append(c)
        # one law for all is the usual case, and a slice costs less than indices
        self.held = [
            (
                self._cables[cables[0]].elasticity,
                slice(None) if len(cables) == len(self._cables) else np.array(cables),
            )
            for cables in by_law.values()
        ]
        self._least = frozen(np.array([cable.minimum for cable in self._cables]))
        self._most = frozen(np.array([cable.maximum for cable in self._cables]))
        self._bounded = bool(self._least.any() or np.isfinite(self._most).any())
        series = np.array([cable.series_stiffness for cable in self._cables])
        self.series = frozen(1.0 / series)
        # EA of the cables where it is always the same; laws that have to be asked
        constant, self._asked = np.zeros(len(self._cables)), []
        for law, of in self.held:
            if isinstance(law, LinearElasticity):
                constant[of] = law.rigidity(0.0)
            else:
                self._asked.append((law, of))
        self._constant = frozen(constant)

    def narrowed(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of tension (…, C) [N], and those that the cables have of their own."""
        if not self._bounded:
            return low, high
        return frozen(np.maximum(low, self._least)), frozen(np.minimum(high, self._most))

    def stiffness(self, lengths: Array, tension: Array) -> Array:
        """Diagonal of K_L (C,) [N/m]: 1/(l_0/EA(F) + 1/k_series), 0 for force-controlled cables.

        Of checked free lengths (C,) [m] and tensions (C,) [N], which are not negative.

        Raises:
            ElasticityRangeError: Names the cables whose tension is outside their elasticity's
                domain.
            InvalidInput: An elasticity of the user's own gives no positive rigidity.
        """
        rigidity = self._constant
        if self._asked:
            rigidity = rigidity.copy()
            for law, held in self._asked:
                try:
                    rigidity[held] = checked_rigidity(law, tension[held])
                except ElasticityRangeError as error:
                    raise self.naming(error, held) from None
        return frozen(cable_stiffness(lengths, rigidity, self.series))

    def slopes(self, tension: Array, stiffness: Array) -> tuple[Array, Array]:
        """dk/dF (C,) [1/m] and d²k/dF² (C,) [1/(N m)] of cables of stiffness k under F (C,) [N].

        k′ = (k² l_0/EA) EA′/EA = k (1 − k/k_series) EA′/EA: the free length need not be known. EA″
        is a difference, good for some five digits.

        Raises:
            ElasticityRangeError: As for :meth:`stiffness`.
            InvalidInput: An elasticity of the user's own gives no finite slope.
        """
        first, second = np.zeros_like(stiffness), np.zeros_like(stiffness)
        for law, held in self.held:
            F, k = tension[held], stiffness[held]
            last = np.array([*law.jumps, law.domain.high])[np.searchsorted(law.jumps, F)]
            step = _STEP * np.maximum(F, 1.0)
            beside = np.where(F + step <= last, F + step, F - step)
            try:
                slopes = np.asarray(law.rigidity_slope(np.stack([F, beside])))
                EA = law.rigidity(F)
            except ElasticityRangeError as error:
                raise self.naming(error, held) from None
            if slopes.shape != (2, F.size) or not np.isfinite(slopes).all():
                raise InvalidInput(
                    "elasticity",
                    f"{law!r} gives the slopes {slopes} of its rigidity at tensions {F} N and "
                    "beside them; one finite number for each is needed.",
                )
            growth, wire = slopes[0] / EA, 1.0 - k * self.series[held]
            bend = (slopes[1] - slopes[0]) / (beside - F) / EA - growth**2
            first[held] = k * wire * growth
            second[held] = first[held] * growth * (2.0 * wire - 1.0) + k * wire * bend
        return frozen(first), frozen(second)

    def naming(
        self, error: ElasticityRangeError, held: slice | NDArray[np.intp]
    ) -> ElasticityRangeError:
        """The error of a law at the tensions of some cables, with their names and numbers."""
        outside = np.arange(len(self._cables))[held][list(error.indices)].tolist()
        names = [self._cables[c].name for c in outside]
        return ElasticityRangeError(error.problem, error.tension, outside, names)


def checked_rigidity(law: Elasticity, tension: Array) -> Array:
    """EA(F) [N] of a law, same shape as F [N], which need not be the library's own.

    Raises:
        ElasticityRangeError: A tension outside the domain of the law.
        InvalidInput: The law gives no positive rigidity.
    """
    rigidity = np.asarray(law.rigidity(tension))
    usable = (rigidity >= SMALLEST) & (rigidity <= LARGEST)  # false for NaN too
    if rigidity.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the rigidity {rigidity} N at tensions {tension} N; one positive "
            "number for each is needed.",
        )
    return rigidity


def _key(law: Elasticity) -> object:
    """What equal laws share; an elasticity of the user's own need not be hashable."""
    try:
        hash(law)
    except TypeError:
        return id(law)
    return law

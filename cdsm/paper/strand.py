"""Fig. 5 of the paper: the tensile test of the strand, computed from Eq. 19."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final, final

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from cdsm import presets
from cdsm.paper.claims import Claim, Figure
from cdsm.paper.digits import JOIN, LEVEL, band, least_bend
from cdsm.support.values import Array, frozen
from cdsm.wires.laws import EQ19_PRINTED

GAUGE_LENGTH: Final = 0.5
"""Length of the tested wire [m]. It is assumed: the paper does not give it."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StrandFigure(Figure):
    """Fig. 5: force as a function of displacement, and rigidity as a function of tension.

    Attributes:
        gauge_length: Length of the tested wire [m].
        tension: F (N,) [N].
        displacement: Elongation of the wire from 2.2 N on, ∫ l_0 dF/EA (N,) [m].
        tangent: Tangent rigidity EA of the repaired Eq. 19 (N,) [N].
        secant: Secant rigidity (Eq. 18) of the repaired Eq. 19 (N,) [N].
        low: Least EA of all continuous laws that round to the printed digits (N,) [N].
        high: Largest EA of all continuous laws that round to the printed digits (N,) [N].
        printed: EA by Eq. 19 as printed (N,) [N].
        join: Tension at which the branches of Eq. 19 meet [N].
    """

    gauge_length: float
    tension: Array
    displacement: Array
    tangent: Array
    secant: Array
    low: Array
    high: Array
    printed: Array
    join: float

    def numbers(self) -> dict[str, object]:
        """Return the curves as plain SI numbers, for JSON."""
        return {
            "gauge_length_m": self.gauge_length,
            "tension_N": self.tension.tolist(),
            "displacement_m": self.displacement.tolist(),
            "tangent_rigidity_N": self.tangent.tolist(),
            "secant_rigidity_N": self.secant.tolist(),
            "least_rigidity_N": self.low.tolist(),
            "largest_rigidity_N": self.high.tolist(),
            "as_printed_N": self.printed.tolist(),
        }


def eq19_as_printed(tension: ArrayLike) -> Array:
    """Compute EA [N] at each ``tension`` [N] by Eq. 19 with its misprint.

    The values from 11 to 31 N are negative.
    """
    F = np.asarray(tension, dtype=np.float64)
    lower, upper = EQ19_PRINTED
    return np.where(F <= JOIN, polyval(F, (*lower[:-1], -1e-3)), polyval(F, upper))


def figure_5(gauge_length: float = GAUGE_LENGTH) -> StrandFigure:
    """Compute Fig. 5 for a 1×19 strand whose tested length is ``gauge_length`` [m]."""
    law = presets.STRAND_1X19
    tension = np.concatenate([np.linspace(2.25, JOIN, 80), np.linspace(31.01, law.high, 120)])
    low, high = band(tension)
    claim = partial(Claim, figure="Fig. 5")
    flat = law.rigidity(np.linspace(*LEVEL, 400))
    return StrandFigure(
        name="fig5",
        title="Fig. 5: tensile test of the 1×19 strand, as Eq. 19 implies it",
        gauge_length=gauge_length,
        tension=frozen(tension),
        displacement=frozen(gauge_length * law.strain(tension)),
        tangent=frozen(law.rigidity(tension)),
        secant=frozen(law.secant_rigidity(tension)),
        low=low,
        high=high,
        printed=frozen(eq19_as_printed(tension)),
        join=JOIN,
        claims=(
            claim(
                quantity="first coefficient for which the branches meet at 31 N, times 1e4",
                unit="N⁻⁵",
                paper=(-10.0,),
                computed=(1e4 * law.coefficients[0][-1],),
                assumption="misprint: −1e-3 for −1e-4; all other digits as printed",
            ),
            claim(
                quantity="EA at 31 N from the lower over that from the upper polynomial, "
                "as printed",
                unit="-",
                paper=(1.0,),
                computed=(float(eq19_as_printed(JOIN)) / float(law.polynomial(JOIN)),),
                assumption="none: a misprint",
            ),
            claim(
                quantity="slope of EA below and above 31 N, where the least change is sought",
                unit="-",
                computed=least_bend(),
                assumption="any first coefficient, the others within their printed digits",
            ),
            claim(
                quantity="EA at 810 N, least and largest within the printed digits",
                unit="kN",
                computed=(1e-3 * float(low[-1]), 1e-3 * float(high[-1])),
                assumption="none",
            ),
            claim(
                quantity="rise of EA from least to largest, 400 to 810 N (paper: near-constant)",
                unit="%",
                computed=(100.0 * float(flat.max() / flat.min() - 1.0),),
                assumption="Eq. 19 most level within its digits",
            ),
        ),
    )

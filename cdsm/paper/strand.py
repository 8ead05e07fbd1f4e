"""Fig. 5 of the paper: the tensile test of the strand, computed from Eq. 19."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, final

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from cdsm import presets
from cdsm.paper.claims import Claim, Figure, floats
from cdsm.support.result import unit
from cdsm.support.values import Array, frozen
from cdsm.wires.elasticity import Elasticity

GAUGE_LENGTH = 0.5  # [m], [N]
JOIN = 31.0
_STRONGEST: Final = 1e4  # tension [N] above those of the paper

LEVEL: Final = (400.0, 810.0)
"""Range of tension [N] over which the paper calls the rigidity near-constant (Section IV-C)."""

EQ19_PRINTED: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -1e-4),
    (-1924.5, 493.35, -2.26, 0.0054, -6.94e-6, 4.58e-9, -1.22e-12),
)
"""Printed coefficients of Eq. 19. Only the misprinted −1e-3 is corrected."""

HALF_UNITS: Final = (
    frozen(np.array([5e-3, 5e-3, 5e-3, 5e-3, 5e-3, 5e-5, 5e-5])),
    frozen(np.array([5e-2, 5e-3, 5e-3, 5e-5, 5e-9, 5e-12, 5e-15])),
)
"""Half a unit of the last printed digit of each coefficient of :data:`EQ19_PRINTED`."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StrandFigure(Figure):
    """Fig. 5: force as a function of displacement, and rigidity as a function of tension.

    Attributes:
        tension: F (N,) [N].
        displacement: Elongation of a wire of 0.5 m from 2.2 N on, `∫ l_0 dF/EA` (N,) [m].
        tangent: Tangent rigidity EA of the repaired Eq. 19 (N,) [N].
        secant: Secant rigidity (Eq. 18) of the repaired Eq. 19 (N,) [N].
        printed: EA by Eq. 19 as printed (N,) [N].
        gauge_length: Length of the tested wire [m]. It is assumed: the paper does not give it.
        join: Tension at which the two branches of Eq. 19 meet [N].
    """

    tension: Array = field(metadata=unit("N", "point"))
    displacement: Array = field(metadata=unit("m", "point"))
    tangent: Array = field(metadata=unit("N", "point", name="tangent_rigidity"))
    secant: Array = field(metadata=unit("N", "point", name="secant_rigidity"))
    printed: Array = field(metadata=unit("N", "point", name="as_printed"))
    gauge_length: float = field(default=GAUGE_LENGTH, metadata=unit("m"))
    join: float = JOIN


def eq19_as_printed(tension: ArrayLike) -> Array:
    """Compute EA [N] at each ``tension`` [N] by Eq. 19 with its misprint.

    The values from 11 to 31 N are negative.
    """
    F = np.asarray(tension, dtype=np.float64)
    lower, upper = EQ19_PRINTED
    return np.where(F <= JOIN, polyval(F, (*lower[:-1], -1e-3)), polyval(F, upper))


def left_open(tension: float) -> tuple[float, float]:
    """Return the least and largest EA [N] above 31 N, by coefficients that round to the printed."""
    middle = float(eq19_as_printed(tension))
    half = float(polyval(tension, HALF_UNITS[1]))
    return middle - half, middle + half


def law_of_stretched_length(law: Elasticity) -> Elasticity:
    """Return the law with which `EA/l_0` is EA/L of ``law``: the stiffness of a wire in the paper.

    The paper takes the stretched length L of a wire for its original length `l_0`. With the strain
    `ε = ∫ dF/EA` of ``law`` this is exactly a wire of another law, `EA′ = EA exp(−ε)`: its strain
    is `ε′ = exp(ε) − 1`, so that `EA′/l_0 = EA′ (1 + ε′)/L = EA/L`. It ends where ``law``
    does, at 10 kN at most.
    """
    joins = law.arguments.get("joins", ())
    high = min(law.high, _STRONGEST)

    def rigidity(F: Array) -> Array:
        strain, EA = law.strain_and_rigidity(F)
        return EA * np.exp(-strain)

    return Elasticity.from_rigidity(rigidity, law.low, high, joins)


def figure_5() -> StrandFigure:
    """Compute Fig. 5 for a 1×19 strand."""
    law = presets.STRAND_1X19
    tension = np.concatenate([np.linspace(2.25, JOIN, 80), np.linspace(31.01, law.high, 120)])
    flat = law.rigidity(np.linspace(*LEVEL, 400))
    first = "first coefficient for which the branches meet at 31 N, times 1e4"
    jump = "EA at 31 N from the lower over that from the upper polynomial, as printed"
    end = "EA at 810 N, least and largest within the printed digits"
    rise = "rise of EA from least to largest, 400 to 810 N (paper: near-constant)"
    misprint = "misprint: −1e-3 for −1e-4; all other digits as printed"
    level = "Eq. 19 most level within its digits"
    steps = eq19_as_printed([JOIN])
    claims: list[tuple[str, str, tuple[float] | None, Iterable[float], str]] = [
        (first, "N⁻⁵", (-10.0,), [1e4 * law.coefficients[0][-1]], misprint),
        (jump, "-", (1.0,), steps / law.polynomial(JOIN), "none: a misprint"),
        (end, "kN", None, (1e-3 * EA for EA in left_open(LEVEL[1])), "none"),
        (rise, "%", None, [100.0 * (flat.max() / flat.min() - 1.0)], level),
    ]
    return StrandFigure(
        name="fig5",
        title="Fig. 5: tensile test of the 1×19 strand, as Eq. 19 implies it",
        tension=frozen(tension),
        displacement=frozen(GAUGE_LENGTH * law.strain(tension)),
        tangent=frozen(law.rigidity(tension)),
        secant=frozen(law.secant_rigidity(tension)),
        printed=frozen(eq19_as_printed(tension)),
        claims=tuple(
            Claim(
                "Fig. 5",
                what,
                unit_text,
                paper,
                floats(x),
                assumption=why,
                misprint=paper is not None,
            )
            for what, unit_text, paper, x, why in claims
        ),
    )

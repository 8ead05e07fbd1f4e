"""Fig. 5 of the paper: the strand's tensile test, as its Eq. 19 implies it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

import numpy as np

from cdsm import presets
from cdsm._checks import Array, frozen
from cdsm.paper.figures import Claim
from cdsm.wire import StrandElasticity

GAUGE_LENGTH: Final = 0.5
"""Length of the tested wire [m]: assumed, since the paper does not give it."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StrandFigure:
    """Fig. 5: force over displacement, and rigidity over tension.

    Attributes:
        name: ``"fig5"``.
        title: What it shows.
        gauge_length: Length of the tested wire [m].
        tension: F (N,) [N].
        displacement: Stretch of the wire from 2.2 N on, ∫ l_0 dF/EA (N,) [m].
        tangent: EA of the repaired Eq. 19 (N,) [N].
        secant: Its secant, Eq. 18 (N,) [N].
        printed: Eq. 19 as printed (N,) [N].
        claims: What the paper says of it.
    """

    name: str
    title: str
    gauge_length: float
    tension: Array
    displacement: Array
    tangent: Array
    secant: Array
    printed: Array
    claims: tuple[Claim, ...]


def figure_5(gauge_length: float = GAUGE_LENGTH) -> StrandFigure:
    """Force over displacement and rigidity over tension of the 1×19 strand.

    Args:
        gauge_length: Length of the tested wire [m].
    """
    law, printed = presets.STRAND_1X19, StrandElasticity.eq19_as_printed()
    tension = np.concatenate([np.linspace(2.25, 31.0, 80), np.linspace(31.01, law.high, 200)])
    just_above = float(law.polynomial(np.nextafter(31.0, 32.0)))
    level = law.rigidity([400.0, law.high])
    return StrandFigure(
        name="fig5",
        title="Fig. 5: tensile test of the 1×19 strand, as Eq. 19 implies it",
        gauge_length=gauge_length,
        tension=frozen(tension),
        displacement=frozen(gauge_length * law.strain(tension)),
        tangent=frozen(law.rigidity(tension)),
        secant=frozen(law.secant_rigidity(tension)),
        printed=frozen(printed.polynomial(tension)),
        claims=(
            _claim(
                "EA at 31 N from the lower over that from the upper polynomial",
                "-",
                (1.0,),
                float(law.polynomial(31.0)) / just_above,
                "Eq. 19 with its first coefficient read as −1e-4",
            ),
            _claim(
                "the same, Eq. 19 as printed",
                "-",
                (1.0,),
                float(printed.polynomial(31.0)) / just_above,
                "none: a misprint",
            ),
            _claim(
                "rise of EA from 400 to 810 N (paper: near-constant)",
                "%",
                None,
                100.0 * float(level[1] / level[0] - 1.0),
                "Eq. 19",
            ),
        ),
    )


def _claim(
    quantity: str, unit: str, paper: tuple[float, ...] | None, computed: float, assumption: str
) -> Claim:
    return Claim(
        figure="Fig. 5",
        quantity=quantity,
        unit=unit,
        paper=paper,
        computed=(computed,),
        along=(),
        assumption=assumption,
    )

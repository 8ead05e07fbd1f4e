"""Figs. 3, 4, 6, 7 and 8 of the paper, recomputed.

What the paper leaves open is filled in by :mod:`cdsm.presets` and by the assumptions that each
claim carries, which also says which of them were searched to meet the paper's number. Every number
is given thrice: as the paper computes it, K_R read as ``pseudoinverse`` and a cable's original
length as its stretched one; the same with the original length; and as the stiffness that a small
weight hung at the tip would measure, ``along``, with the original length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, final

import numpy as np
from scipy.optimize import brentq

from cdsm import presets
from cdsm.arm_model import OriginalLength
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.manipulator import Manipulator
from cdsm.paper.digits import LEVEL
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import Array, frozen
from cdsm.tension import distribute_tension

Part = Literal["active", "passive"]

STRAND_END: Final = presets.STRAND_1X19.high
"""Tension [N] at which the strand's elastic stage ends, by the text of Section IV-C."""

STRETCHED: Final[OriginalLength] = "stretched"
UNSTRAINED: Final[OriginalLength] = "unstrained"

_POINTS = 25


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """Stiffness in x, y and z over a swept quantity.

    Attributes:
        label: What distinguishes this curve in its figure.
        original_length: As of its :class:`~cdsm.Manipulator`.
        swept: The swept quantity (N,): Young's modulus [Pa] or lower bound of tension [N].
        tension: Smallest, mean and largest cable tension (N, 3) [N].
        pseudoinverse: Diagonal of the paper's K_R (N, 3) [N/m].
        pseudoinverse_part: The same of one term of K_θ alone, the figure's ``part``.
        along: Stiffness that a small weight measures along x, y, z (N, 3) [N/m].
        along_part: What that term carries of it.
    """

    label: str
    original_length: OriginalLength
    swept: Array
    tension: Array
    pseudoinverse: Array
    pseudoinverse_part: Array
    along: Array
    along_part: Array


@final
@dataclass(frozen=True, kw_only=True)
class Claim:
    """What the paper says of a figure, and what comes out.

    Attributes:
        figure: Name of the figure.
        quantity: What is compared.
        unit: Unit of all numbers.
        paper: The paper's numbers, x, y, z or one; None where it gives words only.
        computed: Ours, in the paper's reading: pseudo-inverse, and l_0 = L.
        original: Ours, the pseudo-inverse with the original length; empty where no cable strains.
        along: Ours, for a small weight hung at the tip, with the original length; empty where no
            arm is involved.
        assumption: What the paper leaves open and we chose.
        searched: Which of these assumptions were searched for the paper's number; empty: none.
        at_most: Whether the paper's number is an upper bound.
    """

    figure: str
    quantity: str
    unit: str
    paper: tuple[float, ...] | None
    computed: tuple[float, ...]
    original: tuple[float, ...]
    along: tuple[float, ...]
    assumption: str
    searched: str = ""
    at_most: bool = False

    @property
    def difference(self) -> tuple[float, ...] | None:
        """Computed minus the paper's, in :attr:`unit`; None where that means nothing."""
        if self.paper is None or self.at_most:
            return None
        return tuple(ours - theirs for ours, theirs in zip(self.computed, self.paper, strict=True))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Figure:
    """One figure of the paper.

    Attributes:
        name: ``"fig3"`` and so on.
        title: What it shows.
        swept: Name of the swept quantity: ``"young_modulus"`` or ``"tension"``.
        part: Name of the term of K_θ shown beside the total.
        curves: Its curves, original lengths taken as the stretched ones, as in the paper.
        original: The same curves with the original lengths.
        postures: Where each curve was computed.
        claims: What the paper says of it.
    """

    name: str
    title: str
    swept: Literal["young_modulus", "tension"]
    part: Part
    curves: tuple[Curve, ...]
    original: tuple[Curve, ...]
    postures: tuple[Posture, ...]
    claims: tuple[Claim, ...]


PROTOTYPE: Final = "three cables a joint, 0.5 kg a link, gravity along −y, no lead"
"""What the virtual prototype of all these figures assumes besides the stated dimensions."""

SEARCHED: Final = (
    "cables, link, mass, gravity, hole phase, lower bound and reading of K_R, for this row"
)
"""What was searched for Fig. 6."""

KEPT: Final = "prototype searched for Fig. 6"
"""What the other figures take over from it."""


def figure_3() -> Figure:
    """Passive and total stiffness over Young's modulus, 160 to 320 GPa, at equal tensions."""
    moduli = np.linspace(160e9, 320e9, _POINTS)

    def pair(minimum: float) -> _Pair:
        def curve(length: OriginalLength) -> Curve:
            arms = [_prototype(_wire(modulus), length) for modulus in moduli]
            results = [_at_minimum(arm, _TEN, minimum) for arm in arms]
            return _curve(f"lower bound {minimum:g} N", length, "passive", moduli, results)

        return _pair(curve)

    pairs = [pair(50.0), pair(800.0)]
    return Figure(
        name="fig3",
        title="Fig. 3: stiffness over Young's modulus, cable tension constant",
        swept="young_modulus",
        part="passive",
        curves=tuple(pair.stretched for pair in pairs),
        original=tuple(pair.unstrained for pair in pairs),
        postures=(presets.virtual_prototype().at(_TEN),) * len(pairs),
        claims=(
            _claim(
                pairs[0],
                _ratio,
                figure="Fig. 3",
                quantity="stiffness at 320 GPa over stiffness at 160 GPa (proportional: 2)",
                unit="-",
                paper=(2.0, 2.0, 2.0),
                assumption="solid wire of 1.2 mm, lower bound 50 N",
                searched=KEPT,
            ),
            *(
                _claim(
                    pair,
                    _largest_gap,
                    figure="Fig. 3",
                    quantity="largest difference of passive and total stiffness",
                    unit="%",
                    paper=(1.5,),
                    assumption=f"solid wire of 1.2 mm, {pair.stretched.label}",
                    searched=KEPT,
                    at_most=True,
                )
                for pair in pairs
            ),
        ),
    )


def figure_4() -> Figure:
    """Active and total stiffness over tension, with constant cable elasticity."""
    minima = np.linspace(100.0, 800.0, _POINTS)
    laws = {
        "EA = 48 kN (the strand in its elastic stage)": presets.ELASTIC_STAGE,
        "EA = 226 kN (solid wire, the stated 200 GPa)": presets.STEEL_WIRE_200GPA,
    }
    pairs = [_over_minimum(label, law, _TEN, minima) for label, law in laws.items()]
    return Figure(
        name="fig4",
        title="Fig. 4: stiffness over cable tension, cable elasticity constant",
        swept="tension",
        part="active",
        curves=tuple(pair.stretched for pair in pairs),
        original=tuple(pair.unstrained for pair in pairs),
        postures=(presets.virtual_prototype().at(_TEN),) * len(pairs),
        claims=tuple(
            _claim(
                pair,
                _percent,
                figure="Fig. 4",
                quantity="change of stiffness with tension",
                unit="%",
                paper=(-1.46, -1.04, -1.43),
                assumption=f"{pair.stretched.label}, lower bound 100 to 800 N",
                searched=searched,
            )
            for pair, searched in zip(
                pairs, (f"EA, range of tension; {KEPT}", f"range of tension; {KEPT}"), strict=True
            )
        ),
    )


def figure_6() -> Figure:
    """Stiffness over tension in the pre-tensioning stage, with Eq. 19."""
    pair = _over_minimum("Eq. 19", presets.STRAND_1X19, _TEN, np.linspace(15.0, 120.0, _POINTS))
    return Figure(
        name="fig6",
        title="Fig. 6: stiffness over cable tension in the pre-tensioning stage, Eq. 19",
        swept="tension",
        part="active",
        curves=(pair.stretched,),
        original=(pair.unstrained,),
        postures=(presets.virtual_prototype().at(_TEN),),
        claims=(
            _claim(
                pair,
                _increment,
                figure="Fig. 6",
                quantity="increment of stiffness, (last − first)/first",
                unit="times",
                paper=(4.24, 2.9, 4.57),
                assumption=f"{PROTOTYPE}; Eq. 19 repaired, lower bound 15 to 120 N",
                searched=SEARCHED,
            ),
        ),
    )


def figure_7() -> Figure:
    """Stiffness over tension in the elastic stage, EA constant."""
    highest = _highest_minimum(presets.virtual_prototype().at(_TEN))
    pair = _over_minimum(
        "EA = 48 kN", presets.ELASTIC_STAGE, _TEN, np.linspace(120.0, highest, _POINTS)
    )
    return Figure(
        name="fig7",
        title="Fig. 7: stiffness over cable tension in the elastic stage, EA constant",
        swept="tension",
        part="active",
        curves=(pair.stretched,),
        original=(pair.unstrained,),
        postures=(presets.virtual_prototype().at(_TEN),),
        claims=(
            _claim(
                pair,
                _percent,
                figure="Fig. 7",
                quantity="change in the elastic stage",
                unit="%",
                paper=(-1.5, -0.6, -1.6),
                assumption=f"EA = 48 kN, tensions from 120 N to {STRAND_END:g} N "
                f"(lower bound to {highest:.0f} N)",
                searched=f"EA, for Fig. 4; {KEPT}",
            ),
        ),
    )


def figure_8() -> Figure:
    """Stiffness over the whole range of tension, at three postures."""
    arm = presets.virtual_prototype()
    pairs, claims = [], []
    for label, q in FIGURE_8_POSTURES.items():
        highest = _highest_minimum(arm.at(q))
        # dense where the pre-tensioning stage is steep
        minima = np.geomspace(5.0, highest, 2 * _POINTS)
        pair = _over_minimum(label, presets.STRAND_1X19, q, minima)
        pairs.append(pair)
        claims += [
            _claim(
                pair,
                _increment,
                figure="Fig. 8",
                quantity="rise of stiffness over the whole range, (last − first)/first",
                unit="times",
                paper=None,
                assumption=f"{label}; Eq. 19 repaired, lower bound 5 to {highest:.0f} N",
                searched=KEPT,
            ),
            _claim(
                _over_minimum(label, presets.STRAND_1X19, q, np.array([LEVEL[0], highest])),
                _percent,
                figure="Fig. 8",
                quantity="change at the end of the range (paper: a slight decrease)",
                unit="%",
                paper=None,
                assumption=f"{label}; Eq. 19 most level within its digits, lower bound "
                f"{LEVEL[0]:g} to {highest:.0f} N",
                searched=KEPT,
            ),
        ]
    return Figure(
        name="fig8",
        title="Fig. 8: stiffness over the whole range of tension, Eq. 19, three postures",
        swept="tension",
        part="active",
        curves=tuple(pair.stretched for pair in pairs),
        original=tuple(pair.unstrained for pair in pairs),
        postures=tuple(arm.at(q) for q in FIGURE_8_POSTURES.values()),
        claims=tuple(claims),
    )


_TEN = np.full(10, presets.TEN_DEGREES)

FIGURE_8_POSTURES: Final = {
    "all joints 10°": _TEN,
    "arc: 15° about y": np.deg2rad([15.0, 0.0] * 5),
    "S: 12° up, then 12° down": np.deg2rad([12.0, 6.0] * 2 + [0.0, 0.0] + [-12.0, -6.0] * 2),
}
"""Postures of Fig. 8 [rad]: assumed, since the paper shows them as pictures only."""


class _Pair(NamedTuple):
    """A curve in both readings of the original length."""

    stretched: Curve
    unstrained: Curve


def _pair(curve: Callable[[OriginalLength], Curve]) -> _Pair:
    return _Pair(curve(STRETCHED), curve(UNSTRAINED))


def _prototype(law: Elasticity, length: OriginalLength) -> Manipulator:
    return presets.virtual_prototype(law, original_length=length)


def _wire(modulus: float) -> LinearElasticity:
    return LinearElasticity.of_wire(modulus, presets.STRAND_DIAMETER)


def _at_minimum(arm: Manipulator, q: Array, minimum: float) -> Stiffness:
    pose = arm.at(q)
    return stiffness(pose, distribute_tension(pose, minimum))


def _over_minimum(label: str, law: Elasticity, q: Array, minima: Array) -> _Pair:
    def curve(length: OriginalLength) -> Curve:
        arm = _prototype(law, length)
        results = [_at_minimum(arm, q, minimum) for minimum in minima]
        return _curve(label, length, "active", minima, results)

    return _pair(curve)


def _curve(
    label: str, length: OriginalLength, part: Part, swept: Array, results: Sequence[Stiffness]
) -> Curve:
    axes = np.eye(3)
    return Curve(
        label=label,
        original_length=length,
        swept=frozen(np.array(swept)),
        tension=_table([(K.tension.min(), K.tension.mean(), K.tension.max()) for K in results]),
        pseudoinverse=_table([np.diag(K.pseudoinverse()) for K in results]),
        pseudoinverse_part=_table([np.diag(K.pseudoinverse(part)) for K in results]),
        along=_table([[K.along(axis) for axis in axes] for K in results]),
        along_part=_table(
            [[getattr(K.shares(axis), part).sum() for axis in axes] for K in results]
        ),
    )


def _table(rows: Sequence[Sequence[float] | Array]) -> Array:
    return frozen(np.array(rows, dtype=np.float64))


def _highest_minimum(pose: Posture) -> float:
    """The lower bound [N] at which the largest tension reaches the end of the elastic stage."""

    def excess(minimum: float) -> float:
        return float(distribute_tension(pose, minimum).values.max()) - STRAND_END

    bound: float = brentq(excess, 5.0, STRAND_END, xtol=1e-6)
    return bound - 1e-3  # safely inside the elasticity's domain


def _claim(
    pair: _Pair,
    measure: Callable[[Array, Array], Array],
    *,
    figure: str,
    quantity: str,
    unit: str,
    paper: tuple[float, ...] | None,
    assumption: str,
    searched: str = "",
    at_most: bool = False,
) -> Claim:
    """A claim about one curve, measured alike in all readings."""
    ours, true = pair
    return Claim(
        figure=figure,
        quantity=quantity,
        unit=unit,
        paper=paper,
        computed=tuple(measure(ours.pseudoinverse, ours.pseudoinverse_part).tolist()),
        original=tuple(measure(true.pseudoinverse, true.pseudoinverse_part).tolist()),
        along=tuple(measure(true.along, true.along_part).tolist()),
        assumption=assumption,
        searched=searched,
        at_most=at_most,
    )


def _ratio(total: Array, _: Array) -> Array:
    ratio: Array = total[-1] / total[0]
    return ratio


def _increment(total: Array, part: Array) -> Array:
    return _ratio(total, part) - 1.0


def _percent(total: Array, part: Array) -> Array:
    return 100.0 * _increment(total, part)


def _largest_gap(total: Array, part: Array) -> Array:
    return np.array([100.0 * abs(part / total - 1.0).max()])

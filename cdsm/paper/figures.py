"""Figs. 3, 4, 6, 7 and 8 of the paper, recomputed.

What the paper leaves open is filled in by :mod:`cdsm.presets` and by the assumptions that each
claim carries. Every number is given in the paper's reading of K_R, ``pseudoinverse``, and as the
stiffness that a weight hung at the tip would measure, ``along``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, final

import numpy as np
from scipy.optimize import brentq

from cdsm import presets
from cdsm._checks import Array, frozen
from cdsm.elasticity import LinearElasticity
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.stiffness import Stiffness, stiffness
from cdsm.tension import distribute_tension
from cdsm.wire import StrandElasticity

Part = Literal["active", "passive"]

STRAND_END: Final = presets.STRAND_1X19.high
"""Tension [N] at which the strand's elastic stage ends, by the text of Section IV-C."""

_LEVEL = 400.0
"""Tension [N] from which the text calls EA near-constant (Section IV-C)."""

_POINTS = 25


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """Stiffness in x, y and z over a swept quantity.

    Attributes:
        label: What distinguishes this curve in its figure.
        swept: The swept quantity (N,): Young's modulus [Pa] or lower bound of tension [N].
        tension: Smallest, mean and largest cable tension (N, 3) [N].
        pseudoinverse: Diagonal of the paper's K_R (N, 3) [N/m].
        pseudoinverse_part: The same of one term of K_θ alone, the figure's ``part``.
        along: Stiffness that a weight measures along x, y, z (N, 3) [N/m].
        along_part: What that term carries of it.
    """

    label: str
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
        computed: Ours, in the paper's reading.
        along: Ours, for a weight hung at the tip; empty where no arm is involved.
        assumption: What the paper leaves open and we chose.
        at_most: Whether the paper's number is an upper bound.
    """

    figure: str
    quantity: str
    unit: str
    paper: tuple[float, ...] | None
    computed: tuple[float, ...]
    along: tuple[float, ...]
    assumption: str
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
        curves: Its curves.
        postures: Where each curve was computed.
        claims: What the paper says of it.
    """

    name: str
    title: str
    swept: Literal["young_modulus", "tension"]
    part: Part
    curves: tuple[Curve, ...]
    postures: tuple[Posture, ...]
    claims: tuple[Claim, ...]


def figure_3() -> Figure:
    """Passive and total stiffness over Young's modulus, 160 to 320 GPa, at equal tensions."""
    moduli = np.linspace(160e9, 320e9, _POINTS)
    arms = [presets.virtual_prototype(_wire(modulus)) for modulus in moduli]
    curves = [
        _curve(
            f"lower bound {minimum:g} N",
            "passive",
            moduli,
            [_at_minimum(arm, _TEN, minimum) for arm in arms],
        )
        for minimum in (50.0, 800.0)
    ]
    return Figure(
        name="fig3",
        title="Fig. 3: stiffness over Young's modulus, cable tension constant",
        swept="young_modulus",
        part="passive",
        curves=tuple(curves),
        postures=(arms[0].at(_TEN),) * len(curves),
        claims=(
            _claim(
                curves[0],
                _ratio,
                figure="Fig. 3",
                quantity="stiffness at 320 GPa over stiffness at 160 GPa (proportional: 2)",
                unit="-",
                paper=(2.0, 2.0, 2.0),
                assumption="solid wire of 1.2 mm, lower bound 50 N",
            ),
            *(
                _claim(
                    curve,
                    _largest_gap,
                    figure="Fig. 3",
                    quantity="largest difference of passive and total stiffness",
                    unit="%",
                    paper=(1.5,),
                    assumption=f"solid wire of 1.2 mm, {curve.label}",
                    at_most=True,
                )
                for curve in curves
            ),
        ),
    )


def figure_4() -> Figure:
    """Active and total stiffness over tension, with constant cable elasticity."""
    minima = np.linspace(100.0, 800.0, _POINTS)
    laws = {
        "EA = 48 kN (the strand in its elastic stage)": presets.ELASTIC_STAGE,
        "EA = 226 kN (solid wire, 200 GPa)": presets.STEEL_WIRE_200GPA,
    }
    curves = [
        _over_minimum(label, presets.virtual_prototype(law), _TEN, minima)
        for label, law in laws.items()
    ]
    return Figure(
        name="fig4",
        title=f"Fig. 4: stiffness over cable tension, {curves[0].label}",
        swept="tension",
        part="active",
        curves=(curves[0],),
        postures=(presets.virtual_prototype(presets.ELASTIC_STAGE).at(_TEN),),
        claims=tuple(
            _claim(
                curve,
                _percent,
                figure="Fig. 4",
                quantity="change of stiffness with tension",
                unit="%",
                paper=(-1.46, -1.04, -1.43),
                assumption=f"{curve.label}, lower bound 100 to 800 N",
            )
            for curve in curves
        ),
    )


def figure_6() -> Figure:
    """Stiffness over tension in the pre-tensioning stage, with Eq. 19."""
    arm = presets.virtual_prototype()
    curve = _over_minimum("Eq. 19, repaired", arm, _TEN, np.linspace(15.0, 120.0, _POINTS))
    return Figure(
        name="fig6",
        title="Fig. 6: stiffness over cable tension in the pre-tensioning stage, Eq. 19",
        swept="tension",
        part="active",
        curves=(curve,),
        postures=(arm.at(_TEN),),
        claims=(
            _claim(
                curve,
                _increment,
                figure="Fig. 6",
                quantity="increment of stiffness, (last − first)/first",
                unit="times",
                paper=(4.24, 2.9, 4.57),
                assumption="Eq. 19 repaired, lower bound 15 to 120 N",
            ),
        ),
    )


def figure_7() -> Figure:
    """Stiffness over tension in the elastic stage, EA constant."""
    arm = presets.virtual_prototype(presets.ELASTIC_STAGE)
    highest = _highest_minimum(arm.at(_TEN))
    curve = _over_minimum("EA = 48 kN", arm, _TEN, np.linspace(120.0, highest, _POINTS))
    return Figure(
        name="fig7",
        title="Fig. 7: stiffness over cable tension in the elastic stage, EA constant",
        swept="tension",
        part="active",
        curves=(curve,),
        postures=(arm.at(_TEN),),
        claims=(
            _claim(
                curve,
                _percent,
                figure="Fig. 7",
                quantity="change of stiffness with tension",
                unit="%",
                paper=(-1.5, -0.6, -1.6),
                assumption=f"EA = 48 kN, tensions from 120 N to {STRAND_END:g} N "
                f"(lower bound to {highest:.0f} N)",
            ),
        ),
    )


def figure_8() -> Figure:
    """Stiffness over the whole range of tension, at three postures."""
    arm = presets.virtual_prototype()
    laws = {
        "Eq. 19 repaired": presets.STRAND_1X19,
        f"EA constant from {_LEVEL:g} N on": _levelled(_LEVEL),
    }
    curves, claims = [], []
    for label, q in FIGURE_8_POSTURES.items():
        highest = _highest_minimum(arm.at(q))
        # dense where the pre-tensioning stage is steep
        curve = _over_minimum(label, arm, q, np.geomspace(5.0, highest, 2 * _POINTS))
        curves.append(curve)
        claims.append(
            _claim(
                curve,
                _increment,
                figure="Fig. 8",
                quantity="rise of stiffness over the whole range, (last − first)/first",
                unit="times",
                paper=None,
                assumption=f"{label}; Eq. 19 repaired, lower bound 5 to {highest:.0f} N",
            )
        )
        for name, law in laws.items():
            ends = np.array([_LEVEL, highest])
            claims.append(
                _claim(
                    _over_minimum(name, presets.virtual_prototype(law), q, ends),
                    _percent,
                    figure="Fig. 8",
                    quantity="change at the end of the range (paper: a slight decrease)",
                    unit="%",
                    paper=None,
                    assumption=f"{label}; {name}, lower bound {_LEVEL:g} to {highest:.0f} N",
                )
            )
    return Figure(
        name="fig8",
        title="Fig. 8: stiffness over the whole range of tension, Eq. 19, three postures",
        swept="tension",
        part="active",
        curves=tuple(curves),
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


def _wire(modulus: float) -> LinearElasticity:
    return LinearElasticity.of_wire(modulus, presets.STRAND_DIAMETER)


def _levelled(tension: float) -> StrandElasticity:
    """Eq. 19 with EA held constant from a tension on, as the text describes the elastic stage."""
    law = presets.STRAND_1X19
    level = float(law.rigidity(tension))
    return StrandElasticity((*law.coefficients, (level,)), (*law.joins, tension), law.low, law.high)


def _at_minimum(arm: Manipulator, q: Array, minimum: float) -> Stiffness:
    pose = arm.at(q)
    return stiffness(pose, distribute_tension(pose, minimum))


def _over_minimum(label: str, arm: Manipulator, q: Array, minima: Array) -> Curve:
    return _curve(label, "active", minima, [_at_minimum(arm, q, minimum) for minimum in minima])


def _curve(label: str, part: Part, swept: Array, results: Sequence[Stiffness]) -> Curve:
    axes = np.eye(3)
    return Curve(
        label=label,
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
    curve: Curve,
    measure: Callable[[Array, Array], Array],
    *,
    figure: str,
    quantity: str,
    unit: str,
    paper: tuple[float, ...] | None,
    assumption: str,
    at_most: bool = False,
) -> Claim:
    """A claim about one curve, measured alike in both readings."""
    return Claim(
        figure=figure,
        quantity=quantity,
        unit=unit,
        paper=paper,
        computed=tuple(measure(curve.pseudoinverse, curve.pseudoinverse_part).tolist()),
        along=tuple(measure(curve.along, curve.along_part).tolist()),
        assumption=assumption,
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

"""Figs. 3, 4, 6, 7 and 8 of the paper, recomputed.

:mod:`cdsm.presets` and the assumptions of each claim fill in what the paper leaves open. A claim
also says which assumptions were searched to meet the paper's number. Every number is computed in
three readings: ``pseudoinverse`` with the stretched length as original length, as in the paper;
``pseudoinverse`` with the original length; and ``along`` with the original length, the stiffness
that a small weight at the tip measures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, Literal, final

import numpy as np
from scipy.optimize import brentq

from cdsm import presets
from cdsm.cable_laws import OriginalLength
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.manipulator import Manipulator
from cdsm.paper.claims import Claim, Figure, floats
from cdsm.paper.digits import LEVEL
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import Array, frozen
from cdsm.tension import distribute_tension

Part = Literal["active", "passive"]
Swept = Literal["young_modulus", "tension"]

STRAND_END: Final = presets.STRAND_1X19.high
"""Tension [N] at which the elastic stage of the strand ends (text of Section IV-C)."""

PROTOTYPE: Final = "three cables a joint, 0.5 kg a link, gravity along −y, no lead"
"""Assumptions of the virtual prototype in all figures, besides the stated dimensions."""

SEARCHED: Final = (
    "cables, link, mass, gravity, hole phase, lower bound and reading of K_R, for this row"
)
"""Text of ``Claim.searched`` for Fig. 6."""

KEPT: Final = "prototype searched for Fig. 6"
"""Text of ``Claim.searched`` for the other figures, which keep the prototype of Fig. 6."""

_TEN = np.full(10, presets.TEN_DEGREES)
FIGURE_8_POSTURES: Final = {
    "all joints 10°": _TEN,
    "arc: 15° about y": np.deg2rad([15.0, 0.0] * 5),
    "S: 12° up, then 12° down": np.deg2rad([12.0, 6.0] * 2 + [0.0, 0.0] + [-12.0, -6.0] * 2),
}
"""Postures of Fig. 8 [rad]. They are assumed: the paper shows only pictures."""

_POINTS = 25


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """Stiffness in x, y and z over a swept quantity.

    Attributes:
        label: Name of the curve in its figure.
        original_length: ``original_length`` of the :class:`~cdsm.Manipulator`.
        swept: Swept quantity (N,): Young's modulus [Pa] or lower bound of tension [N].
        tension: Smallest, mean and largest cable tension (N, 3) [N].
        pseudoinverse: Diagonal of the paper's K_R (N, 3) [N/m].
        pseudoinverse_part: Diagonal of K_R of the figure's ``part`` of K_θ alone (N, 3) [N/m].
        along: Stiffness that a small weight measures along x, y, z (N, 3) [N/m].
        along_part: Share of ``part`` in ``along`` (N, 3) [N/m].
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
@dataclass(frozen=True, eq=False, kw_only=True)
class StiffnessFigure(Figure):
    """A figure of stiffness over Young's modulus or tension.

    Attributes:
        swept: Name of the swept quantity.
        part: Name of the term of K_θ shown beside the total.
        curves: Curves with the stretched length as original length, as in the paper.
        original: Curves of the same cases with the original length.
        postures: Posture of each curve.
    """

    swept: Swept
    part: Part
    curves: tuple[Curve, ...]
    original: tuple[Curve, ...]
    postures: tuple[Posture, ...]

    def numbers(self) -> dict[str, object]:
        """Return the curves as plain SI numbers, for JSON."""
        swept = {"young_modulus": "young_modulus_Pa", "tension": "minimum_tension_N"}[self.swept]
        return {
            "postures_rad": [pose.q.tolist() for pose in self.postures],
            "curves": [
                {
                    "label": curve.label,
                    "original_length": curve.original_length,
                    swept: curve.swept.tolist(),
                    "tension_min_mean_max_N": curve.tension.tolist(),
                    "pseudoinverse_xyz_N_per_m": curve.pseudoinverse.tolist(),
                    "along_xyz_N_per_m": curve.along.tolist(),
                    f"{self.part}_part": {
                        "pseudoinverse_xyz_N_per_m": curve.pseudoinverse_part.tolist(),
                        "along_xyz_N_per_m": curve.along_part.tolist(),
                    },
                }
                for curve in (*self.curves, *self.original)
            ],
        }


_Pair = tuple[Curve, Curve]
"""Two curves of one case: with the stretched length (as in the paper), with the original one."""


def figure_3() -> StiffnessFigure:
    """Compute passive and total stiffness over Young's modulus, 160 to 320 GPa, fixed tension."""
    moduli = np.linspace(160e9, 320e9, _POINTS)
    laws = [LinearElasticity.of_wire(modulus, presets.STRAND_DIAMETER) for modulus in moduli]
    pairs = [
        _pair(f"lower bound {bound:g} N", _TEN, [(law, bound) for law in laws], moduli, "passive")
        for bound in (50.0, 800.0)
    ]
    claims = [
        _claim(
            pairs[0],
            _ratio,
            figure="Fig. 3",
            quantity="stiffness at 320 GPa over stiffness at 160 GPa (proportional: 2)",
            unit="-",
            paper=(2.0, 2.0, 2.0),
            assumption="solid wire of 1.2 mm, lower bound 50 N",
            searched=KEPT,
        )
    ]
    claims += [
        _claim(
            pair,
            _largest_gap,
            figure="Fig. 3",
            quantity="largest difference of passive and total stiffness",
            unit="%",
            paper=(1.5,),
            assumption=f"solid wire of 1.2 mm, {pair[0].label}",
            searched=KEPT,
            at_most=True,
        )
        for pair in pairs
    ]
    title = "Fig. 3: stiffness over Young's modulus, cable tension constant"
    return _figure("fig3", title, pairs, claims, [_TEN] * 2, "young_modulus", "passive")


def figure_4() -> StiffnessFigure:
    """Compute active and total stiffness over tension, with constant EA."""
    minima = np.linspace(100.0, 800.0, _POINTS)
    strand, wire = (
        _over_minimum(label, law, _TEN, minima)
        for label, law in (
            ("EA = 48 kN (the strand in its elastic stage)", presets.ELASTIC_STAGE),
            ("EA = 226 kN (solid wire, the stated 200 GPa)", presets.STEEL_WIRE_200GPA),
        )
    )
    claims = [
        _claim(
            pair,
            _percent,
            figure="Fig. 4",
            quantity="change of stiffness with tension",
            unit="%",
            paper=(-1.46, -1.04, -1.43),
            assumption=f"{pair[0].label}, lower bound 100 to 800 N",
            searched=searched,
        )
        for pair, searched in (
            (strand, f"EA, range of tension; {KEPT}"),
            (wire, f"range of tension; {KEPT}"),
        )
    ]
    title = "Fig. 4: stiffness over cable tension, cable elasticity constant"
    return _figure("fig4", title, [strand, wire], claims, [_TEN] * 2)


def figure_6() -> StiffnessFigure:
    """Compute stiffness over tension in the pre-tensioning stage, with Eq. 19."""
    pair = _over_minimum("Eq. 19", presets.STRAND_1X19, _TEN, np.linspace(15.0, 120.0, _POINTS))
    claim = _claim(
        pair,
        _increment,
        figure="Fig. 6",
        quantity="increment of stiffness, (last − first)/first",
        unit="times",
        paper=(4.24, 2.9, 4.57),
        assumption=f"{PROTOTYPE}; Eq. 19 repaired, lower bound 15 to 120 N",
        searched=SEARCHED,
    )
    title = "Fig. 6: stiffness over cable tension in the pre-tensioning stage, Eq. 19"
    return _figure("fig6", title, [pair], [claim], [_TEN])


def figure_7() -> StiffnessFigure:
    """Compute stiffness over tension in the elastic stage, with constant EA."""
    highest = _highest_minimum(presets.virtual_prototype().at(_TEN))
    minima = np.linspace(120.0, highest, _POINTS)
    pair = _over_minimum("EA = 48 kN", presets.ELASTIC_STAGE, _TEN, minima)
    claim = _claim(
        pair,
        _percent,
        figure="Fig. 7",
        quantity="change in the elastic stage",
        unit="%",
        paper=(-1.5, -0.6, -1.6),
        assumption=f"EA = 48 kN, tensions from 120 N to {STRAND_END:g} N "
        f"(lower bound to {highest:.0f} N)",
        searched=f"EA, for Fig. 4; {KEPT}",
    )
    title = "Fig. 7: stiffness over cable tension in the elastic stage, EA constant"
    return _figure("fig7", title, [pair], [claim], [_TEN])


def figure_8() -> StiffnessFigure:
    """Compute stiffness over the whole range of tension, at three postures."""
    arm = presets.virtual_prototype()
    pairs, claims = [], []
    for label, q in FIGURE_8_POSTURES.items():
        highest = _highest_minimum(arm.at(q))
        # more points at low tension, where the curve is steep
        minima = np.geomspace(5.0, highest, 2 * _POINTS)
        whole = _over_minimum(label, presets.STRAND_1X19, q, minima)
        end = _over_minimum(label, presets.STRAND_1X19, q, np.array([LEVEL[0], highest]))
        pairs.append(whole)
        claims += [
            _claim(
                whole,
                _increment,
                figure="Fig. 8",
                quantity="rise of stiffness over the whole range, (last − first)/first",
                unit="times",
                assumption=f"{label}; Eq. 19 repaired, lower bound 5 to {highest:.0f} N",
                searched=KEPT,
            ),
            _claim(
                end,
                _percent,
                figure="Fig. 8",
                quantity="change at the end of the range (paper: a slight decrease)",
                unit="%",
                assumption=f"{label}; Eq. 19 most level within its digits, lower bound "
                f"{LEVEL[0]:g} to {highest:.0f} N",
                searched=KEPT,
            ),
        ]
    title = "Fig. 8: stiffness over the whole range of tension, Eq. 19, three postures"
    return _figure("fig8", title, pairs, claims, list(FIGURE_8_POSTURES.values()))


def readings(K: Stiffness) -> Array:
    """Compute the diagonal of K_R and the stiffness for a small weight in x, y, z (2, 3) [N/m]."""
    return np.array([np.diag(K.pseudoinverse()), [K.along(axis) for axis in np.eye(3)]])


def _figure(
    name: str,
    title: str,
    pairs: Sequence[_Pair],
    claims: Sequence[Claim],
    postures: Sequence[Array],
    swept: Swept = "tension",
    part: Part = "active",
) -> StiffnessFigure:
    arm = presets.virtual_prototype()
    stretched, unstrained = zip(*pairs, strict=True)
    return StiffnessFigure(
        name=name,
        title=title,
        swept=swept,
        part=part,
        curves=stretched,
        original=unstrained,
        postures=tuple(arm.at(q) for q in postures),
        claims=tuple(claims),
    )


def _over_minimum(label: str, law: Elasticity, q: Array, minima: Array) -> _Pair:
    return _pair(label, q, [(law, minimum) for minimum in minima], minima, "active")


def _pair(
    label: str, q: Array, cases: Sequence[tuple[Elasticity, float]], swept: Array, part: Part
) -> _Pair:
    """Compute a curve over cases (law, lower bound of tension) for both original lengths."""

    def curve(length: OriginalLength) -> Curve:
        results = [_at_minimum(_prototype(law, length), q, minimum) for law, minimum in cases]
        values = np.array([readings(K) for K in results])
        return Curve(
            label=label,
            original_length=length,
            swept=frozen(np.array(swept)),
            tension=_table((K.tension.min(), K.tension.mean(), K.tension.max()) for K in results),
            pseudoinverse=frozen(values[:, 0].copy()),
            pseudoinverse_part=_table(np.diag(K.pseudoinverse(part)) for K in results),
            along=frozen(values[:, 1].copy()),
            along_part=_table(
                [getattr(K.shares(axis), part).sum() for axis in np.eye(3)] for K in results
            ),
        )

    return curve("stretched"), curve("unstrained")


@lru_cache(maxsize=1)  # all points of a curve over tension use one arm
def _prototype(law: Elasticity, length: OriginalLength) -> Manipulator:
    return presets.virtual_prototype(law, original_length=length)


def _at_minimum(arm: Manipulator, q: Array, minimum: float) -> Stiffness:
    pose = arm.at(q)
    return stiffness(pose, distribute_tension(pose, minimum))


def _table(rows: Iterable[Sequence[float] | Array]) -> Array:
    return frozen(np.array(list(rows), dtype=np.float64))


def _highest_minimum(pose: Posture) -> float:
    """Find the lower bound [N] at which the largest tension reaches :data:`STRAND_END`."""

    def excess(minimum: float) -> float:
        return float(distribute_tension(pose, minimum).values.max()) - STRAND_END

    bound: float = brentq(excess, 5.0, STRAND_END, xtol=1e-6)
    return bound - 1e-3  # safely inside the domain of the law


def _claim(pair: _Pair, measure: Callable[[Array, Array], Array], **texts: Any) -> Claim:
    """Build a claim from one measure of a curve, evaluated in all three readings."""
    stretched, unstrained = pair
    return Claim(
        computed=floats(measure(stretched.pseudoinverse, stretched.pseudoinverse_part)),
        original=floats(measure(unstrained.pseudoinverse, unstrained.pseudoinverse_part)),
        along=floats(measure(unstrained.along, unstrained.along_part)),
        **texts,
    )


def _ratio(total: Array, _: Array) -> Array:
    return np.asarray(total[-1] / total[0])


def _increment(total: Array, part: Array) -> Array:
    return _ratio(total, part) - 1.0


def _percent(total: Array, part: Array) -> Array:
    return 100.0 * _increment(total, part)


def _largest_gap(total: Array, part: Array) -> Array:
    return np.array([100.0 * abs(part / total - 1.0).max()])

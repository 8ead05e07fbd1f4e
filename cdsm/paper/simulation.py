"""Recompute Figs. 3, 4, 6, 7 and 8 of the paper: stiffness over Young's modulus or tension.

Every number is computed in three ways: K_R by the pseudo-inverse and EA/L, L the stretched length,
as in the paper; the same by EA/l_0, l_0 the original length; by EA/l_0, the stiffness ``along`` an
axis that a small weight measures. Each :class:`Claim` says what is assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final, Literal, final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from cdsm import presets
from cdsm.paper.claims import Claim, Figure, Statement, floats
from cdsm.paper.strand import LEVEL, law_of_stretched_length
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.result import Result, unit
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

STRAND_END: Final = presets.STRAND_1X19.high
"""Tension [N] at which the elastic stage of the strand ends (text of Section IV-C)."""

_TEN = np.full(10, presets.TEN_DEGREES)
FIGURE_8_POSTURES: Final = {
    "all joints 10°": _TEN,
    "arc: 15° about y": np.deg2rad([15.0, 0.0] * 5),
    "S: 12° up, then 12° down": np.deg2rad([12.0, 6.0] * 2 + [0.0, 0.0] + [-12.0, -6.0] * 2),
}
"""Postures of Fig. 8 [rad]. They are assumed: the paper shows only pictures."""

LEADS: Final = frozen(np.concatenate([[0.0], np.geomspace(0.003, 0.3, 30)]))
"""Examined leads [m]. With a lead of 0.33 m or more the arm buckles below 800 N."""

_FROM_FIG_6 = "prototype searched for Fig. 6"
_POINTS = 25
Part = Literal["active", "passive"]
OriginalLength = Literal["stretched", "unstrained"]
_STIFFNESS: Final = unit("N/m", "case", "axis")
_CHANGE: Final = unit("percent", "lead", "reading", "axis")


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Curve(Result):
    """Stiffness in x, y and z at N values of a swept quantity.

    Attributes:
        label: Name of the curve in its figure.
        original_length: ``"stretched"`` for EA/L, ``"unstrained"`` for `EA/l_0`.
        q: Joint angles (nv,) [rad].
        swept: Swept quantity (N,): Young's modulus [Pa] or lower bound of tension [N].
        tension: Smallest, mean and largest cable tension (N, 3) [N].
        pseudoinverse: Diagonal of the paper's `K_R` (N, 3) [N/m].
        pseudoinverse_part: The same of the ``part`` of `K_θ` that the figure names (N, 3) [N/m].
        along: Stiffness that a small weight measures along x, y, z (N, 3) [N/m].
        along_part: Contribution of this part to ``along`` (N, 3) [N/m].
    """

    label: str = field(metadata=unit("1"))
    original_length: OriginalLength = field(metadata=unit("1"))
    q: Array = field(metadata=unit("rad", "joint_column"))
    swept: Array = field(metadata=unit("Pa or N", "case"))
    tension: Array = field(metadata=unit("N", "case", "extreme", name="tension_min_mean_max"))
    pseudoinverse: Array = field(metadata=_STIFFNESS)
    pseudoinverse_part: Array = field(metadata=_STIFFNESS)
    along: Array = field(metadata=_STIFFNESS)
    along_part: Array = field(metadata=_STIFFNESS)


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class StiffnessFigure(Figure):
    """A figure of stiffness as a function of Young's modulus or tension.

    Attributes:
        swept: ``"young_modulus"`` or ``"tension"``: the quantity on the horizontal axis.
        part: ``"active"`` or ``"passive"``: the term of `K_θ` that is shown beside the total.
        curves: Curves with the cable stiffness EA/L, L the stretched length, as in the paper.
        original: The same curves with `EA/l_0`, `l_0` the original length.
        postures: Posture of each curve.
    """

    swept: Literal["young_modulus", "tension"] = field(default="tension", metadata=unit("1"))
    part: Part = field(default="active", metadata=unit("1"))
    curves: tuple[Curve, ...] = field(metadata=unit("1"))
    original: tuple[Curve, ...] = field(metadata=unit("1"))
    postures: tuple[Posture, ...]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class LeadFigure(Figure):
    """Change of stiffness if the lower bound of tension rises from 100 N to 800 N, for each lead.

    Changes (N, 2, 3) are those of `K_R` and of what a small weight measures, in x, y and z.

    Attributes:
        leads: Straight cable between its actuator and the base disk, for all cables (N,) [m].
        stretched: Changes (N, 2, 3) [%] with the stretched length, `l_0 = L`, as in the paper.
        original: Changes (N, 2, 3) [%] with the original length `l_0`.
    """

    leads: Array = field(metadata=unit("m", "lead"))
    stretched: Array = field(metadata=_CHANGE)
    original: Array = field(metadata=_CHANGE)


def _rows(values: Iterable[Any]) -> Array:
    return frozen(np.array(list(values)))


def _curves(
    label: str,
    laws: Sequence[Elasticity],
    minima: Array | Sequence[float],
    q: Array = _TEN,
    part: Part = "active",
    swept: Array | None = None,
    lead: float = 0.0,
) -> tuple[Curve, Curve]:
    """Compute a curve over laws and lower bounds of tension, by EA/L and by EA/l_0."""

    def curve(length: OriginalLength) -> Curve:
        wires = map(law_of_stretched_length, laws) if length == "stretched" else laws
        arms = [presets.virtual_prototype(wire, lead=lead) for wire in wires]
        cases = [(arm.at(q), float(F)) for arm, F in product(arms, minima)]
        stiffnesses = [stiffness(pose, distribute_tension(pose, F)) for pose, F in cases]
        axes = np.eye(3)
        return Curve(
            label=label,
            original_length=length,
            q=frozen(q.copy()),
            swept=_rows(minima if swept is None else swept),
            tension=_rows(
                (K.tension.min(), K.tension.mean(), K.tension.max()) for K in stiffnesses
            ),
            pseudoinverse=_rows(np.diag(K.pseudoinverse()) for K in stiffnesses),
            pseudoinverse_part=_rows(np.diag(K.pseudoinverse(part)) for K in stiffnesses),
            along=_rows([K.along(axis) for axis in axes] for K in stiffnesses),
            along_part=_rows(
                [getattr(K.shares(axis), part).sum() for axis in axes] for K in stiffnesses
            ),
        )

    return curve("stretched"), curve("unstrained")


def _claim(
    statement: Statement,
    pair: tuple[Curve, Curve],
    measure: Callable[[Array, Array], Array],
    assumption: str,
    searched: str = _FROM_FIG_6,
    at_most: bool = False,
) -> Claim:
    """Return the numbers that ``measure`` takes from a stiffness and its part (N, 3) [N/m]."""
    paper, original = pair
    numbers = (
        floats(measure(paper.pseudoinverse, paper.pseudoinverse_part)),
        floats(measure(original.pseudoinverse, original.pseudoinverse_part)),
        floats(measure(original.along, original.along_part)),
    )
    return Claim(*statement, *numbers, assumption=assumption, searched=searched, at_most=at_most)


def _figure(
    number: int, about: str, pairs: Sequence[tuple[Curve, Curve]], *claims: Claim, **options: Any
) -> StiffnessFigure:
    curves, original = zip(*pairs, strict=True)
    postures = tuple(presets.virtual_prototype().at(curve.q) for curve in curves)
    names: Any = {"name": f"fig{number}", "title": f"Fig. {number}: {about}", "claims": claims}
    return StiffnessFigure(**names, curves=curves, original=original, postures=postures, **options)


def figure_3() -> StiffnessFigure:
    """Compute stiffness and its passive part at 160 to 320 GPa, for 2 lower bounds of tension."""
    moduli = np.linspace(160e9, 320e9, _POINTS)
    laws = [LinearElasticity.of_wire(modulus, presets.STRAND_DIAMETER) for modulus in moduli]
    labels = {F: f"lower bound {F:g} N" for F in (50.0, 800.0)}
    pairs = [_curves(labels[F], laws, [F], part="passive", swept=moduli) for F in labels]
    wire = "solid wire of 1.2 mm, lower bound"
    ratio = "stiffness at 320 GPa over stiffness at 160 GPa (proportional: 2)", "-", (2.0, 2.0, 2.0)
    claims = [
        _claim(("Fig. 3", *ratio), pairs[0], lambda total, _: total[-1] / total[0], f"{wire} 50 N")
    ]
    for pair, F in zip(pairs, labels, strict=True):
        what = f"largest difference of passive and total stiffness, lower bound {F:g} N"
        gap: Statement = "Fig. 3", what, "%", (1.5,)
        claims.append(_claim(gap, pair, _largest_gap, f"{wire} {F:g} N", at_most=True))
    about = "stiffness over Young's modulus, cable tension constant"
    return _figure(3, about, pairs, *claims, swept="young_modulus", part="passive")


def figure_4() -> StiffnessFigure:
    """Compute stiffness and its active part as a function of tension, with constant EA."""
    minima = np.linspace(100.0, 800.0, _POINTS)
    strand = "EA = 48 kN (the strand in its elastic stage)", [presets.ELASTIC_STAGE]
    wire = "EA = 226 kN (solid wire, the stated 200 GPa)", [presets.STEEL_WIRE_200GPA]
    pairs = [_curves(*case, minima) for case in (strand, wire)]
    claims = []
    for pair, searched in zip(pairs, ("EA, range of tension", "range of tension"), strict=True):
        assumed = f"{pair[0].label}, lower bound 100 to 800 N"
        what = f"change of stiffness with tension, {pair[0].label.partition(' (')[0]}"
        statement: Statement = "Fig. 4", what, "%", (-1.46, -1.04, -1.43)
        claims.append(_claim(statement, pair, _percent, assumed, f"{searched}; {_FROM_FIG_6}"))
    about = "stiffness over cable tension, cable elasticity constant"
    return _figure(4, about, pairs, *claims)


def figure_lead() -> LeadFigure:
    """Compute, for each lead of the cables, the change of stiffness in Fig. 4.

    With EA constant, tension softens the arm by the active stiffness, and stiffens it since locked
    wires are shorter than the cable: EA/l_0 = (EA + F)/L. Only this depends on the lead. The paper
    takes l_0 = L and leaves it out.
    """
    law = [presets.ELASTIC_STAGE]
    ends = [100.0, 800.0]
    pairs = [_curves("", law, ends, lead=lead) for lead in LEADS.tolist()]
    stretched, original = (
        _rows((_percent(curve.pseudoinverse), _percent(curve.along)) for curve in curves)
        for curves in zip(*pairs, strict=True)
    )

    def first_falls(changes: Array) -> tuple[float, ...]:  # [mm] in x, y, z; 0 with any lead
        roots = (CubicSpline(LEADS, column).roots(extrapolate=False) for column in changes.T)
        return floats(1e3 * zeros.min() if zeros.size else 0.0 for zeros in roots)

    statement = "Fig. 4, lead", "lead from which stiffness falls with tension", "mm", None
    falls = first_falls(stretched[:, 0]), first_falls(original[:, 0]), first_falls(original[:, 1])
    claim = Claim(*statement, *falls, assumption="as Fig. 4, EA = 48 kN", searched=_FROM_FIG_6)
    title = "Change of stiffness, 100 N to 800 N, over the lead of the cables, EA = 48 kN"
    changes = {"leads": LEADS, "stretched": stretched, "original": original}
    return LeadFigure(name="lead", title=title, claims=(claim,), **changes)


def figure_6() -> StiffnessFigure:
    """Compute stiffness as a function of tension in the pre-tensioning stage, with Eq. 19."""
    pair = _curves("Eq. 19", [presets.STRAND_1X19], np.linspace(15.0, 120.0, _POINTS))
    statement = "Fig. 6", "increment of stiffness, (last − first)/first", "times", (4.24, 2.9, 4.57)
    assumed = "three cables a joint, 0.5 kg a link, gravity along −y, no lead; Eq. 19 repaired, "
    assumed += "lower bound 15 to 120 N"
    searched = (
        "cables, link, mass, gravity, hole phase, lower bound and reading of K_R, for this row"
    )
    about = "stiffness over cable tension in the pre-tensioning stage, Eq. 19"
    return _figure(6, about, [pair], _claim(statement, pair, _increment, assumed, searched))


def figure_7() -> StiffnessFigure:
    """Compute stiffness as a function of tension in the elastic stage, with constant EA."""
    highest = _highest_minimum(_TEN)
    pair = _curves("EA = 48 kN", [presets.ELASTIC_STAGE], np.linspace(120.0, highest, _POINTS))
    statement = "Fig. 7", "change in the elastic stage", "%", (-1.5, -0.6, -1.6)
    assumed = (
        f"EA = 48 kN, tensions from 120 N to {STRAND_END:g} N (lower bound to {highest:.0f} N)"
    )
    claim = _claim(statement, pair, _percent, assumed, f"EA, for Fig. 4; {_FROM_FIG_6}")
    about = "stiffness over cable tension in the elastic stage, EA constant"
    return _figure(7, about, [pair], claim)


def figure_8() -> StiffnessFigure:
    """Compute stiffness as a function of tension, over its whole range, at three postures."""
    pairs = []
    claims = []
    for label, q in FIGURE_8_POSTURES.items():
        highest = _highest_minimum(q)
        law = [presets.STRAND_1X19]
        # more points at low tension, where the curve is steep
        pairs.append(_curves(label, law, np.geomspace(5.0, highest, 2 * _POINTS), q))
        end = _curves(label, law, [LEVEL[0], highest], q)
        posture = label.partition(":")[0]
        risen = f"rise of stiffness over the whole range, (last − first)/first, {posture}"
        fallen = f"change at the end of the range (paper: a slight decrease), {posture}"
        rise: Statement = "Fig. 8", risen, "times", None
        fall: Statement = "Fig. 8", fallen, "%", None
        assumed = f"{label}; Eq. 19 repaired, lower bound 5 to {highest:.0f} N"
        claims.append(_claim(rise, pairs[-1], _increment, assumed))
        assumed = f"{label}; Eq. 19 most level within its digits, lower bound "
        assumed += f"{LEVEL[0]:g} to {highest:.0f} N"
        claims.append(_claim(fall, end, _percent, assumed))
    about = "stiffness over the whole range of tension, Eq. 19, three postures"
    return _figure(8, about, pairs, *claims)


def _highest_minimum(q: Array) -> float:
    """Find the lower bound [N] of all tensions at which the largest reaches :data:`STRAND_END`."""
    pose = presets.virtual_prototype().at(q)
    bound = brentq(
        lambda F: distribute_tension(pose, F).values.max() - STRAND_END, 5.0, STRAND_END, xtol=1e-6
    )
    return float(bound) - 1e-3  # safely inside the domain of the law


def _largest_gap(total: Array, part: Array) -> Array:
    return np.array([100.0 * abs(part / total - 1.0).max()])


def _increment(total: Array, part: Array | None = None) -> Array:
    return np.asarray(total[-1] / total[0] - 1.0)


def _percent(total: Array, part: Array | None = None) -> Array:
    return 100.0 * _increment(total)

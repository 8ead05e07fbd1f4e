"""Recompute Figs. 10, 12 and 13 and Table II of Section V by virtual experiments.

The prototype is unknown: :func:`cdsm.paper.fitted_prototype` was fitted to the numbers that these
experiments gave in the paper. So agreement only shows that such a prototype is possible.
Disagreement contradicts the model, an assumption or the other data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.manipulator import Manipulator
from cdsm.paper.claims import Claim, Figure, Statement, floats
from cdsm.paper.prototype import fitted_prototype
from cdsm.stiffness_matrix import stiffness
from cdsm.support.result import Result, unit
from cdsm.support.validation import XYZ
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_X = [4.08, 4.86, 5.76, 8.21, 12.71]
_Y = [2.23, 7.45, 7.24, 9.94, 10.29]
_Z = [8.88, 10.31, 16.43, 27.54, 35.25]
TABLE_II: Final = frozen(1e3 * np.column_stack([_X, _Y, _Z]))
"""Measured stiffness in x, y, z (5, 3) [N/m], at tensions rising from 3 to 86 N (Table II)."""

TABLE_II_SWAPPED: Final = frozen(np.vstack([TABLE_II[0], TABLE_II[1:4, [1, 0, 2]], TABLE_II[4]]))
"""Table II with x and y exchanged in rows 2 to 4 (5, 3) [N/m].

By the caption of Fig. 10 and Section V-C, y is the least of the three. The printed table
contradicts this in exactly these rows: 7.45 > 4.86, 7.24 > 5.76, 9.94 > 8.21. In these rows y also
falls, from 7.45 to 7.24. With the exchange, y is the least in every row and always rises. The
increments from the first to the last row do not change.
"""

TENSIONS: Final = frozen(np.linspace(3.0, 86.0, 5))
"""Tensions of the rows of Table II (5,) [N]: first and last are given, even spacing is assumed."""

POSTURE: Final = frozen(np.deg2rad([-12.0, -18.0, -20.0]))
"""Joint angles of Table II (3,) [rad] (Section V-C)."""

DROPS = (0.17, 0.40)
RISES = (7.93, 12.25)
"""What stiffness in y falls by with tension (Fig. 12) and rises by with the springs (Fig. 13),
(last − first)/first, in two configurations."""

CHECK = 139.0
MEASURED = 131.0
"""Calculated and measured stiffness in z [N/m] of the accuracy check (Section V-B)."""

HYBRID: Final = 1890.0
"""Stiffness of the hybrid cables (strand and spring together) of Fig. 12 [N/m]."""

# Conditions that the paper does not state, fitted with fitted_prototype to its 20 numbers

TENSION_OFFSET: Final = 17.3
"""Actual minus reported tension of the force-controlled cables [N]."""

SECOND_POSTURE: Final = frozen(np.deg2rad([-30.0, -30.0, 7.28]))
"""Joint angles of the second configuration of Figs. 12 and 13 (3,) [rad]; the first is POSTURE."""

HIGHEST_TENSION = 34.4
HYBRID_TENSION = 3.0
"""Highest tension in Fig. 12 [N], and the tension in Fig. 13 and the accuracy check [N]."""

STIFFEST: Final = 8.04 * HYBRID
"""Stiffness of the stiffest hybrid cables of Fig. 13 [N/m]; Fig. 11 gives no numbers."""

_POINTS: Final = 40


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Trace(Result):
    """One curve of a virtual experiment, with the paper's values beside it.

    Attributes:
        label: Name of the curve.
        swept: Swept quantity (N,): a tension [N] or the stiffness of the cables [N/m].
        computed: Stiffness (N,) [N/m], or its ratio to the first value [-].
        paper_at: Values of ``swept`` that belong to ``paper`` (M,); some are assumed or fitted.
        paper: Stiffness in the paper (M,), in the unit of ``computed``; in Fig. 10 with x and y
            exchanged in rows 2 to 4 of Table II.
    """

    label: str = field(metadata=unit("1"))
    swept: Array = field(metadata=unit("N or N/m", "case"))
    computed: Array = field(metadata=unit("N/m or 1", "case"))
    paper_at: Array = field(metadata=unit("N or N/m", "case"))
    paper: Array = field(metadata=unit("N/m or 1", "case"))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class ExperimentFigure(Figure):
    """A virtual experiment on the fitted prototype.

    Attributes:
        swept: ``"tension"``, the reported tension of the force-controlled cables [N], or
            ``"cable_stiffness"`` [N/m].
        relative: Whether the stiffness is divided by its first value.
        traces: Curves of the figure.
    """

    swept: Literal["tension", "cable_stiffness"] = field(metadata=unit("1"))
    relative: bool = field(metadata=unit("1"))
    traces: tuple[Trace, ...] = field(metadata=unit("1"))


def measured(arm: Manipulator, q: ArrayLike, tensions: Sequence[float] | Array) -> Array:
    """Compute the stiffness that a small weight measures along x, y, z (N, 3) [N/m].

    ``tensions`` are N reported tensions of the force-controlled cables [N]; statics give those of
    the others. ``q`` are the joint angles (nv,) [rad].
    """
    pose = arm.at(q)
    rows = []
    forced = [cable.name for cable in arm.cables if cable.control == "force"]
    for tension in np.asarray(tensions, dtype=np.float64) + TENSION_OFFSET:
        K = stiffness(pose, distribute_tension(pose, fixed=dict.fromkeys(forced, float(tension))))
        rows.append([K.along(axis) for axis in np.eye(3)])
    return np.array(rows)


def _claim(statement: Statement, computed: Sequence[float] | Array, assumption: str) -> Claim:
    searched = "dimensions of the prototype, conditions of the tests"
    return Claim(*statement, floats(computed), assumption=assumption, searched=searched)


def figure_10() -> ExperimentFigure:
    """Compute stiffness in x, y and z against tension with the 1×19 strand; compare with Table II.

    The curves stand beside Table II with x and y exchanged in rows 2 to 4 (evidence:
    :data:`TABLE_II_SWAPPED`). The claims compare the printed table too.
    """
    arm = fitted_prototype()
    tensions = frozen(np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS))
    curves = measured(arm, POSTURE, tensions)
    computed = measured(arm, POSTURE, TENSIONS)
    exchanged = "x and y exchanged in rows 2 to 4 of the table"
    claims = []
    traces = []
    for axis, paper, ours, curve in zip(XYZ, TABLE_II_SWAPPED.T, computed.T, curves.T, strict=True):
        statement = "Table II", f"stiffness in {axis}", "N/mm", floats(paper / 1e3)
        claims.append(_claim(statement, ours / 1e3, f"tensions evenly spaced; {exchanged}"))
        beside = {"paper_at": TENSIONS, "paper": frozen(paper.copy())}
        traces.append(Trace(label=axis, swept=tensions, computed=frozen(curve.copy()), **beside))
    rise, paper = (floats(table[-1] / table[0] - 1.0) for table in (computed, TABLE_II))
    statement = "Fig. 10", "increment of stiffness, (last − first)/first", "times", paper
    claims.append(_claim(statement, rise, "tensions from 3 to 86 N"))
    for label, table in ((exchanged, TABLE_II_SWAPPED), ("as printed", TABLE_II)):
        misfit = 100.0 * np.sqrt(np.mean(np.log(computed / table) ** 2, axis=0))
        assumed = f"root mean square of ln(model/paper); {label}"
        what = f"typical misfit in x, y, z, {label.partition(' in')[0]}"
        claims.append(_claim(("Table II", what, "%", None), misfit, assumed))
    return ExperimentFigure(
        name="fig10",
        title="Fig. 10: stiffness over tension, 1×19 strand, fitted prototype. "
        "Table II with x and y exchanged in rows 2 to 4",
        swept="tension",
        relative=False,
        traces=tuple(traces),
        claims=tuple(claims),
    )


def figure_12() -> ExperimentFigure:
    """Compute stiffness in y against tension for 2 configurations, at constant cable stiffness.

    Its claims have the accuracy check of Section V-B as well.
    """
    arm = fitted_prototype(HYBRID)
    tensions = np.linspace(TENSIONS[0], HIGHEST_TENSION, _POINTS)
    first, second = (measured(arm, q, tensions)[:, 1] for q in (POSTURE, SECOND_POSTURE))
    traces = _relative(tensions, [first, second], 1.0 - np.array(DROPS))
    falls = [100.0 * (1.0 - trace.computed[-1]) for trace in traces]
    paper = floats(100.0 * drop for drop in DROPS)
    statement = "Fig. 12", "largest reduction of stiffness in y, two configurations", "%", paper
    assumed = (
        f"tension 3 to {HIGHEST_TENSION:g} N; the first configuration is the posture of Table II"
    )
    drops = _claim(statement, falls, assumed)
    stated = "calculated stiffness in z of the accuracy check", "N/mm", (CHECK / 1e3,)
    assumed = f"posture of Table II, cables of 1.89 N/mm, {HYBRID_TENSION:g} N; "
    assumed += f"the paper measured {MEASURED / 1e3:g} N/mm"
    z = measured(arm, POSTURE, [HYBRID_TENSION])[0, 2]
    return ExperimentFigure(
        name="fig12",
        title="Fig. 12: stiffness in y over tension, cables of 1.89 N/mm, fitted prototype",
        swept="tension",
        relative=True,
        traces=traces,
        claims=(drops, _claim(("Section V-B", *stated), [z / 1e3], assumed)),
    )


def figure_13() -> ExperimentFigure:
    """Compute stiffness in y against cable stiffness for 2 configurations, at constant tension."""
    springs = np.linspace(HYBRID, STIFFEST, _POINTS)
    arms = [fitted_prototype(spring) for spring in springs.tolist()]
    curves = [
        np.array([measured(arm, q, [HYBRID_TENSION])[0, 1] for arm in arms])
        for q in (POSTURE, SECOND_POSTURE)
    ]
    traces = _relative(springs, curves, 1.0 + np.array(RISES))
    statement = "Fig. 13", "increment of stiffness in y, two configurations", "times", RISES
    assumed = f"stiffest spring {STIFFEST / HYBRID:.3g} times the softest; {HYBRID_TENSION:g} N"
    return ExperimentFigure(
        name="fig13",
        title="Fig. 13: stiffness in y over that of the cables, fitted prototype",
        swept="cable_stiffness",
        relative=True,
        traces=traces,
        claims=(_claim(statement, [trace.computed[-1] - 1.0 for trace in traces], assumed),),
    )


def _relative(swept: Array, curves: Sequence[Array], paper: Array) -> tuple[Trace, ...]:
    """Return each configuration's curve over its first value, beside the paper's last value."""
    traces = []
    for which, q, curve, stated in zip(
        ("first", "second"), (POSTURE, SECOND_POSTURE), curves, paper.tolist(), strict=True
    ):
        label = f"{which}: {', '.join(f'{x:.0f}°' for x in np.rad2deg(q))}"
        beside = {"paper_at": frozen(swept[-1:].copy()), "paper": frozen(np.array([stated]))}
        computed = frozen(curve / curve[0])
        traces.append(Trace(label=label, swept=frozen(swept), computed=computed, **beside))
    return tuple(traces)

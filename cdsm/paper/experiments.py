"""Recompute Figs. 10, 12 and 13 and Table II of Section V by virtual experiments.

The prototype is unknown: :func:`cdsm.presets.fitted_prototype` was fitted to the numbers that these
experiments gave in the paper. So agreement only shows that such a prototype is possible.
Disagreement contradicts the model, an assumption or the other data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm import presets
from cdsm.manipulator import Manipulator
from cdsm.paper.claims import Claim, Figure, floats
from cdsm.paper.section_v import (
    CHECK,
    DROPS,
    HIGHEST_TENSION,
    HYBRID,
    HYBRID_TENSION,
    MEASURED,
    POSTURE,
    RISES,
    SECOND_POSTURE,
    STIFFEST,
    TABLE_II,
    TABLE_II_SWAPPED,
    TENSION_OFFSET,
    TENSIONS,
)
from cdsm.stiffness_matrix import stiffness
from cdsm.support.directions import XYZ
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_POINTS: Final = 40
_POSTURES: Final = (POSTURE, SECOND_POSTURE)

_claim = partial(Claim, searched="dimensions of the prototype, conditions of the tests")


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """One curve of a virtual experiment, with the paper's values beside it.

    Attributes:
        label: Name of the curve.
        swept: Swept quantity (N,): a tension [N] or the stiffness of the cables [N/m].
        computed: Stiffness (N,) [N/m], or its ratio to the first value [-].
        paper_at: Values of ``swept`` that belong to ``paper`` (M,); some are assumed or fitted.
        paper: Stiffness in the paper (M,), in the unit of ``computed``; in Fig. 10 with x and y
            exchanged in rows 2 to 4 of Table II.
    """

    label: str
    swept: Array
    computed: Array
    paper_at: Array
    paper: Array


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

    swept: Literal["tension", "cable_stiffness"]
    relative: bool
    traces: tuple[Trace, ...]

    def numbers(self) -> dict[str, object]:
        """Return the curves as plain SI numbers, for JSON."""
        swept = {"tension": "tension_N", "cable_stiffness": "cable_stiffness_N_per_m"}[self.swept]
        computed = "stiffness_over_first" if self.relative else "stiffness_N_per_m"
        return {
            "curves": [
                {
                    "label": trace.label,
                    swept: trace.swept.tolist(),
                    computed: trace.computed.tolist(),
                    f"paper_{swept}": trace.paper_at.tolist(),
                    f"paper_{computed}": trace.paper.tolist(),
                }
                for trace in self.traces
            ]
        }


def measured(arm: Manipulator, q: ArrayLike, tensions: Sequence[float] | Array) -> Array:
    """Compute the stiffness that a small weight measures along x, y, z (N, 3) [N/m].

    ``tensions`` are N reported tensions of the force-controlled cables [N]; statics give those of
    the others. ``q`` are the joint angles (nv,) [rad].
    """
    pose, rows = arm.at(q), []
    forced = [cable.name for cable in arm.cables if cable.control == "force"]
    for tension in np.asarray(tensions, dtype=np.float64) + TENSION_OFFSET:
        K = stiffness(pose, distribute_tension(pose, fixed=dict.fromkeys(forced, float(tension))))
        rows.append([K.along(axis) for axis in np.eye(3)])
    return np.array(rows)


def figure_10() -> ExperimentFigure:
    """Compute stiffness in x, y and z against tension with the 1×19 strand; compare with Table II.

    The curves stand beside Table II with x and y exchanged in rows 2 to 4 (evidence:
    :data:`~cdsm.paper.section_v.TABLE_II_SWAPPED`). The claims compare the printed table too.
    """
    arm = presets.fitted_prototype()
    tensions = np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS)
    curves, computed = measured(arm, POSTURE, tensions), measured(arm, POSTURE, TENSIONS)
    exchanged = "x and y exchanged in rows 2 to 4 of the table"
    tables = ((exchanged, TABLE_II_SWAPPED), ("as printed", TABLE_II))
    claims = [
        _claim(
            figure="Table II",
            quantity=f"stiffness in {axis}",
            unit="N/mm",
            paper=floats(theirs / 1e3),
            computed=floats(ours / 1e3),
            assumption=f"tensions evenly spaced; {exchanged}",
        )
        for axis, theirs, ours in zip(XYZ, TABLE_II_SWAPPED.T, computed.T, strict=True)
    ]
    claims.append(
        _claim(
            figure="Fig. 10",
            quantity="increment of stiffness, (last − first)/first",
            unit="times",
            paper=floats(TABLE_II[-1] / TABLE_II[0] - 1.0),
            computed=floats(computed[-1] / computed[0] - 1.0),
            assumption="tensions from 3 to 86 N",
        )
    )
    claims += [
        _claim(
            figure="Table II",
            quantity="typical misfit in x, y, z",
            unit="%",
            computed=floats(100.0 * np.sqrt(np.mean(np.log(computed / table) ** 2, axis=0))),
            assumption=f"root mean square of ln(model/paper); {label}",
        )
        for label, table in tables
    ]
    return ExperimentFigure(
        name="fig10",
        title="Fig. 10: stiffness over tension, 1×19 strand, fitted prototype. "
        "Table II with x and y exchanged in rows 2 to 4",
        swept="tension",
        relative=False,
        traces=tuple(
            Trace(
                label=axis,
                swept=frozen(tensions),
                computed=frozen(curve.copy()),
                paper_at=TENSIONS,
                paper=frozen(column.copy()),
            )
            for axis, curve, column in zip(XYZ, curves.T, TABLE_II_SWAPPED.T, strict=True)
        ),
        claims=tuple(claims),
    )


def figure_12() -> ExperimentFigure:
    """Compute stiffness in y against tension for 2 configurations, at constant cable stiffness.

    Its claims have the accuracy check of Section V-B as well.
    """
    arm = presets.fitted_prototype(HYBRID)
    tensions = np.linspace(TENSIONS[0], HIGHEST_TENSION, _POINTS)
    curves = [measured(arm, q, tensions)[:, 1] for q in _POSTURES]
    check = measured(arm, POSTURE, [HYBRID_TENSION])[0, 2]
    return ExperimentFigure(
        name="fig12",
        title="Fig. 12: stiffness in y over tension, cables of 1.89 N/mm, fitted prototype",
        swept="tension",
        relative=True,
        traces=_configurations(tensions, curves, [1.0 - drop for drop in DROPS]),
        claims=(
            _claim(
                figure="Fig. 12",
                quantity="largest reduction of stiffness in y, two configurations",
                unit="%",
                paper=floats(100.0 * np.array(DROPS)),
                computed=floats(100.0 * (1.0 - curve[-1] / curve[0]) for curve in curves),
                assumption=f"tension 3 to {HIGHEST_TENSION:g} N; the first configuration is the "
                "posture of Table II",
            ),
            _claim(
                figure="Section V-B",
                quantity="calculated stiffness in z of the accuracy check",
                unit="N/mm",
                paper=(CHECK / 1e3,),
                computed=(float(check) / 1e3,),
                assumption=f"posture of Table II, cables of 1.89 N/mm, {HYBRID_TENSION:g} N; the "
                f"paper measured {MEASURED / 1e3:g} N/mm",
            ),
        ),
    )


def figure_13() -> ExperimentFigure:
    """Compute stiffness in y against cable stiffness for 2 configurations, at constant tension."""
    springs = np.linspace(HYBRID, STIFFEST, _POINTS)
    arms = [presets.fitted_prototype(spring) for spring in springs.tolist()]
    curves = [
        np.array([measured(arm, q, [HYBRID_TENSION])[0, 1] for arm in arms]) for q in _POSTURES
    ]
    return ExperimentFigure(
        name="fig13",
        title="Fig. 13: stiffness in y over that of the cables, fitted prototype",
        swept="cable_stiffness",
        relative=True,
        traces=_configurations(springs, curves, [1.0 + rise for rise in RISES]),
        claims=(
            _claim(
                figure="Fig. 13",
                quantity="increment of stiffness in y, two configurations",
                unit="times",
                paper=RISES,
                computed=floats(curve[-1] / curve[0] - 1.0 for curve in curves),
                assumption=f"stiffest spring {STIFFEST / HYBRID:.3g} times the softest; "
                f"{HYBRID_TENSION:g} N",
            ),
        ),
    )


def _configurations(
    swept: Array, curves: Sequence[Array], paper: Sequence[float]
) -> tuple[Trace, ...]:
    """Build a trace for each configuration: its curve against ``swept`` (N,), over its first value.

    ``paper`` has the paper's ratio of the last to the first value.
    """
    return tuple(
        Trace(
            label=f"{which}: {', '.join(f'{x:.0f}°' for x in np.rad2deg(q))}",
            swept=frozen(swept),
            computed=frozen(curve / curve[0]),
            paper_at=frozen(swept[-1:].copy()),
            paper=frozen(np.array([stated])),
        )
        for which, q, curve, stated in zip(
            ("first", "second"), _POSTURES, curves, paper, strict=True
        )
    )

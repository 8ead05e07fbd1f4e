"""Recompute Figs. 10, 12 and 13 and Table II of Section V by virtual experiments.

The prototype is unknown: :mod:`cdsm.paper.prototype_fit` identifies it from the numbers that these
experiments gave in the paper. So agreement only shows that such a prototype is possible.
Disagreement contradicts the model, an assumption or the other data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, final

import numpy as np

from cdsm.paper.claims import Claim, Figure, floats
from cdsm.paper.prototype_fit import STEPS, PrototypeFit, identified, section_v_claim
from cdsm.paper.section_v import DROPS, HYBRID, RISES, TENSIONS
from cdsm.support.directions import XYZ
from cdsm.support.values import Array, frozen

_POINTS: Final = 40


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """One curve of a virtual experiment, with the paper's values beside it.

    Attributes:
        label: Name of the curve.
        swept: Swept quantity (N,): a tension [N] or the stiffness of the cables [N/m].
        computed: Stiffness (N,) [N/m], or its ratio to the first value [-].
        paper_at: Values of ``swept`` that belong to ``paper`` (M,); some are assumed or identified.
        paper: Stiffness in the paper (M,), in the unit of ``computed``; for some fits of Fig. 10
            with x and y exchanged.
    """

    label: str
    swept: Array
    computed: Array
    paper_at: Array
    paper: Array


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class ExperimentFigure(Figure):
    """A virtual experiment on the identified prototype.

    Attributes:
        swept: ``"tension"``, the reported tension of the force-controlled cables [N], or
            ``"cable_stiffness"`` [N/m].
        relative: Whether the stiffness is divided by its first value.
        traces: Curves of the figure.
        fit: Identified prototype; in Fig. 10 the one with x and y exchanged in Table II.
    """

    swept: Literal["tension", "cable_stiffness"]
    relative: bool
    traces: tuple[Trace, ...]
    fit: PrototypeFit

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


def figure_10() -> ExperimentFigure:
    """Compute stiffness in x, y and z against tension with the 1×19 strand; compare with Table II.

    Three prototypes are shown. The first is fitted to Section V as printed. The second is fitted to
    Section V with x and y exchanged in rows 2 to 4 of Table II (evidence:
    :data:`~cdsm.paper.section_v.TABLE_II_SWAPPED`). The third is fitted to the exchanged Table II
    alone, with unevenly spaced tensions and finite weights: 14 parameters for 15 numbers. No fit is
    a proof.
    """
    fits = [identified(step) for step in (STEPS[0], STEPS[1], STEPS[-1])]
    return ExperimentFigure(
        name="fig10",
        title="Fig. 10, Table II: stiffness over tension, 1×19 strand, identified prototypes",
        swept="tension",
        relative=False,
        traces=tuple(trace for fit in fits for trace in _over_tension(fit)),
        fit=fits[1],
        claims=tuple(claim for fit in fits for claim in _table_claims(fit)),
    )


def figure_12() -> ExperimentFigure:
    """Compute stiffness in y against tension for 2 configurations, at constant cable stiffness."""
    fit = identified(STEPS[1])
    prototype = fit.prototype
    tensions = np.linspace(TENSIONS[0], prototype.highest_hybrid_tension, _POINTS)
    soft = prototype.arm(HYBRID)
    curves = [prototype.measure(soft.at(q), tensions)[:, 1] for q in prototype.configurations]
    return ExperimentFigure(
        name="fig12",
        title="Fig. 12: stiffness in y over tension, cables of 1.89 N/mm, identified prototype",
        swept="tension",
        relative=True,
        traces=_configurations(fit, tensions, curves, [1.0 - drop for drop in DROPS]),
        fit=fit,
        claims=(
            section_v_claim(
                figure="Fig. 12",
                quantity="largest reduction of stiffness in y, two configurations",
                unit="%",
                paper=floats(100.0 * np.array(DROPS)),
                computed=floats(100.0 * np.array(fit.predicted.drops)),
                assumption=f"identified prototype; tension 3 to {tensions[-1]:.3g} N and second "
                "configuration identified with it",
            ),
        ),
    )


def figure_13() -> ExperimentFigure:
    """Compute stiffness in y against cable stiffness for 2 configurations, at constant tension."""
    fit = identified(STEPS[1])
    prototype, tension = fit.prototype, fit.prototype.hybrid_tension
    springs = np.linspace(HYBRID, HYBRID * prototype.spring_ratio, _POINTS)
    arms = [prototype.arm(spring) for spring in springs.tolist()]
    curves = [
        np.array([prototype.measure(arm.at(q), tension)[0, 1] for arm in arms])
        for q in prototype.configurations
    ]
    return ExperimentFigure(
        name="fig13",
        title="Fig. 13: stiffness in y over that of the cables, identified prototype",
        swept="cable_stiffness",
        relative=True,
        traces=_configurations(fit, springs, curves, [1.0 + rise for rise in RISES]),
        fit=fit,
        claims=(
            section_v_claim(
                figure="Fig. 13",
                quantity="increment of stiffness in y, two configurations",
                unit="times",
                paper=RISES,
                computed=fit.predicted.rises,
                assumption="identified prototype; stiffest spring "
                f"{prototype.spring_ratio:.3g} times the softest and tension {tension:.3g} N "
                "identified with it",
            ),
        ),
    )


def _over_tension(fit: PrototypeFit) -> list[Trace]:
    """Compute stiffness in x, y and z against tension, with Table II as the paper's values.

    It is the printed or the exchanged table, to which the prototype was fitted.
    """
    prototype = fit.prototype
    tensions = np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS)
    curves = prototype.weigh(prototype.arm().at(prototype.configurations[0]), tensions)
    return [
        Trace(
            label=f"{axis}: {fit.step.label}",
            swept=frozen(tensions),
            computed=frozen(curve.copy()),
            paper_at=frozen(prototype.levels),
            paper=frozen(column.copy()),
        )
        for axis, curve, column in zip(XYZ, curves.T, fit.step.table.T, strict=True)
    ]


def _configurations(
    fit: PrototypeFit, swept: Array, curves: Sequence[Array], paper: Sequence[float]
) -> tuple[Trace, ...]:
    """Build a trace for each configuration: its curve against ``swept`` (N,), over its first value.

    ``curves`` has a stiffness (N,) [N/m] for each configuration, ``paper`` the paper's ratio of the
    last to the first value.
    """
    configurations = np.rad2deg(fit.prototype.configurations)
    return tuple(
        Trace(
            label=f"{which}: {', '.join(f'{x:.0f}°' for x in q)}",
            swept=frozen(swept),
            computed=frozen(curve / curve[0]),
            paper_at=frozen(swept[-1:].copy()),
            paper=frozen(np.array([stated])),
        )
        for which, q, curve, stated in zip(
            ("first", "second"), configurations, curves, paper, strict=True
        )
    )


def _table_claims(fit: PrototypeFit) -> list[Claim]:
    """Build claims that compare Table II, and its increments, with numbers of the prototype."""
    table, computed = fit.step.table, fit.predicted.table
    assumption = f"{fit.step.label}; {fit.step.count}"
    claims = [
        section_v_claim(
            figure="Table II",
            quantity=f"stiffness in {axis}",
            unit="N/mm",
            paper=floats(theirs / 1e3),
            computed=floats(ours / 1e3),
            assumption=assumption,
        )
        for axis, theirs, ours in zip(XYZ, table.T, computed.T, strict=True)
    ]
    claims.append(
        section_v_claim(
            figure="Fig. 10",
            quantity="increment of stiffness, (last − first)/first",
            unit="times",
            paper=floats(table[-1] / table[0] - 1.0),
            computed=floats(computed[-1] / computed[0] - 1.0),
            assumption=assumption,
        )
    )
    return claims

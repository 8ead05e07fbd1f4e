"""Figs. 10, 12 and 13, Table II and the accuracy check of Section V, as virtual experiments.

:mod:`cdsm.paper.prototype` identifies a prototype from the numbers of these experiments.
Agreement only shows that such a prototype is possible. Disagreement contradicts the model, an
assumption or the other data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from typing import Final, Literal, final

import numpy as np

from cdsm.paper.claims import Claim, Figure, floats, markdown_table
from cdsm.paper.prototype import BOUNDS, STEPS, PrototypeFit, identify_prototype
from cdsm.paper.section_v import AXES, CHECK, DROPS, HYBRID, MEASURED, RISES, TENSIONS
from cdsm.support.validation import Array, frozen

_POINTS: Final = 40
_ALL: Final = "all parameters of the prototype"
"""Text of ``Claim.searched`` for Section V. Measured with weights, it has one reading only."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """One curve of a virtual experiment, with the values that the paper prints.

    Attributes:
        label: Name of the curve.
        swept: Swept quantity (N,), a tension [N] or a stiffness [N/m].
        computed: Stiffness (N,) [N/m], or its ratio to the first value [-].
        paper_at: Values of ``swept`` at which the paper prints the stiffness (M,).
        paper: Stiffness in the paper (M,), in the unit of ``computed``.
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


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFigure(Figure):
    """Residuals of all numbers of Section V for the identified prototypes.

    Attributes:
        fits: Prototype identified at each step.
    """

    fits: tuple[PrototypeFit, ...]

    def numbers(self) -> dict[str, object]:
        """Return parameters and residuals of all steps, for JSON."""
        return {
            "bounds_SI": BOUNDS,
            "fits": [
                {
                    "step": fit.step.label,
                    "free": fit.step.free,
                    "numbers": len(fit.step.numbers),
                    "table_N_per_m": fit.step.table.tolist(),
                    "parameters_SI": asdict(fit.prototype),
                    "at_bound": fit.at_bound,
                    "misfit_xyz": fit.misfit.tolist(),
                    "residuals": dict(zip(fit.step.numbers, fit.residuals.tolist(), strict=True)),
                }
                for fit in self.fits
            ],
        }

    def tables(self) -> tuple[str, ...]:
        """Return the table of identified parameters; * marks a parameter at a bound."""
        rows = []
        for name, (low, high) in BOUNDS.items():
            cells = [
                "–"
                if name not in fit.step.free
                else f"{getattr(fit.prototype, name):.4g}" + ("*" if name in fit.at_bound else "")
                for fit in self.fits
            ]
            rows.append((name, f"{low:.4g}", f"{high:.4g}", *cells))
        header = ("parameter [SI]", "from", "to", *(fit.step.label for fit in self.fits))
        return (markdown_table(header, rows),)


def figure_10() -> ExperimentFigure:
    """Compute stiffness in x, y and z over tension with the 1×19 strand, beside Table II.

    Three prototypes are shown. The first is fitted to Section V as printed. The second takes Table
    II with x and y exchanged in rows 2 to 4 (evidence:
    :data:`~cdsm.paper.section_v.TABLE_II_SWAPPED`). The third is fitted to the exchanged Table II
    alone, with uneven tensions and finite weights: 14 parameters for 15 numbers. No fit is a proof.
    """
    fits = [_identified(step.label) for step in (STEPS[0], STEPS[1], STEPS[-1])]
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
    """Compute stiffness in y over tension with cables of constant stiffness, 2 configurations."""
    fit = _identified()
    prototype = fit.prototype
    tensions = np.linspace(TENSIONS[0], prototype.highest_hybrid_tension, _POINTS)
    soft = prototype.arm(HYBRID)

    def stiffness_y(q: Array) -> Array:
        return prototype.measure(soft.at(q), tensions)[:, 1]

    return ExperimentFigure(
        name="fig12",
        title="Fig. 12: stiffness in y over tension, cables of 1.89 N/mm, identified prototype",
        swept="tension",
        relative=True,
        traces=_configurations(fit, tensions, stiffness_y, 1.0 - np.array(DROPS)),
        fit=fit,
        claims=(
            Claim(
                figure="Fig. 12",
                quantity="largest reduction of stiffness in y, two configurations",
                unit="%",
                paper=floats(100.0 * np.array(DROPS)),
                computed=floats(100.0 * np.array(fit.predicted.drops)),
                assumption=f"identified prototype; tension 3 to {tensions[-1]:.3g} N and second "
                "configuration identified with it",
                searched=_ALL,
            ),
        ),
    )


def figure_13() -> ExperimentFigure:
    """Compute stiffness in y over cable stiffness at constant tension, for 2 configurations."""
    fit = _identified()
    prototype = fit.prototype
    springs = np.linspace(HYBRID, HYBRID * prototype.spring_ratio, _POINTS)
    arms = [prototype.arm(spring) for spring in springs.tolist()]

    def stiffness_y(q: Array) -> Array:
        tension = prototype.hybrid_tension
        return np.array([prototype.measure(arm.at(q), tension)[0, 1] for arm in arms])

    return ExperimentFigure(
        name="fig13",
        title="Fig. 13: stiffness in y over that of the cables, identified prototype",
        swept="cable_stiffness",
        relative=True,
        traces=_configurations(fit, springs, stiffness_y, 1.0 + np.array(RISES)),
        fit=fit,
        claims=(
            Claim(
                figure="Fig. 13",
                quantity="increment of stiffness in y, two configurations",
                unit="times",
                paper=RISES,
                computed=fit.predicted.rises,
                assumption="identified prototype; stiffest spring "
                f"{prototype.spring_ratio:.3g} times the softest and tension "
                f"{prototype.hybrid_tension:.3g} N identified with it",
                searched=_ALL,
            ),
        ),
    )


def figure_prototype() -> PrototypeFigure:
    """Compare all numbers of Section V with the prototype identified at each step."""
    fits = tuple(_identified(step.label) for step in STEPS)
    checks = [
        Claim(
            figure="Section V-B",
            quantity="accuracy check in z, off the paper's calculated 0.139 N/mm",
            unit="%",
            paper=(100.0 * (MEASURED / CHECK - 1.0),),
            computed=(100.0 * (fit.predicted.check / CHECK - 1.0),),
            assumption=f"{fit.step.label}; the paper's is its measurement, 0.131 N/mm; posture of "
            "Table II, cables of 1.89 N/mm",
            searched=_ALL,
        )
        for fit in fits
        if fit.predicted.check is not None
    ]
    misfits = [
        Claim(
            figure="Section V",
            quantity="typical misfit of Table II in x, y, z",
            unit="%",
            computed=floats(100.0 * fit.misfit),
            assumption=f"{fit.step.label}; {fit.step.count}; at a bound: "
            f"{', '.join(fit.at_bound) or 'none'}",
            searched=_ALL,
        )
        for fit in fits
    ]
    return PrototypeFigure(
        name="prototype",
        title="Section V: every number against one identified prototype",
        fits=fits,
        claims=(*checks, *misfits),
    )


@cache
def _identified(label: str = STEPS[1].label) -> PrototypeFit:
    return identify_prototype(next(step for step in STEPS if step.label == label))


def _over_tension(fit: PrototypeFit) -> tuple[Trace, ...]:
    """Compute stiffness in x, y and z over tension, beside the table of the fit."""
    prototype = fit.prototype
    tensions = np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS)
    curves = prototype.weigh(prototype.arm().at(prototype.configurations[0]), tensions)
    return tuple(
        Trace(
            label=f"{axis}: {fit.step.label}",
            swept=frozen(tensions),
            computed=frozen(curves[:, i].copy()),
            paper_at=frozen(prototype.levels),
            paper=frozen(fit.step.table[:, i].copy()),
        )
        for i, axis in enumerate(AXES)
    )


def _table_claims(fit: PrototypeFit) -> list[Claim]:
    """Compare the columns of Table II, and their increments, with the fitted prototype."""
    table, computed = fit.step.table, fit.predicted.table
    assumption = f"{fit.step.label}; {fit.step.count}"
    claims = [
        Claim(
            figure="Table II",
            quantity=f"stiffness in {axis}",
            unit="N/mm",
            paper=floats(theirs / 1e3),
            computed=floats(ours / 1e3),
            assumption=assumption,
            searched=_ALL,
        )
        for axis, theirs, ours in zip(AXES, table.T, computed.T, strict=True)
    ]
    rise = Claim(
        figure="Fig. 10",
        quantity="increment of stiffness, (last − first)/first",
        unit="times",
        paper=floats(table[-1] / table[0] - 1.0),
        computed=floats(computed[-1] / computed[0] - 1.0),
        assumption=assumption,
        searched=_ALL,
    )
    return [*claims, rise]


def _configurations(
    fit: PrototypeFit, swept: Array, stiffness_of: Callable[[Array], Array], paper: Array
) -> tuple[Trace, ...]:
    """Build a trace per configuration, relative to its first value; the paper gives the last."""
    traces = []
    for i, q in enumerate(fit.prototype.configurations):
        computed = stiffness_of(q)
        degrees = ", ".join(f"{angle:.0f}°" for angle in np.rad2deg(q))
        traces.append(
            Trace(
                label=f"{('first', 'second')[i]}: {degrees}",
                swept=frozen(swept.copy()),
                computed=frozen(computed / computed[0]),
                paper_at=frozen(swept[-1:].copy()),
                paper=frozen(paper[i : i + 1].copy()),
            )
        )
    return tuple(traces)

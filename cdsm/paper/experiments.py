"""Figs. 10, 12 and 13, Table II and the accuracy check of Section V, as virtual experiments.

They are made on the one prototype that :mod:`cdsm.paper.prototype` identifies from their own
numbers. Agreement shows no more than that such a prototype could be; what does not agree
contradicts the model, an assumption, or the rest of the data.
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
"""What was searched for these numbers. Measured with weights, they have one reading only."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """One curve of a virtual experiment, and what the paper prints of it.

    Attributes:
        label: What it is of.
        swept: The swept quantity (N,) [N] or [N/m].
        computed: Stiffness (N,) [N/m], or over the first one [-].
        paper_at: Where the paper prints a value (M,).
        paper: Those values (M,), in the unit of ``computed``.
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
        swept: ``"tension"``, of the force-controlled cables as reported [N], or
            ``"cable_stiffness"`` [N/m].
        relative: Whether the stiffness is given over its first value.
        traces: Its curves.
        fit: The prototype it was made on.
    """

    swept: Literal["tension", "cable_stiffness"]
    relative: bool
    traces: tuple[Trace, ...]
    fit: PrototypeFit

    def numbers(self) -> dict[str, object]:
        """Its curves as plain numbers in SI, for JSON."""
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
    """Every number of Section V over what the identified prototype gives.

    Attributes:
        fits: The prototype identified at each step.
    """

    fits: tuple[PrototypeFit, ...]

    def numbers(self) -> dict[str, object]:
        """Parameters and residuals of all steps, for JSON."""
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
        """Parameters of the identified prototypes; * where one is at a bound."""
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
    """Stiffness in x, y and z over tension with the 1×19 strand, beside Table II.

    Once as printed, once with x and y exchanged in rows 2 to 4, for which there is evidence in the
    paper (see :data:`~cdsm.paper.section_v.TABLE_II_SWAPPED`), and that once more with uneven
    tensions and weights of finite size, for Table II alone. No step is a proof: the last frees 14
    parameters for 15 numbers.
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
    """Stiffness in y over tension with hybrid cables of constant stiffness, two configurations."""
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
    """Stiffness in y over that of the cables, tension constant, two configurations."""
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
    """All numbers of Section V against one prototype, for each step of reading Table II."""
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
    """Stiffness in x, y and z over tension, beside the columns of the table it was fitted to."""
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
    """What a step makes of Table II: its columns, and how much they rise."""
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
    """A trace for each configuration, over its first value; the paper's is at the end."""
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

"""Figs. 10, 12 and 13, Table II and the accuracy check of Section V, as virtual experiments.

They are made on the one prototype that :mod:`cdsm.paper.prototype` identifies from their own
numbers, so that agreement shows no more than that such a prototype could be; what does not agree
contradicts the model, an assumption, or the rest of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal, final

import numpy as np

from cdsm.paper.figures import Claim
from cdsm.paper.prototype import STEPS, PrototypeFit, identify_prototype
from cdsm.paper.section_v import AXES, CHECK, DROPS, HYBRID, MEASURED, RISES, TENSIONS
from cdsm.support.validation import Array, frozen

_POINTS: Final = 40


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
class ExperimentFigure:
    """A virtual experiment on the identified prototype.

    Attributes:
        name: ``"fig10"``, ``"fig12"`` or ``"fig13"``.
        title: What it shows.
        swept: ``"tension"``, of the force-controlled cables as reported [N], or
            ``"cable_stiffness"`` [N/m].
        relative: Whether the stiffness is given over its first value.
        traces: Its curves.
        fit: The prototype it was made on.
        claims: What the paper says of it.
    """

    name: str
    title: str
    swept: Literal["tension", "cable_stiffness"]
    relative: bool
    traces: tuple[Trace, ...]
    fit: PrototypeFit
    claims: tuple[Claim, ...]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class PrototypeFigure:
    """Every number of Section V over what the identified prototype gives.

    Attributes:
        name: ``"prototype"``.
        title: What it shows.
        fits: The prototype identified at each step.
        claims: What the paper says, and how well each step explains it.
    """

    name: str
    title: str
    fits: tuple[PrototypeFit, ...]
    claims: tuple[Claim, ...]


def figure_10() -> ExperimentFigure:
    """Stiffness in x, y and z over tension with the 1×19 strand, beside Table II.

    Once as printed, once with x and y exchanged in rows 2 to 4, for which there is evidence in the
    paper (see :data:`~cdsm.paper.section_v.TABLE_II_SWAPPED`), and that once more with uneven
    tensions and weights of finite size, for Table II alone. No step is a proof: the last frees 14
    parameters for 15 numbers.
    """
    shown = (STEPS[0], STEPS[1], STEPS[-1])
    fits = [_identified(step.label) for step in shown]
    return ExperimentFigure(
        name="fig10",
        title="Fig. 10, Table II: stiffness over tension, 1×19 strand, identified prototypes",
        swept="tension",
        relative=False,
        traces=tuple(trace for fit in fits for trace in _over_tension(fit)),
        fit=fits[1],
        claims=tuple(claim for fit in fits for claim in _of_table(fit)),
    )


def _over_tension(fit: PrototypeFit) -> tuple[Trace, ...]:
    """Stiffness in x, y and z over tension, beside the columns of the table it was fitted to."""
    found = fit.prototype
    tensions = np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS)
    curves = found.weigh(found.arm().at(found.configurations[0]), tensions)
    return tuple(
        Trace(
            label=f"{axis}: {fit.step.label}",
            swept=frozen(tensions),
            computed=frozen(curves[:, i].copy()),
            paper_at=frozen(found.levels),
            paper=frozen(fit.step.table[:, i].copy()),
        )
        for i, axis in enumerate(AXES)
    )


def _of_table(fit: PrototypeFit) -> tuple[Claim, ...]:
    """What a step makes of Table II."""
    table, computed = fit.step.table, fit.predicted.table
    assumed = f"{fit.step.label}; {fit.step.count}"
    return (
        *(
            _claim("Table II", f"stiffness in {axis}", "N/mm", paper, ours, assumed)
            for axis, paper, ours in zip(AXES, table.T / 1e3, computed.T / 1e3, strict=True)
        ),
        _claim(
            "Fig. 10",
            "increment of stiffness, (last − first)/first",
            "times",
            table[-1] / table[0] - 1.0,
            computed[-1] / computed[0] - 1.0,
            assumed,
        ),
    )


def figure_12() -> ExperimentFigure:
    """Stiffness in y over tension with hybrid cables of constant stiffness, two configurations."""
    fit = _identified()
    found = fit.prototype
    tensions = np.linspace(TENSIONS[0], found.highest_hybrid_tension, _POINTS)
    soft = found.arm(HYBRID)
    return ExperimentFigure(
        name="fig12",
        title="Fig. 12: stiffness in y over tension, cables of 1.89 N/mm, identified prototype",
        swept="tension",
        relative=True,
        traces=_configurations(
            fit,
            tensions,
            lambda q: found.measure(soft.at(q), tensions)[:, 1],
            1.0 - np.array(DROPS),
        ),
        fit=fit,
        claims=(
            _claim(
                "Fig. 12",
                "largest reduction of stiffness in y, two configurations",
                "%",
                100.0 * np.array(DROPS),
                100.0 * np.array(fit.predicted.drops),
                f"identified prototype; tension 3 to {tensions[-1]:.3g} N and second "
                "configuration identified with it",
            ),
        ),
    )


def figure_13() -> ExperimentFigure:
    """Stiffness in y over that of the cables, tension constant, two configurations."""
    fit = _identified()
    found = fit.prototype
    springs = np.linspace(HYBRID, HYBRID * found.spring_ratio, _POINTS)
    arms = [found.arm(spring) for spring in springs.tolist()]
    return ExperimentFigure(
        name="fig13",
        title="Fig. 13: stiffness in y over that of the cables, identified prototype",
        swept="cable_stiffness",
        relative=True,
        traces=_configurations(
            fit,
            springs,
            lambda q: np.array(
                [found.measure(arm.at(q), found.hybrid_tension)[0, 1] for arm in arms]
            ),
            1.0 + np.array(RISES),
        ),
        fit=fit,
        claims=(
            _claim(
                "Fig. 13",
                "increment of stiffness in y, two configurations",
                "times",
                np.array(RISES),
                np.array(fit.predicted.rises),
                f"identified prototype; stiffest spring {found.spring_ratio:.3g} times the softest "
                f"and tension {found.hybrid_tension:.3g} N identified with it",
            ),
        ),
    )


def figure_prototype() -> PrototypeFigure:
    """All numbers of Section V against one prototype, for each step of reading Table II."""
    fits = tuple(_identified(step.label) for step in STEPS)
    return PrototypeFigure(
        name="prototype",
        title="Section V: every number against one identified prototype",
        fits=fits,
        claims=(
            *(
                _claim(
                    "Section V-B",
                    "accuracy check in z, off the paper's calculated 0.139 N/mm",
                    "%",
                    np.array([100.0 * (MEASURED / CHECK - 1.0)]),
                    np.array([100.0 * (fit.predicted.check / CHECK - 1.0)]),
                    f"{fit.step.label}; the paper's is its measurement, 0.131 N/mm; posture of "
                    "Table II, cables of 1.89 N/mm",
                )
                for fit in fits
                if fit.predicted.check is not None
            ),
            *(
                _claim(
                    "Section V",
                    "typical misfit of Table II in x, y, z",
                    "%",
                    None,
                    100.0 * fit.misfit,
                    f"{fit.step.label}; {fit.step.count}; at a "
                    f"bound: {', '.join(fit.at_bound) or 'none'}",
                )
                for fit in fits
            ),
        ),
    )


@cache
def _identified(label: str = STEPS[1].label) -> PrototypeFit:
    return identify_prototype(next(step for step in STEPS if step.label == label))


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


def _claim(
    figure: str, quantity: str, unit: str, paper: Array | None, computed: Array, assumption: str
) -> Claim:
    return Claim(
        figure=figure,
        quantity=quantity,
        unit=unit,
        paper=None if paper is None else tuple(paper.tolist()),
        computed=tuple(computed.tolist()),
        original=(),  # the same: these were measured with weights
        along=(),
        assumption=assumption,
        searched="all parameters of the prototype",
    )

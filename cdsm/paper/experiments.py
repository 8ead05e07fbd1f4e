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

from cdsm._checks import Array, frozen
from cdsm.paper.figures import Claim
from cdsm.paper.prototype import PrototypeFit, identify_prototype
from cdsm.paper.section_v import AXES, CHECK, DROPS, HYBRID, NAMES, RISES, TABLE_II, TENSIONS

_POINTS: Final = 40
_LEFT_OUT: Final = ("Table II, x", "Table II, y", "Table II, z", "V-B")
"""What contradicts the rest, or might; without Figs. 12 and 13 hardly anything changes."""


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
        fit: The prototype identified from all of them.
        without: Prototypes identified without some of them, by what was left out.
        claims: What the paper says, and which of its data contradict each other.
    """

    name: str
    title: str
    fit: PrototypeFit
    without: dict[str, PrototypeFit]
    claims: tuple[Claim, ...]


def figure_10() -> ExperimentFigure:
    """Stiffness in x, y and z over tension with the 1×19 strand, beside Table II.

    Whatever the tensions between 3 and 86 N were, no common rise of the cables' rigidity explains
    all columns: from the first to the second y grows 3.3-fold and x 1.2-fold, from there to the
    last y 1.4-fold and x 2.6-fold. And evenly spaced, x and z rise ever faster while the slope of
    Eq. 19 falls from 31 N on.
    """
    fit = _identified()
    found = fit.prototype
    tensions = np.linspace(TENSIONS[0], TENSIONS[-1], _POINTS)
    curves = found.measure(found.arm().at(found.configurations[0]), tensions)
    computed = fit.predicted.table
    assumed = "one identified prototype, five evenly spaced tensions"
    return ExperimentFigure(
        name="fig10",
        title="Fig. 10, Table II: stiffness over tension, 1×19 strand, identified prototype",
        swept="tension",
        relative=False,
        traces=tuple(
            Trace(
                label=axis,
                swept=frozen(tensions),
                computed=frozen(curves[:, i].copy()),
                paper_at=TENSIONS,
                paper=frozen(TABLE_II[:, i].copy()),
            )
            for i, axis in enumerate(AXES)
        ),
        fit=fit,
        claims=(
            *(
                _claim("Table II", f"stiffness in {axis}", "N/mm", paper, ours, assumed)
                for axis, paper, ours in zip(AXES, TABLE_II.T / 1e3, computed.T / 1e3, strict=True)
            ),
            _claim(
                "Fig. 10",
                "increment of stiffness, (last − first)/first",
                "times",
                TABLE_II[-1] / TABLE_II[0] - 1.0,
                computed[-1] / computed[0] - 1.0,
                assumed,
            ),
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
    """All numbers of Section V against one prototype, and against those without some of them."""
    fit = _identified()
    without = {
        group: _identified(tuple(name for name in NAMES if name.startswith(group)))
        for group in _LEFT_OUT
    }
    return PrototypeFigure(
        name="prototype",
        title="Section V: every number against one identified prototype",
        fit=fit,
        without=without,
        claims=(
            _claim(
                "Section V-B",
                "stiffness in z of the accuracy check",
                "N/mm",
                np.array([CHECK / 1e3]),
                np.array([fit.predicted.check / 1e3]),
                "0.139 is the paper's own model, 0.131 measured; identified prototype, Table II's "
                "posture, cables of 1.89 N/mm",
            ),
            *(
                _claim(
                    "Section V",
                    f"typical misfit of Table II (x, y, z) {name}",
                    "%",
                    None,
                    _typical(each),
                    f"{name}; at a bound: {', '.join(each.at_bound) or 'nothing'}",
                )
                for name, each in {
                    "identified from all data": fit,
                    **{f"leaving out {group}": each for group, each in without.items()},
                }.items()
            ),
        ),
    )


@cache
def _identified(without: tuple[str, ...] = ()) -> PrototypeFit:
    return identify_prototype(without=without)


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


def _typical(fit: PrototypeFit) -> Array:
    """Root mean square of ln(model/paper) over the columns of Table II (3,) [%]."""
    table = fit.residuals[: TABLE_II.size].reshape(TABLE_II.shape)
    return np.asarray(100.0 * np.sqrt(np.mean(table**2, axis=0)))


def _claim(
    figure: str, quantity: str, unit: str, paper: Array | None, computed: Array, assumption: str
) -> Claim:
    return Claim(
        figure=figure,
        quantity=quantity,
        unit=unit,
        paper=None if paper is None else tuple(paper.tolist()),
        computed=tuple(computed.tolist()),
        along=(),  # the same: these were measured with weights
        assumption=assumption,
    )

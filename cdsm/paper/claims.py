"""Compare numbers that the paper states with computed ones, and write both as text or JSON."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import cdsm

if TYPE_CHECKING:
    from matplotlib import figure

HEADER = (
    *("figure", "quantity", "paper", "computed", "difference", "original length", "hung weight"),
    *("assumption", "searched"),
)
"""Columns of :func:`to_rows`."""

EXPLANATION = (
    "Three numbers are x, y, z. computed: K_R as the paper writes it, with the pseudo-inverse of "
    "the Jacobian, and with the stretched length of the cables in EA/l_0; original length: the "
    "same with the unstrained length, which locked motors hold; hung weight: with that, the "
    "stiffness that a small weight at the tip measures. searched: what was chosen to meet the "
    "paper's number. Section V was measured with weights: there computed is that, on one prototype "
    "whose dimensions were fitted to the same data. All of it is frictionless, links rigid. "
    "Left out: Fig. 9, a photograph, and Fig. 11, measured springs without printed numbers."
)
"""Meaning of the columns, and the figures that are left out."""


@final
@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number of the paper, or one for each of x, y and z, and the computed numbers.

    Attributes:
        figure: Name of the figure.
        quantity: Name of the compared quantity.
        unit: Unit of all numbers.
        paper: Numbers of the paper; None if the paper gives words only.
        computed: K_R with the pseudo-inverse and l_0 = L, as in the paper; for Section V the
            stiffness measured by weights; for Fig. 5 numbers of the strand.
        original: As ``computed``, but with the original length l_0. Empty for Fig. 5 and Section V.
        along: Stiffness that a small weight measures, with the original length l_0. Empty for
            Fig. 5 and Section V.
        assumption: Assumptions where the paper is silent.
        searched: Assumptions that were searched to meet the paper's number; empty if none.
        at_most: Whether the paper's number is an upper bound.
    """

    figure: str
    quantity: str
    unit: str
    paper: tuple[float, ...] | None = None
    computed: tuple[float, ...]
    original: tuple[float, ...] = ()
    along: tuple[float, ...] = ()
    assumption: str
    searched: str = ""
    at_most: bool = False

    @property
    def difference(self) -> tuple[float, ...] | None:
        """``computed`` − ``paper``; None if ``paper`` is None or an upper bound."""
        if self.paper is None or self.at_most:
            return None
        return tuple(ours - theirs for ours, theirs in zip(self.computed, self.paper, strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class Figure(ABC):
    """One recomputed figure of the paper. Each subclass adds its curves.

    Attributes:
        name: ``"fig3"``, ``"lead"`` and so on.
        title: Title above the figure.
        claims: Numbers of the paper, each with the computed numbers.
    """

    name: str
    title: str
    claims: tuple[Claim, ...]

    def plot(self) -> figure.Figure:
        """Plot the curves, with the numbers that the paper prints."""
        return cdsm.plots.plot_paper(self)

    @abstractmethod
    def numbers(self) -> dict[str, object]:
        """Return the curves as plain SI numbers, for JSON."""


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """Convert values to a tuple of floats, as a :class:`Claim` stores them."""
    return tuple(float(value) for value in values)


SUMMARY = ("number that deviates most", "compared", "deviation", "paper", "computed")
"""Columns of :func:`to_summary`."""


def to_summary(figures: Sequence[Figure]) -> list[tuple[str, ...]]:
    """Return a row per figure with its claim that deviates most from the paper.

    :data:`SUMMARY` names the columns. A deviation is relative to the largest number of the paper in
    the same claim.
    """
    rows: list[tuple[str, ...]] = []
    for figure in figures:
        compared = [claim for claim in figure.claims if claim.difference is not None]
        count = f"{len(compared)} of {len(figure.claims)}"
        if compared:
            worst = max(compared, key=_deviation)
            name = f"{worst.figure}: {worst.quantity} [{worst.unit}]"
            numbers = _listed(worst.paper, ".4g"), _listed(worst.computed, ".3g")
            rows.append((name, count, f"{100.0 * _deviation(worst):.2g} %", *numbers))
        else:
            rows.append((f"{figure.claims[0].figure}: no numbers in the paper", count, "", "", ""))
    return rows


def _deviation(claim: Claim) -> float:
    """Return the largest difference of a claim, divided by the largest of the paper's numbers."""
    assert claim.difference is not None
    assert claim.paper is not None
    return max(map(abs, claim.difference)) / max(map(abs, claim.paper))


def to_rows(figures: Sequence[Figure]) -> list[tuple[str, ...]]:
    """Return a row of text for each claim of ``figures``; :data:`HEADER` names the columns."""
    return [
        (
            claim.figure,
            f"{claim.quantity} [{claim.unit}]",
            ("≤ " if claim.at_most else "") + _listed(claim.paper, ".4g"),
            _listed(claim.computed, ".3g"),
            _listed(claim.difference, "+.2g"),
            _listed(claim.original, ".3g"),
            _listed(claim.along, ".3g"),
            claim.assumption,
            claim.searched or "–",
        )
        for figure in figures
        for claim in figure.claims
    ]


def to_markdown(figures: Sequence[Figure]) -> str:
    """Return a table of all claims with their assumptions, in Markdown, and what it means."""
    return f"{markdown_table(HEADER, to_rows(figures))}\n\n{EXPLANATION}\n"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown, with ``header`` above ``rows``."""
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def to_dict(figures: Sequence[Figure]) -> dict[str, object]:
    """Return all curves (plain SI numbers) and claims of ``figures``, ready for JSON."""
    return {
        figure.name: {
            "title": figure.title,
            **figure.numbers(),
            "claims": [{**vars(claim), "difference": claim.difference} for claim in figure.claims],
        }
        for figure in figures
    }


def _listed(values: tuple[float, ...] | None, form: str) -> str:
    return "–" if not values else ", ".join(format(value, form) for value in values)

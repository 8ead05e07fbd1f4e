"""Compare numbers that the paper states with computed ones, and write both as text or JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, final

from cdsm.support.result import Result, unit
from cdsm.support.values import Plotted

HEADER = (
    *("figure", "quantity", "paper", "computed", "difference", "verdict", "original length"),
    *("hung weight", "assumption", "searched"),
)
"""Columns of :func:`to_rows`."""

EXPLANATION = (
    "Three numbers are x, y, z. computed: K_R as the paper writes it, with the pseudo-inverse of "
    "the Jacobian, and with the stretched length of the cables in EA/l_0. verdict: all numbers are "
    "within the printed digits; or hold within a fifth; or have the sign only; misprint: a digit "
    "of the paper is wrong. original length: computed with the unstrained length, which locked "
    "motors hold; hung weight: with that, the stiffness that a small weight at the tip measures. "
    "searched: what was chosen to meet the "
    "paper's number. Section V was measured with weights: there computed is that, on one prototype "
    "whose dimensions were fitted to the same data. All of it is frictionless, links rigid. "
    "Left out: Fig. 9, a photograph, and Fig. 11, measured springs without printed numbers."
)
"""Meaning of the columns, and the figures that are left out."""


_HOLDS = 0.2  # largest difference with which a number of the paper holds, as a part of it

Statement: TypeAlias = tuple[str, str, str, tuple[float, ...] | None]
"""What the paper says: the first four fields of a :class:`Claim`."""


@final
@dataclass(frozen=True)
class Claim:
    """A number of the paper, or one for each of x, y and z, and the computed numbers.

    Attributes:
        figure: Name of the figure.
        quantity: Name of the compared quantity.
        unit: Unit of all numbers.
        paper: Numbers of the paper; None if the paper gives words only.
        computed: `K_R` with the pseudo-inverse and `l_0 = L`, as in the paper; for Section V the
            stiffness measured by weights; for Fig. 5 numbers of the strand.
        original: As ``computed``, but with the original length `l_0`. Empty for Fig. 5 and Section
            V.
        along: Stiffness that a small weight measures, with the original length `l_0`. Empty for
            Fig. 5 and Section V.
        assumption: Assumptions where the paper is silent.
        searched: Assumptions that were searched to meet the paper's number; empty if none.
        at_most: Whether the paper's number is an upper bound.
        misprint: Whether the row shows a misprint of the paper.
    """

    figure: str
    quantity: str
    unit: str
    paper: tuple[float, ...] | None
    computed: tuple[float, ...]
    original: tuple[float, ...] = ()
    along: tuple[float, ...] = ()
    assumption: str = field(kw_only=True)
    searched: str = ""
    at_most: bool = False
    misprint: bool = False

    @property
    def verdict(self) -> str:
        """How the paper's numbers stand to the computed ones; "–" where the paper has none.

        ``within printed digits``; ``holds``: all within a fifth of the paper's, or below its bound;
        ``sign only``; ``differs``; or ``misprint``.
        """
        if self.misprint or not self.paper:
            return "misprint" if self.misprint else "–"
        if self.at_most:
            return "holds" if max(self.computed) <= self.paper[0] else "differs"
        pairs = [*zip(self.computed, self.paper, strict=True)]
        if all(abs(ours - theirs) <= _half_digit(theirs) for ours, theirs in pairs):
            return "within printed digits"
        if all(abs(ours - theirs) <= _HOLDS * abs(theirs) for ours, theirs in pairs):
            return "holds"
        return "sign only" if all(ours * theirs > 0.0 for ours, theirs in pairs) else "differs"

    @property
    def difference(self) -> tuple[float, ...] | None:
        """``computed`` − ``paper``; None if ``paper`` is None or an upper bound."""
        if self.paper is None or self.at_most:
            return None
        return tuple(ours - theirs for ours, theirs in zip(self.computed, self.paper, strict=True))

    def to_dict(self) -> dict[str, object]:
        """Return all fields, the difference and the verdict, for JSON."""
        return {**vars(self), "difference": self.difference, "verdict": self.verdict}


@dataclass(frozen=True, eq=False, kw_only=True)
class Figure(Result, Plotted):
    """One recomputed figure of the paper. Each subclass adds its curves.

    Attributes:
        name: ``"fig3"``, ``"lead"`` and so on.
        title: Title above the figure.
        claims: Numbers of the paper, each with the computed numbers.
    """

    _figure = "plot_paper"

    name: str
    title: str = field(metadata=unit("1"))
    claims: tuple[Claim, ...] = field(metadata=unit("1"))


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """Convert values to a tuple of floats, as a :class:`Claim` stores them."""
    return tuple(float(value) for value in values)


def to_rows(figures: Sequence[Figure]) -> list[tuple[str, ...]]:
    """Return a row of text for each claim of ``figures``; :data:`HEADER` names the columns."""
    return [
        (
            claim.figure,
            f"{claim.quantity} [{claim.unit}]",
            ("≤ " if claim.at_most else "") + _joined(claim.paper, ".4g"),
            _joined(claim.computed, ".3g"),
            _joined(claim.difference, "+.2g"),
            claim.verdict,
            _joined(claim.original, ".3g"),
            _joined(claim.along, ".3g"),
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
    """Return all curves (in SI) and claims of ``figures`` by name, ready for JSON."""
    return {figure.name: figure.to_dict() for figure in figures}


def _half_digit(number: float) -> float:
    """Return half a unit of the last digit that is printed of a number."""
    return 0.5 * 10.0 ** -len(f"{number:.10g}".partition(".")[2])


def _joined(values: tuple[float, ...] | None, form: str) -> str:
    return "–" if not values else ", ".join(format(value, form) for value in values)

"""What a recomputed figure is: what the paper claims, what comes out, and both as text or JSON."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import final

HEADER = (
    *("figure", "quantity", "paper", "computed", "difference", "original length", "hung weight"),
    *("assumption", "searched"),
)

EXPLANATION = (
    "Three numbers are x, y, z. computed: K_R as the paper writes it, with the pseudo-inverse of "
    "the Jacobian, and with the stretched length of the cables in EA/l_0; original length: the "
    "same with the unstrained length, which locked motors hold; hung weight: with that, the "
    "stiffness that a small weight at the tip measures. searched: what was chosen to meet the "
    "paper's number. Section V was measured with weights: there computed is that, on one prototype "
    "identified from the same data within stated bounds. All of it is frictionless, links rigid."
)


@final
@dataclass(frozen=True, kw_only=True)
class Claim:
    """One number or triple of the paper, and what comes out.

    Attributes:
        figure: Name of the figure.
        quantity: What is compared.
        unit: Unit of all numbers.
        paper: The paper's numbers, x, y, z or one; None where it gives words only.
        computed: Ours, in the paper's reading: pseudo-inverse, and l_0 = L.
        original: Ours, the pseudo-inverse with the original length; empty where no cable strains.
        along: Ours, for a small weight hung at the tip, with the original length; empty where no
            arm is involved.
        assumption: What the paper leaves open and we chose.
        searched: Which of these assumptions were searched for the paper's number; empty: none.
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
        """Computed minus the paper's, in :attr:`unit`; None where that means nothing."""
        if self.paper is None or self.at_most:
            return None
        return tuple(ours - theirs for ours, theirs in zip(self.computed, self.paper, strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class Figure(ABC):
    """One recomputed figure of the paper; its subclasses hold what is drawn.

    Attributes:
        name: ``"fig3"``, ``"lead"`` and so on.
        title: What it shows.
        claims: What the paper says of it.
    """

    name: str
    title: str
    claims: tuple[Claim, ...]

    @abstractmethod
    def numbers(self) -> dict[str, object]:
        """Its curves as plain numbers in SI, for JSON."""

    def tables(self) -> tuple[str, ...]:
        """Further tables of the report, in Markdown."""
        return ()


def floats(values: Iterable[float]) -> tuple[float, ...]:
    """The numbers of a claim."""
    return tuple(float(value) for value in values)


def to_rows(figures: Sequence[Figure]) -> list[tuple[str, ...]]:
    """The claims, one row of text each under :data:`HEADER`."""
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
    """The claims as a Markdown table: what the paper says, what comes out, and what was assumed."""
    further = [table for figure in figures for table in figure.tables()]
    return "\n\n".join([markdown_table(HEADER, to_rows(figures)), EXPLANATION, *further]) + "\n"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def to_dict(figures: Sequence[Figure]) -> dict[str, object]:
    """All curves and claims as plain SI numbers, ready for JSON."""
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

"""The simulation study of the paper (Section IV), recomputed: Figs. 3 to 8."""

from collections.abc import Callable
from typing import Final

from cdsm.paper.figures import (
    Claim,
    Curve,
    Figure,
    figure_3,
    figure_4,
    figure_6,
    figure_7,
    figure_8,
)
from cdsm.paper.report import EXPLANATION, HEADER, to_dict, to_markdown, to_rows
from cdsm.paper.strand import StrandFigure, figure_5

FIGURES: Final[dict[str, Callable[[], Figure | StrandFigure]]] = {
    "fig3": figure_3,
    "fig4": figure_4,
    "fig5": figure_5,
    "fig6": figure_6,
    "fig7": figure_7,
    "fig8": figure_8,
}
"""What computes each figure, by name."""

__all__ = [
    "EXPLANATION",
    "FIGURES",
    "HEADER",
    "Claim",
    "Curve",
    "Figure",
    "StrandFigure",
    "to_dict",
    "to_markdown",
    "to_rows",
]

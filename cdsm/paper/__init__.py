"""Recompute the paper: simulations (Section IV, Figs. 3 to 8) and experiments (Section V).

The prototype of Section V is here too: the paper gives none of its dimensions.
"""

from collections.abc import Callable
from typing import Final

from cdsm.paper.claims import HEADER, Claim, Figure, to_dict, to_markdown, to_rows
from cdsm.paper.experiments import ExperimentFigure, Trace, figure_10, figure_12, figure_13
from cdsm.paper.prototype import (
    experimental_prototype,
    experimental_prototype_geometry,
    fitted_prototype,
)
from cdsm.paper.simulation import (
    Curve,
    LeadFigure,
    StiffnessFigure,
    figure_3,
    figure_4,
    figure_6,
    figure_7,
    figure_8,
    figure_lead,
)
from cdsm.paper.strand import StrandFigure, figure_5, law_of_stretched_length

# fmt: off
FIGURES: Final[dict[str, Callable[[], Figure]]] = {
    "fig3": figure_3, "fig4": figure_4, "lead": figure_lead, "fig5": figure_5, "fig6": figure_6,
    "fig7": figure_7, "fig8": figure_8, "fig10": figure_10, "fig12": figure_12, "fig13": figure_13,
}
"""Function that computes each figure, by the name of the figure."""

__all__ = [
    "FIGURES", "HEADER", "Claim", "Curve", "ExperimentFigure", "Figure", "LeadFigure",
    "StiffnessFigure", "StrandFigure", "Trace", "experimental_prototype",
    "experimental_prototype_geometry", "fitted_prototype", "law_of_stretched_length", "to_dict",
    "to_markdown", "to_rows",
]
# fmt: on

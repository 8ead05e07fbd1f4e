"""The simulation study of the paper (Section IV), recomputed: Figs. 3, 4, 6, 7 and 8."""

from cdsm.paper.figures import FIGURES, Claim, Curve, Figure
from cdsm.paper.report import EXPLANATION, HEADER, to_dict, to_markdown, to_rows

__all__ = [
    "EXPLANATION",
    "FIGURES",
    "HEADER",
    "Claim",
    "Curve",
    "Figure",
    "to_dict",
    "to_markdown",
    "to_rows",
]

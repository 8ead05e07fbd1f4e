"""The recomputed figures as a table and as plain numbers."""

from __future__ import annotations

from collections.abc import Sequence

from cdsm.paper.figures import Figure
from cdsm.paper.strand import StrandFigure

HEADER = ("figure", "quantity", "paper", "computed", "difference", "hung weight", "assumption")

EXPLANATION = (
    "Three numbers are x, y, z. computed: K_R read as the paper writes it, with the pseudo-inverse "
    "of the Jacobian; hung weight: the same for the stiffness that a weight at the tip measures."
)


def to_rows(results: Sequence[Figure | StrandFigure]) -> list[tuple[str, ...]]:
    """The claims, one row of text each under :data:`HEADER`.

    Args:
        results: The figures to report.
    """
    return [
        (
            claim.figure,
            f"{claim.quantity} [{claim.unit}]",
            ("≤ " if claim.at_most else "") + _numbers(claim.paper, ".4g"),
            _numbers(claim.computed, ".3g"),
            _numbers(claim.difference, "+.2g"),
            _numbers(claim.along, ".3g"),
            claim.assumption,
        )
        for figure in results
        for claim in figure.claims
    ]


def to_markdown(results: Sequence[Figure | StrandFigure]) -> str:
    """The claims as a Markdown table: what the paper says, what comes out, and what was assumed.

    Args:
        results: The figures to report.
    """
    lines = [HEADER, ("---",) * len(HEADER), *to_rows(results)]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    return f"{table}\n\n{EXPLANATION}\n"


def to_dict(results: Sequence[Figure | StrandFigure]) -> dict[str, object]:
    """All curves and claims as plain SI numbers, ready for JSON.

    Args:
        results: The figures to report.
    """
    return {
        figure.name: {
            "title": figure.title,
            **(_strand(figure) if isinstance(figure, StrandFigure) else _stiffness(figure)),
            "claims": [{**vars(claim), "difference": claim.difference} for claim in figure.claims],
        }
        for figure in results
    }


def _strand(figure: StrandFigure) -> dict[str, object]:
    return {
        "gauge_length_m": figure.gauge_length,
        "tension_N": figure.tension.tolist(),
        "displacement_m": figure.displacement.tolist(),
        "tangent_rigidity_N": figure.tangent.tolist(),
        "secant_rigidity_N": figure.secant.tolist(),
        "as_printed_N": figure.printed.tolist(),
    }


def _stiffness(figure: Figure) -> dict[str, object]:
    return {
        "postures_rad": [pose.q.tolist() for pose in figure.postures],
        "curves": [
            {
                "label": curve.label,
                _SWEPT[figure.swept]: curve.swept.tolist(),
                "tension_min_mean_max_N": curve.tension.tolist(),
                "pseudoinverse_xyz_N_per_m": curve.pseudoinverse.tolist(),
                "along_xyz_N_per_m": curve.along.tolist(),
                f"{figure.part}_part": {
                    "pseudoinverse_xyz_N_per_m": curve.pseudoinverse_part.tolist(),
                    "along_xyz_N_per_m": curve.along_part.tolist(),
                },
            }
            for curve in figure.curves
        ],
    }


_SWEPT = {"young_modulus": "young_modulus_Pa", "tension": "minimum_tension_N"}


def _numbers(values: tuple[float, ...] | None, form: str) -> str:
    return "–" if not values else ", ".join(format(value, form) for value in values)

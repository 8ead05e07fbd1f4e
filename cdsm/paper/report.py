"""The recomputed figures as a table and as plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from cdsm.paper.experiments import ExperimentFigure, PrototypeFigure
from cdsm.paper.figures import Figure
from cdsm.paper.lead import LeadFigure
from cdsm.paper.prototype import BOUNDS, PrototypeFit
from cdsm.paper.strand import StrandFigure

Result = Figure | LeadFigure | StrandFigure | ExperimentFigure | PrototypeFigure
"""What any part of the paper recomputed is."""

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


def to_rows(results: Sequence[Result]) -> list[tuple[str, ...]]:
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
            _numbers(claim.original, ".3g"),
            _numbers(claim.along, ".3g"),
            claim.assumption,
            claim.searched or "–",
        )
        for figure in results
        for claim in figure.claims
    ]


def to_markdown(results: Sequence[Result]) -> str:
    """The claims as a Markdown table: what the paper says, what comes out, and what was assumed.

    Args:
        results: The figures to report.
    """
    lines = [HEADER, ("---",) * len(HEADER), *to_rows(results)]
    table = "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
    sections = [table, EXPLANATION]
    for each in results:
        if isinstance(each, PrototypeFigure):
            sections.append(_prototypes(each.fits))
    return "\n\n".join(sections) + "\n"


def _prototypes(fits: Sequence[PrototypeFit]) -> str:
    """Parameters of the identified prototypes as a Markdown table; * where one is at a bound."""
    rows = [
        ("parameter [SI]", "from", "to", *(fit.step.label for fit in fits)),
        ("---",) * (3 + len(fits)),
    ]
    for name, (low, high) in BOUNDS.items():
        cells = [
            "–"
            if name not in fit.step.free
            else f"{getattr(fit.prototype, name):.4g}" + ("*" if name in fit.at_bound else "")
            for fit in fits
        ]
        rows.append((name, f"{low:.4g}", f"{high:.4g}", *cells))
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def to_dict(results: Sequence[Result]) -> dict[str, object]:
    """All curves and claims as plain SI numbers, ready for JSON.

    Args:
        results: The figures to report.
    """
    return {
        figure.name: {
            "title": figure.title,
            **_numbers_of(figure),
            "claims": [{**vars(claim), "difference": claim.difference} for claim in figure.claims],
        }
        for figure in results
    }


def _numbers_of(figure: Result) -> dict[str, object]:
    if isinstance(figure, StrandFigure):
        return _strand(figure)
    if isinstance(figure, LeadFigure):
        return _lead(figure)
    if isinstance(figure, ExperimentFigure):
        return _experiment(figure)
    return _fits(figure) if isinstance(figure, PrototypeFigure) else _stiffness(figure)


def _strand(figure: StrandFigure) -> dict[str, object]:
    return {
        "gauge_length_m": figure.gauge_length,
        "tension_N": figure.tension.tolist(),
        "displacement_m": figure.displacement.tolist(),
        "tangent_rigidity_N": figure.tangent.tolist(),
        "secant_rigidity_N": figure.secant.tolist(),
        "least_rigidity_N": figure.low.tolist(),
        "largest_rigidity_N": figure.high.tolist(),
        "as_printed_N": figure.printed.tolist(),
    }


def _lead(figure: LeadFigure) -> dict[str, object]:
    return {
        "lead_m": figure.leads.tolist(),
        **{
            f"{name}_change_xyz_percent": getattr(figure, name).tolist()
            for name in ("pseudoinverse", "along", "stretched_pseudoinverse", "stretched_along")
        },
    }


def _stiffness(figure: Figure) -> dict[str, object]:
    return {
        "postures_rad": [pose.q.tolist() for pose in figure.postures],
        "curves": [
            {
                "label": curve.label,
                "original_length": curve.original_length,
                _SWEPT[figure.swept]: curve.swept.tolist(),
                "tension_min_mean_max_N": curve.tension.tolist(),
                "pseudoinverse_xyz_N_per_m": curve.pseudoinverse.tolist(),
                "along_xyz_N_per_m": curve.along.tolist(),
                f"{figure.part}_part": {
                    "pseudoinverse_xyz_N_per_m": curve.pseudoinverse_part.tolist(),
                    "along_xyz_N_per_m": curve.along_part.tolist(),
                },
            }
            for curve in (*figure.curves, *figure.original)
        ],
    }


def _experiment(figure: ExperimentFigure) -> dict[str, object]:
    swept = {"tension": "tension_N", "cable_stiffness": "cable_stiffness_N_per_m"}[figure.swept]
    computed = "stiffness_over_first" if figure.relative else "stiffness_N_per_m"
    return {
        "curves": [
            {
                "label": trace.label,
                swept: trace.swept.tolist(),
                computed: trace.computed.tolist(),
                f"paper_{swept}": trace.paper_at.tolist(),
                f"paper_{computed}": trace.paper.tolist(),
            }
            for trace in figure.traces
        ]
    }


def _fits(figure: PrototypeFigure) -> dict[str, object]:
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
            for fit in figure.fits
        ],
    }


_SWEPT = {"young_modulus": "young_modulus_Pa", "tension": "minimum_tension_N"}


def _numbers(values: tuple[float, ...] | None, form: str) -> str:
    return "–" if not values else ", ".join(format(value, form) for value in values)

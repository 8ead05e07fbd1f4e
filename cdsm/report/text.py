"""The report as text and as HTML, both by rich."""

from __future__ import annotations

from collections.abc import Iterator
from io import StringIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from cdsm.report.report import Report


def printed(report: Report, about: str = "") -> Console:
    """Return a console that has recorded the report; ``about`` is text below the title."""
    from rich.console import Console  # slow to import
    from rich.table import Table

    console = Console(
        record=True, file=StringIO(), width=100, markup=False, emoji=False, highlight=False
    )
    console.print(f"Stiffness check: {report.stiffness.posture.arm.name}", style="bold")
    if about:
        console.print(about)
    good = "PASS: agrees with finite differences, tensions balance the arm, arm is stable."
    bad = "FAIL: do not use this stiffness as it is."
    console.print(good if report.passed else bad, style="bold")
    for fault in report.faults:
        console.print(f"! {fault}", style="red")
    for note in report.notes:
        console.print(f"- {note}")
    console.print(f"\n{report.stiffness}\n")
    for head, *rows in _tables(report):
        table = Table(box=None, header_style="bold", pad_edge=False)
        for i, title in enumerate(head):
            table.add_column(title, justify="right" if i else "left", no_wrap=True)
        for row in rows:
            table.add_row(*row)
        console.print(table)
        console.print()
    said = "K_θ = ∂(J_Lᵀ F + g − J_Xᵀ W)/∂θ: rows torque, columns angle. F is tension, the cables' "
    console.print(f"{said}torque −J_Lᵀ F, the wrench W a dead load; readings are in base axes.")
    if (arm := report.stiffness.posture.arm).slides.any():
        console.print(
            f"Joints that slide count with the arm's length, {arm.length:.4g} m, as lever."
        )
    return console


def _tables(report: Report) -> Iterator[tuple[tuple[str, ...], ...]]:
    """Yield the rows of each table; the first has the titles of its columns."""
    rows = []
    for each in report.comparisons:
        size = each.largest or 1.0
        off = ("-", "-") if each.reason else (f"{each.off / size:.0e}", f"{each.error / size:.0e}")
        name = "cdsm.evaluate, all terms" if each.name == "batch" else each.name
        rows.append((name, f"{each.largest:.4g} {each.unit}", *off, each.verdict))
    yield ("against finite differences", "largest entry", "off by", "error bound", "verdict"), *rows
    facts = {
        "residual of Eq. 13": f"{report.residual:.1e} N m at {report.residual_joint}",
        "residual per torque": f"{report.imbalance:.1e}",
        "violation of bounds": report.bound_violation,
        "KKT residual (recomputed multipliers)": report.kkt_residual,
        "condition of K_θ": f"{report.condition:.3g}",
    }
    texts = {k: f"{v:.1e}" if isinstance(v, float) else v or "-" for k, v in facts.items()}
    yield ("balance, optimality, stability", ""), *texts.items()

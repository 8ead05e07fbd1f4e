"""The report on a stiffness: is it right, balanced and stable, and how to read it.

It is printed as text and as HTML, both by rich.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property
from io import StringIO
from typing import TYPE_CHECKING, final

import numpy as np

import cdsm
from cdsm.errors import CdsmError, SingularStiffness, listed
from cdsm.report import checks
from cdsm.report.checks import Comparison
from cdsm.stiffness_matrix.prints import missing_leads
from cdsm.support.format import plain
from cdsm.support.result import Result, quantity, unit

if TYPE_CHECKING:
    from rich.console import Console

    from cdsm.stiffness_matrix import Stiffness


@final
@dataclass(frozen=True, eq=False, repr=False)
class Report(Result):
    """Whether a stiffness is right, balanced and stable; made by :meth:`Stiffness.report`.

    Attributes:
        stiffness: The stiffness that was checked.
        comparisons: Terms of K_θ and torques against finite differences and the batch.
        residual: Largest residual |J_Lᵀ F + g − J_Xᵀ W| of Eq. 13 [N m]; the force at a prismatic
            joint is multiplied by the arm's length.
        residual_joint: Name of the joint with the largest residual.
        imbalance: ``residual`` per torque of cables, weight and load [-].
        bound_violation: Violation of the bounds of distributed tensions per largest tension [-];
            None for tensions that were given.
        kkt_residual: min ‖F + J_L λ − μ + ν‖/‖F‖ [-] of Eq. 17 over the multipliers λ of the
            balance, μ ≥ 0 and ν ≥ 0 of the bounds; None if the tensions need not be the least.
    """

    _posture_from = "stiffness.posture"

    stiffness: Stiffness
    comparisons: tuple[Comparison, ...]
    residual: float = field(metadata=unit("N m"))
    residual_joint: str = field(metadata=unit("1"))
    imbalance: float = field(metadata=unit("1"))
    bound_violation: float | None = field(metadata=unit("1"))
    kkt_residual: float | None = field(metadata=unit("1"))

    @quantity("1")
    def condition(self) -> float:
        """Condition number of K_θ [-], made dimensionless with the arm's length."""
        scale = checks.joint_unit(self.stiffness)
        return float(np.linalg.cond(self.stiffness.joint * scale[:, None] * scale))

    @property
    def passed(self) -> bool:
        """Whether there are no faults: all comparisons agree, the arm is in balance and stable."""
        return not self.faults

    @cached_property
    def faults(self) -> tuple[str, ...]:
        """Reasons not to use the stiffness, one text each; empty if there are none."""
        return tuple(_faults(self))

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Notes on how to read the stiffness, one text each, e.g. that a cable is slack."""
        return tuple(_notes(self))

    def to_dict(self) -> dict[str, object]:
        """Return the report and :meth:`Stiffness.to_dict` in SI for JSON, units in the keys."""
        said = {"passed": self.passed, "faults": self.faults, "notes": self.notes}
        checked = {"comparisons": [asdict(each) for each in self.comparisons]}
        return self.stiffness.to_dict() | plain(said | checked) | super().to_dict()

    def to_html(self, about: str = "") -> str:
        """Return the report as a self-contained HTML page; ``about`` is text below the title."""
        return _printed(self, about).export_html()

    def __repr__(self) -> str:
        name = self._posture.arm.name
        return f"<Report on the stiffness of {name}: {'PASS' if self.passed else 'FAIL'}>"

    def __str__(self) -> str:
        return "\n".join(map(str.rstrip, _printed(self).export_text().splitlines()))


def report_on(K: Stiffness) -> Report:
    """Compute the report on a stiffness."""
    return Report(K, checks.compared(K), *checks.balance_error(K), *checks.optimality(K))


def _faults(report: Report) -> Iterator[str]:
    """Yield the reasons not to use the stiffness of ``report``."""
    K = report.stiffness
    for each in report.comparisons:
        if each.verdict == "DIFFERS":
            yield (
                f"{each.name}: off by {each.off:.2g} {each.unit}, where the largest entry is "
                f"{each.largest:.4g} {each.unit}. Do not use this stiffness."
            )
    for reason in dict.fromkeys(each.reason for each in report.comparisons if each.reason):
        names = [each.name for each in report.comparisons if each.reason == reason]
        yield f"check not possible for {' and '.join(names)}: {reason}."
    if report.imbalance > checks.TOLERANCE:
        yield (
            f"the tensions do not balance the arm: the residual is {report.residual:.3g} N m at "
            f"{report.residual_joint}, {report.imbalance:.1e} of the torques; distribute_tension "
            "finds tensions that do."
        )
    if not K.is_stable:
        yield " ".join(map(str.strip, K.warnings))
    elif report.condition > 1e12:  # singular but for rounding
        yield f"the arm is about to buckle: K_θ has the condition number {report.condition:.2g}."
    violation = report.bound_violation or 0.0
    kkt = report.kkt_residual or 0.0
    if max(violation, kkt) > checks.TOLERANCE:
        yield f"the tensions are not optimal: bounds violated by {violation:.1e}, KKT {kkt:.1e}."


def _notes(report: Report) -> Iterator[str]:
    """Yield what a user of the stiffness should know; none of it means that it is wrong."""
    K = report.stiffness
    pose = report.stiffness.posture
    arm = report.stiffness.posture.arm
    yield from (*pose.remarks, *missing_leads(K))
    if report.bound_violation is None:
        came = "were given" if K.free_length is None else "follow from an equilibrium"
        yield f"the tensions {came}, not distributed: they need not be the least."
    elif report.kkt_residual is None:
        yield "the tensions were chosen for a stiffness: they are not the least."
    if arm.has_friction:
        yield f"the cables have friction; this K is frictionless, as after shaking. {_stuck(K)}"
    if K.wrench[3:].any():
        yield "with a moment at the tip K_θ is not symmetric: its symmetric part decides stability."
    yield from _of_limits(K)
    unit = checks.joint_unit(K)
    for matrix, full, what in (
        (pose.length_jacobian, arm.nv, "the cables give {} of {} joint torques."),
        (pose.jacobian[:3], 3, "the tip moves in {} of {} directions; in the others it is rigid."),
    ):
        if (rank := np.linalg.matrix_rank(matrix * unit, rtol=1e-9)) < full:
            yield what.format(rank, full)
    try:
        along = [K.along(axis) for axis in np.eye(3)]
        apart = np.diag(K.pseudoinverse()) / along, np.diag(K.cartesian) / along
    except SingularStiffness:
        return
    if (abs(np.array(apart) - 1.0) > 0.1).any():
        yield (
            "along, cartesian and pseudoinverse differ: use along, which a small weight measures; "
            "cartesian locks the other two translations, pseudoinverse is the paper's reading."
        )


def _of_limits(K: Stiffness) -> Iterator[str]:
    """Yield which cables are slack, hold a force, or are near an end of their law; joints alike."""
    arm = K.posture.arm
    q = K.posture.q
    F = K.tension
    laws = [cable.elasticity for cable in arm.cables]
    low, high = np.array([(law.low, law.high) for law in laws]).T
    locked = arm.cables.position_controlled
    slack = F == 0.0
    cables = arm.cables.names
    near = np.minimum(q - arm.lower, arm.upper - q) < 0.01 * (arm.upper - arm.lower)
    for what, names, chosen in (
        ("slack, 0 N; they stiffen one direction, raise minimum", cables, locked & slack),
        ("force-controlled, no passive stiffness", cables, ~locked),
        ("within 5 % of the low end of their law", cables, locked & ~slack & (low >= 0.95 * F)),
        ("within 5 % of the high end of their law", cables, locked & (high <= 1.05 * F)),
        ("within 1 % of their range from a joint limit", arm.joint_names, near),
    ):
        if chosen.any():
            yield f"{what}: {listed(np.array(names)[chosen].tolist())}."


def _stuck(K: Stiffness) -> str:
    """Return below which load friction holds all cables, and the stiffness there."""
    try:
        found = [(axis, cdsm.breakaway(K.posture, K.tension, axis, K.wrench)) for axis in "xyz"]
        stuck = ", ".join(f"{each.stiffness.along(u) / 1e3:.4g}" for u, each in found)
    except CdsmError as error:  # the stuck arm is singular, or a tension outside its law
        return f"The load below which they stick is not known: {error}"
    if not any(each.load for _, each in found):
        return "Here no cable sticks."
    loads = ", ".join(f"{each.load:.2g}" for _, each in found)
    return f"Below {loads} N along x, y, z they stick, and a load measures {stuck} N/mm."


def _printed(report: Report, about: str = "") -> Console:
    """Return a console that has recorded the report; ``about`` is text below the title."""
    from rich.console import Console  # slow to import
    from rich.table import Table

    console = Console(
        record=True, file=StringIO(), width=100, markup=False, emoji=False, highlight=False
    )
    console.print(f"Stiffness check: {report._posture.arm.name}", style="bold")
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
    if (arm := report._posture.arm).slides.any():
        console.print(f"Sliding joints count with the arm's length, {arm.length:.4g} m, as lever.")
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
    violation, kkt = (
        "-" if x is None else f"{x:.1e}" for x in (report.bound_violation, report.kkt_residual)
    )
    yield (
        ("balance, optimality, stability", ""),
        ("residual of Eq. 13", f"{report.residual:.1e} N m at {report.residual_joint}"),
        ("residual per torque", f"{report.imbalance:.1e}"),
        ("violation of bounds", violation),
        ("KKT residual (recomputed multipliers)", kkt),
        ("condition of K_θ", f"{report.condition:.3g}"),
    )

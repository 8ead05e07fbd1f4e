"""The report on a stiffness as a frozen value; :mod:`cdsm.report` computes it.

It is printed as text by rich; :mod:`cdsm.plots` draws it as a page.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, final

from cdsm.errors import InvalidInput
from cdsm.support.files import as_path, write_text
from cdsm.support.format import merged, prepare_json, rounded
from cdsm.support.result import Result, unit
from cdsm.support.values import draw

if TYPE_CHECKING:
    from cdsm.stiffness_matrix.value import Stiffness
    from cdsm.support.validation import Direction

Outcome = Literal["PASS", "NOT CHECKED", "FAIL"]

_OUTCOMES: Final[dict[Outcome, str]] = {
    "PASS": "agrees with finite differences, tensions balance the arm, arm is stable.",
    "NOT CHECKED": "no fault was found, but not all could be checked.",
    "FAIL": "do not use this stiffness as it is.",
}

Agreement = Literal["agrees", "DIFFERS", "not possible"]


@final
@dataclass(frozen=True)
class Comparison:
    """A term of K_θ or a torque against finite differences, or all terms against the batch.

    Attributes:
        name: Name of the term or torque, or ``"batch"``; ``"joint"`` is K_θ.
        unit: ``"N m/rad"`` or, for a torque, ``"N m"``; prismatic joints count with the arm's
            length as lever.
        largest: Largest magnitude of an entry.
        off: Largest magnitude of the difference.
        error: Error estimate of the finite differences; 0 for the batch.
        verdict: ``"not possible"`` if the differences decide nothing.
        reason: Why the check is not possible; else empty.
    """

    name: str
    unit: str
    largest: float
    off: float
    error: float
    verdict: Agreement
    reason: str


_QUANTITIES: Final = {"wire": "EA of wires", "spring": "k_series", "tension": "lower bounds"}


@final
@dataclass(frozen=True)
class Remedy:
    """Change of one quantity of an unstable arm; of :attr:`Report.remedies`.

    ``change`` is ``"wire"``: EA of all wires; ``"spring"``: all `k_series`; ``"tension"``: the
    lower bounds. ``factor`` [-] is the one nearest to 1 at which the arm becomes stable, None if
    none is.
    """

    change: Literal["wire", "spring", "tension"]
    factor: float | None

    def __str__(self) -> str:
        what = _QUANTITIES[self.change]
        s = self.factor
        if s is None:
            return f"no other {what} alone would hold it"
        times = f"{rounded(s, up=s > 1.0)} times as high, or {'more' if s > 1.0 else 'less'}"
        return f"it would hold with {what} {times}"


@final
@dataclass(frozen=True, eq=False, repr=False)
class Report(Result):
    """Whether a stiffness is right, balanced and stable; made by :meth:`Stiffness.report`.

    Attributes:
        stiffness: The stiffness that was checked.
        comparisons: Terms of `K_θ` and torques against finite differences and the batch.
        largest_residual: Largest residual `|J_Lᵀ F + g − J_Xᵀ W|` of Eq. 13 [N m]; the force at a
            prismatic joint is multiplied by the arm's length.
        residual_joint: Name of the joint with the largest residual.
        imbalance: ``largest_residual`` per torque of cables, weight and load [-].
        bound_violation: Violation of the bounds of distributed tensions per largest tension [-];
            None for tensions that were given.
        kkt_residual: `min ‖F + J_L λ − μ + ν‖/‖F‖` [-] of Eq. 17 over the multipliers λ of the
            balance, μ ≥ 0 and ν ≥ 0 of the bounds; None if the tensions need not be the least.
        condition: Condition number of `K_θ` [-], made dimensionless with the arm's length.
        remedies: Changes that would make an unstable arm stable, each alone; empty for a stable
            arm, and if friction makes it unstable.
        faults: Reasons not to use the stiffness, one text each; empty if there are none.
        unchecked: What could not be checked and why, one text each.
        notes: Notes on how to read the stiffness, one text each, e.g. that a cable is slack.
    """

    stiffness: Stiffness
    comparisons: tuple[Comparison, ...]
    largest_residual: float = field(metadata=unit("N m"))
    residual_joint: str = field(metadata=unit("1"))
    imbalance: float = field(metadata=unit("1"))
    bound_violation: float | None = field(metadata=unit("1"))
    kkt_residual: float | None = field(metadata=unit("1"))
    condition: float = field(metadata=unit("1"))
    remedies: tuple[Remedy, ...] = ()
    faults: tuple[str, ...] = ()
    unchecked: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def outcome(self) -> Outcome:
        """``"FAIL"`` if there are faults, else ``"NOT CHECKED"`` if a check was not possible."""
        if self.faults:
            return "FAIL"
        return "NOT CHECKED" if self.unchecked else "PASS"

    @property
    def passed(self) -> bool:
        """Whether all could be checked, agrees, and the arm is in balance and stable."""
        return self.outcome == "PASS"

    def to_dict(self) -> dict[str, object]:
        """Return the report and :meth:`Stiffness.to_dict` in SI for JSON, units in the keys."""
        verdict = {"outcome": self.outcome, "passed": self.passed, "faults": self.faults}
        verdict |= {"unchecked": self.unchecked, "notes": self.notes}
        comparisons = {"comparisons": [asdict(comparison) for comparison in self.comparisons]}
        remedies = {"remedies": {remedy.change: remedy.factor for remedy in self.remedies}}
        parts = prepare_json(verdict | comparisons | remedies), super().to_dict()
        return merged(self.stiffness.to_dict(), *parts)

    @property
    def judgement(self) -> str:
        """What the outcome means, as a sentence."""
        return _OUTCOMES[self.outcome]

    @property
    def model(self) -> str:
        """What `K_θ` is, and in which axes it is read."""
        sentence = (
            "K_θ = ∂(J_Lᵀ F + g − J_Xᵀ W)/∂θ: rows torque, columns angle. F is tension, the "
            "cables' torque −J_Lᵀ F, the wrench W a dead load; readings are in base axes."
        )
        arm = self.stiffness.posture.arm
        if not arm.slides.any():
            return sentence
        lever = f"Sliding joints count with the arm's length, {arm.length:.4g} m, as lever."
        return f"{sentence}\n{lever}"

    def to_html(self, about: str = "", direction: Direction | None = None, source: str = "") -> str:
        """Return the report as a self-contained HTML page with pictures, without scripts.

        Args:
            about: Text below the title.
            direction: Direction of shares, curve and uncertainty: an axis such as ``"z"``, or (3,)
                in base axes, any length; None: the softest of x, y and z.
            source: Python that gives the arm, for the lines that compute all this again. Default:
                ``cdsm.Manipulator.read("ARM.toml")``, a file that the reader has to write.

        Raises:
            InvalidInput: The direction is invalid.
        """
        page: str = draw("draw_report", self, about=about, direction=direction, source=source)
        return page

    def write(
        self,
        path: str | os.PathLike[str],
        about: str = "",
        direction: Direction | None = None,
        source: str = "",
    ) -> Path:
        """Write the report; return the path.

        The file is a page (``.html``, :meth:`to_html`), text (``.txt``), or the numbers as a table
        (``.csv``) or Dataset (``.nc``). ``about`` is text below the title of page and text,
        ``source`` as in :meth:`to_html`.

        Raises:
            InvalidInput: The path has another ending, or the direction is invalid.
            CdsmError: pandas, xarray or netCDF4 is not installed.
            FileError: The file cannot be written.
        """
        suffix = as_path(path).suffix.lower()
        if suffix == ".html":
            return write_text(path, self.to_html(about, direction, source))
        if suffix == ".txt":
            return write_text(path, f"{_text(self, about)}\n")
        if suffix not in (".csv", ".nc"):
            problem = f"{str(path)!r} given; it must end in .html, .txt, .csv or .nc."
            raise InvalidInput("path", problem)
        return super().write(path)

    def __repr__(self) -> str:
        name = self.stiffness.posture.arm.name
        return f"<Report on the stiffness of {name}: {self.outcome}>"

    def __str__(self) -> str:
        return _text(self)


def _text(report: Report, about: str = "") -> str:
    """Return the report as text; ``about`` is text below the title."""
    from rich.console import Console  # slow to import
    from rich.table import Table

    console = Console(
        record=True,
        file=StringIO(),
        force_jupyter=False,  # there it would show each line at once, beside the text returned
        width=100,
        markup=False,
        emoji=False,
        highlight=False,
    )
    console.print(f"Stiffness check: {report.stiffness.posture.arm.name}")
    if about:
        console.print(about)
    console.print(f"{report.outcome}: {report.judgement}")
    for mark, sentences in (("!", report.faults), ("?", report.unchecked), ("-", report.notes)):
        for sentence in sentences:
            console.print(f"{mark} {sentence}")
    console.print(f"\n{report.stiffness}\n")
    for head, *rows in tables(report):
        table = Table(box=None, pad_edge=False)
        for i, title in enumerate(head):
            table.add_column(title, justify="right" if i else "left", no_wrap=True)
        for row in rows:
            table.add_row(*row)
        console.print(table)
        console.print()
    console.print(report.model)
    return "\n".join(map(str.rstrip, console.export_text().splitlines()))


def tables(report: Report) -> Iterator[tuple[tuple[str, ...], ...]]:
    """Yield the rows of each table; the first has the titles of its columns."""
    rows = []
    for comparison in report.comparisons:
        size = comparison.largest or 1.0
        off = ("-", "-")
        if not comparison.reason:
            off = (f"{comparison.off / size:.0e}", f"{comparison.error / size:.0e}")
        name = "cdsm.evaluate, all terms" if comparison.name == "batch" else comparison.name
        rows.append((name, f"{comparison.largest:.4g} {comparison.unit}", *off, comparison.verdict))
    arm = report.stiffness.posture.arm
    largest = f"largest entry (1 m counted as {1.0 / arm.length:.4g} rad)"
    largest = largest if arm.slides.any() else "largest entry"
    yield ("against finite differences", largest, "off by", "error bound", "verdict"), *rows
    violation, kkt = (
        "-" if x is None else f"{x:.1e}" for x in (report.bound_violation, report.kkt_residual)
    )
    yield (
        ("balance, optimality, stability", ""),
        ("residual of Eq. 13", f"{report.largest_residual:.1e} N m at {report.residual_joint}"),
        ("residual per torque", f"{report.imbalance:.1e}"),
        ("violation of bounds", violation),
        ("KKT residual (recomputed multipliers)", kkt),
        ("condition of K_θ", f"{report.condition:.3g}"),
    )

"""Results of a search: the Pareto front, its tables and figures, and files of a chosen arm."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from cdsm.design.evaluation import Designs
from cdsm.design.lengths import length_bounds
from cdsm.design.problem import DesignProblem
from cdsm.interchange.mjcf import write_mjcf
from cdsm.manipulator import Manipulator
from cdsm.support.files import make_folder, write_text
from cdsm.support.format import aligned, plural, prepare_json
from cdsm.support.result import data_frame
from cdsm.support.tables import csv_text
from cdsm.support.validation import whole_number
from cdsm.support.values import Array, Plotted, ReadOnlyState
from cdsm.urdf import write_urdf
from cdsm.wires.catalogue import label

if TYPE_CHECKING:
    import pandas

_DEFLECTION = (
    "deflection: by the load on locked motors, to first order, with the stiffness of the least "
    "tensions without the load"
)
_DIGITS = 4
_PRINTED = 20  # number of designs, evenly spread over a front, that a printed table shows


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DesignSearch(ReadOnlyState, Plotted):
    """Best designs of a problem; made by :func:`search_designs`.

    Attributes:
        problem: The problem.
        seed: Seed of the search.
        evaluated: All designs that were evaluated.
        front: Pareto front: indices (n,) into ``evaluated`` of the feasible designs for which no
            other is at least as good in all objectives and better in one; the best in the first
            objective comes first.
    """

    _figure = "plot_designs"

    problem: DesignProblem
    seed: int
    evaluated: Designs
    front: NDArray[np.intp]

    @property
    def compromise(self) -> int:
        """Index into ``front`` of the design nearest to the ideal point.

        The ideal point has the best value of each objective on the front. Differences are divided
        by the range of each objective on the front.
        """
        goals = self.best.goals
        size = np.ptp(goals, axis=0)
        scaled = (goals - goals.min(axis=0)) / np.where(size > 0.0, size, 1.0)
        return int(np.linalg.norm(scaled, axis=1).argmin())

    def design(self, number: int | None = None) -> Array:
        """Return design ``number`` of the front (n,) [m, rad, N, -], from 0; None: the compromise.

        Raises InvalidInput if the front has no such number.
        """
        return np.asarray(self.evaluated.designs[self.front[self._number(number)]])

    def arm(self, number: int | None = None) -> Manipulator:
        """Build the arm of design ``number`` of the front, from 0; None: the compromise."""
        return self.problem.arm_of(self.design(number))

    def values(self, number: int | None = None) -> dict[str, float]:
        """Return all quantities, by name in SI, of a design of the front; None: the compromise."""
        row = self.evaluated.values[self.front[self._number(number)]]
        return dict(zip(self.evaluated.keys(), row.tolist(), strict=True))

    def _number(self, number: int | None) -> int:
        if number is None:
            return self.compromise
        return whole_number("number", number, 0, len(self.front) - 1)

    def write_arm(self, folder: str | os.PathLike[str], number: int | None = None) -> list[Path]:
        """Write a design as ``arm.toml``, ``arm.urdf``, ``arm.xml`` and tables; return their paths.

        ``holes.csv`` has each hole of each disk. ``cables.csv`` has three lengths of each cable,
        lead included: in the straight arm, and the shortest and the longest (the cut) within the
        joint limits; with coupled joints these two are bounds, which no posture need attain. The
        stroke, which the motor winds, is their difference. All are geometric lengths: the stretch
        under tension is not subtracted, and the wire needed to fix both ends is not included.

        Args:
            folder: The folder; it is created if it does not exist.
            number: Number of the design on the front, from 0; None: the compromise.

        Raises:
            InvalidInput: The front has no such number.
            FileError: A file cannot be written.
            GeometryError: Two parsers disagree on the URDF.
        """
        row = self.design(number)
        arm = self.problem.arm_of(row)
        into = make_folder(folder)
        return [
            arm.write(into / "arm.toml"),
            write_urdf(arm.geometry, into / "arm.urdf"),
            write_mjcf(arm, into / "arm.xml"),
            write_text(into / "holes.csv", _hole_table(arm)),
            write_text(into / "cables.csv", cable_table(arm)),
        ]

    @property
    def best(self) -> Designs:
        """Designs of the Pareto front; ``best.to_csv()`` is their table."""
        return self.evaluated.some(self.front)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table of the front in SI, a row per design; needs pandas (CdsmError)."""
        names = [str(i) for i in range(len(self.front))]
        return data_frame(self.best.columns(), "design", names)

    def to_dict(self) -> dict[str, object]:
        """Return the front and the compromise in SI for JSON, with units in the keys."""
        numbers = {
            "designs": len(self.evaluated),
            "feasible": int(self.evaluated.feasible.sum()),
            "seed": self.seed,
            "compromise": self.compromise,
            "front": self.best.columns(),
        }
        return prepare_json(numbers)

    def __repr__(self) -> str:
        return f"<DesignSearch: {plural(len(self.front), 'design')} on the front>"

    def __str__(self) -> str:
        return self.describe(self.compromise)

    def describe(self, chosen: int) -> str:
        """Return the printed table of the front; it includes design ``chosen``."""
        problem = self.problem
        feasible = int(self.evaluated.feasible.sum())
        shown = self._spread(_PRINTED, chosen)
        count = len(self.front)
        more = f", {len(shown)} shown" if len(shown) < count else ""
        head = (
            f"{plural(len(self.evaluated), 'design')}, {feasible} feasible, {count} on the front"
            f"{more}; * is the compromise"
        )
        asked = [
            f"asked: {constraint.words} {constraint.asked}" for constraint in problem.constraints
        ]
        notes = []
        if "deflection" in {measure.of for measure in problem.measures}:
            notes = [_DEFLECTION]
        return "\n".join([head, *aligned(self._table(shown)), *asked, *notes])

    def _spread(self, most: int, *also: int) -> list[int]:
        """Return up to ``most`` designs spread over the front, the compromise, and ``also``."""
        count = len(self.front)
        even = np.linspace(0, count - 1, min(count, most)).round().astype(int)
        return sorted({*even.tolist(), self.compromise, *also})

    @property
    def objective_labels(self) -> list[str]:
        """Name and unit of each objective, for the axes of a figure."""
        labels = [(objective.words, objective.unit[0]) for objective in self.problem.objectives]
        return [f"{name} [{unit}]" if unit else name for name, unit in labels]

    def _table(self, shown: Sequence[int]) -> list[list[str]]:
        """Return header and rows for the designs ``shown`` of the front, in units for the user."""
        problem = self.problem
        keys = [measure.key for measure in problem.measures]
        rows = [["design", *(variable.of for variable in problem.variables), *keys]]
        for i in shown:
            row = problem.values(self.design(i))
            values = self.values(i).values()
            chosen = (v.shown(x) for v, x in zip(problem.variables, row, strict=True))
            quantities = (m.shown(x) for m, x in zip(problem.measures, values, strict=True))
            rows.append([f"{i}{'*' if i == self.compromise else ''}", *chosen, *quantities])
        return rows


def _hole_table(arm: Manipulator) -> str:
    """Return a CSV with a row per hole of each disk, in mm, and in degrees from y towards z."""
    geometry = arm.geometry
    rows = []
    for number, disk in enumerate(geometry.disks, start=1):
        for name, route in zip(geometry.cable_names, geometry.cables, strict=True):
            if disk.joint > route.joint:
                continue
            _, y, z = disk.hole(route)
            ends = "ends" if disk == geometry.disks_of(route)[-1] else "passes"
            sizes = (1e3 * disk.x, 1e3 * disk.radius, 1e3 * disk.radius_of(route))
            angle = math.degrees(route.angle) % 360.0
            rows.append([number, disk.link, *map(_mm, sizes), name, ends, _mm(angle)])
            rows[-1] += [_mm(1e3 * y), _mm(1e3 * z)]
    head = ["disk", "link", "x [mm]", "disk radius [mm]", "hole radius [mm]", "cable", "here it"]
    return csv_text([*head, "angle [deg]", "y [mm]", "z [mm]"], rows)


def cable_table(arm: Manipulator) -> str:
    """Return the text of the file ``cables.csv`` of :meth:`DesignSearch.write`."""
    straight = arm.at(arm.body.straight).cable_lengths
    shortest, longest = length_bounds(arm)
    leads = [cable.lead for cable in arm.cables]
    lengths = np.column_stack([leads, straight, shortest, longest, longest - shortest])
    rows = [
        [cable.name, route.joint, label(cable.elasticity), *map(_mm, row)]
        for cable, route, row in zip(arm.cables, arm.geometry.cables, 1e3 * lengths, strict=True)
    ]
    head = ["cable", "ends after joint", "wire", "lead [mm]", "straight [mm]", "shortest [mm]"]
    return csv_text([*head, "cut [mm]", "stroke [mm]"], rows)


def _mm(value: float) -> str:
    return f"{round(value, _DIGITS) + 0.0:g}" if abs(value) < 1e-4 else f"{value:.{_DIGITS}f}"

"""Result of :func:`plan_path`: tensions, stiffness, lengths of wire, infeasible samples."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Literal, final

import numpy as np

import cdsm
from cdsm.cable_laws import CableLaws
from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.planning.path_table import path_table
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.files import write_text
from cdsm.support.format import JointUnits, plain, plural
from cdsm.support.tables import csv_text
from cdsm.support.tidy import data_frame
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

Status = Literal["posture", "balance", "elasticity", "singular", "stiffness", "rate"]


@final
@dataclass(frozen=True)
class InfeasibleSample:
    """Sample of a path that cannot be planned.

    Attributes:
        index: Number of the sample, from 0.
        status: ``"posture"`` (a joint limit, a cable without direction, or a tip out of reach),
            ``"balance"`` (no tensions within the bounds), ``"elasticity"`` (no tensions within the
            domains), ``"singular"`` (no tensions make the arm stable, or the tip cannot move along
            u), ``"stiffness"`` (no tensions hit the target) or ``"rate"`` (tensions hit the target,
            but the rate does not allow them after the samples before).
        reason: The reason in words, with the remedy.
        error: The error that the plan of this sample raised, with its data; or None.
    """

    index: int
    status: Status
    reason: str
    error: CdsmError | None = None


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PathPlan(ReadOnlyState):
    """Tensions along a path, with the arguments of the plan; made by :func:`plan_path`.

    P of the S samples are planned. Arrays of results have one row per planned sample.

    Attributes:
        arm: The arm.
        direction: Unit directions u in base axes, (3,) or (n, 3).
        target: The target at every sample [N/m]: (S,), or one per direction (S, n).
        rate: Largest change of a tension per step (C,) [N]; may be inf.
        planned: Numbers of the planned samples, from 0.
        angles: Joint angles (P, nv) [rad]; [m] for prismatic joints.
        tensions: F (P, C) [N].
        achieved: ``stiffness.along``, (P,) or (P, n) [N/m].
        stiffness: K_θ at each planned sample, with its posture and wrench.
        infeasible: The samples that are not planned, each with its reason.
    """

    arm: Manipulator
    direction: Array
    target: Array
    rate: Array
    planned: tuple[int, ...]
    angles: Array
    tensions: Array
    achieved: Array
    stiffness: tuple[Stiffness, ...]
    infeasible: tuple[InfeasibleSample, ...]

    @property
    def complete(self) -> bool:
        """Whether every sample is planned."""
        return not self.infeasible

    @cached_property
    def steps(self) -> Array:
        """Largest change of any tension per step, from one planned sample to the next (P,) [N].

        Entry i is the change up to planned sample i; the first entry is 0.
        """
        changes = np.zeros(len(self.planned))
        moved = abs(np.diff(self.tensions, axis=0)).max(axis=1, initial=0.0)
        changes[1:] = moved / np.diff(self.planned)
        return frozen(changes)

    @cached_property
    def cable_lengths(self) -> Array:
        """Cable lengths L (P, C) [m] with lead (straight cable between actuator and base disk)."""
        lengths = [K.posture.cable_lengths for K in self.stiffness]
        return frozen(np.array(lengths).reshape(self.tensions.shape))

    @cached_property
    def unstrained_lengths(self) -> Array:
        """Original lengths l_0 (P, H) [m] of the H position-controlled cables: the paid-out wire.

        l_0 is the length without strain. It solves l_0 + Δl(F, l_0) = L with the planned tension F
        and the elongation Δl of :meth:`~cdsm.Cable.elongation`. ``original_length`` of the arm has
        no effect on it.
        """
        motors = CableLaws(self.arm.cables, "unstrained")
        pairs = zip(self.cable_lengths, self.tensions, strict=True)
        rows = np.array([motors.original_lengths(L, F) for L, F in pairs])
        return frozen(rows.reshape(self.tensions.shape)[:, self.arm.cables.position_controlled])

    @property
    def tips(self) -> Array:
        """Tip positions (P, 3) [m]."""
        return frozen(np.array([K.posture.tip[:3, 3] for K in self.stiffness]).reshape(-1, 3))

    def plot(self, animate: str | os.PathLike[str] | None = None) -> Figure:
        """Plot wanted and reached stiffness [N/mm] and the tensions [N] against the samples.

        Args:
            animate: A ``.gif`` to write too, in which the arm follows the path.

        Raises:
            InvalidInput: No sample to animate is planned.
            FileError: The animation cannot be written.
        """
        if animate is not None:
            cdsm.plots.plot_path(self, animate=animate)
        return cdsm.plots.plot_path_plan(self)

    def to_dict(self) -> dict[str, object]:
        """Return the plan in SI for JSON, with units in the keys; a row per planned sample."""
        numbers = {
            "cables": self.arm.cables.names,
            "target_N_per_m": self.target,
            "planned": self.planned,
            "achieved_N_per_m": self.achieved,
            **JointUnits(self.arm.slides).to_dict(self.arm.joint_names, self.angles),
            "tip_position_m": self.tips,
            "tensions_N": self.tensions,
            "cable_lengths_m": self.cable_lengths,
            "infeasible": [
                {"index": sample.index, "status": sample.status, "reason": sample.reason}
                for sample in self.infeasible
            ],
        }
        return plain(numbers)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table of :meth:`write`, a row per sample; needs pandas (MissingExtra)."""
        header, rows = path_table(self)
        columns = [[None if x == "" else x for x in column] for column in zip(*rows, strict=True)]
        table = dict(zip(header, columns, strict=True))
        return data_frame(table, "sample", table.pop("sample"))

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write one line per sample in SI units as CSV; return the path.

        The columns are ``sample``, ``status``, joint angles [rad] ([m] for prismatic joints),
        tensions [N], cable lengths [m], unstrained lengths [m] of position-controlled cables, tip
        [m], target and reached stiffness [N/m], and ``reason``. An infeasible sample has only its
        number, status, target and reason.

        Args:
            path: The file. It is written completely or not at all.

        Raises:
            FileError: The file cannot be written.
        """
        return write_text(path, csv_text(*path_table(self)))

    def __repr__(self) -> str:
        return f"<PathPlan of {len(self.planned)} of {plural(len(self.target), 'sample')}>"

    def __str__(self) -> str:
        lines = [f"{len(self.planned)} of {plural(len(self.target), 'sample')} planned"]
        if self.planned:
            F = self.tensions
            lines[0] += f", with {F.min():.4g} to {F.max():.4g} N"
        if len(self.planned) > 1:
            lines[0] += f", which change by up to {self.steps.max():.4g} N per step"
        # consecutive samples with one status are one line
        numbered = enumerate(self.infeasible)
        for _, group in groupby(numbered, lambda pair: (pair[1].index - pair[0], pair[1].status)):
            run = [each for _, each in group]
            first, last = run[0], run[-1]
            where = f"samples {first.index} to {last.index}" if run[1:] else f"sample {first.index}"
            alike = all(each.reason == first.reason for each in run)
            status = first.status if alike else f"{first.status}, the first of them"
            lines.append(f"{where}: {status}: {first.reason}")
        return "\n".join(lines)

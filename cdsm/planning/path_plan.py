"""Result of :func:`plan_path`: tensions, stiffness, lengths of wire, infeasible samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.errors import CdsmError, listed
from cdsm.manipulator import Manipulator
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import merged, plural, prepare_json
from cdsm.support.result import Result, quantity, unit
from cdsm.support.values import Array, Plotted, frozen

if TYPE_CHECKING:
    import pandas


@final
@dataclass(frozen=True)
class InfeasibleSample:
    """Sample of a path that cannot be planned.

    Attributes:
        index: Number of the sample, from 0.
        status: The cause: that of ``error``, or OUT_OF_REACH (the tip comes no nearer) or
            CHANGE_LIMITED (no tensions within the largest change since the samples before).
        reason: The reason in words, with the remedy.
        error: The error that the plan of this sample raised, with its data; or None.
    """

    index: int
    status: Status
    reason: str
    error: CdsmError | None = None


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PathPlan(Result, Plotted):
    """Tensions along a path, with the arguments of the plan; made by :func:`plan_path`.

    P of the S samples are planned. Arrays of results have one row per planned sample; the table and
    the ``.csv`` have one per sample, empty if it is infeasible.

    Attributes:
        arm: The arm.
        direction: Unit directions u in base axes, (3,) or (n, 3).
        target: The target at every sample [N/m]: (S,), or one per direction (S, n).
        max_change_per_sample: Largest change of a tension per sample (C,) [N]; may be inf.
        planned: Numbers of the planned samples, from 0.
        angles: Joint angles (P, nv) [rad]; [m] for prismatic joints.
        tensions: F (P, C) [N].
        achieved: ``stiffness.along``, (P,) or (P, n) [N/m].
        stiffness: `K_θ` at each planned sample, with its posture and wrench.
        infeasible: The samples that are not planned, each with its reason.
    """

    _headline = "tensions"
    _rows = "planned"
    _figure = "plot_path_plan"

    arm: Manipulator
    direction: Array = field(metadata=unit("1", "direction", "axis"))
    target: Array = field(metadata=unit("N/m", "sample", "direction"))
    max_change_per_sample: Array = field(metadata=unit("N", "cable"))
    planned: tuple[int, ...] = field(metadata=unit("1", "planned"))
    angles: Array = field(metadata=unit("joint", "planned", "joint"))
    tensions: Array = field(metadata=unit("N", "planned", "cable"))
    achieved: Array = field(metadata=unit("N/m", "planned", "direction"))
    stiffness: tuple[Stiffness, ...]
    infeasible: tuple[InfeasibleSample, ...]

    @property
    def complete(self) -> bool:
        """Whether every sample is planned."""
        return not self.infeasible

    @quantity("N", "planned")
    def steps(self) -> Array:
        """Largest change of any tension per sample since the planned sample before (P,) [N]."""
        moved = abs(np.diff(self.tensions, axis=0)).max(axis=1, initial=0.0)
        return frozen(np.append(np.zeros(len(self.planned[:1])), moved / np.diff(self.planned)))

    @quantity("m", "planned", "cable")
    def cable_lengths(self) -> Array:
        """Cable lengths L (P, C) [m] with lead (straight cable between actuator and base disk)."""
        lengths = [K.posture.cable_lengths for K in self.stiffness]
        return frozen(np.array(lengths).reshape(self.tensions.shape))

    @quantity("m", "planned", "held_cable")
    def rest_lengths(self) -> Array:
        """Lengths without strain `l_0` (P, H) [m] of the H position-controlled cables, paid out.

        `l_0 + Δl(F, l_0) = L`, with :meth:`~cdsm.Cable.elongation` Δl.
        """
        rows = np.array([K.free_lengths for K in self.stiffness])
        return frozen(rows.reshape(self.tensions.shape)[:, self.arm.cables.position_controlled])

    @quantity("m", "planned", "axis")
    def tips(self) -> Array:
        """Tip positions (P, 3) [m]."""
        return frozen(np.array([K.posture.tip[:3, 3] for K in self.stiffness]).reshape(-1, 3))

    def to_dict(self) -> dict[str, object]:
        """Return the plan in SI for JSON, with units in the keys; a row per planned sample."""
        causes = [
            {"index": sample.index, "status": sample.status.word, "reason": sample.reason}
            for sample in self.infeasible
        ]
        names = {"joints": self.arm.joint_names, "cables": self.arm.cables.names}
        return merged(prepare_json(names), super().to_dict(), {"infeasible": causes})

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table with a row and the status of each sample; needs pandas (CdsmError)."""
        causes = {sample.index: (sample.status, sample.reason) for sample in self.infeasible}
        table = super().to_pandas().reindex(range(len(self.target))).rename_axis("sample")
        # joints have their own names, as in the files that are read as a path
        table = table.rename(columns=lambda column: column.removeprefix("angles "))
        rows = [causes.get(index, (Status.OK, "")) for index in table.index]
        table.insert(0, "status", [status.word for status, _ in rows])
        for k, column in enumerate(np.reshape(self.target, (len(table), -1)).T):
            table[f"target {k + 1} [N/m]" if self.target.ndim > 1 else "target [N/m]"] = column
        return table.assign(reason=[reason for _, reason in rows])

    def __str__(self) -> str:
        lines = [f"{len(self.planned)} of {plural(len(self.target), 'sample')} planned"]
        if self.planned:
            F = self.tensions
            lines[0] += f", with {F.min():.4g} to {F.max():.4g} N"
        if len(self.planned) > 1:
            lines[0] += f", which change by up to {self.steps.max():.4g} N per sample"
        for status in dict.fromkeys(sample.status for sample in self.infeasible):
            samples = [sample for sample in self.infeasible if sample.status == status]
            plural_s = "s" * (len(samples) > 1)
            numbers = listed([str(sample.index) for sample in samples])
            at_first = "at first " if len(samples) > 1 else ""
            reason = f"{at_first}{samples[0].reason}"
            lines.append(f"sample{plural_s} {numbers}: {status.title}: {reason}")
        return "\n".join(lines)

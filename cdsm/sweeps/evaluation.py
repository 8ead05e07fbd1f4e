"""Evaluation of all cases at a block of postures, each with its status."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm import batch
from cdsm.elasticity import Elasticity
from cdsm.kernels.principal import principal_stiffness
from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array, ReadOnlyState
from cdsm.sweeps.quantities import LOST, QUANTITIES, SweepStatus

BlockResult = dict[str, NDArray[Any]]
"""Outputs and ``status`` by name; the first axis is the posture, the next axes are the cases."""

Rows = dict[str, Array]
Statuses = NDArray[np.int8]

_BATCH_NAMES = {
    "tip_position": "tip",
    "gravity_stiffness": "gravity",
    "active_stiffness": "active",
    "passive_stiffness": "passive",
    "load_stiffness": "load",
    "joint_stiffness": "joint",
    "translational_compliance": "compliance",
}
"""Names of quantities in a batch, where the name in a sweep is different."""

_Place = tuple[NDArray[np.intp], ...] | tuple[NDArray[np.bool_]]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class SweepTask(ReadOnlyState):
    """Quantities and cases to compute at each posture; with the postures, all a worker needs.

    Attributes:
        arm: The given arm.
        laws: Elasticities; each is used for all cables in turn, None keeps those of the arm.
        wrenches: Wrenches (W, 6): force [N], then moment [N m].
        minima: Lower bounds of tension (M,) [N].
        maximum: Upper bound [N].
        directions: Unit directions (D, 3).
        outputs: Names from :data:`~cdsm.sweeps.quantities.QUANTITIES`.
    """

    arm: Manipulator
    laws: tuple[Elasticity | None, ...]
    wrenches: Array
    minima: Array
    maximum: float
    directions: Array
    outputs: tuple[str, ...]

    @property
    def cases(self) -> int:
        """Return the number of cases (stiffness matrices) at each posture."""
        return len(self.laws) * len(self.wrenches) * len(self.minima)

    @cached_property
    def arms(self) -> tuple[Manipulator, ...]:
        """Return the arm with each elasticity; springs, leads and control stay unchanged."""
        return tuple(self.arm if law is None else _with(self.arm, law) for law in self.laws)


def evaluate(task: SweepTask, q: Array, threads: int | None = None) -> BlockResult:
    """Compute all cases at joint angles q (P, nv) [rad]; a failure sets the status of the case.

    Returns:
        ``status`` (P, E, W, M), for E elasticities, W wrenches and M minima, and all outputs; an
        output has only those of these axes on which it depends.
    """
    shape = len(q), len(task.wrenches), len(task.minima)
    stages = {name: QUANTITIES[name].stage for name in task.outputs}
    of_pose = [name for name, stage in stages.items() if stage == "pose"]
    of_law = [name for name, stage in stages.items() if stage not in ("pose", "tension")]
    extreme = [name for name, stage in stages.items() if stage == "principal"]

    result, status_of_pose = _postures(task.arm, q, of_pose, threads)
    answer: BlockResult = {**result}
    status = np.tile(status_of_pose[:, None, None], (1, *shape[1:]))
    if len(stages) > len(of_pose):
        place = p, w, m = np.nonzero(status == SweepStatus.OK)
        tension, status[place] = _tensions(
            task.arm, q[p], task.minima[m], task.maximum, task.wrenches[w], threads
        )
        tension = _spread(tension, place, shape)
        if "tension" in stages:
            answer["tension"] = tension
    if not of_law:
        return answer | {"status": np.stack([status] * len(task.laws), axis=1)}

    needed = [name for name in of_law if name not in extreme]
    needed += ["margin", "translational_compliance"] if extreme else ["margin"]
    place = p, w, m = np.nonzero(status == SweepStatus.OK)
    statuses, by_law = [], []
    for arm in task.arms:
        rows, found_status = _stiffnesses(
            arm,
            q[p],
            tension[place],
            task.wrenches[w],
            task.directions,
            list(dict.fromkeys(needed)),
            threads,
        )
        if extreme:
            rows |= _principal(rows, found_status, extreme)
        by_law.append({name: _spread(rows[name], place, shape) for name in of_law})
        statuses.append(status.copy())
        buckles = (rows["margin"] <= 0.0) & np.isin(
            found_status, (SweepStatus.OK, SweepStatus.IMMOBILE)
        )
        statuses[-1][place] = np.where(buckles, SweepStatus.UNSTABLE, found_status)
    answer |= {name: np.stack([rows[name] for rows in by_law], axis=1) for name in of_law}
    return answer | {"status": np.stack(statuses, axis=1)}


def _principal(rows: Rows, status: Statuses, names: list[str]) -> Rows:
    """Compute the extreme stiffnesses (softest, stiffest) of stable rows; NaN in all other rows."""
    exist = (rows["margin"] > 0.0) & (status != SweepStatus.SINGULAR)  # a margin may be NaN
    extremes = principal_stiffness(rows["translational_compliance"][exist])
    return {name: _spread(extremes[name], (exist,), exist.shape) for name in names}


def _spread(rows: Array, place: _Place, shape: tuple[int, ...]) -> Array:
    """Build an array of all cases from rows of some cases; NaN in all other cases."""
    full = np.full((*shape, *rows.shape[1:]), np.nan)
    full[place] = rows
    return full


def _with(arm: Manipulator, law: Elasticity) -> Manipulator:
    cables = [replace(cable, elasticity=law) for cable in arm.cables]
    return arm.with_cables(cables)


# --- rows: the only functions of a sweep that call the physics ---------------------------------


def _postures(
    arm: Manipulator, q: Array, names: Collection[str], threads: int | None
) -> tuple[Rows, Statuses]:
    """Compute quantities that depend on the joint angles q (R, nv) [rad] alone."""
    return _read(batch.evaluate(arm, q, outputs=_batch_names(names), threads=threads), names)


def _tensions(
    arm: Manipulator,
    q: Array,
    minimum: Array,
    maximum: float,
    wrench: Array,
    threads: int | None,
) -> tuple[Array, Statuses]:
    """Compute the least balancing tensions (R, C) [N] for lower bounds (R,) and wrenches (R, 6)."""
    low = np.repeat(minimum[:, None], len(arm.cables), axis=1)
    pull = batch.distribute_tensions(arm, q, low, maximum, wrench, threads=threads)
    return pull.values, pull.status.astype(np.int8)


def _stiffnesses(
    arm: Manipulator,
    q: Array,
    tension: Array,
    wrench: Array,
    directions: Array,
    names: Collection[str],
    threads: int | None,
) -> tuple[Rows, Statuses]:
    """Compute quantities that also depend on tensions (R, C) [N] and elasticity."""
    found = batch.evaluate(
        arm,
        q,
        tension,
        wrench,
        _batch_names(names),
        direction=directions if "along" in names else None,
        threads=threads,
    )
    return _read(found, names)


def _batch_names(names: Collection[str]) -> list[str]:
    return [_BATCH_NAMES.get(name, name) for name in names]


def _read(found: batch.Batch, names: Collection[str]) -> tuple[Rows, Statuses]:
    """Return quantities of a batch by their names in a sweep; NaN where the status demands it."""
    status = found.status.astype(np.int8)
    rows = {}
    for name in names:
        values = found[_BATCH_NAMES.get(name, name)]
        if name == "tip_position":
            values = values[:, :3, 3]
        elif name == "translational_compliance":
            values = values[:, :3, :3]
        # a batch holds the pseudoinverse even where K_θ is singular; a sweep does not
        lost = [kind for kind in SweepStatus if QUANTITIES[name].stage in LOST[kind]]
        rows[name] = values.copy()
        rows[name][np.isin(status, lost)] = np.nan
    return rows, status

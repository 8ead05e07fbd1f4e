"""Evaluation of all cases at a block of postures, each with its status."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm import batch
from cdsm.elasticity import Elasticity
from cdsm.kernels.principal import principal_stiffness
from cdsm.manipulator import Manipulator
from cdsm.measures.rows import (
    MEASURED,
    capacity_margins,
    friction_losses,
    measured,
    narrowed_bounds,
    payloads,
)
from cdsm.measures.wire_use import life_margin, safety, strains
from cdsm.support.values import Array, ReadOnlyState
from cdsm.sweeps.quantities import DIRECTIONAL, QUANTITIES
from cdsm.sweeps.status import LOST, SweepStatus

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
    "stuck_joint_stiffness": "stuck_joint",
}
"""Names of quantities in a batch, where the name in a sweep is different."""

_Place = tuple[NDArray[np.intp], ...] | tuple[NDArray[np.bool_]]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class SweepTask(ReadOnlyState):
    """Quantities and cases to compute at each posture; with the postures, all a worker needs.

    Attributes:
        arm: The given arm.
        laws: Elasticities to compare, each for all cables; None keeps those of the arm.
        wrenches: Wrenches (W, 6): force [N], then moment [N m].
        minima: Lower bounds of tension (M,) [N].
        maximum: Upper bound [N].
        directions: Unit directions (D, 3).
        outputs: Names from :data:`~cdsm.sweeps.quantities.QUANTITIES`.
        worst_friction: Whether all segments of the cables stay within the bounds.
        diameter: Diameter of the cables [m].
        breaking_load: Breaking load of the wire [N].
        bend_diameter: Diameter of the bend in the holes [m].
    """

    arm: Manipulator
    laws: tuple[Elasticity | None, ...]
    wrenches: Array
    minima: Array
    maximum: float
    directions: Array
    outputs: tuple[str, ...]
    worst_friction: bool
    diameter: float
    breaking_load: float
    bend_diameter: float

    @property
    def cases(self) -> int:
        """Return the number of cases (stiffness matrices) at each posture."""
        return len(self.laws) * len(self.wrenches) * len(self.minima)

    @cached_property
    def arms(self) -> tuple[Manipulator, ...]:
        """Return the arm with each elasticity; springs, leads and control stay unchanged."""
        return tuple(
            self.arm
            if law is None
            else self.arm.with_cables([replace(each, elasticity=law) for each in self.arm.cables])
            for law in self.laws
        )


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

    computed = [name for name in of_pose if name not in MEASURED]
    rows, status_of_pose = _rows(computed, task.arm, q, threads=threads)
    exist = status_of_pose == SweepStatus.OK
    wanted = [name for name in of_pose if name in MEASURED]
    for name, values in measured(task.arm, q[exist], wanted, task.diameter, threads).items():
        rows[name] = _over_all_cases(values, (exist,), exist.shape)
    answer: BlockResult = {**rows}
    status = np.tile(status_of_pose[:, None, None], (1, *shape[1:]))
    if len(stages) > len(of_pose):
        # along a cable the tensions differ by this factor at most
        loss = np.ones((len(q), len(task.arm.cables)))
        if task.worst_friction:
            loss[exist] = friction_losses(task.arm, q[exist], threads)
        p, _, m = place = np.nonzero(status == SweepStatus.OK)
        low, high, bounded = narrowed_bounds(task.arm, task.minima[m], task.maximum, loss[p])
        pull = batch.distribute_tensions(
            task.arm, q[p], low, high, task.wrenches[place[1]], threads=threads
        )
        status[place] = np.where(bounded, pull.status, SweepStatus.INFEASIBLE)
        held = status[place] == SweepStatus.OK
        p, w, _ = place = tuple(each[held] for each in place)
        F = pull.values[held]
        bounds = task.arm, q[p], task.wrenches[w], low[held], high[held]
        of_tension: dict[str, Callable[[], Array]] = {
            "tension": lambda: F,
            "payload": lambda: payloads(*bounds, task.directions, threads),
            "capacity_margin": lambda: capacity_margins(*bounds),
            "wire_safety": lambda: safety(F * loss[p], task.breaking_load),
            "wire_life": lambda: life_margin(F * loss[p], task.diameter, task.bend_diameter),
        }
        for name, stage in stages.items():
            if stage == "tension":
                answer[name] = _over_all_cases(of_tension[name](), place, shape)
    if not of_law:
        return answer | {"status": np.stack([status] * len(task.laws), axis=1)}

    by_law: list[BlockResult] = []
    for arm in task.arms:
        rows, status_of_law = _stiffnesses(
            task, arm, q[p], F, loss[p], task.wrenches[w], of_law, threads
        )
        by_law.append({name: _over_all_cases(rows[name], place, shape) for name in of_law})
        by_law[-1]["status"] = status.copy()
        by_law[-1]["status"][place] = status_of_law
    return answer | {name: np.stack([each[name] for each in by_law], axis=1) for name in by_law[0]}


def _stiffnesses(
    task: SweepTask,
    arm: Manipulator,
    q: Array,
    tension: Array,
    loss: Array,
    wrench: Array,
    names: list[str],
    threads: int | None,
) -> tuple[Rows, Statuses]:
    """Compute the quantities that need the cable stiffness, at R postures q with tensions (R, C).

    ``loss`` (R, C) is the largest factor between the tensions along a cable with friction.
    """
    extreme = [name for name in names if QUANTITIES[name].stage == "principal"]
    needed = [name for name in names if name not in (*extreme, "wire_strain")]
    needed += ["margin", "translational_compliance"] if extreme else ["margin"]
    rows, status = _rows(
        list(dict.fromkeys(needed)),
        arm,
        q,
        tension,
        wrench,
        direction=None if DIRECTIONAL.isdisjoint(names) else task.directions,
        threads=threads,
    )
    if "wire_strain" in names:
        # friction may take a tension along a cable out of the domain of its law
        strain = strains(arm, tension * loss)
        status[np.isnan(strain).any(axis=1)] = SweepStatus.OUTSIDE_ELASTICITY
        rows["wire_strain"] = strain
        for values in rows.values():
            values[status == SweepStatus.OUTSIDE_ELASTICITY] = np.nan
    if extreme:
        # extreme stiffnesses exist in stable rows; a margin may be NaN
        exist = (rows["margin"] > 0.0) & (status != SweepStatus.SINGULAR)
        found = principal_stiffness(rows["translational_compliance"][exist])
        rows |= {name: _over_all_cases(found[name], (exist,), exist.shape) for name in extreme}
    buckles = (rows["margin"] <= 0.0) & np.isin(status, (SweepStatus.OK, SweepStatus.IMMOBILE))
    status[buckles] = SweepStatus.UNSTABLE
    return rows, status


def _rows(
    names: list[str],
    arm: Manipulator,
    q: Array,
    tension: Array | None = None,
    wrench: Array | None = None,
    *,
    direction: Array | None = None,
    threads: int | None,
) -> tuple[Rows, Statuses]:
    """Compute sweep quantities for a batch of postures; NaN where the status forbids them."""
    outputs = [_BATCH_NAMES.get(name, name) for name in names]
    found = batch.evaluate(arm, q, tension, wrench, outputs, direction=direction, threads=threads)
    status = found.status.astype(np.int8)
    rows = {}
    for name, output in zip(names, outputs, strict=True):
        values = found[output]
        if name == "tip_position":
            values = values[:, :3, 3]
        elif name == "translational_compliance":
            values = values[:, :3, :3]
        # a batch holds the pseudoinverse even where K_θ is singular; a sweep does not
        lost = [kind for kind in SweepStatus if QUANTITIES[name].stage in LOST[kind]]
        rows[name] = values.copy()
        rows[name][np.isin(status, lost)] = np.nan
    return rows, status


def _over_all_cases(rows: Array, place: _Place, shape: tuple[int, ...]) -> Array:
    """Build an array of all cases from rows of some cases; NaN in all other cases."""
    full = np.full((*shape, *rows.shape[1:]), np.nan)
    full[place] = rows
    return full

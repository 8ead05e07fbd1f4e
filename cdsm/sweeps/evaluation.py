"""Some postures of a sweep, computed: all their cases, each with its status."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm.elasticity import Elasticity
from cdsm.kernels.principal import principal_stiffness
from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array, ReadOnlyState
from cdsm.sweeps.quantities import QUANTITIES, SweepStatus
from cdsm.sweeps.rows import Rows, Statuses, postures, stiffnesses, tensions

Answer = dict[str, NDArray[Any]]
"""Outputs by name, and their ``status``: postures first, then the cases."""

_Place = tuple[NDArray[np.intp], ...] | tuple[NDArray[np.bool_]]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Problem(ReadOnlyState):
    """What to compute at each posture: all that a worker needs beside the postures.

    Attributes:
        arm: The arm as given.
        laws: Elasticities of all cables in turn; None stands for the arm's own.
        wrenches: (W, 6): force [N], then moment [N m].
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
        """How many stiffnesses there are at each posture."""
        return len(self.laws) * len(self.wrenches) * len(self.minima)

    @cached_property
    def arms(self) -> tuple[Manipulator, ...]:
        """The arm with each elasticity; springs, leads and control as they are."""
        return tuple(self.arm if law is None else _with(self.arm, law) for law in self.laws)


def evaluate(problem: Problem, q: Array, threads: int | None = None) -> Answer:
    """All cases at joint angles q (P, nv) [rad]; none fails, each has its status instead.

    Returns:
        ``status`` (P, E, W, M), and every output with those of the four axes it depends on: E
        elasticities, W wrenches, M minima.
    """
    shape = len(q), len(problem.wrenches), len(problem.minima)
    stages = {name: QUANTITIES[name].stage for name in problem.outputs}
    of_pose = [name for name, stage in stages.items() if stage == "pose"]
    of_law = [name for name, stage in stages.items() if stage not in ("pose", "tension")]
    extreme = [name for name, stage in stages.items() if stage == "principal"]

    found, posed = postures(problem.arm, q, of_pose, threads)
    answer: Answer = {**found}
    status = np.tile(posed[:, None, None], (1, *shape[1:]))
    if len(stages) > len(of_pose):
        place = p, w, m = np.nonzero(status == SweepStatus.OK)
        pull, status[place] = tensions(
            problem.arm, q[p], problem.minima[m], problem.maximum, problem.wrenches[w], threads
        )
        pull = _spread(pull, place, shape)
        if "tension" in stages:
            answer["tension"] = pull
    if not of_law:
        return answer | {"status": np.stack([status] * len(problem.laws), axis=1)}

    needed = [name for name in of_law if name not in extreme]
    needed += ["margin", "translational_compliance"] if extreme else ["margin"]
    place = p, w, m = np.nonzero(status == SweepStatus.OK)
    statuses, by_law = [], []
    for arm in problem.arms:
        rows, told = stiffnesses(
            arm,
            q[p],
            pull[place],
            problem.wrenches[w],
            problem.directions,
            list(dict.fromkeys(needed)),
            threads,
        )
        if extreme:
            rows |= _principal(rows, told, extreme)
        by_law.append({name: _spread(rows[name], place, shape) for name in of_law})
        statuses.append(status.copy())
        buckles = (rows["margin"] <= 0.0) & np.isin(told, (SweepStatus.OK, SweepStatus.IMMOBILE))
        statuses[-1][place] = np.where(buckles, SweepStatus.UNSTABLE, told)
    answer |= {name: np.stack([rows[name] for rows in by_law], axis=1) for name in of_law}
    return answer | {"status": np.stack(statuses, axis=1)}


def _principal(rows: Rows, status: Statuses, names: list[str]) -> Rows:
    """The extreme stiffnesses of the rows that have them: stable ones; NaN in the others."""
    exist = (rows["margin"] > 0.0) & (status != SweepStatus.SINGULAR)  # a margin may be NaN
    extremes = principal_stiffness(rows["translational_compliance"][exist])
    return {name: _spread(extremes[name], (exist,), exist.shape) for name in names}


def _spread(rows: Array, place: _Place, shape: tuple[int, ...]) -> Array:
    """An array of all cases from the rows of some, NaN in the others."""
    full = np.full((*shape, *rows.shape[1:]), np.nan)
    full[place] = rows
    return full


def _with(arm: Manipulator, law: Elasticity) -> Manipulator:
    cables = [replace(cable, elasticity=law) for cable in arm.cables]
    return arm.with_cables(cables)

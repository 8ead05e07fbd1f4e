"""Many postures and tensions, one row each: the only place where a sweep meets the physics.

Rows that fail hold NaN and say why; :mod:`cdsm.batch` has 0 there, which a Dataset would pass on as
if it were a stiffness.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from cdsm.batch import Batch, distribute_tensions, evaluate
from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array
from cdsm.sweeps.quantities import LOST, QUANTITIES, SweepStatus

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
"""Where a batch has another name for it, which there cannot be mistaken for a dimension's."""


def postures(
    arm: Manipulator, q: Array, names: Collection[str], threads: int | None
) -> tuple[Rows, Statuses]:
    """What depends on the joint angles q (R, nv) [rad] alone."""
    return _read(evaluate(arm, q, outputs=_batch_names(names), threads=threads), names)


def tensions(
    arm: Manipulator,
    q: Array,
    minimum: Array,
    maximum: float,
    wrench: Array,
    threads: int | None,
) -> tuple[Array, Statuses]:
    """Least tensions in balance (R, C) [N], under a lower bound (R,) [N] and wrench (R, 6) each."""
    low = np.repeat(minimum[:, None], len(arm.cables), axis=1)
    pull = distribute_tensions(arm, q, low, maximum, wrench, threads=threads)
    status = pull.status.astype(np.int8)
    return np.where(pull.ok[:, None], pull.values, np.nan), status


def stiffnesses(
    arm: Manipulator,
    q: Array,
    tension: Array,
    wrench: Array,
    directions: Array,
    names: Collection[str],
    threads: int | None,
) -> tuple[Rows, Statuses]:
    """What depends on tensions (R, C) [N] and elasticity too."""
    found = evaluate(
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


def _read(batch: Batch, names: Collection[str]) -> tuple[Rows, Statuses]:
    """What was asked for, NaN where the status says that it does not exist."""
    status = batch.status.astype(np.int8)
    rows = {}
    for name in names:
        values = batch[_BATCH_NAMES.get(name, name)]
        if name == "tip_position":
            values = values[:, :3, 3]
        elif name == "translational_compliance":
            values = values[:, :3, :3]
        rows[name] = values.copy()
        lost = [kind for kind in SweepStatus if QUANTITIES[name].stage in LOST[kind]]
        rows[name][np.isin(status, lost)] = np.nan
    return rows, status

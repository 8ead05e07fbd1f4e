"""Table of a path plan: a row per sample, as CSV files and pandas show it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from cdsm.planning.path_plan import PathPlan

_NO_ANGLE = 1e-15  # a smaller joint coordinate [rad or m] of a path is rounding


def path_table(plan: PathPlan) -> tuple[list[str], list[list[Any]]]:
    """Return the header and a row for each sample of ``plan``, in SI. Unknown values are empty."""
    arm, names, locked = plan.arm, plan.arm.cables.names, plan.arm.cables.position_controlled
    targets = plan.target.reshape(len(plan.target), -1)
    numbered = _numbered(targets.shape[1])
    columns = [
        *(f"{name} [{unit}]" for name, unit in zip(arm.joint_names, arm.joint_units, strict=True)),
        *(f"{name} tension [N]" for name in names),
        *(f"{name} length [m]" for name in names),
        *(f"{names[c]} unstrained length [m]" for c in np.flatnonzero(locked)),
        *("tip x [m]", "tip y [m]", "tip z [m]"),
        *(f"stiffness{number} [N/m]" for number in numbered),
    ]
    achieved = plan.achieved.reshape(len(plan.planned), targets.shape[1])
    # inverse kinematics leaves angles such as 1e-33, which are 0
    angles = np.where(abs(plan.angles) < _NO_ANGLE, 0.0, plan.angles)
    blocks = angles, plan.tensions, plan.cable_lengths, plan.unstrained_lengths
    numbers = np.hstack([*blocks, plan.tips, achieved]).tolist()
    rows: list[list[Any]] = [
        [i, "planned", *row, *targets[i].tolist(), ""]
        for i, row in zip(plan.planned, numbers, strict=True)
    ]
    rows += [
        [each.index, each.status, *[""] * len(columns), *targets[each.index].tolist(), each.reason]
        for each in plan.infeasible
    ]
    rows.sort(key=lambda row: int(row[0]))
    wanted = (f"target{number} [N/m]" for number in numbered)
    return ["sample", "status", *columns, *wanted, "reason"], rows


def _numbered(count: int) -> list[str]:
    """Return the suffixes of the columns "stiffness" and "target", such as "stiffness 2".

    They are 1, 2, … for a plan of several directions, ``count`` in all; and empty for one.
    """
    return [""] if count == 1 else [f" {k}" for k in range(1, count + 1)]

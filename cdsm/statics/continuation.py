"""Follow a stable equilibrium of an arm while its load grows from one share to another."""

from __future__ import annotations

from collections.abc import Callable

from cdsm.posture import Posture
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import Balance, Point, continued, stable_between
from cdsm.support.values import Array

_FINEST = 2.0**-12  # relative precision of a buckling load; absolute below 1e-9 of the load

Model = Callable[[float], LockedArm]
"""Arm under a share of the load and of the pull."""


def follow(
    model: Model, before: Posture, stop_torque: Array, share: float, goal: float
) -> tuple[Point | None, float]:
    """Follow a stable equilibrium while its ``share`` of load and pull grows to ``goal``.

    It is at the posture ``before``, where the stops push with ``stop_torque`` (nv,) [N m]. Returns
    the last equilibrium before the arm jumps, None if that is this one; and its share.
    """
    here = None
    step = goal - share
    while share < goal:
        part = min(goal, share + step)
        arm = model(part)
        f = Balance(arm.at, arm.reference, arm.at_pose(before))
        point = continued(f, (before.q / f.unit - stop_torque * f.unit / f.k,), before.q)
        if point is not None and stable_between(arm.at, before.q, point.state.pose.q):
            here = point
            share = part
            step = 2.0 * step
            before = point.state.pose
            stop_torque = point.stop_torque
        elif step > _FINEST * max(share, 1e-9):
            step /= 2.0
        else:
            break
    return here, share

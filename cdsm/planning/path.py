"""Plan tensions for a wanted stiffness along a path, with a limited change per sample."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.distribution import RowsOfLoads, check_load_rows
from cdsm.errors import CdsmError, InvalidInput
from cdsm.kinematics import inverse_kinematics
from cdsm.limits import UNCHECKED
from cdsm.manipulator import Manipulator
from cdsm.planning.goal import Goal
from cdsm.planning.path_plan import InfeasibleSample, PathPlan
from cdsm.planning.plan import achieved, checked_targets
from cdsm.planning.tension_space import TensionSpace
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import coordinates, plural
from cdsm.support.progress import show_progress
from cdsm.support.validation import (
    NO_WRENCH,
    Direction,
    bound,
    instance,
    number_array,
    unit_directions,
)
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds


def plan_path(
    arm: Manipulator,
    direction: Direction | Sequence[Direction],
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: RowsOfLoads = NO_WRENCH,
    *,
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
    guess: ArrayLike | None = None,
    max_change_per_sample: ArrayLike = math.inf,
) -> PathPlan:
    """Plan tensions for a wanted stiffness along a path: `min ‖F_i‖²` with `along(u) = target_i`.

    Each of S samples is planned as by :func:`~cdsm.plan_stiffness`, from the tensions of the sample
    before, or from scratch if that fails. An infeasible sample does not stop the path:
    ``infeasible`` of the result lists it with its reason. Between samples the error of the
    stiffness is of second order in the step.

    Between two planned samples that are k samples apart, no tension changes by more than k times
    ``max_change_per_sample``. If no tensions within this limit hit the target although others do,
    the sample has the status CHANGE_LIMITED: after a jump of the target, until the limit allows the
    new tensions. If the arm must follow meanwhile, give a ramp instead.

    Args:
        arm: The arm.
        direction: u, or several that are hit together, as for :func:`~cdsm.plan_stiffness`.
        target: The stiffness [N/m], one for all samples or one per sample: () or (S,) along u, (n,)
            or (S, n) along several directions.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W at ``tool0`` in base axes, (6,) or one per sample (S, 6): force [N], moment [N m].
            Or loads on links: a dict of such wrenches by link, or a list of :class:`~cdsm.Load`.
        angles: The path as joint angles (S, nv) [rad]. Give either ``angles`` or ``tips``.
        tips: The path as tip positions (S, 3) [m]. :func:`~cdsm.inverse_kinematics` finds the joint
            angles of each sample that are nearest to the angles of the sample before.
        guess: Joint angles (nv,) [rad] from which the first of ``tips`` is solved; default: zero.
        max_change_per_sample: Largest change of a tension from sample to sample [N], for all cables
            or (C,); inf for no limit.

    Raises:
        InvalidInput: Neither or both of ``angles`` and ``tips`` are given; a target or a largest
            change is not positive; or another argument is invalid.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> plan = cdsm.plan_path(arm, "z", 2500.0, 5.0, 200.0, angles=[[0.08] * 10, [0.1] * 10])
        >>> print(plan)
        2 of 2 samples planned, with 5 to 33.41 N, which change by up to 0.6345 N per sample
    """
    instance("arm", arm, Manipulator)
    path = checked_path(arm, angles, tips)
    if tips is None and guess is not None:
        raise InvalidInput("guess", "given with angles=, which need none; drop it, or give tips=.")
    directions = unit_directions("direction", direction)
    targets = checked_targets(target, directions.shape[:-1], len(path))
    acting = check_load_rows(arm, wrench, len(path))
    limit = checked_change("max_change_per_sample", arm, max_change_per_sample)
    checked_bounds(arm, minimum, maximum)  # check now, not at the first feasible posture

    start = guess
    planned = dict[int, Stiffness]()
    infeasible: list[InfeasibleSample] = []
    for i in show_progress(range(len(path)), "planning the path"):
        try:
            q = path[i]
            if tips is not None:
                q = _angles(arm, q, start)
                start = q
            load = acting.case(i)
            space = TensionSpace(arm.at(q), directions, minimum, maximum, load)
            goal = Goal(space, targets[i].reshape(-1))
            last = max(planned, default=i)
            before = planned[last].tension if planned else None
            F = _plan(goal, before, (i - last) * limit if planned else limit, i - last)
            planned[i] = stiffness(space.pose, F, load)
        except _Infeasible as cause:
            infeasible.append(InfeasibleSample(i, cause.status, cause.reason))
        except CdsmError as error:
            if error.status.is_fault:  # of an argument: the other samples would have it, too
                raise
            reason = str(error).replace(UNCHECKED, "")
            infeasible.append(InfeasibleSample(i, error.status, reason, error))
    values = np.array([achieved(K, directions) for K in planned.values()])
    return PathPlan(
        arm=arm,
        direction=directions,
        target=targets,
        max_change_per_sample=limit,
        planned=tuple(planned),
        angles=frozen(np.array([K.posture.q for K in planned.values()]).reshape(-1, arm.nv)),
        tensions=frozen(np.array([K.tension for K in planned.values()]).reshape(-1, limit.size)),
        achieved=frozen(values.reshape(-1, *directions.shape[:-1])),
        stiffness=tuple(planned.values()),
        infeasible=tuple(infeasible),
    )


class _Infeasible(Exception):
    """What prevents the plan of a sample and is no error of the library."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status = status
        self.reason = reason


def _angles(arm: Manipulator, tip: Array, guess: ArrayLike | None) -> Array:
    solution = inverse_kinematics(arm, tip, guess)
    if solution.reachable:
        return solution.angles
    distance = f"{coordinates(1e3 * tip)} mm than {1e3 * solution.position_error:.3g} mm"
    remedy = "Ask for a place within reach, or, in Python, start from a guess= nearer to it."
    raise _Infeasible(Status.OUT_OF_REACH, f"the tip comes no nearer to {distance}. {remedy}")


def _plan(goal: Goal, before: Array | None, change: Array, steps: int) -> Array:
    """Plan the least F (C,) [N] for a goal, at most ``change`` from ``before``, ``steps`` ago."""
    # 1. the tensions of the sample before are usually near
    allowed = None if before is None else goal.space.within(before, change)
    if before is not None:
        F = goal.search(before, allowed)
        if F is not None:
            return F
    # 2. from scratch, without the limit of the change
    least = goal.least()
    if not goal.met(least):
        raise _Infeasible(
            Status.UNREACHABLE_STIFFNESS,
            "no tensions were found that hit all targets at once. Ask for fewer, or for others; "
            "plan_stiffness finds what comes nearest to them.",
        )
    if before is None or np.isinf(change).all():
        return least
    # 3. with the limit, from the tensions with the least change
    nearest = goal.search(least, centre=before)
    nearest = least if nearest is None else nearest
    F = goal.search(nearest, allowed)
    if F is not None:
        return F
    moved = abs(nearest - before)
    worst = int((moved / change).argmax())
    raise _Infeasible(
        Status.CHANGE_LIMITED,
        "tensions that hit the target exist, but none were found within the largest change: the "
        f"nearest change {goal.space.pose.arm.cables[worst].name} by {moved[worst]:.4g} N in "
        f"{plural(steps, 'sample')}, and {change[worst]:.4g} N are allowed. Raise "
        "max_change_per_sample, or change the target more slowly.",
    )


def checked_path(arm: Manipulator, angles: ArrayLike | None, tips: ArrayLike | None) -> Array:
    """Check and return the path: joint angles (S, nv) [rad] or tip positions (S, 3) [m]."""
    if (angles is None) == (tips is None):
        count = "neither" if angles is None else "both"
        problem = f"{count} of angles= and tips= given; give the path as one of them."
        raise InvalidInput("angles", problem)
    name = "tips" if angles is None else "angles"
    width = 3 if angles is None else arm.nv
    path = number_array(name, tips if angles is None else angles)  # type: ignore[arg-type]
    if path.ndim != 2 or path.shape[1] != width or not len(path):
        meaning = "a tip position [m]" if angles is None else "the joint angles [rad]"
        problem = f"shape {path.shape} given; (S, {width}) is needed, {meaning} for each sample."
        raise InvalidInput(name, problem)
    return frozen(path)


def checked_change(name: str, arm: Manipulator, change: ArrayLike) -> Array:
    """Check the largest change of each tension per step; return it as (C,) [N]."""
    limit = bound(name, change, len(arm.cables))
    if not (limit > 0.0).all():
        raise InvalidInput(name, f"{limit.min():g} N given; it must be positive, or inf for any.")
    return limit

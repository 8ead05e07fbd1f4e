"""Tensions for a wanted stiffness along a path, and what the motors have to do for it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track

from cdsm.errors import (
    CableError,
    CdsmError,
    ElasticityRangeError,
    InfeasibleTension,
    InvalidInput,
    JointLimitError,
    SingularStiffness,
    SolverError,
    UnreachableStiffness,
)
from cdsm.kinematics.maps import KinematicSolution, inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.planning.follow import Follower, SampleTarget, Status
from cdsm.planning.objectives import (
    achieved,
    checked_margin,
    checked_matrix,
    checked_positive,
    checked_starts,
    stiffness_model,
    target_constraints,
)
from cdsm.planning.path_plan import InfeasibleSample, PathPlan
from cdsm.planning.range import MARGIN
from cdsm.stiffness_matrix import stiffness
from cdsm.support.validation import (
    Array,
    bound,
    flag,
    frozen,
    instance,
    number_array,
    unit_directions,
)
from cdsm.tension import checked_bounds

_STATUS: Final[dict[type[CdsmError], Status]] = {
    JointLimitError: "posture",
    CableError: "posture",
    InfeasibleTension: "balance",
    SolverError: "balance",
    ElasticityRangeError: "elasticity",
    SingularStiffness: "singular",
    UnreachableStiffness: "stiffness",
}


def plan_path(
    arm: Manipulator,
    direction: ArrayLike | None,
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *,
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
    guess: ArrayLike | None = None,
    rate: ArrayLike = math.inf,
    margin: float = MARGIN,
    starts: int = 3,
    seed: int = 0,
    progress: bool = True,
) -> PathPlan:
    """Tensions for a wanted stiffness along a path: min ‖F_i‖² so that along(u) = target_i.

    Each of S samples is planned as by :func:`~cdsm.planning.plan.plan_stiffness`, but starting from
    the tensions of the one before. If that leads nowhere, or for the first sample, it is planned
    from scratch. An infeasible sample does not stop the path; ``infeasible`` of the answer lists
    each with its reason.

    Between a planned sample and the one before it, k samples back, no tension changes by more than
    k·rate. Of the tensions within that the least are taken. If none of them hit the target although
    others do, up to 50 samples before are planned again, backwards: they still hit their targets,
    but with tensions that lead to this sample. If that fails, the sample has the status ``"rate"``,
    and the motors have more steps for the next. So a target that jumps is hit again as many samples
    later as the motors need; make it a ramp if the arm is to follow it in between.

    The targets are hit at the samples. ``between`` of the answer gives the stiffness half-way
    between two of them; its miss falls with the square of the step.

    Args:
        arm: The arm.
        direction: u (3,) in base axes, any length; several (n, 3), all of which are to be hit; or
            None for ``cartesian``.
        target: The stiffness [N/m], one for all samples or one per sample: () or (S,) along u, (n,)
            or (S, n) along several, (3, 3) or (S, 3, 3) of ``cartesian``.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for none but the end
            of the elasticity's domain, and buckling.
        wrench: W at ``tool0`` in base axes, (6,) or one per sample (S, 6): force [N], then moment
            [N m].
        angles: The path as joint angles (S, nv) [rad]; or else
        tips: the path as tip positions (S, 3) [m], solved for the angles nearest to those before by
            :func:`~cdsm.inverse_kinematics`.
        guess: Angles (nv,) [rad] near which the first of ``tips`` is solved for; the straight arm
            if not given.
        rate: By how much a tension may change per step [N], for all cables or (C,); inf for any.
        margin: From which part of the largest eigenvalue of K_θ under the least tensions on the
            smallest one counts as stable [-], 1e-9 or more.
        starts: From how many tensions to search where there are none to go on from, at most 1000.
        seed: Of the random ones among them.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: None or both of ``angles`` and ``tips``, no direction, a target or a rate that
            is not positive, bounds the wrong way, or another argument out of place.
    """
    instance("arm", arm, Manipulator)
    path = _checked_path(arm, angles, tips)
    if tips is None and guess is not None:
        raise InvalidInput("guess", "given with angles=, which need none; drop it, or give tips=.")
    size = len(path)
    directions = None if direction is None else unit_directions("direction", direction)
    targets = _checked_targets(directions, target, size)
    loads = _per_sample("wrench", wrench, (6,), size)
    limit = bound("rate", rate, len(arm.cables))
    if not (limit > 0.0).all():
        raise InvalidInput("rate", f"{limit.min():g} N given; it must be positive, or inf for any.")
    checked_bounds(arm, minimum, maximum)  # at once, not at the first posture that is possible
    checked_margin(margin)
    follower = Follower(limit, *checked_starts(starts, seed))
    flag("progress", progress)

    near = guess
    infeasible: list[InfeasibleSample] = []
    for i in _shown(size, progress):
        try:
            q = path[i]
            if tips is not None:
                solved = inverse_kinematics(arm, path[i], near)
                if not solved.reachable:
                    infeasible.append(InfeasibleSample(i, "posture", _out_of_reach(solved)))
                    continue
                q = near = solved.angles
            model = stiffness_model(arm.at(q), minimum, maximum, loads[i], margin)
            constraints = target_constraints(model, directions, targets[i])
            single = None
            if directions is not None and directions.ndim == 1:
                single = directions, float(targets[i])
            reason = follower.add(SampleTarget(i, model, constraints, single))
        except tuple(_STATUS) as error:
            infeasible.append(InfeasibleSample(i, _status(error), _explained(error), error))
        else:
            if reason is not None:
                infeasible.append(InfeasibleSample(i, *reason))

    found = [
        stiffness(each.target.model.pose, each.F, wrench=loads[each.target.index])
        for each in follower.planned
    ]
    return PathPlan(
        arm=arm,
        direction=directions,
        target=targets,
        rate=limit,
        planned=tuple(each.target.index for each in follower.planned),
        angles=_stacked([K.posture.q for K in found], (arm.nv,)),
        tensions=_stacked([K.tension for K in found], (len(arm.cables),)),
        achieved=_stacked([achieved(K, directions) for K in found], targets.shape[1:]),
        stiffness=tuple(found),
        infeasible=tuple(infeasible),
        iterations=follower.iterations,
    )


def _checked_path(arm: Manipulator, angles: ArrayLike | None, tips: ArrayLike | None) -> Array:
    """The path: joint angles (S, nv) [rad] or tip positions (S, 3) [m]."""
    if (angles is None) == (tips is None):
        raise InvalidInput(
            "angles",
            f"{'neither' if angles is None else 'both'} of angles= and tips= given; give the path "
            "as one of them.",
        )
    name, given, width = ("tips", tips, 3) if angles is None else ("angles", angles, arm.nv)
    path = number_array(name, given)  # type: ignore[arg-type]
    if path.ndim != 2 or path.shape[1] != width or not len(path):
        meaning = "a tip position [m]" if angles is None else "the joint angles [rad]"
        raise InvalidInput(
            name, f"shape {path.shape} given; (S, {width}) is needed, {meaning} for each sample."
        )
    return frozen(path)


def _checked_targets(directions: Array | None, target: ArrayLike, size: int) -> Array:
    """Positive targets [N/m], one for each sample: (S,), (S, n) or (S, 3, 3)."""
    tail = (3, 3) if directions is None else directions.shape[:-1]
    targets = _per_sample("target", target, tail, size)
    if directions is None:
        for matrix in targets:
            checked_matrix(matrix)
    else:
        checked_positive(targets)
    return targets


def _per_sample(name: str, value: ArrayLike, tail: tuple[int, ...], size: int) -> Array:
    """One value for each sample (S, …), from one for all or one for each."""
    given = number_array(name, value)
    if given.shape not in (tail, (size, *tail)):
        raise InvalidInput(
            name,
            f"shape {given.shape} given; {tail} for all samples or {(size, *tail)}, one for each "
            "of them, is needed.",
        )
    return frozen(np.broadcast_to(given, (size, *tail)).copy())


def _shown(size: int, progress: bool) -> Iterable[int]:
    """The samples, with a progress bar on a terminal."""
    console = Console(stderr=True)
    disable = not (progress and console.is_terminal)
    return track(range(size), "planning the path", console=console, disable=disable)


def _status(error: CdsmError) -> Status:
    return next(status for kind, status in _STATUS.items() if isinstance(error, kind))


def _explained(error: CdsmError) -> str:
    """The message of an error, with a remedy for paths."""
    if isinstance(error, JointLimitError):
        return (
            f"{error.problem}. Keep the path within the limits, or widen joint_limit in the "
            "geometry (limit in a full description or a URDF)."
        )
    return str(error)


def _out_of_reach(solved: KinematicSolution) -> str:
    wanted = ", ".join(f"{x:.6g}" for x in solved.target)
    return (
        f"the tip comes no nearer to ({wanted}) m than {solved.position_error:.3g} m. Ask for a "
        "place within reach, or start from a guess= nearer to it."
    )


def _stacked(rows: list[Array], tail: tuple[int, ...]) -> Array:
    return frozen(np.array(rows).reshape(-1, *tail))

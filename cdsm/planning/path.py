"""Plan tensions for a wanted stiffness along a path, within the rate of the motors."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm import errors
from cdsm.errors import CdsmError, InvalidInput
from cdsm.kinematics import KinematicSolution, inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.planning.follow import Follower, Sample
from cdsm.planning.objectives import achieved, check_positive, checked_starts, target_constraints
from cdsm.planning.path_plan import InfeasibleSample, PathPlan, Status
from cdsm.planning.range import MARGIN
from cdsm.planning.stiffness_model import StiffnessModel, checked_margin
from cdsm.stiffness_matrix import stiffness
from cdsm.support.directions import Direction, unit_directions
from cdsm.support.format import coordinates
from cdsm.support.progress import track
from cdsm.support.validation import NO_WRENCH, bound, flag, instance, number_array
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds

_log = logging.getLogger("cdsm")

_STATUS: Final[dict[type[CdsmError], Status]] = {
    errors.JointLimitError: "posture",
    errors.CableError: "posture",
    errors.InfeasibleTension: "balance",
    errors.SolverError: "balance",
    errors.ElasticityRangeError: "elasticity",
    errors.SingularStiffness: "singular",
    errors.UnreachableStiffness: "stiffness",
}


def plan_path(
    arm: Manipulator,
    direction: Direction | Sequence[Direction],
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
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
    """Plan tensions for a wanted stiffness along a path: min ‖F_i‖² with along(u) = target_i.

    :func:`~cdsm.planning.plan.plan_stiffness` describes the plan of each of S samples. The search
    starts from the tensions of the sample before, or from scratch if that fails. An infeasible
    sample does not stop the path: ``infeasible`` of the result lists it with its reason.

    Between two planned samples that are k samples apart, no tension changes by more than k·rate.
    If no tensions within this limit hit the target although others do, the sample has the status
    ``"rate"``, and the next sample may change the tensions by one rate more. So after a jump of the
    target, samples have this status until the rate allows the new tensions. If the arm must follow
    meanwhile, give a ramp instead of a jump.

    The plan hits the targets at the samples. Between samples the error of the stiffness is of
    second order in the step.

    Args:
        arm: The arm.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length; several directions
            (n, 3), which are hit together.
        target: The stiffness [N/m], one for all samples or one per sample: () or (S,) along u, (n,)
            or (S, n) along several directions.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W at ``tool0`` in base axes, (6,) or one per sample (S, 6): force [N], then moment
            [N m].
        angles: The path as joint angles (S, nv) [rad]. Give either ``angles`` or ``tips``.
        tips: The path as tip positions (S, 3) [m]. :func:`~cdsm.inverse_kinematics` finds the joint
            angles of each sample that are nearest to the angles of the sample before.
        guess: Joint angles (nv,) [rad] from which the first of ``tips`` is solved. Default: the
            straight arm.
        rate: Largest change of a tension per step [N], for all cables or (C,); inf for no limit.
        margin: Smallest eigenvalue of K_θ that counts as stable, as a part of the largest [-]. A
            prismatic joint counts in lengths of the arm.
        starts: Number of starting tensions of a search from scratch, at most 1000.
        seed: Seed of the random starting tensions.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: Neither or both of ``angles`` and ``tips`` are given; ``direction`` is not
            finite or is zero; a target or a rate is not positive; ``minimum`` exceeds ``maximum``;
            or another argument is invalid.
    """
    instance("arm", arm, Manipulator)
    path = checked_path(arm, angles, tips)
    if tips is None and guess is not None:
        raise InvalidInput("guess", "given with angles=, which need none; drop it, or give tips=.")
    size = len(path)
    directions = unit_directions("direction", direction)
    tail = directions.shape[:-1]
    targets = _per_sample("target", target, tail, size)
    check_positive(targets)
    loads = _per_sample("wrench", wrench, (6,), size)
    limit = checked_rate(arm, rate)
    checked_bounds(arm, minimum, maximum)  # check now, not at the first feasible posture
    checked_margin(margin)
    follower = Follower(limit, *checked_starts(starts, seed))
    flag("progress", progress)

    near = guess
    infeasible: list[InfeasibleSample | None] = []
    for i in track(range(size), "planning the path", wanted=progress):
        try:
            q = path[i]
            if tips is not None:
                solved = inverse_kinematics(arm, path[i], near)
                if not solved.reachable:
                    infeasible.append(_out_of_reach(i, solved))
                    continue
                q = near = solved.angles
            model = StiffnessModel(arm.at(q), minimum, maximum, loads[i], margin)
            constraints = target_constraints(model, directions, targets[i])
            sample = Sample(i, model, constraints, model.region.least.values)
            infeasible.append(follower.add(sample))
        except tuple(_STATUS) as error:
            infeasible.append(_infeasible(i, error))

    planned = follower.planned
    _log.info("path: %d of %d samples planned", len(planned), size)
    found = [stiffness(each.model.pose, each.F, loads[each.index]) for each in planned]
    values = np.array([achieved(K, directions) for K in found])
    return PathPlan(
        arm=arm,
        direction=directions,
        target=targets,
        rate=limit,
        planned=tuple(each.index for each in planned),
        angles=frozen(np.array([K.posture.q for K in found]).reshape(-1, arm.nv)),
        tensions=frozen(np.array([K.tension for K in found]).reshape(-1, limit.size)),
        achieved=frozen(values.reshape(-1, *tail)),
        stiffness=tuple(found),
        infeasible=tuple(each for each in infeasible if each is not None),
    )


def checked_path(arm: Manipulator, angles: ArrayLike | None, tips: ArrayLike | None) -> Array:
    """Check and return the path: joint angles (S, nv) [rad] or tip positions (S, 3) [m]."""
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


def checked_rate(arm: Manipulator, rate: ArrayLike) -> Array:
    """Check ``rate``, the largest change of each tension per step; return it as (C,) [N]."""
    limit = bound("rate", rate, len(arm.cables))
    if not (limit > 0.0).all():
        raise InvalidInput("rate", f"{limit.min():g} N given; it must be positive, or inf for any.")
    return limit


def _per_sample(name: str, value: ArrayLike, tail: tuple[int, ...], size: int) -> Array:
    """Return one value per sample, (S, *tail) with S = ``size``.

    ``value`` has this shape, or the shape ``tail``; then it is repeated for each sample.
    """
    given = number_array(name, value)
    if given.shape not in (tail, (size, *tail)):
        raise InvalidInput(
            name,
            f"shape {given.shape} given; {tail} for all samples or {(size, *tail)}, one for each "
            "of them, is needed.",
        )
    return frozen(np.broadcast_to(given, (size, *tail)).copy())


def _out_of_reach(index: int, nearest: KinematicSolution) -> InfeasibleSample:
    reason = (
        f"the tip comes no nearer to {coordinates(1e3 * nearest.target)} mm than "
        f"{1e3 * nearest.position_error:.3g} mm. Ask for a place within reach, or start from a "
        "guess= nearer to it."
    )
    return InfeasibleSample(index, "posture", reason)


def _infeasible(index: int, error: CdsmError) -> InfeasibleSample:
    status = next(word for kind, word in _STATUS.items() if isinstance(error, kind))
    reason = str(error)
    if isinstance(error, errors.JointLimitError):  # without the remedy that a path does not have
        reason = (
            f"{error.problem}. Keep the path within the limits, or widen joint_limit in the "
            "geometry (limit in a full description or a URDF)."
        )
    return InfeasibleSample(index, status, reason, error)

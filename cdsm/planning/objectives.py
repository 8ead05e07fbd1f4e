"""Check the arguments of the planners, and build the constraints that follow from the targets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.manipulator import Manipulator
from cdsm.planning.stiffness_model import Constraint, Constraints, StiffnessModel
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import SMALLEST, number_array, whole_number
from cdsm.support.values import Array, frozen

_MOST_STARTS = 1000  # so many take about a minute, and a late start is seldom the best


def checked_starts(starts: object, seed: object) -> tuple[int, int]:
    """Check and return the number of starting tensions, 1 to 1000, and the seed of random ones."""
    return whole_number("starts", starts, 1, _MOST_STARTS), whole_number("seed", seed, 0)


def target_constraints(model: StiffnessModel, directions: Array, target: Array) -> Constraints:
    """Build the constraints that ``K.along(u)`` of each direction u has the ``target`` [N/m].

    Raises SingularStiffness if the tip cannot move along a direction.
    """
    K = stiffness(model.pose, model.region.least)
    rows = directions.reshape(-1, 3)
    for u in rows:
        K._require_mobile(u)
    single = (directions, float(target)) if directions.ndim == 1 else None
    return replace(along_constraints(model, rows, target.reshape(-1)), single=single)


def along_constraints(model: StiffnessModel, directions: Array, targets: Array) -> Constraints:
    """Build the constraints along(u)/target − 1 = 0 for directions u (m, 3), targets (m,) [N/m]."""
    parts = tuple(
        Constraint(u[None] @ model.jacobian[:3], np.full((1, 1, 1), 1.0 / target))
        for u, target in zip(directions, targets.tolist(), strict=True)
    )
    return Constraints(parts, np.ones(targets.size))


def achieved(K: Stiffness, directions: Array) -> Array:
    """Return ``K.along(u)`` [N/m] of each of the ``directions`` (3,) or (n, 3): () or (n,)."""
    along = [K.along(u) for u in directions.reshape(-1, 3)]
    return frozen(np.array(along).reshape(directions.shape[:-1]))


def unstable(arm: Manipulator, problem: str, mode: Array) -> SingularStiffness:
    """Build the error that no tensions make the arm stable.

    ``problem`` begins the message. ``mode`` (nv,) is the joint motion of least stiffness, and its
    largest entry tells the joint that buckles.
    """
    mode = mode * np.sign(mode[abs(mode).argmax()])
    remedy = "Change the bounds, the posture or the load, take stiffer cables, or lower margin."
    if all(cable.control == "force" for cable in arm.cables):
        remedy = "All motors control force, so that no cable resists by its elasticity: have some "
        remedy += 'hold their length (control="position").'
    joint = arm.joint_names[int(abs(mode).argmax())]
    return SingularStiffness(f"{problem}; it buckles mostly in {joint}. {remedy}", frozen(mode))


def checked_targets(directions: Array, target: ArrayLike) -> Array:
    """Check and return the targets [N/m]: one per direction."""
    targets = number_array("target", target)
    if targets.shape != directions.shape[:-1]:
        raise InvalidInput(
            "target",
            f"shape {targets.shape} given for {directions.size // 3} direction(s) of shape "
            f"{directions.shape}; give one stiffness [N/m] for each, {directions.shape[:-1]}.",
        )
    check_positive(targets)
    return frozen(targets)


def check_positive(targets: Array) -> None:
    """Raise InvalidInput unless all targets of stiffness [N/m] are positive."""
    if not (targets >= SMALLEST).all():
        raise InvalidInput(
            "target",
            f"{targets.min():g} N/m given; stiffness is positive, at least {SMALLEST:g} N/m.",
        )

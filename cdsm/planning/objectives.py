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
_SYMMETRIC = 1e-9  # a skew part of a matrix below this part of its largest entry is rounding


def checked_starts(starts: object, seed: object) -> tuple[int, int]:
    """Check and return the number of starting tensions, 1 to 1000, and the seed of random ones."""
    return whole_number("starts", starts, 1, _MOST_STARTS), whole_number("seed", seed, 0)


def target_constraints(
    model: StiffnessModel, directions: Array | None, target: Array
) -> Constraints:
    """Build the constraints that ``K.along(u)`` of each direction u has the ``target`` [N/m].

    If ``directions`` is None, the constraints are ``K.cartesian`` = ``target`` (3, 3). Raises
    SingularStiffness if the tip cannot move along a direction, or if ``K.cartesian`` does not
    exist.
    """
    K = stiffness(model.pose, model.region.least)
    if directions is None:
        _ = K.cartesian  # raises if it does not exist
        return cartesian_constraints(model, target)
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


def cartesian_constraints(model: StiffnessModel, target: Array) -> Constraints:
    """Build the constraints (cartesian − target)/‖target‖ = 0 for a target (3, 3) [N/m].

    There are 6 constraints, one for each entry of the symmetric part of this matrix. Entries off
    the diagonal have a factor √2, so the norm of the 6 values is the norm of the symmetric part.
    """
    k, (i, j), E = np.arange(6), np.triu_indices(3), np.zeros((6, 3, 3))
    E[k, i, j] = E[k, j, i] = np.where(i == j, 1.0, np.sqrt(0.5))
    E /= np.linalg.norm(target)
    part = Constraint(model.jacobian[:3].copy(), E)
    return Constraints((part,), np.tensordot(E, target))


def achieved(K: Stiffness, directions: Array | None) -> Array:
    """Return the stiffness [N/m] that a plan has reached.

    It is ``K.along(u)`` of each direction u: () for ``directions`` (3,), (n,) for (n, 3). If
    ``directions`` is None, it is ``K.cartesian`` (3, 3).
    """
    if directions is None:
        return K.cartesian
    along = [K.along(u) for u in directions.reshape(-1, 3)]
    return frozen(np.array(along).reshape(directions.shape[:-1]))


def misfit(achieved: Array, target: Array, directions: Array | None) -> float:
    """Return the relative error of a stiffness, ‖achieved/target − 1‖ [-].

    If ``directions`` is None, it is ‖S − target‖/‖target‖ [-] instead, where S is the symmetric
    part of ``achieved`` (3, 3).
    """
    if directions is None:
        off = (achieved + achieved.T) / 2.0 - target
        return float(np.linalg.norm(off) / np.linalg.norm(target))
    return float(np.linalg.norm(achieved / target - 1.0))


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


def checked_targets(directions: Array | None, target: ArrayLike) -> Array:
    """Check and return the targets [N/m]: one per direction, or (3, 3) if there is no direction."""
    targets = number_array("target", target)
    if directions is None and targets.shape != (3, 3):
        raise InvalidInput(
            "target", f"shape {targets.shape} given without a direction; (3, 3) is needed [N/m]."
        )
    if directions is not None and targets.shape != directions.shape[:-1]:
        raise InvalidInput(
            "target",
            f"shape {targets.shape} given for {directions.size // 3} direction(s) of shape "
            f"{directions.shape}; give one stiffness [N/m] for each, {directions.shape[:-1]}, or "
            "direction=None with the (3, 3) of cartesian.",
        )
    check_positive(directions, targets)
    return frozen(targets)


def check_positive(directions: Array | None, targets: Array) -> None:
    """Raise InvalidInput unless all targets of stiffness [N/m] are positive.

    If ``directions`` is None, the targets are matrices (…, 3, 3), which must be symmetric and
    positive definite.
    """
    if directions is not None:
        if not (targets >= SMALLEST).all():
            raise InvalidInput(
                "target",
                f"{targets.min():g} N/m given; stiffness is positive, at least {SMALLEST:g} N/m.",
            )
        return
    for matrix in targets.reshape(-1, 3, 3):
        if abs(matrix - matrix.T).max() > _SYMMETRIC * abs(matrix).max():
            raise InvalidInput("target", "is not symmetric, which a stiffness matrix is.")
        if not np.linalg.eigvalsh(matrix)[0] >= SMALLEST:
            raise InvalidInput("target", "is not positive definite, which a stiffness matrix is.")

"""Find why no tensions balance an arm: the missing torque, and which bounds must widen how far."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InfeasibleTension, listed, solver_failed
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.format import plural
from cdsm.support.values import Array, frozen
from cdsm.tension.least_tensions import nearest_tensions
from cdsm.tension.solvers import OPTIMALITY, TensionProblem, minimise

_NO_ARM: Final = 1e-9  # of the largest moment arm: below, a cable does not pull a joint


def infeasible(
    pose: Posture, problem: TensionProblem, free: NDArray[np.bool_]
) -> InfeasibleTension:
    """Find by linear programs what is missing, and how far which bounds must widen.

    ``problem`` has no solution. ``free`` (C,) marks the cables without a fixed tension; only their
    bounds may widen. Return the error to raise; raise CdsmError if a linear program fails.
    """
    nearest = nearest_tensions(problem)
    if not nearest.ok:  # it is feasible and bounded by construction
        raise solver_failed("highs", f"cannot tell which torque is missing: {nearest.message}")
    A, b, low, high, arm, force = problem
    F = nearest.x
    widening = _widening(problem, free)
    blocked = math.isinf(widening) and _widening(problem, np.ones_like(free)) < math.inf
    names = pose.arm.cables.names
    missing = (b - A @ F) * arm * force
    tight = free & (np.minimum(F - low, high - F) <= OPTIMALITY)
    one_sided = _one_sided(problem)
    lever = np.where(pose.arm.slides, pose.arm.length, 1.0)  # of a force, to compare it
    worst = one_sided[0] if one_sided else int(abs(missing * lever).argmax())
    return InfeasibleTension(
        frozen(missing),
        pose.arm.joint_names[worst],
        widening,
        binding=[names[c] for c in np.flatnonzero(tight)],
        fixed=[names[c] for c in np.flatnonzero(~free)] if blocked else (),
        units=[pose.arm.torque_unit(joint) for joint in range(pose.arm.nv)],
        names=pose.arm.joint_names,
        hint=_sides(pose.arm, problem, one_sided) + too_few_cables(pose.arm)
        if math.isinf(widening)
        else advice(pose.arm, force * F, force * low, force * high, free),
        cause=_sides(pose.arm, problem, one_sided),
    )


def _one_sided(problem: TensionProblem) -> list[int]:
    """Return the joints that cables pull to one side at most, and not to the one that is needed."""
    A, b, low, *_ = problem
    size = _NO_ARM * abs(A).max(initial=0.0)
    forward = (size < A).any(axis=1)
    backward = (-size > A).any(axis=1)
    helped = ((b > 0.0) & forward) | ((b < 0.0) & backward)
    loaded = (b != 0.0) | ((abs(A) > size) & (low > 0.0)).any(axis=1)
    return np.flatnonzero(~(forward & backward) & ~helped & loaded).tolist()


def _sides(arm: Manipulator, problem: TensionProblem, joints: list[int]) -> str:
    """Say of these joints that all cables pull them to one side, or that none does."""
    size = _NO_ARM * abs(problem.A).max(initial=0.0)
    free = [arm.joint_names[j] for j in joints if (abs(problem.A[j]) <= size).all()]
    pulled = [arm.joint_names[j] for j in joints if arm.joint_names[j] not in free]
    text = f"No cable pulls {listed(free)}: lead one past it. " if free else ""
    if pulled:
        text += f"All cables pull {listed(pulled)} to the same side: add one that pulls the other "
        text += "way. "
    return text


def advice(
    arm: Manipulator, F: Array, low: Array, high: Array, among: NDArray[np.bool_] | None = None
) -> str:
    """Say which bounds to widen: of each cable at a bound, the argument, its own, or its law's.

    Tensions and bounds are (C,) [N]; ``among`` (C,) are the cables that count, default all. The
    text is such as "lower minimum, raise the maximum of cable1_1 itself", or empty.
    """
    near = OPTIMALITY * max(float(F.max()), 1.0)
    cables: dict[str, list[str]] = {}
    for c, cable in enumerate(arm.cables):
        law = cable.elasticity if cable.control == "position" else None
        for tight, value, verb, side, end in (
            (0.0 < F[c] <= low[c] + near, low[c], "lower", "minimum", law and law.low),
            (F[c] >= high[c] - near, high[c], "raise", "maximum", law and law.high),
        ):
            if tight and (among is None or among[c]):
                rule = f"{verb} {side}"
                if value == getattr(cable, side):
                    rule = f"{verb} the {side} of % itself"
                elif value == end:
                    rule = f"take another law than one that ends at {value:.4g} N for %"
                cables.setdefault(rule, []).append(cable.name)
    return ", ".join(rule.replace("%", listed(names)) for rule, names in cables.items())


def too_few_cables(arm: Manipulator) -> str:
    """Return a sentence if the cables are too few to hold all joints anywhere, else nothing."""
    count = len(arm.cables)
    joints = arm.nv
    if count > joints:
        return ""
    if arm.has_springs:
        held = (
            f"{plural(count, 'cable')} and springs hold {plural(joints, 'joint')} only where they"
        )
        finds = "forward_statics(arm, tension=...) finds it (command: cdsm stiffness --tension)"
        return f"{held} come to rest: {finds}. "
    needed = f"cables only pull, so at least {joints + 1} are needed"
    return f"{plural(count, 'cable')} alone cannot hold {plural(joints, 'joint')}: {needed}. "


def _widening(problem: TensionProblem, free: NDArray[np.bool_]) -> float:
    """Compute how far the bounds of ``free`` cables (C,) must widen [N]; inf if nothing helps."""
    A, b, low, high, _, force = problem
    nv, count = A.shape
    # variables: F ≥ 0, then the widening t: low − t ≤ F ≤ high + t; a fixed tension does not widen
    rows = np.column_stack([np.vstack([-np.eye(count), np.eye(count)]), -1.0 * np.tile(free, 2)])
    sides = np.concatenate([-low, high])
    finite = np.isfinite(sides)
    balance = np.column_stack([A, np.zeros(nv)])
    widest = np.append(np.zeros(count), 1.0)
    solution = minimise(widest, A_ub=rows[finite], b_ub=sides[finite], A_eq=balance, b_eq=b)
    return float(solution.x[-1]) * force if solution.ok else math.inf

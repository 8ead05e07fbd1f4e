"""Find why no tensions balance an arm: the missing torque, and which bounds must widen how far."""

from __future__ import annotations

import math
from typing import Final, NoReturn

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InfeasibleTension, listed, solver_failed
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.format import plural
from cdsm.support.values import Array, frozen
from cdsm.tension.solvers import HINT, OPTIMAL, OPTIMALITY, Problem, least

_PROOF: Final = 1e-8  # least missing torque, per largest moment arm × force, that proves anything
_ROUNDING: Final = 1e-11  # a cable that pulls less than this against it does not pull


def explain(
    pose: Posture, problem: Problem, solver: str, fault: str, free: NDArray[np.bool_]
) -> NoReturn:
    """Find by linear programs why ``solver`` did not solve ``problem``; raise that as an error.

    ``free`` (C,) marks the cables without a fixed tension; only their bounds may widen. ``fault``
    says what the solver returned. Raises InfeasibleTension, or CdsmError if tensions exist.
    """
    F, missed = _nearest(problem)
    A, b, low, high, arm, force = problem
    if missed <= OPTIMALITY:
        exists = f"{fault}, though one exists with tensions of up to {F.max() * force:.2g} N"
        edge = "the arm may be at the edge of what its cables can balance"
        raise solver_failed(solver, f"{exists}: {edge}. {HINT}")
    widening = _widening(problem, free)
    blocked = math.isinf(widening) and _widening(problem, np.ones_like(free)) < math.inf
    names = pose.arm.cables.names
    missing = (b - A @ F) * arm * force
    tight = free & (np.minimum(F - low, high - F) <= OPTIMALITY)
    worst = int(abs(missing).argmax())
    raise InfeasibleTension(
        frozen(missing),
        pose.arm.joint_names[worst],
        widening,
        binding=[names[c] for c in np.flatnonzero(tight)],
        fixed=[names[c] for c in np.flatnonzero(~free)] if blocked else (),
        units=(pose.arm.torque_unit(), pose.arm.torque_unit(worst)),
        hint=too_few_cables(pose.arm)
        if math.isinf(widening)
        else advice(pose.arm, force * F, force * low, force * high, free),
    )


def advice(
    arm: Manipulator, F: Array, low: Array, high: Array, among: NDArray[np.bool_] | None = None
) -> str:
    """Say which bounds to widen: of each cable at a bound, the argument, its own, or its law's.

    Tensions and bounds are (C,) [N]; ``among`` (C,) are the cables that count, default all. The
    text is such as "lower minimum, raise the maximum of cable1_1 itself", or empty.
    """
    near = OPTIMALITY * max(float(F.max()), 1.0)
    found: dict[str, list[str]] = {}
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
                found.setdefault(rule, []).append(cable.name)
    return ", ".join(rule.replace("%", listed(names)) for rule, names in found.items())


def too_few_cables(arm: Manipulator) -> str:
    """Return a sentence if the cables are too few to hold all joints anywhere, else nothing."""
    count = len(arm.cables)
    joints = arm.nv
    if count > joints:
        return ""
    if arm.has_springs:
        said = (
            f"{plural(count, 'cable')} and springs hold {plural(joints, 'joint')} only where they"
        )
        finds = "forward_statics(arm, tension=...) finds it (command: cdsm stiffness --tension)"
        return f"{said} come to rest: {finds}. "
    needed = f"cables only pull, so at least {joints + 1} are needed"
    return f"{plural(count, 'cable')} alone cannot hold {plural(joints, 'joint')}: {needed}. "


def is_infeasible(problem: Problem) -> bool:
    """Whether no tensions within the bounds balance the arm, by linear programming: slow."""
    return _nearest(problem)[1] > OPTIMALITY


def is_proved_infeasible(problem: Problem) -> bool:
    """Whether there is a quick proof that no tensions within the bounds balance the arm.

    With x = F − low ≥ 0, the residual r of min ‖A x − b‖ is a proof by Farkas: rᵀA ≤ 0 < rᵀb.
    Bounds above become equations x + s = high − low with slacks s ≥ 0.
    """
    from scipy.optimize import nnls  # slow to import

    A, b, low, high, *_ = problem
    b = b - A @ low
    upper = np.flatnonzero(high < np.inf)
    if upper.size:
        bounded = np.eye(low.size)[upper]
        none = np.zeros((b.size, upper.size))
        A = np.block([[A, none], [bounded, np.eye(upper.size)]])
        b = np.concatenate([b, (high - low)[upper]])
    try:
        x, missing = nnls(A, b)
    except RuntimeError:  # too many iterations
        return False
    r = b - A @ x
    work = r @ b
    most = abs(A).max(axis=0) * abs(r).max()
    proof = missing > _PROOF and work > _PROOF * (abs(r) @ abs(b))
    return bool(proof and ((r @ A) <= _ROUNDING * most).all())


def _nearest(problem: Problem) -> tuple[Array, float]:
    """Return the tensions (C,) [-] that miss the balance least, and the torque they miss [-]."""
    A, b, low, high, *_ = problem
    nv, count = A.shape
    # variables: F, then the positive and the negative part of the missing torque; HiGHS drops
    # entries below 1e-9, so each cable is scaled by its own largest moment arm
    lever = abs(A).max(axis=0)
    lever[lever == 0.0] = 1.0
    nearest = least(
        np.repeat([0.0, 1.0], [count, 2 * nv]),
        A_eq=np.hstack([A / lever, np.eye(nv), -np.eye(nv)]),
        b_eq=b,
        bounds=[*zip(low * lever, high * lever, strict=True), *[(0.0, None)] * (2 * nv)],
    )
    if nearest.status != OPTIMAL:  # it is feasible and bounded by construction
        raise solver_failed("highs", f"cannot tell whether tensions exist: {nearest.message}")
    return nearest.x[:count] / lever, float(nearest.fun)


def _widening(problem: Problem, free: NDArray[np.bool_]) -> float:
    """Compute how far the bounds of ``free`` cables (C,) must widen [N]; inf if nothing helps."""
    A, b, low, high, _, force = problem
    nv, count = A.shape
    # variables: F ≥ 0, then the widening t: low − t ≤ F ≤ high + t; a fixed tension does not widen
    rows = np.column_stack([np.vstack([-np.eye(count), np.eye(count)]), -1.0 * np.tile(free, 2)])
    sides = np.concatenate([-low, high])
    finite = np.isfinite(sides)
    balance = np.column_stack([A, np.zeros(nv)])
    widest = np.append(np.zeros(count), 1.0)
    found = least(widest, A_ub=rows[finite], b_ub=sides[finite], A_eq=balance, b_eq=b)
    return float(found.x[-1]) * force if found.status == OPTIMAL else math.inf

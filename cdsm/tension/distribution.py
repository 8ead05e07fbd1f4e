"""Tension distribution: the smallest cable tensions that balance the arm.

The balance (Eq. 17) does not determine the tensions of a redundant arm. As usual, the smallest are
chosen:

    min ½‖F‖²   subject to   J_Lᵀ F = J_Xᵀ W − g   and   minimum ≤ F ≤ maximum.

First, :mod:`cdsm.kernels.serpentine_guess` guesses the tensions. If the guess meets the optimality
conditions, as it usually does, it is the solution. Otherwise a solver solves the dimensionless
problem. If it finds no solution, :mod:`cdsm.tension.infeasibility` finds the reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.errors import InvalidInput
from cdsm.kernels import tension as tension_kernels
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.validation import (
    NO_WRENCH,
    bound,
    flag,
    instance,
    one_of,
    quantity,
    wrench_vector,
)
from cdsm.support.values import Array, frozen
from cdsm.tension.infeasibility import explain
from cdsm.tension.solvers import DEFAULT_SOLVER, solve
from cdsm.tension.value import Tension


def distribute_tension(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
    solver: str = DEFAULT_SOLVER,
    *,
    fixed: Mapping[str, float] | None = None,
    worst_friction: bool = False,
) -> Tension:
    """Compute the smallest tensions in balance: min ‖F‖² with J_Lᵀ F = J_Xᵀ W − g (Eqs. 13, 17).

    Args:
        pose: The posture.
        minimum: Lower bound [N], for all cables or (C,); not negative, since cables only pull.
            The default of the command line is 10 N, since a strand has no rigidity at 0 N.
        maximum: Upper bound [N], for all cables or (C,); inf: no bound. Bounds that a cable defines
            also apply.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        solver: ``"daqp"`` (exact), ``"osqp"``, or another solver that qpsolvers finds installed.
            The default is called only if a first guess does not meet the optimality conditions.
        fixed: Tensions [N] by cable name, e.g. of motors that control force. The other tensions are
            computed. A fixed tension replaces the bounds of its cable.
        worst_friction: Keep the tension of each segment of each cable within the bounds, for any
            earlier loads. With the friction coefficients μ and wrap angles φ of the holes of a
            cable, its tensions lie between F exp(−Σ μ φ) and F exp(Σ μ φ). The bounds narrow by
            these factors.

    Raises:
        InvalidInput: A bound, a fixed tension or the wrench has the wrong shape or is not a number,
            or a minimum is above its maximum, possibly after ``worst_friction`` has narrowed them.
        InfeasibleTension: No tension within the bounds balances the arm. The error gives the
            missing torque. If wider bounds help, it says how far the bounds of cables without a
            fixed tension must widen.
        UnknownName: The solver is not installed, or a fixed cable does not exist.
        SolverError: The solver's solution does not meet the optimality conditions.
    """
    instance("pose", pose, Posture)
    low, high = bounds_at(pose, minimum, maximum, worst_friction)
    fixed = {} if fixed is None else fixed
    if fixed:
        low, high = _with_fixed(pose, low, high, fixed)
    wrench = wrench_vector("wrench", wrench)
    length, certified = pose.arm.length, False
    if not certified:
        torque = pose.jacobian.T @ wrench - pose.gravity_torque
        scaled = tension_kernels.scaled_balance(pose.length_jacobian, torque, low, high, length)
        problem = tension_kernels.Scaled(*scaled)
        solution = solve(problem, solver)
        if isinstance(solution, str):
            free = np.array([cable.name not in fixed for cable in pose.arm.cables])
            explain(pose, problem, solver, solution, free)
        values = solution * problem.force
    return Tension(
        posture=pose,
        values=frozen(values),
        wrench=wrench,
        minimum=low,
        maximum=high,
        solver=solver,
    )


def bounds_at(
    pose: Posture, minimum: ArrayLike, maximum: ArrayLike, worst_friction: bool
) -> tuple[Array, Array]:
    """Check the bounds of the tensions at a posture; return lower and upper ones, (C,) [N] each.

    If ``worst_friction`` is True, they are narrowed as in :func:`distribute_tension`.
    """
    low, high = checked_bounds(pose.arm, minimum, maximum)
    if flag("worst_friction", worst_friction):
        loss = np.exp(grip(pose))
        low, high = checked_bounds(pose.arm, low * loss, high / loss)
    return low, high


def grip(pose: Posture) -> Array:
    """Compute Σ μ φ (C,) [-] over the holes of each cable: ln of its largest ratio of tensions.

    μ is the friction coefficient of a hole and φ its wrap angle.
    """
    chains, count = pose.segments.chains, len(pose.arm.cables)
    total = np.bincount(chains.cable[chains.hole], pose.segments.grip, minlength=count)
    return np.asarray(total, dtype=np.float64)


def checked_bounds(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, rows: int | None = None
) -> tuple[Array, Array]:
    """Check ``minimum`` and ``maximum``, narrow them to the bounds that cables define, return both.

    Each is (C,) [N]. With ``rows``, a bound may also have the shape (rows, C): one row per posture.
    Invalid bounds raise InvalidInput.
    """
    cables = arm.cables
    low = bound("minimum", minimum, len(cables), rows)
    high = bound("maximum", maximum, len(cables), rows)
    least, most = arm._laws.narrowed(low, high)
    if least is low and _ordered(minimum, maximum):
        return low, high
    allowed = (low >= 0.0) & (low < math.inf)
    if np.count_nonzero(allowed) < low.size:
        *row, c = np.argwhere(~allowed)[0].tolist()
        raise InvalidInput(
            "minimum",
            f"{low[(*row, c)]:g} N given for {_named(cables[c], row)}; cables only pull, so it "
            "must be finite and not negative.",
        )
    ordered = least <= most
    if np.count_nonzero(ordered) < ordered.size:
        at = tuple(np.argwhere(~ordered)[0].tolist())
        l0, l1, h0, h1 = (
            np.broadcast_to(each, ordered.shape)[at] for each in (low, least, high, most)
        )
        given, own = "given" if h1 == h0 else "of its own", l1 > l0
        raise InvalidInput(
            "maximum",
            f"{h1:g} N {given} for {_named(cables[at[-1]], at[:-1])}, below "
            f"{'its own' if own else 'its'} minimum of {l1:g} N; raise maximum or lower minimum.",
        )
    return least, most


def _ordered(minimum: object, maximum: object) -> bool:
    """Return whether both bounds are floats with 0 ≤ minimum ≤ maximum, minimum finite.

    In this usual case :func:`checked_bounds` skips its slower checks.
    """
    if not isinstance(minimum, float) or not isinstance(maximum, float):
        return False
    return 0.0 <= minimum <= maximum and minimum < math.inf


def _named(cable: Cable, row: Sequence[int]) -> str:
    return f"{cable.name} in row {row[0]}" if row else cable.name


def _with_fixed(
    pose: Posture, low: Array, high: Array, fixed: Mapping[str, float]
) -> tuple[Array, Array]:
    """Return the bounds (C,) [N]; for cables in ``fixed``, both are equal to the fixed tension."""
    if not isinstance(fixed, Mapping):
        raise InvalidInput("fixed", f"{fixed!r} given; give a dict of tensions [N] by cable.")
    names = [cable.name for cable in pose.arm.cables]
    low, high = low.copy(), high.copy()
    for name, value in fixed.items():
        c = names.index(one_of("cable", name, names))
        low[c] = high[c] = quantity(f"fixed[{name!r}]", value, "tension", zero=True)
    return frozen(low), frozen(high)

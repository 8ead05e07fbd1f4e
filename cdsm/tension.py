"""Tension distribution: the smallest cable tensions that balance the arm.

The balance (Eq. 17) does not determine the tensions of a redundant arm. As usual, the smallest are
chosen:

    min ½‖F‖²   so that   J_Lᵀ F = J_Xᵀ W − g   and   minimum ≤ F ≤ maximum.

The problem is made dimensionless before a solver gets it. A solution is accepted only if it meets
the optimality conditions. If there is none, :mod:`cdsm.infeasibility` says why.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from cdsm.cable import Cable
from cdsm.errors import InvalidInput, SolverError
from cdsm.infeasibility import explain, instead
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE, OPTIMALITY
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.format import aligned, key, plain, plural
from cdsm.support.tidy import data_frame
from cdsm.support.validation import bound, flag, instance, one_of, quantity, wrench_vector
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

DEFAULT_SOLVER: Final = "daqp"
"""Default solver of all tension distributions: exact, and the fastest in measurements."""

# with qpsolvers' defaults, these solvers miss OPTIMALITY by orders of magnitude; OSQP's polishing
# step can spoil a solution and still report success
_SETTINGS: dict[str, dict[str, Any]] = {
    "clarabel": {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11},
    "daqp": {"primal_tol": 1e-10},
    "osqp": {
        "eps_abs": 1e-10,
        "eps_rel": 1e-10,
        "max_iter": 100_000,
        "polish": False,
        "raise_error": False,
    },
    "piqp": {"eps_abs": 1e-11, "eps_rel": 1e-11},
    "proxqp": {"eps_abs": 1e-11, "eps_rel": 0.0},
}


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Tension(ReadOnlyState):
    """Cable tensions that balance an arm, with the data of their problem.

    A mapping from the name of a cable to its tension [N]: ``tension["cable1_1"]``,
    ``dict(tension)``, ``len(tension)``. :attr:`values` is the array, as in ``np.array(tension)``.

    Attributes:
        posture: The posture.
        values: F (C,) [N], in the order of ``posture.arm.cables``.
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m].
        minimum: Lower bounds (C,) [N].
        maximum: Upper bounds (C,) [N].
        solver: Name of the solver that found the tensions.
        residual: Residual J_Lᵀ F − (J_Xᵀ W − g) of Eq. 13, (nv,) [N m].
        least: Whether the tensions are the smallest; False if they were chosen for a stiffness.
    """

    posture: Posture
    values: Array
    wrench: Array
    minimum: Array
    maximum: Array
    solver: str
    residual: Array
    least: bool = True

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables, in the order of :attr:`values`."""
        return self.posture.arm.cables.names

    def items(self) -> tuple[tuple[str, float], ...]:
        """Return name and tension [N] of each cable."""
        return tuple(zip(self.keys(), self.values.tolist(), strict=True))

    def __getitem__(self, cable: str) -> float:
        """Return the tension of a cable [N].

        Raises:
            UnknownName: No cable has this name.
        """
        return dict(self.items())[one_of("cable", cable, self.keys())]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, cable: object) -> bool:
        return cable in self.keys()

    def __len__(self) -> int:
        return self.values.size

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype) if copy else np.asarray(self.values, dtype)

    @property
    def at_minimum(self) -> tuple[str, ...]:
        """Names of the cables at their lower bound."""
        return self._names(self.values - self.minimum)

    @property
    def at_maximum(self) -> tuple[str, ...]:
        """Names of the cables at their upper bound."""
        return self._names(self.maximum - self.values)

    def _names(self, distance: Array) -> tuple[str, ...]:
        tight = distance <= OPTIMALITY * self.values.max(initial=0.0)
        return tuple(self.posture.arm.cables[c].name for c in np.flatnonzero(tight))

    def plot(self) -> Figure:
        """Plot the arm in mm, its cables coloured by their tension [N]."""
        return self.posture.plot(self)

    def to_dict(self) -> dict[str, object]:
        """Return tensions, bounds and load in SI for JSON, with units in the keys; inf as None."""
        arm = self.posture.arm
        numbers = {
            **self.posture._coordinates,
            "tension_N": dict(self),
            "minimum_N": dict(zip(self, self.minimum, strict=True)),
            "maximum_N": dict(zip(self, self.maximum, strict=True)),
            "force_N": self.wrench[:3],
            "moment_Nm": self.wrench[3:],
            key("static_residual", arm.torque_unit()): self.residual,
            "solver": self.solver,
        }
        return dict(plain(numbers))

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table of tension and bounds [N], a row for each cable.

        Raises:
            MissingExtra: pandas is not installed.
        """
        columns = {
            "tension [N]": self.values,
            "minimum [N]": self.minimum,
            "maximum [N]": self.maximum,
        }
        return data_frame(columns, "cable", self.keys())

    def __repr__(self) -> str:
        return (
            f"<Tension {self.values.min():.4g} to {self.values.max():.4g} N in "
            f"{plural(self.values.size, 'cable')}>"
        )

    def __str__(self) -> str:
        rows = aligned([("cable", "tension [N]"), *((c, f"{F:.3f}") for c, F in self.items())])
        unit = self.posture.arm.torque_unit()
        return "\n".join([*rows, f"static residual: {abs(self.residual).max():.1e} {unit}"])


def distribute_tension(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    solver: str = DEFAULT_SOLVER,
    *,
    fixed: Mapping[str, float] | None = None,
    worst_friction: bool = False,
) -> Tension:
    """Compute the smallest tensions in balance: min ‖F‖² with J_Lᵀ F = J_Xᵀ W − g (Eqs. 13, 17).

    Args:
        pose: The posture.
        minimum: Lower bound [N], for all cables or (C,); not negative, since cables only pull.
        maximum: Upper bound [N], for all cables or (C,); inf: no bound. Bounds that a cable defines
            also apply.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        solver: ``"daqp"`` (exact), ``"osqp"``, or another solver that qpsolvers finds installed.
        fixed: Tensions [N] by cable name, e.g. of motors that control force. The other tensions are
            computed. A fixed tension replaces the bounds of its cable and is never widened.
        worst_friction: Keep each segment of each cable within the bounds, whatever loads came and
            went before. At this posture friction holds all tensions of a cable within
            exp(±Σ μ φ) of F, with the sum over its holes. The bounds narrow by these factors.

    Raises:
        InvalidInput: A bound, a fixed tension or the wrench has the wrong shape or is not a number,
            or the bounds contradict each other, also because of the worst friction.
        InfeasibleTension: No tension within the bounds balances the arm. The error gives the
            missing torque. If wider bounds help, it says how far the bounds of cables without a
            fixed tension must widen.
        UnknownName: The solver is not installed, or a fixed cable does not exist.
        SolverError: The solver's solution does not meet the optimality conditions.
    """
    instance("pose", pose, Posture)
    low, high = checked_bounds(pose.arm, minimum, maximum)
    if flag("worst_friction", worst_friction):
        loss = np.exp(_grip(pose))
        low, high = checked_bounds(pose.arm, low * loss, high / loss)
    fixed = {} if fixed is None else fixed
    if fixed:
        low, high = _with_fixed(pose, low, high, fixed)
    wrench = wrench_vector("wrench", wrench)
    torque = pose.jacobian.T @ wrench - pose.gravity_torque

    length = pose.arm.length
    scaled = tension_kernels.scaled_balance(pose.length_jacobian, torque, low, high, length)
    problem = tension_kernels.Scaled(*scaled)
    solution = _solve(problem, solver)
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
        residual=frozen(values @ pose.length_jacobian - torque),
    )


def _grip(pose: Posture) -> Array:
    """Compute Σ μ φ of the holes of each cable (C,) [-]."""
    segments = pose.segments
    chains = segments.chains
    grip = chains.friction * segments.wrap
    total = np.bincount(chains.cable[chains.hole], grip, minlength=len(pose.arm.cables))
    return np.asarray(total, dtype=np.float64)


def checked_bounds(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, rows: int | None = None
) -> tuple[Array, Array]:
    """Return valid bounds (C,) [N] of the tensions, including those that the cables define.

    With ``rows`` a bound may also have the shape (rows, C): one row per posture. Invalid bounds
    raise InvalidInput.
    """
    cables = arm.cables
    low = bound("minimum", minimum, len(cables), rows)
    high = bound("maximum", maximum, len(cables), rows)
    allowed = (low >= 0.0) & (low < math.inf)
    if np.count_nonzero(allowed) < low.size:
        *row, c = np.argwhere(~allowed)[0].tolist()
        raise InvalidInput(
            "minimum",
            f"{low[(*row, c)]:g} N given for {_named(cables[c], row)}; cables only pull, so it "
            "must be finite and not negative.",
        )
    least, most = arm._model.laws.narrowed(low, high)
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


def _named(cable: Cable, row: Sequence[int]) -> str:
    return f"{cable.name} in row {row[0]}" if row else cable.name


def _with_fixed(
    pose: Posture, low: Array, high: Array, fixed: Mapping[str, float]
) -> tuple[Array, Array]:
    """Return the bounds; for each fixed cable, minimum and maximum equal its fixed tension."""
    if not isinstance(fixed, Mapping):
        raise InvalidInput("fixed", f"{fixed!r} given; give a dict of tensions [N] by cable.")
    names = [cable.name for cable in pose.arm.cables]
    low, high = low.copy(), high.copy()
    for name, value in fixed.items():
        c = names.index(one_of("cable", name, names))
        low[c] = high[c] = quantity(f"fixed[{name!r}]", value, "tension", zero=True)
    return frozen(low), frozen(high)


def installed_solvers() -> list[str]:
    """Return the names of the solvers that are installed."""
    import qpsolvers  # slow to import

    return sorted(qpsolvers.available_solvers)


def installed_solver(solver: str) -> str:
    """Return the name of a solver; UnknownName if it is not installed."""
    return one_of("installed solver", solver, installed_solvers())


def _solve(problem: tension_kernels.Scaled, solver: str) -> Array | str:
    """Return the verified optimum, or the fault as text: no solution, or not the optimum."""
    import qpsolvers
    from scipy.sparse import csc_matrix

    installed_solver(solver)
    A, b, low, high, *_ = problem
    sparse = csc_matrix if solver in qpsolvers.sparse_solvers else np.asarray
    identity, nothing = np.eye(low.size), np.zeros(low.size)
    qp = qpsolvers.Problem(sparse(identity), nothing, A=sparse(A), b=b, lb=low, ub=high)
    settings = _SETTINGS.get(solver, {})
    try:
        if solver == "daqp":
            solution = qpsolvers.solve_problem(qp, solver, **settings)
        else:  # other solvers also report failure as warnings
            with warnings.catch_warnings(action="ignore"):
                solution = qpsolvers.solve_problem(qp, solver, **settings)
    except Exception as error:  # each solver has its own error types
        raise SolverError(solver, f"failed: {error}. {instead(solver)}") from error
    x = solution.x
    if not solution.found or x is None:
        return "found no solution"
    if solution.y is None or solution.z_box is None:
        raise SolverError(solver, f"returns no multipliers to verify it by. {instead(solver)}")
    point = tuple(np.asarray(each, dtype=np.float64) for each in (x, solution.y, solution.z_box))
    if not np.isfinite(point[0]).all():
        raise SolverError(solver, f"calls {x.tolist()} optimal. {instead(solver)}")
    if _shortfall(problem, point):
        # first-order and interior-point solvers end near the optimum, with known active bounds
        point = _polished(problem, point)
        shortfall = _shortfall(problem, point)
        if shortfall:
            return f"calls a point optimal that is not: {shortfall}"
    # after the check: near infeasibility, large multipliers make the last bit of x matter
    x, _, z = point
    return tension_kernels.onto_bounds(x, z, low, high, OPTIMALITY * max(1.0, float(abs(x).max())))


def _shortfall(problem: tension_kernels.Scaled, point: tuple[Array, ...]) -> str:
    """Return as text why a point and its multipliers are not the optimum; empty if they are."""
    # equal to qpsolvers' primal_residual, dual_residual and duality_gap, ten times faster
    primal, dual, gap = tension_kernels.single_optimality(*problem[:4], *point)
    size = max(1.0, float(abs(point[0]).max()))
    distance = math.sqrt(2.0 * gap)  # ½‖x − x*‖² is at most the gap
    if max(primal, dual) <= OPTIMALITY * size and distance <= DISTANCE * size:
        return ""
    return (
        f"balance and bounds are missed by {primal / size:.1e}, stationarity by {dual / size:.1e} "
        f"({OPTIMALITY:g} is allowed), and the optimum may be {distance / size:.1e} away "
        f"({DISTANCE:g} is allowed; all dimensionless)"
    )


def _polished(problem: tension_kernels.Scaled, point: tuple[Array, ...]) -> tuple[Array, ...]:
    """Solve the optimality conditions exactly for the bounds that a near-optimum makes active."""
    A, b, low, high, *_ = problem
    x, _, z = point
    at_low, at_high = x - low < -z, high - x < z
    free = ~(at_low | at_high)
    x = np.where(at_low, low, np.where(at_high, high, 0.0))
    x[free] = np.linalg.lstsq(A[:, free], b - A @ x, rcond=None)[0]
    y = np.asarray(np.linalg.lstsq(A[:, free].T, -x[free], rcond=None)[0], dtype=np.float64)
    z = -x - y @ A
    z[free] = 0.0
    return x, y, z

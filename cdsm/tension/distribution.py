"""Tension distribution: the smallest cable tensions that balance the arm."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from cdsm.applied import Applied, Loaded, required_torque
from cdsm.assembly import Assembly
from cdsm.cable import breaking_forces, largest_share
from cdsm.errors import InvalidInput, solver_failed
from cdsm.loads import LoadsLike, loads_of
from cdsm.motors import needs_assembly
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.format import aligned, merged
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import NO_WRENCH, instance, one_of
from cdsm.support.values import Array, IndexedByName, draw, frozen
from cdsm.tension.assembled import assembled_tensions
from cdsm.tension.bounds import Bounds, bounds_at
from cdsm.tension.infeasibility import infeasible
from cdsm.tension.least_tensions import least_tensions
from cdsm.tension.solvers import DEFAULT_SOLVER, OPTIMALITY, nondimensional

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tension(Result, Loaded, IndexedByName):
    """Cable tensions that balance an arm, with the posture, load and bounds they were computed for.

    The keys are the names of the cables: ``tension["cable1_1"]`` [N], ``dict(tension)``. Use the
    array :attr:`values`, equal to ``np.array(tension)``, to index by number.

    Attributes:
        posture: The posture.
        values: F (C,) [N], in the order of ``posture.arm.cables``.
        applied: What acts: W (6,) at the tip, or loads on links.
        minimum: Lower bounds (C,) [N] that were asked for.
        maximum: Upper bounds (C,) [N] that were asked for; inf for none.
        minimum_held: Lower bounds (C,) [N] that held: narrowed by the cables' own, by
            ``worst_friction``, by ``fixed`` and, in plans, by the laws.
        maximum_held: Upper bounds (C,) [N] that held; inf for none.
        solver: Name of the solver that computed them.
        least: Whether they are the smallest tensions within the bounds; False if they were planned
            for a stiffness.
        assembly: The assembly whose motors give them; None: they have free choice.
        commands: What its motors are told (M,), in the order of ``arm.motors``: turns [rad], or
            torques [N m]; of a cable's own motor wire [m], or tension [N].

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> round(F["cable1_1"], 3), len(F.at_minimum)
        (33.132, 5)
    """

    _headline = "tension"
    _rows = "cable"

    posture: Posture
    values: Array = field(metadata=unit("N", "cable", name="tension"))
    applied: Applied
    minimum: Array = field(metadata=unit("N", "cable"))
    maximum: Array = field(metadata=unit("N", "cable"))
    minimum_held: Array = field(metadata=unit("N", "cable"))
    maximum_held: Array = field(metadata=unit("N", "cable"))
    solver: str = field(metadata=unit("1"))
    least: bool = True
    assembly: Assembly | None = None
    commands: Array | None = None

    @quantity("torque", "joint")
    def residual(self) -> Array:
        """Residual `J_Lᵀ F − (J_Xᵀ W − g)` of Eq. 13, (nv,) [N m]."""
        torque = self.values @ self.posture.length_jacobian
        return frozen(torque - required_torque(self.posture, self.applied))

    @quantity("1", "cable")
    def breaking_share(self) -> Array:
        """Tension over the least breaking force of the rope (C,) [-]; NaN for wires without one."""
        return frozen(self.values / breaking_forces(self.posture.arm.cables))

    def keys(self) -> tuple[str, ...]:
        """Return the names of the cables, in the order of :attr:`values`."""
        return self.posture.arm.cables.names

    def __getitem__(self, cable: str) -> float:
        """Return the tension of a cable [N]; InvalidInput if there is no such cable."""
        remedy = "" if isinstance(cable, str) else "By index there is the array tension.values."
        return float(self.values[self.keys().index(one_of("cable", cable, self.keys(), remedy))])

    def __len__(self) -> int:
        return self.values.size

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.values, dtype) if copy else np.asarray(self.values, dtype)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence if motors move several cables, and cannot give all of these tensions."""
        motors = self.posture.arm.motors
        return () if motors.are_free or self.assembly else (needs_assembly(motors),)

    @property
    def at_minimum(self) -> tuple[str, ...]:
        """Names of the cables at the lower bound that held."""
        return self._names(self.values - self.minimum_held)

    @property
    def at_maximum(self) -> tuple[str, ...]:
        """Names of the cables at the upper bound that held."""
        return self._names(self.maximum_held - self.values)

    def _names(self, distance: Array) -> tuple[str, ...]:
        tight = distance <= OPTIMALITY * self.values.max(initial=0.0)
        return tuple(self.keys()[c] for c in np.flatnonzero(tight))

    def to_dict(self) -> dict[str, object]:
        """Return all numbers in SI for JSON, commands of motors, and warnings if there are any."""
        more: dict[str, object] = {"warnings": [*self.warnings]} if self.warnings else {}
        if self.commands is not None:
            more |= self.posture.arm.motors.described(self.commands)
        return merged(super().to_dict(), more)

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the tension [N] of each cable as a bar, with its bounds, and return the axes.

        Other options are those of :func:`cdsm.plots.plot_tensions`. ``pose.plot(F)`` draws the arm.
        """
        axes: Axes = draw("plot_tensions", self, ax, **options)
        return axes

    def __str__(self) -> str:
        rows = aligned([("cable", "tension [N]"), *((c, f"{self[c]:.3f}") for c in self)])
        unit = self.posture.arm.torque_unit()
        rows += [share] if (share := largest_share(self.posture.arm.cables, self.values)) else []
        if self.commands is not None:
            rows.append(self.posture.arm.motors.commanded(self.commands))
        rows.append(f"static residual: {abs(self.residual).max():.1e} {unit}")
        return "\n".join([*self.warnings, *rows])


def distribute_tension(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
    solver: str = DEFAULT_SOLVER,
    *,
    fixed: Mapping[str, float] | None = None,
    worst_friction: bool = False,
    assembly: Assembly | None = None,
) -> Tension:
    """Compute the least tensions in balance: `min ½‖F‖²`, `J_Lᵀ F = J_Xᵀ W − g` (Eqs. 13, 17).

    Args:
        pose: The posture.
        minimum: Lower bound [N], for all cables or (C,); not negative, since cables only pull.
        maximum: Upper bound [N], for all cables or (C,); inf: no bound. A cable's own also apply.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Or loads on any
            links: a dict of wrenches (6,) by link, or a list of :class:`~cdsm.Load`.
        solver: Any solver that qpsolvers finds installed; every solution is verified.
        fixed: Tensions [N] by cable name, e.g. of motors that control force. They replace the
            bounds of their cables; the other tensions are computed.
        worst_friction: Keep the tension of each segment within the bounds, for any earlier loads:
            between `F exp(−Σ μ φ)` and `F exp(Σ μ φ)`, with the friction coefficients μ and wrap
            angles φ of the holes of its cable. The bounds of F narrow by these factors.
        assembly: Wires with the motors at 0, of :meth:`Manipulator.assemble`. The tensions are then
            the least that its M motors give, `F = f(L; l_0 − B φ)`, with ``commands`` φ. Without
            it, each cable has the wire that its tension needs: motors that are fewer than cables
            have it only if the arm was assembled for this posture, as the result says.

    Raises:
        InvalidInput: An argument has the wrong shape or is not a number, or a minimum is above its
            maximum, possibly after ``worst_friction`` has narrowed them. The solver is not
            installed, or a fixed cable does not exist.
        InfeasibleTension: No tension within the bounds balances the arm. The error gives the
            missing torque, and how far the bounds of cables without a fixed tension must widen. Or
            the motors of the assembly give none of them.
        CdsmError: The solver's solution does not meet the optimality conditions.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0, wrench=[0, -5, 0, 0, 0, 0])
        >>> F.values.round(1).tolist()
        [39.5, 5.0, 6.0, 36.5, 5.0, 17.5, 28.4, 5.0, 22.0, 18.6, 5.0, 20.3, 10.4, 5.0, 14.7]
    """
    instance("pose", pose, Posture)
    tensions = {} if fixed is None else fixed
    if not isinstance(tensions, Mapping):
        raise InvalidInput("fixed", f"{fixed!r} given; give a dict of tensions [N] by cable.")
    bounds = bounds_at(pose, minimum, maximum, worst_friction, fixed=tensions)
    load = loads_of(pose.arm, wrench)
    if assembly is not None:
        instance("assembly", assembly, Assembly).require_arm(pose)
        F, commands = assembled_tensions(
            pose, assembly, bounds, required_torque(pose, load), solver
        )
        given: Any = {"assembly": assembly, "commands": commands, **bounds._asdict()}
        return Tension(posture=pose, values=F, applied=load, solver=solver, **given)
    return least_tension(pose, bounds, load, solver, tuple(tensions))


def least_tension(
    pose: Posture,
    bounds: Bounds,
    wrench: Applied,
    solver: str = DEFAULT_SOLVER,
    fixed: Collection[str] = (),
) -> Tension:
    """Compute the least tensions in balance within ``bounds``, as :func:`distribute_tension` does.

    ``fixed`` names the cables whose bounds are a fixed tension.
    """
    torque = required_torque(pose, wrench)
    low = bounds.minimum_held
    high = bounds.maximum_held
    problem = nondimensional(pose.length_jacobian, torque, low, high, pose.arm.length)
    solution = least_tensions(problem, solver)
    if solution.status is Status.INFEASIBLE:
        free = np.array([name not in fixed for name in pose.arm.cables.names])
        raise infeasible(pose, problem, free)
    if not solution.ok:
        raise solver_failed(solver, solution.message)
    F = frozen(solution.x * problem.force)
    return Tension(posture=pose, values=F, applied=wrench, solver=solver, **bounds._asdict())

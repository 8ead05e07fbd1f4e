"""Errors of mechanics: no balance, no stiffness, no equilibrium, unreachable requests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cdsm.errors.base import CdsmError, named
from cdsm.support.format import coordinates, distinct_texts, rounded

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class ElasticityRangeError(CdsmError, ValueError):
    """A tension at which the elasticity is not defined.

    Attributes:
        problem: The fault, as text.
        tension: The invalid tensions [N]; empty if the error is about a strain or an elongation
            that no tension gives.
        indices: Indices of these tensions, strains or elongations in the input array.
        cables: Names of the cables with these tensions; empty if no cable is known.
    """

    def __init__(
        self,
        problem: str,
        tension: Sequence[float] = (),
        indices: Sequence[int] = (),
        cables: Sequence[str] = (),
    ) -> None:
        self.problem = problem
        self.tension = tuple(float(value) for value in tension)
        self.indices = tuple(int(index) for index in indices)
        self.cables = tuple(cables)
        names = f"cable {named(self.cables)}" if self.cables else ""
        values = f"tension {named(distinct_texts(self.tension))} N" if self.tension else ""
        where = f"{values} ({names})" if values and names else values or names
        super().__init__(f"{where}: {problem}" if where else problem)


class InfeasibleTension(CdsmError):
    """No cable tension within the bounds balances the arm at this posture.

    Attributes:
        missing: Torque that the cables cannot balance, (nv,) [N m] ([N] for prismatic joints), at
            the tensions within the bounds that minimise Σ|missing|.
        joint: Name of the joint with the largest missing torque.
        relaxation: Least amount by which the bounds of all cables without a fixed tension must be
            widened to make the problem feasible [N]; inf if this is not possible.
        binding: Names of the cables without a fixed tension that are at a bound at these tensions.
        fixed: Names of the cables with fixed tensions, if these make the problem infeasible; else
            empty.
    """

    def __init__(
        self,
        missing: NDArray[np.float64],
        joint: str,
        relaxation: float,
        binding: Sequence[str],
        units: tuple[str, str] = ("N m", "N m"),
        fixed: Sequence[str] = (),
    ) -> None:
        self.missing = missing
        self.joint = joint
        self.relaxation = relaxation
        self.binding = tuple(binding)
        self.fixed = tuple(fixed)
        total = float(abs(missing).sum())
        worst = float(abs(missing).max())
        message = (
            f"no tension within the bounds balances the arm: {total:.4g} {units[0]} are "
            f"missing, most of it ({worst:.4g} {units[1]}) at {joint}. "
        )
        if fixed:
            message += (
                f"Beside the fixed tensions no bounds of the other cables help: change or free "
                f"{', '.join(fixed)}."
            )
        elif relaxation == float("inf"):
            message += (
                "No bounds would help: the cables cannot exert this torque at all. Change the "
                "posture, the load, or the routing (in Python, print(pose.moment_arms))."
            )
        else:
            message += (
                f"Widening every bound by {rounded(relaxation, up=True)} N would be enough "
                f"(cables at a bound: {', '.join(self.binding) or 'none'}). Lower minimum=, raise "
                "maximum=, or reduce the load."
            )
        super().__init__(message)


class SolverError(CdsmError):
    """A quadratic-programming solver returned a result that is not the optimum.

    Attributes:
        solver: Name of the solver.
    """

    def __init__(self, solver: str, problem: str) -> None:
        super().__init__(f"solver {solver!r} {problem}")
        self.solver = solver


class SingularStiffness(CdsmError, ArithmeticError):
    """A stiffness or compliance matrix that does not exist at this posture.

    Attributes:
        direction: Unit vector: the joint motion (nv,) with the least stiffness, or the direction
            (3,) in base axes in which the tip cannot move.
    """

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class SingularMass(CdsmError, ArithmeticError):
    """A joint motion that moves no mass and therefore has no natural frequency.

    Attributes:
        direction: The joint motion (nv,), unit length.
    """

    def __init__(self, problem: str, direction: NDArray[np.float64]) -> None:
        super().__init__(problem)
        self.direction = direction


class EquilibriumError(CdsmError, ArithmeticError):
    """A loaded arm that has no equilibrium, or that buckles before the full load.

    Attributes:
        residual: Torque residual at the last iterate (nv,) [N m]; [N] for prismatic joints.
        load_factor: Largest fraction of the load [-] at which the arm was in equilibrium.
        joint: Name of the joint with the largest residual, or of the joint that buckles first.
    """

    def __init__(
        self,
        problem: str,
        residual: NDArray[np.float64],
        load_factor: float,
        joint: str,
        remedy: str = "Reduce the load, or stiffen the arm: raise the tensions, or take stiffer "
        "cables or springs.",
    ) -> None:
        super().__init__(f"{problem}. {remedy}")
        self.residual = residual
        self.load_factor = load_factor
        self.joint = joint


class UnreachableStiffness(CdsmError):
    """A stiffness that no admissible cable tensions give.

    Attributes:
        direction: u (3,), unit length, base axes.
        target: Wanted stiffness [N/m].
        low: Smallest attainable stiffness along u [N/m].
        high: Largest attainable stiffness along u [N/m]; inf if it has no upper bound.
        nearest: Attainable stiffness nearest to the target [N/m]: ``low`` or ``high``, or the
            nearest values found below and above the target.
    """

    def __init__(
        self,
        direction: NDArray[np.float64],
        target: float,
        low: float,
        high: float,
        nearest: Sequence[float],
    ) -> None:
        self.direction = direction
        self.target = target
        self.low = low
        self.high = high
        self.nearest = tuple(float(value) for value in nearest)
        wanted, least, most, *near = distinct_texts(
            [value / 1e3 for value in (target, low, high, *self.nearest)]
        )
        message = (
            f"no admissible tensions give {wanted} N/mm along {coordinates(direction)}: the range "
            f"is {least} to {most} N/mm"
        )
        if low <= target <= high:
            message += (
                f", but the nearest found is {' and '.join(near)} N/mm. Raise starts=, ask for one "
                "of these, or change the bounds or the posture."
            )
        else:
            message += (
                ". Ask for a stiffness within it, or widen it: change minimum=, maximum=, "
                "the load or the posture, or take other cables."
            )
            if low <= 1e3 * target <= high:
                message += " It looks as if the target is in N/mm: give it in N/m."
        super().__init__(message)


class InfeasibleDesign(CdsmError):
    """No design that a search tried meets all constraints of its problem.

    Attributes:
        constraints: Names of the constraints that the nearest design violates; the name ``held``
            means that at some postures the arm cannot be balanced or is unstable.
        design: The nearest design, the one with the smallest sum of violations, as one number for
            each variable; empty if no design gives a valid arm.
    """

    def __init__(self, message: str, constraints: Sequence[str], design: Sequence[float]) -> None:
        self.constraints = tuple(constraints)
        self.design = tuple(design)
        super().__init__(message)

"""Compute the quantities of one design over all postures and loads of a problem."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.batch import Batch, evaluate
from cdsm.design.goals import KINDS, Measure
from cdsm.design.problem import SURE, DesignProblem
from cdsm.errors import CdsmError, CdsmWarning, GeometryError
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS as CLEARANCES
from cdsm.measures.indices import principal_stiffness
from cdsm.measures.rows import force_radii, friction_losses, measured, narrowed_bounds, payloads
from cdsm.stiffness_matrix import stiffness
from cdsm.support.status import Status
from cdsm.support.values import Array
from cdsm.tension import distribute_tension
from cdsm.tolerancing.budget import propagate
from cdsm.tolerancing.measurand import Measurand, MeasurandName

_MEASURANDS: Final[dict[str, MeasurandName]] = {
    "stiffness": "along",
    "margin": "margin",
    "motor_force": "tension",
}
_OUTPUTS = ("tip", "tension", "margin", "compliance", "cable_lengths")


class Found(NamedTuple):
    """Quantities of one design, in SI: ``values`` (m,).

    ``fault`` is the reason why no arm can be built from the design, or empty.
    """

    values: Array
    fault: str = ""


def measure(problem: DesignProblem, row: Array) -> Found:
    """Compute the quantities of one design ``row`` (n,), in the order of ``problem.measures``."""
    return measure_cases(problem, row, ())[0]


def measure_cases(
    problem: DesignProblem, row: Array, goals: Sequence[Measure]
) -> tuple[Found, list[Array] | None]:
    """Compute the quantities of a design, and each of ``goals`` at all postures and loads.

    A goal that has a margin for tolerances has it everywhere. The list is None if no arm can be
    built from the design, or if one posture is not held.
    """
    try:
        arm = quiet_arm(problem, row)
    except CdsmError as error:
        fault = "; ".join(error.faults) if isinstance(error, GeometryError) else str(error)
        return Found(np.full(len(problem.measures), math.nan), fault), None
    found = _Arm(problem, arm, problem.minimum_of(row))
    values = np.array([found.value(each) for each in problem.measures])
    return Found(values), [found.sure(each) for each in goals] if found.held.all() else None


def quiet_arm(problem: DesignProblem, design: Array) -> Manipulator:
    """Build the arm of a design (n,) without warnings, such as that cables share a hole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        return problem._made(design)


class _Arm:
    """An arm with all pairs of posture and load: ``held`` says which are balanced and stable."""

    def __init__(self, problem: DesignProblem, arm: Manipulator, minimum: float) -> None:
        self.problem, self.arm = problem, arm
        self.postures = problem.postures_of(arm)
        count = len(problem.loads)
        self.q = np.repeat(self.postures, count, axis=0)
        self.loads = np.tile(problem.loads, (len(self.postures), 1))
        self.loss = np.ones((len(self.q), len(arm.cables)))
        if problem.worst_friction:
            self.loss = np.repeat(friction_losses(arm, self.postures), count, axis=0)
        self.low, self.high, exist = narrowed_bounds(arm, minimum, problem.maximum, self.loss)
        self.found, stable = self._evaluated(self.loads)
        self.held = exist & stable
        self.margins: dict[tuple[str, int], Array] = {}

    def _evaluated(self, loads: Array) -> tuple[Batch, NDArray[np.bool_]]:
        """Evaluate all postures under ``loads`` (R, 6); also return which are stable (R,)."""
        bounds: Any = {"minimum": self.low, "maximum": self.high}
        found = evaluate(self.arm, self.q, None, loads, _OUTPUTS, threads=1, **bounds)
        known = np.isin(found.status, (Status.OK, Status.IMMOBILE))
        return found, known & (found["margin"] > 0.0)

    @cached_property
    def of_pose(self) -> dict[str, Array]:
        """Quantities of the postures alone that are held under a load, those of the problem."""
        wanted = {each.of for each in self.problem.measures} & {*CLEARANCES, "tension_factor"}
        inside = self.held.reshape(len(self.postures), -1).any(axis=1)
        return measured(self.arm, self.postures[inside], sorted(wanted), self.problem.diameter)

    def cases(self, each: Measure) -> Array:
        """Return a quantity in SI (n, k) for each held posture and load; k = 1.

        For ``motor_force``, k counts the cables. What depends on neither is one case.
        """
        held, geometry = self.held, self.arm.geometry
        C = self.found["compliance"][held][:, :3, :3]
        bounds = self.q[held], self.loads[held], self.low[held], self.high[held]
        u = np.array(each.direction)
        match each.of:
            case "mass":
                found = np.array([sum(link.mass for link in geometry.links)])
            case "length":
                found = np.array([geometry.length])
            case "wire_length":
                found = self.found["cable_lengths"][held].max(axis=0).sum(keepdims=True)
            case "stiffness":
                with np.errstate(divide="ignore"):
                    found = 1.0 / np.maximum(np.einsum("i,nij,j->n", u, C, u), 0.0)
            case "deflection":
                bare, stable = self._evaluated(np.zeros_like(self.loads))
                C, forces = bare["compliance"][:, :3, :3], self.loads[:, :3, None]
                moved = np.linalg.norm((C @ forces)[..., 0], axis=1)
                found = np.where(stable, moved, math.inf)[held]
            case "margin":
                found = self.found["margin"][held]
            case "softest":
                found = principal_stiffness(C)["softest"]
            case "payload":
                found = payloads(self.arm, *bounds, u[None])[:, 0]
            case "force_radius":
                found = force_radii(self.arm, *bounds)
            case "motor_force":
                return np.asarray(self.found["tension"][held] * self.loss[held])
            case _:
                found = self.of_pose[each.of]
        return found[:, None]

    def sure(self, each: Measure) -> Array:
        """Return :meth:`cases` with the margin for tolerances of each, if the quantity has one."""
        found = self.cases(each)
        if self.problem.has_margin(each):
            found = found + [self._margin(each, case) for case in range(len(found))]
        return found

    def value(self, each: Measure) -> float:
        """Return the worst case of a quantity; NaN if no posture is held."""
        if each.of == "held":
            return float(self.held.mean())
        if each.of == "workspace":
            return _volume(self.found["tip"][self.held][:, :3, 3])
        if not self.held.any() and each.of not in ("mass", "length"):
            return math.nan
        found = self.cases(each)
        worst = found.argmax() if KINDS[each.of].best == "least" else found.argmin()
        case, cable = divmod(int(worst), found.shape[1])
        extra = self._margin(each, case)[cable] if self.problem.has_margin(each) else 0.0
        return float(found[case, cable] + extra)

    def _margin(self, each: Measure, case: int) -> Array:
        """Compute the margin for tolerances (k,) of a quantity in one case, ± coverage · u.

        The sign is that for which adding the margin makes the quantity worse. The arm is not built
        yet: its tensions are the least ones of its dimensions, within bounds that do not change.
        """
        if (each.key, case) not in self.margins:
            n, of = int(np.flatnonzero(self.held)[case]), _MEASURANDS[each.of]
            pose = self.arm.at(self.q[n])
            pull = distribute_tension(pose, self.low[n], self.high[n], self.loads[n])
            u = None if each.direction is None else np.array(each.direction)
            tolerances, loss = self.problem.tolerances, self.loss[n] if of == "tension" else 1.0
            assert tolerances is not None
            measurand = Measurand(of, stiffness(pose, pull), u, redistribute=True)
            variances, *_ = propagate(measurand, measurand.inputs.groups(tolerances), {})
            found = np.sqrt(sum(variances.values(), 0.0 * measurand.value()))
            self.margins[each.key, case] = SURE[each.of] * self.problem.coverage * loss * found
        return self.margins[each.key, case]


def _volume(tips: Array) -> float:
    """Return the volume [m³] of the convex hull of tips (n, 3) [m]; 0 if they are coplanar."""
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    try:
        return float(ConvexHull(tips).volume)
    except (QhullError, ValueError):
        return 0.0

"""Compute the quantities of one design over all postures and loads of a problem."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.batch import Batch, evaluate
from cdsm.design.goals import KINDS, Measure
from cdsm.design.problem import DesignProblem
from cdsm.errors import CdsmError, CdsmWarning, GeometryError
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS as CLEARANCES
from cdsm.measures.rows import (
    force_radii,
    friction_losses,
    measured,
    narrowed_bounds,
    payloads,
)
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.principal import principal_stiffness
from cdsm.support.status import Status
from cdsm.support.values import Array
from cdsm.tension import distribute_tension
from cdsm.tolerancing.budget import propagate
from cdsm.tolerancing.measurand import Measurand, MeasurandName

_SURE: dict[str, tuple[MeasurandName, float]] = {
    "stiffness": ("along", -1.0),
    "margin": ("margin", -1.0),
    "motor_force": ("tension", 1.0),
}
"""For each quantity with a margin: the measurand that it is, and the margin's sign."""


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
    found = _Arm(problem, row, arm)
    held = found.held.all()
    return Found(found.values()), [found.sure(each) for each in goals] if held else None


def quiet_arm(problem: DesignProblem, design: Array) -> Manipulator:
    """Build the arm of a design (n,) without warnings, such as that cables share a hole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        return problem.arm_of(design)


class _Arm:
    def __init__(self, problem: DesignProblem, row: Array, arm: Manipulator) -> None:
        self.problem, self.arm = problem, arm
        q = problem.postures_of(arm)
        self.q = np.repeat(q, len(problem.loads), axis=0)
        self.loads = np.tile(problem.loads, (len(q), 1))
        loss = np.ones((len(q), len(arm.cables)))
        if problem.worst_friction:
            loss = friction_losses(arm, q)
        self.loss = np.repeat(loss, len(problem.loads), axis=0)
        self.low, self.high, held = narrowed_bounds(
            arm, problem.minimum_of(row), problem.maximum, self.loss
        )
        self.found, stable = self._evaluated(self.loads)
        self.held = held & stable
        self.margins: dict[tuple[str, int], Array] = {}
        self.of_pose: dict[str, Array] = {}
        wanted = {each.of for each in problem.measures} & {*CLEARANCES, "tension_factor"}
        if wanted:
            inside = self.held.reshape(len(q), -1).any(axis=1)
            self.of_pose = measured(arm, q[inside], sorted(wanted), problem.diameter)

    def _evaluated(self, loads: Array) -> tuple[Batch, NDArray[np.bool_]]:
        """Compute tip, tensions, margin, compliance and lengths for R pairs of posture and load.

        Also return which pairs are stable (R,). ``loads`` (R, 6) [N, N m] replaces the loads of the
        problem.
        """
        found = evaluate(
            self.arm,
            self.q,
            None,
            loads,
            ["tip", "tension", "margin", "compliance", "cable_lengths"],
            minimum=self.low,
            maximum=self.high,
            threads=1,
        )
        known = np.isin(found.status, (Status.OK, Status.IMMOBILE))
        return found, known & (found["margin"] > 0.0)

    def values(self) -> Array:
        return np.array([self._value(each) for each in self.problem.measures])

    def cases(self, each: Measure) -> Array:
        """Return a quantity in SI (n, k) for each held posture and load; k = 1.

        They are held if tensions within the bounds balance the arm, and the arm is stable. For
        ``motor_force``, k counts the cables. What depends on neither is one case.
        """
        held, links = self.held, self.arm.geometry.links
        C = self.found["compliance"][held][:, :3, :3]
        bounds = self.q[held], self.loads[held], self.low[held], self.high[held]
        match each.of:
            case "mass":
                found = np.array([sum(link.mass for link in links)])
            case "length":
                found = np.array([self.arm.geometry.length])
            case "stiffness":
                u = np.array(each.direction)
                with np.errstate(divide="ignore"):
                    found = 1.0 / np.maximum(np.einsum("i,nij,j->n", u, C, u), 0.0)
            case "deflection":
                unloaded, stable = self._evaluated(np.zeros_like(self.loads))
                moved = np.einsum(
                    "nij,nj->ni", unloaded["compliance"][:, :3, :3], self.loads[:, :3]
                )
                found = np.where(stable, np.linalg.norm(moved, axis=1), math.inf)[held]
            case "margin":
                found = self.found["margin"][held]
            case "softest":
                found = principal_stiffness(C)["softest"]
            case "payload":
                found = payloads(self.arm, *bounds, np.array(each.direction)[None])[:, 0]
            case "force_radius":
                found = force_radii(self.arm, *bounds)
            case _:
                return np.asarray(self.found["tension"][held] * self.loss[held])
        return found[:, None]

    def sure(self, each: Measure) -> Array:
        """Return :meth:`cases` with the margin for tolerances of each, if the quantity has one."""
        found = self.cases(each)
        if has_margin(self.problem, each):
            found = found + [self._margin(each, case) for case in range(len(found))]
        return found

    def _value(self, each: Measure) -> float:
        held = self.held
        if each.of == "held":
            return float(held.mean())
        if each.of == "workspace":
            return _volume(self.found["tip"][held][:, :3, 3])
        if not held.any() and each.of not in ("mass", "length"):
            return math.nan
        if each.of in self.of_pose:
            return float(self.of_pose[each.of].min())
        if each.of == "wire_length":
            return float(self.found["cable_lengths"][held].max(axis=0).sum())
        found = self.cases(each)
        worst = found.argmax() if KINDS[each.of].best == "least" else found.argmin()
        case, cable = divmod(int(worst), found.shape[1])
        extra = self._margin(each, case)[cable] if has_margin(self.problem, each) else 0.0
        return float(found[case, cable] + extra)

    def _margin(self, each: Measure, case: int) -> Array:
        """Compute the margin for tolerances (k,) of a quantity in one case, ± coverage · u.

        The sign is that for which adding the margin makes the quantity worse. The arm is not built
        yet: its tensions are the least ones of its dimensions, within bounds that do not change.
        """
        if (each.key, case) not in self.margins:
            n, (of, sign) = int(np.flatnonzero(self.held)[case]), _SURE[each.of]
            bounds, pose = (self.low[n], self.high[n]), self.arm.at(self.q[n])
            K = stiffness(pose, distribute_tension(pose, *bounds, self.loads[n]))
            u = None if each.direction is None else np.array(each.direction)
            tolerances, loss = self.problem.tolerances, self.loss[n] if of == "tension" else 1.0
            assert tolerances is not None
            measurand = Measurand(of, K, u, redistribute=True)
            variances, *_ = propagate(measurand, measurand.inputs.groups(tolerances), {})
            found = np.sqrt(sum(variances.values(), 0.0 * measurand.value()))
            self.margins[each.key, case] = sign * self.problem.coverage * loss * found
        return self.margins[each.key, case]


def has_margin(problem: DesignProblem, each: Measure) -> bool:
    """Whether a quantity has a margin for tolerances.

    It has one if a constraint is on it, the problem has tolerances, and the quantity is
    ``stiffness``, ``margin`` or ``motor_force``.
    """
    bounded = any(constraint.key == each.key for constraint in problem.constraints)
    return bounded and problem.tolerances is not None and each.of in _SURE


def with_margin(problem: DesignProblem, each: Measure, words: str) -> str:
    """Return ``words``, the name of a quantity, followed by its margin if it has one.

    For example, the result is ``stiffness - 2 u``.
    """
    if not has_margin(problem, each):
        return words
    return f"{words} {'+' if _SURE[each.of][1] > 0.0 else '-'} {problem.coverage:g} u"


def _volume(tips: Array) -> float:
    """Return the volume [m³] of the convex hull of tips (n, 3) [m]; 0 if they are coplanar."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(tips).volume)
    except (QhullError, ValueError):
        return 0.0

"""Compute the quantities of one design over all postures and loads of a problem."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
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
from cdsm.stiffness_matrix.principal import principal_stiffness
from cdsm.support.status import Status
from cdsm.support.values import Array
from cdsm.tension import Tension, distribute_tension, grip
from cdsm.uncertainties.budget import uncertainty
from cdsm.uncertainties.readings import Reading

_SURE: dict[str, tuple[Reading, float]] = {
    "stiffness": ("along", -1.0),
    "margin": ("margin", -1.0),
    "motor_force": ("tension", 1.0),
}
"""For each quantity with a margin: the reading with this uncertainty, and the margin's sign."""


class Found(NamedTuple):
    """Quantities of one design, in SI: ``values`` (m,).

    ``fault`` is the reason why no arm can be built from the design, or empty.
    """

    values: Array
    fault: str = ""


def measure(problem: DesignProblem, row: Array) -> Found:
    """Compute the quantities of one design ``row`` (n,), in the order of ``problem.measures``."""
    try:
        arm = quiet_arm(problem, row)
    except CdsmError as error:
        fault = "; ".join(error.faults) if isinstance(error, GeometryError) else str(error)
        return Found(np.full(len(problem.measures), math.nan), fault)
    return Found(_Arm(problem, row, arm).values())


def quiet_arm(problem: DesignProblem, design: Array) -> Manipulator:
    """Build the arm of a design (n,) without warnings, such as that cables share a hole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        return problem.arm_of(design)


def balanced(
    problem: DesignProblem, design: Array, arm: Manipulator, loads: Array
) -> Iterator[tuple[Tension, Array]]:
    """Yield the least tensions at each posture under each of ``loads`` (n, 6) [N, N m].

    Each item also has exp(Σ μ φ) of the cables (C,), the factor by which friction (coefficient μ,
    wrap angle φ) narrows their bounds. It is 1 without ``worst_friction``.
    """
    bounds, worst = (problem.minimum_of(design), problem.maximum), problem.worst_friction
    for q in problem.postures_of(arm):
        pose = arm.at(q)
        loss = np.exp(grip(pose)) if worst else np.ones(len(arm.cables))
        for load in loads:
            yield distribute_tension(pose, *bounds, load, worst_friction=worst), loss


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

    def rows(self, each: Measure) -> Array:
        """Return a quantity that depends on tensions, in SI, for each held posture and load.

        They are held if tensions within the bounds balance the arm, and the arm is stable.
        """
        held = self.held
        C = self.found["compliance"][held][:, :3, :3]
        if each.of == "stiffness":
            u = np.array(each.direction)
            with np.errstate(divide="ignore"):
                return np.asarray(1.0 / np.maximum(np.einsum("i,nij,j->n", u, C, u), 0.0))
        if each.of == "deflection":
            unloaded, stable = self._evaluated(np.zeros_like(self.loads))
            C = unloaded["compliance"][:, :3, :3]
            moved = np.linalg.norm(np.einsum("nij,nj->ni", C, self.loads[:, :3]), axis=1)
            return np.where(stable, moved, math.inf)[held]
        if each.of == "margin":
            return np.asarray(self.found["margin"][held])
        if each.of == "softest":
            return principal_stiffness(C)["softest"]
        bounds = self.q[held], self.loads[held], self.low[held], self.high[held]
        if each.of == "payload":
            return payloads(self.arm, *bounds, np.array(each.direction)[None])[:, 0]
        if each.of == "force_radius":
            return force_radii(self.arm, *bounds)
        assert each.of == "motor_force"
        along_cables = self.found["tension"][held] * self.loss[held]
        return np.asarray(along_cables.max(axis=1))

    def _value(self, each: Measure) -> float:
        arm, held = self.arm, self.held
        if each.of == "held":
            return float(held.mean())
        if each.of == "mass":
            return sum(link.mass for link in arm.geometry.links)
        if each.of == "length":
            return arm.geometry.length
        if each.of == "workspace":
            return _volume(self.found["tip"][held][:, :3, 3])
        if not held.any():
            return math.nan
        if each.of in self.of_pose:
            return float(self.of_pose[each.of].min())
        if each.of == "wire_length":
            return float(self.found["cable_lengths"][held].max(axis=0).sum())
        rows = self.rows(each)
        worst = int(rows.argmax() if KINDS[each.of].best == "least" else rows.argmin())
        return float(rows[worst]) + self._margin(each, worst)

    def _margin(self, each: Measure, worst: int) -> float:
        """Return the margin for tolerances of a quantity, ± coverage · u, or 0 if it has none.

        u is the standard uncertainty at the worst posture and load, which have the index ``worst``
        in :meth:`rows`.
        """
        if not has_margin(self.problem, each):
            return 0.0
        n = int(np.flatnonzero(self.held)[worst])
        pose = self.arm.at(self.q[n])
        F = distribute_tension(pose, self.low[n], self.high[n], self.loads[n])
        c = int((F.values * self.loss[n]).argmax()) if each.of == "motor_force" else None
        return margin(self.problem, each, F, self.loss[n], c)


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


def margin(
    problem: DesignProblem, each: Measure, tension: Tension, loss: Array, cable: int | None
) -> float:
    """Compute the margin for tolerances of a quantity, ± coverage · u.

    u is its standard uncertainty. The sign is that for which adding the margin makes the quantity
    worse. ``cable`` is the index of a cable for ``motor_force``, else None. ``loss`` (C,) has the
    factor exp(Σ μ φ) of each cable, the largest ratio of tensions along it.
    """
    of, sign = _SURE[each.of]
    found = uncertainty(
        tension.posture,
        tension,
        problem.tolerances,
        of=of,
        cable=None if cable is None else tension.posture.arm.cables.names[cable],
        direction=each.direction,
    )
    factor = 1.0 if cable is None else float(loss[cable])
    return sign * problem.coverage * factor * found.standard_uncertainty


def _volume(tips: Array) -> float:
    """Return the volume [m³] of the convex hull of tips (n, 3) [m]; 0 if they are coplanar."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(tips).volume)
    except (QhullError, ValueError):
        return 0.0

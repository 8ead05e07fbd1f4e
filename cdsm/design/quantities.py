"""Compute the quantities of one design over all postures and loads of a problem."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.design.goals import KINDS, Measure
from cdsm.design.problem import DesignProblem
from cdsm.errors import CdsmError, CdsmWarning, GeometryError
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.sweeps.cases import QUANTITIES, Cases
from cdsm.tension import friction_exponents

_SWEPT: Final = {
    "stiffness": "translational_compliance",
    "motor_force": "tension",
    "wire_length": "cable_lengths",
    "workspace": "tip_position",
}
"""Quantities of a sweep from which those of a design are computed, where names are different."""


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
    found = _Arm(problem, arm, problem.minimum_of(row))
    values = np.array([found.value(each) for each in problem.measures])
    return Found(values)


def quiet_arm(problem: DesignProblem, design: Array) -> Manipulator:
    """Build the arm of a design (n,) without warnings, such as that cables share a hole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        return problem._made(design)


class _Arm:
    """An arm at all pairs of posture and load; it is held at those where it is stable."""

    def __init__(self, problem: DesignProblem, arm: Manipulator, minimum: float) -> None:
        self.problem = problem
        self.arm = arm
        self.postures = problem.postures_of(arm)
        payloads = [each.direction for each in problem.measures if each.of == "payload"]
        self.ways = [*dict.fromkeys(payloads)]
        names = {_SWEPT.get(each.of, each.of) for each in problem.measures} & {*QUANTITIES}
        self.cases = Cases(
            arm=arm,
            outputs=tuple(sorted({*names, "margin"})),
            wrench=problem.loads,
            minimum=np.array([minimum]),
            maximum=problem.maximum,
            direction=np.array(self.ways).reshape(-1, 3),
            worst_friction=problem.worst_friction,
            diameter=problem.diameter,
        )
        self.rows = self.cases.rows(self.postures)
        self.held = _held(self.rows)

    def _pair(self, case: int) -> tuple[Posture, Array]:
        """Return the posture and the load of one of the held pairs."""
        posture, load = divmod(int(np.flatnonzero(self.held)[case]), len(self.problem.loads))
        return self.arm.at(self.postures[posture]), self.problem.loads[load]

    def cases_of(self, each: Measure) -> Array:
        """Return a quantity in SI (n, k): n held cases, or 1 for all; k = 1, or the cables."""
        held = self.held
        geometry = self.arm.geometry
        inside = held.reshape(len(self.postures), -1).any(axis=1)
        swept = _SWEPT.get(each.of, each.of)
        if each.of == "mass":
            return np.array([[sum(body.mass for body in geometry.chain.bodies[1:])]])
        if each.of == "length":
            return np.array([[geometry.length]])
        if each.of == "deflection":
            outputs = "translational_compliance", "margin"
            bare = replace(self.cases, outputs=outputs, wrench=np.zeros((1, 6)))
            rows = bare.rows(self.postures)  # the motors are locked before the load acts
            moved = np.linalg.norm(rows[outputs[0]] @ self.problem.loads[:, :3].T, axis=1)
            moved[~_held(rows)] = math.inf
            return np.asarray(moved.reshape(-1, 1)[held])
        found = self.rows[swept][inside if QUANTITIES[swept].needs == "posture" else held]
        if each.of == "wire_length":
            return np.array([[found.max(axis=0).sum()]])
        if each.of == "motor_force":
            if not self.problem.worst_friction:
                return found
            return found * np.exp([friction_exponents(self._pair(n)[0]) for n in range(len(found))])
        if each.of == "payload":
            found = found[:, self.ways.index(each.direction)]
        elif each.of == "stiffness":
            with np.errstate(divide="ignore"):
                u = np.array(each.direction)
                found = 1.0 / np.maximum(np.einsum("i,nij,j->n", u, found, u), 0.0)
        return found[:, None]

    def value(self, each: Measure) -> float:
        """Return the worst case of a quantity; NaN if no posture is held."""
        if each.of == "held":
            return float(self.held.mean())
        if each.of == "workspace":
            inside = self.held.reshape(len(self.postures), -1).any(axis=1)
            return _volume(self.rows["tip_position"][inside])
        if not self.held.any() and each.of not in ("mass", "length"):
            return math.nan
        found = self.cases_of(each)
        worst = found.argmax() if KINDS[each.of].best == "least" else found.argmin()
        case, cable = divmod(int(worst), found.shape[1])
        return float(found[case, cable])


def _held(rows: dict[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Return in which cases the arm is balanced and stable."""
    return np.isin(rows["status"], (Status.OK, Status.IMMOBILE))


def _volume(tips: Array) -> float:
    """Return the volume [m³] of the convex hull of tips (n, 3) [m]; 0 if they are coplanar."""
    from scipy.spatial import ConvexHull, QhullError  # slow to import

    try:
        return float(ConvexHull(tips).volume)
    except (QhullError, ValueError):
        return 0.0

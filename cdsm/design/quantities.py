"""Compute the quantities of one design over all postures and loads of a problem."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.design.goals import Measure
from cdsm.design.problem import DesignProblem
from cdsm.errors import CdsmError, CdsmWarning, GeometryError
from cdsm.manipulator import Manipulator
from cdsm.quantities import QUANTITIES
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.sweeps.cases import Cases
from cdsm.tension import friction_exponents


class Measured(NamedTuple):
    """Quantities of one design, in SI: ``values`` (m,).

    ``fault`` is the reason why no arm can be built from the design, or empty.
    """

    values: Array
    fault: str = ""


def measure(problem: DesignProblem, row: Array) -> Measured:
    """Compute the quantities of one design ``row`` (n,), in the order of ``problem.measures``."""
    try:
        arm = quiet_arm(problem, row)
    except CdsmError as error:
        fault = "; ".join(error.faults) if isinstance(error, GeometryError) else str(error)
        return Measured(np.full(len(problem.measures), math.nan), fault)
    pairs = _Pairs(problem, arm, problem.minimum_of(row))
    return Measured(np.array([pairs.worst(measure) for measure in problem.measures]))


def quiet_arm(problem: DesignProblem, design: Array) -> Manipulator:
    """Build the arm of a design (n,) without warnings, such as that cables share a hole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CdsmWarning)
        return problem.unbounded_arm_of(design)


class _Pairs:
    """All pairs of posture and load of an arm; it is held at those where it is stable."""

    def __init__(self, problem: DesignProblem, arm: Manipulator, minimum: float) -> None:
        self.problem = problem
        self.arm = arm
        self.postures = problem.postures_of(arm)
        directions = [m.direction for m in problem.measures if m.direction is not None]
        self.directions = [*dict.fromkeys(directions)]
        self.cases = Cases(
            arm=arm,
            outputs=_outputs(problem.measures),
            applied=tuple(problem.loads),
            minimum=np.array([minimum]),
            maximum=problem.maximum,
            direction=np.array(self.directions).reshape(-1, 3),
            worst_friction=problem.worst_friction,
            diameter=problem.diameter,
        )
        self.rows = self.cases.rows(self.postures)
        self.held = _held(self.rows)
        self.held_postures = self.held.reshape(len(self.postures), -1).any(axis=1)

    def worst(self, measure: Measure) -> float:
        """Return the worst value of a quantity in SI; NaN if no pair is held."""
        quantity = measure.quantity
        if quantity.needs == "arm":
            assert quantity.compute is not None
            return float(quantity.compute(self.arm))
        if measure.of == "held":
            return float(self.held.mean())
        if measure.of == "workspace":
            return _volume(self.rows["tip_position"][self.held_postures])
        if not self.held.any():
            return math.nan
        if measure.of == "wire_length":
            return float(self.rows["cable_lengths"][self.held_postures].max(axis=0).sum())
        values = self._values(measure)
        return float(values.max() if quantity.best == "least" else values.min())

    def _values(self, measure: Measure) -> Array:
        """Return a quantity (n,), or (n, C) of the cables, at n held postures or pairs."""
        if measure.of == "deflection":
            return self._deflections()
        of_posture = measure.quantity.needs == "posture"
        values = self.rows[measure.of][self.held_postures if of_posture else self.held]
        if measure.direction is not None:
            values = values[:, self.directions.index(measure.direction)]
        if measure.of == "tension" and self.problem.worst_friction:
            postures = np.flatnonzero(self.held) // len(self.problem.loads)
            exponents = [friction_exponents(self.arm.at(self.postures[i])) for i in postures]
            values = values * np.exp(exponents)
        return np.asarray(values)

    def _deflections(self) -> Array:
        """Return |C_vv f| of each held pair; the motors are locked before the load acts."""
        unloaded = replace(
            self.cases, outputs=("translational_compliance", "margin"), applied=(np.zeros(6),)
        )
        rows = unloaded.rows(self.postures)
        force = self.problem.loads[:, :3]
        deflections = np.linalg.norm(rows["translational_compliance"] @ force.T, axis=1)
        deflections[~_held(rows)] = math.inf
        return np.asarray(deflections.ravel()[self.held])


def _outputs(measures: tuple[Measure, ...]) -> tuple[str, ...]:
    """Return the quantities of a sweep from which those of a design follow."""
    names = {"margin"}
    for measure in measures:
        is_swept = "sweep" in measure.quantity.outputs or measure.quantity.compute is not None
        names |= {measure.of} if is_swept else {*measure.quantity.reads}
    return tuple(name for name in QUANTITIES if name in names and QUANTITIES[name].needs != "arm")


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

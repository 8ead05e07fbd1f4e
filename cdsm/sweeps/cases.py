"""Compute the quantities of many postures, each in several cases: for sweeps and for designs.

A case is a combination of a wrench and a lower bound of the tensions (a minimum).
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied
from cdsm.batch.applied_rows import AppliedRows
from cdsm.batch.evaluation import Batch, evaluate
from cdsm.batch.quantities import derive
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, distances
from cdsm.measures.indices import principal_stiffness, tension_factor
from cdsm.measures.payload import largest_force
from cdsm.measures.polytope import balanced, polytope_of
from cdsm.posture import Posture
from cdsm.quantities import QUANTITIES
from cdsm.status import Status
from cdsm.support.validation import checked_quantity, flag
from cdsm.support.values import Array
from cdsm.tension import checked_bounds, friction_exponents

CASES: Final = ("wrench", "minimum")
"""Dimensions of the cases; each exists only if several values of the argument are given."""

DEFAULT: Final = ("tip_position", "along", "slack", "margin", "softest", "stiffest", "isotropy")
"""Default outputs, which the maps need."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cases:
    """What is computed at each posture, and in which cases."""

    arm: Manipulator
    outputs: tuple[str, ...]  # names of quantities of a sweep
    applied: tuple[Applied, ...]  # what acts in each of W cases
    minimum: Array  # lower bounds of tension (M,) [N], as asked
    maximum: float  # upper bound [N], as asked
    direction: Array  # unit directions (D, 3)
    worst_friction: bool  # whether all segments of the cables stay within the bounds
    diameter: float  # of the cables [m]

    @property
    def count(self) -> int:
        """Return the number of cases at each posture."""
        return len(self.applied) * len(self.minimum)

    @cached_property
    def acting(self) -> AppliedRows:
        """What acts in each of W cases, as rows."""
        return AppliedRows.of(self.applied)

    @property
    def is_slow(self) -> bool:
        """Whether a posture takes milliseconds."""
        return any(QUANTITIES[name].is_slow for name in self.outputs)

    @property
    def sizes(self) -> dict[str, int]:
        """Return the size of each dimension of an output or of the cases."""
        sizes = {"wrench": len(self.applied), "minimum": len(self.minimum)}
        sizes |= {"direction": len(self.direction), "cable": len(self.arm.cables)}
        sizes |= dict.fromkeys(("joint", "joint_column"), self.arm.nv)
        sizes |= dict.fromkeys(("axis", "axis_column"), 3)
        return sizes | dict.fromkeys(("motion", "motion_column"), 6)

    @property
    def held_bounds(self) -> tuple[Array, Array]:
        """Bounds that hold: lower ones (M, C) and upper ones (C,) [N], the cables' own included."""
        pairs = [checked_bounds(self.arm, low, self.maximum) for low in self.minimum.tolist()]
        return np.array([low for low, _ in pairs]), pairs[0][1]

    def rows(self, q: Array, threads: int | None = 1) -> dict[str, NDArray[Any]]:
        """Compute outputs and ``status`` at q (P, nv); a row is a posture, wrench and minimum.

        Quantities of the posture alone have a row for each posture. NaN stands for what does not
        exist. A posture of which an angle is NaN is out of reach.
        """
        reached = ~np.isnan(q.sum(axis=1))
        if not reached.all():
            return self._with_gaps(q, reached, threads)
        cases = self.count
        case = np.tile(np.repeat(np.arange(len(self.applied)), len(self.minimum)), len(q))
        low, high, bounded = self._bounds(q)
        names = self._batch_outputs()
        batch = evaluate(
            self.arm,
            np.repeat(q, cases, axis=0),
            wrench=self.acting.of_rows(case),
            outputs=names,
            direction=self.direction if "along" in names else None,
            minimum=low,
            maximum=high,
            threads=threads,
        )
        status = batch.status.astype(np.int8)
        placed = ~np.isin(status, (Status.BEYOND_LIMITS, Status.COINCIDENT_SITES))
        status[placed & ~bounded] = Status.INFEASIBLE
        held = placed & ~np.isin(status, (Status.INFEASIBLE, Status.SOLVER_FAILED))
        stable = np.isin(status, (Status.OK, Status.IMMOBILE))
        if "margin" in batch:
            unstable = stable & (batch["margin"] <= 0.0)
            status[unstable] = Status.UNSTABLE
            stable &= ~unstable
        exists = {"tension": bounded, "stiffness": bounded, "stable arm": stable}
        rows: dict[str, NDArray[Any]] = {"status": status}
        for name in self.outputs:
            needs = QUANTITIES[name].needs
            rows[name] = self._of_batch(name, batch)
            if needs == "posture":
                rows[name] = rows[name][::cases]
            else:
                rows[name][~exists[needs]] = False if QUANTITIES[name].is_flag else np.nan
        if "compliance" in batch:
            principal = principal_stiffness(batch["compliance"][stable, :3, :3])
            for name in principal.keys() & rows.keys():
                rows[name][stable] = principal[name]
        for i in np.flatnonzero(placed[::cases]).tolist() if self.is_slow else ():
            pose = self.arm.at(q[i])
            for name, measure in self._measures(pose).items():
                rows[name][i] = measure
            for row in range(i * cases, (i + 1) * cases):
                acts = self.applied[case[row]]
                forces = self._forces(pose, acts, low[row], high[row]) if held[row] else {}
                for name, force in forces.items():
                    rows[name][row] = force
        return rows

    def _with_gaps(
        self, q: Array, reached: NDArray[np.bool_], threads: int | None
    ) -> dict[str, NDArray[Any]]:
        """Compute the rows of postures that are ``reached`` (P,); the others are out of reach."""
        rows = self.rows(np.where(reached[:, None], q, self.arm.body.straight), threads)
        entries = np.repeat(reached, self.count)
        for name, values in rows.items():
            missed = ~(reached if len(values) == len(reached) else entries)
            values[missed] = Status.OUT_OF_REACH if name == "status" else np.nan
        return rows

    def _batch_outputs(self) -> list[str]:
        """Return the quantities of a batch that the outputs and their status need."""
        names: set[str] = set()
        needs = set[str]()
        for output in self.outputs:
            row = QUANTITIES[output]
            needs.add(row.needs)
            names |= {output} if "batch" in row.outputs else {*row.reads}
        if needs - {"posture"}:
            names.add("tension")
        if needs & {"stiffness", "stable arm"}:
            names.add("margin")
        return [name for name in QUANTITIES if name in names]

    def _of_batch(self, name: str, batch: Batch) -> Array:
        """Return a quantity (R, …) as far as a batch has it or what it reads; else NaN."""
        row = QUANTITIES[name]
        if name in batch:
            return batch[name].copy()
        if row.compute is not None:
            return derive(name, dict(zip(batch.keys(), batch.values, strict=True)), self.direction)
        return np.full((len(batch), *(self.sizes[dim] for dim in row.dims)), np.nan)

    def _measures(self, pose: Posture) -> dict[str, float]:
        """Compute the slow quantities of a posture."""
        kinds = [name for name in self.outputs if name in KINDS]
        nearest = distances(pose, self.diameter, kinds=kinds) if kinds else {}
        measures = {kind: bodies.distance for kind, bodies in nearest.items()}
        if "tension_factor" in self.outputs:
            measures["tension_factor"] = tension_factor(pose)
        return measures

    def _forces(self, pose: Posture, wrench: Applied, low: Array, high: Array) -> dict[str, Any]:
        """Compute the largest forces [N] that tensions within the bounds balance; 0 if none."""
        forces: dict[str, Any] = {}
        if "payload" in self.outputs:
            problems = (balanced(pose, u[:, None], wrench, low, high) for u in self.direction)
            forces["payload"] = [largest_force(problem) for problem in problems]
        if "force_radius" in self.outputs:
            polytope = polytope_of(pose, wrench, low, high)
            forces["force_radius"] = polytope.radius if polytope else 0.0
        return forces

    def _bounds(self, q: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return bounds (R, C) [N] at the motors, and whether worst friction leaves any (R,)."""
        least, most = self.held_bounds
        low = np.tile(least, (len(q) * len(self.applied), 1))
        high = np.tile(most, (len(low), 1))
        bounded = np.ones(len(low), dtype=np.bool_)
        if self.worst_friction:
            loss = np.ones((len(q), low.shape[1]))
            for i in np.flatnonzero(evaluate(self.arm, q, outputs=[], threads=1).ok):
                loss[i] = np.exp(friction_exponents(self.arm.at(q[i])))
            loss = np.repeat(loss, self.count, axis=0)
            bounded = np.asarray((low * loss <= high / loss).all(axis=1))
            loss[~bounded] = 1.0
            low = low * loss
            high = high / loss
        return low, high, bounded


def require(
    names: Collection[str], arm: Manipulator, maximum: float, worst_friction: bool, diameter: float
) -> None:
    """Raise InvalidInput if an argument of a sweep of ``names`` is missing or invalid."""
    if flag("worst_friction", worst_friction) and not arm.has_friction:
        raise InvalidInput(
            "worst_friction",
            f"{arm.name} has no friction in its holes; leave it out, or give them a coefficient: "
            "friction = in ARM.toml, --set friction=0.1, Manipulator.with_friction.",
        )
    checked_quantity("diameter", diameter, "diameter", zero=True)
    if "force_radius" in names and math.isinf(checked_bounds(arm, 0.0, maximum)[1].max()):
        raise InvalidInput("maximum", "force_radius needs a finite one [N].")

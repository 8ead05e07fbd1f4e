"""Compute the quantities of many postures, each in several cases: for sweeps and for designs.

A case is a combination of a wrench and a lower bound of the tensions (a minimum).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.evaluation import evaluate
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, distances
from cdsm.measures.indices import principal_stiffness, tension_factor
from cdsm.measures.payload import largest_force
from cdsm.measures.polytope import balanced, polytope_of
from cdsm.posture import Posture
from cdsm.quantities import names_of
from cdsm.status import Status
from cdsm.support.validation import checked_quantity, flag
from cdsm.support.values import Array
from cdsm.tension import checked_bounds, friction_exponents

Needs = Literal["posture", "tension", "stiffness", "stable arm"]


class Quantity(NamedTuple):
    """Description of an output of a sweep, which is a variable of the Dataset."""

    needs: Needs  # what must exist for the quantity to exist
    long_name: str  # in words
    units: str  # SI, in the notation of UDUNITS
    dims: tuple[str, ...]  # its own dimensions, after those of poses and cases


CASES: Final = ("wrench", "minimum")
"""Dimensions of the cases; each exists only if several values of the argument are given."""

_JOINTS = ("joint", "joint_column")
_AXES = ("axis", "axis_column")
_K = "N m rad-1"

_TABLE: dict[Needs, dict[str, tuple[str, ...]]] = {  # words, unit and dimensions
    "posture": {
        "tip_position": ("position of the tip in base axes", "m", "axis"),
        "cable_lengths": ("cable lengths L, lead included (Eq. 8)", "m", "cable"),
        "gravity_torque": ("gravity torque g = dV/dq", "N m", "joint"),
        "gravity_stiffness": ("gravity part of K, dg/dq", _K, *_JOINTS),
        "tension_factor": ("largest min F / max F with J_L^T F = 0; 0: no wrench closure", "1"),
        "cable_clearance": ("least distance of two cables", "m"),
        "link_clearance": ("least distance of a cable from a backbone", "m"),
        "disk_clearance": ("least distance of a cable from a disk, or its hole's edge", "m"),
    },
    "tension": {
        "tension": ("least cable tensions F in balance (Eq. 17)", "N", "cable"),
        "payload": ("largest force in a direction within the tension limits", "N", "direction"),
        "force_radius": ("largest force in any direction within the tension limits", "N"),
    },
    "stiffness": {
        "cable_stiffness": ("cable stiffness, diagonal of K_L", "N m-1", "cable"),
        "active_stiffness": ("active part of K, H_L F (Eq. 16)", _K, *_JOINTS),
        "passive_stiffness": ("passive part of K, J_L^T K_L J_L (Eq. 16)", _K, *_JOINTS),
        "load_stiffness": ("load part of K (Eq. 16)", _K, *_JOINTS),
        "joint_stiffness": ("joint stiffness K (Eq. 16)", _K, *_JOINTS),
        "margin": ("stability margin, smallest eigenvalue of the symmetric part of K", _K),
        "translational_compliance": ("compliance C_vv, motion per force", "m N-1", *_AXES),
        "along": ("stiffness in a direction, 1/(u^T C_vv u) (Eq. 20)", "N m-1", "direction"),
        "cartesian": ("Cartesian stiffness, inverse of C_vv", "N m-1", *_AXES),
        "pseudoinverse": ("the paper's Cartesian stiffness, J+^T K J+", "N m-1", *_AXES),
    },
    "stable arm": {
        "softest": ("stiffness in the softest direction", "N m-1"),
        "stiffest": ("stiffness in the stiffest direction", "N m-1"),
        "isotropy": ("softest over stiffest", "1"),
        "softest_direction": ("softest direction, unit length", "1", "axis"),
        "stiffest_direction": ("stiffest direction, unit length", "1", "axis"),
    },
}

QUANTITIES: Final[dict[str, Quantity]] = {
    name: Quantity(needs, words, units, tuple(dims))
    for needs, table in _TABLE.items()
    for name, (words, units, *dims) in table.items()
}
"""All quantities that a sweep computes, by name."""

DEFAULT: Final = ("tip_position", "along", "margin", "softest", "stiffest", "isotropy")
"""Default outputs, which the maps need."""

_BATCH_NAMES: Final = {
    "tip_position": "tip",
    "translational_compliance": "compliance",
    **{f"{term}_stiffness": term for term in ("gravity", "active", "passive", "load", "joint")},
}
"""Names of quantities in a batch, where the name in a sweep is different."""

_BLOCKS: Final[dict[str, Any]] = {"tip": np.s_[:, :3, 3], "compliance": np.s_[:, :3, :3]}
"""Parts of matrices of a batch."""

_SLOW: Final = frozenset(("tension_factor", *KINDS, "payload", "force_radius"))
"""Measures that take some milliseconds a posture."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cases:
    """What is computed at each posture, and in which cases."""

    arm: Manipulator
    outputs: tuple[str, ...]  # names from QUANTITIES
    wrench: Array  # (W, 6): force [N], then moment [N m]
    minimum: Array  # lower bounds of tension (M,) [N]
    maximum: float  # upper bound [N]
    direction: Array  # unit directions (D, 3)
    worst_friction: bool  # whether all segments of the cables stay within the bounds
    diameter: float  # of the cables [m]

    @property
    def count(self) -> int:
        """Return the number of cases at each posture."""
        return len(self.wrench) * len(self.minimum)

    @property
    def slow(self) -> bool:
        """Whether a posture takes milliseconds."""
        return not _SLOW.isdisjoint(self.outputs)

    @property
    def sizes(self) -> dict[str, int]:
        """Return the size of each dimension of an output or of the cases."""
        nv = self.arm.nv
        own = {"axis": 3, "axis_column": 3, "cable": len(self.arm.cables)}
        own |= {"wrench": len(self.wrench), "minimum": len(self.minimum)}
        return own | {"direction": len(self.direction), "joint": nv, "joint_column": nv}

    def rows(self, q: Array, threads: int | None = 1) -> dict[str, NDArray[Any]]:
        """Compute outputs and ``status`` at q (P, nv); a row is a posture, wrench and minimum.

        Quantities of the posture alone have a row for each posture. NaN stands for what does not
        exist.
        """
        arm = self.arm
        cases = self.count
        wrench = np.tile(np.repeat(self.wrench, len(self.minimum), axis=0), (len(q), 1))
        low, high, bounded = self._bounds(q)
        kinds = {QUANTITIES[name].needs for name in self.outputs}
        asked = {_BATCH_NAMES.get(name, name) for name in self.outputs}
        asked |= {"tension"} if kinds - {"posture"} else set()
        asked |= {"margin"} if kinds & {"stiffness", "stable arm"} else set()
        asked |= {"compliance"} if "stable arm" in kinds else set()
        found = evaluate(
            arm,
            np.repeat(q, cases, axis=0),
            wrench=wrench,
            outputs=[name for name in names_of("batch") if name in asked],
            direction=self.direction if "along" in asked else None,
            minimum=low,
            maximum=high,
            threads=threads,
        )
        status = found.status.astype(np.int8)
        exist = ~np.isin(status, (Status.BEYOND_LIMITS, Status.COINCIDENT_SITES))
        status[exist & ~bounded] = Status.INFEASIBLE
        rows: dict[str, NDArray[Any]] = {"status": status}
        for name in self.outputs:
            needs, _, _, dims = QUANTITIES[name]
            of_batch = _BATCH_NAMES.get(name, name)
            count = len(q) if needs == "posture" else len(status)
            rows[name] = np.full((count, *(self.sizes[dim] for dim in dims)), np.nan)
            if of_batch in found:
                values = found[of_batch][_BLOCKS.get(of_batch, ())]
                if needs == "posture":
                    rows[name][:] = values[::cases]
                else:
                    rows[name][bounded] = values[bounded]

        def put(values: Mapping[str, Any], place: Any) -> None:
            for name in values.keys() & rows.keys():
                rows[name][place] = values[name]

        held = exist & ~np.isin(status, (Status.INFEASIBLE, Status.SOLVER_FAILED))
        for i in np.flatnonzero(exist[::cases]).tolist() if self.slow else ():
            pose = arm.at(q[i])
            put(self._measures(pose), i)
            for row in range(i * cases, (i + 1) * cases):
                if held[row]:
                    put(self._forces(pose, wrench[row], low[row], high[row]), row)
        if "margin" in found:
            known = np.isin(status, (Status.OK, Status.IMMOBILE))
            if "stable arm" in kinds:
                stable = known & (found["margin"] > 0.0)
                put(principal_stiffness(found["compliance"][stable, :3, :3]), stable)
            status[known & (found["margin"] <= 0.0)] = Status.UNSTABLE
        return rows

    def _measures(self, pose: Posture) -> dict[str, float]:
        kinds = [name for name in self.outputs if name in KINDS]
        near = distances(pose, self.diameter, kinds=kinds) if kinds else {}
        found = {kind: each.distance for kind, each in near.items()}
        if "tension_factor" in self.outputs:
            found["tension_factor"] = tension_factor(pose)
        return found

    def _forces(self, pose: Posture, wrench: Array, low: Array, high: Array) -> dict[str, Any]:
        """Compute the largest forces [N] that tensions within the bounds balance; 0 if none."""
        found: dict[str, Any] = {}
        if "payload" in self.outputs:
            ways = (balanced(pose, u[:, None], wrench, low, high) for u in self.direction)
            found["payload"] = [largest_force(each) for each in ways]
        if "force_radius" in self.outputs:
            polytope = polytope_of(pose, wrench, low, high)
            found["force_radius"] = polytope.radius if polytope else 0.0
        return found

    def _bounds(self, q: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return bounds (R, C) [N] at the motors, narrowed by worst friction if any remain (R,)."""
        pairs = [checked_bounds(self.arm, each, self.maximum) for each in self.minimum.tolist()]
        low, high = (
            np.tile(each, (len(q) * len(self.wrench), 1)) for each in zip(*pairs, strict=True)
        )
        exist = np.ones(len(low), dtype=np.bool_)
        if self.worst_friction:
            loss = np.ones((len(q), low.shape[1]))
            for i in np.flatnonzero(evaluate(self.arm, q, outputs=[], threads=1).ok):
                loss[i] = np.exp(friction_exponents(self.arm.at(q[i])))
            loss = np.repeat(loss, self.count, axis=0)
            exist = np.asarray((low * loss <= high / loss).all(axis=1))
            loss[~exist] = 1.0
            low = low * loss
            high = high / loss
        return low, high, exist


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

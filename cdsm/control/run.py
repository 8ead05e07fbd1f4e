"""Result of :func:`~cdsm.track`: a path followed in closed loop."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from cdsm.control.assessment import hung_weight
from cdsm.control.plant import SlowPlant
from cdsm.errors import InvalidInput
from cdsm.planning.path_plan import PathPlan
from cdsm.support.extras import need
from cdsm.support.files import as_path, write_file
from cdsm.support.format import aligned, plain, plural
from cdsm.support.tidy import dataset
from cdsm.support.validation import whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from cdsm.control.plant import Plant, PlantState

Outcome = Literal["completed", "lost", "no rest", "wire"]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TrackingRun(ReadOnlyState):
    """Closed loop along a path, step by step; made by :func:`track`.

    n steps, C cables, D wanted directions. Under friction, *the* stiffness of a state is that of
    the arm with the same wire and load once its cables have slid until nothing holds them:
    :meth:`hung_weight` measures it, since it shakes the load. NaN stands where an arm has no such
    rest.

    Attributes:
        plan: The plan that was followed.
        law: Name of the motor law.
        plant: The arm that was controlled.
        period: Time between two steps [s].
        goals: Planned tip positions (n, 3) [m].
        target: Wanted stiffness (n, D) [N/m].
        angles: True joint angles (n, nv) [rad]; [m] where a joint slides.
        estimated_angles: Angles that the controller believed in before each step (n, nv) [rad].
        tips: True tip positions (n, 3) [m].
        wanted_tension: References of the tensions at the motors (n, C) [N].
        commanded_tension: Tensions that the commands stand for (n, C) [N], within the bounds.
        commanded_wire: Wire that the motors were told to pay out (n, C) [m].
        measured_tension: Readings of the load cells before each step (n, C) [N].
        tension: True tensions at the motors (n, C) [N].
        saturated: Whether a clamp changed the command of each motor (n, C).
        stiffness: True stiffness along each direction (n, D) [N/m].
        margin: Smallest eigenvalue of the true K_θ (n,) [N m/rad].
        band: Least and largest proved displacement along the first direction (n, 2) [m], about the
            rest without friction; NaN where none was asked for or proved.
        displacement: Displacement of the tip from that rest along the first direction (n,) [m].
        wrench: Load (n, 6): force [N], then moment [N m].
        estimated_force: Force at the tip that the controller believed in (n, 3) [N].
        rigidity: Rigidity of the wires over that of their laws, as estimated (n,) [-].
        refused: Reasons why the outer loop kept its tensions, by step.
        outcome: ``"completed"``; ``"lost"``: the tip left its path, the loop is unstable; ``"no
            rest"``: the arm buckled; ``"wire"``: a cable left its law.
        reason: What stopped the loop, in words; or empty.
        states: States of the plant, which :meth:`hung_weight` loads further.
    """

    plan: PathPlan
    law: str
    plant: Plant[Any]
    period: float
    goals: Array
    target: Array
    angles: Array
    estimated_angles: Array
    tips: Array
    wanted_tension: Array
    commanded_tension: Array
    commanded_wire: Array
    measured_tension: Array
    tension: Array
    saturated: NDArray[np.bool_]
    stiffness: Array
    margin: Array
    band: Array
    displacement: Array
    wrench: Array
    estimated_force: Array
    rigidity: Array
    refused: dict[int, str]
    outcome: Outcome
    reason: str
    states: tuple[PlantState, ...]

    @cached_property
    def time(self) -> Array:
        """Time of each step (n,) [s]."""
        return frozen(self.period * np.arange(len(self.tips), dtype=np.float64))

    @property
    def directions(self) -> Array:
        """Wanted directions u (D, 3), base axes."""
        return self.plan.direction.reshape(-1, 3)  # type: ignore[union-attr]

    @cached_property
    def tip_error(self) -> Array:
        """Distance of the tip from the path (n,) [m]."""
        off = self.tips - self.goals
        return frozen(np.sqrt((off**2).sum(axis=1, dtype=np.float64)))

    @cached_property
    def stiffness_error(self) -> Array:
        """Stiffness over the wanted one, minus 1 (n, D) [-]; NaN where there is none."""
        return frozen(self.stiffness / self.target - 1.0)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the tip is inside its proved band (B,), for the B steps that have one."""
        low, high = self.band[self._banded].T
        moved = self.displacement[self._banded]
        return frozen(np.asarray((low - _ROUNDING <= moved) & (moved <= high + _ROUNDING)))

    @property
    def _banded(self) -> NDArray[np.intp]:
        return np.flatnonzero(np.isfinite(self.band[:, 0]))

    def hung_weight(self, step: int, direction: int = 0) -> float:
        """Hang a weight on the true arm as it was after a step; return the stiffness [N/m].

        The motors stand still. The load swings and fades away before and after the weight is hung,
        so that friction does not hold the arm. NaN if the arm finds no rest.

        Args:
            step: Number of the step; negative numbers count from the last.
            direction: Number of the direction.

        Raises:
            InvalidInput: There is no such step or direction, the arm has no rest without friction
                there, or the plant is not a :class:`SlowPlant`.
        """
        count, D = len(self.time), len(self.directions)
        k = whole_number("step", step, -count, count - 1) % count
        u = self.directions[whole_number("direction", direction, 0, D - 1)]
        if not isinstance(self.plant, SlowPlant):
            raise InvalidInput("plant", f"{self.plant!r} cannot be loaded further; use SlowPlant.")
        return hung_weight(self.plant, self.states[k], u)  # type: ignore[arg-type]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Faults, worst first; empty if the path was followed to its end."""
        said = []
        if self.outcome != "completed":
            word = {"lost": "UNSTABLE", "no rest": "BUCKLES", "wire": "WIRE"}[self.outcome]
            said.append(f"{word} at {self._end:.4g} s: {self.reason}")
        unstable = np.flatnonzero(~(self.margin > 0.0))
        if unstable.size:
            said.append(
                f"UNSTABLE AT REST at {unstable.size} of {len(self.time)} steps, from "
                f"{self.time[unstable[0]]:.4g} s: without friction the arm would give way"
            )
        if self.refused:
            first = min(self.refused)
            said.append(
                f"NOT PLANNED at {len(self.refused)} of {len(self.time)} steps, from "
                f"{self.time[first]:.4g} s: {self.refused[first]}"
            )
        if not self.inside.all():
            said.append(f"OUTSIDE ITS BAND at {np.count_nonzero(~self.inside)} steps")
        return tuple(said)

    @property
    def _end(self) -> float:
        return float(self.time[-1]) if len(self.time) else 0.0

    def to_xarray(self) -> xarray.Dataset:
        """Return a labelled Dataset over time, in SI units.

        Raises:
            MissingExtra: xarray is not installed.
        """
        arm, names = self.plan.arm, "xyz"
        labels: dict[str, Sequence[object] | NDArray[Any]] = {
            "time": self.time,
            "axis": list(names),
            "component": [f"{kind}{axis}" for kind in "fm" for axis in names],
            "joint": arm.joint_names,
            "cable": arm.cables.names,
            "end": ["low", "high"],
        }
        angle, of_cable = "rad, or m where a joint slides", ("time", "cable")
        variables: dict[str, tuple[tuple[str, ...], NDArray[Any], str]] = {
            "goal": (("time", "axis"), self.goals, "m"),
            "tip": (("time", "axis"), self.tips, "m"),
            "tip_error": (("time",), self.tip_error, "m"),
            "target": (("time", "direction"), self.target, "N/m"),
            "stiffness": (("time", "direction"), self.stiffness, "N/m"),
            "direction_vector": (("direction", "axis"), self.directions, "1"),
            "margin": (("time",), self.margin, arm.stiffness_unit()),
            "joint_position": (("time", "joint"), self.angles, angle),
            "estimated_joint_position": (("time", "joint"), self.estimated_angles, angle),
            "wanted_tension": (of_cable, self.wanted_tension, "N"),
            "commanded_tension": (of_cable, self.commanded_tension, "N"),
            "commanded_wire": (of_cable, self.commanded_wire, "m"),
            "measured_tension": (of_cable, self.measured_tension, "N"),
            "tension": (of_cable, self.tension, "N"),
            "saturated": (of_cable, self.saturated, "1"),
            "band": (("time", "end"), self.band, "m"),
            "displacement": (("time",), self.displacement, "m"),
            "wrench": (("time", "component"), self.wrench, "N, N m"),
            "estimated_force": (("time", "axis"), self.estimated_force, "N"),
            "rigidity": (("time",), self.rigidity, "1"),
        }
        title = f"{arm.name} in closed loop, law {self.law}"
        data = dataset(variables, labels, title=title, outcome=self.outcome, reason=self.reason)
        data["time"].attrs["units"] = "s"
        return data

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_xarray` as NetCDF (``.nc``), completely or not at all; return the path.

        Raises:
            InvalidInput: The path does not end in ``.nc``.
            MissingExtra: netCDF4 is not installed.
            FileError: The file cannot be written.
        """
        if as_path(path).suffix.lower() != ".nc":
            raise InvalidInput("path", f"{str(path)!r} given; it must end in .nc (NetCDF).")
        need("sweep", "netCDF4")
        data = self.to_xarray()
        return write_file(path, lambda aside: data.to_netcdf(aside, engine="netcdf4"))

    def to_dict(self) -> dict[str, object]:
        """Return the numbers of the table in SI for JSON, with units in the keys."""
        return dict(plain(self._numbers))

    @property
    def _numbers(self) -> dict[str, Any]:
        off = abs(self.stiffness_error)
        known = off[np.isfinite(off).all(axis=1)]
        return {
            "law": self.law,
            "steps": len(self.time),
            "outcome": self.outcome,
            "reason": self.reason,
            "ended_s": self._end,
            "tip_error_mean_m": _mean(self.tip_error),
            "tip_error_largest_m": float(self.tip_error.max(initial=0.0)),
            "stiffness_error_mean": _mean(known.ravel()),
            "stiffness_error_largest": float(known.max()) if known.size else math.nan,
            "least_tension_N": float(self.tension.min(initial=math.inf)),
            "largest_tension_N": float(self.tension.max(initial=0.0)),
            "least_margin_Nm_per_rad": float(np.nanmin(self.margin, initial=math.inf)),
            "saturated_motors": self.saturated_motors,
            "steps_not_planned": len(self.refused),
            "steps_with_band": len(self.inside),
            "share_inside_band": _mean(self.inside.astype(float)),
            "estimated_rigidity": float(self.rigidity[-1]) if len(self.rigidity) else math.nan,
        }

    @property
    def saturated_motors(self) -> tuple[str, ...]:
        """Names of the cables whose command a clamp changed at some step."""
        names = self.plan.arm.cables.names
        return tuple(names[c] for c in np.flatnonzero(self.saturated.any(axis=0)))

    def plot(self, animate: str | os.PathLike[str] | None = None) -> Figure:
        """Plot tip error, stiffness, tensions and the proved band over time.

        Args:
            animate: A ``.gif`` to write too, in which the true arm follows the path.

        Raises:
            InvalidInput: ``animate`` does not end in ``.gif``.
            FileError: The animation cannot be written.
        """
        from cdsm.plots import plot_path, plot_tracking_run  # matplotlib imports slowly

        if animate is not None:
            plot_path([state.pose for state in self.states], animate=animate, tensions=self.tension)
        return plot_tracking_run(self)

    def __repr__(self) -> str:
        return f"<TrackingRun of {self.plan.arm.name}, law {self.law}, {self.outcome}>"

    def __str__(self) -> str:
        n = self._numbers
        low, high = n["least_tension_N"], n["largest_tension_N"]
        banded, share = n["steps_with_band"], n["share_inside_band"]
        rows = [
            ("tip error, mean and largest", f"{1e3 * n['tip_error_mean_m']:.3g}, "
             f"{1e3 * n['tip_error_largest_m']:.3g} mm"),
            ("stiffness error, mean and largest", f"{100.0 * n['stiffness_error_mean']:.3g}, "
             f"{100.0 * n['stiffness_error_largest']:.3g} %"),
            ("tensions at the motors", f"{low:.4g} to {high:.4g} N"),
            ("least margin to buckling", f"{n['least_margin_Nm_per_rad']:.4g} "
             f"{self.plan.arm.stiffness_unit()}"),
            ("saturated motors", ", ".join(self.saturated_motors) or "none"),
            ("rigidity of the wires, as estimated", f"{100.0 * n['estimated_rigidity']:.4g} %"),
            ("inside the proved band", f"{100.0 * share:.4g} % of {plural(banded, 'step')}"
             if banded else "no band was proved"),
        ]  # fmt: skip
        head = f"law {self.law}: {plural(len(self.time), 'step')}, {self.outcome}"
        return "\n".join([*self.warnings, head, *aligned(rows)])


_ROUNDING = 1e-9
"""Distance beyond a band [m] that is rounding of a place of rest."""


def _mean(values: Array) -> float:
    return float(values.mean()) if values.size else math.nan

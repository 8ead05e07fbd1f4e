"""Result of :func:`~cdsm.track`: a path followed in closed loop."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
from numpy.typing import NDArray

import cdsm
from cdsm.control.labelled import labelled, numbers, rows, table
from cdsm.planning.path_plan import PathPlan
from cdsm.support.files import as_path
from cdsm.support.format import aligned, plain, plural
from cdsm.support.tidy import write_labelled
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

    from cdsm.control.plant import Plant, PlantState

Outcome = Literal["completed", "lost", "no rest", "wire"]

_ROUNDING = 1e-9  # distance beyond a band [m] that counts as rounding


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TrackingRun(ReadOnlyState):
    """Result of :func:`track`: a closed loop along a path, step by step.

    There are n steps, C cables and D wanted directions. With friction, the true stiffness of a
    state is the frictionless stiffness at the equilibrium that the arm would have without friction,
    with the same wire and load. It is NaN if there is no such equilibrium. Around this equilibrium
    lies the first-order band in which friction can let the tip rest, whatever loads came before:
    see :func:`~cdsm.rest_band`.

    Attributes:
        plan: The plan that was followed.
        law: Name of the motor law.
        plant: The arm that was controlled.
        period: Time between two steps [s].
        goals: Planned tip positions (n, 3) [m].
        target: Wanted stiffness (n, D) [N/m].
        angles: True joint angles (n, nv) [rad]; [m] for prismatic joints.
        estimated_angles: Angles that the controller estimated before each step (n, nv) [rad].
        tips: True tip positions (n, 3) [m].
        wanted_tension: Tensions at the motors (n, C) [N] that the outer loop plans; without such a
            loop, those of the plan.
        commanded_tension: Tensions that the motor commands give (n, C) [N], within the bounds.
        commanded_wire: Commanded wire to pay out (n, C) [m].
        measured_tension: Readings of the load cells before each step (n, C) [N].
        tension: True tensions at the motors (n, C) [N].
        saturated: Whether the command of each motor was changed to keep its tension within the
            bounds (n, C).
        stiffness: True stiffness along each direction (n, D) [N/m].
        margin: Smallest eigenvalue of the true K_θ (n,) [N m/rad].
        band: Half-width of the first-order band of ``displacement`` (n,) [m]; NaN without friction,
            and where there is no stable equilibrium.
        displacement: Displacement of the tip from the equilibrium without friction along the first
            direction (n,) [m].
        wrench: Load (n, 6): force [N], then moment [N m].
        estimated_force: Force at the tip that the controller estimated (n, 3) [N].
        rigidity: Estimated rigidity of the wires, divided by the rigidity of their laws (n,) [-].
        short: Whether the outer loop found no tensions within the bounds that give the target (n,).
        refused: For each step at which the outer loop could not plan tensions and kept the previous
            ones: the number of the step, and the reason.
        outcome: ``"completed"``; ``"lost"``: the loop is unstable, so the tip left its path or the
            plant diverged; ``"no rest"``: the arm buckled; ``"wire"``: a tension left the domain of
            its law.
        reason: What stopped the loop, in words; or empty.
        states: State of the plant after each step.
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
    short: NDArray[np.bool_]
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
        return self.plan.direction.reshape(-1, 3)

    @cached_property
    def tip_error(self) -> Array:
        """Distance of the tip from its planned position at each step (n,) [m]."""
        off = self.tips - self.goals
        return frozen(np.sqrt((off**2).sum(axis=1, dtype=np.float64)))

    @cached_property
    def stiffness_error(self) -> Array:
        """Relative error of the true stiffness, stiffness/target − 1 (n, D) [-]; NaN if unknown."""
        return frozen(self.stiffness / self.target - 1.0)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the tip is inside the first-order band (B,), for the B steps that have a band."""
        known = np.isfinite(self.band)
        return frozen(abs(self.displacement[known]) <= self.band[known] + _ROUNDING)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Faults of the run, worst first; empty if there are none."""
        said = []
        if self.outcome != "completed":
            word = {"lost": "UNSTABLE", "no rest": "BUCKLES", "wire": "WIRE"}[self.outcome]
            said.append(f"{word} at {self.end:.4g} s: {self.reason}")
        if unstable := np.flatnonzero(~(self.margin > 0.0)).tolist():
            said.append(
                f"UNSTABLE AT REST {self._at(unstable)}: without friction the arm would give way"
            )
        if refused := sorted(self.refused):
            said.append(f"NOT PLANNED {self._at(refused)}: {self.refused[refused[0]]}")
        if short := np.flatnonzero(self.short).tolist():
            said.append(
                f"OUT OF REACH {self._at(short)}: within the bounds no tensions were found that "
                "give the target"
            )
        return tuple(said)

    def _at(self, steps: Sequence[int]) -> str:
        """Return text such as ``at 3 of 40 steps, from 0.2 s`` for these numbers of steps."""
        return f"at {len(steps)} of {len(self.time)} steps, from {self.period * steps[0]:.4g} s"

    @property
    def end(self) -> float:
        """Time of the last completed step [s]; 0 if no step was completed."""
        return float(self.time[-1]) if len(self.time) else 0.0

    def to_xarray(self) -> xarray.Dataset:
        """Return a labelled Dataset over time, in SI units; needs xarray (MissingExtra)."""
        return labelled(self)

    def to_pandas(self) -> pandas.DataFrame:
        """Return angles, tip, tensions and stiffness over time; needs pandas (MissingExtra)."""
        return table(self)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_xarray` (``.nc``) or :meth:`to_pandas` (``.csv``); return the path.

        ``cdsm view ARM.toml --path RUN.csv`` plays the table.

        Raises:
            InvalidInput: The path ends neither in ``.nc`` nor in ``.csv``.
            MissingExtra: pandas or netCDF4 is not installed.
            FileError: The file cannot be written.
        """
        return write_labelled(path, self.to_pandas, self.to_xarray)

    def to_dict(self) -> dict[str, object]:
        """Return the numbers of the printed table in SI for JSON, with units in the keys."""
        return plain(numbers(self))

    @property
    def saturated_motors(self) -> tuple[str, ...]:
        """Names of the cables whose command was changed at some step because of a tension bound."""
        names = self.plan.arm.cables.names
        return tuple(names[c] for c in np.flatnonzero(self.saturated.any(axis=0)))

    def plot(self, animate: str | os.PathLike[str] | None = None) -> Figure:
        """Plot tip error, stiffness, tensions and the first-order band over time.

        ``animate`` is the path of a ``.gif`` to write as well; for errors see :meth:`animate`.
        """
        if animate is not None:
            self.animate(animate)
        return cdsm.plots.plot_tracking_run(self)

    def animate(self, path: str | os.PathLike[str]) -> Path:
        """Write a ``.gif`` in which the true arm follows the path; return its path.

        Raises:
            InvalidInput: The path does not end in ``.gif``, or no step was completed.
            FileError: The file cannot be written.
        """
        cdsm.plots.plot_path(
            [state.pose for state in self.states], animate=path, tensions=self.tension
        )
        return as_path(path)

    def __repr__(self) -> str:
        return f"<TrackingRun of {self.plan.arm.name}, law {self.law}, {self.outcome}>"

    def __str__(self) -> str:
        head = f"law {self.law}: {plural(len(self.time), 'step')}, {self.outcome}"
        return "\n".join([*self.warnings, head, *aligned(rows(self))])

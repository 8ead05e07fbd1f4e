"""Result of :func:`~cdsm.track`: a path followed in closed loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import listed
from cdsm.manipulator import Manipulator
from cdsm.planning.path_plan import PathPlan
from cdsm.status import Status
from cdsm.support.format import aligned, coordinates, plural
from cdsm.support.result import Result, quantity, unit
from cdsm.support.values import Array, Plotted, frozen

if TYPE_CHECKING:
    import pandas

    from cdsm.control.plants import Plant, PlantState

_ROUNDING = 1e-9  # distance beyond a band [m] that counts as rounding


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class TrackingRun(Result, Plotted):
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
        steps: Steps of control from one sample of the path to the next.
        max_change_per_step: Largest change of each tension that the outer loop plans (C,) [N].
        reference_tips: Planned tip positions (n, 3) [m].
        target: Wanted stiffness (n, D) [N/m].
        reference_balanced: Whether the tensions of the plan balance the arm at each step (n,).
        angles: True joint angles (n, nv) [rad]; [m] for prismatic joints.
        estimated_angles: Angles that the controller estimated before each step (n, nv) [rad].
        tips: True tip positions (n, 3) [m].
        reference_tension: Tensions at the motors (n, C) [N] that the outer loop plans; without such
            a loop, those of the plan.
        commanded_tension: Tensions that the motor commands are to give (n, C) [N], within the
            bounds.
        paid_out: Commanded wire to pay out (n, C) [m].
        measured_tension: Measurements of the load cells before each step (n, C) [N].
        tension: True tensions at the motors (n, C) [N].
        saturated: Whether the command of each motor was changed to keep its tension within the
            bounds (n, C).
        stiffness: True stiffness along each direction (n, D) [N/m].
        margin: Smallest eigenvalue of the true `K_θ` (n,) [N m/rad].
        band: Half-width of the first-order band of ``displacement`` (n,) [m]; NaN without friction,
            and where there is no stable equilibrium.
        displacement: Displacement of the tip from the equilibrium without friction along the first
            direction (n,) [m].
        wrench: Load (n, 6): force [N], then moment [N m].
        estimated_force: Force at the tip that the controller estimated (n, 3) [N].
        estimated_force_band: Most by which friction can change each of its components (n, 3) [N],
            as of :func:`~cdsm.estimate_load`.
        rigidity: Estimated rigidity of the wires, divided by the rigidity of their laws (n,) [-].
        target_unreachable: Whether the outer loop found no tensions within the bounds that give the
            target (n,).
        change_limited: Whether ``max_change_per_step`` kept the outer loop from the tensions that
            give the target (n,).
        replan_failed: For each step at which the outer loop could not plan tensions and kept the
            previous ones: the number of the step, and the reason.
        outcome: OK (the path is followed to its end); DIVERGED (the loop is unstable: the tip left
            its path, or the plant diverged); NO_EQUILIBRIUM (the arm buckled); OUTSIDE_ELASTICITY
            (a tension left the domain of its law).
        reason: What stopped the loop, in words; or empty.
        states: State of the plant after each step.
    """

    _rows = "time"
    _figure = "plot_tracking_run"

    plan: PathPlan
    law: str = field(metadata=unit("1"))
    plant: Plant[Any]
    period: float = field(metadata=unit("s"))
    steps: int = field(metadata=unit("1"))
    max_change_per_step: Array = field(metadata=unit("N", "cable"))
    reference_tips: Array = field(metadata=unit("m", "time", "axis"))
    target: Array = field(metadata=unit("N/m", "time", "direction"))
    reference_balanced: NDArray[np.bool_] = field(metadata=unit("1", "time"))
    angles: Array = field(metadata=unit("joint", "time", "joint"))
    estimated_angles: Array = field(metadata=unit("joint", "time", "joint"))
    tips: Array = field(metadata=unit("m", "time", "axis"))
    reference_tension: Array = field(metadata=unit("N", "time", "cable"))
    commanded_tension: Array = field(metadata=unit("N", "time", "cable"))
    paid_out: Array = field(metadata=unit("m", "time", "cable"))
    measured_tension: Array = field(metadata=unit("N", "time", "cable"))
    tension: Array = field(metadata=unit("N", "time", "cable"))
    saturated: NDArray[np.bool_] = field(metadata=unit("1", "time", "cable"))
    stiffness: Array = field(metadata=unit("N/m", "time", "direction"))
    margin: Array = field(metadata=unit("joint stiffness", "time"))
    band: Array = field(metadata=unit("m", "time"))
    displacement: Array = field(metadata=unit("m", "time"))
    wrench: Array = field(metadata=unit("N and N m", "time", "component"))
    estimated_force: Array = field(metadata=unit("N", "time", "axis"))
    estimated_force_band: Array = field(metadata=unit("N", "time", "axis"))
    rigidity: Array = field(metadata=unit("1", "time"))
    target_unreachable: NDArray[np.bool_] = field(metadata=unit("1", "time"))
    change_limited: NDArray[np.bool_] = field(metadata=unit("1", "time"))
    replan_failed: dict[int, str] = field(metadata=unit("1"))
    outcome: Status = field(metadata=unit("1"))
    reason: str = field(metadata=unit("1"))
    states: tuple[PlantState, ...]

    @property
    def arm(self) -> Manipulator:
        """The arm of the plan."""
        return self.plan.arm

    @quantity("s", "time")
    def time(self) -> Array:
        """Time of each step (n,) [s]."""
        return frozen(self.period * np.arange(len(self.tips), dtype=np.float64))

    @quantity("1", "direction", "axis")
    def directions(self) -> Array:
        """Wanted directions u (D, 3), base axes."""
        return self.plan.direction.reshape(-1, 3)

    @quantity("m", "time")
    def tip_error(self) -> Array:
        """Distance of the tip from its planned position at each step (n,) [m]."""
        return frozen(np.linalg.norm(self.tips - self.reference_tips, axis=1))

    @quantity("1", "time", "direction")
    def stiffness_error(self) -> Array:
        """Relative error of the true stiffness, stiffness/target − 1 (n, D) [-]; NaN if unknown."""
        return frozen(self.stiffness / self.target - 1.0)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the tip is inside the first-order band (B,), for the B steps that have a band."""
        known = np.isfinite(self.band)
        return frozen(abs(self.displacement[known]) <= self.band[known] + _ROUNDING)

    @quantity("1")
    def steps_needed(self) -> int:
        """Steps between two samples with which the outer loop can follow the plan's tensions."""
        changes = abs(np.diff(self.plan.tensions, axis=0)) / self.max_change_per_step
        return max(math.ceil(float(changes.max(initial=0.0)) - _ROUNDING), 1)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Faults of the run, worst first; empty if there are none."""
        warnings = []
        if self.outcome is not Status.OK:
            end = self.time.max(initial=0.0)
            warnings.append(f"{self.outcome.title} at {end:.4g} s: {self.reason}")
        if unstable := np.flatnonzero(~(self.margin > 0.0)).tolist():
            warnings.append(f"UNSTABLE {self._at(unstable)}: without friction the arm would buckle")
        if unbalanced := np.flatnonzero(~self.reference_balanced).tolist():
            warnings.append(
                f"OUT OF BALANCE {self._at(unbalanced)}: between samples of the plan no tensions "
                "within the domains of the laws balance the arm; give the path more samples"
            )
        if failed := sorted(self.replan_failed):
            warnings.append(f"NOT PLANNED {self._at(failed)}: {self.replan_failed[failed[0]]}")
        if unreachable := np.flatnonzero(self.target_unreachable).tolist():
            warnings.append(
                f"OUT OF REACH {self._at(unreachable)}: within the bounds no tensions were found "
                "that give the target"
            )
        limited = np.flatnonzero(self.change_limited).tolist()
        if limited and self.steps_needed > self.steps:
            most = abs(np.diff(self.plan.tensions, axis=0)).max()
            warnings.append(
                f"TOO FEW STEPS {self._at(limited)}: tensions of the plan change by up to "
                f"{most:.3g} N from sample to sample, and by max_change_per_step in one step; "
                f"steps={self.steps_needed} would do"
            )
        return tuple(warnings)

    def _at(self, steps: Sequence[int]) -> str:
        """Return text such as ``at 3 of 40 steps, from 0.2 s`` for these numbers of steps."""
        return f"at {len(steps)} of {len(self.time)} steps, from {self.period * steps[0]:.4g} s"

    def to_pandas(self) -> pandas.DataFrame:
        """Return a table over time, which ``cdsm view`` plays; needs pandas (CdsmError)."""
        return super().to_pandas().rename(columns=lambda name: name.removeprefix("angles "))

    def _last_force(self) -> str:
        """Return the last estimate of the force at the tip as text."""
        if not len(self.time):
            return "unknown"
        band = self.estimated_force_band[-1]
        friction = f" ± {coordinates(band, '.2g')} by friction" if band.any() else ""
        return f"{coordinates(self.estimated_force[-1], '.3g')} N{friction}"

    def __repr__(self) -> str:
        return f"<TrackingRun of {self.arm.name}, law {self.law}, {self.outcome.word}>"

    def __str__(self) -> str:
        tip = 1e3 * self.tip_error
        off = 100.0 * abs(self.stiffness_error)
        known = off[np.isfinite(off)]
        clamped = np.flatnonzero(self.saturated.any(axis=0))
        motors = listed([self.arm.cables.names[c] for c in clamped]) if clamped.size else "none"
        low = self.tension.min(initial=math.inf)
        high = self.tension.max(initial=0.0)
        least = f"{np.nanmin(self.margin, initial=math.inf):.4g} {self.arm.stiffness_unit()}"
        inside = self.inside
        bands = plural(self.inside.size, "step")
        rows = [
            ("tip error, mean and largest", f"{_both(tip)} mm"),
            ("frictionless stiffness error, mean and largest", f"{_both(known)} %"),
            ("true tensions at the motors", f"{low:.4g} to {high:.4g} N"),
            ("smallest joint stiffness", least),
            ("motors clamped at a tension bound", motors),
            ("rigidity of the wires, as estimated", f"{100.0 * self.rigidity[-1:].sum():.4g} %"),
            ("force at the tip, as estimated", self._last_force()),
            (
                "inside the first-order band",
                f"{100.0 * inside.mean():.4g} % of {bands}" if inside.size else "no step has one",
            ),
        ]
        end = "completed" if self.outcome is Status.OK else self.outcome.message
        head = f"law {self.law}: {plural(len(self.time), 'step')}, {end}"
        return "\n".join([*self.warnings, head, *aligned(rows)])


def _both(values: Array) -> str:
    return f"{values.mean():.3g}, {values.max():.3g}" if values.size else "unknown"

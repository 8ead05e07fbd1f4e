"""Compute the results for a setting of the controls, or the reason why there are none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

import cdsm
from cdsm.applied import Applied, PlacedForce, acts, placed_forces
from cdsm.errors import CdsmError
from cdsm.loads import link_point, loads_of
from cdsm.manipulator import Manipulator
from cdsm.measures.indices import principal_stiffness
from cdsm.plots.style import tension_colors
from cdsm.posture import Posture
from cdsm.report.remedies import find_remedies
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.events import Event
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.smooth_events import events_under
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.verdict import Finding, Verdict, find_excess
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, distribute_tension
from cdsm.view.ellipsoid import Ellipsoid, ellipsoid
from cdsm.view.holes import hole_lines

Color = tuple[int, int, int]

GREY: Final = (150, 150, 150)
"""Colour of cables with unknown tension."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Setting:
    """Values of the controls in SI units."""

    q: Array  # joint angles (nv,) [rad]; [m] for prismatic joints
    minimum: float  # lower bound of all tensions [N]
    maximum: float = math.inf  # upper bound of all tensions [N]
    force: Array  # in base axes (3,) [N]
    link: str = ""  # on which the force acts; empty: at the tip
    sag: bool = False  # whether the force moves the arm, tensioned without it, motors locked
    pull: Array | None = None  # wire that the motors take in (C,) [m]: the posture follows from it

    @property
    def wrench(self) -> Array | dict[str, Array]:
        """The force as functions take it: W (6,) at the tip, or by its link."""
        W = np.concatenate([self.force, np.zeros(3)])
        return {self.link: W} if self.link else W


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Shown:
    """Results at a setting; a missing result is None, never that of a past setting."""

    setting: Setting
    status: Status  # OK: the arm is stable; else why not, or the cause of an error
    problem: str = ""  # error message, or what qualifies the verdict
    verdict: Verdict | None = None  # on the arm as it is shown
    reference: Posture | None = None  # posture of the setting
    tension: Tension | None = None  # tensions at the reference
    stiffness: Stiffness | None = None  # stiffness at the posture that is shown
    rest: Equilibrium | None = None  # under the force, if the arm sags
    sliding: NDArray[np.bool_] | None = None  # holes (P,) in which a cable slides, if it moved

    @property
    def heading(self) -> str:
        """The verdict as the page has it; the cause, where there are no results."""
        return self.status.title if self.verdict is None else self.verdict.heading

    @property
    def posture(self) -> Posture | None:
        """Posture that is drawn: the equilibrium under the force, or else the reference."""
        return self.reference if self.rest is None else self.rest.pose

    @property
    def tensions(self) -> Array | None:
        """Tensions (C,) [N] at the drawn posture."""
        if self.setting.sag or self.setting.pull is not None:
            return None if self.rest is None else self.rest.tension
        return None if self.tension is None else self.tension.values

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds (C,) [N] of the tensions; motors that hold the wire have no lower one."""
        if self.tension is not None:
            return self.tension.minimum_held, self.tension.maximum_held
        assert self.posture is not None
        own = np.array([cable.maximum for cable in self.posture.arm.cables])
        return np.zeros(own.size), np.minimum(own, self.setting.maximum)

    @property
    def source(self) -> Equilibrium | Stiffness | None:
        """What knows the compliance of the tip; None if the arm is not stable as shown."""
        firm = self.verdict is not None and self.verdict.is_firm
        return (self.rest or self.stiffness) if firm else None

    @cached_property
    def ellipsoid(self) -> Ellipsoid | None:
        """Ellipsoid of displacements of the tip; None if not stable."""
        pose = self.posture
        source = self.source
        if pose is None or source is None:
            return None
        return ellipsoid(source.compliance[:3, :3], pose.tip[:3, 3], pose.arm.length)

    @cached_property
    def principal(self) -> dict[str, Array]:
        """Softest and stiffest directions of the tip, where it is stable."""
        assert self.source is not None
        return principal_stiffness(self.source.compliance[:3, :3])

    @property
    def forces(self) -> list[PlacedForce]:
        """The forces on the drawn posture; none without one, or if they are invalid."""
        pose = self.posture
        if pose is None or self.status is Status.INVALID_INPUT:
            return []
        return placed_forces(pose, loads_of(pose.arm, self.setting.wrench))

    @property
    def loaded_point(self) -> Array:
        """Where the force acts on the drawn posture (3,) [m]."""
        assert self.posture is not None
        return loaded_point(self.posture, self.setting.link)

    @property
    def moved_point(self) -> Array:
        """How far the force moved the point where it acts (3,) [m]."""
        assert self.reference is not None
        return self.loaded_point - loaded_point(self.reference, self.setting.link)

    @property
    def touching(self) -> frozenset[str]:
        """Names of the links that overlap others."""
        pairs = () if self.posture is None else self.posture.self_contacts
        return frozenset(link for pair in pairs for link in pair)

    @cached_property
    def cable_colors(self) -> list[Color]:
        """Red, green and blue, 0 to 255, of each cable by its tension; grey if unknown."""
        if self.tensions is None:
            return [GREY] * (0 if self.posture is None else len(self.posture.arm.cables))
        colors = tension_colors(self.tensions).to_rgba(self.tensions, bytes=True)
        return [(int(r), int(g), int(b)) for r, g, b, _ in colors]

    @cached_property
    def holes(self) -> tuple[Array, Array]:
        """Short lines (n, 2, 3) [m] at the holes where cables stick, and where they slide."""
        pose = self.posture
        if pose is None or self.tensions is None or not pose.arm.has_friction:
            return np.empty((0, 2, 3)), np.empty((0, 2, 3))
        return hole_lines(pose, self.sliding)


def loaded_point(pose: Posture, link: str) -> Array:
    """Return where a force on a link acts (3,) [m]; without a name, at the tip."""
    at = link_point(pose.arm, link or None)
    return pose.tip[:3, 3] if at is None else at.position(pose)


def show(arm: Manipulator, setting: Setting) -> Shown:
    """Compute the results for an arm at a setting; an error is its status and problem."""
    try:
        pose = arm.at(setting.q)
    except CdsmError as error:
        return Shown(setting=setting, status=error.status, problem=str(error))
    results: dict[str, Any] = {"setting": setting, "reference": pose}
    try:
        force = loads_of(arm, setting.wrench)
        if setting.pull is not None:
            rest = cdsm.forward_statics(arm, pull=setting.pull, wrench=force)
            slides = None if rest.sliding is None else rest.sliding != 0
            results |= {"rest": rest, "stiffness": rest.stiffness, "sliding": slides}
            excess = find_excess(arm, rest.tension, setting.maximum)
            history = (rest.history,) if rest.history else ()
            return _judged(results, rest.verdict.with_findings(excess), history)
        wrench = np.zeros(6) if setting.sag else force
        tension = distribute_tension(pose, setting.minimum, setting.maximum, wrench)
        results["tension"] = tension
        if not setting.sag:
            results["stiffness"] = K = stiffness(pose, tension)
            _ = K.compliance  # raises if K_θ is singular
            # remedies take tenths of a second
            return _judged(results, K.verdict, () if K.is_stable else tuple(find_remedies(K)))
        locked = cdsm.stuck_stiffness if arm.has_friction else stiffness
        stable = locked(pose, tension).is_stable
        rest, results["sliding"] = _rest(pose, tension, setting, force)
        results |= {"rest": rest, "stiffness": rest.stiffness}
        _ = rest.compliance
        findings = list(find_excess(arm, rest.tension, setting.maximum))
        if not stable:
            sentence = "UNSTABLE: without the force, the arm moves away from this posture"
            findings.append(Finding(Status.MOVED, sentence))
        elif not arm.has_friction and acts(force):
            locked_arm = LockedArm(pose, tension.values, np.zeros(6))
            findings += _buckling(events_under(locked_arm, force, tension.maximum_held))
        return _judged(results, rest.verdict.with_findings(findings))
    except CdsmError as error:
        problem = "\n".join([str(error), *pose.remarks])
        return Shown(**results, status=error.status, problem=problem)


def _judged(results: dict[str, Any], verdict: Verdict, notes: Sequence[object] = ()) -> Shown:
    """Return results with the verdict on the arm, and notes such as what would make it stable."""
    status = Status.OK if verdict.is_held else verdict.status
    problem = "\n".join([*verdict.warnings, *map(str, notes)])
    return Shown(**results, verdict=verdict, status=status, problem=problem)


def _buckling(events: Sequence[Event]) -> Iterator[Finding]:
    """Yield that the arm buckled, if it lost its stability before the whole force acts."""
    for event in events:
        if event.kind == "buckling":
            label = f"BUCKLED at {event.load:.4g} N"
            yield Finding(Status.MOVED, f"{label}, {event.place} most", label)
            return


def _rest(
    pose: Posture, tension: Tension, setting: Setting, wrench: Applied
) -> tuple[Equilibrium, NDArray[np.bool_] | None]:
    """Return the equilibrium under a load with locked motors, and the holes where cables slide."""
    if not pose.arm.has_friction:
        return cdsm.equilibrium(pose, tension, wrench), None
    row = np.concatenate([setting.force, np.zeros(3)])[None]
    history = cdsm.load_cycle(pose, tension, {setting.link: row} if setting.link else row)
    rest = Equilibrium(
        reference=pose,
        reference_tension=tension.values,
        stiffness=history.stiffness(-1),
        stop_torque=frozen(history.stop_torque[-1].copy()),
        model=LockedArm(pose, tension.values, wrench),
    )
    return rest, history.sliding[-1] != 0

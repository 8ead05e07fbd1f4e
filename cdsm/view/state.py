"""Compute the results for a setting of the controls, or the reason why there are none."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError, EquilibriumError, InvalidInput
from cdsm.friction.stick import can_stick, stuck_stiffness
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import Ellipsoid, color_scale, ellipsoid
from cdsm.posture import Posture
from cdsm.statics.equilibrium import Equilibrium, equilibrium
from cdsm.statics.load_cycle import LoadHistory, load_cycle
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.instability import verdict
from cdsm.stiffness_matrix.principal import principal_stiffness
from cdsm.support.status import Status
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import DEFAULT_SOLVER, Tension, distribute_tension

GREY: Final = (150, 150, 150)
"""Colour of cables with unknown tension."""

ELLIPSOID: Final = (200, 85, 61)
FORCE: Final = (59, 111, 182)
STICKS: Final = (40, 40, 45)
SLIDES: Final = (220, 38, 127)

_BEAD: Final = 0.013  # half the length of the mark of a hole, as a fraction of the arm's length


class Condition(Enum):
    """State of the arm at a setting, or why it is unknown; the value is the text on the page."""

    STABLE = "STABLE"
    UNSTABLE = "UNSTABLE"
    SINGULAR = "ABOUT TO BUCKLE"
    LEFT_REFERENCE = "LEFT ITS REFERENCE"
    NEUTRAL = "NEUTRAL"
    NO_EQUILIBRIUM = "NO EQUILIBRIUM FOUND"
    INFEASIBLE = "INFEASIBLE"
    OUTSIDE_ELASTICITY = "OUTSIDE THE ELASTICITY"
    NO_POSTURE = "NO POSTURE"
    INVALID = "INVALID SETTING"
    FAILED = "FAILED"


_CONDITIONS: Final[dict[Status | None, Condition]] = {
    Status.INFEASIBLE: Condition.INFEASIBLE,
    Status.OUTSIDE_ELASTICITY: Condition.OUTSIDE_ELASTICITY,
    Status.SINGULAR: Condition.SINGULAR,
    Status.BEYOND_LIMITS: Condition.NO_POSTURE,
    Status.COINCIDENT_SITES: Condition.NO_POSTURE,
}

_PROBLEMS: Final = {
    Condition.LEFT_REFERENCE: "The arm is unstable where its motors are locked. It left this "
    "posture without any force, and rests where it is shown.",
    Condition.NEUTRAL: "No cable brings back every joint: the arm rests here, but not firmly.",
}


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Setting(ReadOnlyState):
    """Values of the controls in SI units.

    Attributes:
        q: Joint angles (nv,) [rad]; [m] for prismatic joints.
        minimum: Lower bound of all tensions [N].
        maximum: Upper bound of all tensions [N].
        force: Force at the tip, in base axes (3,) [N].
        sag: Whether the force moves the arm. If True, the cables are tensioned at ``q`` without
            the force, the motors are locked, and the arm sags under the force; where holes have
            friction, cables stick and slide in them. If False, the tensions balance the force at
            ``q``.
        solver: Solver of the tension distribution.
    """

    q: Array
    minimum: float
    maximum: float = math.inf
    force: Array
    sag: bool = False
    solver: str = DEFAULT_SOLVER

    def __post_init__(self) -> None:
        # not checked here: the page shows an invalid value as a condition
        for name in ("q", "force"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Shown(ReadOnlyState):
    """Results on the page at one setting. A missing result is None, never that of a past setting.

    Attributes:
        setting: Values of the controls.
        condition: Whether the arm is stable, or why not, or what went wrong: a :class:`Condition`.
        problem: Error message, or the reason why the arm is not stable. For a stable arm that
            passes through itself, a sentence that says so. Otherwise empty.
        reference: Posture of the setting. None if its angles are invalid or beyond a limit, or
            sites of a cable coincide.
        tension: Tensions at the reference; None if none balance the arm.
        stiffness: Stiffness at the posture that is shown. None if no tensions or no equilibrium
            were found, or a tension is outside the domain of the law.
        rest: Equilibrium under the force; None if the arm does not sag, or none was found.
        history: Load history from the reference to ``rest``; None if the arm has no friction or
            ``rest`` is None.
    """

    setting: Setting
    condition: Condition
    problem: str = ""
    reference: Posture | None = None
    tension: Tension | None = None
    stiffness: Stiffness | None = None
    rest: Equilibrium | None = None
    history: LoadHistory | None = None

    @property
    def posture(self) -> Posture | None:
        """Posture that is drawn: the equilibrium under the force, or else the reference.

        None if neither exists.
        """
        return self.reference if self.rest is None else self.rest.pose

    @property
    def tensions(self) -> Array | None:
        """Tensions (C,) [N] at the drawn posture; None if unknown."""
        if self.setting.sag:
            return None if self.rest is None else self.rest.tension
        return None if self.tension is None else self.tension.values

    @cached_property
    def compliance(self) -> Array | None:
        """Compliance C_vv (3, 3) [m/N] of the tip; None if the arm is not stable as shown."""
        if self.condition not in (Condition.STABLE, Condition.LEFT_REFERENCE):
            return None
        source = self.rest or self.stiffness
        return None if source is None else source.compliance[:3, :3]

    @cached_property
    def along(self) -> Array | None:
        """Stiffness along x, y, z (3,) [N/m], inf if the tip cannot move; None if not stable."""
        source = self.rest or self.stiffness
        if self.compliance is None or source is None:
            return None
        return frozen(np.array([source.along(axis) for axis in np.eye(3)]))

    @cached_property
    def principal(self) -> dict[str, Array] | None:
        """Softest and stiffest direction, and the stiffness along each [N/m]; None if not stable.

        The keys are those of :func:`~cdsm.stiffness_matrix.principal.principal_stiffness`.
        """
        return None if self.compliance is None else principal_stiffness(self.compliance)

    @cached_property
    def cable_colors(self) -> NDArray[np.uint8] | None:
        """Red, green and blue (C, 3), 0 to 255, of each cable, by its tension.

        All cables are grey if their tensions are unknown. None if no posture exists.
        """
        if self.posture is None:
            return None
        if self.tensions is None:
            return frozen(np.full((len(self.posture.arm.cables), 3), GREY, dtype=np.uint8))
        colors = color_scale(self.tensions).to_rgba(self.tensions, bytes=True)
        return frozen(np.asarray(colors, dtype=np.uint8)[:, :3].copy())

    @cached_property
    def holes(self) -> tuple[Array, Array]:
        """Short lines (n, 2, 3) [m] at the holes where cables stick, and at those where they slide.

        Holes without friction, and holes that a cable passes straight, have no line. Cables
        slide only if the force moves the arm (``sag``); else the second array is empty.
        """
        pose = self.posture
        if pose is None or self.tensions is None or not pose.arm.has_friction:
            return np.empty((0, 2, 3)), np.empty((0, 2, 3))
        chains = pose.segments.chains
        slides = np.zeros(chains.hole.size, dtype=np.bool_)
        if self.history is not None:
            slides = self.history.sliding[-1] != 0
        where = zip(chains.cable[chains.hole], chains.site, strict=True)
        spans = np.array([pose.cable_paths[c][i : i + 2] for c, i in where])
        along = spans[:, 1] - spans[:, 0]
        along *= _BEAD * pose.arm.length / np.linalg.norm(along, axis=1, keepdims=True)
        lines = spans[:, :1] + np.stack([-along, along], axis=1)
        return frozen(lines[can_stick(pose) & ~slides]), frozen(lines[slides])

    @cached_property
    def ellipsoid(self) -> Ellipsoid | None:
        """Ellipsoid of displacements, as in :func:`cdsm.plots.plot_arm`; None if not stable."""
        pose = self.posture
        if self.compliance is None or pose is None:
            return None
        return ellipsoid(self.compliance, pose.tip[:3, 3], pose.arm.length)


def show(arm: Manipulator, setting: Setting) -> Shown:
    """Compute the results for an arm at a setting.

    A CdsmError is not raised: it determines the ``condition``, and its text is the ``problem``.
    """
    pose = tension = K = rest = history = None
    condition, problem = Condition.STABLE, ""
    try:
        pose = arm.at(setting.q)
        force, none = np.concatenate([setting.force, np.zeros(3)]), np.zeros(6)
        wrench = none if setting.sag else force
        tension = distribute_tension(pose, setting.minimum, setting.maximum, wrench, setting.solver)
        if setting.sag:
            locked = stuck_stiffness if arm.has_friction else stiffness
            stable = locked(pose, tension).is_stable
            if arm.has_friction:
                history = load_cycle(pose, tension, force[None])
            rest = equilibrium(pose, tension, force) if history is None else _rest(history)
            K = rest.stiffness
            _ = rest.compliance
            condition = Condition.STABLE if stable else Condition.LEFT_REFERENCE
            condition = condition if rest.stable else Condition.NEUTRAL
        else:
            K = stiffness(pose, tension)
            _ = K.compliance  # raises if K_θ is singular: its margin is only rounding error
            condition = Condition.STABLE if K.is_stable else Condition.UNSTABLE
        problem = _PROBLEMS.get(condition, "\n".join(K.posture.remarks))
        if condition is Condition.UNSTABLE:
            problem = verdict(K)
    except InvalidInput as error:
        condition, problem = Condition.INVALID, str(error)
    except EquilibriumError as error:
        condition, problem = Condition.NO_EQUILIBRIUM, str(error)
    except CdsmError as error:
        condition, problem = _CONDITIONS.get(Status.of(error), Condition.FAILED), str(error)
    return Shown(
        setting=setting,
        condition=condition,
        problem=problem,
        reference=pose,
        tension=tension,
        stiffness=K,
        rest=rest,
        history=history,
    )


def _rest(history: LoadHistory) -> Equilibrium:
    """Return the last state of ``history`` as an equilibrium, with the tangent K_θ there."""
    return Equilibrium(
        reference=history.reference,
        reference_tension=history.reference_tension,
        stiffness=history.stiffness(-1),
        stop_torque=frozen(history.stop_torque[-1].copy()),
    )

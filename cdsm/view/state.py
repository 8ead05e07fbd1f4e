"""What the page shows at a setting of the sliders: results, or why there are none."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError, InvalidInput
from cdsm.kernels.principal import principal_stiffness
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import ellipsoid, tension_colors
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.status import Status
from cdsm.support.validation import Array, ReadOnlyState, frozen
from cdsm.tension import DEFAULT_SOLVER, Tension, distribute_tension

GREY: Final = (150, 150, 150)
"""Colour of cables whose tension is not known."""


class Condition(Enum):
    """State of the arm at a setting; the value is what the page says."""

    STABLE = "STABLE"
    UNSTABLE = "UNSTABLE"
    SINGULAR = "ABOUT TO BUCKLE"
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


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Setting(ReadOnlyState):
    """Where the sliders stand, in SI units.

    Attributes:
        q: Joint angles (nv,) [rad]; [m] where a joint slides.
        minimum: Lower bound of all tensions [N].
        maximum: Upper bound of all tensions [N].
        force: At the tip, in base axes (3,) [N].
        solver: Of the tension distribution.
    """

    q: Array
    minimum: float
    maximum: float = math.inf
    force: Array
    solver: str = DEFAULT_SOLVER

    def __post_init__(self) -> None:
        # not checked here: a wrong value becomes a condition that the page shows
        for name in ("q", "force"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Shown(ReadOnlyState):
    """What the page shows at one setting. What does not exist there is None, never an old value.

    Attributes:
        setting: Where the sliders stand.
        condition: State of the arm.
        problem: Why something is missing, in the words of the error; empty for a stable arm.
        posture: None where there is none: beyond a limit, or two sites of a cable meet.
        tension: None where nothing balances the arm.
        stiffness: None where the tensions are missing or outside the elasticity.
    """

    setting: Setting
    condition: Condition
    problem: str = ""
    posture: Posture | None = None
    tension: Tension | None = None
    stiffness: Stiffness | None = None

    @property
    def _stable(self) -> Stiffness | None:
        return self.stiffness if self.condition is Condition.STABLE else None

    @cached_property
    def along(self) -> Array | None:
        """Stiffness along x, y and z (3,) [N/m], inf where nothing moves; of a stable arm only."""
        K = self._stable
        return None if K is None else frozen(np.array([K.along(axis) for axis in np.eye(3)]))

    @cached_property
    def principal(self) -> dict[str, Array] | None:
        """Softest and stiffest direction and the stiffness [N/m] there; of a stable arm only."""
        K = self._stable
        return None if K is None else principal_stiffness(K.compliance[:3, :3])

    @cached_property
    def cable_colors(self) -> NDArray[np.uint8] | None:
        """Red, green and blue of each cable (C, 3): by tension, grey where it is not known."""
        if self.posture is None:
            return None
        if self.tension is None:
            return frozen(np.full((len(self.posture.arm.cables), 3), GREY, dtype=np.uint8))
        colors = tension_colors(self.tension).to_rgba(self.tension.values, bytes=True)
        return frozen(np.asarray(colors, dtype=np.uint8)[:, :3].copy())

    @cached_property
    def ellipsoid(self) -> Array | None:
        """Where forces of one size move the tip, (3, rows, columns) [m]; of a stable arm only.

        The surface that :func:`cdsm.plots.plot_arm` draws.
        """
        K = self._stable
        drawn = None if K is None else ellipsoid(K)
        return None if drawn is None else frozen(drawn.surface)


def show(arm: Manipulator, setting: Setting) -> Shown:
    """Compute what the page shows of an arm at a setting; every error becomes a condition."""
    pose = tension = K = None
    try:
        pose = arm.at(setting.q)
        wrench = np.concatenate([setting.force, np.zeros(3)])
        tension = distribute_tension(pose, setting.minimum, setting.maximum, wrench, setting.solver)
        K = stiffness(pose, tension)
        _ = K.compliance  # refuses a singular K_θ, whose margin is rounding
    except CdsmError as error:
        condition = _CONDITIONS.get(Status.of(error), Condition.FAILED)
        if isinstance(error, InvalidInput):
            condition = Condition.INVALID
        problem = str(error)
    else:
        condition, problem = Condition.STABLE, ""
        if not K.is_stable:
            condition = Condition.UNSTABLE
            problem = "K_θ is not positive definite: the arm buckles under these tensions."
    return Shown(
        setting=setting,
        condition=condition,
        problem=problem,
        posture=pose,
        tension=tension,
        stiffness=K,
    )

"""Compute the results for a setting of the sliders, or the reason why they do not exist."""

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
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import DEFAULT_SOLVER, Tension, distribute_tension

GREY: Final = (150, 150, 150)
"""Colour of cables with unknown tension."""


class Condition(Enum):
    """State of the arm at a setting; the value is the text on the page."""

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
    """Values of the sliders in SI units.

    Attributes:
        q: Joint angles (nv,) [rad]; [m] where a joint slides.
        minimum: Lower bound of all tensions [N].
        maximum: Upper bound of all tensions [N].
        force: Force at the tip, in base axes (3,) [N].
        solver: Solver of the tension distribution.
    """

    q: Array
    minimum: float
    maximum: float = math.inf
    force: Array
    solver: str = DEFAULT_SOLVER

    def __post_init__(self) -> None:
        # not checked here: the page shows an invalid value as a condition
        for name in ("q", "force"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name))))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Shown(ReadOnlyState):
    """Results on the page at one setting. A result that does not exist is None, never outdated.

    Attributes:
        setting: Values of the sliders.
        condition: State of the arm.
        problem: Error message, or why the arm is unstable; empty for a stable arm.
        posture: None if the angles are invalid or beyond a limit, or sites of a cable coincide.
        tension: None if no tensions balance the arm.
        stiffness: None if the tensions are missing or outside the domain of the law.
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
        """Stiffness along x, y, z (3,) [N/m], inf if the tip cannot move; None if not stable."""
        K = self._stable
        return None if K is None else frozen(np.array([K.along(axis) for axis in np.eye(3)]))

    @cached_property
    def principal(self) -> dict[str, Array] | None:
        """Softest and stiffest direction and their stiffness [N/m]; None if not stable."""
        K = self._stable
        return None if K is None else principal_stiffness(K.compliance[:3, :3])

    @cached_property
    def cable_colors(self) -> NDArray[np.uint8] | None:
        """Red, green and blue of each cable (C, 3), by tension; grey if it is unknown."""
        if self.posture is None:
            return None
        if self.tension is None:
            return frozen(np.full((len(self.posture.arm.cables), 3), GREY, dtype=np.uint8))
        colors = tension_colors(self.tension).to_rgba(self.tension.values, bytes=True)
        return frozen(np.asarray(colors, dtype=np.uint8)[:, :3].copy())

    @cached_property
    def ellipsoid(self) -> Array | None:
        """Ellipsoid of :func:`cdsm.plots.plot_arm` (3, rows, columns) [m]; None if not stable."""
        return None if self._stable is None else ellipsoid(self._stable)


def show(arm: Manipulator, setting: Setting) -> Shown:
    """Compute the results for an arm at a setting; every error becomes a condition."""
    pose = tension = K = None
    condition, problem = Condition.STABLE, ""
    try:
        pose = arm.at(setting.q)
        wrench = np.concatenate([setting.force, np.zeros(3)])
        tension = distribute_tension(pose, setting.minimum, setting.maximum, wrench, setting.solver)
        K = stiffness(pose, tension)
        _ = K.compliance  # raises if K_θ is singular: its margin is only rounding error
        if not K.is_stable:
            condition = Condition.UNSTABLE
            problem = "K_θ is not positive definite: the arm buckles under these tensions."
    except InvalidInput as error:
        condition, problem = Condition.INVALID, str(error)
    except CdsmError as error:
        condition, problem = _CONDITIONS.get(Status.of(error), Condition.FAILED), str(error)
    return Shown(
        setting=setting,
        condition=condition,
        problem=problem,
        posture=pose,
        tension=tension,
        stiffness=K,
    )

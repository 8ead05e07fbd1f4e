"""True stiffness of a plant in a given state, and the band of its tip.

With friction, the measured stiffness depends on the size and on the history of the load. Here the
true stiffness of a state is the frictionless K_θ at the equilibrium that the arm would have without
friction, with the same wire in every cable and the same load. Small weights measure the stuck arm,
which is several times stiffer.

Around this equilibrium lies the first-order band (:func:`cdsm.rest_band`) in which friction can let
the tip rest, whatever loads came before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.control.plant import PlantState
from cdsm.errors import CdsmError, SingularStiffness
from cdsm.friction.stick import half_width
from cdsm.statics.equilibrium import locked_equilibrium
from cdsm.statics.locked_arm import LockedArm
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array


class Assessment(NamedTuple):
    """True stiffness of a plant in one state, and the band in which friction can let its tip rest.

    Values that do not exist are NaN.
    """

    tip: Array  # tip (3,) [m] at the equilibrium without friction
    stiffness: list[float]  # stiffness along each direction (D,) [N/m] there
    margin: float  # smallest eigenvalue of K_θ [N m/rad] there
    band: float  # half-width [m] of the first-order band along the first direction


def assess(state: PlantState, wrench: Array, directions: Array) -> Assessment:
    """Compute the true stiffness [N/m] of a state along each of ``directions`` (D, 3).

    ``wrench`` (6,) is the load.
    """
    nan = math.nan
    try:
        K = frictionless_stiffness(state, wrench)
    except CdsmError:
        return Assessment(np.full(3, nan), [nan] * len(directions), nan, nan)
    rough = K.posture.arm.has_friction and K.is_stable
    band = half_width(K, directions[0]) if rough else nan
    return Assessment(K.posture.tip[:3, 3], [_along(K, u) for u in directions], K.margin, band)


def _along(K: Stiffness, u: Array) -> float:
    """Return the stiffness along u [N/m]; NaN if K_θ is singular."""
    try:
        return K.along(u)
    except SingularStiffness:
        return math.nan


def frictionless_stiffness(state: PlantState, wrench: Array) -> Stiffness:
    """Return K_θ at the equilibrium that the arm of ``state`` would have without friction.

    The cables have the wire of ``state``, and ``wrench`` (6,) is the load.

    Raises:
        EquilibriumError: There is no equilibrium: the arm buckles.
        ElasticityRangeError: A tension leaves the domain of its law.
    """
    pose, (wire, F) = state.pose, state.true
    return locked_equilibrium(LockedArm(pose, F, wrench, wire)).stiffness

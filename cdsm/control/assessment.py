"""True stiffness of a plant in a given state, the band of its tip, and a test with a hung weight.

With friction, the measured stiffness depends on the size and on the history of the load. Here the
true stiffness of a state is the frictionless K_θ at the equilibrium that the arm would have without
friction, with the same wire in every cable and the same load. A weight hung on the arm measures
this stiffness if the load is shaken before and after (:func:`hung_weight`). Without shaking, small
weights measure the stuck arm, which is several times stiffer.

The band is the interval around this equilibrium in which friction can let the tip rest, whatever
loads came before. Linear programs prove it (:func:`cdsm.friction.band.rest_band`); if they cannot,
the band is NaN.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdsm.control.plant import PlantState, SlowPlant, SlowState
from cdsm.errors import CdsmError, SingularStiffness
from cdsm.friction.band import rest_band
from cdsm.friction.breakaway import breakaway
from cdsm.statics.locked_motors import LoadedArm, lengths_with
from cdsm.statics.rest_search import no_rest
from cdsm.statics.slow_loading import Load
from cdsm.statics.trust_region import find_rest
from cdsm.statics.weight_friction import fading
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array

_CYCLES: Final = 4
"""Number of cycles in which the shaking of a hung weight fades out."""

_SHAKEN: Final = 3.0  # amplitude of the shaking over the breakaway load; with it all cables slide
_DISPLACED: Final = 1e-3  # displacement that the weight causes, over the length of the arm


class Assessment(NamedTuple):
    """True stiffness of a plant in one state, and the band in which friction can let its tip rest.

    Values that do not exist are NaN.
    """

    tip: Array  # tip (3,) [m] at the equilibrium without friction
    stiffness: list[float]  # stiffness along each direction (D,) [N/m] there
    margin: float  # smallest eigenvalue of K_θ [N m/rad] there
    # least and largest proved displacement from ``tip`` along the first direction [m]
    band: tuple[float, float]


def assess(state: PlantState, wrench: Array, directions: Array, *, banded: bool) -> Assessment:
    """Compute the true stiffness [N/m] of a state along each of ``directions`` (D, 3).

    ``wrench`` (6,) is the load. If ``banded`` is True, also compute the proved band of the tip
    along the first direction.
    """
    nan = math.nan
    try:
        K = frictionless_stiffness(state, wrench)
    except CdsmError:
        return Assessment(np.full(3, nan), [nan] * len(directions), nan, (nan, nan))
    ends = nan, nan
    if banded and K.is_stable:
        band = rest_band(K.posture, K.tension, directions[0], K.wrench)
        ends = (band.low, band.high) if band.proved else ends
    return Assessment(K.posture.tip[:3, 3], [_along(K, u) for u in directions], K.margin, ends)


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
    held = pose.arm.cables.position_controlled
    loaded = LoadedArm(pose, F, wrench, lengths_with(wire[held], pose, F))
    search = find_rest(loaded, loaded.at(pose, F))
    K = search.state.K
    if not search.converged:
        raise no_rest(pose, search, 0.0)
    loaded.require_domains(K.tension)
    return K


def hung_weight(plant: SlowPlant, state: SlowState, u: Array) -> float:
    """Hang a weight on a plant with its motors stopped; return the stiffness [N/m] along u (3,).

    ``state`` is the state of the plant before the weight is hung.

    If the arm has friction, the load is shaken along u, first without the weight and then with it.
    The first amplitude is three times the breakaway load, at which the first cable slides; the
    shaking fades in four cycles. The weight moves the tip by about 0.1 % of the arm's length. The
    result is NaN if no equilibrium is found on the way or the arm is about to buckle, and inf if
    the tip cannot move along u.
    """
    arm, load, tips = plant.arm, state.state.load, []
    try:
        near = frictionless_stiffness(state, load.wrench)
        weight = near.along(u) * _DISPLACED * arm.length
        if not math.isfinite(weight):
            return math.inf
        swing = _SHAKEN * breakaway(near.posture, near.tension, u, near.wrench).load
        for hung in (0.0, weight):
            for force in (*(hung + fading(swing, _CYCLES) if arm.has_friction else ()), hung):
                wrench = load.wrench + np.append(force * u, np.zeros(3))
                state = plant.load(state, Load(wrench, load.holding, load.motors))
            tips.append(state.pose.tip[:3, 3])
    except CdsmError:
        return math.nan
    return weight / float(u @ (tips[1] - tips[0]))

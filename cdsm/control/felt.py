"""Stiffness felt at the tip: motors pull as a weight would, and sensors tell how far the tip goes.

A force f at the tip loads the joints with J_vᵀ f. Changes x of the tensions load them alike if
−J_Lᵀ x = J_vᵀ f. Motors that pay out the wire −x/κ, with κ = −∂F/∂l_0 of each cable, move the
joints as f does. Wire and tension give the posture before and after. So the controller checks the
whole of K_θ with the sensors that it has.

Without friction this is the stiffness. Under friction it is too high: holes keep part of a motor's
pull from the joints, and the estimate does not know all of it.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from cdsm.control.estimates import Estimate, Observer
from cdsm.control.laws import Command, Reading
from cdsm.control.plant import Plant, PlantState
from cdsm.errors import CdsmError
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.values import Array

_DISPLACED: Final = 5e-3
"""Displacement of the tip either way, over the length of the arm."""

_RESERVE: Final = 0.5
"""Largest part of the way to a bound of a tension that the excitation goes."""

_READINGS: Final = 64
"""Readings of the load cells that are averaged at rest."""


def virtual_force(pose: Posture, gain: Array, force: Array) -> Array:
    """Compute the wire (C,) [m] to pay out that moves the joints as a force at the tip does.

    Args:
        pose: The posture.
        gain: κ of each cable (C,) [N/m]; 0 where the motor itself holds the tension.
        force: f (3,) [N], base axes.
    """
    held = gain > 0.0
    J, wire = pose.length_jacobian[held], np.zeros(gain.size)
    x = np.linalg.lstsq(J.T, -pose.jacobian[:3].T @ force, rcond=None)[0]
    wire[held] = -x / gain[held]
    return wire


def felt_stiffness(
    plant: Plant[Any],
    state: PlantState,
    wrench: Array,
    observer: Observer,
    estimate: Estimate,
    bounds: tuple[Array, Array],
    u: Array,
    random: np.random.Generator,
) -> float:
    """Excite an arm both ways along u (3,) with its motors; return the stiffness felt [N/m].

    The arm is a copy: ``state`` does not change. The tip moves by 0.5 % of the arm, or less where
    half the way to a bound of a tension is reached. NaN if the arm finds no rest, if the controller
    believes in an arm that gives way, or if a tension is at its bound.
    """
    wire, F = observer.sensors.read([state.true], random)
    gain = observer.gain(estimate, Reading(wire, F))
    per_newton = virtual_force(estimate.pose, gain, u)
    change = abs(gain * per_newton)
    room = np.minimum(F - bounds[0], bounds[1] - F)[change > 0.0]
    most = _RESERVE * float(np.min(room / change[change > 0.0], initial=math.inf))
    try:
        load = np.append(estimate.force, np.zeros(3))
        K = stiffness(estimate.pose, estimate.tension, load)
        force = min(K.along(u) * _DISPLACED * estimate.pose.arm.length, most)
        if not (K.is_stable and 0.0 < force < math.inf):
            return math.nan
        places = []
        for pull in (-force, force):
            command = Command(wire + pull * per_newton, F, np.zeros(F.size, dtype=np.bool_))
            state = plant.move(state, command, wrench)
            readings = [observer.sensors.read([state.true], random) for _ in range(_READINGS)]
            tension = np.mean([reading.tension for reading in readings], axis=0)
            estimate = observer.update(estimate, Reading(readings[0].wire, tension))
            places.append(float(u @ estimate.pose.tip[:3, 3]))
    except CdsmError:
        return math.nan
    return 2.0 * force / (places[1] - places[0])

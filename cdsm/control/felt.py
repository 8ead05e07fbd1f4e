"""Stiffness measured with the motors: they move the tip, and sensors give its displacement.

A force f at the tip causes the joint torques J_vᵀ f, with the translational rows J_v of the tip
Jacobian. Changes x of the tensions cause the same torques if −J_Lᵀ x = J_vᵀ f. Motors that pay out
the wire −x/κ, with κ = −∂F/∂l_0 of each cable, move the joints as f does. The controller estimates
the posture before and after from wire and tension, and so measures the stiffness with its own
sensors.

Without friction the result is the stiffness. With friction the result is too high: friction reduces
the effect of the motors on the joints, and the estimated posture does not include all of this
effect.
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

_DISPLACED: Final = 5e-3  # displacement of the tip in each direction, over the length of the arm

_RESERVE: Final = 0.5
"""Largest change of a tension by the motors, divided by its distance from the nearest bound."""

_READINGS: Final = 64  # number of load cell readings that are averaged at rest


def virtual_force(pose: Posture, gain: Array, force: Array) -> Array:
    """Compute the wire (C,) [m] that motors pay out to imitate a ``force`` (3,) [N] at the tip.

    The wire moves the joints as the force would. ``gain`` is κ = −∂F/∂l_0 of each cable (C,) [N/m];
    0 for force-controlled cables.
    """
    locked = gain > 0.0
    J, wire = pose.length_jacobian[locked], np.zeros(gain.size)
    x = np.linalg.lstsq(J.T, -pose.jacobian[:3].T @ force, rcond=None)[0]
    wire[locked] = -x / gain[locked]
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
    """Move the tip along ±u (3,) with the motors; return the measured stiffness [N/m].

    ``state`` does not change, since the plant moves a copy. The tip moves by 0.5 % of the arm's
    length either way. It moves less if a tension would otherwise cover more than half of the
    distance to one of its ``bounds`` (lower, upper). ``observer`` updates ``estimate`` with
    readings, whose noise comes from ``random``. The result is NaN if no equilibrium is found, if
    the estimated arm is unstable, or if a tension is at its bound.
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
        for part in (-force, force):
            command = Command(wire + part * per_newton, F, np.zeros(F.size, dtype=np.bool_))
            state = plant.move(state, command, wrench)
            readings = [observer.sensors.read([state.true], random) for _ in range(_READINGS)]
            tension = np.mean([reading.tension for reading in readings], axis=0)
            estimate = observer.update(estimate, Reading(readings[0].wire, tension))
            places.append(float(u @ estimate.pose.tip[:3, 3]))
    except CdsmError:
        return math.nan
    return 2.0 * force / (places[1] - places[0])

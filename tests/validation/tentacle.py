"""The measured silicone tentacle: its markers, and what cdsm predicts of them."""

from functools import cache
from pathlib import Path

import numpy as np

import cdsm
from cdsm.support.values import Array

_TABLE = np.loadtxt(
    Path(__file__).parents[1] / "data" / "silicone_tentacle.csv", delimiter=",", skiprows=3
)
MOTORS = _TABLE[::4, 0].astype(int)
TENSIONS = _TABLE[::4, 1]
"""Motor that pulls, from 1, and its tension (8,) [N]; the other one is loose."""

MARKERS = _TABLE[:, 3:].reshape(8, 4, 3)
"""Measured markers (8, 4, 3) [mm] in their base axes, of which z is up."""

PLACES = (0.1291, 0.2195, 0.28, 0.36)
"""Distance of each marker from the base along the straight tentacle [m]."""

OFFSETS = np.array([[0.0, 0.0, 25.0], [0.0, 0.0, -21.0], [0.0, 0.0, 20.0], [8.0, 0.0, 0.0]]) / 1e3
"""Offset of each marker from the axis, in the frame of the body there [m]."""


def markers(pose: cdsm.Posture) -> Array:
    """Markers (4, 3) [mm] of a posture, in their base axes."""
    straight = pose.arm.at(np.zeros(pose.arm.nv))
    links = [body.name for body in pose.arm.geometry.chain.bodies[1:] if body.kind != "cross"]
    begin = np.array([straight.link_pose(link)[0, 3] for link in links])
    found = []
    for place, offset in zip(PLACES, OFFSETS, strict=True):
        at = int(np.flatnonzero(begin < place)[-1])
        here = [place - begin[at] + offset[0], *offset[1:], 1.0]
        x, y, z = (pose.link_pose(links[at]) @ here)[:3]
        found.append([z, y, -x])
    return 1e3 * np.array(found)


@cache
def predicted(E: float, mu: float, density: float) -> Array:
    """Markers (8, 4, 3) [mm] at the measured tensions; E in kPa."""
    arm = cdsm.presets.silicone_tentacle(1e3 * E, mu, density)
    shapes = []
    for motor, tension in zip(MOTORS, TENSIONS, strict=True):
        pulls = np.where([motor == 1, motor == 2], tension, 0.0)
        shapes.append(markers(cdsm.forward_statics(arm, tension=pulls).pose))
    return np.array(shapes)


def straight() -> Array:
    """Markers (4, 3) [mm] where nothing pulls."""
    arm = cdsm.presets.silicone_tentacle()
    return markers(arm.at(np.zeros(arm.nv)))

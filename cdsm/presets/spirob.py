"""A SpiRob: an arm of TPU in the shape of a spiral, whose flexures are no linear springs."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.cable_path import Site
from cdsm.manipulator import Manipulator
from cdsm.presets.bodies import JOINT_AXES, SerialBody, chain
from cdsm.springs import SpringLaw
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

_SEGMENTS: Final = (
    (51.797, 40.863, 14.288, 38.429, 44.899),
    (47.529, 36.855, 12.887, 34.593, 41.319),
    (43.612, 33.176, 11.601, 31.074, 38.034),
    (40.018, 29.801, 10.420, 27.844, 35.020),
    (36.721, 26.704, 9.337, 24.881, 32.254),
    (33.695, 23.862, 8.344, 22.162, 29.716),
    (30.918, 21.254, 7.432, 19.667, 27.388),
    (28.370, 18.862, 6.595, 17.378, 25.251),
    (26.032, 16.666, 5.827, 15.277, 23.290),
    (23.887, 14.651, 5.123, 13.349, 21.491),
    (21.919, 12.802, 4.477, 11.580, 19.840),
    (20.113, 11.106, 3.883, 9.957, 18.325),
    (18.455, 9.549, 3.339, 8.468, 16.935),
    (16.935, 8.121, 2.840, 7.101, 15.660),
)  # [mm], base to tip: length; radius of a hole and its place, near the base and near the end
_LONGEST: Final = 45.880, 51.797  # half the width of the first segment over its length [mm]
_DENSITY: Final = 1100.0  # of TPU [kg/m³]
_LIMIT: Final = math.radians(29.43)

MEASURED_JOINTS: Final = (1, 8, 11, 13)
"""Hinges of the SpiRob whose torque was measured, counted from the base."""

TANGENTS: Final = (1.221, 0.424, 0.708, 0.563)
EXPONENTS: Final = (0.531, 0.780, 0.637, 0.740)
"""Laws of these: k at rest [N m/rad] with a scale of 2°, and exponent."""


def spirob(
    friction: float = 0.0,
    elasticity: Elasticity = LinearElasticity(1e4),  # noqa: B008  # frozen
    *,
    gravity: ArrayLike = (0.0, -9.81, 0.0),
) -> Manipulator:
    """Build a SpiRob with 13 parallel hinges of TPU and two cables, whose joint laws were measured.

    Fourteen segments get shorter by 8.2 % each, 440 mm in all; a cable on each side runs through
    two holes of every segment. Motors hold the tensions. Hinges turn about y, up to ±29.4°. Source:
    arben24/spirob-mjlab-sysid on GitHub, commit e67ff90, whose licence is not stated. **Measured**
    there: torques at 5 to 30° of hinges 1, 8, 11 and 13. **Fitted here** to these by
    :func:`cdsm.fit_spring`, apart from points at a stop: a law of each. Assumed: a scale of 2°,
    below which no point tells the law; laws of the other hinges in between, by their number; the
    cables, and gravity along the hinges, as of an arm on a table. Segments have the masses of the
    boxes in the authors' model, which are as thick as wide.

    Args:
        friction: μ in all holes but the first and the last [-].
        elasticity: Law of the cables.
        gravity: Gravity in base axes (3,) [m/s²].

    Example:
        >>> import cdsm
        >>> rest = cdsm.forward_statics(cdsm.presets.spirob(), tension=[2.0, 0.0])
        >>> (1e3 * rest.pose.tip[:3, 3]).round(1).tolist()
        [370.7, 0.0, 190.2]
    """
    (_, y, _) = JOINT_AXES
    bodies = []
    sides: tuple[list[Site], list[Site]] = ([], [])
    before = 0.0
    for k, numbers in enumerate(_SEGMENTS):
        (length, first, start, second, stop) = (1e-3 * number for number in numbers)
        name = f"segment{k}" if k else "base"
        if k:
            width = 2.0 * length * _LONGEST[0] / _LONGEST[1]
            mass = _DENSITY * length * width**2
            along = mass * (length**2 + width**2) / 12.0
            inertia = mass * width**2 / 6.0, along, along
            middle = length / 2.0, 0.0, 0.0
            bodies.append(SerialBody(name, (before, 0.0, 0.0), (y,), _LIMIT, mass, middle, inertia))
        before = length
        for sign, sites in zip((1.0, -1.0), sides, strict=True):
            sites += [
                Site(name, (start, 0.0, sign * first)),
                Site(name, (stop, 0.0, sign * second)),
            ]
    cables = [
        Cable(f"cable{i}", tuple(sites), elasticity, control="force").with_friction(friction)
        for i, sites in enumerate(sides, start=1)
    ]
    springs = {
        f"{body.name}_joint1": SpringLaw.power(
            stiffness=float(np.interp(number, MEASURED_JOINTS, TANGENTS)),
            exponent=float(np.interp(number, MEASURED_JOINTS, EXPONENTS)),
            scale=math.radians(2.0),
        )
        for number, body in enumerate(bodies, start=1)
    }
    urdf = chain("spirob", bodies, (before, 0.0, 0.0))
    return Manipulator.from_urdf(urdf, cables, tip="tool0", springs=springs, gravity=gravity)

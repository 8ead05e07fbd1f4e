"""Tables for the workshop: where each hole is drilled, and how long each cable is cut."""

from __future__ import annotations

import itertools
import math

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.tables import csv_text
from cdsm.support.values import Array
from cdsm.wires.catalogue import label

_DIGITS = 4
_INSIDE = 1e-6  # distance from a joint limit, over the range: there two disks touch, holes may meet


def hole_table(arm: Manipulator) -> str:
    """Return a CSV with a row for each hole of each disk of an arm, in mm and degrees.

    Angles are about the x axis of the link, from y towards z. A cable is fixed at its last disk.
    """
    geometry = arm.geometry
    rows = []
    for number, disk in enumerate(geometry.disks, start=1):
        for name, route in zip(geometry.cable_names, geometry.cables, strict=True):
            if number > 2 * route.joint:
                continue
            _, y, z = disk.hole(route)
            ends = "ends" if number == 2 * route.joint else "passes"
            sizes = (1e3 * disk.x, 1e3 * disk.radius, 1e3 * disk.radius_of(route))
            angle = math.degrees(route.angle) % 360.0
            rows.append([number, disk.link, *map(_mm, sizes), name, ends, _mm(angle)])
            rows[-1] += [_mm(1e3 * y), _mm(1e3 * z)]
    head = ["disk", "link", "x [mm]", "disk radius [mm]", "hole radius [mm]", "cable", "here it"]
    return csv_text([*head, "angle [deg]", "y [mm]", "z [mm]"], rows)


def cable_table(arm: Manipulator) -> str:
    """Return a CSV with a row for each cable: wire, lead, and lengths in mm.

    All lengths include the lead. ``straight`` is the length in the straight arm, ``shortest`` and
    ``cut`` are the shortest and the longest within the joint limits, and ``stroke``, which the
    motor winds, is their difference. The lengths are without stretch, and without the wire needed
    to fix both ends.
    """
    straight = arm.cable_lengths(np.clip(0.0, arm.lower, arm.upper))
    rows = []
    for c, cable in enumerate(arm.cables):
        joint = arm.geometry.cables[c].joint
        shortest, longest = _extremes(arm, c)
        lengths = (cable.lead, straight[c], shortest, longest, longest - shortest)
        rows.append([cable.name, joint, label(cable.elasticity), *(_mm(1e3 * x) for x in lengths)])
    head = ["cable", "ends after joint", "wire", "lead [mm]", "straight [mm]", "shortest [mm]"]
    return csv_text([*head, "cut [mm]", "stroke [mm]"], rows)


def _extremes(arm: Manipulator, c: int) -> tuple[float, float]:
    """Return the shortest and the longest length [m] of cable ``c`` within the joint limits.

    A segment crosses at most one joint, so the length is a sum with a term for each joint. The
    search starts with each joint at the best of its limits and zero, and then follows the gradient.
    """
    from scipy.optimize import minimize  # slow to import

    inset = _INSIDE * (arm.upper - arm.lower)
    low, high = arm.lower + inset, arm.upper - inset
    ends = np.array([low, np.clip(0.0, low, high), high])
    blocks = np.split(np.arange(arm.nv), np.cumsum([len(x.axes) for x in arm.geometry.joints])[:-1])
    found = []
    for sign in (1.0, -1.0):
        start = ends[1].copy()
        for own in blocks:
            tried = np.repeat(start[None], 3 ** len(own), axis=0)
            tried[:, own] = [*itertools.product(*ends[:, own].T)]
            start = min(tried, key=lambda q: sign * arm.cable_lengths(q)[c])

        def length(q: Array, sign: float = sign) -> tuple[float, Array]:
            pose = arm.at(q)
            return sign * float(pose.cable_lengths[c]), sign * pose.length_jacobian[c]

        bounds = [*zip(low, high, strict=True)]
        found.append(sign * float(minimize(length, start, jac=True, bounds=bounds).fun))
    return found[0], found[1]


def _mm(value: float) -> str:
    return f"{round(value, _DIGITS) + 0.0:g}" if abs(value) < 1e-4 else f"{value:.{_DIGITS}f}"

"""Tables for the workshop: where each hole is drilled, and how long each cable is cut."""

from __future__ import annotations

import math

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.tables import csv_text
from cdsm.support.values import Array
from cdsm.wires.catalogue import label

_DIGITS = 4


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


def cable_table(arm: Manipulator, q: Array) -> str:
    """Return a CSV with a row for each cable: wire, lead, and lengths in mm.

    The length is that of the straight arm, lead included. The motor must wind the cable between its
    shortest and longest length over the postures q (P, nv) [rad]. The cut is the longest length,
    without an allowance for fixing the two ends.
    """
    straight = arm.cable_lengths(np.clip(0.0, arm.lower, arm.upper))
    inside = [row for row in q if not arm._model.beyond_limits(row).any()]
    every = np.array([straight, *(arm.cable_lengths(row) for row in inside)])
    shortest, longest = every.min(axis=0), every.max(axis=0)
    rows = []
    for c, cable in enumerate(arm.cables):
        joint = arm.geometry.cables[c].joint
        lengths = (cable.lead, straight[c], shortest[c], longest[c], longest[c] - shortest[c])
        rows.append([cable.name, joint, label(cable.elasticity), *(_mm(1e3 * x) for x in lengths)])
    head = ["cable", "ends after joint", "wire", "lead [mm]", "straight [mm]", "shortest [mm]"]
    return csv_text([*head, "cut [mm]", "stroke [mm]"], rows)


def _mm(value: float) -> str:
    return f"{round(value, _DIGITS) + 0.0:g}" if abs(value) < 1e-4 else f"{value:.{_DIGITS}f}"

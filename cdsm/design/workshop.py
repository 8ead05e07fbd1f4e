"""Tables for the workshop: where each hole is drilled, and how long each cable is cut."""

from __future__ import annotations

import math

import numpy as np

from cdsm.batch import evaluate
from cdsm.manipulator import Manipulator
from cdsm.support.tables import csv_text
from cdsm.support.values import Array
from cdsm.wires.catalogue import label

_DIGITS = 4
_GRID = 41  # angles of each axis: lengths within the limits are found to 1 µm
_INSIDE = 1e-6  # distance from a joint limit, over the range: there two disks touch, holes may meet


def hole_table(arm: Manipulator) -> str:
    """Return a CSV with a row for each hole of each disk of an arm, in mm and degrees.

    Angles are about the x axis of the link, from y towards z. A cable is fixed at its last disk.
    """
    geometry = arm.geometry
    rows = []
    for number, disk in enumerate(geometry.disks, start=1):
        for name, route in zip(geometry.cable_names, geometry.cables, strict=True):
            if disk.joint > route.joint:
                continue
            _, y, z = disk.hole(route)
            ends = "ends" if disk == geometry.disks_of(route)[-1] else "passes"
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
    shortest, longest = _extremes(arm)
    leads = [cable.lead for cable in arm.cables]
    lengths = np.column_stack([leads, straight, shortest, longest, longest - shortest])
    rows = [
        [cable.name, route.joint, label(cable.elasticity), *map(_mm, own)]
        for cable, route, own in zip(arm.cables, arm.geometry.cables, 1e3 * lengths, strict=True)
    ]
    head = ["cable", "ends after joint", "wire", "lead [mm]", "straight [mm]", "shortest [mm]"]
    return csv_text([*head, "cut [mm]", "stroke [mm]"], rows)


def _extremes(arm: Manipulator) -> tuple[Array, Array]:
    """Return the shortest and the longest length (C,) [m] of the cables within the joint limits.

    A segment crosses at most one joint, so a length is a sum with a term for each joint, and a
    grid over one joint after the other finds all of it.
    """
    inset = _INSIDE * (arm.upper - arm.lower)
    low, high = arm.lower + inset, arm.upper - inset
    straight = np.clip(0.0, low, high)
    shortest = longest = at_rest = arm.cable_lengths(straight)
    first = 0
    for joint in arm.geometry.joints:
        own = slice(first, first + len(joint.axes))
        grid = np.meshgrid(*np.linspace(low[own], high[own], _GRID).T)
        q = np.tile(straight, (grid[0].size, 1))
        q[:, own] = np.stack([each.ravel() for each in grid], axis=1)
        change = evaluate(arm, q, outputs=["cable_lengths"])["cable_lengths"] - at_rest
        shortest, longest = shortest + change.min(axis=0), longest + change.max(axis=0)
        first = own.stop
    return shortest, longest


def _mm(value: float) -> str:
    return f"{round(value, _DIGITS) + 0.0:g}" if abs(value) < 1e-4 else f"{value:.{_DIGITS}f}"

"""Compute the hole angles of uniform arms, and find cables that share a hole."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from cdsm.geometry.parts import CableRoute, Disk

SAME_HOLE = 1e-6
"""Holes closer than this angle [rad] are one hole, since angles are rounded."""


def evenly_spaced(joints: int, cables: int) -> list[list[float]]:
    """Return, for each joint k = 1…n, the hole angles φ = 2π((k−1) + n j)/(n m) [rad].

    j = 0…m−1 are its cables. n is ``joints``; m is ``cables``, the number per joint.
    """
    n, m = joints, cables
    return [[2.0 * math.pi * (k + n * j) / (n * m) for j in range(m)] for k in range(n)]


def hinge_hole_angles(rolls: Sequence[float], cables: int) -> list[list[float]]:
    """Return, for each hinge, the hole angles φ = ψ + 90° + 2πj/m [rad] of its cables j = 0…m−1.

    ``rolls`` has the angle ψ [rad] of each hinge, whose axis is cos ψ y + sin ψ z; m is ``cables``,
    the number per hinge.
    """
    # evenly spaced, starting 90 degrees from the axis: two cables form the antagonistic pair
    turns = [2.0 * math.pi * j / cables for j in range(cables)]
    return [[roll + math.pi / 2 + turn for turn in turns] for roll in rolls]


def spread_out(cables: Sequence[CableRoute], spread: float) -> tuple[CableRoute, ...]:
    """Return the cables, with an angle ``spread`` [rad] between those that had equal hole angles.

    Of g cables at one angle, the hole of cable i = 0…g−1 is turned by (i − (g−1)/2)·spread.
    """
    moved = list(cables)
    for group in same_angle(cables) if spread else ():
        for i, c in enumerate(sorted(group)):
            turn = (i - (len(group) - 1) / 2.0) * spread
            moved[c] = replace(cables[c], angle=cables[c].angle + turn)
    return tuple(moved)


def same_angle(cables: Sequence[CableRoute]) -> list[list[int]]:
    """Return groups of cables with the same hole angle, each as two or more indices."""
    turn = 2.0 * math.pi
    angles = [cable.angle % turn for cable in cables]
    order = sorted(range(len(cables)), key=angles.__getitem__)
    groups: list[list[int]] = []
    for before, c in zip([None, *order], order, strict=False):
        if before is not None and angles[c] - angles[before] < SAME_HOLE:
            groups[-1].append(c)
        else:
            groups.append([c])
    if len(groups) > 1 and turn + angles[order[0]] - angles[order[-1]] < SAME_HOLE:
        groups[0] += groups.pop()
    return [group for group in groups if len(group) > 1]


def sharing(cables: Sequence[CableRoute], disks: Sequence[Disk]) -> list[list[int]]:
    """Return groups of cables that share a hole of some disk, each as two or more indices."""
    found: dict[tuple[int, ...], None] = {}
    for group in same_angle(cables):
        for d, disk in enumerate(disks):
            holes: defaultdict[float, list[int]] = defaultdict(list)
            for c in sorted(group):
                if d < 2 * cables[c].joint:
                    holes[disk.radius_of(cables[c])].append(c)
            for members in holes.values():
                if len(members) > 1 and not any(set(members) <= set(each) for each in found):
                    found[tuple(members)] = None
    return [list(each) for each in sorted(found)]

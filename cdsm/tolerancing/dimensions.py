"""Dimensions of a geometry that can have a tolerance, and what each one changes in the arm.

A link is one input and a disk is one, however many bodies of the chain stand for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdsm.geometry.chain import Chain, chain_of
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array

Change = tuple[str, str, NDArray[np.intp], Array]
"""Source and name of an input; which numbers of the arm it changes, and how fast."""

NO_PULLEYS = (
    "of such an arm tolerances vary rigidity, spring, pulley_radius, joint_angle, joint_position, "
    "tension, slack and gain alone."
)
"""What :meth:`Cable.only_sites` says of cables that tolerances cannot vary."""

_NEAR = 1e-9  # a site this near to a disk [m] is on the disk
_STEP = 1e-3  # of differences, over the smallest offset of a disk


def changes_of_holes(arm: Manipulator, sites: Sequence[str], start: int) -> Iterator[Change]:
    """Yield what moves holes in their disk; ``start`` is the place of the first site."""
    links = {disk.link for disk in arm.geometry.disks}
    for p, own in enumerate(site for cable in arm.cables for site in cable.only_sites(NO_PULLEYS)):
        _, y, z = own.position
        if own.link in links and (radius := math.hypot(y, z)):
            at = start + 3 * p + np.array([1, 2])
            yield "hole_radius", sites[p], at, np.array([y, z]) / radius
            yield "hole_angle", sites[p], at, np.array([-z, y])


def changes_of_chain(arm: Manipulator, starts: Mapping[str, int]) -> Iterator[Change]:
    """Yield what moves disks and joints, or changes masses; ``starts`` by name of the numbers.

    The rates are central differences of the chain. It is linear in lengths and masses, except for
    the share of a link's mass that a body has.
    """
    geometry = arm.geometry
    chain = arm.geometry.chain
    joints = geometry.joints
    links = geometry.links
    disks = geometry.disks
    h = [joint.disk_offset for joint in joints]
    number = {x.name: x.joint for x in chain.bodies}
    shared = [
        abs(x.length - a - b) < _NEAR for x, a, b in zip(links, h, [*h[1:], 0.0], strict=True)
    ]
    owner = [number[disk.link] for disk in disks]  # the number of its link; 0: the base
    first = [owner.index(k) for k in range(len(links) + 1)]
    rows, read = _numbers(arm, starts)

    def rates(
        moved: Mapping[tuple[int, int], float], longer: int = 0, heavier: int = 0
    ) -> tuple[NDArray[np.intp], Array]:
        step = _STEP * min(h)
        numbers = []
        for way in (step, -step):
            offsets = [[x, x] for x in h]
            parts: dict[str, list[Any]] = {"joints": [*joints], "links": [*links]}
            for (k, side), factor in moved.items():
                offsets[k][side] += factor * way
            if longer:
                link = links[longer - 1]
                parts["links"][longer - 1] = replace(link, length=link.length + way)
            for group in parts.values() if heavier else ():
                heavy = group[heavier - 1]
                group[heavier - 1] = replace(
                    heavy, mass=heavy.mass * (1.0 + math.copysign(0.5, way))
                )
            sizes = [(0.0, 0.0, 0.0)] * len(joints)
            numbers.append(
                read(chain_of(geometry.base_length, **parts, sizes=sizes, offsets=offsets))
            )
        change = (numbers[0] - numbers[1]) / (1.0 if heavier else 2.0 * step)
        some = np.flatnonzero(change)
        return rows[some], change[some]

    for d, k in enumerate(owner):
        behind = k > 0 and first[k] == d  # its joint
        moved = {(k - 1, 1): 1.0} if behind else {(k, 0): 1.0}
        if behind and shared[k - 1] and k < len(joints):
            moved[k, 0] = -1.0
        yield "disk_offset", f"disk {d - first[k] + 1} of {disks[first[k]].link}", *rates(moved)
    for k in range(1, len(links) + 1):
        # a disk that two necks share has no link of its own: the neck before it is longer
        moved = {(k - 1, 1): 1.0} if shared[k - 1] else {}
        yield "link_length", disks[first[k]].link, *rates(moved, longer=k)
    mover = {axis.child: axis.name for axis in chain.axes}
    for k in range(1, len(links) + 1):
        at, change = rates({}, heavier=k)
        if change.size:
            body = next(x.name for x in chain.bodies if x.joint == k and x.kind != "cross")
            yield "link_mass", f"link moved by {mover[body]}", at, change / change.sum()


def _numbers(
    arm: Manipulator, starts: Mapping[str, int]
) -> tuple[NDArray[np.intp], Callable[[Chain], Array]]:
    """Return which numbers of an arm depend on its chain, and the function that reads them."""
    chain = arm.geometry.chain
    places = dict[str, list[tuple[int, float]]]()
    for d, disk in enumerate(chain.disks):
        places.setdefault(disk.link, []).append((d, disk.x))
    cable_sites = enumerate(site for cable in arm.cables for site in cable.only_sites(NO_PULLEYS))
    near = [
        (p, d, x - site.position[0])
        for p, site in cable_sites
        for d, x in places.get(site.link, ())
    ]
    sites, of_sites = (
        np.array([(p, d) for p, d, x in near if abs(x) <= _NEAR], np.intp).reshape(-1, 2).T
    )
    pairs = zip(chain.axes, arm.springs.stiffness.tolist(), strict=True)
    springs = [j for j, (axis, k) in enumerate(pairs) if axis.stiffness == k > 0.0]  # no laws
    n = len(chain.axes)
    bodies = np.arange(len(chain.bodies))
    at = {"shift": 3 * np.arange(n), "site": 3 * sites, "centre": 3 * bodies, "tip": [0]}
    at |= {"mass": bodies, "softness": springs}

    def read(chain: Chain) -> Array:
        middles = [body.middle for body in chain.bodies]
        holes = [chain.disks[d].x for d in of_sites]
        masses = [body.mass for body in chain.bodies]
        ks = [chain.axes[j].stiffness for j in springs]
        soft = [1.0 / k for k in ks if isinstance(k, float)]
        return np.array([*(a.x for a in chain.axes), *holes, *middles, chain.x, *masses, *soft])

    return np.concatenate([starts[name] + np.array(x, np.intp) for name, x in at.items()]), read

"""The chain of bodies and joints of a geometry: one description for URDF, disks and springs.

A beam of length l, bending stiffness EI and torsion stiffness GJ becomes n pieces: two universal
joints at 1/6 and 5/6 of each piece with springs 2 EI n/l, and a joint about its axis in the middle
with GJ n/l. There, a cable beside the beam shortens as beside an arc, to second order. The axes are
y, z at the first joint and z, y at the second: in equal order, a bend that is about neither of them
would twist the beam.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cdsm.geometry.parts import STEEPEST, Disk, Joint, Link
from cdsm.springs import SpringLaw

_MOST_AXES = 400  # one behind the other; many more crash the parser of URDFs
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_OF_CROSS = 0.01  # mass of the cross of a beam's joint, taken from its piece
_POISSON = 0.3
_LEAST = 1e-6  # two disks that are closer than this [m] are one
_NEAR = 1e-9


Sizes = tuple[float, float, float]
"""Hole radius and outer radius of the disks of a joint [m], and the limit of the joint [rad]."""


class Body(NamedTuple):
    """A rigid body along x, from 0 to ``length`` [m]; or the cross of a universal joint."""

    name: str
    length: float
    mass: float  # [kg]
    joint: int  # number of the joint before it; 0: the base
    kind: str  # "link", "cross", or "beam"
    start: float = 0.0  # where it begins [m]: behind the centre of a surface that rolls

    @property
    def middle(self) -> float:
        """Middle of the body [m], in its frame."""
        return self.start + self.length / 2.0


class Axis(NamedTuple):
    """A joint of one axis between two bodies."""

    name: str
    parent: str
    child: str
    x: float  # place on the parent [m]
    axis: tuple[float, ...]
    limit: float  # both ways [rad]
    stops: bool  # whether the limit is where disks touch
    stiffness: float | SpringLaw  # k of its spring [N m/rad]; 0: none; or its law
    rest_angle: float  # q_0 [rad]
    leader: str = ""  # joint whose angle it copies
    multiplier: float = 1.0  # of the angle that it copies

    @property
    def spring(self) -> tuple[float, float] | SpringLaw:
        """Stiffness and angle of its spring, or the law."""
        if isinstance(self.stiffness, SpringLaw):
            return self.stiffness.at_angle(self.rest_angle or self.stiffness.angle)
        return self.stiffness, self.rest_angle


@dataclass
class Chain:
    """Bodies one behind another along x; the last one is at ``link`` and has reached ``x`` [m]."""

    link: str = "base_disk"
    behind: int = 0  # number of the joint before it
    at: int = 0  # number of the joint that is being added
    kind: str = "link"
    x: float = 0.0
    begin: float = 0.0  # where the last body begins [m]
    mass: float = 0.0
    bodies: list[Body] = field(default_factory=list)
    axes: list[Axis] = field(default_factory=list)
    disks: list[Disk] = field(default_factory=list)

    def end(self) -> None:
        """End the last body."""
        length = self.x - self.begin
        body = Body(self.link, length, self.mass, self.behind, self.kind, self.begin)
        self.bodies.append(body)

    def turn(
        self,
        name: str,
        axis: tuple[float, ...],
        child: str,
        kind: str,
        *more: Any,
        back: float = 0.0,
        ahead: float = 0.0,
    ) -> None:
        """End the last body at a joint, and begin the next; ``more`` as the last of an Axis.

        The axis is ``back`` [m] before the end, and ``ahead`` behind the beginning of the next.
        """
        self.axes.append(Axis(name, self.link, child, self.x - back, axis, *more))
        self.end()
        self.link = child
        self.kind = kind
        self.x = -ahead
        self.begin = -ahead
        self.mass = 0.0
        self.behind = self.at

    def disk(self, joint: int, radius: float, outer: float) -> None:
        """Put a disk here, unless there is one."""
        last = self.disks[-1] if self.disks else None
        if not (last and last.link == self.link and abs(last.x - self.x) < _NEAR):
            self.disks.append(Disk(self.link, self.x, joint, radius, outer))

    def faults(self) -> list[str]:
        """Return what is wrong with the chain as a whole: too many joints."""
        if len(self.axes) <= _MOST_AXES:
            return []
        problem = (
            f"joints: {len(self.axes)} axes with those of all pieces of beams; {_MOST_AXES} are "
        )
        problem += (
            "taken at most. Give fewer pieces or disks, or leave twist out: torsion_stiffness="
        )
        return [problem + "inf"]

    def run(
        self,
        stem: str,
        length: float,
        beam: Joint | Link,
        mass: float,
        end: str,
        limit: float,
        stops: bool,
    ) -> None:
        """Run along a beam of this length [m]; the body at its end is called ``end``."""
        EI = beam.bending_stiffness
        GJ = beam.torsion_stiffness
        n = beam.pieces
        assert EI is not None
        GJ = EI / (1.0 + _POISSON) if GJ is None else GJ
        piece = length / n
        piece_mass = mass / n * (1.0 - 2.0 * _OF_CROSS)
        limit = limit / (2 * n)
        spring = (2.0 * EI / piece, 0.0)

        def go(part: float) -> None:
            self.x += part * piece
            self.mass += part * piece_mass

        def bend(name: str, cross: str, child: str, order: str, kind: str) -> None:
            ends = limit, stops, *spring
            self.turn(f"{name}_{order[0]}", _AXES[order[0]], cross, "beam", *ends)
            self.mass = _OF_CROSS * mass / n
            self.turn(f"{name}_{order[1]}", _AXES[order[1]], child, kind, *ends)

        for p in range(1, n + 1):
            name = stem if n == 1 else f"{stem}_{p}"
            go(1.0 / 6.0)
            bend(f"{name}_bend1", f"{name}_cross1", f"{name}_middle1", "yz", "beam")
            go(1.0 / 3.0)
            if math.isfinite(GJ):
                ends = STEEPEST, False, GJ / piece, 0.0
                self.turn(f"{name}_twist", _AXES["x"], f"{name}_middle2", "beam", *ends)
            go(1.0 / 3.0)
            last = (end, "link") if p == n else (f"{name}_end", "beam")
            bend(f"{name}_bend2", f"{name}_cross2", last[0], "zy", last[1])
            go(1.0 / 6.0)


def chain_of(
    base_length: float,
    joints: Sequence[Joint],
    links: Sequence[Link],
    sizes: Sequence[Sizes],
    offsets: Sequence[Sequence[float]] = (),
) -> Chain:
    """Return the chain of an arm; ``sizes`` are those of the disks of each joint.

    ``offsets`` are the distances [m] of each joint from the disk before and the one after it; both
    are ``disk_offset`` if they are not given.
    """
    chain = Chain()
    rigid = (STEEPEST, False)
    offsets = offsets or [[joint.disk_offset] * 2 for joint in joints]
    for k in range(len(joints) + 1):
        after = joints[k] if k < len(joints) else None
        link = links[k - 1] if k else Link(length=max(base_length, _LEAST), mass=0.0)
        length = link.length if k else base_length
        distances = offsets[k - 1] if k else [0.0, 0.0]
        start = _start(chain, k, joints[k - 1], link, sizes[k - 1], distances) if k else 0.0
        h = offsets[k][0] if after else 0.0
        if link.bending_stiffness is None:
            chain.mass += link.mass
            chain.x = length - h - start
        else:
            gap = length - h - distances[1]
            chain.run(f"link{k}b", gap, link, link.mass * gap / length, f"link{k}_end", *rigid)
        if after:
            chain.disk(k + 1, *sizes[k][:2])
        if after and after.axes and link.bending_stiffness is None:
            chain.x = length - start
        elif after and after.axes:
            chain.run(f"link{k}c", h, link, link.mass * h / length, f"link{k}_tip", *rigid)
    chain.end()
    return chain


def _start(
    chain: Chain, k: int, joint: Joint, link: Link, sizes: Sizes, offsets: Sequence[float]
) -> float:
    """Add joint k with the disk after it; return where x = 0 of its link is behind the joint."""
    (before, h) = offsets
    (radius, outer, limit) = sizes
    # with a limit of its own, holes may still meet at its end
    stops = joint.limit is None or limit >= 2.0 * math.atan2(joint.disk_offset, radius)
    chain.at = k
    bends = link.bending_stiffness is not None
    if not joint.axes:
        backbone = min(abs(link.length - h), abs(link.length - 2.0 * h)) < _NEAR
        stem, name = (f"gap{k}", f"disk{k}") if backbone else (f"joint{k}", f"link{k}")
        chain.run(stem, before + h, joint, joint.mass, name, limit, stops)
        chain.disk(k, radius, outer)
        return h - chain.x
    name = f"joint{k}"
    child = f"link{k}_start" if bends else f"link{k}"
    ends = limit, stops, joint.stiffness, joint.rest_angle
    leader = f"joint{joint.follows}" if joint.follows else ""
    if joint.rolls:
        # hinges at the centres of both surfaces, coupled so that they roll without slip
        (r1, r2) = joint.rolls
        axis = joint.axes[0]
        chain.turn(name, axis, f"roller{k}", "cross", *ends, leader, back=r1)
        chain.x = r1 + r2
        follower = STEEPEST if limit == STEEPEST else limit * r1 / r2, stops, 0.0, 0.0
        copies = name, r1 / r2
        chain.turn(f"{name}_roll", axis, child, "link", *follower, *copies, ahead=r2)
        chain.x = h - r2
        chain.disk(k, radius, outer)
        return r2
    if len(joint.axes) == 2:
        first = f"{leader}_1" if leader else ""
        chain.turn(f"{name}_1", joint.axes[0], f"cross{k}", "cross", *ends, first)
        name = f"{name}_2"
        leader = f"{leader}_2" if leader else ""
    chain.turn(name, joint.axes[-1], child, "beam" if bends else "link", *ends, leader)
    if bends:
        chain.run(f"link{k}a", h, link, link.mass * h / link.length, f"link{k}", STEEPEST, False)
    else:
        chain.x = h
    chain.disk(k, radius, outer)
    return 0.0

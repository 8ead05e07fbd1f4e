"""Arms whose joints are alike: one record of their sizes, and the angles of their holes."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from cdsm.geometry.beams import Beam
from cdsm.geometry.parts import MAXIMUM_JOINTS, CableRoute, Joint, JointLimit, Link
from cdsm.springs import JointSpring
from cdsm.support import records
from cdsm.support.records import EACH, ONE, PerJoint


def _in_radians(value: float) -> float:
    if abs(value) > 2.0 * math.pi:
        raise ValueError(f"{value:g} rad given; at most one turn; convert degrees to radians")
    return value


def _one_or_each_list(value: object) -> str:
    return records.one_or_each(value[0]) if isinstance(value, (list, tuple)) and value else ONE


Turn = Annotated[records.Number, AfterValidator(_in_radians)]
_HoleAngles = Annotated[
    Annotated[records.HoleAngles, Tag(ONE)] | Annotated[Sequence[records.HoleAngles], Tag(EACH)],
    Discriminator(_one_or_each_list),
    BeforeValidator(records.plain),
]
_OF_JOINTS = (
    *("disk_offset", "hole_radius", "disk_radius", "joint_limit", "link_length", "link_mass"),
    *("lead", "friction", "cable_radius", "phase", "joint_stiffness", "rest_angle"),
)


@records.record
class Universal(Beam):
    """Build an arm of n universal joints with m cables each.

    Cable j = 0…m−1 of joint k = 1…n has its holes at `φ = 2π((k−1) + n j)/(n m) + phase_k`, or at
    ``hole_angles[k][j] + phase[k]``. If ``hole_angles`` and ``phase`` are not given, all holes of
    the base disk are evenly spaced. A size is one number for all joints, or a list with one for
    each joint, base to tip. Errors and warnings are those of :class:`Geometry`.

    Args:
        joints: n, 1 to 100.
        cables_per_joint: m; not needed with ``hole_angles``.
        link_length: Length of every link [m], more than two ``disk_offset``.
        base_length: `L_0`: distance from the base frame to joint 1 [m].
        disk_offset: h: distance from each joint centre to the disk on each side [m].
        hole_radius: R: distance of the holes from the axis, on both disks of a joint [m].
        link_mass: Mass of every link [kg].
        lead: Straight cable between each actuator and the base disk [m].
        friction: Friction coefficient μ of the cables [-], as in :class:`CableRoute`.
        joint_limit: Largest angle about each axis [rad], as ``limit`` of :class:`Joint`.
        disk_radius: Outer radius of the disks [m], as in :class:`Joint`.
        cable_radius: As ``radius`` of :class:`CableRoute`, for the cables of each joint [m].
        hole_angles: φ of the cables of a joint [rad]: one list for all joints, or one for each.
        phase: Added to φ of the cables of each joint [rad].
        joint_stiffness: Stiffness of a spring about each axis of every joint [N m/rad], or its
            :class:`~cdsm.SpringLaw`; 0: none.
        rest_angle: Angle about each axis at which its spring has no torque [rad].
        coupled: Whether all joints turn by the angles of the first one, as in a section that bends
            evenly.
        spread: Angle [rad] between the holes of g cables whose angles φ are equal: the hole of
            cable i = 0…g−1, base to tip, is turned by `(i − (g−1)/2)·spread`. 0: not turned.
        bending_stiffness: EI of all links [N m²]; None: they do not bend. Or give the diameters.
        torsion_stiffness: GJ of all links [N m²]; None: EI/(1 + ν); inf: they do not twist.
        outer_diameter: Outer diameter [m] of links that are tubes or rods.
        inner_diameter: Inner diameter [m]; 0: a rod.
        youngs_modulus: E of the links [Pa].
        poisson: ν, Poisson's ratio [-].
        pieces: Number of pieces of each beam, from joint to disk to disk to joint; one is enough.
        name: Name of the robot.
    """

    joints: Annotated[records.Integer, Field(ge=1, le=MAXIMUM_JOINTS)]
    cables_per_joint: Annotated[records.Integer, Field(ge=1, le=64)] | None = None
    link_length: PerJoint[records.Length]
    base_length: records.LengthOrZero
    disk_offset: PerJoint[records.Length]
    hole_radius: PerJoint[records.Length]
    link_mass: PerJoint[records.Mass]
    lead: PerJoint[records.LengthOrZero] = 0.0
    friction: PerJoint[records.FrictionCoefficient] = 0.0
    joint_limit: PerJoint[JointLimit] | None = None
    disk_radius: PerJoint[records.Length] | None = None
    cable_radius: PerJoint[records.Length] | None = None
    hole_angles: _HoleAngles | None = None
    phase: PerJoint[records.Number] = 0.0
    joint_stiffness: PerJoint[JointSpring] = 0.0
    rest_angle: PerJoint[records.Number] = 0.0
    coupled: bool = False
    spread: Turn = 0.0
    name: records.Name = "arm"

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = self.joints
        angles = self.hole_angles
        count = self.cables_per_joint
        faults = [
            f"{key}: {len(value)} values given for {n} joints; give one, or one for each"
            for key, value in vars(self).items()
            if isinstance(value, (list, tuple)) and len(value) != n
            if key != "hole_angles" or isinstance(value[0], Sequence)
        ]
        if (angles is None) == (count is None) and (count or type(self) is Universal):
            faults.append("cables_per_joint: give it, or hole_angles, and not both")
        faults += self.faults_of_beam()
        if faults:
            raise records.CrossFaults(faults)
        return self

    def _axes_and_angles(self) -> tuple[list[Any], list[list[float]]]:
        axes = [((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))] * self.joints
        return axes, evenly_spaced(self.joints, self.cables_per_joint or 1)

    def parts(self) -> dict[str, Any]:
        """Return the fields of the :class:`~cdsm.Geometry` by name."""
        n = self.joints
        (axes, usual) = self._axes_and_angles()
        angles: Sequence[Any] = self.hole_angles or usual
        if not isinstance(angles[0], Sequence):
            angles = [angles] * n
        values = [getattr(self, key) for key in _OF_JOINTS]
        columns = [value if isinstance(value, Sequence) else [value] * n for value in values]
        joints = list[Joint]()
        links = list[Link]()
        cables = list[CableRoute]()
        common = columns[1][0]
        beam = self.stiffness()
        rows = zip(axes, angles, *columns, strict=True)
        for axis, phis, h, R, r, top, length, mass, lead, mu, ring, phase, k, rest in rows:
            R = None if common == R else R
            spring = {"stiffness": k, "rest_angle": rest}
            spring["follows"] = 1 if self.coupled and joints else None
            joints += [
                Joint(axes=axis, disk_offset=h, limit=top, hole_radius=R, disk_radius=r, **spring)
            ]
            links += [Link(length=length, mass=mass, **beam)]
            kept = {"joint": len(joints), "lead": lead, "friction": mu, "radius": ring}
            cables += [CableRoute(angle=phi + phase, **kept) for phi in phis]
        whole = {"name": self.name, "base_length": self.base_length, "hole_radius": common}
        parts = {"joints": joints, "links": links, "cables": spread_out(cables, self.spread)}
        return whole | parts


@records.record
class Hinged(Universal):
    """Build an arm of n hinges; ``twist`` [rad] turns each axis about x from the previous one.

    Hinge k has the axis `cos ψ_k y + sin ψ_k z` with `ψ_k = (k−1)·twist`. The link frames are not
    twisted. Cable j = 0…m−1 of hinge k has its holes at `φ = ψ_k + 90° + 2πj/m + phase_k`: by
    default (m = 2) an antagonistic pair at `ψ_k ± 90°`. Cables of parallel hinges share holes;
    ``spread`` separates them. All other arguments are those of :meth:`Geometry.universal`.
    """

    twist: Turn

    def _axes_and_angles(self) -> tuple[list[Any], list[list[float]]]:
        rolls = [k * self.twist for k in range(self.joints)]
        axes = [((0.0, math.cos(roll), math.sin(roll)),) for roll in rolls]
        return axes, hinge_hole_angles(rolls, self.cables_per_joint or 2)


@records.record
class Rolling(Hinged):
    """Build an arm of n links whose round ends roll on each other, without slip.

    The surfaces of joint k have the radii `r₁`, ``radius``, on the link before it, and `r₂`,
    ``second_radius``. Equal arcs turn the line of their centres by q on the first, and by `q r₁/r₂`
    on the second: a hinge ``joint{k}`` at the centre of the first surface, a link of length
    `r₁ + r₂`, and a hinge ``joint{k}_roll`` at the centre of the second, which copies the first one
    with the multiplier `r₁/r₂`. **The angle q is that of the line of centres.** The links turn by
    `θ = q (1 + r₁/r₂)` to each other, 2 q for equal radii. Limits and springs count for q, and so
    does `K_θ`: the stiffness for θ is `K_θ/(1 + r₁/r₂)²`.

    At q = 0 the contact of joint 1 is at x = ``base_length``, and each ``link_length`` goes from
    contact to contact. ``disk_offset`` h counts from the contact. A hole on the rim of the surface,
    at the angle α from the line of centres, has `h = r (1 − cos α)` and ``hole_radius`` `r sin α`.
    The sum of the lengths of an antagonistic pair then grows as the joint bends (variable neutral
    line), so tension straightens the arm.

    Slip, and contacts that open, are not modelled. Hinge k turns about `cos ψ_k y + sin ψ_k z`,
    with `ψ_k = (k−1)·twist`; ``twist`` is 90° by default. All other arguments are those of
    :meth:`Geometry.hinged`.
    """

    radius: PerJoint[records.Length]
    second_radius: PerJoint[records.Length] | None = None
    twist: Turn = math.pi / 2.0

    def parts(self) -> dict[str, Any]:
        """Return the fields of the :class:`~cdsm.Geometry` by name."""
        parts = super().parts()
        radii = [self.radius, self.radius if self.second_radius is None else self.second_radius]
        columns = [r if isinstance(r, Sequence) else [r] * self.joints for r in radii]
        rows = zip(parts["joints"], *columns, strict=True)
        return parts | {"joints": [replace(joint, rolls=(r1, r2)) for joint, r1, r2 in rows]}


def evenly_spaced(joints: int, cables: int) -> list[list[float]]:
    """Return φ = 2π((k−1) + n j)/(n m) [rad] of cables j = 0…m−1 of each of n ``joints`` k."""
    n = joints
    m = cables
    return [[2.0 * math.pi * (k + n * j) / (n * m) for j in range(m)] for k in range(n)]


def hinge_hole_angles(rolls: Sequence[float], cables: int) -> list[list[float]]:
    """Return φ = ψ + 90° + 2πj/m [rad] of cables j = 0…m−1 of each hinge; ``rolls``: ψ [rad]."""
    turns = [2.0 * math.pi * j / cables for j in range(cables)]
    return [[roll + math.pi / 2 + turn for turn in turns] for roll in rolls]


_STEPS = 14_515_200  # of a turn, to compare angles; whole degrees and 2π/n are within a step


def same_angle(cables: Sequence[CableRoute]) -> list[list[int]]:
    """Return groups of cables with the same hole angle, each as two or more ascending indices."""
    groups = defaultdict(list)
    for c, cable in enumerate(cables):
        groups[round(cable.angle / (2.0 * math.pi) * _STEPS) % _STEPS].append(c)
    return [group for group in groups.values() if len(group) > 1]


def spread_out(cables: Sequence[CableRoute], spread: float) -> tuple[CableRoute, ...]:
    """Return the cables, with an angle ``spread`` [rad] between those of equal hole angles."""
    moved = list(cables)
    for group in same_angle(cables) if spread else ():
        for i, c in enumerate(group):
            turn = (i - (len(group) - 1) / 2.0) * spread
            moved[c] = replace(cables[c], angle=cables[c].angle + turn)
    return tuple(moved)

"""Parameters: the numbers of an arm by name, with their units, how they are read and how changed.

A new parameter is one row of :data:`PARAMETERS`. It then has its unit in prints, is free in
:class:`~cdsm.ArmParameters` (so in identification and in designs), and may have a tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, NamedTuple, TypeVar

import numpy as np

from cdsm.cable import Cable
from cdsm.cable_path import SURFACE, Pulley, Site, off_axis
from cdsm.geometry import CableRoute, Joint, Link
from cdsm.motors import Motor
from cdsm.quantities import DISPLAY
from cdsm.springs import SpringLaw

_Part = TypeVar("_Part")

PartKind = Literal["joints", "links", "routes", "cables", "motors"]
"""Parts of a geometry (joints, links, routes of cables), and the cables of an arm."""


class Unit(NamedTuple):
    """SI unit of a parameter; the range of its values, a key of RANGES, or None: any number."""

    si: str
    quantity: str | None = None
    display: tuple[str, float] | None = None  # unit for people and its size, if not that of DISPLAY

    @property
    def shown(self) -> tuple[str, float]:
        """Unit in which people read a value, and its size in SI."""
        return self.display or DISPLAY.get(self.si, (self.si, 1.0))


METRE: Final = Unit("m", "length")
RADIAN: Final = Unit("rad", display=("deg", math.pi / 180.0))
KILOGRAM: Final = Unit("kg", "mass", display=("g", 1e-3))
NEWTON: Final = Unit("N", "tension")
STIFFNESS: Final = Unit("N/m", "stiffness")
SPRING: Final = Unit("N m/rad", "spring")
BENDING: Final = Unit("N m²", "bending stiffness")
NUMBER: Final = Unit("")


@dataclass(frozen=True, kw_only=True)
class Source:
    """A number that may have an error, and what errors are plausible.

    Attributes:
        unit: Unit of the number; of its errors too, unless they are relative.
        is_relative: Whether an error is a fraction of the number, which stays positive.
        is_common: Whether all parts of an arm usually have one error, as cables of one spool do.
        largest: Largest standard uncertainty that is still a tolerance.
    """

    unit: Unit
    is_relative: bool = False
    is_common: bool = False
    largest: float = math.inf


@dataclass(frozen=True, kw_only=True)
class Parameter(Source):
    """A number of each joint, link, route or cable of an arm.

    Attributes:
        kinds: Kinds of parts that may have the number.
        get: Returns the number of a part in SI; None: this part has none.
        set: Returns the part with another number.
        shares: Parameter that has the same number, which this one adds to or multiplies; or None.
        is_spring: Whether springs that were given to the arm itself replace it.
        lacks: What an arm lacks that has no such number, and what to do.
        usual: Smallest and largest usual value in SI; None: half the value of the arm to twice it.
        typical: Value in SI from which it is sought where the arm's own is at a bound, or None.
        acts_under_load: Whether forces on an arm with locked motors show it.
    """

    kinds: tuple[PartKind, ...]
    get: Callable[[Any], float | None]
    set: Callable[[Any, float], Any]
    shares: str | None = None
    is_spring: bool = False
    lacks: str = "no part with this number there"
    usual: tuple[float, float] | None = None
    typical: float | None = None
    acts_under_load: bool = True


def attribute(kind: PartKind, name: str, unit: Unit, **more: Any) -> Parameter:
    """Return the parameter that is the attribute ``name`` of parts of a ``kind``."""

    def get(part: Any) -> float | None:
        value: float | None = getattr(part, name)
        return value

    def with_value(part: _Part, value: float) -> _Part:
        return replace(part, **{name: value})  # type: ignore[type-var]

    return Parameter(unit=unit, kinds=(kind,), get=get, set=with_value, **more)


def _joint_stiffness(joint: Joint) -> float | None:
    """Return k of the spring about the axes of a joint; of a law, the tangent at rest."""
    if not joint.axes:
        return None
    spring = joint.stiffness
    return spring.stiffness_at_rest if isinstance(spring, SpringLaw) else spring


def _with_joint_stiffness(joint: Joint, stiffness: float) -> Joint:
    spring = joint.stiffness
    if isinstance(spring, SpringLaw):
        return replace(joint, stiffness=spring.scaled(stiffness / spring.stiffness_at_rest))
    return replace(joint, stiffness=stiffness)


def _exponent(joint: Joint) -> float | None:
    return joint.stiffness.exponent if isinstance(joint.stiffness, SpringLaw) else None


def _with_exponent(joint: Joint, exponent: float) -> Joint:
    assert isinstance(joint.stiffness, SpringLaw)
    return replace(joint, stiffness=joint.stiffness.with_exponent(exponent))


def _bending_stiffness(beam: Joint | Link) -> float | None:
    return beam.bending_stiffness


def _with_bending_stiffness(beam: Joint | Link, EI: float) -> Joint | Link:
    """Return a beam with another EI, and with a GJ in the same ratio to it."""
    GJ = beam.torsion_stiffness
    assert beam.bending_stiffness is not None
    scaled = None if GJ is None else GJ * EI / beam.bending_stiffness
    return replace(beam, bending_stiffness=EI, torsion_stiffness=scaled)


def _turned(route: CableRoute, angle: float) -> CableRoute:
    return replace(route, angle=route.angle + angle)


def _motor_stiffness(motor: Motor) -> float | None:
    return motor.stiffness if math.isfinite(motor.stiffness) else None


def _with_motor_stiffness(motor: Motor, stiffness: float) -> Motor:
    return replace(motor, stiffness=stiffness)


def _friction(cable: Cable) -> float:
    return max(site.friction for site in cable.sites)


def _pulley_radius(cable: Cable) -> float | None:
    return 0.0 if cable.pulleys else None


def _with_rim(pulley: Pulley, site: Site, more: float) -> Site:
    """Return a site of the link of a pulley, farther from its axis if the site is on its rim."""
    out = off_axis(pulley, site.position)
    far = float(np.linalg.norm(out))
    if abs(far - pulley.radius) > SURFACE:
        return site
    return replace(site, position=tuple((site.position + out * (more / far)).tolist()))


def _with_pulleys(cable: Cable, more: float) -> Cable:
    """Return a cable whose pulleys are larger, all by as much; sites on rims stay there."""
    path = [*cable.sites]
    for i, pulley in enumerate(cable.sites):
        if isinstance(pulley, Pulley):
            path[i] = replace(pulley, radius=pulley.radius + more)
            for k in (i - 1, i + 1):
                site = path[k]
                if isinstance(site, Site) and site.link == pulley.link:
                    path[k] = _with_rim(pulley, site, more)
    return replace(cable, sites=tuple(path))


def _scaled(cable: Cable, factor: float) -> Cable:
    return replace(cable, elasticity=cable.elasticity.scaled(factor))


PARAMETERS: Final[dict[str, Parameter]] = {
    "rigidity": Parameter(
        unit=NUMBER,
        kinds=("cables",),
        get=lambda cable: 1.0,
        set=_scaled,
        is_relative=True,
        is_common=True,
        largest=0.5,
    ),
    "spring": attribute("cables", "series_stiffness", STIFFNESS, is_relative=True, largest=0.5),
    "joint_stiffness": Parameter(
        unit=SPRING,
        kinds=("joints",),
        get=_joint_stiffness,
        set=_with_joint_stiffness,
        is_spring=True,
        lacks="no joints with axes there; free the bending_stiffness of its beams",
        is_relative=True,
        is_common=True,
        largest=0.5,
    ),
    "bending_stiffness": Parameter(
        unit=BENDING,
        kinds=("joints", "links"),
        get=_bending_stiffness,
        set=_with_bending_stiffness,
        is_spring=True,
        lacks="no backbone and no links that bend there",
        is_relative=True,
        is_common=True,
        largest=0.5,
    ),
    "exponent": Parameter(
        unit=NUMBER,
        kinds=("joints",),
        get=_exponent,
        set=_with_exponent,
        is_spring=True,
        lacks="no joints there whose spring is a SpringLaw.power",
        is_common=True,
        largest=0.5,
        usual=(0.3, 2.0),
    ),
    "lead": attribute("routes", "lead", METRE),
    "hole_radius": attribute("joints", "hole_radius", METRE),
    "hole_angle": attribute("routes", "angle", RADIAN, largest=0.3),
    "phase": Parameter(
        unit=RADIAN,
        kinds=("routes",),
        get=lambda route: 0.0,
        set=_turned,
        shares="hole_angle",
    ),
    "disk_offset": attribute("joints", "disk_offset", METRE),
    "link_length": attribute("links", "length", METRE),
    "link_mass": attribute("links", "mass", KILOGRAM),
    "friction": Parameter(
        unit=NUMBER,
        kinds=("cables",),
        get=_friction,
        set=Cable.with_friction,
        is_common=True,
        largest=0.5,
        usual=(0.0, 1.0),
        typical=0.1,
    ),
    "pulley_radius": Parameter(
        unit=METRE,
        kinds=("cables",),
        get=_pulley_radius,
        set=_with_pulleys,
        lacks="no pulleys there",
    ),
    "slack": attribute("cables", "slack", METRE, acts_under_load=False),
    "gain": attribute("cables", "gain", NUMBER, largest=0.5, acts_under_load=False),
    "motor_stiffness": Parameter(
        unit=SPRING,
        kinds=("motors",),
        get=_motor_stiffness,
        set=_with_motor_stiffness,
        lacks="no motor with a stiffness there; give cdsm.Motor(…, stiffness=)",
        is_relative=True,
        is_common=True,
        largest=0.5,
    ),
}
"""All parameters by name; :class:`~cdsm.ArmParameters` explains them."""

"""Paths of cables: sites that they pass, pulleys that they run around, sheaths that guide them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import (
    check_numbers,
    checked_quantity,
    flag,
    number,
    one_of,
    scalar,
    text,
    vector,
    whole_number,
)
from cdsm.support.values import Array

SURFACE = 1e-9
"""Distance from a pulley's surface [m] below which a point is on it: a free piece has no length.

Rounding of √(R² − r²) would be as long, and its direction would be noise.
"""


@final
@dataclass(frozen=True)
class Site:
    """A point fixed to a link, through which a cable passes or at which it ends.

    Attributes:
        link: Name of the link in the URDF.
        position: Position in the link's frame [m].
        friction: Coulomb friction coefficient μ [-] between cable and hole, 0 to 2.
        wrap: Wrap angle [rad] beyond that between the two segments, e.g. of a curved tube, 0 to 4π.

    Raises InvalidInput if an attribute is anything else.

    Example:
        >>> import cdsm
        >>> hole = cdsm.Site("link1", (0.01, 0.025, 0.0), friction=0.1)
        >>> hole.link, hole.friction
        ('link1', 0.1)
    """

    link: str
    position: tuple[float, float, float]
    friction: float = number("friction", 0.0, zero=True)
    wrap: float = number("wrap", 0.0, zero=True)

    def __post_init__(self) -> None:
        text("link", self.link)
        position = vector("position", self.position, 3, f"a point on {self.link} [m]", "length")
        check_numbers(self)
        self.__dict__["position"] = tuple(position.tolist())


@final
@dataclass(frozen=True)
class Pulley:
    """A cylinder fixed to a link, around which a cable runs in the positive sense of its axis.

    Turn the axis over for the other side: with the thumb of the right hand along the axis, the
    cable runs as the fingers point. The wrap angle Φ is between −90° and 270°, plus 360° for each
    of the ``turns``; the cable does not touch where Φ < 0, and runs straight past the pulley.

    A pulley with a groove keeps the cable in its plane: idlers, and pulleys on the axis of a joint.
    A smooth one (``groove=False``) lets the cable shift along the axis, on which it is a helix:
    drums, posts, rounded edges. The two differ beside the plane: a groove also holds sideways.

    The groove is narrow and the cable has no thickness. The radius therefore counts to the centre
    line of the cable: radius of the groove plus half the diameter of the cable.

    Attributes:
        link: Name of the link in the URDF.
        position: Centre c in the link's frame [m]; the plane of a groove passes through it.
        axis: Axis a in the link's frame, of any length.
        radius: r [m], to the centre line of the cable.
        groove: Whether the pulley keeps the cable in its plane.
        turns: Whole turns of the cable beyond Φ in (−90°, 270°].
        friction: Coulomb friction coefficient μ [-] of a post that does not turn, 0 to 2.
        bearing: Friction of a pulley that turns, `μ_bearing r_bearing/r` [-], 0 to 1; not both.

    Raises InvalidInput if an attribute is anything else.

    Example:
        >>> import cdsm
        >>> pulley = cdsm.Pulley("link1", position=(0, 0, 0), axis=(0, 0, 1), radius=0.008)
        >>> pulley.radius, pulley.groove
        (0.008, True)
    """

    link: str
    position: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float
    groove: bool = True
    turns: int = 0
    friction: float = 0.0
    bearing: float = 0.0

    def __post_init__(self) -> None:
        text("link", self.link)
        where = f"pulley on {self.link}"
        position = vector("position", self.position, 3, f"the centre of a {where} [m]", "length")
        axis = vector("axis", self.axis, 3, f"the axis of a {where}")
        if math.hypot(*axis) < 1e-9:
            raise InvalidInput("axis", f"{self.axis} of a {where} has no direction.")
        turns = scalar("turns", self.turns)
        if turns < 0.0 or turns != round(turns):
            message = f"{turns:g} given for a {where}; a whole number, 0 or more, is needed. "
            raise InvalidInput("turns", message + "Turn its axis over for the other side.")
        groove = flag("groove", self.groove)
        friction = checked_quantity("friction", self.friction, "friction", zero=True)
        bearing = scalar("bearing", self.bearing)
        if not 0.0 <= bearing < 1.0:
            message = f"{bearing:g} given for a {where}; 0 to 1 is needed: μ_bearing r_bearing/r."
            raise InvalidInput("bearing", message)
        if not groove and (friction or bearing):
            message = f"a smooth {where} has friction; how a cable then shifts along the axis is "
            raise InvalidInput("friction", message + "not modelled. Give a groove, or no friction.")
        if friction and bearing:
            message = f"a {where} has friction and bearing; give friction for a post that does not "
            raise InvalidInput("bearing", message + "turn, or bearing for a pulley that does.")
        self.__dict__.update(
            position=tuple(position.tolist()),
            axis=tuple(axis.tolist()),
            radius=checked_quantity("radius", self.radius, "length"),
            groove=groove,
            turns=int(turns),
            friction=friction,
            bearing=bearing,
        )


def unit_axis(pulley: Pulley) -> Array:
    """Return the axis a (3,) of a pulley, of length 1."""
    axis = np.array(pulley.axis)
    return np.asarray(axis / np.linalg.norm(axis))


def off_axis(pulley: Pulley, points: ArrayLike) -> Array:
    """Return the parts of the ways from the centre to points (…, 3) that are square to the axis."""
    axis = unit_axis(pulley)
    apart = np.subtract(points, pulley.position)
    return np.asarray(apart - (apart @ axis)[..., None] * axis)


@final
@dataclass(frozen=True)
class JointPulley:
    """A pulley on the axis of a joint; in an arm it becomes the :class:`Pulley` that it stands for.

    It is fixed to the link before the joint. The moment arm of the cable about the joint is the
    radius as long as the cable touches it.

    Attributes:
        joint: Name of the joint in the URDF.
        radius: r [m], to the centre line of the cable.
        turn: ``"+"``: the cable runs around the axis of the joint in its positive sense. Then it
            gets longer by r Δθ as the joint turns by Δθ, and turns the joint to negative angles.
            ``"-"``: the other way round.
        groove: As of a :class:`Pulley`, like the following.
        turns: Whole turns beyond Φ in (−90°, 270°].
        friction: μ [-] of a post that does not turn.
        bearing: Friction of a pulley that turns, `μ_bearing r_bearing/r` [-].

    Raises InvalidInput if an attribute is anything else.

    Example:
        >>> import cdsm
        >>> pulley = cdsm.JointPulley("mcp", radius=0.008, turn="+")
        >>> pulley.joint, pulley.turns
        ('mcp', 0)
    """

    joint: str
    radius: float
    turn: Literal["+", "-"] = "+"
    groove: bool = True
    turns: int = 0
    friction: float = 0.0
    bearing: float = 0.0

    def __post_init__(self) -> None:
        text("joint", self.joint)
        one_of("turn", self.turn, ("+", "-"))
        self.placed(self.joint, np.zeros(3), np.array([1.0, 0.0, 0.0]))

    def placed(self, link: str, position: Array, axis: Array) -> Pulley:
        """Return the pulley at a joint, of which place and axis are in the frame of ``link``."""
        side = axis if self.turn == "+" else -axis
        return Pulley(
            link,
            tuple(position.tolist()),
            tuple(side.tolist()),
            self.radius,
            self.groove,
            self.turns,
            self.friction,
            self.bearing,
        )


_PIECES = 1000  # of a sheath at most


@final
@dataclass(frozen=True)
class Sheath:
    """A sheath (Bowden tube) that guides a cable, before its first site or between two sites.

    Its length is constant, so it exerts no torque on the joints that it passes, and counts for the
    stiffness of the cable alone. With friction, the tension falls by `e^{−μφ}` along it, over the
    total angle φ by which it is bent. The compliance of the sheath itself is in series: add it to
    1/``series_stiffness``. Its bending stiffness is a spring at the joints that it passes.

    Attributes:
        length: Length of the sheath [m].
        wrap: Total angle φ by which it is bent [rad], 0 to 4π, at the working posture.
        friction: Coulomb friction coefficient μ [-] between cable and sheath, 0 to 2.
        pieces: Number of places at which friction acts, 1 to 1000; 8 are within 0.15 %
            of the continuous sheath for μφ = 1.

    Raises InvalidInput if an attribute is anything else.

    Example:
        >>> import cdsm
        >>> sheath = cdsm.Sheath(length=0.5, wrap=1.57, friction=0.15)
        >>> sheath.pieces
        8
    """

    length: float
    wrap: float = number("wrap", 0.0, zero=True)
    friction: float = number("friction", 0.0, zero=True)
    pieces: int = 8

    def __post_init__(self) -> None:
        check_numbers(self)
        self.__dict__["length"] = checked_quantity("length", self.length, "length")
        self.__dict__["pieces"] = whole_number("pieces", self.pieces, 1, _PIECES)


PathElement = Site | Pulley | Sheath
"""An entry of the path of a cable in an arm."""


def check_cable_path(elements: object, lead: float) -> tuple[PathElement, ...]:
    """Return the path of a cable with this lead [m], or InvalidInput, which names the entry."""
    if not isinstance(elements, list | tuple) or not all(
        isinstance(element, PathElement | JointPulley) for element in elements
    ):
        message = f"{elements!r} given; a list or tuple of Site, Pulley or Sheath is needed."
        raise InvalidInput("sites", message)
    path = tuple(elements)
    for i in {0, max(len(path) - 1, 0)} if path else ():
        if isinstance(path[i], Pulley | JointPulley):
            end = "ends" if i else "begins"
            message = f"the cable {end} at {_words(path[i])}; it needs a Site there. "
            raise InvalidInput(
                "sites", message + "A cable that is fixed to the rim has its site on it."
            )
    sites = sum(isinstance(element, Site) for element in path)
    if sites < 2:
        raise InvalidInput("sites", f"{sites} given; two or more Site are needed.")
    if isinstance(path[-1], Sheath):
        raise InvalidInput("sites", "the cable ends in a sheath; it needs a Site behind it.")
    if isinstance(path[0], Sheath) and lead > 0.0:
        message = (
            f"the cable has a lead of {1e3 * lead:g} mm and begins in a sheath; give one of them."
        )
        raise InvalidInput("lead", message)
    for i, (first, second) in enumerate(pairwise(path), start=1):
        if isinstance(first, Sheath) != isinstance(second, Sheath):
            other = second if isinstance(first, Sheath) else first
            if not isinstance(other, Site):
                message = f"entries {i} and {i + 1} are a sheath and {_words(other)}; "
                raise InvalidInput("sites", message + "put a Site between them.")
        elif isinstance(first, Sheath):
            message = f"entries {i} and {i + 1} are sheaths; put a Site between them."
            raise InvalidInput("sites", message)
    return path


def _words(pulley: Pulley | JointPulley) -> str:
    if isinstance(pulley, JointPulley):
        return f"the pulley at {pulley.joint}"
    return f"the pulley on {pulley.link}"


def positions(path: Sequence[PathElement]) -> list[Site | Pulley]:
    """Return the entries of a path that have a place on a link: all but sheaths."""
    return [element for element in path if not isinstance(element, Sheath)]

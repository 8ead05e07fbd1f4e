"""Named numbers of an arm: their units, their values, and the arm that has other values."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, NamedTuple, final

import numpy as np

from cdsm.cable import Cable, Site, require_own_cables, serpentine_cables
from cdsm.errors import InvalidInput
from cdsm.geometry import Joint, Link
from cdsm.manipulator import Manipulator
from cdsm.support.validation import instance, one_of, scalar, text
from cdsm.wires.elasticity import Elasticity


class Parameter(NamedTuple):
    """A number of an arm, of each joint or of each cable."""

    unit: str  # unit shown to people
    size: float  # size of ``unit`` in SI
    # of the geometry, with "beams" for joints and links that bend; or a Cable of the arm
    part: Literal["joints", "links", "beams", "routes", "cables"]
    attribute: str  # its name there
    neutral: float = math.nan  # of a change of this number: the value that leaves it as it is


PARAMETERS: Final = {
    "hole_radius": Parameter("mm", 1e-3, "joints", "hole_radius"),
    "disk_offset": Parameter("mm", 1e-3, "joints", "disk_offset"),
    "link_length": Parameter("mm", 1e-3, "links", "length"),
    "link_mass": Parameter("g", 1e-3, "links", "mass"),
    "joint_stiffness": Parameter("N m/rad", 1.0, "joints", "stiffness"),
    "bending_stiffness": Parameter("N m²", 1.0, "beams", "bending_stiffness"),
    "lead": Parameter("mm", 1e-3, "routes", "lead"),
    "hole_angle": Parameter("deg", math.pi / 180.0, "routes", "angle"),
    "phase": Parameter("deg", math.pi / 180.0, "routes", "angle", neutral=0.0),
    "friction": Parameter("", 1.0, "cables", "friction"),
    "spring": Parameter("N/mm", 1e3, "cables", "series_stiffness"),
    "rigidity": Parameter("", 1.0, "cables", "elasticity", neutral=1.0),
    "slack": Parameter("mm", 1e-3, "cables", "slack"),
    "gain": Parameter("", 1.0, "cables", "gain"),
}
"""All parameters by name; :class:`ArmParameters` explains them."""


@final
@dataclass(frozen=True)
class ArmParameters:
    """Arm as a function of some of its parameters; use it as ``model_of`` of :func:`identify`.

    - ``hole_radius``, ``disk_offset`` [m] of a joint; ``link_length`` [m], ``link_mass`` [kg] of
      the link after it; ``joint_stiffness`` [N m/rad] of the springs about its axes.
    - ``bending_stiffness`` EI [N m²] of a neck, a gap of a backbone or a link that bends; its GJ
      changes in the same ratio.
    - Of a cable: ``lead`` [m], ``hole_angle`` [rad], ``friction`` μ [-] in its holes, ``spring``
      [N/m] in series, ``rigidity`` [-], a factor on the EA of its law, ``slack`` [m] and ``gain``
      [-] of its motor, and ``phase`` [rad], which is added to its hole angle.

    ``"hole_radius"`` is that of all joints, ``"hole_radius@2"`` of the second one from the base.
    ``"lead"`` is that of all cables, ``"lead@2"`` of the cables that end at joint 2,
    ``"lead@cable2_1"`` of one cable. An arm from a URDF has only friction, spring, rigidity, slack
    and gain, of all cables or of one. A call passes names with @ in a dict:
    ``parameters(**{"hole_radius@2": 0.025})``.

    Attributes:
        arm: The arm; parameters that are not named keep their values.
        names: Names of the parameters, in any order.

    Raises:
        InvalidInput: There is no such parameter or cable. The arm has no such joint, no geometry,
            or other cables, leads, holes or springs than its geometry; or two names change the same
            number.
    """

    arm: Manipulator
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        instance("arm", self.arm, Manipulator)
        object.__setattr__(self, "names", tuple(text("names", name) for name in self.names))
        if self.arm.is_serpentine:
            require_own_cables(self.arm.geometry, self.arm.cables)
        taken = set[tuple[str, int]]()
        for name in self.names:
            kind, where = self._place(name)
            numbers = {(PARAMETERS[kind].attribute, i) for i in where}
            if not numbers:
                lacks = _LACKS.get(kind, "no cable that ends there")
                raise InvalidInput(name, f"{self.arm.name} has {lacks}.")
            if kind in _LACKS and self.arm.own_springs is not None:
                said = (
                    "the springs of the arm are not those of its geometry, which alone is varied."
                )
                raise InvalidInput(name, f"{said} Give them by joint_stiffness= of the geometry.")
            if taken & numbers:
                raise InvalidInput(name, f"frees {kind} of a joint twice.")
            taken |= numbers

    def unit(self, name: str) -> tuple[str, float]:
        """Return the unit in which the parameter ``name`` is printed, and its size in SI."""
        kind = PARAMETERS[self._place(name)[0]]
        return kind.unit, kind.size

    @property
    def present(self) -> dict[str, float]:
        """Value of each parameter in :attr:`arm`, in SI; the median if its joints differ.

        A ``rigidity`` is 1 and a ``phase`` 0.
        """
        return {name: float(np.median(self.values(name))) for name in self.names}

    def __call__(self, **values: float) -> Manipulator:
        """Build the arm with these values of parameters, in SI.

        Raises:
            GeometryError: No valid arm has these values.
            InvalidInput: A parameter is not among :attr:`names`. A rigidity is not positive, or a
                value is not a number. A spring is not positive.
        """
        places = {one_of("parameter", name, self.names): self._place(name) for name in values}
        numbers = {name: scalar(name, number) for name, number in values.items()}
        changes = [dict[str, float]() for _ in self.arm.cables]
        laws = dict[Any, Elasticity]()
        for name, (kind, where) in places.items():
            for i in where if PARAMETERS[kind].part == "cables" else ():
                changes[i][kind] = numbers[name]
        if all(PARAMETERS[kind].part == "cables" for kind, _ in places.values()):
            pairs = zip(self.arm.cables, changes, strict=True)
            return self.arm.with_cables([_changed(each, own, laws) for each, own in pairs])
        geometry = self.arm.geometry
        parts: dict[str, list[Any]] = {
            "joints": [*geometry.joints],
            "links": [*geometry.links],
            "routes": [*geometry.cables],
        }
        common = geometry.hole_radius
        for name, (kind, where) in places.items():
            value: float | None = numbers[name]
            if name == "hole_radius":
                common = numbers[name]  # of all joints: they have none of their own
                value = None
            _, _, part, attribute, _ = PARAMETERS[kind]
            for i in where if part != "cables" else ():
                if part == "beams":
                    own_part = "joints" if i < len(geometry.joints) else "links"
                    i %= len(geometry.joints)
                    parts[own_part][i] = _bent(parts[own_part][i], numbers[name])
                elif kind == "phase":
                    angle = parts[part][i].angle + numbers[name]
                    parts[part][i] = replace(parts[part][i], angle=angle)
                else:
                    parts[part][i] = replace(parts[part][i], **{attribute: value})
        geometry = geometry.replace(
            joints=tuple(parts["joints"]),
            links=tuple(parts["links"]),
            cables=tuple(parts["routes"]),
            hole_radius=common,
        )
        routed = serpentine_cables(geometry, self.arm.cables[0].elasticity)
        cables = [
            _changed(replace(old, sites=holes_like(new, old), lead=new.lead), own, laws)
            for old, new, own in zip(self.arm.cables, routed, changes, strict=True)
        ]
        return self.arm.with_geometry(geometry, cables)

    def _place(self, name: str) -> tuple[str, list[int]]:
        """Split a name such as ``hole_radius@2`` into its kind, and the indices in its part."""
        kind, at, place = name.partition("@")
        one_of("parameter of an arm", kind, PARAMETERS)
        part = PARAMETERS[kind].part
        if not self.arm.is_serpentine:
            if part != "cables":
                free = ", ".join(k for k, each in PARAMETERS.items() if each.part == "cables")
                said = "is not known of an arm from a URDF"
                raise InvalidInput(name, f"{said}; its cables have {free}.")
            names = self.arm.cables.names
            place = one_of("cable", place, names) if at else ""
            return kind, [c for c, own in enumerate(names) if place in ("", own)]
        geometry = self.arm.geometry
        count = len(geometry.joints)
        of_cable = part in ("routes", "cables")
        joints = [c.joint for c in geometry.cables] if of_cable else [*range(1, count + 1)] * 2
        if of_cable and place.startswith("cable"):
            one_of("cable", place, geometry.cable_names)
            return kind, [geometry.cable_names.index(place)]
        if at and not (place.isdecimal() and 1 <= int(place) <= count):
            raise InvalidInput(name, f"the arm has the joints 1 to {count}.")
        where = range(len(joints) if of_cable or part == "beams" else count)
        own = [i for i in where if not at or joints[i] == int(place)]
        if kind == "joint_stiffness":
            own = [i for i in own if geometry.joints[i].axes]
        elif part == "beams":
            own = [i for i in own if self._beams[i].bending_stiffness is not None]
        return kind, own

    @property
    def _beams(self) -> tuple[Joint | Link, ...]:
        return (*self.arm.geometry.joints, *self.arm.geometry.links)

    def values(self, name: str) -> list[float]:
        """Return the values in SI that the parameter ``name`` has in the joints or cables."""
        kind, where = self._place(name)
        _, _, part, attribute, neutral = PARAMETERS[kind]
        if not math.isnan(neutral):
            return [neutral]
        if kind == "hole_radius":
            return [self.arm.geometry.hole_radii[i] for i in where]
        if kind == "friction":
            return [max(site.friction for site in self.arm.cables[i].sites) for i in where]
        owners: Any = self._beams if part == "beams" else self.arm.cables
        if part not in ("cables", "beams"):
            owners = getattr(self.arm.geometry, "cables" if part == "routes" else part)
        return [getattr(owners[i], attribute) for i in where]


_LACKS: Final = {
    "joint_stiffness": "no joints with axes there; free the bending_stiffness of its beams",
    "bending_stiffness": "no backbone and no links that bend there",
}


def _bent(beam: Joint | Link, EI: float) -> Joint | Link:
    """Return a beam with another bending stiffness, and with GJ in the same ratio."""
    GJ = beam.torsion_stiffness
    assert beam.bending_stiffness is not None
    GJ = None if GJ is None else GJ * EI / beam.bending_stiffness
    return replace(beam, bending_stiffness=EI, torsion_stiffness=GJ)


def _changed(cable: Cable, changes: dict[str, float], laws: dict[Any, Elasticity]) -> Cable:
    """Return the cable with ``changes``; cables that share one of the scaled ``laws`` share it."""
    if "friction" in changes:
        cable = cable.with_friction(changes["friction"])
    names = {name: PARAMETERS[name].attribute for name in ("spring", "slack", "gain")}
    own: dict[str, Any] = {names[key]: x for key, x in changes.items() if key in names}
    if "rigidity" in changes:
        law = cable.elasticity
        factor = changes["rigidity"]
        own["elasticity"] = laws.setdefault((law, factor), law.scaled(factor))
    return replace(cable, **own)


def holes_like(cable: Cable, other: Cable) -> tuple[Site, ...]:
    """Return the sites of ``cable``, with the friction and the wrap of the holes of ``other``.

    A hole that only ``cable`` passes gets the friction of the nearest hole that ``other`` passes.
    """
    sites = list(cable.sites)
    known = other._holes
    for i in cable._holes if known else ():
        near = min(max(i, known[0]), known[-1])
        wrap = other.sites[near].wrap if i == near else 0.0
        sites[i] = replace(sites[i], friction=other.sites[near].friction, wrap=wrap)
    return tuple(sites)

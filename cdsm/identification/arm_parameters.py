"""Build an arm from values of named parameters: dimensions, masses, rigidity, springs, friction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple, final

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.geometry import Geometry
from cdsm.geometry.cables import require_own_cables, serpentine_cables
from cdsm.manipulator import Manipulator
from cdsm.support.validation import instance, one_of, scalar, text
from cdsm.wires.elasticity import Elasticity


class _Kind(NamedTuple):
    """One kind of parameter: its unit, and where a geometry or a :class:`~cdsm.Cable` stores it."""

    unit: str  # unit shown to the user
    size: float  # size of ``unit`` in SI
    # part of the geometry: ``joints``, ``links`` or ``cables``; empty if it belongs to a Cable
    part: str = ""
    attribute: str = ""  # its name in this part, or in the Cable


KINDS: Final = {
    "friction": _Kind("", 1.0),
    "rigidity": _Kind("", 1.0),
    "spring": _Kind("N/mm", 1e3, "", "series_stiffness"),
    "lead": _Kind("mm", 1e-3, "cables", "lead"),
    "hole_radius": _Kind("mm", 1e-3, "joints", "hole_radius"),
    "disk_offset": _Kind("mm", 1e-3, "joints", "disk_offset"),
    "link_length": _Kind("mm", 1e-3, "links", "length"),
    "link_mass": _Kind("g", 1e-3, "links", "mass"),
}
"""Kinds of parameters of an arm, by name."""


@final
@dataclass(frozen=True)
class ArmParameters:
    """Arm as a function of some of its parameters; use it as ``model_of`` of :func:`identify`.

    A parameter belongs to all joints or links (``"hole_radius"``), or to one, counted from the base
    (``"hole_radius@2"``). The parameters ``lead``, ``friction``, ``rigidity`` and ``spring`` belong
    to all cables, or with a number to the cables that end at that joint. ``friction`` is μ [-].
    ``rigidity`` [-] multiplies EA of the arm's laws. ``spring`` [N/m] is the stiffness in series
    with each cable. All others are lengths [m] or masses [kg]. A call passes names with @ in a
    dict: ``parameters(**{"hole_radius@2": 0.025})``.

    Attributes:
        arm: The arm; parameters that are not named keep their values.
        names: Names of the parameters, in any order.

    Raises:
        UnknownName: There is no such parameter.
        InvalidInput: The arm has no such joint, no geometry, or other cables, leads or holes than
            its geometry; or a name is given twice, or both for all joints and for one joint.
    """

    arm: Manipulator
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        instance("arm", self.arm, Manipulator)
        object.__setattr__(self, "names", tuple(text("names", name) for name in self.names))
        require_own_cables(self.geometry, self.arm.cables)
        taken = set[tuple[str, int]]()
        for name in self.names:
            kind, where = self._place(name)
            if taken & {(kind, k) for k in where}:
                raise InvalidInput(name, f"frees {kind} of a joint twice.")
            taken |= {(kind, k) for k in where}

    @property
    def geometry(self) -> Geometry:
        """Geometry of the arm; raises InvalidInput for an arm from a URDF, which has none."""
        return self.arm.geometry

    def _place(self, name: str) -> tuple[str, tuple[int, ...]]:
        """Split the ``name`` of a parameter into its kind and the numbers of its joints.

        ``"hole_radius@2"`` gives ``"hole_radius"`` and (2,). Without @ the numbers are those of all
        joints. Raises UnknownName or InvalidInput if the kind or the joint does not exist.
        """
        kind, at, number = name.partition("@")
        one_of("parameter of an arm", kind, KINDS)
        joints = len(self.geometry.joints)
        if at and not (number.isdecimal() and 1 <= int(number) <= joints):
            raise InvalidInput(name, f"the arm has the joints 1 to {joints}.")
        return kind, (int(number),) if at else tuple(range(1, joints + 1))

    def unit(self, name: str) -> tuple[str, float]:
        """Return the unit in which the parameter ``name`` is printed, and its size in SI."""
        kind = KINDS[self._place(name)[0]]
        return kind.unit, kind.size

    @property
    def present(self) -> dict[str, float]:
        """Value of each parameter in :attr:`arm`, in SI; the median if its joints differ.

        ``rigidity`` is a factor, so its present value is 1.
        """
        return {name: float(np.median(self._values(name))) for name in self.names}

    def __call__(self, **values: float) -> Manipulator:
        """Build the arm with these values of parameters, in SI.

        Raises:
            GeometryError: No valid arm has these values.
            UnknownName: A parameter is not among :attr:`names`.
            InvalidInput: A rigidity is not positive, or a value is not a number.
            CableError: A spring is not positive.
        """
        geometry, parts = self.geometry, dict[str, list[Any]]()
        of_joint: dict[int, dict[str, float]] = {}
        for name, number in values.items():
            one_of("parameter", name, self.names)
            value, (kind, where) = scalar(name, number), self._place(name)
            part, attribute = KINDS[kind].part, KINDS[kind].attribute
            if not part:
                for k in where:
                    of_joint.setdefault(k, {})[kind] = value
                continue
            own = parts.setdefault(part, list(getattr(geometry, part)))
            for i, k in enumerate(_joints_of(geometry, part)):
                if k in where:
                    own[i] = replace(own[i], **{attribute: value})
        if parts:
            geometry = geometry.replace(**{part: tuple(own) for part, own in parts.items()})
        cables, laws = [], dict[tuple[Elasticity, float], Elasticity]()
        routed = serpentine_cables(geometry, self.arm.cables[0].elasticity)
        for old, new, route in zip(self.arm.cables, routed, geometry.cables, strict=True):
            sites = tuple(
                replace(site, position=moved.position)
                for site, moved in zip(old.sites, new.sites, strict=True)
            )
            cable, given = replace(old, sites=sites, lead=new.lead), of_joint.get(route.joint, {})
            if "friction" in given:
                cable = cable.with_friction(given["friction"])
            if "rigidity" in given:
                law, factor = cable.elasticity, given["rigidity"]
                # cables share their law: they are computed together
                shared = laws.setdefault((law, factor), law.scaled(factor))
                cable = replace(cable, elasticity=shared)
            if "spring" in given:
                cable = replace(cable, series_stiffness=given["spring"])
            cables.append(cable)
        return Manipulator(
            geometry,
            cables=cables,
            gravity=self.arm.gravity,
            original_length=self.arm.original_length,
        ).with_tolerances(self.arm.tolerances)

    def _values(self, name: str) -> list[float]:
        """Return the values in SI that the parameter ``name`` has now, at each of its joints."""
        (kind, where), geometry = self._place(name), self.geometry
        if kind == "rigidity":
            return [1.0]
        if kind == "hole_radius":
            return [geometry.hole_radii[k - 1] for k in where]
        part, attribute = KINDS[kind].part, KINDS[kind].attribute
        parts = getattr(geometry, part) if part else self.arm.cables
        joints = _joints_of(geometry, part or "cables")
        own = [each for k, each in zip(joints, parts, strict=True) if k in where]
        if kind == "friction":
            return [max(site.friction for site in cable.sites) for cable in own]
        return [getattr(each, attribute) for each in own]


def _joints_of(geometry: Geometry, part: str) -> list[int]:
    """Return the number of the joint to which each entry of a part of the geometry belongs.

    ``part`` is ``joints``, ``links`` or ``cables``. Link k belongs to joint k, a cable to the joint
    at which it ends.
    """
    if part == "cables":
        return [route.joint for route in geometry.cables]
    return list(range(1, len(geometry.joints) + 1))

"""An arm as a function of some of its parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from cdsm.cable import holes_like, require_own_cables, serpentine_cables
from cdsm.errors import CdsmError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.parameters import PARAMETERS, Parameter, PartKind
from cdsm.support.validation import instance, one_of, scalar, sequence_of, text

Place = tuple[PartKind, int]
"""PartKind of a part of an arm, and its index among them."""


@final
@dataclass(frozen=True)
class ArmParameters:
    """Arm as a function of some of its parameters; use it as ``model_of`` of :func:`identify`.

    - ``hole_radius``, ``disk_offset`` [m] of a joint; ``link_length`` [m], ``link_mass`` [kg] of
      the link after it; ``joint_stiffness`` [N m/rad] of the springs about its axes, which scales a
      law as a whole, and ``exponent`` [-] of a law :meth:`SpringLaw.power`.
    - ``bending_stiffness`` EI [N m²] of a neck, a gap of a backbone or a link that bends; its GJ
      changes in the same ratio.
    - ``motor_stiffness`` `k_m` [N m/rad] of a motor that has one.
    - Of a cable: ``lead`` [m], ``hole_angle`` [rad], ``friction`` μ [-] in its holes, ``spring``
      [N/m] in series, ``rigidity`` [-], a factor on the EA of its law, ``slack`` [m] and ``gain``
      [-] of its motor, ``phase`` [rad], which is added to its hole angle, and ``pulley_radius``
      [m], which is added to the radius of each of its pulleys.

    ``"hole_radius"`` is that of all joints, ``"hole_radius@2"`` of the second one from the base.
    ``"lead"`` is that of all cables, ``"lead@2"`` of the cables that end at joint 2,
    ``"lead@cable2_1"`` of one cable, ``"motor_stiffness@m1"`` that of one motor. An arm from a URDF
    has only friction, spring, rigidity, slack, gain and pulley_radius, of all cables or of one, and
    its motors. A call passes names with @ in a dict: ``parameters(**{"hole_radius@2": 0.025})``.

    Attributes:
        arm: The arm; parameters that are not named keep their values.
        names: Names of the parameters, in any order.

    Raises:
        InvalidInput: There is no such parameter or cable. The arm has no such joint, no geometry,
            or other cables, leads, holes or springs than its geometry; or two names change the same
            number.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> model = cdsm.ArmParameters(arm, ("friction", "lead"))
        >>> arm = model(friction=0.1, lead=0.3)
        >>> arm.cables[0].friction, arm.cables[0].lead
        ((0.0,), 0.3)
    """

    arm: Manipulator
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        instance("arm", self.arm, Manipulator)
        names = sequence_of("names", self.names, str)
        object.__setattr__(self, "names", tuple(text("names", name) for name in names))
        if self.arm.is_serpentine:
            require_own_cables(self.arm.geometry, self.arm.cables)
        free = dict[tuple[str, Place], str]()
        for name in self.names:
            parameter = parameter_of(name)
            if parameter.is_spring and self.arm.definition.springs is not None:
                problem = "its springs are not those of its geometry, which alone is varied"
                remedy = "Give them by joint_stiffness= of the geometry."
                raise InvalidInput(name, f"{self.arm.name}: {problem}. {remedy}")
            for place in self.places(name):
                number = parameter.shares or name.partition("@")[0]
                if (number, place) in free:
                    other = free[number, place]
                    problem = f"changes a number that {other} changes too; name it once."
                    raise InvalidInput(name, problem)
                free[number, place] = name

    def unit(self, name: str) -> tuple[str, float]:
        """Return the unit in which the parameter ``name`` is printed, and its size in SI."""
        return parameter_of(name).unit.shown

    @property
    def present(self) -> dict[str, float]:
        """Value of each parameter in :attr:`arm`, in SI; the median if its joints differ.

        A ``rigidity`` is 1, a ``phase`` and a ``pulley_radius`` are 0.
        """
        return {name: float(np.median(self.values(name))) for name in self.names}

    def start(self, name: str, low: float, high: float) -> float | None:
        """Return a value in SI from which to seek a parameter within bounds; None: any.

        It is that of the arm, or else the typical one: of a friction of 0, no derivative shows what
        it does.
        """
        for value in (self.present[name], parameter_of(name).typical):
            if value is not None and low < value < high:
                return value
        return None

    def require_arms(self, name: str, low: float, high: float) -> None:
        """Raise InvalidInput if there is no arm at an end of the bounds of a parameter, in SI."""
        unit, size = self.unit(name)
        for side, value in (("low", low), ("high", high)):
            try:
                self(**{name: value})
            except CdsmError as error:
                given = f"{side} = {value / size:g} {unit}".rstrip()
                problem = (
                    f"the bound {given} is given, but no arm has it: {error} Give closer ones."
                )
                raise InvalidInput(name, problem) from None

    def values(self, name: str) -> list[float]:
        """Return the values in SI that the parameter ``name`` has in the joints or cables."""
        parameter = parameter_of(name)
        values = [parameter.get(self._parts[kind][i]) for kind, i in self.places(name)]
        return [value for value in values if value is not None]

    def __call__(self, **values: float) -> Manipulator:
        """Build the arm with these values of parameters, in SI.

        Raises:
            GeometryError: No valid arm has these values.
            InvalidInput: A parameter is not among :attr:`names`. A rigidity is not positive, or a
                value is not a number. A spring is not positive.
        """
        parts = {kind: [*group] for kind, group in self._parts.items()}
        changed = set[PartKind]()
        for name, value in values.items():
            parameter = parameter_of(one_of("parameter", name, self.names))
            number = scalar(name, value)
            for kind, i in self.places(name):
                parts[kind][i] = parameter.set(parts[kind][i], number)
                changed.add(kind)
        return self._built(parts, changed)

    def with_number(self, name: str, place: Place, value: float) -> Manipulator:
        """Build the arm in which one part alone has another number ``name``, in SI."""
        kind, i = place
        parts = {kind: [*group] for kind, group in self._parts.items()}
        parts[kind][i] = parameter_of(name).set(parts[kind][i], scalar(name, value))
        return self._built(parts, {kind})

    def _built(self, parts: dict[PartKind, list[Any]], changed: set[PartKind]) -> Manipulator:
        """Build the arm of these parts, of which those of some kinds are changed."""
        cables = parts["cables"]
        motors = tuple(parts["motors"])
        if changed <= {"cables", "motors"}:
            return self.arm.replace(cables=cables, motors=motors)
        geometry = self.arm.geometry.replace(
            joints=tuple(parts["joints"]),
            links=tuple(parts["links"]),
            cables=tuple(parts["routes"]),
        )
        routed = serpentine_cables(geometry, cables[0].elasticity)
        cables = [
            replace(cable, sites=holes_like(route, cable), lead=route.lead)
            for cable, route in zip(cables, routed, strict=True)
        ]
        return self.arm.with_motors(motors).with_geometry(geometry, cables)

    @property
    def _parts(self) -> dict[PartKind, tuple[Any, ...]]:
        """All parts of the arm by kind; each joint has a hole radius of its own."""
        parts: dict[PartKind, tuple[Any, ...]] = {"cables": self.arm.cables}
        parts["motors"] = self.arm.definition.motors
        if self.arm.is_serpentine:
            geometry = self.arm.geometry
            joints = zip(geometry.joints, geometry.hole_radii, strict=True)
            parts["joints"] = tuple(replace(joint, hole_radius=R) for joint, R in joints)
            parts["links"] = geometry.links
            parts["routes"] = geometry.cables
        return parts

    def places(self, name: str) -> list[Place]:
        """Return the parts that a name such as ``hole_radius@2`` or ``lead@cable2_1`` means.

        Raises InvalidInput if the arm has none.
        """
        parameter = parameter_of(name)
        parts = self._parts
        kinds = [kind for kind in parameter.kinds if kind in parts]
        if not kinds:
            free = [key for key, row in PARAMETERS.items() if "cables" in row.kinds]
            problem = "is not known of an arm from a URDF"
            raise InvalidInput(name, f"{problem}; its cables have {', '.join(free)}.")
        owners = {(kind, i) for kind in kinds for i in self._at(name, kind)}
        places = [
            (kind, i)
            for kind in kinds
            for i, part in enumerate(parts[kind])
            if (kind, i) in owners and parameter.get(part) is not None
        ]
        if not places:
            ends = "no cable that ends there"
            of_cables = {*kinds} <= {"routes", "cables"} and not owners
            lacks = ends if of_cables else parameter.lacks
            raise InvalidInput(name, f"{self.arm.name} has {lacks}.")
        return places

    def _at(self, name: str, kind: PartKind) -> list[int]:
        """Return the indices of the parts of a ``kind`` that stand where the name says."""
        _, at, where = name.partition("@")
        is_cable = kind in ("routes", "cables")
        names = self.arm.cables.names
        if not at:
            return [*range(len(self._parts[kind]))]
        if kind == "motors":
            drives = [motor.name for motor in self.arm.definition.motors]
            return [drives.index(one_of("motor", where, drives))]
        if is_cable and (where in names or not self.arm.is_serpentine or not where.isdecimal()):
            return [names.index(one_of("cable", where, names))]
        count = len(self.arm.geometry.joints)
        if not (where.isdecimal() and 1 <= int(where) <= count):
            raise InvalidInput(name, f"the arm has the joints 1 to {count}.")
        joints = [route.joint for route in self.arm.geometry.cables]
        ends = joints if is_cable else range(1, count + 1)
        return [i for i, joint in enumerate(ends) if joint == int(where)]


def parameter_of(name: str) -> Parameter:
    """Return the parameter of a name such as ``hole_radius@2``; InvalidInput if there is none."""
    return PARAMETERS[one_of("parameter of an arm", name.partition("@")[0], PARAMETERS)]

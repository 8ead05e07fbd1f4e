"""Design variables: numbers of an arm that a search may choose, and the arm that has them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, final

from cdsm.arm_parameters import ArmParameters
from cdsm.cable import Cable, holes_like, serpentine_cables
from cdsm.errors import InvalidInput, warn
from cdsm.geometry import CableRoute, Geometry
from cdsm.geometry.uniform import evenly_spaced, hinge_hole_angles
from cdsm.manipulator import Manipulator
from cdsm.parameters import NEWTON, NUMBER, PARAMETERS, Unit
from cdsm.support.format import place
from cdsm.support.validation import (
    WIDEST,
    checked_quantity,
    doubts_about_angle,
    doubts_about_units,
    instance,
    one_of,
    scalar,
    whole_number,
)
from cdsm.wires.catalogue import as_wire

Value = float | int | str
"""Value of a variable: a number in SI, or the name or the rigidity [N] of a wire."""

WHOLE: Final = ("end", "cables_per_joint")
"""Variables that are whole numbers."""

_OF_ARM: Final = (*WHOLE, "wire", "minimum")  # variables that are no parameters
_WIDEST_ANGLE = 4.0 * math.pi  # a range of angles beyond this [rad] is probably in degrees


@final
@dataclass(frozen=True)
class Variable:
    """Design variable: a number of an arm that a search may choose.

    Attributes:
        of: A parameter of an arm as in :class:`ArmParameters`, such as ``"hole_radius"`` of all
            joints, ``"hole_radius@2"`` of one, or ``"hole_angle@cable1_2"``; a link keeps its mass
            per length. Or ``"end@cable2_1"``, the number of the joint at which a cable ends;
            ``"cables_per_joint"``, the number of evenly spaced cables of each joint; ``"wire"`` of
            all cables; ``"minimum"`` [N], the lower bound of all tensions.
        low: Smallest value, in SI: [m], [rad], [N], …; None with ``choices``.
        high: Largest value, in SI; None with ``choices``.
        choices: Values to choose from, instead of a range; always needed for a wire.

    Raises:
        InvalidInput: There is no such variable. The range is empty or not of numbers; or joint or
            cable are missing, or given for a variable that has one value for the arm.

    Example:
        >>> import cdsm
        >>> cdsm.Variable("hole_radius", 0.02, 0.04).unit
        'm'
    """

    of: str
    low: float | None = None
    high: float | None = None
    choices: Sequence[Value] = ()

    def __post_init__(self) -> None:
        kind = self.kind if instance("of", self.of, str) else ""
        one_of("variable", kind, (*PARAMETERS, *_OF_ARM))
        if not isinstance(self.choices, (tuple, list)):
            raise InvalidInput("choices", f"{self.choices!r} given; give a list.")
        self.__dict__.update(choices=tuple(self.choices))
        if bool(self.choices) == (self.low is not None or self.high is not None):
            raise InvalidInput(self.of, "needs low and high, or choices.")
        if self.kind == "wire":
            if not self.choices:
                raise InvalidInput(self.of, "has no range; give choices: names, or EA in N.")
            for wire in self.choices:
                as_wire(wire)
        elif self.choices:
            values = [scalar(f"{self.of}.choices", choice) for choice in self.choices]
            if len(set(values)) < len(values):
                raise InvalidInput(self.of, "names a choice twice.")
        else:
            self.__dict__.update(zip(("low", "high"), self._range(), strict=True))
        of_cable = self.kind in ("hole_angle", "end")
        if of_cable and not self.at:
            raise InvalidInput(self.of, f"needs the name of a cable: {self.of}@cable1_1.")
        if self.at and not of_cable and self.kind not in PARAMETERS:
            raise InvalidInput(self.of, f"has one value for the arm: {self.kind}.")

    def _range(self) -> tuple[float, float]:
        if self.low is None or self.high is None:
            raise InvalidInput(self.of, "needs both low and high.")
        kind = self._unit.quantity
        low, high = (
            scalar(self.of, end)
            if kind is None
            else checked_quantity(self.of, end, kind, zero=True)
            for end in (self.low, self.high)
        )
        if not low < high:
            raise InvalidInput(self.of, f"from {low:g} to {high:g} given; give low < high.")
        if self.kind in WHOLE:
            low, high = (_whole(self.of, end) for end in (low, high))
        doubts = list[str]()
        if self.kind in ("hole_radius", "disk_offset"):
            doubts = doubts_about_units(0.0, [(self.of, high, WIDEST)])
        elif self.unit == "rad":
            doubts = doubts_about_angle(f"{self.of} up to", max(-low, high), _WIDEST_ANGLE)
        for doubt in doubts:
            warn(doubt)
        return low, high

    @property
    def kind(self) -> str:
        """The part of ``of`` before the @, such as ``hole_radius``."""
        return self.of.partition("@")[0]

    @property
    def at(self) -> str:
        """The number of the joint or the name of the cable after the @, or empty: all."""
        return self.of.partition("@")[2]

    @property
    def unit(self) -> str:
        """SI unit, or empty."""
        return self._unit.si

    @property
    def _unit(self) -> Unit:
        if self.kind in PARAMETERS:
            return PARAMETERS[self.kind].unit
        return NEWTON if self.kind == "minimum" else NUMBER

    @property
    def reroutes(self) -> bool:
        """Whether the variable changes the cables themselves, not a number of them."""
        return self.kind in (*WHOLE, "wire")

    def number_of(self, cell: str) -> float:
        """Return the number in a design of a value as text, in SI: of a choice its index.

        Raises ValueError if it is none.
        """
        return float([str(x) for x in self.choices].index(cell) if self.choices else cell)

    def shown(self, value: Value) -> str:
        """Return a value [SI] as text, in the unit shown to the user: mm, degrees, N."""
        if isinstance(value, (str, int)):
            return f"{value}"
        if self.unit in ("m", "rad"):
            return place(value, self.unit)
        unit, size = self._unit.shown
        return f"{value / size:.4g} {unit}".rstrip()

    def require(self, arm: Manipulator) -> None:
        """Raise InvalidInput if an arm lacks the joint or the cable of this."""
        if self.kind == "cables_per_joint" and not all(x.axes for x in arm.geometry.joints):
            problem = f"{arm.name} has a backbone or necks, whose cables no rule spaces; vary "
            first = arm.geometry.cable_names[0]
            raise InvalidInput(
                self.of, f"{problem}hole_angle@{first} or end@{first} of its cables."
            )
        if self.kind == "end":
            one_of("cable", self.at, arm.geometry.cable_names)
            if not self.choices:
                whole_number(f"{self.of}.high", self.high, 2, len(arm.geometry.joints))
        elif self.kind in PARAMETERS:
            ArmParameters(arm, (self.of,))

    def present(self, arm: Manipulator, minimum: float) -> float | None:
        """Return the value in an arm, the index of a choice; None if it has another or several."""
        geometry = arm.geometry
        numbers: Sequence[object]
        match self.kind:
            case "end":
                numbers = [geometry.cables[geometry.cable_names.index(self.at)].joint]
            case "cables_per_joint":
                joints = [cable.joint for cable in geometry.cables]
                numbers = [joints.count(k + 1) for k in range(len(geometry.joints))]
            case "minimum":  # where nothing asks for more, the least of the range will do
                least = max(minimum, min(cable.minimum for cable in arm.cables))
                numbers = [max(least, self.low or 0.0)]
            case "wire":
                laws = {cable.elasticity for cable in arm.cables}
                numbers = [wire for wire in self.choices if {as_wire(wire)} == laws][:1]
            case _:
                numbers = ArmParameters(arm, (self.of,)).values(self.of)
        values = {*numbers}
        if len(values) != 1:
            return None
        (value,) = values
        if self.choices:
            return float(self.choices.index(value)) if value in self.choices else None
        assert isinstance(value, (int, float))
        assert self.low is not None
        assert self.high is not None
        return float(value) if self.low <= value <= self.high else None


def _whole(name: str, value: float) -> int:
    """Return the value of variable ``name`` as a whole number; a float such as 3.0 is allowed."""
    return whole_number(name, round(value) if float(value).is_integer() else value, 1)


def changed(arm: Manipulator, values: dict[Variable, Value]) -> Manipulator:
    """Build the arm in which the variables have these values [SI].

    Raises GeometryError if no valid arm has them.
    """
    routing = tuple((variable, value) for variable, value in values.items() if variable.reroutes)
    base = _rerouted(arm, routing) if routing else arm
    numbers: dict[str, float] = {}
    for variable, value in values.items():
        if variable.kind not in PARAMETERS:
            continue
        numbers[variable.of] = scalar(variable.of, value)
        if variable.kind == "link_length":
            links = base.geometry.links
            changed_links = [int(variable.at)] if variable.at else range(1, len(links) + 1)
            for k in changed_links:  # a link keeps its mass per length
                mass = links[k - 1].mass * numbers[variable.of] / links[k - 1].length
                numbers.setdefault(f"link_mass@{k}", mass)
    return _parameters(base, tuple(numbers))(**numbers) if numbers else base


@lru_cache(maxsize=16)
def _parameters(arm: Manipulator, names: tuple[str, ...]) -> ArmParameters:
    return ArmParameters(arm, names)


@lru_cache(maxsize=16)
def _rerouted(arm: Manipulator, values: tuple[tuple[Variable, Value], ...]) -> Manipulator:
    """Return the arm with as many cables, their ends and their wire as the values say."""
    geometry = arm.geometry
    law = None
    routes = [*geometry.cables]
    for variable, value in values:
        match variable.kind:
            case "wire":
                law = as_wire(value)
            case "cables_per_joint":
                routes = _even(geometry, int(value))
            case "end":
                c = geometry.cable_names.index(variable.at)
                routes[c] = replace(routes[c], joint=int(value))
    geometry = geometry.replace(cables=tuple(routes))
    like: Sequence[Cable] = arm.cables
    if len(routes) != len(like):
        joints = [route.joint for route in arm.geometry.cables]
        firsts = [joints.index(route.joint) if route.joint in joints else 0 for route in routes]
        like = tuple(arm.cables[first] for first in firsts)
    routed = serpentine_cables(geometry, law or arm.cables[0].elasticity)
    cables = [
        replace(
            kept,
            name=cable.name,
            sites=holes_like(cable, kept),
            lead=cable.lead,
            elasticity=law or kept.elasticity,
        )
        for cable, kept in zip(routed, like, strict=True)
    ]
    return arm.with_geometry(geometry, cables)


def _even(geometry: Geometry, count: int) -> list[CableRoute]:
    """Return ``count`` evenly spaced cables per joint, otherwise like the joint's first cable."""
    n = len(geometry.joints)
    if all(len(joint.axes) == 2 for joint in geometry.joints):
        angles = evenly_spaced(n, count)
    else:
        rolls = [math.atan2(joint.axes[0][2], joint.axes[0][1]) for joint in geometry.joints]
        angles = hinge_hole_angles(rolls, count)
    cables = []
    for k in range(n):
        like = [cable for cable in geometry.cables if cable.joint == k + 1] or [geometry.cables[0]]
        cables += [replace(like[0], joint=k + 1, angle=angle) for angle in angles[k]]
    return cables

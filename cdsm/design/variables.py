"""Design variables: quantities of an arm that a search may choose, and the geometry they give."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, final, get_args

from cdsm.errors import InvalidInput
from cdsm.geometry import CableRoute, Geometry
from cdsm.geometry.uniform import evenly_spaced, hinge_hole_angles
from cdsm.geometry.units import WIDEST, doubts_about_angle, doubts_about_units
from cdsm.support.format import place
from cdsm.support.validation import one_of, quantity, scalar, whole_number
from cdsm.support.warning import warn
from cdsm.wires.catalogue import Wire, as_wire

VariableName = Literal[
    "hole_radius",
    "disk_offset",
    "link_length",
    "lead",
    "phase",
    "hole_angle",
    "end",
    "cables_per_joint",
    "wire",
    "minimum",
]

Value = float | int | str
"""Value of a variable: a number in SI, or the name or the rigidity [N] of a wire."""

WHOLE: Final = ("end", "cables_per_joint")
_OF_JOINT: Final = ("hole_radius", "disk_offset", "link_length", "lead", "phase")
_OF_CABLE: Final = ("hole_angle", "end")
UNITS: Final = {
    "hole_radius": "m",
    "disk_offset": "m",
    "link_length": "m",
    "lead": "m",
    "phase": "rad",
    "hole_angle": "rad",
    "minimum": "N",
}
"""SI unit of each variable that has one."""

_WIDEST_ANGLE = 4.0 * math.pi  # a range of angles beyond this [rad] is probably in degrees


@final
@dataclass(frozen=True)
class Variable:
    """Design variable: a quantity of an arm that a search may choose.

    Attributes:
        of: ``"hole_radius"``, ``"disk_offset"``, ``"link_length"`` [m]: of one joint or of all
            joints; a link keeps its mass per length. ``"lead"`` [m], and ``"phase"`` [rad], an
            angle added to the hole angles: of the cables of one joint or of all joints.
            ``"hole_angle"`` [rad]: of one cable. ``"end"``: number of the joint at which one cable
            ends. ``"cables_per_joint"``: number of evenly spaced cables of each joint. ``"wire"``:
            wire of all cables. ``"minimum"`` [N]: lower bound of all tensions.
        low: Smallest value, in SI: [m], [rad] or [N]; None with ``choices``.
        high: Largest value, in SI: [m], [rad] or [N]; None with ``choices``.
        at: Number of the joint, from 1, or name of the cable, that is changed; None: all.
        choices: Values to choose from, instead of a range; always needed for a wire.

    Raises:
        UnknownName: ``of`` is unknown.
        InvalidInput: The range is empty or not of numbers; ``at`` is missing, or is given for a
            variable that has one value for the arm.
    """

    of: VariableName
    low: float | None = None
    high: float | None = None
    at: int | str | None = None
    choices: Sequence[Value] = ()

    def __post_init__(self) -> None:
        one_of("variable", self.of, get_args(VariableName))
        if not isinstance(self.choices, (tuple, list)):
            raise InvalidInput("choices", f"{self.choices!r} given; give a list.")
        self.__dict__.update(choices=tuple(self.choices))
        if bool(self.choices) == (self.low is not None or self.high is not None):
            raise InvalidInput(self.of, "needs low and high, or choices.")
        if self.of == "wire":
            if not self.choices:
                raise InvalidInput(self.of, "has no range; give choices: names, or EA in N.")
            for wire in self.choices:
                as_wire(wire)
        elif self.choices:
            values = [scalar(f"{self.of}.choices", each) for each in self.choices]
            if len(set(values)) < len(values):
                raise InvalidInput(self.of, "names a choice twice.")
        else:
            if self.low is None or self.high is None:
                raise InvalidInput(self.of, "needs both low and high.")
            kind = {"m": "length", "N": "tension"}.get(UNITS.get(self.of, ""))
            low, high = (
                scalar(self.of, each) if kind is None else quantity(self.of, each, kind, zero=True)
                for each in (self.low, self.high)
            )
            if not low < high:
                raise InvalidInput(self.of, f"from {low:g} to {high:g} given; give low < high.")
            if self.of in WHOLE:
                low, high = (_whole(self.of, each) for each in (low, high))
            self.__dict__.update(low=low, high=high)
            if self.of in ("hole_radius", "disk_offset"):
                for doubt in doubts_about_units(0.0, [(self.of, high, WIDEST)]):
                    warn(doubt)
            if UNITS.get(self.of) == "rad":
                most = max(-low, high)
                for doubt in doubts_about_angle(f"{self.of} up to", most, _WIDEST_ANGLE):
                    warn(doubt)
        if self.of in _OF_CABLE and not isinstance(self.at, str):
            raise InvalidInput(self.of, f"needs at= the name of a cable, not {self.at!r}.")
        if self.of in _OF_JOINT and self.at is not None:
            whole_number(f"{self.of}.at", self.at, 1)
        if self.of not in (*_OF_CABLE, *_OF_JOINT) and self.at is not None:
            raise InvalidInput(self.of, f"at={self.at!r} given; it has one value for the arm.")

    @property
    def name(self) -> str:
        """Name of the variable, such as ``hole_radius`` or ``hole_radius of joint 2``."""
        if self.at is None:
            return self.of
        return f"{self.of} of {f'joint {self.at}' if isinstance(self.at, int) else self.at}"

    @property
    def is_continuous(self) -> bool:
        """Whether the variable is a real number in a range."""
        return not self.choices and self.of not in WHOLE

    def shown(self, value: Value) -> str:
        """Return a value [SI] as text, in the unit shown to the user: mm, degrees, N."""
        unit = UNITS.get(self.of)
        if unit is None or isinstance(value, str):
            return f"{value}" if isinstance(value, (str, int)) else f"{value:g}"
        return f"{value:.4g} N" if unit == "N" else place(value, unit)


def _whole(name: str, value: float) -> int:
    """Return the value of variable ``name`` as a whole number; a float such as 3.0 is allowed."""
    return whole_number(name, round(value) if float(value).is_integer() else value, 1)


def changed(
    geometry: Geometry, variables: Sequence[Variable], values: Iterable[Value]
) -> tuple[Geometry, Wire | None]:
    """Return the geometry in which ``variables`` have ``values`` [SI], and the wire, if it changes.

    Raises GeometryError if no valid geometry has these values.
    """
    wire: Wire | None = None
    common = geometry.hole_radius
    joints, links, cables = [*geometry.joints], [*geometry.links], [*geometry.cables]
    # where cables end first: lead and phase belong to the cables of a joint
    pairs = sorted(zip(variables, values, strict=True), key=lambda pair: pair[0].of not in WHOLE)
    for variable, value in pairs:
        of, at = variable.of, variable.at
        if of == "wire" or isinstance(value, str):
            wire = value
            continue
        where = range(1, len(joints) + 1) if at is None or of in _OF_CABLE else [int(at)]
        match of:
            case "cables_per_joint":
                cables = _even(geometry, int(value))
            case "end":
                c = geometry.cable_names.index(str(at))
                cables[c] = replace(cables[c], joint=int(value))
            case "hole_angle":
                c = geometry.cable_names.index(str(at))
                cables[c] = replace(cables[c], angle=value)
            case "lead":
                cables = [replace(c, lead=value) if c.joint in where else c for c in cables]
            case "phase":
                turns = [value if c.joint in where else 0.0 for c in cables]
                cables = [replace(c, angle=c.angle + x) for c, x in zip(cables, turns, strict=True)]
            case "link_length":
                for k in where:
                    mass = links[k - 1].mass * value / links[k - 1].length
                    links[k - 1] = replace(links[k - 1], length=value, mass=mass)
            case "hole_radius":
                common = value if at is None else common
                own = None if at is None else value
                for k in where:
                    joints[k - 1] = replace(joints[k - 1], hole_radius=own)
            case "disk_offset":
                for k in where:
                    joints[k - 1] = replace(joints[k - 1], disk_offset=value)
    new = geometry.replace(
        joints=tuple(joints), links=tuple(links), cables=tuple(cables), hole_radius=common
    )
    return new, wire


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


def present(variable: Variable, geometry: Geometry, minimum: float) -> float:
    """Return the current value of a variable in an arm [SI].

    ``minimum`` is the current lower bound of all tensions [N]. The result is NaN for a wire, or if
    joints or cables have different values.
    """
    own = [
        [cable for cable in geometry.cables if cable.joint == k]
        for k in range(1, len(geometry.joints) + 1)
    ]
    values: Sequence[float]
    match variable.of:
        case "end" | "hole_angle":
            cable = geometry.cables[geometry.cable_names.index(str(variable.at))]
            return cable.joint if variable.of == "end" else cable.angle
        case "hole_radius":
            values = geometry.hole_radii
        case "disk_offset":
            values = [joint.disk_offset for joint in geometry.joints]
        case "link_length":
            values = [link.length for link in geometry.links]
        case "lead":
            values = [_common([cable.lead for cable in cables]) for cables in own]
        case "cables_per_joint":
            values = [len(cables) for cables in own]
        case "phase":
            values = [0.0] * len(own)
        case "minimum":
            values = [minimum]
        case "wire":
            return math.nan
    return values[variable.at - 1] if isinstance(variable.at, int) else _common(values)


def _common(values: Sequence[float]) -> float:
    """Return the common value of all ``values``; NaN if they differ or there is none."""
    return values[0] if len(set(values)) == 1 else math.nan


def require_compatible(variables: Sequence[Variable], geometry: Geometry) -> None:
    """Raise InvalidInput or UnknownName unless variables fit the arm and each other.

    The arm must have their joints and cables, and no two may change the same thing.
    """
    for variable in variables:
        _require_present(variable, geometry)
    for name, count in Counter(variable.name for variable in variables).items():
        if count > 1:
            raise InvalidInput("variables", f"{name} is named twice.")
    kinds = {variable.of for variable in variables}
    if "cables_per_joint" in kinds and kinds & {"end", "hole_angle"}:
        raise InvalidInput(
            "variables", "cables_per_joint replaces the cables that end or hole_angle name."
        )


def _require_present(variable: Variable, geometry: Geometry) -> None:
    """Raise InvalidInput or UnknownName if the arm lacks the joint or the cable of a variable."""
    if isinstance(variable.at, str):
        one_of("cable", variable.at, geometry.cable_names)
    elif variable.at is not None:
        whole_number(f"{variable.of}.at", variable.at, 1, len(geometry.joints))
    if variable.of == "end" and not variable.choices:
        whole_number("end.high", variable.high, 2, len(geometry.joints))

"""Read and write ARM.toml: a robot, its cables, their wires, gravity and tolerances in one file."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from pydantic import Field, model_validator

from cdsm.arm_file.cables import (
    UnwiredCable,
    build_cables,
    cable_lines,
    read_routed,
    setting_lines,
)
from cdsm.arm_file.wires import CableKeys, CableSettings, read_wires, wire_entries
from cdsm.cable import Cable
from cdsm.cable_laws import OriginalLength
from cdsm.errors import LINES, FileError, GeometryError, UnknownName, UrdfError, listed
from cdsm.geometry import Geometry
from cdsm.geometry.cables import serpentine_cables
from cdsm.geometry.toml import build, lines_of, split_geometry
from cdsm.manipulator import GRAVITY, Manipulator
from cdsm.support.files import read_text
from cdsm.support.records import CrossFaults, Number, parse, read_toml, record, toml_value
from cdsm.support.validation import RANGES, one_of
from cdsm.tolerances import Tolerances, from_table, tolerance_lines
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.catalogue import Wire, as_wire
from cdsm.wires.laws import LinearElasticity

_HEAD = """\
# An arm of cdsm. Units: m, rad, kg, N, N/m, m/s2. Base axes: x along the straight arm.
"""


_ESCAPED = re.compile(r"'''|'$|[^\t\n -~\x80-\U0010ffff]")
"""Characters that a literal string of TOML cannot contain."""

_Read = TypeVar("_Read")

_G = Annotated[Number, Field(ge=-RANGES["gravity"].high, le=RANGES["gravity"].high)]


@record
class _Urdf:
    tip: str
    file: str | None = None
    text: str | None = None
    joint_names: Annotated[tuple[str, ...], Field(strict=False)] | None = None
    check_inertia: bool = True

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.file is None) == (self.text is None):
            raise CrossFaults(["file: give file (a path, from the folder of this one) or text"])
        return self


@record
class _Keys(CableKeys):
    """Top-level keys of an ARM.toml. The functions that read fields of type Any check them."""

    gravity: Annotated[tuple[_G, _G, _G], Field(strict=False)] = GRAVITY
    original_length: OriginalLength = "unstrained"
    urdf: _Urdf | None = None
    tolerances: Any = Field(default_factory=dict)


def read_arm(path: str | os.PathLike[str], wire: Wire | None) -> dict[str, Any]:
    """Read what defines an arm. Arguments and errors are those of :meth:`cdsm.Manipulator.read`."""
    text = read_text(path)
    forced = None if wire is None else as_wire(wire)
    if text.lstrip().startswith("<"):
        raise FileError(
            path,
            "is XML, no ARM.toml. A robot from a URDF needs a tip and cables, too: give them to "
            "Manipulator.from_urdf, or write an ARM.toml with a table [urdf].",
        )
    faults: list[str] = []

    def attempt(read: Callable[..., _Read], *given: Any) -> _Read | None:
        try:
            return read(*given)
        except GeometryError as error:
            faults.extend(error.faults)
            return None

    data = attempt(read_toml, text)
    if data is None:
        raise FileError(path, faults[0])
    described, rest = split_geometry(data)
    keys = attempt(parse, _Keys, rest)
    geometry = robot = routed = wires = cables = tolerances = None
    if "urdf" not in rest:
        geometry = attempt(build, Geometry, described)
    elif described:
        faults.append(f"urdf: is given beside {next(iter(described))}; an arm has one of them")
    if keys is not None:
        robot, wires = keys.urdf, attempt(read_wires, keys, forced)
        tolerances = attempt(_tolerances, keys.tolerances)
        if robot is not None or geometry is not None:
            routed = attempt(_routed, keys.cables, geometry)
    if not faults:
        cables = attempt(build_cables, routed, keys, wires, path)
    if faults or keys is None or cables is None or tolerances is None:
        raise FileError(path, f"cannot be read as an arm:{listed(faults, 20, LINES)}")
    arm = {"cables": cables, "gravity": keys.gravity, "original_length": keys.original_length}
    arm["tolerances"] = tolerances
    if robot is None:
        assert geometry is not None
        return {**arm, "urdf": to_urdf(geometry), "tip_link": TIP, "geometry": geometry}
    source = robot.text if robot.file is None else Path(path).parent / robot.file
    assert source is not None
    try:
        urdf = read_urdf(source, check_inertia=robot.check_inertia)
    except FileError as error:
        raise FileError(path, f"urdf.file: {error}") from None
    return {**arm, "urdf": urdf, "tip_link": robot.tip, "joint_names": robot.joint_names}


def _tolerances(given: object) -> Tolerances:
    """Build the tolerances of a parsed table [tolerances]; GeometryError lists every fault."""
    if not isinstance(given, dict):
        raise GeometryError([f"tolerances: is {given!r}; give a table [tolerances]"])
    try:
        return from_table(given)
    except GeometryError as error:
        raise GeometryError([f"tolerances.{fault}" for fault in error.faults]) from None


def _routed(cables: object, geometry: Geometry | None) -> list[UnwiredCable]:
    """Read the cables of an arm from the value of the key ``cables``; GeometryError lists faults.

    Tables ``[[cables]]`` describe all cables. Otherwise the cables are those of the geometry, and
    each table ``[cables.NAME]`` has settings of one of them.
    """
    if geometry is None or isinstance(cables, list):
        return read_routed(cables)
    tables = {} if cables is None else cables
    if not isinstance(tables, dict):
        raise GeometryError([f"cables: is {cables!r}; give tables [cables.NAME] or [[cables]]"])
    routed = serpentine_cables(geometry, LinearElasticity(1e5))
    own, faults = {}, []
    for name, table in tables.items():
        try:
            one_of("cable", name, [cable.name for cable in routed])
            own[name] = parse(CableSettings, table)
        except UnknownName as error:
            faults.append(f"cables.{name}: {error}")
        except GeometryError as error:
            faults += [f"cables.{name}.{fault}" for fault in error.faults]
    if faults:
        raise GeometryError(faults)
    return [
        UnwiredCable(f"cables.{c.name}", c.name, c.sites, c.lead, own.get(c.name, CableSettings()))
        for c in routed
    ]


def arm_text(arm: Manipulator) -> str:
    """Return the text of an ARM.toml; InvalidInput if an elasticity cannot be written."""
    geometry, cables = arm.geometry if arm.is_serpentine else None, arm.cables
    wires, tables = wire_entries(cables)
    settings = [setting_lines(cable) for cable in cables]
    lines = [_HEAD, f"gravity = {toml_value(arm.gravity)}"]
    lines.append(f"original_length = {toml_value(arm.original_length)}")
    if len(set(wires)) == 1:
        lines.append(f"wire = {wires[0]}")
        wires = [""] * len(cables)
    shared = [line for line in settings[0] if all(line in own for own in settings)]
    settings = [[line for line in own if line not in shared] for own in settings]
    lines += [*shared, "", *tables]
    tolerances = tolerance_lines(arm.tolerances)
    lines += ["[tolerances]", *tolerances, ""] if tolerances else []
    if geometry is None:
        lines += _urdf_lines(arm)
    else:
        lines += ["[geometry]", *lines_of(geometry, "geometry."), ""]
    plain = () if geometry is None else serpentine_cables(geometry, LinearElasticity(1e5))
    if [_path(cable) for cable in plain] != [_path(cable) for cable in cables]:
        return "\n".join([*lines, *cable_lines(cables, wires, settings)])
    for cable, wire, own in zip(cables, wires, settings, strict=True):
        own = [*([f"wire = {wire}"] if wire else []), *own]
        if own:
            lines += [f"[cables.{cable.name}]", *own, ""]
    return "\n".join(lines)


def _path(cable: Cable) -> tuple[object, ...]:
    return cable.name, cable.sites, cable.lead


def _urdf_lines(arm: Manipulator) -> list[str]:
    """Return the TOML lines of the table [urdf], with the URDF unescaped ('''…''') if possible."""
    urdf, lines = arm.urdf, ["[urdf]", f"tip = {toml_value(arm.tip_link)}"]
    lines.append(f"joint_names = {toml_value(arm.joint_names)}")
    try:
        read_urdf(urdf)
    except UrdfError:  # the arm was built without this check
        lines.append("check_inertia = false")
    text = toml_value(urdf) if _ESCAPED.search(urdf) else f"'''\n{urdf}'''"
    return [*lines, f"text = {text}", ""]

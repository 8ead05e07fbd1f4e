"""Read and write cables in TOML: sites, wire, lead, spring, control and tension bounds."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from cdsm.arm_file.wires import (
    SETTINGS,
    CableKeys,
    CableSettings,
    FileWires,
    read_wires,
    wire_entries,
)
from cdsm.cable import Cable, Site
from cdsm.errors import (
    LINES,
    CableError,
    FileError,
    GeometryError,
    InvalidInput,
    MissingWire,
    listed,
)
from cdsm.support.files import read_text, write_text
from cdsm.support.records import (
    Friction,
    LengthOrZero,
    Point,
    Wrap,
    parse,
    read_toml,
    record,
    toml_lines,
    toml_value,
)
from cdsm.support.validation import sequence_of
from cdsm.wires.catalogue import Wire, as_wire
from cdsm.wires.laws import LinearElasticity

_HEAD = """\
# cdsm cables. Units: m, N, N/m.
# wire: a name, a constant rigidity EA in N, or the law of a table [wires.NAME].
# sites: links of the robot with a point in each one's frame, from the actuator's side to the end.
# lead: straight cable from the actuator to the first site. series_stiffness: of a spring in series;
# none if left out. control: what the motor holds, "position" or "force". minimum, maximum: tensions
# that the cable may carry; 0 and none if left out. friction, wrap (of a site): coefficient, and an
# angle [rad] that adds to the angle by which the cable turns there; 0 if left out.
"""

_Label = Annotated[str, Field(min_length=1, max_length=200)]


@record
class _Site:
    link: _Label
    xyz: Point
    friction: Friction | None = None
    wrap: Wrap | None = None


@record
class _Entry(CableSettings):
    name: _Label
    lead: LengthOrZero = 0.0
    friction: Friction = 0.0
    sites: Annotated[tuple[_Site, ...], Field(strict=False, min_length=2)]


@record
class _Entries:
    cables: Annotated[tuple[_Entry, ...], Field(strict=False, min_length=1)]


def write_cables(cables: Sequence[Cable], path: str | os.PathLike[str]) -> Path:
    """Write cables to a TOML file. :func:`read_cables` returns equal cables.

    Args:
        cables: One or more cables.
        path: The file. An existing file is replaced.

    Raises:
        InvalidInput: No cables are given, or an elasticity of this kind cannot be written.
        FileError: The file cannot be written.
    """
    cables = sequence_of("cables", cables, Cable)
    if not cables:
        raise InvalidInput("cables", "none given; there is nothing to write.")
    wires, tables = wire_entries(cables)
    settings = [setting_lines(cable) for cable in cables]
    return write_text(path, "\n".join([_HEAD, *tables, *cable_lines(cables, wires, settings)]))


def read_cables(path: str | os.PathLike[str], wire: Wire | None = None) -> tuple[Cable, ...]:
    """Read the cables of an arm from a TOML file.

    The file has one table ``[[cables]]`` per cable. Its keys are:

    - ``name``; ``sites``: two or more ``{link = "…", xyz = [x, y, z]}``, [m]. A site may also have
      ``friction`` and ``wrap`` [rad], as in :class:`~cdsm.Site`.
    - ``wire``: a name such as ``"1x19-1.2mm"``, a constant rigidity [N], or the NAME of a table
      ``[wires.NAME]`` in the form of :meth:`Elasticity.read`.
    - Optional: ``series_stiffness`` [N/m], ``control`` (``"position"`` or ``"force"``),
      ``minimum`` and ``maximum`` [N]. These keys and ``wire`` may also stand at the top of the
      file, for all cables without their own.
    - Optional: ``lead`` [m], the straight cable between the actuator and the first site, and
      ``friction``, the coefficient in all holes that the cable passes.

    Args:
        path: The file.
        wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or a
            WIRE.toml.

    Raises:
        FileError: The file cannot be read or does not describe cables. Every fault is listed.
        MissingWire: The file names no wire for some cables, and ``wire`` is not given.
    """
    text = read_text(path)
    forced = None if wire is None else as_wire(wire)
    try:
        keys = parse(CableKeys, read_toml(text))
        wires = read_wires(keys, forced)
        return build_cables(read_routed(keys.cables), keys, wires, path)
    except GeometryError as error:
        faults = error.faults
    raise FileError(path, f"cannot be read as cables:{listed(faults, 20, LINES)}")


_ANY = LinearElasticity(1e5)
"""Placeholder for a missing wire, so that all other faults of the file are found first."""


class UnwiredCable(NamedTuple):
    """A cable as a file describes it: its sites are built, its wire is not read yet."""

    where: str  # key in the file, which errors name
    name: str
    sites: tuple[Site, ...]
    lead: float  # [m]
    own: CableSettings  # settings of this cable alone


def read_routed(cables: object) -> list[UnwiredCable]:
    """Read the cables of the parsed tables ``[[cables]]``; GeometryError lists every fault."""
    entries = parse(_Entries, {"cables": cables} if cables is not None else {}).cables
    names = [entry.name for entry in entries]
    faults = [
        f"cables[{i}].name: {name!r} is used twice"
        for i, name in enumerate(names, start=1)
        if name in names[: i - 1]
    ]
    routed = []
    for i, entry in enumerate(entries, start=1):
        try:
            routed.append(
                UnwiredCable(f"cables[{i}]", entry.name, _sites(entry), entry.lead, entry)
            )
        except InvalidInput as error:
            faults.append(f"cables[{i}]: {error}")
    if faults:
        raise GeometryError(faults)
    return routed


def _sites(entry: _Entry) -> tuple[Site, ...]:
    """Build the sites of a cable. A hole without ``friction`` has the friction of the cable."""
    passed = range(0 if entry.lead > 0.0 else 1, len(entry.sites) - 1)
    sites = []
    for i, site in enumerate(entry.sites):
        usual = entry.friction if i in passed else 0.0
        friction = usual if site.friction is None else site.friction
        sites.append(Site(site.link, site.xyz, friction, site.wrap or 0.0))
    return tuple(sites)


def build_cables(
    routed: Iterable[UnwiredCable],
    settings: CableSettings,
    wires: FileWires,
    path: str | os.PathLike[str],
) -> tuple[Cable, ...]:
    """Build cables with the laws of ``wires``.

    ``settings`` has the values for all cables without a setting of their own. Raises GeometryError,
    which lists every fault, or MissingWire if wires are missing and nothing else is wrong.
    """
    cables: list[Cable] = []
    faults: list[str] = []
    without: list[str] = []
    for where, name, sites, lead, own in routed:
        given = {
            key: getattr(each, key)
            for each in (settings, own)
            for key in SETTINGS
            if getattr(each, key) is not None
        }
        try:
            wire = wires.of(own.wire)
            if wire is None:
                without.append(name)
            cables.append(Cable(name, sites, wire or _ANY, lead, **given))
        except GeometryError as error:
            faults += [f"{where}.{fault}" for fault in error.faults]
        except (CableError, InvalidInput) as error:
            faults.append(f"{where}: {error}")
    if faults:
        raise GeometryError(faults)
    if without:
        raise MissingWire(path, without if len(without) < len(cables) else ())
    return tuple(cables)


def setting_lines(cable: Cable) -> list[str]:
    """Return a TOML line for each of :data:`SETTINGS` in which a cable differs from the default."""
    defaults = {field.name: field.default for field in fields(Cable)}
    given = {key: getattr(cable, key) for key in SETTINGS if getattr(cable, key) != defaults[key]}
    return [f"{key} = {toml_value(value)}" for key, value in given.items()]


def cable_lines(
    cables: Sequence[Cable], wires: Sequence[str], settings: Sequence[Sequence[str]]
) -> list[str]:
    """Return the TOML lines of tables ``[[cables]]``, one table for each cable.

    ``wires`` are values of the key ``wire`` (``""``: leave out the key), ``settings`` are lines of
    :func:`setting_lines`, both for each cable.
    """
    lines = []
    for cable, wire, given in zip(cables, wires, settings, strict=True):
        lines += ["[[cables]]", f"name = {toml_value(cable.name)}"]
        lines += [f"wire = {wire}"] if wire else []
        lines += [f"lead = {toml_value(cable.lead)}"] if cable.lead else []
        lines += [*given, "sites = ["]
        for site in cable.sites:
            own = {"friction": site.friction or None, "wrap": site.wrap or None}
            entry = toml_lines(_Site(link=site.link, xyz=site.position, **own))
            lines.append(f"    {{{', '.join(entry)}}},")
        lines += ["]", ""]
    return lines

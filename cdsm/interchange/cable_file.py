"""Write and read cables as TOML: sites, wire, lead, spring, control and tension bounds."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from pydantic import Field

from cdsm.cable import Cable, Control, Site
from cdsm.elasticity import Elasticity
from cdsm.errors import CableError, FileError, GeometryError, InvalidInput, counted
from cdsm.support.files import read_text, write_text
from cdsm.support.records import (
    Friction,
    LengthOrZero,
    Point,
    SpringStiffness,
    Tension,
    Wrap,
    parse,
    read_toml,
    record,
    toml_lines,
)
from cdsm.support.validation import sequence_of
from cdsm.wires.files import from_table, table_of

_HEAD = """\
# cdsm cables. Units: m, N, N/m.
# sites: links of the URDF with a point in each one's frame, from the actuator's side to the end.
# lead: straight cable from the actuator to the first site. series_stiffness: of a spring in series;
# none if left out. control: what the motor holds, "position" or "force". minimum, maximum: tensions
# that the cable may carry; 0 and none if left out. friction, wrap (of a site): coefficient, and an
# angle [rad] that adds to the angle by which the cable turns there; 0 if left out.
"""

_KEYS = ("name", "lead", "series_stiffness", "control", "minimum", "maximum")
"""Keys of a cable that are its attributes; left out where the attribute is infinite."""

_Label = Annotated[str, Field(min_length=1, max_length=200)]


@record
class _Site:
    link: _Label
    xyz: Point
    friction: Friction | None = None
    wrap: Wrap = 0.0


@record
class _Entry:
    name: _Label
    elasticity: _Label
    lead: LengthOrZero = 0.0
    series_stiffness: SpringStiffness | None = None
    control: Control = "position"
    minimum: Tension = 0.0
    maximum: Tension | None = None
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
        InvalidInput: No cables are given, or a file cannot hold an elasticity of this kind.
        FileError: The file cannot be written.
    """
    cables = sequence_of("cables", cables, Cable)
    if not cables:
        raise InvalidInput("cables", "none given; there is nothing to write.")
    tables = ["\n".join(table_of(cable.elasticity)) for cable in cables]
    names = {table: f"wire{i}" for i, table in enumerate(dict.fromkeys(tables), start=1)}
    lines = [_HEAD]
    for table, name in names.items():
        lines += [f"[elasticities.{name}]", table, ""]
    for cable, table in zip(cables, tables, strict=True):
        lines += ["[[cables]]", *_lines(cable, names[table]), ""]
    return write_text(path, "\n".join(lines))


def read_cables(path: str | os.PathLike[str]) -> tuple[Cable, ...]:
    """Read the cables of an arm from a TOML file.

    The file has one table ``[elasticities.NAME]`` per wire, in the form of
    :func:`~cdsm.read_elasticity`, and one table ``[[cables]]`` per cable. A cable has ``name``,
    ``elasticity`` (a NAME), and ``sites`` (two or more ``{link = "…", xyz = [x, y, z]}``, [m]).
    Optional are ``lead`` [m] (the straight cable between its actuator and the first site),
    ``series_stiffness`` [N/m], ``control`` (``"position"`` or ``"force"``), ``minimum`` and
    ``maximum`` [N], and ``friction``, the coefficient in all holes that the cable passes. A site
    may have ``friction`` and ``wrap`` [rad] of its own, as in :class:`~cdsm.Site`.

    Args:
        path: The file.

    Raises:
        FileError: The file cannot be read or does not describe cables. Every fault is listed.
    """
    text = read_text(path)
    try:
        data = read_toml(text)
        wires = data.pop("elasticities", {})
        if not isinstance(wires, dict):
            raise GeometryError(["elasticities: must be tables, [elasticities.NAME]"])
        return _built(parse(_Entries, data), _wires(wires))
    except GeometryError as error:
        faults = error.faults
    raise FileError(path, f"cannot be read as cables, {counted(faults)}")


def _wires(tables: dict[str, object]) -> dict[str, Elasticity]:
    wires, faults = {}, []
    for name, table in tables.items():
        try:
            wires[name] = from_table(table)
        except GeometryError as error:
            faults += [f"elasticities.{name}.{fault}" for fault in error.faults]
        except InvalidInput as error:
            faults.append(f"elasticities.{name}: {error}")
    if faults:
        raise GeometryError(faults)
    return wires


def _built(entries: _Entries, wires: dict[str, Elasticity]) -> tuple[Cable, ...]:
    cables, faults = [], []
    seen: set[str] = set()
    for i, entry in enumerate(entries.cables, start=1):
        if entry.name in seen:
            faults.append(f"cables[{i}].name: {entry.name!r} is used twice")
        seen.add(entry.name)
        if entry.elasticity not in wires:
            known = ", ".join(wires) or "no table at all"
            faults.append(
                f"cables[{i}].elasticity: there is no [elasticities.{entry.elasticity}]; there is "
                f"{known}"
            )
            continue
        try:
            cables.append(_cable(entry, wires[entry.elasticity]))
        except (CableError, InvalidInput) as error:
            faults.append(f"cables[{i}]: {error}")
    if faults:
        raise GeometryError(faults)
    return tuple(cables)


def _cable(entry: _Entry, wire: Elasticity) -> Cable:
    given = {key: getattr(entry, key) for key in _KEYS if getattr(entry, key) is not None}
    passed = range(0 if entry.lead > 0.0 else 1, len(entry.sites) - 1)
    sites = []
    for i, site in enumerate(entry.sites):
        common = entry.friction if i in passed else 0.0
        friction = common if site.friction is None else site.friction
        sites.append(Site(site.link, site.xyz, friction, site.wrap))
    return Cable(sites=tuple(sites), elasticity=wire, **given)


def _lines(cable: Cable, wire: str) -> list[str]:
    given = {key: getattr(cable, key) for key in _KEYS if getattr(cable, key) != math.inf}
    sites = tuple(_Site(link=site.link, xyz=site.position) for site in cable.sites)
    entry = _Entry(elasticity=wire, sites=sites, **given)
    return [
        *toml_lines(entry, ("name", "elasticity", *_KEYS[1:])),
        "sites = [",
        *(f"    {{{_site_text(site)}}}," for site in cable.sites),
        "]",
    ]


def _site_text(site: Site) -> str:
    text = f"link = {json.dumps(site.link)}, xyz = {list(site.position)}"
    text += f", friction = {site.friction!r}" if site.friction else ""
    return text + (f", wrap = {site.wrap!r}" if site.wrap else "")

"""Read and write cables as TOML files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from cdsm.arm_file.model import SETTINGS, read_model
from cdsm.cable import Cable, Site
from cdsm.errors import InvalidInput
from cdsm.support.files import write_text
from cdsm.support.records import one_line_each, toml_text
from cdsm.support.validation import sequence_of
from cdsm.wires.catalogue import Wire, name_of, table_of
from cdsm.wires.elasticity import Elasticity

_HEAD = """\
# cdsm cables. Units: m, N, N/m.
# wire: a name, a constant rigidity EA in N, or the law of a table [wires.NAME].
# sites: links of the robot with a point in each one's frame, from the actuator's side to the end.
# lead: straight cable from the actuator to the first site. series_stiffness: of a spring in series;
# none if left out. control: what the motor holds, "position" or "force". minimum, maximum: tensions
# that the cable may carry; 0 and none if left out. slack: wire that the motor takes in before the
# cable pulls; 0 if left out. gain: wire taken in per pull that the motor reports; 1 if left out.
# friction, wrap (of a site): coefficient, and an angle [rad] that adds to the angle by which the
# cable turns there; 0 if left out.

"""

_USUAL = {field.name: field.default for field in fields(Cable) + fields(Site)}


def read_cables(path: str | os.PathLike[str], wire: Wire | None = None) -> tuple[Cable, ...]:
    """Read the cables of an arm from a TOML file.

    The file has one table ``[[cables]]`` per cable. Its keys are:

    - ``name``; ``sites``: two or more ``{link = "…", xyz = [x, y, z]}``, [m]. A site may also have
      ``friction`` and ``wrap`` [rad], as in :class:`~cdsm.Site`.
    - ``wire``: a name such as ``"1x19-1.2mm"``, a constant rigidity [N], or the NAME of a table
      ``[wires.NAME]`` in the form of :meth:`Elasticity.read`.
    - Optional: ``series_stiffness`` [N/m], ``control`` (``"position"`` or ``"force"``),
      ``minimum`` and ``maximum`` [N], ``slack`` [m] and ``gain``. These keys and ``wire`` may also
      stand at the top of the file, for all cables without their own.
    - Optional: ``lead`` [m], the straight cable between the actuator and the first site, and
      ``friction``, the coefficient in all holes that the cable passes.

    Args:
        path: The file.
        wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or a
            WIRE.toml.

    Raises:
        FileError: The file cannot be read or does not describe cables. Every fault is listed. The
            file names no wire for some cables, and ``wire`` is not given.
    """
    return tuple(read_model(path, wire, robot=False)[1])


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
    values, tables = wire_tables(cables)
    entries = [routed(each, {"wire": values[each.elasticity], **settings(each)}) for each in cables]
    return write_text(path, _HEAD + toml_text({"wires": tables, "cables": entries}))


def wire_tables(cables: Sequence[Cable]) -> tuple[dict[Elasticity, Any], dict[str, Any]]:
    """Return the value of the key ``wire`` for each law of the cables, and the tables [wires]."""
    values: dict[Elasticity, Any] = {}
    tables: dict[str, Any] = {}
    for law in dict.fromkeys(cable.elasticity for cable in cables):
        values[law] = name_of(law) or law._constant or f"wire{len(tables) + 1}"
        if values[law] == f"wire{len(tables) + 1}":
            tables[values[law]] = table_of(law)
    return values, tables


def settings(cable: Cable) -> dict[str, Any]:
    """Return the settings of a cable that are not the default."""
    return {key: x for key in SETTINGS if (x := getattr(cable, key)) != _USUAL[key]}


def routed(cable: Cable, own: dict[str, Any]) -> dict[str, Any]:
    """Return the TOML table of a cable with its sites and the settings ``own``."""
    sites = [
        {"link": site.link, "xyz": site.position}
        | {key: x for key in ("friction", "wrap") if (x := getattr(site, key))}
        for site in cable.sites
    ]
    lead = {"lead": cable.lead} if cable.lead else {}
    return {"name": cable.name, **lead, **own, "sites": one_line_each(sites)}

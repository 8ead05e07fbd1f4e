"""``cdsm new``: write a first ARM.toml."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.files import file_option
from cdsm.cli.options import AsJson
from cdsm.cli.output import Json, answer
from cdsm.cli.values import gravity_of, misuse, numbers

_kind = {"rich_help_panel": "The kind of arm: one of them"}
_OTHER_WIRES = "Or give EA in N; later commands take --wire WIRE.toml, which replaces it."

_size = {"rich_help_panel": "Its sizes"}


_KEY = r"^(?:lead|twist)(?=: )|\b(?:link_length|base_length|disk_offset|hole_radius|link_mass)\b"
"""Pattern of a geometry's key in the text of a fault. Elsewhere, ``lead`` may be a word."""


def new(
    arm: Annotated[
        Path,
        file_option(
            endings=(".toml",), declare=typer.Argument, metavar="ARM.toml", help="File to write."
        ),
    ],
    universal: Annotated[
        int | None, typer.Option(metavar="N", help="N universal joints.", min=1, **_kind)
    ] = None,
    hinged: Annotated[
        int | None, typer.Option(metavar="N", help="N hinges; see --twist.", min=1, **_kind)
    ] = None,
    sections: Annotated[
        str | None,
        typer.Option(
            metavar="N,N,...",
            help="Sections of N universal joints each, base to tip; each one is a quarter "
            "narrower.",
            **_kind,
        ),
    ] = None,
    twist: Annotated[
        float | None,
        typer.Option(
            help="Angle from each axis of --hinged to the next [degrees]; default 90.", **_size
        ),
    ] = None,
    cables_per_joint: Annotated[
        int | None,
        typer.Option(help="Default 3; for hinges 2, an antagonistic pair.", min=1, **_size),
    ] = None,
    link_length: Annotated[float, typer.Option(help="Length of every link [mm].", **_size)] = 60.0,
    base_length: Annotated[
        float, typer.Option(help="Distance from the base frame to joint 1 [mm].", **_size)
    ] = 30.0,
    disk_offset: Annotated[
        float, typer.Option(help="Distance from each joint to its two disks [mm].", **_size)
    ] = 5.0,
    hole_radius: Annotated[
        float, typer.Option(help="Distance of the holes from the axis [mm].", **_size)
    ] = 20.0,
    link_mass: Annotated[float, typer.Option(help="Mass of every link [kg].", **_size)] = 0.05,
    lead: Annotated[
        float, typer.Option(help="Straight cable from actuator to base disk [mm].", **_size)
    ] = 100.0,
    wire: Annotated[
        str, typer.Option(metavar="NAME|EA", help="Wire of all cables: a name, or EA in N.")
    ] = "1x19-1.2mm",
    gravity: Annotated[
        str,
        typer.Option(
            metavar="GX,GY,GZ|AXIS", help="Gravity, base axes [m/s²]; or an axis for 9.81."
        ),
    ] = "-z",
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an existing file.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write a complete ARM.toml with a comment on every key; every command can read it."""
    from cdsm.arm_file.template import template
    from cdsm.support.files import write_text
    from cdsm.support.validation import one_of
    from cdsm.wires.catalogue import WIRES, as_wire

    if sum(kind is not None for kind in (universal, hinged, sections)) != 1:
        raise misuse("--universal", "give one of --universal, --hinged and --sections.")
    if twist is not None and hinged is None:
        raise misuse("--twist", "goes with --hinged only.")
    if arm.exists() and not overwrite:
        raise misuse("ARM.toml", f"{arm} exists; add --overwrite.")
    try:
        law: str | float = float(wire)
    except ValueError:
        law = one_of("wire", wire, WIRES, _OTHER_WIRES)
    counts = [universal or hinged or 0]
    if sections is not None:
        counts = [round(count) for count in numbers("--sections", sections)]
    kind = "universal" if hinged is None else "hinged"
    usual: dict[str, float] = {"twist": math.radians(90.0 if twist is None else twist)}
    each = cables_per_joint or (3 if hinged is None else 2)
    parts = []
    for i, count in enumerate(counts):
        sizes = {
            "joints": count,
            **(usual if hinged is not None else {}),
            "cables_per_joint": each,
            "link_length": link_length / 1000.0,
            "base_length": 0.0 if i else base_length / 1000.0,
            "disk_offset": disk_offset / 1000.0,
            "hole_radius": 0.75**i * hole_radius / 1000.0,
            "link_mass": link_mass,
            "lead": lead / 1000.0,
        }
        if hinged is not None:
            # 10 degrees, or less, so that the holes of one plane do not reach those of the next
            sizes["spread"] = min(math.radians(10.0), math.tau / (count * each))
        if i:  # between the holes of all sections, wherever those are
            sizes["phase"] = math.tau / max(math.lcm(*counts), 1) / each * i / len(counts)
        parts.append((kind, sizes))
    try:
        built = [getattr(cdsm.Geometry, kind)(**sizes) for kind, sizes in parts]
        geometry = cdsm.Geometry.sections(built)
    except cdsm.GeometryError as error:
        raise misuse("sizes", f"{_in_options(error)}. Options take mm and degrees.") from None
    whole = cdsm.Manipulator(geometry, as_wire(law), gravity=gravity_of(gravity))
    text = template(arm.name, law, tuple(whole.gravity.tolist()), parts)
    written = write_text(arm, text)
    facts: Json = {"name": geometry.name, "length_m": geometry.length, "written": [str(written)]}
    answer(as_json, lambda: facts, whole, f"written: {written}; try cdsm check {written}")


def _in_options(error: cdsm.GeometryError) -> str:
    """Return the faults of a geometry as a text, with options such as --link-length for keys."""
    return "; ".join(
        re.sub(_KEY, lambda key: f"--{key[0].replace('_', '-')}", fault) for fault in error.faults
    )

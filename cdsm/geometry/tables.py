"""Build a geometry from its tables in TOML, and write its TOML, joint by joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from cdsm.errors import GeometryError
from cdsm.geometry.parts import Turn
from cdsm.support.records import Name, did_you_mean, parse, record, toml_lines

if TYPE_CHECKING:
    from cdsm.geometry.geometry import Geometry

ARM_KEYS = (
    *("gravity", "original_length", "wire", "wires", "urdf"),
    *("series_stiffness", "control", "minimum", "maximum", "tolerances"),
)
"""Keys of an ARM.toml that do not belong to the geometry; ``cables`` may belong to it."""


def build(cls: type[Geometry], data: dict[str, Any]) -> Geometry:
    """Build a geometry from parsed TOML, in any form that :meth:`Geometry.read` describes.

    Raises GeometryError, which lists every fault.
    """
    builders: dict[str, Callable[..., Geometry]] = {
        "universal": cls.universal,
        "hinged": cls.hinged,
        "geometry": lambda **full: parse(cls, full),
    }
    if "sections" in data:
        return _joined(cls, data)
    kind = next((key for key in data if key in builders), None)
    if kind is None and data.keys() & {"joints", "links"}:
        return parse(cls, data)
    if kind is None and "cables" in data:
        faults = ["holds cables but no joints: give a file of cables beside the arm it is for"]
    elif kind is None:
        found = ", ".join(data) or "nothing"
        faults = [
            f"holds {found}; give a table [universal] or [hinged], [[sections]] of them, "
            "or the full form"
        ]
    elif len(data) > 1:
        faults = [
            f"{key}: stands outside [{kind}], which says all of the geometry; move it in, or "
            f"away{did_you_mean(key, ARM_KEYS)}"
            for key in data
            if key != kind
        ]
    elif not isinstance(data[kind], dict):
        faults = [f"{kind}: is {data[kind]!r}; give a table [{kind}]"]
    else:
        return builders[kind](**data[kind])
    raise GeometryError(faults)


def build_only(cls: type[Geometry], data: dict[str, Any]) -> Geometry:
    """Build the geometry in the parsed TOML of an arm, and ignore the keys of other things."""
    described, rest = split_geometry(data)
    if "urdf" in rest and not described:
        raise GeometryError(
            ["urdf: the arm is a robot from a URDF and has no geometry; use Manipulator.read"]
        )
    return build(cls, described)


@record
class _Sections:
    sections: Annotated[tuple[dict[str, Any], ...], Field(strict=False, min_length=1)]
    spread: Turn = 0.0
    name: Name = "arm"


def _joined(cls: type[Geometry], data: dict[str, Any]) -> Geometry:
    """Join the tables ``[[sections]]`` to one geometry; raise GeometryError with every fault."""
    given = parse(_Sections, data)
    parts, faults = [], []
    for i, section in enumerate(given.sections, start=1):
        try:
            parts.append(build(cls, section))
        except GeometryError as error:
            faults += [f"sections[{i}].{fault}" for fault in error.faults]
    if faults:
        raise GeometryError(faults)
    return cls.sections(parts, spread=given.spread, name=given.name)


def split_geometry(data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split the parsed TOML of an arm into the keys of its geometry and all other keys.

    The key ``cables`` belongs to the geometry if there is a key ``joints`` or ``links``, or if it
    is the only key.
    """
    passed_over = set(ARM_KEYS)
    if data.keys() - {"cables"} and not data.keys() & {"joints", "links"}:
        passed_over.add("cables")
    geometry = {key: value for key, value in data.items() if key not in passed_over}
    return geometry, {key: value for key, value in data.items() if key in passed_over}


def text_of(geometry: Geometry) -> str:
    """Return the TOML text of a geometry: a table for each joint, link and cable."""
    lines = [
        "# cdsm geometry. Units: m, rad, kg.",
        "# axes: in the axes of the link before; angle: of the hole about x, from y towards z;",
        "# joint (of a cable): the joint it drives, from 1; it ends on the disk after it.",
    ]
    return "\n".join([*lines, *lines_of(geometry)]) + "\n"


def lines_of(geometry: Geometry, prefix: str = "") -> list[str]:
    """Return the TOML lines of a geometry, a table for each joint, link and cable.

    ``prefix``, e.g. ``geometry.``, precedes the names of the tables.
    """
    lines = toml_lines(geometry, ("name", "base_length", "hole_radius"))
    for joint in geometry.joints:
        lines += ["", f"[[{prefix}joints]]", *toml_lines(joint)]
    for link in geometry.links:
        lines += ["", f"[[{prefix}links]]", *toml_lines(link)]
    for cable in geometry.cables:
        keys = ("joint", "angle", "lead", *(["friction"] if cable.friction else []), "radius")
        lines += ["", f"[[{prefix}cables]]", *toml_lines(cable, keys)]
    return lines

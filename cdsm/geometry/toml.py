"""Build a geometry from its tables in TOML, and write its TOML, joint by joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from cdsm.errors import GeometryError
from cdsm.geometry.uniform import Turn
from cdsm.support.records import Name, did_you_mean, parse, record, toml_lines

if TYPE_CHECKING:
    from cdsm.geometry.geometry import Geometry

# keys of an ARM.toml that do not belong to the geometry; cables may belong to it
_ARM_KEYS = (
    *("gravity", "original_length", "wire", "wires", "urdf", "springs"),
    *("slack_below", "friction", "series_stiffness", "control", "minimum", "maximum"),
    *("slack", "gain", "tolerances"),
)


def split_geometry(data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split the parsed TOML of an arm into the keys of its geometry and all others.

    ``cables`` belongs to the geometry beside ``joints`` or ``links``, and if it is the only key.
    """
    others = set(_ARM_KEYS)
    if data.keys() - {"cables"} and not data.keys() & {"joints", "links"}:
        others.add("cables")
    geometry = {key: value for key, value in data.items() if key not in others}
    return geometry, {key: value for key, value in data.items() if key in others}


_NONE = "friction = 0.0", "stiffness = 0.0", "rest_angle = 0.0", "pieces = 1"  # not written


@record
class _Sections:
    sections: Annotated[tuple[dict[str, Any], ...], Field(strict=False, min_length=1)]
    spread: Turn = 0.0
    name: Name = "arm"


def build(cls: type[Geometry], data: dict[str, Any]) -> Geometry:
    """Build a geometry from parsed TOML as :meth:`Geometry.read`; GeometryError lists faults."""
    kind = next(
        (key for key in ("sections", "universal", "hinged", "backbone", "geometry") if key in data),
        "",
    )
    if not kind and not data.keys() & {"joints", "links"}:
        found = ", ".join(data) or "nothing"
        raise GeometryError(
            [f"holds {found}; give [universal], [hinged], [backbone], [[sections]] or joints"]
        )
    if kind == "sections":
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
    if kind and len(data) > 1:
        outside = [(key, did_you_mean(key, _ARM_KEYS)) for key in data if key != kind]
        inside = f"; if it belongs there, write it below [{kind}]"
        raise GeometryError(
            [f"{key}: stands outside [{kind}]{hint or inside}" for key, hint in outside]
        )
    table = data[kind] if kind else data
    if not isinstance(table, dict):
        raise GeometryError([f"{kind}: is {table!r}; give a table [{kind}]"])
    return (
        getattr(cls, kind)(**table)
        if kind in ("universal", "hinged", "backbone")
        else parse(cls, table)
    )


def lines_of(geometry: Geometry, prefix: str = "") -> list[str]:
    """Return the TOML lines of a geometry; ``prefix``: of the names of its tables."""
    lines = toml_lines(geometry, ("name", "base_length", "hole_radius"))
    for key in ("joints", "links", "cables"):
        for part in getattr(geometry, key):
            rows = toml_lines(part)
            if key == "joints":
                rows = [row for row in rows if row not in ("mass = 0.0", "axes = []")]
            lines += ["", f"[[{prefix}{key}]]", *(row for row in rows if row not in _NONE)]
    return lines

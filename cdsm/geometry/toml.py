"""Build a geometry from its tables in TOML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from cdsm.errors import GeometryError, did_you_mean
from cdsm.geometry.geometry import Geometry
from cdsm.geometry.uniform import Turn
from cdsm.support.records import Name, parse, record

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


def build(data: Mapping[str, Any]) -> Geometry:
    """Build a geometry from parsed TOML as :meth:`Geometry.read`; GeometryError lists faults."""
    forms = ("sections", "universal", "hinged", "backbone", "geometry")
    kind = next((key for key in forms if key in data), "")
    if not kind and not data.keys() & {"joints", "links"}:
        found = ", ".join(data) or "nothing"
        forms_known = "[universal], [hinged], [backbone], [[sections]] or joints"
        raise GeometryError([f"holds {found}; give {forms_known}"])
    if kind == "sections":
        return Geometry.sections(**vars(parse(_Sections, data)))
    if kind and len(data) > 1:
        inside = f"stands outside [{kind}]; if it belongs there, write it below [{kind}]"
        said = dict.fromkeys(data, inside)
        for key in data:
            if hint := did_you_mean(key, _ARM_KEYS, least=0.8):
                said[key] = f"is not a key that is known here{hint}"
        said |= dict.fromkeys(forms, f"stands beside [{kind}]; an arm has one of them")
        raise GeometryError([f"{key}: {said[key]}" for key in data if key != kind])
    table = data[kind] if kind else data
    if not isinstance(table, dict):
        raise GeometryError([f"{kind}: is {table!r}; give a table [{kind}]"])
    return parse(Geometry, table) if kind in ("", "geometry") else getattr(Geometry, kind)(**table)


@record
class _Sections:
    sections: Annotated[
        tuple[Annotated[dict[str, Any], AfterValidator(build)], ...], Field(strict=False)
    ]
    spread: Turn = 0.0
    name: Name = "arm"

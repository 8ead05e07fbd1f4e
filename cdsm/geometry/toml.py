"""Build a geometry from its tables in TOML."""

from __future__ import annotations

import re
from collections.abc import Mapping
from inspect import signature
from typing import Annotated, Any, Final, cast

from pydantic import AfterValidator, Field

from cdsm.errors import GeometryError
from cdsm.geometry.geometry import Geometry
from cdsm.geometry.uniform import Turn
from cdsm.support.records import Name, faults_at, parse, record

_FORMS: Final = ("sections", "universal", "hinged", "backbone", "rolling", "geometry")
"""Tables that describe a geometry; a file may have the keys of [geometry] at its top instead."""

_OF_CABLES: Final = ("friction",)  # keys of a form that an arm has at its top, for its cables


def split_geometry(data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split the parsed TOML of an arm into the keys of its geometry and all others.

    A key that belongs into the table of the geometry counts as the geometry's, which refuses it.
    ``cables`` belongs to the geometry beside ``joints`` or ``links``, and if it is the only key.
    """
    forms = [key for key in _FORMS if key in data]
    known = {*_FORMS, *_keys_of("geometry")}.union(*map(_keys_of, forms)).difference(_OF_CABLES)
    if data.keys() - {"cables"} and not data.keys() & {"joints", "links"}:
        known.discard("cables")
    geometry = {key: value for key, value in data.items() if key in known}
    return geometry, {key: value for key, value in data.items() if key not in known}


def called(geometry: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the keys of a geometry that has this ``name``, if it gives none of its own.

    The full form, which :meth:`Geometry.write` writes, leaves out the usual name alone.
    """
    form = next((key for key in _FORMS if key in geometry), "geometry")
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII)[:64]
    table = geometry if form == "sections" else geometry.get(form)
    if form == "geometry" or not isinstance(table, dict) or not re.match("[A-Za-z]", plain):
        return dict(geometry)
    table = {"name": plain, **table}
    return table if form == "sections" else {**geometry, form: table}


def places_of(key: str, geometry: Mapping[str, Any]) -> list[str]:
    """Return the tables of a geometry to which a key belongs: ``sections.1.universal``."""
    tables = [("", geometry)]
    sections = geometry.get("sections")
    for i, section in enumerate(sections if isinstance(sections, list) else (), start=1):
        if isinstance(section, dict):
            tables.append((f"sections.{i}.", section))
    return [
        f"{where}{form}"
        for where, table in tables
        for form in table
        if form in _FORMS and form != "sections" and key in _keys_of(form)
    ]


def _keys_of(form: str) -> set[str]:
    """Return the keys that belong to a form of geometries."""
    if form == "sections":
        return {*_Sections.__dataclass_fields__}
    return {*signature(Geometry if form == "geometry" else getattr(Geometry, form)).parameters}


def build(data: Mapping[str, Any]) -> Geometry:
    """Build a geometry from parsed TOML as :meth:`Geometry.read`; GeometryError lists faults."""
    kind = next((key for key in _FORMS if key in data), "")
    if not kind and not data.keys() & {"joints", "links"}:
        keys = ", ".join(data) or "nothing"
        known = "[universal], [hinged], [backbone], [rolling], [[sections]] or joints"
        raise GeometryError([f"holds {keys}; give {known}"])
    if kind == "sections":
        return Geometry.sections(**vars(parse(_Sections, data)))
    if kind and len(data) > 1:
        inside = f"stands outside [{kind}]; if it belongs there, write it below [{kind}]"
        beside = f"stands beside [{kind}]; an arm has one of them"
        faults = [f"{key}: {beside if key in _FORMS else inside}" for key in data if key != kind]
        raise GeometryError(faults)
    table = data[kind] if kind else data
    if not isinstance(table, dict):
        raise GeometryError([f"{kind}: is {table!r}; give a table [{kind}]"])
    if kind in ("", "geometry"):
        return parse(Geometry, table)
    try:
        return cast(Geometry, getattr(Geometry, kind)(**table))
    except GeometryError as error:
        raise GeometryError(faults_at(kind, error)) from None


@record
class _Sections:
    sections: Annotated[
        tuple[Annotated[dict[str, Any], AfterValidator(build)], ...], Field(strict=False)
    ]
    spread: Turn = 0.0
    name: Name = "arm"

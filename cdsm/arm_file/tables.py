"""Parse an ARM.toml or a file of cables, with changes for one run; tell what other files are."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from cdsm.errors import FileError
from cdsm.support.files import read_text
from cdsm.support.records import laid_over, read_toml
from cdsm.wires.catalogue import is_file, read_law, table_of

_FROM: Final = "Write an ARM.toml of it once, `cdsm new ARM.toml --from {path}"
_OTHERS: Final = {
    "<mujoco": "is a MuJoCo model (MJCF), no ARM.toml: give the URDF that it was made from.",
    "<xacro:": "is a xacro file: run xacro on it first, and give what it prints as a URDF.",
    "<robot": f"is a robot (URDF), no ARM.toml. {_FROM} --cables CABLES.toml --tip LINK`, and give "
    "that; or, in Python, Manipulator.from_urdf().",
    "<": "is XML, no ARM.toml. `cdsm new --from` takes a URDF, or the folder of a CASPR model.",
}
"""What a file of XML is, by a text in it; the first one counts."""


def read_tables(
    path: str | os.PathLike[str], changes: Mapping[str, Any] | None, robot: bool
) -> dict[str, Any]:
    """Read the tables of a file, ``changes`` laid over them, and the files of wires they name.

    Raises FileError, which says what the file is if it is no TOML, or GeometryError for the faults
    of TOML and changes.
    """
    if any(Path(path).glob("*_bodies.xml")):
        said = f"is the folder of a CASPR model. {_FROM} --wire EA`, and give that."
        raise FileError(path, said.format(path=path))
    if str(path).endswith((".nc", ".zarr", ".csv")):
        raise FileError(path, "is a sweep or a table, no arm; give an ARM.toml.")
    text = read_text(path)
    if robot and text.lstrip("\ufeff \t\r\n").startswith("<"):
        said = next(said for sign, said in _OTHERS.items() if sign in text)
        raise FileError(path, said.format(path=path))
    tables: dict[str, Any] = laid_over(read_toml(text), changes or {})
    cables = tables.get("cables")
    each = [*cables.values()] if isinstance(cables, dict) else cables
    for table in (tables, *(each if isinstance(each, list) else ())):
        wire = table.get("wire") if isinstance(table, dict) else None
        if is_file(wire):
            table["wire"] = table_of(read_law(Path(path).parent / wire))
    return tables

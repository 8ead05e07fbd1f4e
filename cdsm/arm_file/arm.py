"""Read and write ARM.toml: a robot, its cables, their wires, gravity and tolerances in one file."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from cdsm.arm_file.cables import routed, settings, wire_tables
from cdsm.arm_file.model import read_model
from cdsm.cable import Cable
from cdsm.errors import FileError, GeometryError
from cdsm.geometry import Geometry
from cdsm.geometry.cables import serpentine_cables
from cdsm.manipulator import Manipulator
from cdsm.support.records import toml_text, verbatim
from cdsm.tolerances import table_of as tolerance_table
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.catalogue import Wire

_HEAD = (
    "# An arm of cdsm. Units: m, rad, kg, N, N/m, m/s2. Base axes: x along the straight arm.\n\n"
)
_ESCAPED = re.compile(r"'''|'$|[^\t\n -~\x80-\U0010ffff]")  # what a literal string cannot hold


def read_arm(
    path: str | os.PathLike[str], wire: Wire | None, changes: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Read what defines an arm. Arguments and errors are those of :meth:`cdsm.Manipulator.read`."""
    file, cables = read_model(path, wire, changes, robot=True)
    keys = ("gravity", "original_length", "tolerances", "geometry", "springs")
    arm = {"cables": cables} | {key: getattr(file, key) for key in keys}
    if (robot := file.urdf) is None:
        return {**arm, "urdf": to_urdf(file.geometry), "tip_link": TIP}
    source = robot.text if robot.file is None else Path(path).parent / robot.file
    assert source is not None
    try:
        urdf = read_urdf(source, check_inertia=robot.check_inertia)
    except FileError as error:
        raise FileError(path, f"urdf.file: {error}") from None
    return {**arm, "urdf": urdf, "tip_link": robot.tip, "joint_names": robot.joint_names}


def arm_text(arm: Manipulator) -> str:
    """Return the text of an ARM.toml; InvalidInput if an elasticity cannot be written."""
    cables, geometry = arm.cables, arm.geometry if arm.is_serpentine else None
    values, tables = wire_tables(cables)
    owns = [{"wire": values[each.elasticity]} | settings(each) for each in cables]
    shared = {key: x for key, x in owns[0].items() if all(own.get(key) == x for own in owns)}
    owns = [{key: x for key, x in own.items() if key not in shared} for own in owns]
    data: dict[str, Any] = {"gravity": arm.gravity.tolist(), "original_length": arm.original_length}
    data |= {"springs": arm._own_springs}
    data |= {**shared, "wires": tables, "tolerances": tolerance_table(arm.tolerances)}
    plain: tuple[Cable, ...] = ()
    if geometry is None:
        data["urdf"] = _urdf_table(arm)
    else:
        data["geometry"] = TypeAdapter(Geometry).dump_python(geometry, exclude_defaults=True)
        plain = serpentine_cables(geometry, cables[0].elasticity)
    each = zip(cables, owns, strict=True)
    if [(c.name, c.sites, c.lead) for c in plain] == [(c.name, c.sites, c.lead) for c in cables]:
        data["cables"] = {cable.name: own for cable, own in each if own}
    else:
        data["cables"] = [routed(cable, own) for cable, own in each]
    return _HEAD + toml_text(data)


def _urdf_table(arm: Manipulator) -> dict[str, Any]:
    """Return the table [urdf], with the text of the URDF unescaped ('''…''') if possible."""
    text = arm.urdf if _ESCAPED.search(arm.urdf) else verbatim(f"'''\n{arm.urdf}'''")
    table = {"tip": arm.tip_link, "joint_names": arm.joint_names, "text": text}
    try:
        read_urdf(arm.urdf)
    except GeometryError:  # the arm was built without this check
        table["check_inertia"] = False
    return table

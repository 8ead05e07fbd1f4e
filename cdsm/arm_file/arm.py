"""Read and write ARM.toml, an arm with all that belongs to it, and files of cables alone."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from importlib.resources import files
from pathlib import Path
from string import Template
from textwrap import fill
from typing import Any, Final

from cdsm.arm_file.model import ArmFile, read_model
from cdsm.arm_file.path_entries import entry_table
from cdsm.cable import SETTINGS, Cable, serpentine_cables
from cdsm.cable_path import Site
from cdsm.dead_loads import Load
from cdsm.definition import ArmDefinition, refuse_terms
from cdsm.errors import FileError, GeometryError, InvalidInput
from cdsm.joint_springs import Spring
from cdsm.motors import Motor
from cdsm.springs import SpringLaw, law_table
from cdsm.support.described import attributes_of, in_plain_text
from cdsm.support.files import write_text
from cdsm.support.records import one_line_each, toml_text, verbatim
from cdsm.support.validation import sequence_of
from cdsm.tolerances import tolerance_table
from cdsm.urdf import TIP, to_urdf
from cdsm.urdf_reader import read_urdf
from cdsm.wires.catalogue import WIRES, Wire, name_of, table_of
from cdsm.wires.elasticity import Elasticity

_WIRE = "a name, a constant rigidity EA in N, or the law of a table [wires.NAME]"


def _cables_head() -> str:
    """Return the comment at the head of a file of cables: each key and what it means."""
    cable = attributes_of(Cable)
    site = attributes_of(Site)
    meanings = {"wire": _WIRE} | {key: cable[key] for key in ("sites", "lead", *SETTINGS)}
    meanings |= {f"{key} (of a site)": site[key] for key in ("friction", "wrap")}
    lines = ["cdsm cables. Units: m, N, N/m, rad. What is left out has its usual value."]
    lines += [f"{key}: {in_plain_text(meaning)}" for key, meaning in meanings.items()]
    wrapped = (fill(line, 98, initial_indent="# ", subsequent_indent="#   ") for line in lines)
    return "\n".join(wrapped) + "\n\n"


_USUAL = {field.name: field.default for field in fields(Cable) + fields(Site)}


def read_cables(path: str | os.PathLike[str], wire: Wire | None = None) -> tuple[Cable, ...]:
    """Read the cables of an arm from a TOML file.

    The file has one table ``[[cables]]`` per cable. Its keys are:

    - ``name``; ``sites``: two or more ``{link = "…", xyz = [x, y, z]}``, [m]. A site may also have
      ``friction`` and ``wrap`` [rad], as in :class:`~cdsm.Site`.
    - ``wire``: a name such as ``"1x19-1.2mm"``, a constant rigidity [N], or the NAME of a table
      ``[wires.NAME]`` in the form of :meth:`Elasticity.read`.
    - Optional: ``series_stiffness`` [N/m], ``control`` (``"position"`` or ``"force"``),
      ``minimum`` and ``maximum`` [N], ``slack`` [m] and ``gain``.
    - Optional: ``lead`` [m], the straight cable between the actuator and the first site, and
      ``friction``, the coefficient in all holes that the cable passes.

    These keys, but not ``name`` and ``sites``, may also stand at the top of the file, for all
    cables without their own.

    Args:
        path: The file.
        wire: Wire of all cables, instead of the wires in the file: a law, a name, EA [N], or a
            WIRE.toml.

    Raises:
        FileError: The file cannot be read or does not describe cables. Every fault is listed. The
            file names no wire for some cables, and ``wire`` is not given.

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> with TemporaryDirectory() as folder:
        ...     path = cdsm.write_cables(arm.cables, Path(folder, "cables.toml"))
        ...     cables = cdsm.read_cables(path)
        >>> cables == arm.cables
        True
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

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> with TemporaryDirectory() as folder:
        ...     text = cdsm.write_cables(arm.cables, Path(folder, "cables.toml")).read_text()
        >>> text.count("[[cables]]")
        15
    """
    cables = sequence_of("cables", cables, Cable)
    if not cables:
        raise InvalidInput("cables", "none given; there is nothing to write.")
    values, tables = _wire_tables(cables)
    entries = [
        _routed(cable, {"wire": values[cable.elasticity], **_settings(cable)}) for cable in cables
    ]
    return write_text(path, _cables_head() + toml_text({"wires": tables, "cables": entries}))


def _wire_tables(cables: Sequence[Cable]) -> tuple[dict[Elasticity, Any], dict[str, Any]]:
    """Return the value of the key ``wire`` for each law of the cables, and the tables [wires]."""
    values: dict[Elasticity, Any] = {}
    tables: dict[str, Any] = {}
    for law in dict.fromkeys(cable.elasticity for cable in cables):
        values[law] = name_of(law) or law.constant_rigidity or f"wire{len(tables) + 1}"
        if values[law] == f"wire{len(tables) + 1}":
            tables[values[law]] = table_of(law)
    return values, tables


def _settings(cable: Cable) -> dict[str, Any]:
    """Return the settings of a cable that are not the default."""
    return {key: x for key in SETTINGS if (x := getattr(cable, key)) != _USUAL[key]}


def _routed(cable: Cable, settings: dict[str, Any]) -> dict[str, Any]:
    """Return the TOML table of a cable with its sites and the settings ``own``."""
    sites = [entry_table(element) for element in cable.sites]
    lead = {"lead": cable.lead} if cable.lead else {}
    return {"name": cable.name, **lead, **settings, "sites": one_line_each(sites)}


HELD: Final = 0.35
"""Joint limit of a first arm of universal joints [rad]: cables hold nearly all postures within."""

_OTHERS: Final = ("geometry", "urdf", "cables", "wire", "original_length", "lead")
_KEYS: Final = tuple(key for key in ArmFile.__annotations__ if key not in _OTHERS)
"""Keys of a file that are attributes of an arm; its robot and its cables are more than one key."""


def _spring_tables(springs: Mapping[str, Spring] | None) -> dict[str, Any] | None:
    """Return the table [springs]; InvalidInput for a law that no file holds."""
    if springs is None:
        return None
    return {
        joint: law_table(spring, joint) if isinstance(spring, SpringLaw) else spring
        for joint, spring in springs.items()
    }


def _motor_tables(motors: Sequence[Motor]) -> dict[str, Any]:
    """Return the tables [motors.NAME]; what has its usual value is left out."""
    tables: dict[str, Any] = {}
    for motor in motors:
        rigid = math.isinf(motor.stiffness)
        tables[motor.name] = {
            "cables": dict(motor.cables),
            "stiffness": None if rigid else motor.stiffness,
            "control": None if motor.control == "position" else motor.control,
        }
    return tables


def _load_tables(loads: Sequence[Load]) -> list[dict[str, Any]] | None:
    """Return the tables [[loads]], without a force or moment that is zero; None without loads."""
    tables = [
        {key: x for key, x in vars(load).items() if key == "point" or any(x)} for load in loads
    ]
    return tables or None


_TABLES: Final[dict[str, Callable[[Any], Any]]] = {
    "springs": _spring_tables,
    "tolerances": tolerance_table,
    "motors": _motor_tables,
    "loads": _load_tables,
}


def _as_it_is(value: Any) -> Any:
    return value


_ARM_HEAD = (
    "# An arm of cdsm. Units: m, rad, kg, N, N/m, m/s2. Base axes: x along the straight arm.\n\n"
)
_ESCAPED = re.compile(r"'''|'$|[^\t\n -~\x80-\U0010ffff]")  # what a literal string cannot hold


def read_arm(
    path: str | os.PathLike[str], wire: Wire | None, changes: Mapping[str, Any] | None
) -> ArmDefinition:
    """Read what defines an arm. Arguments and errors are those of :meth:`cdsm.Manipulator.read`."""
    file, cables = read_model(path, wire, changes, robot=True)
    values: Any = {"cables": cables, "geometry": file.geometry}
    values |= {key: getattr(file, key) for key in _KEYS}
    if (robot := file.urdf) is None:
        return ArmDefinition(urdf=to_urdf(file.geometry), tip_link=TIP, **values)
    source = robot.text if robot.file is None else Path(path).parent / robot.file
    assert source is not None
    try:
        urdf = read_urdf(source, check_inertia=robot.check_inertia)
    except FileError as error:
        raise FileError(path, f"urdf.file: {error}") from None
    return ArmDefinition(urdf=urdf, tip_link=robot.tip, joint_names=robot.joint_names, **values)


def arm_text(arm: ArmDefinition) -> str:
    """Return the text of an ARM.toml; InvalidInput if a wire or a term cannot be written."""
    refuse_terms(arm.terms, "ARM.toml has no key for the terms", "terms")
    cables = arm.cables
    geometry = arm.geometry
    values, tables = _wire_tables(cables)
    owns = [{"wire": values[cable.elasticity]} | _settings(cable) for cable in cables]
    shared = {
        key: x for key, x in owns[0].items() if all(settings.get(key) == x for settings in owns)
    }
    owns = [{key: x for key, x in settings.items() if key not in shared} for settings in owns]
    data = {key: _TABLES.get(key, _as_it_is)(getattr(arm, key)) for key in _KEYS}
    data |= shared | {"wires": tables}
    plain: tuple[Cable, ...] = ()
    if geometry is None:
        data["urdf"] = _urdf_table(arm)
    else:
        data["geometry"] = geometry._table
        plain = serpentine_cables(geometry, cables[0].elasticity)
    pairs = zip(cables, owns, strict=True)
    if [(c.name, c.sites, c.lead) for c in plain] == [(c.name, c.sites, c.lead) for c in cables]:
        data["cables"] = {cable.name: settings for cable, settings in pairs if settings}
    else:
        data["cables"] = [_routed(cable, settings) for cable, settings in pairs]
    return _ARM_HEAD + toml_text(data)


def _urdf_table(arm: ArmDefinition) -> dict[str, Any]:
    """Return the table [urdf], with the text of the URDF unescaped ('''…''') if possible."""
    text = arm.urdf if _ESCAPED.search(arm.urdf) else verbatim(f"'''\n{arm.urdf}'''")
    table = {"tip": arm.tip_link, "joint_names": arm.joint_names, "text": text}
    try:
        read_urdf(arm.urdf)
    except GeometryError:  # the arm was built without this check
        table["check_inertia"] = False
    return table


def template(
    name: str,
    wire: str | float,
    minimum: float,
    sections: Sequence[tuple[str, Mapping[str, float]]],
) -> str:
    """Return the text of an ARM.toml called ``name``: ``template.toml`` beside this file, filled.

    ``minimum`` is the lower bound of all tensions [N]. Each of ``sections``, base to tip, is a
    constructor of :class:`Geometry` by name and its keywords; lines of the file with other keywords
    are left out.
    """
    text = files("cdsm.arm_file").joinpath("template.toml").read_text("utf-8")
    section = next(
        paragraph for paragraph in text.split("\n\n") if paragraph.startswith("[[sections]]")
    )
    header, *lines = section.split("\n")
    robot = []
    for i, (kind, sizes) in enumerate(sections):
        values: dict[str, object] = dict(sizes)
        values |= {f"{key}_degrees": f"{math.degrees(x):.4g}" for key, x in sizes.items()}
        values["kind"] = kind if len(sections) == 1 else f"sections.{kind}"
        values["start"] = "end of the section before" if i else "base frame"
        values["centre"] = "contact" if kind == "rolling" else "joint centre"
        values["limit_reason"] = "disks touch there, as by default"
        if kind == "universal" and sizes["joint_limit"] == HELD:
            values["limit_reason"] = "cables often cannot hold more; default: disks touch"
        values["disk_radius"] = f"{1.2 * sizes['hole_radius']:.4g}"
        values["cable_radius"] = f"{sizes['hole_radius'] / 2.0:.4g}"
        kept = [line for line in lines if line[0] in "#[" or line.split(" = ")[0] in sizes]
        robot.append(Template("\n".join([header][: len(sections) - 1] + kept)).substitute(values))
    return Template(text.replace(section, "\n\n".join(robot))).substitute(
        name=name, wire=json.dumps(wire), wires=", ".join(WIRES), minimum=minimum
    )

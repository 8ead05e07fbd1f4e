"""ARM.toml and files of cables as one pydantic model, which builds the cables.

A check of several keys is a validator of the last of them: so all faults of a file come at once.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar, cast, get_type_hints

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    WrapValidator,
)
from pydantic import ValidationInfo as Info

from cdsm.arm_file.motor_entries import MotorTables, motors_of
from cdsm.arm_file.path_entries import Label, PathEntry
from cdsm.cable import SETTINGS, Cable, Cables, serpentine_cables
from cdsm.dead_loads import Load
from cdsm.errors import LINES, FileError, GeometryError, InvalidInput, listed, warn
from cdsm.geometry import Geometry, toml
from cdsm.rigid_body import GRAVITY
from cdsm.springs import JointSpring
from cdsm.support import records
from cdsm.support.files import as_path, read_text
from cdsm.support.records import EACH, ONE, CrossFaults, laid_over, read_toml, record
from cdsm.support.validation import gravity_vector, one_of
from cdsm.tolerances import Tolerances, tolerances_from
from cdsm.wires.catalogue import (
    WIRES,
    Wire,
    as_wire,
    from_table,
    is_file,
    law_of_name,
    read_law,
    table_of,
)
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

_Record = TypeVar("_Record")

_FROM: Final = "Write an ARM.toml of it once, `cdsm new ARM.toml --from {path}"
_OTHERS: Final = {
    "<mujoco": "is a MuJoCo model (MJCF), no ARM.toml: give the URDF that it was made from.",
    "<xacro:": "is a xacro file: run xacro on it first, and give what it prints as a URDF.",
    "<robot": f"is a robot (URDF), no ARM.toml. {_FROM} --cables CABLES.toml --tip LINK`, and give "
    "that; or, in Python, Manipulator.from_urdf().",
    "<": "is XML, no ARM.toml. `cdsm new --from` takes a URDF, or the folder of a CASPR model.",
}
"""What a file of XML is, by a text in it; the first one counts."""


def _read_tables(
    path: str | os.PathLike[str], changes: Mapping[str, Any] | None, robot: bool
) -> dict[str, Any]:
    """Read the tables of a file, ``changes`` laid over them, and the files of wires they name."""
    given: Any = {} if changes is None else changes
    if not isinstance(given, Mapping):
        problem = f"{changes!r} given; give a dict of values by keys, such as "
        raise InvalidInput("changes", problem + '{"universal.link_mass": 0.06}.')
    if any(as_path(path).glob("*_bodies.xml")):
        problem = f"is the folder of a CASPR model. {_FROM} --wire EA`, and give that."
        raise FileError(path, problem.format(path=path))
    if str(path).endswith((".nc", ".zarr", ".csv")):
        raise FileError(path, "is a sweep or a table, no arm; give an ARM.toml.")
    text = read_text(path)
    if robot and text.lstrip("\ufeff \t\r\n").startswith("<"):
        problem = next(problem for sign, problem in _OTHERS.items() if sign in text)
        raise FileError(path, problem.format(path=path))
    tables: dict[str, Any] = read_toml(text)
    for key, value in given.items():
        change = value
        for name in reversed(str(key).split(".")):
            change = {name: change}
        tables = laid_over(tables, change)
    cables = tables.get("cables")
    cable_tables = [*cables.values()] if isinstance(cables, dict) else cables
    for table in (tables, *(cable_tables if isinstance(cable_tables, list) else ())):
        wire = table.get("wire") if isinstance(table, dict) else None
        if is_file(wire):
            table["wire"] = table_of(read_law(Path(path).parent / wire))
    return tables


_GIVEN: Final = *SETTINGS, "friction", "slack_below"  # keys of all cables or of each

_ROBOT: Final = ONE  # key of the geometry, of which files have only the parts; no fault prints it
_NO_ROBOT: Final = (
    "describes no robot; give [universal], [hinged], [backbone], [rolling], [[sections]] or [urdf]"
)
_NO_TABLE: Final = (
    "joints: a number of joints stands in the table of their kind, below [universal], [hinged], "
    "[backbone] or [rolling], with their sizes; cdsm new writes such a file"
)
_FORMS: Final = (
    *("universal", "hinged", "backbone", "rolling"),
    *("sections", "geometry", "joints", "links"),
)
_NO_WIRE: Final = LinearElasticity(1e5)  # of cables whose wire is missing


def _ordered(high: float | None, info: Info) -> float | None:
    low = info.data.get("minimum")
    if low is not None and high is not None and low > high:
        raise ValueError(f"{high:g} N given, below the minimum of {low:g} N")
    return high


def _one_source(text: str | None, info: Info) -> str | None:
    if "file" in info.data and (info.data["file"] is None) == (text is None):
        raise ValueError("give file (a path, from the folder of this one) or text")
    return text


def _alone(urdf: object, info: Info) -> object:
    if urdf is not None and info.data.get("geometry") is not None:
        raise ValueError("is given beside a geometry; an arm has one of them")
    return urdf


def _of_routed(lead: float | None, info: Info) -> float | None:
    if lead is not None and info.data.get("geometry") is not None:
        raise ValueError("belongs to the joints of a geometry: [universal], [hinged] or [backbone]")
    return lead


def _described(tables: dict[str, Any]) -> Geometry:
    """Build the geometry; a key of the whole file that stands in one of its tables is told so."""
    if not tables:
        raise CrossFaults([_NO_ROBOT])
    if isinstance(tables.get("joints"), int):
        raise CrossFaults([_NO_TABLE])
    try:
        return toml.build(tables)
    except GeometryError as error:
        keys = "|".join(ArmFile.__dataclass_fields__)
        known = re.compile(rf"((^|\.)({keys}): is not a key that is known here).*")
        raise CrossFaults(
            known.sub(r"\1; it belongs at the top of the file", fault) for fault in error.faults
        ) from None


def _unstrained(length: object) -> object:
    """Accept the only value that is left of a key of older files."""
    if length != "unstrained":
        raise ValueError(
            f"{length!r} given; leave the key out: a locked motor holds the original length of its "
            "wire. The paper's reading is a law in Python: cdsm.paper.law_of_stretched_length()"
        )
    warn('original_length = "unstrained" holds for every arm; the line may be left out.')
    return length


def _name_of_one(cable: str, info: Info) -> str:
    geometry = info.data.get("geometry")
    return one_of("cable", cable, geometry.cable_names) if geometry else cable


def _new_names(wires: dict[str, Elasticity]) -> dict[str, Elasticity]:
    if known := wires.keys() & WIRES:
        raise CrossFaults(f"{name}: cdsm knows a wire of this name; another" for name in known)
    return wires


def _law_of(wire: Any, known: Mapping[str, Any]) -> Elasticity:
    """Return the law of a key ``wire``; ``known`` has the valid keys before. Or a ValueError."""
    if isinstance(wire, dict):
        return from_table(wire)
    if not isinstance(wire, str):
        return as_wire(wire)
    # with faulty tables of wires, any name is right
    remedy = "Or give EA in N, a file WIRE.toml, or a table [wires.NAME]."
    return law_of_name(wire, known.get("wires", {wire: _NO_WIRE}), remedy)


_Gravity = Annotated[
    Annotated[Any, Tag(ONE)] | Annotated[records.Vector, Tag(EACH)],
    Discriminator(records.one_or_each),
    AfterValidator(lambda value: gravity_vector("gravity", value)),
]
_Law = Annotated[Any, PlainValidator(from_table)]
_Spring = Annotated[
    Annotated[JointSpring, Tag(ONE)] | Annotated[records.Numbers, Tag(EACH)],
    Discriminator(records.one_or_each),
]


_CHECKS: Final = {"maximum": AfterValidator(_ordered)}  # of a key and those before it


def _with_settings(cls: type[_Record]) -> type[_Record]:
    """Give a record the keys that are fields of a :class:`Cable`; None: the key is not given."""
    types = get_type_hints(Cable)
    for setting in fields(Cable):
        if setting.name in SETTINGS:
            kind, zero, _ = setting.metadata.get("range", ("", False, False))
            number = Annotated[records.Number, records.in_range(kind, zero)]
            key = (number if kind else types[setting.name]) | None
            check = _CHECKS.get(setting.name)
            cls.__annotations__[setting.name] = Annotated[key, check] if check else key
            setattr(cls, setting.name, None)
    return cls


@record
@_with_settings
class _Settings:
    wire: Any = None
    slack_below: bool | None = None
    friction: records.FrictionCoefficient | None = None


@record
class _Routed(_Settings):
    name: Label
    lead: records.LengthOrZero | None = None
    sites: Annotated[tuple[PathEntry, ...], Field(strict=False, min_length=2)]

    def built(self, friction: float, common_lead: float) -> Cable:
        """Return the cable; ``friction`` is that of holes without one of their own."""
        lead = common_lead if self.lead is None else self.lead
        holes = range(0 if lead else 1, len(self.sites) - 1)
        path = (entry.built(friction * (i in holes)) for i, entry in enumerate(self.sites))
        return Cable(self.name, tuple[Any, ...](path), _NO_WIRE, lead)


@record
class _OwnLoad:
    link: str
    force: records.Vector = (0.0, 0.0, 0.0)
    moment: records.Vector = (0.0, 0.0, 0.0)
    point: records.Position | None = None


def _loads(tables: tuple[_OwnLoad, ...]) -> tuple[Load, ...]:
    faults = list[str]()
    loads = list[Load]()
    for i, table in enumerate(tables, start=1):
        if not any(table.force + table.moment):
            faults.append(f"[{i}]: gives no force and no moment; 0.2 kg are force = [0, 0, -1.96]")
        try:
            loads.append(Load(**vars(table)))
        except InvalidInput as error:
            faults += records.faults_at(f"[{i}].{error.name}", error)
    if faults:
        raise CrossFaults(faults)
    return tuple(loads)


_OwnLoads = Annotated[tuple[_OwnLoad, ...], Field(strict=False), AfterValidator(_loads)]


@record
class Urdf:
    """The keys of the table [urdf].

    Attributes:
        tip: Link that is the tip.
        joint_names: Joints in the order of the angles.
        check_inertia: ``false`` accepts moments of inertia that no body can have.
        file: Path of the URDF, from the folder of this file.
        text: The URDF itself, instead of its path.
    """

    tip: str
    joint_names: Annotated[tuple[str, ...], Field(strict=False)] | None = None
    check_inertia: bool = True
    file: str | None = None
    text: Annotated[str | None, AfterValidator(_one_source), Field(validate_default=True)] = None


_Tables = Annotated[
    Annotated[dict[Annotated[str, AfterValidator(_name_of_one)], _Settings], Tag(ONE)]
    | Annotated[tuple[_Routed, ...], Field(strict=False), Tag(EACH)],
    Discriminator(records.one_or_each),
]


def _built(value: Any, check: Callable[[Any], Any], info: Info) -> Cables:
    """Build all cables; tables of single cables change those of the geometry."""
    known = info.data
    if known.get("geometry", ...) is None and not isinstance(value, list):
        raise ValueError("give tables [[cables]], one for each cable")
    tables = check({} if value is None else value)
    faults = list[str]()
    routes: dict[str, Any]
    if isinstance(tables, tuple):
        routes = {f"[{i}]": table for i, table in enumerate(tables, start=1)}
        names = [table.name for table in tables]
        twice = [i for i, name in enumerate(names) if name in names[:i]]
        faults = [f"[{i + 1}].name: {names[i]!r} is used twice" for i in twice]
    elif geometry := known.get("geometry"):
        routes = {cable.name: cable for cable in serpentine_cables(geometry, _NO_WIRE)}
    else:
        return Cables()  # its faults are told
    shared = _given(known)
    cables = []
    for where, route in routes.items():
        settings = route if isinstance(route, _Routed) else tables.get(where, _Settings())
        place = f"{where}.wire"
        try:
            law = known.get("wire") if settings.wire is None else _law_of(settings.wire, known)
            place = where
            keys = shared | _given(vars(settings))
            mu = keys.pop("friction", None)
            slack = keys.pop("slack_below", False)
            law = law.slack_below() if law and slack else law or _NO_WIRE
            if isinstance(route, _Routed):
                route = route.built(mu or 0.0, known.get("lead") or 0.0)
            elif mu is not None:
                route = route.with_friction(mu)
            cables.append(replace(route, elasticity=law, **keys))
        except ValueError as error:
            faults += records.faults_at(place, error)
    if faults:
        raise CrossFaults(faults)
    return Cables(cables)


def _given(known: Mapping[str, Any]) -> dict[str, Any]:
    return {key: known[key] for key in _GIVEN if known.get(key) is not None}


@record
class _Wires:
    wires: Annotated[dict[str, _Law], AfterValidator(_new_names)] = Field(
        default_factory=dict, kw_only=True
    )


@record
class ArmFile(_Settings, _Wires):
    """The keys of an ARM.toml, or of a file of cables; bases give ``wires`` and ``wire`` first.

    Attributes:
        gravity: Vector in base axes [m/s²], or an axis such as ``"-z"``, along which it is 9.81.
        wire: Wire of all cables: a name, also of a rope such as ``"7x7-0.8mm"``, a constant EA [N],
            a file of ``cdsm fit``, or the NAME of a table ``[wires.NAME]``. A rope whose breaking
            load is known: ``{rope = "7x7", diameter = 0.8e-3, breaking_load = 390}``.
        slack_below: ``true`` continues the law of the wire below its lowest tension, down to 0.
        friction: Coefficient of friction in all holes [-].
        wires: Tables ``[wires.NAME]``, laws of wires: the lines of a file of ``cdsm fit``.
        springs: Stiffness of joints by name [N m/rad], ``joint1_1 = 2.0``; with the angle [rad] of
            no torque ``[2.0, 0.1]``. Or a law: ``{stiffness = 0.56, exponent = 0.74, scale =
            0.035}``, or points ``{angles = [0.1, 0.2], torques = [0.05, 0.08]}`` [rad, N m]; both
            may have an ``angle`` of no torque.
        loads: Tables ``[[loads]]``, dead loads that belong to the arm, as of a gripper or a camera.
        tolerances: Table of standard deviations, with a key for each source.
        urdf: Table of a robot that no generator makes.
        lead: Straight cable between actuator and first site [m], of all ``[[cables]]``.
        cables: Tables ``[[cables]]`` of a robot's cables; or ``[cables.NAME]`` of keys in which one
            cable differs.
        motors: Tables ``[motors.NAME]`` of motors that move several cables, or yield; cables of
            none of them have motors of their own. ``[[motors]]`` with ``name`` will do, too.
    """

    wire: Annotated[Any, AfterValidator(lambda wire, info: _law_of(wire, info.data))] = None
    gravity: _Gravity = GRAVITY
    original_length: Annotated[Any, AfterValidator(_unstrained)] = None
    tolerances: Annotated[Tolerances, PlainValidator(tolerances_from)] = Tolerances()
    springs: dict[str, _Spring] | None = None
    loads: _OwnLoads = ()
    geometry: Annotated[Any, PlainValidator(_described), Field(alias=_ROBOT)] = None
    urdf: Annotated[Urdf | None, AfterValidator(_alone)] = None
    lead: Annotated[records.LengthOrZero | None, AfterValidator(_of_routed)] = None
    cables: Annotated[_Tables, WrapValidator(_built), Field(validate_default=True)] = None  # type: ignore[assignment]
    motors: Annotated[MotorTables, AfterValidator(motors_of)] = ()  # type: ignore[assignment]


def _placed(fault: str, described: dict[str, Any]) -> str:
    """Return the fault of a key at the top of a file; a key of the geometry is told its tables."""
    key, unknown, _ = fault.partition(": is not a key that is known here")
    places = toml.places_of(key, described) if unknown else []
    return f"{key}{unknown}; it is one of {listed(places)}" if places else fault


def read_model(
    path: str | os.PathLike[str],
    wire: Wire | None,
    changes: Mapping[str, Any] | None = None,
    *,
    robot: bool,
) -> tuple[ArmFile, Cables]:
    """Read a file of cables, or of an arm (``robot``); all cables get the ``wire`` if it is given.

    Raises FileError, which lists every fault or the cables without a wire.
    """
    forced = None if wire is None else as_wire(wire)
    faults = ""
    described: dict[str, Any] = {}
    try:
        data = _read_tables(path, changes, robot)
        described, rest = toml.split_geometry(data)
        if robot and ("urdf" not in rest or any(key in described for key in _FORMS)):
            data = {_ROBOT: toml.called(described, Path(path).stem), **rest}
        file = records.parse(ArmFile, data)
    except GeometryError as error:
        faults = listed([_placed(fault, described) for fault in error.faults], 20, LINES)
    if faults:  # not inside except: its context could not be pickled
        what = ("an arm" if robot else "cables") + " with these changes" * bool(changes)
        raise FileError(path, f"cannot be read as {what}:{faults}")
    cables = cast(Cables, file.cables)  # see _built
    if forced is not None:
        return file, Cables(replace(cable, elasticity=forced) for cable in cables)
    without = [cable.name for cable in cables if cable.elasticity is _NO_WIRE]
    if without:
        whose = f"the cables {listed(without)}" if len(without) < len(cables) else "its cables"
        remedy = 'write at its top: wire = "1x19-1.2mm", or wire = 48e3 for a constant EA in N.'
        gives = "read (commands: --set wire=48e3)" if robot else "read_cables (cdsm new: --wire)"
        problem = f"has no wire for {whose}. Give a wire to {gives}, or {remedy}"
        raise FileError(path, problem)
    return file, cables

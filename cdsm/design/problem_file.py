"""PROBLEM.toml: a design problem and its search in one file; see :meth:`DesignProblem.read`."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field

from cdsm.design.goals import Constraint, Objective
from cdsm.design.problem import DesignProblem
from cdsm.design.variables import Variable
from cdsm.errors import LINES, CdsmError, FileError, GeometryError, InvalidInput, listed
from cdsm.loads import has_loads
from cdsm.manipulator import Manipulator
from cdsm.support.files import read_text
from cdsm.support.format import plural
from cdsm.support.records import Integer, Number, faults_at, gone, parse, read_toml, record
from cdsm.support.validation import one_of
from cdsm.sweeps.poses import GridPoses, PoseSet, RandomPoses

_Kind = TypeVar("_Kind")
_Tables = Annotated[tuple[dict[str, Any], ...], Field(strict=False)]
_Margin = Annotated[
    None,
    gone(
        "designs have no margin for tolerances. Tighten the limits of [[constraints]], and compute "
        "the uncertainty of the chosen arm (cdsm.uncertainty, or [tolerances] in its ARM.toml)"
    ),
]


@record
class _Postures:
    random: Integer | None = None
    seed: Integer = 0
    grid: dict[str, Any] | None = None
    angles: Any = None


@record
class Search:
    """Settings of a search: its generations, the designs in each, and the seed."""

    generations: Integer = 40
    population: Integer = 40
    seed: Integer = 0


@record
class _File:
    arm: str
    postures: _Postures
    variables: _Tables
    objectives: _Tables
    constraints: _Tables = ()
    loads: Any = None
    minimum: Number = 0.0
    maximum: Number | None = None
    worst_friction: bool = False
    diameter: Number = 0.0
    tolerances: _Margin = None
    coverage: _Margin = None
    search: Search = Field(default_factory=Search)


def read_problem(path: str | os.PathLike[str]) -> tuple[DesignProblem, Search]:
    """Read a problem and the settings of its search; FileError lists every fault."""
    try:
        file = parse(_File, read_toml(read_text(path)))
        return _problem(file, Path(path).parent), file.search
    except GeometryError as error:
        faults = error.faults
    except FileError:
        raise
    except CdsmError as error:
        faults = (str(error),)
    raise FileError(path, f"is no design problem:{listed(faults, 20, LINES)}")


def _problem(file: _File, folder: Path) -> DesignProblem:
    faults: list[str] = []
    parts = {
        "variables": _built(Variable, file.variables, "variables", faults),
        "objectives": _built(Objective, file.objectives, "objectives", faults),
        "constraints": _built(Constraint, file.constraints, "constraints", faults),
    }
    try:
        postures = _postures(file.postures)
    except CdsmError as error:
        faults += [f"postures: {error}"]
    if faults:
        raise GeometryError(faults)
    arm = Manipulator.read(folder / file.arm)
    _check_angles(file.postures.angles, arm.joint_names)
    return DesignProblem(
        arm=arm,
        **parts,  # type: ignore[arg-type]
        postures=postures,
        loads=_loads(file.loads),
        minimum=file.minimum,
        maximum=math.inf if file.maximum is None else file.maximum,
        worst_friction=file.worst_friction,
        diameter=file.diameter,
    )


def _built(
    kind: type[_Kind], tables: Sequence[dict[str, Any]], name: str, faults: list[str]
) -> tuple[_Kind, ...]:
    """Build one ``kind`` from each table; add what is wrong to ``faults``."""
    made = list[_Kind]()
    known = [attribute.name for attribute in fields(kind)]  # type: ignore[arg-type]
    for i, table in enumerate(tables, start=1):
        where = f"{name}[{i}]"
        try:
            for key in table:
                one_of("key", key, known)
            if "of" not in table:
                raise InvalidInput("of", "is missing.")
            made.append(kind(**table))
        except CdsmError as error:
            faults += faults_at(where, error)  # type: ignore[arg-type]
    return tuple(made)


def _postures(entry: _Postures) -> PoseSet | Any:
    if (
        sum(entry_of_form is not None for entry_of_form in (entry.random, entry.grid, entry.angles))
        != 1
    ):
        raise InvalidInput("random", "give one of random, grid and angles.")
    if entry.random is not None:
        return RandomPoses(entry.random, entry.seed)
    return GridPoses(entry.grid) if entry.grid is not None else entry.angles


def _check_angles(angles: Any, joints: Sequence[str]) -> None:
    """Check that each posture of a list has an angle for each joint; GeometryError otherwise."""
    rows = angles if isinstance(angles, list) else []
    faults = [
        f"postures: angles[{i}] has {plural(len(row), 'number')}; give {len(joints)} [rad], one "
        f"for each of {', '.join(joints)}"
        for i, row in enumerate(rows, start=1)
        if isinstance(row, list) and len(row) != len(joints)
    ]
    if faults:
        raise GeometryError(faults)


def _loads(loads: Any) -> Any:
    if loads is None:
        return np.zeros((1, 6))
    if loads and has_loads(loads):  # which the problem refuses
        return loads
    rows = loads if isinstance(loads, list) and loads and isinstance(loads[0], list) else [loads]
    return [
        [*row, 0.0, 0.0, 0.0] if isinstance(row, list) and len(row) == 3 else row for row in rows
    ]

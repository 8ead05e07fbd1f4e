"""PROBLEM.toml: a design problem and its search in one file."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from cdsm.design.goals import Constraint, Objective
from cdsm.design.problem import DesignProblem
from cdsm.design.variables import Variable
from cdsm.errors import LINES, CdsmError, FileError, GeometryError, InvalidInput, listed
from cdsm.manipulator import Manipulator
from cdsm.support.files import read_text
from cdsm.support.format import plural
from cdsm.support.records import Integer, Number, parse, read_toml, record
from cdsm.sweeps.poses import GridPoses, PoseSet, RandomPoses
from cdsm.tolerances import Tolerances


@record
class _Variable:
    of: str
    low: Number | None = None
    high: Number | None = None
    joint: Integer | None = None
    cable: str | None = None
    choices: Annotated[tuple[Any, ...], Field(strict=False)] = ()


@record
class _Objective:
    of: str
    direction: Any = None
    goal: str | None = None


@record
class _Constraint:
    of: str
    direction: Any = None
    at_least: Number | None = None
    at_most: Number | None = None


@record
class _Postures:
    random: Integer | None = None
    seed: Integer = 0
    grid: dict[str, Any] | None = None
    angles: Any = None


@record
class _Search:
    generations: Integer = 40
    population: Integer = 40
    seed: Integer = 0


@record
class _File:
    arm: str
    postures: _Postures
    variables: Annotated[tuple[_Variable, ...], Field(strict=False, min_length=1)]
    objectives: Annotated[tuple[_Objective, ...], Field(strict=False, min_length=1)]
    constraints: Annotated[tuple[_Constraint, ...], Field(strict=False)] = ()
    loads: Any = None
    minimum: Number = 10.0
    maximum: Number | None = None
    worst_friction: bool = False
    diameter: Number = 0.0
    tolerances: str | None = None
    coverage: Number = 2.0
    search: _Search = Field(default_factory=lambda: _Search())


class ProblemFile(NamedTuple):
    """A design problem and the settings of its search, read from a file.

    Attributes:
        problem: The problem.
        generations: Number of generations.
        population: Number of designs in each generation.
        seed: Seed of the search.
    """

    problem: DesignProblem
    generations: int
    population: int
    seed: int

    def __repr__(self) -> str:
        search = f"{plural(self.generations, 'generation')} of {plural(self.population, 'design')}"
        return f"<ProblemFile: {str(self.problem).splitlines()[0]}, {search}>"


def read_problem(path: str | os.PathLike[str]) -> ProblemFile:
    """Read a design problem from a PROBLEM.toml; all numbers are in SI: m, rad, N, N/m, kg.

    ``arm`` is the path of an ARM.toml, relative to the folder of the file. ``[postures]`` has
    ``random`` (a number, and ``seed``), ``grid`` (angles [rad] by joint) or ``angles`` (a list of
    postures). ``loads`` is a list of wrenches (6 numbers) or forces (3). The keys of
    ``[[variables]]`` are the attributes of :class:`Variable`, with ``joint`` or ``cable`` instead
    of ``at``. The keys of ``[[objectives]]`` and ``[[constraints]]`` are the attributes of
    :class:`Objective` and :class:`Constraint`. ``tolerances`` is the path of a file of
    :class:`Tolerances`. ``[search]`` has ``generations``, ``population`` and ``seed``. All other
    keys are attributes of :class:`DesignProblem`.

    Args:
        path: The file; ``examples/design.toml`` is one with comments.

    Raises:
        FileError: The file, or one that it names, cannot be read, or does not describe a design
            problem; the error lists every fault.
    """
    text = read_text(path)
    folder = Path(path).parent
    try:
        file = parse(_File, read_toml(text))
        return ProblemFile(_problem(file, folder), **asdict(file.search))
    except GeometryError as error:
        faults = error.faults
    except FileError:
        raise
    except CdsmError as error:
        faults = (str(error),)
    raise FileError(path, f"is no design problem:{listed(faults, 20, LINES)}")


def _problem(file: _File, folder: Path) -> DesignProblem:
    parts: dict[str, list[Any]] = {"variables": [], "objectives": [], "constraints": []}
    faults = []
    for name, kept in parts.items():
        for i, entry in enumerate(getattr(file, name), start=1):
            try:
                kept.append(_built(entry))
            except CdsmError as error:
                faults.append(f"{name}[{i}]: {error}")
    try:
        postures = _postures(file.postures)
    except CdsmError as error:
        faults.append(f"postures: {error}")
    if faults:
        raise GeometryError(faults)
    arm = Manipulator.read(folder / file.arm)
    _check_angles(file.postures.angles, arm.joint_names)
    tolerances = None if file.tolerances is None else Tolerances.read(folder / file.tolerances)
    return DesignProblem(
        arm=arm,
        **{name: tuple(kept) for name, kept in parts.items()},
        postures=postures,
        loads=_loads(file.loads),
        minimum=file.minimum,
        maximum=math.inf if file.maximum is None else file.maximum,
        worst_friction=file.worst_friction,
        diameter=file.diameter,
        tolerances=tolerances,
        coverage=file.coverage,
    )


def _built(entry: Any) -> Any:
    if isinstance(entry, _Variable):
        at = entry.cable if entry.joint is None else entry.joint
        return Variable(entry.of, entry.low, entry.high, at, entry.choices)  # type: ignore[arg-type]
    if isinstance(entry, _Objective):
        return Objective(entry.of, entry.direction, entry.goal)  # type: ignore[arg-type]
    return Constraint(entry.of, entry.direction, entry.at_least, entry.at_most)


def _postures(entry: _Postures) -> PoseSet | Any:
    given = [entry.random, entry.grid, entry.angles]
    if sum(each is not None for each in given) != 1:
        raise InvalidInput("random", "give one of random, grid and angles.")
    if entry.random is not None:
        return RandomPoses(entry.random, entry.seed)
    return GridPoses(entry.grid) if entry.grid is not None else entry.angles


def _check_angles(given: Any, joints: Sequence[str]) -> None:
    """Check that each posture of a list has an angle for each joint; GeometryError otherwise."""
    rows = given if isinstance(given, list) else []
    faults = [
        f"postures: angles[{i}] has {plural(len(row), 'number')}; give {len(joints)} [rad], one "
        f"for each of {', '.join(joints)}"
        for i, row in enumerate(rows, start=1)
        if isinstance(row, list) and len(row) != len(joints)
    ]
    if faults:
        raise GeometryError(faults)


def _loads(given: Any) -> Any:
    if given is None:
        return np.zeros((1, 6))
    rows = given if isinstance(given, list) and given and isinstance(given[0], list) else [given]
    return [
        [*row, 0.0, 0.0, 0.0] if isinstance(row, list) and len(row) == 3 else row for row in rows
    ]

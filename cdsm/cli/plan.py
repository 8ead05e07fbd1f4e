"""``cdsm plan``: plan tensions for a wanted stiffness, at one posture or along a path."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from cdsm.cli.json_answers import Json, of_path, of_plan
from cdsm.cli.options import (
    ANGLES,
    NO_WRENCH,
    UNMET,
    ArmOptions,
    AsJson,
    MaxTension,
    MinTension,
    Picture,
    Wrench,
    answer,
    at_angles,
    console,
    numbers,
    reported,
    write_picture,
)
from cdsm.cli.path_file import PathFile, read_path
from cdsm.manipulator import Manipulator
from cdsm.planning import (
    PathPlan,
    plan_path,
    plan_stiffness,
    stiffness_range,
)
from cdsm.posture import Posture

_Bounds = tuple[float, float, list[float]]
"""Lower and upper bound of the tensions [N], and the wrench."""


def plan(
    arm: ArmOptions,
    direction: Annotated[
        str, typer.Option(help="Along which the arm is to be so stiff.", metavar="X,Y,Z")
    ],
    target: Annotated[
        float | None,
        typer.Option(help="Wanted stiffness [N/mm]; PATH.csv can give it for every sample."),
    ] = None,
    angles: Annotated[str | None, ANGLES] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH.csv",
            help="Instead of --angles, a line per sample. Columns, with the unit in brackets: the "
            "joints in deg (mm where they slide), or x, y, z of the tip in mm; and, if wanted, "
            "target in N/mm.",
        ),
    ] = None,
    rate: Annotated[
        float, typer.Option(help="How much a tension may change per sample of --path [N].")
    ] = math.inf,
    min_tension: MinTension = 10.0,
    max_tension: MaxTension = math.inf,
    wrench: Wrench = NO_WRENCH,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FILE.csv", help="Tensions and cable lengths to write, in SI."
        ),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find the least tensions that make an arm as stiff as wanted, at a posture or along a path.

    Exit code 3: some samples of the path cannot be planned; all that can is written all the same.
    """
    with reported():
        robot = arm.read()
        u, load = numbers("--direction", direction, 3), numbers("--wrench", wrench, 6)
        wanted = None if target is None else 1000.0 * target
        bounds = min_tension, max_tension, load
        if path is not None and angles is not None:
            raise typer.BadParameter(
                "is of one posture; --path has its own.", param_hint="--angles"
            )
        if path is not None:
            result = _along_path(robot, read_path(path, robot), u, wanted, bounds, rate)
        elif wanted is None:
            raise typer.BadParameter("give it, or --path.", param_hint="--target")
        elif math.isfinite(rate):
            raise typer.BadParameter("is of a path; give --path, too.", param_hint="--rate")
        else:
            pose = at_angles(robot, "0" if angles is None else angles)
            result = _at_posture(pose, u, wanted, bounds)
        answer(as_json, result.as_dict, robot, *result.parts)
        if out is not None:
            typer.echo(f"written: {result.motors().write_csv(out)}", err=as_json)
        write_picture(figure, result.draw, *result.drawn, err=as_json)
    if not result.complete:
        raise typer.Exit(UNMET)


class _Answer(NamedTuple):
    """Results to print, write and draw."""

    parts: tuple[object, ...]
    as_dict: Callable[[], Json]
    motors: Callable[[], PathPlan]
    draw: str
    drawn: tuple[object, ...]
    complete: bool = True


def _at_posture(pose: Posture, u: list[float], target: float, bounds: _Bounds) -> _Answer:
    """Plan the stiffness at one posture, and compute its attainable range."""
    attainable = stiffness_range(pose, u, *bounds)
    best = plan_stiffness(pose, u, target, *bounds)

    def motors() -> PathPlan:  # repeats the search of plan_stiffness as a path of one sample
        return plan_path(pose.arm, u, target, *bounds, angles=[pose.q])

    drawn = best, attainable
    as_dict = partial(of_plan, best, attainable)
    return _Answer((attainable, best), as_dict, motors, "plot_stiffness_plan", drawn)


def _along_path(
    arm: Manipulator,
    file: PathFile,
    u: list[float],
    target: float | None,
    bounds: _Bounds,
    rate: float,
) -> _Answer:
    """Plan a path with one target [N/m] for all samples, or with the targets of its file."""
    wanted = file.target if target is None else target
    if wanted is None or (target is not None and file.target is not None):
        raise typer.BadParameter(
            "give it, or a column target [N/mm] in the file of --path; "
            f"{'neither was' if wanted is None else 'both were'} given.",
            param_hint="--target",
        )
    path = plan_path(arm, u, wanted, *bounds, angles=file.angles, tips=file.tips, rate=rate)
    with console.status("looking half-way between the samples"):
        _ = path.between
    as_dict, complete = partial(of_path, path), not path.infeasible
    return _Answer((path,), as_dict, lambda: path, "plot_path_plan", (path,), complete)

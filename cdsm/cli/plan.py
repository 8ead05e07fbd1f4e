"""``cdsm plan``: tensions for a wanted stiffness, at one posture or along a path."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

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
    at_angles,
    console,
    numbers,
    reported,
    show_json,
)
from cdsm.cli.path_file import PathFile, read_path
from cdsm.manipulator import Manipulator
from cdsm.planning import (
    PathPlan,
    StiffnessPlan,
    StiffnessRange,
    plan_path,
    plan_stiffness,
    stiffness_range,
)
from cdsm.posture import Posture
from cdsm.support.files import write_file
from cdsm.support.units import joints_to_dict, key

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
            answer = _along_path(robot, read_path(path, robot), u, wanted, bounds, rate)
        elif wanted is None:
            raise typer.BadParameter("give it, or --path.", param_hint="--target")
        elif math.isfinite(rate):
            raise typer.BadParameter("is of a path; give --path, too.", param_hint="--rate")
        else:
            answer = _at_posture(
                at_angles(robot, "0" if angles is None else angles), u, wanted, bounds
            )
        if as_json:
            show_json(answer.numbers)
        else:
            typer.echo(f"{robot}\n\n{answer.text}")
        if out is not None:
            typer.echo(f"written: {answer.motors().write_csv(out)}", err=as_json)
        if figure is not None:
            typer.echo(f"written: {write_file(figure, answer.draw().savefig)}", err=as_json)
    if not answer.complete:
        raise typer.Exit(UNMET)


class _Answer(NamedTuple):
    """What is told, and what can be written."""

    text: str
    numbers: dict[str, object]
    motors: Callable[[], PathPlan]
    draw: Callable[[], Figure]
    complete: bool = True


def _at_posture(pose: Posture, u: list[float], target: float, bounds: _Bounds) -> _Answer:
    """The plan at one posture, and the range."""
    attainable = stiffness_range(pose, u, *bounds)
    found = plan_stiffness(pose, u, target, *bounds)

    def motors() -> PathPlan:  # the same search, as a path of one sample
        return plan_path(pose.arm, u, target, *bounds, angles=[pose.q])

    def draw() -> Figure:
        from cdsm.plots import plot_stiffness_plan  # matplotlib, only where it is wanted

        return plot_stiffness_plan(found, attainable)

    return _Answer(f"{attainable}\n\n{found}", _plan_to_dict(found, attainable), motors, draw)


def _along_path(
    arm: Manipulator,
    file: PathFile,
    u: list[float],
    target: float | None,
    bounds: _Bounds,
    rate: float,
) -> _Answer:
    """The plan of a path whose targets [N/m] are in its file, or all the same."""
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

    def draw() -> Figure:
        from cdsm.plots import plot_path_plan  # matplotlib, only where it is wanted

        return plot_path_plan(path)

    return _Answer(str(path), _path_to_dict(path), lambda: path, draw, not path.infeasible)


def _plan_to_dict(plan: StiffnessPlan, attainable: StiffnessRange) -> dict[str, object]:
    """Range and plan, in SI units."""
    pose = plan.tension.posture
    names = [cable.name for cable in pose.arm.cables]
    return {
        "direction": attainable.direction.tolist(),
        "low_N_per_m": attainable.low,
        "high_N_per_m": attainable.high,
        "target_N_per_m": plan.target,
        "achieved_N_per_m": plan.achieved,
        "tension_N": dict(zip(names, plan.tension.values.tolist(), strict=True)),
        "cable_length_m": dict(zip(names, pose.cable_lengths.tolist(), strict=True)),
        **joints_to_dict(pose.arm.joint_names, pose.arm.slides, pose.q),
        key("margin", pose.arm.stiffness_unit()): plan.stiffness.margin,
        "efforts_N": plan.efforts.tolist(),
        "iterations": plan.iterations,
    }


def _path_to_dict(plan: PathPlan) -> dict[str, object]:
    """Every sample of a path, in SI units."""
    return {
        "cables": [cable.name for cable in plan.arm.cables],
        "target_N_per_m": plan.target.tolist(),
        "planned": list(plan.planned),
        "achieved_N_per_m": plan.achieved.tolist(),
        **joints_to_dict(plan.arm.joint_names, plan.arm.slides, plan.angles),
        "tensions_N": plan.tensions.tolist(),
        "cable_lengths_m": plan.cable_lengths.tolist(),
        "half_way": [
            {
                "after": each.index,
                "target_N_per_m": each.target.tolist(),
                "achieved_N_per_m": None if each.achieved is None else each.achieved.tolist(),
                "misfit": each.misfit if math.isfinite(each.misfit) else None,
                "reason": each.reason,
            }
            for each in plan.between
        ],
        "infeasible": [
            {"index": each.index, "status": each.status, "reason": each.reason}
            for each in plan.infeasible
        ],
        "iterations": plan.iterations,
    }

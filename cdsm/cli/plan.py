"""``cdsm plan``: plan tensions for a wanted stiffness, at one posture or along a path."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.options import ArmOptions, AsJson, MaxTension, MinTension, Picture, numbers
from cdsm.cli.output import UNMET, Json, answer, by_cable, joints, write_picture

if TYPE_CHECKING:
    from cdsm.support.values import Array


def plan(
    arm: ArmOptions,
    direction: Annotated[
        str, typer.Option(help="Along which the arm is to be so stiff.", metavar="X,Y,Z")
    ],
    target: Annotated[
        float | None,
        typer.Option(help="Wanted stiffness [N/mm]; PATH.csv can give it for every sample."),
    ] = None,
    angles: Annotated[str | None, options.ANGLES] = None,
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
    wrench: options.Wrench = options.NO_WRENCH,
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
    u = numbers("--direction", direction, 3)
    bounds = min_tension, max_tension, numbers("--wrench", wrench, 6)
    if path is not None and angles is not None:
        raise typer.BadParameter("is of one posture; --path has its own.", param_hint="--angles")
    wanted = None if target is None else 1000.0 * target
    drawn: tuple[object, ...]
    if path is not None:
        from cdsm.cli.path_file import read_path

        robot = arm.read()
        file = read_path(path, robot)
        targets = _one_target(wanted, file.target)
        plan = cdsm.plan_path(
            robot, u, targets, *bounds, angles=file.angles, tips=file.tips, rate=rate
        )
        conditions = Conditions(robot, (min_tension,))
        answer(as_json, lambda: _path_numbers(plan), conditions, plan)
        draw, drawn = "plot_path_plan", (plan,)
    elif wanted is None:
        raise typer.BadParameter("give it, or --path.", param_hint="--target")
    elif math.isfinite(rate):
        raise typer.BadParameter("is of a path; give --path, too.", param_hint="--rate")
    else:
        pose = arm.at("0" if angles is None else angles)
        attainable = cdsm.stiffness_range(pose, u, *bounds)
        best = cdsm.plan_stiffness(pose, u, wanted, *bounds)
        conditions = Conditions(pose.arm, (min_tension,))
        answer(as_json, lambda: _numbers(best, attainable), conditions, attainable, best)
        draw, drawn = "plot_stiffness_plan", (best, attainable)
        if out is not None:  # repeats the search as a path of one sample
            plan = cdsm.plan_path(pose.arm, u, wanted, *bounds, angles=[pose.q])
    if out is not None:
        typer.echo(f"written: {plan.write_csv(out)}", err=as_json)
    write_picture(figure, draw, *drawn, err=as_json)
    if path is not None and plan.infeasible:
        raise typer.Exit(UNMET)


def _one_target(given: float | None, of_file: Array | None) -> float | Array:
    """Return the target [N/m] of the option, or the targets of the file; exactly one is given."""
    if given is not None and of_file is None:
        return given
    if given is None and of_file is not None:
        return of_file
    raise typer.BadParameter(
        "give it, or a column target [N/mm] in the file of --path; "
        f"{'neither was' if given is None else 'both were'} given.",
        param_hint="--target",
    )


def _numbers(plan: cdsm.StiffnessPlan, attainable: cdsm.StiffnessRange) -> Json:
    from cdsm.support.format import key

    pose, arm = plan.tension.posture, plan.tension.posture.arm
    return {
        "direction": attainable.direction,
        "low_N_per_m": attainable.low,
        "high_N_per_m": attainable.high,
        "target_N_per_m": plan.target,
        "achieved_N_per_m": plan.achieved,
        "tension_N": by_cable(arm, plan.tension.values),
        "cable_length_m": by_cable(arm, pose.cable_lengths),
        **joints(arm, pose.q),
        key("margin", arm.stiffness_unit()): plan.stiffness.margin,
        "efforts_N": plan.efforts,
        "iterations": plan.iterations,
    }


def _path_numbers(plan: cdsm.PathPlan) -> Json:
    return {
        "cables": [cable.name for cable in plan.arm.cables],
        "target_N_per_m": plan.target,
        "planned": plan.planned,
        "achieved_N_per_m": plan.achieved,
        **joints(plan.arm, plan.angles),
        "tensions_N": plan.tensions,
        "cable_lengths_m": plan.cable_lengths,
        "half_way": [
            {
                "after": between.index,
                "target_N_per_m": between.target,
                "achieved_N_per_m": between.achieved,
                "misfit": between.misfit,
                "reason": between.reason,
            }
            for between in plan.between
        ],
        "infeasible": [
            {"index": sample.index, "status": sample.status, "reason": sample.reason}
            for sample in plan.infeasible
        ],
        "iterations": plan.iterations,
    }

"""``cdsm plan``: plan tensions for a wanted stiffness, at one posture or along a path."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.files import Picture, file_option, out_option
from cdsm.cli.options import ArmOptions, AsJson, LoadOptions, MaxTension, MinTension
from cdsm.cli.output import answer, write, write_picture
from cdsm.cli.values import direction_of, misuse


def plan(
    arm: ArmOptions,
    load: LoadOptions,
    direction: Annotated[
        str,
        typer.Option(
            help="Direction of the wanted stiffness: an axis such as z or -y, or a vector.",
            metavar="AXIS|X,Y,Z",
            autocompletion=options.directions,
        ),
    ],
    target: Annotated[
        float | None,
        typer.Option(
            help="Wanted stiffness [N/mm]; PATH.csv can give it for every sample.", min=0.0
        ),
    ] = None,
    angles: Annotated[str | None, options.ANGLES] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH.csv",
            help=f"Path instead of --angles, a line per sample. {options.PATH_COLUMNS}",
        ),
    ] = None,
    rate: Annotated[
        float, typer.Option(help="Largest change of a tension per sample of --path [N].")
    ] = math.inf,
    min_tension: MinTension = 10.0,
    max_tension: MaxTension = math.inf,
    out: Annotated[
        Path | None,
        out_option(
            endings=(".csv",),
            metavar="FILE.csv",
            help="Table of tensions, lengths, stiffness to write.",
        ),
    ] = None,
    figure: Picture = None,
    animation: Annotated[
        Path | None,
        file_option(
            endings=(".gif",),
            metavar="FILE.gif",
            help="Animation of the arm along --path to write.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find the least tensions with a wanted stiffness, at a posture or along a path.

    Exit code 0; 3 if no tensions reach the target at the posture, or at some samples of the path.
    The plan of the other samples is still written.
    """
    u = direction_of(direction)
    if path is not None and angles is not None:
        raise misuse("--angles", "is of one posture; --path has its own.")
    wanted = None if target is None else 1000.0 * target
    if path is not None:
        from cdsm.cli.path_file import one_target, read_path
        from cdsm.support.format import plural

        robot = arm.read()
        file = read_path(path, robot)
        targets = one_target(wanted, file.target, "--target")
        bounds = min_tension, max_tension, load.at_tip(robot)
        plan = cdsm.plan_path(
            robot,
            u,
            targets,
            *bounds,
            angles=file.angles,
            tips=file.tips,
            max_change_per_sample=rate,
        )
        write(out, plan.write)
        write_picture(figure, plan.plot)
        if plan.planned:  # otherwise there is no posture to draw
            write(animation, lambda file: cdsm.plots.plot_path(plan, animate=file))
        missed = len(plan.target) - len(plan.planned)
        warnings = (
            [f"NOT REACHED at {missed} of {plural(len(plan.target), 'sample')}"] if missed else []
        )
        conditions = Conditions(robot, (min_tension,), planned=True)
        answer(as_json, plan.to_dict, conditions, plan, warnings=warnings)
    elif wanted is None:
        raise misuse("--target", "give it, or --path.")
    elif math.isfinite(rate) or animation is not None:
        option = "--rate" if math.isfinite(rate) else "--animation"
        raise misuse(option, "needs --path.")
    else:
        pose = arm.at("0" if angles is None else angles)
        bounds = min_tension, max_tension, load.at_tip(pose.arm)
        attainable = cdsm.stiffness_range(pose, u, *bounds)
        best = cdsm.plan_stiffness(pose, u, wanted, *bounds)
        write(out, best.write)
        write_picture(figure, lambda: best.plot(attainable))
        conditions = Conditions(pose, (min_tension,), planned=True)
        results = [attainable, best]
        answer(as_json, lambda: attainable.to_dict() | best.to_dict(), conditions, *results)

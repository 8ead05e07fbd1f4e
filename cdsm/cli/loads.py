"""``cdsm weigh`` and ``cdsm buckle``: displacement under a weight, and buckling."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from cdsm.cli.json_answers import of_buckling, of_weight_test
from cdsm.cli.options import (
    NO_WRENCH,
    Angles,
    ArmOptions,
    AsJson,
    Picture,
    Solver,
    TensionOptions,
    Wrench,
    answer,
    numbers,
    reported,
    write_picture,
)
from cdsm.statics.buckling import critical_load, critical_tension
from cdsm.statics.weight_test import weight_test
from cdsm.tension import DEFAULT_SOLVER


def weigh(
    arm: ArmOptions,
    tensions: TensionOptions,
    force: Annotated[
        str, typer.Option(help="The weight: FX,FY,FZ at the tip [N].", metavar="FX,FY,FZ")
    ],
    angles: Angles = "0",
    steps: Annotated[int, typer.Option(help="Equal steps to hang it in.")] = 5,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Hang a weight at the tip with the motors locked, and see how far it goes (Eq. 20)."""
    with reported():
        pose = arm.at(angles)
        tension = tensions.distribute(pose)
        test = weight_test(pose, tension, numbers("--force", force, 3), steps=steps)
        write_picture(figure, "plot_weight_test", test)
        loaded = f"at the full load:\n{test.loaded[-1]}"
        answer(as_json, lambda: of_weight_test(test), pose.arm, test, loaded)


def buckle(
    arm: ArmOptions,
    angles: Angles = "0",
    load: Annotated[
        str | None,
        typer.Option(
            help="Also find the multiple of this load that the arm stands at --min-tension.",
            metavar="FX,...,MZ",
        ),
    ] = None,
    min_tension: Annotated[
        float | None, typer.Option(help="Lower bound of all tensions under the load [N]; 10.")
    ] = None,
    max_tension: Annotated[
        float | None, typer.Option(help="Upper bound of all tensions under the load [N].")
    ] = None,
    wrench: Wrench = NO_WRENCH,
    solver: Solver = DEFAULT_SOLVER,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find the tension, and the load, at which the arm buckles."""
    for option, value in (("--min-tension", min_tension), ("--max-tension", max_tension)):
        if value is not None and load is None:
            raise typer.BadParameter("bounds the tensions under --load only.", param_hint=option)
    with reported():
        pose = arm.at(angles)
        carried = numbers("--wrench", wrench, 6)
        tension = critical_tension(pose, carried, solver)
        most = None
        if load is not None:
            weight = numbers("--load", load, 6)
            low = 10.0 if min_tension is None else min_tension
            high = math.inf if max_tension is None else max_tension
            most = critical_load(pose, weight, low, high, solver, carried=carried)
        write_picture(figure, "plot_critical_tension", tension)
        found = (tension,) if most is None else (tension, most)
        answer(as_json, lambda: of_buckling(tension, most), pose.arm, *found)

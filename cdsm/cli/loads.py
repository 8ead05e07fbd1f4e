"""``cdsm weigh`` and ``cdsm buckle``: displacement under a weight, and buckling."""

from __future__ import annotations

import math
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.options import Angles, ArmOptions, AsJson, Picture, TensionOptions, numbers
from cdsm.cli.output import Json, answer, joints, write_picture


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
    pose = arm.at(angles)
    tension = tensions.distribute(pose)
    test = cdsm.weight_test(pose, tension, numbers("--force", force, 3), steps=steps)
    write_picture(figure, "plot_weight_test", test)
    loaded = f"at the full load:\n{test.loaded[-1]}"
    conditions = tensions.conditions(pose.arm)
    answer(as_json, lambda: _weight_numbers(test), conditions, test, loaded)


def _weight_numbers(test: cdsm.WeightTest) -> Json:
    last, before = test.loaded[-1], test.without
    return {
        "before": {
            "tip_displacement_m": before.displacement,
            "at_limit": before.at_limit,
            "slack": before.slack,
            "stable": before.stable,
        },
        "force_N": test.force,
        "loads_N": test.loads,
        "tip_displacements_m": test.displacements,
        "linear_displacement_m": test.linear.displacement,
        "stiffness_N_per_m": test.stiffness,
        "linear_stiffness_N_per_m": test.linear.stiffness,
        "cables": [cable.name for cable in last.pose.arm.cables],
        "tensions_N": test.tensions,
        **joints(last.pose.arm, last.pose.q),
        "slack": last.slack,
        "at_limit": last.at_limit,
        "stable": last.stable,
    }


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
    wrench: options.Wrench = options.NO_WRENCH,
    solver: options.Solver = options.DEFAULT_SOLVER,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find the tension, and the load, at which the arm buckles."""
    for option, value in (("--min-tension", min_tension), ("--max-tension", max_tension)):
        if value is not None and load is None:
            raise typer.BadParameter("bounds the tensions under --load only.", param_hint=option)
    pose = arm.at(angles)
    carried = numbers("--wrench", wrench, 6)
    tension = cdsm.critical_tension(pose, carried, solver)
    most, low = None, None
    if load is not None:
        low = 10.0 if min_tension is None else min_tension
        high = math.inf if max_tension is None else max_tension
        weight = numbers("--load", load, 6)
        most = cdsm.critical_load(pose, weight, low, high, solver, carried=carried)
    write_picture(figure, "plot_critical_tension", tension)
    found = (tension,) if most is None else (tension, most)
    conditions = Conditions(pose.arm, () if low is None else (low,))
    answer(as_json, lambda: _buckling_numbers(tension, most), conditions, *found)


def _buckling_numbers(tension: cdsm.CriticalTension, load: cdsm.CriticalLoad | None) -> Json:
    names = tension.posture.arm.joint_names
    found: Json = {
        "critical_minimum_tension_N": tension.minimum,
        "stable_minimum_tension_N": tension.stable,
        "examined_minimum_tension_N": tension.examined,
        "mode": dict(zip(names, tension.mode, strict=True)),
        "tension_N": tension.tension,
    }
    if load is not None:
        found |= {
            "load": load.wrench,
            "critical_load_factor": load.factor,
            "limit": load.limit,
            "load_mode": dict(zip(names, load.mode, strict=True)),
        }
    return found

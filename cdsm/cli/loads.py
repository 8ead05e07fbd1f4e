"""``cdsm weigh`` and ``cdsm buckle``: what a load does, and when the arm gives way."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from cdsm.cli.options import (
    NO_WRENCH,
    Angles,
    ArmOptions,
    AsJson,
    Picture,
    Solver,
    TensionOptions,
    Wrench,
    numbers,
    reported,
    show_json,
)
from cdsm.statics.buckling import CriticalLoad, CriticalTension, critical_load, critical_tension
from cdsm.statics.weight_test import WeightTest, weight_test
from cdsm.support.files import write_file
from cdsm.support.units import joints_to_dict


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
        pull = tensions.distribute(pose)
        test = weight_test(pose, pull, numbers("--force", force, 3), steps=steps)
        if figure is not None:
            from cdsm.plots import plot_weight_test  # matplotlib, only where it is wanted

            path = write_file(figure, plot_weight_test(test).savefig)
            typer.echo(f"written: {path}", err=True)
        if as_json:
            show_json(_weight_to_dict(test))
        else:
            typer.echo(f"{pose.arm}\n\n{test}\n\nat the full load:\n{test.loaded[-1]}")


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
    solver: Solver = "daqp",
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find the tension, and the load, at which the arm buckles."""
    for option, value in (("--min-tension", min_tension), ("--max-tension", max_tension)):
        if value is not None and load is None:
            raise typer.BadParameter("bounds the tensions under --load only.", param_hint=option)
    with reported():
        pose = arm.at(angles)
        always = numbers("--wrench", wrench, 6)
        tension = critical_tension(pose, always, solver)
        most = None
        if load is not None:
            weight = numbers("--load", load, 6)
            low = 10.0 if min_tension is None else min_tension
            high = math.inf if max_tension is None else max_tension
            most = critical_load(pose, weight, low, high, solver, carried=always)
        if figure is not None:
            from cdsm.plots import plot_critical_tension  # matplotlib, only where it is wanted

            path = write_file(figure, plot_critical_tension(tension).savefig)
            typer.echo(f"written: {path}", err=True)
        if as_json:
            show_json(_critical_to_dict(tension, most))
        else:
            typer.echo(f"{pose.arm}\n\n{tension}")
            if most is not None:
                typer.echo(f"\n{most}")


def _weight_to_dict(test: WeightTest) -> dict[str, object]:
    """Every step of a weight test, in SI units; null where the stiffness is infinite."""
    last, before = test.loaded[-1], test.without
    return {
        "before": {
            "tip_displacement_m": before.displacement.tolist(),
            "at_limit": list(before.at_limit),
            "slack": list(before.slack),
            "stable": before.stable,
        },
        "force_N": test.force.tolist(),
        "loads_N": test.loads.tolist(),
        "tip_displacements_m": test.displacements.tolist(),
        "linear_displacement_m": test.linear.displacement.tolist(),
        "stiffness_N_per_m": _finite(test.stiffness),
        "linear_stiffness_N_per_m": _finite(test.linear.stiffness),
        "cables": [cable.name for cable in last.pose.arm.cables],
        "tensions_N": test.tensions.tolist(),
        **joints_to_dict(last.pose.arm.joint_names, last.pose.arm.slides, last.pose.q),
        "slack": list(last.slack),
        "at_limit": list(last.at_limit),
        "stable": last.stable,
    }


def _critical_to_dict(tension: CriticalTension, load: CriticalLoad | None) -> dict[str, object]:
    """Both answers, in SI units; null where nothing is critical."""
    names = tension.posture.arm.joint_names
    answer: dict[str, object] = {
        "critical_minimum_tension_N": _finite(tension.minimum),
        "stable_minimum_tension_N": [list(span) for span in tension.stable],
        "examined_minimum_tension_N": list(tension.examined),
        "mode": dict(zip(names, tension.mode.tolist(), strict=True)),
        "tension_N": tension.tension.tolist(),
    }
    if load is not None:
        answer |= {
            "load": load.wrench.tolist(),
            "critical_load_factor": _finite(load.factor),
            "limit": load.limit,
            "load_mode": dict(zip(names, load.mode.tolist(), strict=True)),
        }
    return answer


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None

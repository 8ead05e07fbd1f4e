"""``cdsm cycle``: load an arm with friction up and down."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import (
    Angles,
    ArmOptions,
    AsJson,
    Picture,
    TensionOptions,
    WeightOptions,
    wrench_of,
)
from cdsm.cli.output import answer, write_picture, written


def cycle(
    arm: ArmOptions,
    tensions: TensionOptions,
    weight: WeightOptions,
    wrench: options.Wrench = None,
    angles: Angles = "0",
    cycles: Annotated[int, typer.Option(help="Number of cycles.", min=1, max=100)] = 2,
    steps: Annotated[
        int, typer.Option(help="Steps from zero load to the largest.", min=1, max=1000)
    ] = 12,
    one_sided: Annotated[
        bool, typer.Option("--one-sided", help="Unload to zero; do not reverse the load.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="File to write: .nc (NetCDF) or .csv, SI units."),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Load the tip slowly up and down, and print the hysteresis due to friction in the holes.

    --force or --mass is the largest load; --wrench is a constant load in addition.
    """
    import numpy as np

    from cdsm.sweeps.export import check_target

    if not weight.given:
        raise typer.BadParameter("give it or --mass: the largest load.", param_hint="--force")
    if out is not None:
        check_target(out)
    pose = arm.at(angles)
    tension = tensions.distribute(pose, wrench_of(wrench))
    up = np.arange(1, steps + 1) / steps
    hump = np.concatenate([up, up[-2::-1] if steps > 1 else [], [0.0]])
    factors = hump if one_sided else np.concatenate([hump, -hump])
    added = np.append(weight.vector(pose.arm), np.zeros(3))
    wrenches = tension.wrench + np.tile(factors, cycles)[:, None] * added
    history = cdsm.load_cycle(pose, tension, wrenches)
    if out is not None:
        written(history.write(out))
    write_picture(figure, history.plot)
    lost = float(history.dissipated[-len(factors) :].sum())
    left = float(np.linalg.norm(history.displacement[-1]))
    note = (
        f"the last cycle loses {1000.0 * lost:.4g} mJ; without load the tip is left "
        f"{1e6 * left:.4g} µm from where it was"
    )
    if not pose.arm.has_friction:
        note = "the holes have no friction, so there is no loop: give --friction, e.g. 0.1"
    conditions = dataclasses.replace(tensions.conditions(pose.arm), friction=True)
    answer(
        as_json,
        lambda: history.to_dict() | {"lost_in_last_cycle_J": lost, "left_over_m": left},
        conditions,
        history,
        note,
    )

"""``cdsm export``: an arm for other programs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from cdsm.cable_file import write_cables
from cdsm.cli.options import (
    DOWN,
    NO_WRENCH,
    Angles,
    AsJson,
    GeometryFile,
    Gravity,
    MaxTension,
    MinTension,
    Rigidity,
    Solver,
    Spring,
    Wire,
    Wrench,
    numbers,
    posture,
    reported,
    show_json,
)
from cdsm.mjcf import write_mjcf
from cdsm.tension import distribute_tension


def export(
    geometry: GeometryFile,
    mjcf: Annotated[
        Path | None, typer.Option(metavar="FILE.xml", help="MuJoCo model, its cables pulled.")
    ] = None,
    cables: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Cables, to go with the URDF.")
    ] = None,
    angles: Angles = "0",
    min_tension: MinTension = 10.0,
    max_tension: MaxTension = math.inf,
    damping: Annotated[
        float, typer.Option(help="Of every joint in the MuJoCo model, in N m s/rad.")
    ] = 0.0,
    rigidity: Rigidity = None,
    wire: Wire = None,
    spring: Spring = math.inf,
    wrench: Wrench = NO_WRENCH,
    gravity: Gravity = DOWN,
    solver: Solver = "daqp",
    as_json: AsJson = False,
) -> None:
    """Write an arm for other programs: a MuJoCo model at a posture, or a file of its cables."""
    if mjcf is None and cables is None:
        raise typer.BadParameter("give --mjcf, --cables or both.", param_hint="--mjcf")
    with reported():
        pose = posture(
            geometry, angles, rigidity=rigidity, wire=wire, spring=spring, gravity=gravity
        )
        written = []
        if mjcf is not None:
            load = numbers("--wrench", wrench, 6)
            pull = distribute_tension(pose, min_tension, max_tension, load, solver)
            written.append(str(write_mjcf(pose.arm, mjcf, pose, pull, damping=damping)))
        if cables is not None:
            written.append(str(write_cables(pose.arm.cables, cables)))
        if as_json:
            show_json({"name": pose.arm.name, "written": list(written)})
        else:
            typer.echo("\n".join([str(pose.arm), *(f"written: {path}" for path in written)]))

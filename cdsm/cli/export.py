"""``cdsm export``: an arm for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdsm.cable_file import write_cables
from cdsm.cli.options import (
    Angles,
    ArmOptions,
    AsJson,
    TensionOptions,
    reported,
    show_json,
)
from cdsm.mjcf import write_mjcf


def export(
    arm: ArmOptions,
    tensions: TensionOptions,
    mjcf: Annotated[
        Path | None, typer.Option(metavar="FILE.xml", help="MuJoCo model, its cables pulled.")
    ] = None,
    cables_out: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="File of its cables to write.")
    ] = None,
    angles: Angles = "0",
    damping: Annotated[
        float, typer.Option(help="Of every joint in the MuJoCo model, in N m s/rad.")
    ] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Write an arm for other programs: a MuJoCo model at a posture, or a file of its cables."""
    if mjcf is None and cables_out is None:
        raise typer.BadParameter("give --mjcf, --cables-out or both.", param_hint="--mjcf")
    with reported():
        pose = arm.at(angles)
        written = []
        if mjcf is not None:
            pull = tensions.distribute(pose)
            written.append(str(write_mjcf(pose.arm, mjcf, pose, pull, damping=damping)))
        if cables_out is not None:
            written.append(str(write_cables(pose.arm.cables, cables_out)))
        if as_json:
            show_json({"name": pose.arm.name, "written": list(written)})
        else:
            typer.echo("\n".join([str(pose.arm), *(f"written: {path}" for path in written)]))

"""``cdsm export``: an arm for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdsm.cli.options import (
    UNMET,
    Angles,
    ArmOptions,
    AsJson,
    TensionOptions,
    reported,
    show_json,
)
from cdsm.interchange.cable_file import write_cables
from cdsm.interchange.mjcf import instability, write_mjcf
from cdsm.stiffness_matrix import stiffness


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
    """Write an arm for other programs: a MuJoCo model at a posture, or a file of its cables.

    Exit code 0; 3 if the arm of the MuJoCo model is unstable: it is written all the same.
    """
    if mjcf is None and cables_out is None:
        raise typer.BadParameter("give --mjcf, --cables-out or both.", param_hint="--mjcf")
    with reported():
        pose = arm.at(angles)
        written: list[str] = []
        said: dict[str, object] = {"name": pose.arm.name}
        stable, lines = True, [str(pose.arm)]
        if mjcf is not None:
            pull = tensions.distribute(pose)
            K = stiffness(pose, pull)
            stable = said["stable"] = K.is_stable
            if not stable:
                lines.insert(0, instability(K))
            written.append(str(write_mjcf(pose.arm, mjcf, pose, pull, damping=damping)))
        if cables_out is not None:
            written.append(str(write_cables(pose.arm.cables, cables_out)))
        if as_json:
            show_json(said | {"written": list(written)})
        else:
            typer.echo("\n".join([*lines, *(f"written: {path}" for path in written)]))
    if not stable:
        raise typer.Exit(UNMET)

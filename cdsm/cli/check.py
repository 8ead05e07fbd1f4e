"""``cdsm check``: whether a stiffness can be trusted."""

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
from cdsm.stiffness_matrix import stiffness
from cdsm.support.files import write_text


def check(
    arm: ArmOptions,
    tensions: TensionOptions,
    angles: Angles = "0",
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE.html", help="Write it as a page too.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check a stiffness: derive it anew by differences, and report all that speaks against it.

    The options are those of `cdsm stiffness`.
    Exit code 0: it can be trusted; 3: it cannot, and the report says why.
    """
    with reported():
        pose = arm.at(angles)
        report = stiffness(pose, tensions.distribute(pose)).report()
        if html is not None:
            path = write_text(html, report.to_html())
            typer.echo(f"written: {path}", err=True)
        if as_json:
            show_json(report.to_dict())
        else:
            typer.echo(f"{pose.arm}\n\n{report}")
    if not report.trustworthy:
        raise typer.Exit(UNMET)

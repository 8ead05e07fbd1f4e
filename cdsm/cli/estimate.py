"""Command that estimates loads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import opt
from cdsm.cli.output import answer, misuse, write_picture

_READINGS = "A line per reading. Columns: the tension at the motor of each cable, cable1_1 [N], …; "
_READINGS += "joints [deg] (mm where they slide; others 0); label. As examples/data/LOAD_CELLS.csv."
_LINK = (
    "Link on which a load is sought, and what: force (default), moment, wrench, or rows such as "
)
_LINK += "fy,fz. Repeat it. Default: the force at the tip."
_SLIDING = "All motors last took wire in until their cables slid in all holes, or let it out. "
_SLIDING += "Default: unknown."


def estimate(
    arm: options.ArmArgument,
    readings: Annotated[Path, typer.Argument(metavar="READINGS.csv", help=_READINGS)],
    tension_std: Annotated[float, opt("Standard uncertainty of the load cells.", "N")],
    angle_std: Annotated[
        float, opt("The same of the angles. Default: exact.", "DEG", min=0.0)
    ] = 0.0,
    link: Annotated[list[str] | None, opt(_LINK, "LINK[=WHAT]")] = None,
    sliding: Annotated[Literal["in", "out"] | None, opt(_SLIDING)] = None,
    changes: options.SetOption = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Estimate loads from load cells at the motors and joint angles.

    Prints each component with what the instruments leave unknown and what friction can hide. The
    figure is that of the last reading. docs/theory/estimation.md explains the numbers.
    """
    from cdsm.estimation.files import read_load_cells

    robot = options.load_arm(arm, changes)
    links: dict[str, str | list[str]] = {}
    for text in link or ():
        name, _, what = text.partition("=")
        if name in links:
            raise misuse("--link", f"{name!r} is given twice; give its rows at once.")
        links[name] = what.split(",") if "," in what else what or "force"
    found = {}
    for reading in read_load_cells(readings, robot):
        try:
            found[reading.label] = cdsm.estimate_load(
                reading.posture,
                reading.motor_tension,
                links or None,
                tension_std=tension_std,
                angle_std=angle_std * options.joint_scales(robot),
                sliding={"in": 1, "out": -1, None: None}[sliding],
            )
        except cdsm.InvalidInput as error:
            if error.name == "motor_tensions":  # else it is an option
                raise cdsm.FileError(readings, f"{reading.label}: {error}") from None
            raise
    write_picture(figure, [*found.values()][-1].plot)
    numbers = {name: each.to_dict() | {"warnings": each.warnings} for name, each in found.items()}
    texts = [f"{name}\n{each}" for name, each in found.items()]
    return answer(as_json, {"readings": numbers}, *texts, unmet=False)

"""``cdsm view``: an arm in the browser, with sliders."""

from __future__ import annotations

import contextlib
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.options import ANGLES, ArmOptions, AsJson, TensionOptions, WeightOptions
from cdsm.cli.output import Json, answer


def view(
    arm: ArmOptions,
    tensions: TensionOptions,
    weight: WeightOptions,
    angles: Annotated[str | None, ANGLES] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH.csv",
            help="A path to play, a line per sample. Columns, with the unit in brackets: the "
            "joints in deg (mm where they slide), or x, y, z of the tip in mm.",
        ),
    ] = None,
    sag: Annotated[
        bool, typer.Option("--sag", help="Start with the arm moved by the force.")
    ] = False,
    largest_tension: Annotated[
        float, typer.Option(help="Upper end of the slider of the lower bound of tension [N].")
    ] = 200.0,
    largest_force: Annotated[
        float, typer.Option(help="Upper end of the sliders of the force [N].")
    ] = 20.0,
    port: Annotated[int, typer.Option(help="Port to listen at; 0 for any free one.")] = 8080,
    browser: Annotated[
        bool, typer.Option("--browser", help="Open the page in a browser, too.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Show an arm in the browser: move joints, tip, tension and load, and see its stiffness.

    Only this machine can connect. From another one: ssh -L 8080:localhost:8080 THIS_MACHINE.
    """
    from cdsm.cli.path_file import PathFile, read_path

    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C ends the view, also while it starts
        pose = None if angles is None else arm.at(angles)
        robot = arm.read() if pose is None else pose.arm
        motion = PathFile(None, None, None) if path is None else read_path(path, robot)
        with cdsm.view.serve(
            robot,
            port=port,
            q=None if pose is None else pose.q,
            minimum=tensions.min_tension,
            maximum=tensions.max_tension,
            force=weight.vector(robot),
            sag=sag,
            angles=motion.angles,
            tips=motion.tips,
            solver=tensions.solver,
            largest_tension=largest_tension,
            largest_force=largest_force,
        ) as page:
            text = f"shown at {page.url}; Ctrl-C ends it"
            conditions = tensions.conditions(robot, friction=sag)
            facts: Json = {"name": robot.name, "url": page.url}
            answer(as_json, lambda: facts, conditions, text)
            if browser:
                webbrowser.open(page.url)
            page.wait()

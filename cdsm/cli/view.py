"""``cdsm view``: an arm in the browser, with sliders."""

from __future__ import annotations

import contextlib
import math
import webbrowser
from typing import Annotated

import typer

import cdsm
from cdsm.cli.conditions import Conditions
from cdsm.cli.options import (
    DEFAULT_SOLVER,
    Angles,
    ArmOptions,
    AsJson,
    MaxTension,
    MinTension,
    Solver,
    numbers,
)
from cdsm.cli.output import Json, answer


def view(
    arm: ArmOptions,
    angles: Angles = "0",
    min_tension: MinTension = 10.0,
    max_tension: MaxTension = math.inf,
    force: Annotated[
        str, typer.Option(help="At the tip, to begin with: FX,FY,FZ [N].", metavar="FX,FY,FZ")
    ] = "0,0,0",
    solver: Solver = DEFAULT_SOLVER,
    largest_tension: Annotated[
        float, typer.Option(help="Right end of the slider of the least tension [N].")
    ] = 200.0,
    largest_force: Annotated[
        float, typer.Option(help="Ends of the sliders of the force [N].")
    ] = 20.0,
    host: Annotated[
        str,
        typer.Option(
            help="Address to listen at; the default is this machine alone. With another, other "
            "machines can connect; they need the token in the URL."
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen at; 0 for any free one.")] = 8080,
    browser: Annotated[
        bool, typer.Option("--browser", help="Open the page in a browser, too.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Show an arm in the browser, live: move joints, tension and load; see how stiff it is."""
    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C ends the view, also while it starts
        pose = arm.at(angles)
        with cdsm.view.serve(
            pose.arm,
            host=host,
            port=port,
            q=pose.q,
            minimum=min_tension,
            maximum=max_tension,
            force=numbers("--force", force, 3),
            solver=solver,
            largest_tension=largest_tension,
            largest_force=largest_force,
        ) as page:
            text = f"shown at {page.url}; Ctrl-C ends it"
            conditions = Conditions(pose.arm, (min_tension,))
            told: Json = {"name": pose.arm.name, "url": page.url}
            answer(as_json, lambda: told, conditions, text)
            if browser:
                webbrowser.open(page.url)
            page.wait()

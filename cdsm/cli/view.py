"""``cdsm view``: an arm in the browser, with sliders."""

from __future__ import annotations

import contextlib
import math
from typing import Annotated

import cdsm
from cdsm.cli import options
from cdsm.cli.options import opt
from cdsm.cli.output import Json, answer, header, misuse


def view(
    arm: options.Arm,
    changes: options.Changes = None,
    angles: options.Angles = "",
    path: options.PathFile = None,
    minimum: options.Minimum = 0.0,
    load: options.Load = None,
    port: Annotated[int, opt("Port to listen at, default 8080; 0 for any.", "N")] = 8080,
    as_json: options.AsJson = False,
) -> int:
    """Show an arm in the browser, with sliders, and its stiffness."""
    from cdsm.cli.path_file import PathFile, read_path

    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C ends the view, also while it starts
        robot = options.read(arm, changes)
        start = options.coordinates(angles, robot) if angles else None
        force = options.load_at_tip(robot, load)
        if force[3:].any():
            raise misuse("--load", "has a moment, but the view has forces only: FX,FY,FZ.")
        motion = PathFile(None, None, None) if path is None else read_path(path, robot)
        with cdsm.view.serve(
            robot,
            port=port,
            q=start,
            minimum=minimum,
            maximum=math.inf,
            force=force[:3],
            angles=motion.angles,
            tips=motion.tips,
        ) as page:
            head, numbers = header(robot, [minimum], "included")
            facts: Json = {"name": robot.name, "url": page.url}
            answer(as_json, numbers | facts, head, f"shown at {page.url}; Ctrl-C ends it")
            page.wait()
    return 0

"""``cdsm plan``: plan tensions for a wanted stiffness, at one posture or along a path."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cdsm
from cdsm.cli import options
from cdsm.cli.options import file_opt, opt
from cdsm.cli.output import answer, header, misuse, write, write_picture

if TYPE_CHECKING:
    from cdsm.support.values import Array


def plan(
    arm: options.Arm,
    direction: Annotated[str, opt("Direction of the stiffness, such as -y.", "AXIS|X,Y,Z")],
    changes: options.Changes = None,
    target: Annotated[float | None, opt("Wanted stiffness.", "N/mm", min=0.0)] = None,
    angles: options.Angles = "",
    path: options.PathFile = None,
    max_change_per_sample: Annotated[float, opt("Of a tension, along --path.", "N")] = math.inf,
    minimum: options.Minimum = 0.0,
    maximum: options.Maximum = math.inf,
    load: options.Load = None,
    mass: options.Mass = None,
    out: Annotated[Path | None, file_opt("Tensions and lengths.", "FILE.csv", "--out")] = None,
    figure: options.Figure = None,
    as_json: options.AsJson = False,
) -> int:
    """Find the least tensions that give a wanted stiffness.

    At a posture the answer also has the range of stiffness, along a path the tensions of each line.

    Exit code 0; 3 if no tensions reach the target at the posture, or at some samples of the path.
    The plan of the other samples is still written.
    """
    u = options.direction_of(direction)
    wanted = None if target is None else 1e3 * target
    if path is None:
        if wanted is None:
            raise misuse("--target", "give it, or --path.")
        if max_change_per_sample < math.inf:
            raise misuse("--max-change-per-sample", "needs --path.")
        pose = options.posture(arm, changes, angles or "0")
        bounds = minimum, maximum, options.load_at_tip(pose.arm, load, mass)
        attainable = cdsm.stiffness_range(pose, u, *bounds)
        best = cdsm.plan_stiffness(pose, u, wanted, *bounds)
        write(out, best.write)
        write_picture(figure, lambda: best.plot(attainable))
        head, numbers = header(pose, [minimum])
        return answer(
            as_json, numbers | attainable.to_dict() | best.to_dict(), head, attainable, best
        )
    from cdsm.cli.path_file import read_path
    from cdsm.support.format import plural

    if angles:
        raise misuse("--angles", "is of one posture; --path has its own.")
    robot = options.read(arm, changes)
    file = read_path(path, robot)
    planned = cdsm.plan_path(
        robot,
        u,
        _one_target(wanted, file.target),
        *(minimum, maximum, options.load_at_tip(robot, load, mass)),
        angles=file.angles,
        tips=file.tips,
        max_change_per_sample=max_change_per_sample,
    )
    write(out, planned.write)
    write_picture(figure, planned.plot)
    samples = len(planned.target)
    missed = samples - len(planned.planned)
    warnings = [f"NOT REACHED at {missed} of {plural(samples, 'sample')}"] if missed else []
    head, numbers = header(robot, [minimum])
    return answer(as_json, numbers | planned.to_dict(), head, planned, warnings=warnings)


def _one_target(given: float | None, of_file: Array | None) -> float | Array:
    """Return the wanted stiffness [N/m]: that of --target, or of the path (S,)."""
    if given is not None and of_file is None:
        return given
    if given is None and of_file is not None:
        return of_file
    said = "give it, or a column target [N/mm] in the file of the path; "
    said += f"{'neither was' if given is None else 'both were'} given."
    raise misuse("--target", said)

"""``cdsm plan``: tensions for a stiffness, at a posture or along a path."""

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


_TARGET = "Wanted stiffness; without it, the range of stiffness is the answer."


def plan(
    arm: options.ArmArgument,
    direction: Annotated[str, opt("Direction of the stiffness, such as -y.", "AXIS|X,Y,Z")],
    changes: options.SetOption = None,
    target: Annotated[float | None, opt(_TARGET, "N/mm", min=0.0)] = None,
    angles: options.AnglesOption = None,
    path: options.PathOption = None,
    max_change_per_sample: Annotated[float, opt("Of a tension, along --path.", "N")] = math.inf,
    minimum: options.MinimumOption = 0.0,
    maximum: options.MaximumOption = math.inf,
    load: options.LoadOption = None,
    mass: options.MassOption = None,
    out: Annotated[Path | None, file_opt("Tensions and lengths.", "FILE.csv", "--out")] = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Find the least tensions that give a wanted stiffness.

    At a posture the answer also has the range of stiffness, and without --target only this range,
    which --figure draws; along a path it has the tensions of each line.

    Exit code 0; 3 if no tensions reach the target at the posture, or at some samples of the path.
    The plan of the other samples is still written.
    """
    u = options.parse_direction(direction)
    wanted = None if target is None else 1e3 * target
    if path is None:
        if wanted is None and out is not None:
            raise misuse("--out", "is of a plan: give --target.")
        if max_change_per_sample < math.inf:
            raise misuse("--max-change-per-sample", "needs --path.")
        from cdsm.planning.plan import checked_targets, plan_within
        from cdsm.planning.range import range_within
        from cdsm.planning.tension_space import TensionSpace
        from cdsm.support.validation import unit_direction

        pose = options.posture(arm, changes, angles)
        direction_of_tip = unit_direction("direction", u)
        wrench = options.loads_on(pose.arm, load, mass)
        space = TensionSpace(pose, direction_of_tip, minimum, maximum, wrench)
        if wanted is None:
            attainable = range_within(space)
            write_picture(figure, attainable.plot)
            head, numbers = header(pose, [minimum])
            return answer(as_json, numbers | attainable.to_dict(), head, attainable)
        stiffness_target = checked_targets(wanted, ())
        attainable = range_within(space)
        best = plan_within(space, direction_of_tip, stiffness_target)
        write(out, best.write)
        write_picture(figure, lambda: best.plot(attainable))
        head, numbers = header(pose, [minimum], tension=best.tension)
        return answer(
            as_json, numbers | attainable.to_dict() | best.to_dict(), head, attainable, best
        )
    from cdsm.support.format import plural

    if angles is not None:
        raise misuse("--angles", "is of one posture; --path has its own.")
    robot = options.load_arm(arm, changes)
    file = options.read_path(path, robot)
    planned = cdsm.plan_path(
        robot,
        u,
        _one_target(wanted, file.target),
        *(minimum, maximum, options.loads_on(robot, load, mass)),
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


def _one_target(target: float | None, file_target: Array | None) -> float | Array:
    """Return the wanted stiffness [N/m]: that of --target, or of the path (S,)."""
    if target is not None and file_target is None:
        return target
    if target is None and file_target is not None:
        return file_target
    problem = "give it, or a column target [N/mm] in the file of the path; "
    problem += f"{'neither was' if target is None else 'both were'} given."
    raise misuse("--target", problem)

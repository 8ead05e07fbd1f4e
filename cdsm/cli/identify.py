"""``cdsm identify``: find parameters of an arm from loops of weight tests, or plan such tests."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import opt
from cdsm.cli.output import answer, misuse, write_picture

Range = tuple[float, float]

_LOOPS = "A line per reading. Columns: test; joints [deg]; direction (such as -z); force [N]; "
_LOOPS += "displacement [mm] along it (or x, y, z); minimum [N], or a tension per cable [N]."
_FREE = "Parameter to find; repeat it: friction; rigidity (factor on EA); spring [N/mm] in series; "
_FREE += "lead, slack, hole_radius, disk_offset, link_length [mm]; link_mass [g]; joint_stiffness, "
_FREE += "bending_stiffness [N m/rad, N m²]. Default bounds: half to "
_FREE += "twice the arm's own value; friction 0 to 1."


def identify(
    arm: options.Arm,
    loops: Annotated[Path, typer.Argument(metavar="LOOPS.csv", help=_LOOPS)],
    free: Annotated[list[str], opt(_FREE, "NAME[@JOINT][=LOW:HIGH]")],
    displacement_std: Annotated[float, opt("Standard deviation of a reading.", "MM")],
    changes: options.Changes = None,
    minimum: Annotated[float | None, opt("Least tension, if not in LOOPS.csv.", "N")] = None,
    tests: Annotated[
        int | None, opt("Plan the best N tests of LOOPS.csv instead.", "N", min=1)
    ] = None,
    figure: options.Figure = None,
    as_json: options.AsJson = False,
) -> int:
    """Find friction, rigidity and dimensions from weight tests.

    A test applies a force along a direction and removes it, with locked motors. The answer gives
    each parameter with a 95 % interval, and warns of parameters that the tests do not determine.
    """
    from cdsm.identification.experiment_plan import plan_tests
    from cdsm.parameters import ArmParameters
    from cdsm.support.format import aligned

    described = options.read(arm, changes)
    ranges = _ranges(free)
    parameters = ArmParameters(described, tuple(ranges))
    units = {name: parameters.unit(name) for name in ranges}
    labels = {f"{name} [{unit}]" if unit else name: name for name, (unit, _) in units.items()}
    start = {label: parameters.present[name] / units[name][1] for label, name in labels.items()}

    def model_of(**values: float) -> cdsm.Manipulator:
        return parameters(**{labels[at]: x * units[labels[at]][1] for at, x in values.items()})

    read = cdsm.read_loops(
        loops, described, displacement_std=1e-3 * displacement_std, minimum=minimum
    )
    if tests is not None:
        planned = plan_tests(model_of, start, read, tests=tests)
        write_picture(figure, planned.plot)
        return answer(as_json, planned.to_dict(), planned)
    bounds = {at: ranges[name] or _usual(name, start[at]) for at, name in labels.items()}
    inside = all(low <= start[at] <= high for at, (low, high) in bounds.items())
    found = cdsm.identify(model_of, read, bounds, start=start if inside else None)
    intervals = found.confidence()
    write_picture(figure, found.plot)
    rows = [("95 % by the profile of χ²", "from", "to")]
    rows += [(name, f"{low:.4g}", f"{high:.4g}") for name, (low, high) in intervals.items()]
    told = {**found.to_dict(), "interval_95": intervals}
    warnings = [f"warning: {sentence}" for sentence in found.warnings]
    return answer(as_json, told, found, "\n".join(aligned(rows)), warnings=warnings)


def _ranges(free: list[str]) -> dict[str, Range | None]:
    """Return the bounds of each parameter of --free, by name and in its unit; None: the usual."""
    ranges: dict[str, Range | None] = {}
    for each in free:
        name, equals, given = each.partition("=")
        if name in ranges:
            raise misuse("--free", f"{name} is given twice.")
        form = "NAME=LOW:HIGH, such as friction=0:0.5"
        found = options.numbers("--free", given.replace(":", ","), (2,), form) if equals else None
        ranges[name] = (found[0], found[1]) if found else None
    return ranges


def _usual(name: str, value: float) -> Range:
    """Return the default bounds of a parameter of this value: friction 0 to 1, else ½ to twice."""
    if name.partition("@")[0] == "friction":
        return 0.0, 1.0
    if not 0.0 < value < math.inf:
        raise misuse("--free", f"the arm has {name} {value:g}; give bounds, {name}=LOW:HIGH.")
    return value / 2.0, 2.0 * value

"""``cdsm identify``: friction, rigidity and dimensions of an arm from its measurements."""

from __future__ import annotations

import math
import shlex
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import opt
from cdsm.cli.output import answer, misuse, write_picture

if TYPE_CHECKING:
    from cdsm.identification import Identification
    from cdsm.identification.least_squares import Test


Limits = tuple[float, float]

_LOOPS = "A line per reading. Columns: test; joints [deg]; direction (such as -z); force [N]; "
_LOOPS += "displacement [mm] along it (or x, y, z); minimum [N], or a tension per cable [N]; as "
_LOOPS += (
    "examples/data/LOOPS.csv. Without a column test, positions of the tip: x, y, z [mm]; pull "
)
_LOOPS += "[mm] or tension [N] per cable; as examples/data/TIPS.csv, PULLS.csv."
_FREE = "Parameter to find; repeat it: friction; rigidity (factor on EA); spring [N/mm] in series; "
_FREE += "lead, hole_radius, disk_offset, link_length [mm]; link_mass [g]; joint_stiffness, "
_FREE += (
    "bending_stiffness [N m/rad, N m²]; exponent of a spring's law; pulley_radius [mm], added; of "
    "pulls also slack [mm], gain. Default bounds: half to "
)
_FREE += "twice the arm's own value; friction 0 to 1."
_START = (
    "Value from which to seek a parameter, in its unit; repeat it. Default: that of the arm; of a "
)
_START += "friction of 0, 0.1."


def identify_parameters(
    arm: options.ArmArgument,
    readings: Annotated[Path, typer.Argument(metavar="LOOPS.csv|TIPS.csv", help=_LOOPS)],
    free: Annotated[list[str], opt(_FREE, "NAME[@JOINT][=LOW:HIGH]")],
    displacement_std: Annotated[float, opt("Standard deviation of a reading.", "MM")],
    start: Annotated[list[str] | None, opt(_START, "NAME[@JOINT]=VALUE")] = None,
    changes: options.SetOption = None,
    minimum: Annotated[float | None, opt("Least tension, if not in LOOPS.csv.", "N")] = None,
    tests: Annotated[
        int | None, opt("Plan the best N tests of LOOPS.csv instead.", "N", min=1)
    ] = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Find friction, rigidity and dimensions from weight tests or positions of the tip.

    A test applies a force along a direction and removes it, with locked motors; a position of the
    tip belongs to what the motors pulled: after re-stringing, slack and gain. The answer gives
    each parameter with a 95 % interval, and warns of parameters that the tests do not determine.
    """
    from cdsm.arm_parameters import ArmParameters, parameter_of
    from cdsm.identification.experiment_plan import plan_tests
    from cdsm.support.tables import column_names

    described = options.load_arm(arm, changes)
    ranges = _ranges(free)
    by_weights = "test" in column_names(readings)
    for name in ranges:
        if by_weights and not parameter_of(name).acts_under_load:
            raise misuse("--free", f"{name} changes no weight test: positions of the tip show it.")
    for option, value in (("--minimum", minimum), ("--tests", tests)):
        if value is not None and not by_weights:
            raise misuse(option, "is for weight tests; these are positions of the tip.")
    parameters = ArmParameters(described, tuple(ranges))
    units = {name: parameters.unit(name) for name in ranges}
    labels = {f"{name} [{unit}]" if unit else name: name for name, (unit, _) in units.items()}
    starts = _starts(start or [], ranges)
    present = {name: parameters.present[name] / units[name][1] for name in ranges}

    def model_of(**values: float) -> cdsm.Manipulator:
        return parameters(**{labels[at]: x * units[labels[at]][1] for at, x in values.items()})

    std = 1e-3 * displacement_std
    read: Sequence[Test]
    if by_weights:
        loops = cdsm.read_loops(readings, described, displacement_std=std, minimum=minimum)
        if tests is not None:
            expected = {label: (present | starts)[name] for label, name in labels.items()}
            planned = plan_tests(model_of, expected, loops, tests=tests)
            write_picture(figure, planned.plot)
            return answer(as_json, planned.to_dict(), planned)
        if any(loop.displacements is None for loop in loops):
            problem = "has no readings: no column displacement [mm], or x, y, z."
            raise cdsm.FileError(readings, problem)
        read = loops
    else:
        read = cdsm.read_tip_positions(readings, described, std=std)
    bounds = {name: ranges[name] or _usual(name, present[name]) for name in ranges}
    for name, (low, high) in bounds.items():
        size = units[name][1]
        parameters.require_arms(name, size * low, size * high)
        typical = parameters.start(name, size * low, size * high)
        if typical is not None:
            starts.setdefault(name, typical / size)
    identification = cdsm.identify(
        model_of,
        read,
        {label: bounds[name] for label, name in labels.items()},
        start={label: starts[name] for label, name in labels.items() if name in starts},
    )
    write_picture(figure, identification.plot)
    command = ["cdsm", "identify", str(arm), str(readings)]
    for change in changes or ():
        command += ["--set", change]
    command += [] if minimum is None else ["--minimum", f"{minimum:g}"]
    warnings = [
        *identification.warnings,
        *_next_commands(identification, command, [*ranges], bounds, displacement_std),
    ]
    return answer(as_json, identification.to_dict(), identification, warnings=warnings)


def _next_commands(
    identification: Identification,
    command: list[str],
    names: list[str],
    bounds: dict[str, Limits],
    displacement_std: float,
) -> Iterator[str]:
    """Yield the commands that answer the doubts of an identification, each as a sentence.

    ``names`` are those of the parameters, ``bounds`` theirs, ``command`` is without both.
    """
    import numpy as np

    def with_options(
        bounds: dict[str, Limits], std: float = displacement_std, values: Iterable[float] = ()
    ) -> str:
        entries = [*command]
        for name, (low, high) in bounds.items():
            entries += ["--free", f"{name}={low:.6g}:{high:.6g}"]
        for name, value in zip(names, values, strict=False):
            entries += ["--start", f"{name}={value:.6g}"]
        return shlex.join([*entries, "--displacement-std", f"{std:.4g}"])

    wider = dict(bounds)
    for label, side in identification.at_bounds.items():
        name = names[identification.names.index(label)]
        low, high = bounds[name]
        if side == "upper":
            wider[name] = low, high + (high - low)
        elif low > 0.0:  # below 0 no size, stiffness or friction lies
            wider[name] = low / 2.0, high
    if wider != bounds:
        yield f"Next, with wider bounds: {with_options(wider)}"
    elif identification.unfinished:
        values = identification.values.tolist()
        yield f"Next, from there: {with_options(bounds, values=values)}"
    undetermined = np.flatnonzero(np.isinf(identification.std)).tolist()
    doubtful = [*undetermined, *(j for _, j in identification.correlated())]
    if doubtful and len(names) > 1:
        fixed = names[doubtful[0]]
        left = {name: limits for name, limits in bounds.items() if name != fixed}
        yield f"Next, with {fixed} as it is in the arm: {with_options(left)}"
    if not identification.is_explained:
        std = displacement_std * math.sqrt(identification.reduced_chi_square)
        yield (
            f"Next, if {displacement_std:g} mm was a guess and the model is right: "
            f"{with_options(bounds, std)}"
        )


def _ranges(free: list[str]) -> dict[str, Limits | None]:
    """Return the bounds of each parameter of --free, by name and in its unit; None: the usual."""
    ranges: dict[str, Limits | None] = {}
    for entry in free:
        name, equals, limits = entry.partition("=")
        if name in ranges:
            raise misuse("--free", f"{name} is given twice.")
        form = "NAME=LOW:HIGH, such as friction=0:0.5"
        numbers = (
            options.parse_numbers("--free", limits.replace(":", ","), (2,), form)
            if equals
            else None
        )
        ranges[name] = (numbers[0], numbers[1]) if numbers else None
    return ranges


def _starts(start: list[str], names: Collection[str]) -> dict[str, float]:
    """Return the value of each parameter of --start, by name and in its unit."""
    values: dict[str, float] = {}
    for entry in start:
        name, _, value = entry.partition("=")
        if name not in names:
            raise misuse("--start", f"{name} is not free; --free has {', '.join(names)}.")
        if name in values:
            raise misuse("--start", f"{name} is given twice.")
        form = "NAME=VALUE, such as friction=0.1"
        (values[name],) = options.parse_numbers("--start", value, (1,), form)
    return values


def _usual(name: str, value: float) -> Limits:
    """Return the default bounds of a parameter of this value: its usual ones, else ½ to twice."""
    from cdsm.arm_parameters import parameter_of

    parameter = parameter_of(name)
    if parameter.usual is not None:
        size = parameter.unit.shown[1]
        return parameter.usual[0] / size, parameter.usual[1] / size
    if not 0.0 < value < math.inf:
        raise misuse("--free", f"the arm has {name} {value:g}; give bounds, {name}=LOW:HIGH.")
    return value / 2.0, 2.0 * value

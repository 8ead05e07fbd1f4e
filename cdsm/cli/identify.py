"""``cdsm fit | identify | reproduce``: measurements of a wire, of an arm, and of the paper."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import FigureOption, JsonOption, file_opt, opt
from cdsm.cli.output import answer, misuse, write, write_picture

if TYPE_CHECKING:
    from cdsm.identification import Identification
    from cdsm.identification.least_squares import Test

_TEST = "Tensile test, a line per reading. Columns: displacement (or extension, stroke, strain, …) "
_TEST += "[mm] and force (or load) [N], in the order recorded; as examples/data/TEST.csv. With "
_TEST += "--spring, columns angle [deg] and torque [N m], as examples/data/SPRING.csv."
_SPRING = "Fit the law of a joint's spring to torques at angles instead."
_SCALE = (
    "With --spring: angle below which the spring is linear; it is given, not found. Default: 2."
)


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help=_TEST)],
    gauge_length: Annotated[
        float | None, opt("Length of the wire, if not in the file.", "MM")
    ] = None,
    columns: Annotated[str | None, opt("Of displacement (or strain), force.", "NAME,NAME")] = None,
    units: Annotated[str | None, opt("Of both, if the file has none: mm,N.", "UNIT,UNIT")] = None,
    between: Annotated[
        str | None, opt("Forces to fit [N], on the last rise; angles [deg].", "LOW,HIGH")
    ] = None,
    spring: Annotated[bool, opt(_SPRING, None, "--spring")] = False,
    scale: Annotated[float | None, opt(_SCALE, "DEG")] = None,
    out: Annotated[
        Path | None, file_opt("Law, for wire= in ARM.toml.", "FILE.toml", "--out")
    ] = None,
    figure: FigureOption = None,
    as_json: JsonOption = False,
) -> int:
    """Fit the law EA(F) of a wire to its tensile test, or that of a spring to its torques.

    TEST.csv may be the text file of a testing machine: with lines of titles, decimal commas, or a
    line of units.
    """
    limits = [-math.inf, math.inf]
    if between is not None:
        form = f"LOW,HIGH in {'degrees' if spring else 'N'}"
        limits = options.parse_numbers("--between", between, (2,), form)
    if spring:
        _refuse_of_wires(gauge_length=gauge_length, columns=columns, units=units, out=out)
        return _fit_spring(test, scale, limits, figure, as_json)
    if scale is not None:
        raise misuse("--scale", "belongs to --spring.")
    data = cdsm.read_tensile_csv(
        test,
        columns=_pair("--columns", columns),
        units=_pair("--units", units),
        gauge_length=None if gauge_length is None else gauge_length / 1000.0,
    )
    fitted = cdsm.fit_tensile_test(
        data.displacement, data.force, data.gauge_length, between=(limits[0], limits[1])
    )
    write(out, fitted.elasticity.write)
    write_picture(figure, fitted.plot)
    read = {
        "read": data.source,
        "gauge_length_m": data.gauge_length,
        "domain_N": [fitted.elasticity.low, fitted.elasticity.high],
        "stages_N": {stage.name: [stage.low, stage.high] for stage in fitted.stages},
        "relative_uncertainty": fitted.relative_uncertainty(),
        "notes": fitted.notes,
    }
    return answer(as_json, read | fitted.to_dict(), f"{test}: {data.source}\n{fitted}")


def _refuse_of_wires(**given: object) -> None:
    """Refuse options that only tensile tests have."""
    remedies = {
        "gauge_length": "a spring has none",
        "columns": "call the columns angle [deg] and torque [N m]",
        "units": "give them in the header: angle [deg], torque [mN m]",
        "out": "the law of a spring is a line of ARM.toml, which is printed",
    }
    for name, value in given.items():
        if value is not None:
            raise misuse(f"--{name.replace('_', '-')}", f"is not for --spring: {remedies[name]}.")


def _fit_spring(
    test: Path, scale: float | None, limits: list[float], figure: Path | None, as_json: bool
) -> int:
    """Fit the law of a spring; ``scale`` and ``limits`` are in degrees."""
    from cdsm.springs.fit import SCALE
    from cdsm.support.validation import SMALLEST

    angles, torques = cdsm.read_spring_csv(test)
    if scale is not None and scale < math.degrees(SMALLEST):
        raise misuse("--scale", f"{scale:g} given; a positive angle [deg] is needed.")
    if not limits[0] < limits[1]:
        problem = f"{limits[0]:g},{limits[1]:g} given; LOW is below HIGH"
        raise misuse("--between", f"{problem}, both in degrees.")
    a = SCALE if scale is None else math.radians(scale)
    ends = math.radians(limits[0]), math.radians(limits[1])
    fitted = cdsm.fit_spring(angles, torques, scale=a, between=ends)
    write_picture(figure, fitted.plot)
    law = {"law": fitted.law.shape.arguments, "notes": fitted.notes}
    return answer(as_json, law | fitted.to_dict(), f"{test}\n{fitted}")


def _pair(option: str, text: str | None) -> list[str] | None:
    """Split the text of an option at its comma; an entry with a comma has quotes."""
    import csv  # slow to import

    if text is None:
        return None
    entries = [entry.strip() for entry in next(csv.reader([text], skipinitialspace=True), [])]
    if len(entries) != 2:
        raise misuse(option, f"{text!r} given; give two, separated by a comma.")
    return entries


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


_WIDTHS = (34, 20, 20, 20)  # of the columns: the table fits a terminal of 100
_VERDICTS = """\
holds: within a fifth of the paper's number; sign only: the same direction, another size;
misprint: a digit of the paper is wrong. Three numbers are x, y and z."""


def reproduce(
    out: Annotated[Path, opt("Folder; default: reproduction.", "FOLDER")] = Path("reproduction"),
    kind: Annotated[Literal["pdf", "svg", "png"], opt("Of the figures.", None, "--format")] = "png",
    as_json: JsonOption = False,
) -> int:
    """Recompute the figures and numbers of the paper.

    Writes Figs. 3 to 8, 10, 12 and 13, and prints every number of the paper beside ours.
    reproduction.md also has what was assumed, and what other readings of the paper give.
    """
    from cdsm.support.files import make_folder, write_text
    from cdsm.support.format import aligned
    from cdsm.support.progress import show_progress

    paper = cdsm.paper
    make_folder(out)
    results = []
    written = []
    for compute in show_progress(paper.FIGURES.values(), "recomputing the paper"):
        result = compute()
        results.append(result)
        written.append(cdsm.plots.save_figure(result.plot(), out / f"{result.name}.{kind}"))
    written.append(write_text(out / "reproduction.md", paper.to_markdown(results)))
    numbers = paper.to_dict(results)
    text = json.dumps(numbers, indent=1, allow_nan=False)
    written.append(write_text(out / "reproduction.json", f"{text}\n"))
    rows: list[tuple[str, ...]] = [("quantity", "paper", "computed", "verdict")]
    for figure, quantity, printed, computed, _, verdict, *_ in paper.to_rows(results):
        cells = (f"{figure}: {quantity}", printed, computed, verdict)
        pairs = zip(cells, _WIDTHS, strict=True)
        rows += zip_longest(*(wrap(cell, width) for cell, width in pairs), fillvalue="")
    table = "\n".join([*aligned(rows), "", _VERDICTS])
    summary = f"all numbers, and what each is: {out / 'reproduction.md'}"
    return answer(as_json, numbers, table, f"{summary}\nwritten: {', '.join(map(str, written))}")

"""``cdsm fit | identify | reproduce``: measurements of a wire, of an arm, and of the paper."""

from __future__ import annotations

import csv
import json
import math
from itertools import zip_longest
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import FigureOption, JsonOption, file_opt, opt
from cdsm.cli.output import answer, misuse, write, write_picture

_TEST = "Tensile test, a line per reading. Columns: displacement (or extension, stroke, strain, …) "
_TEST += "[mm] and force (or load) [N], in the order recorded; as examples/data/TEST.csv."


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help=_TEST)],
    gauge_length: Annotated[
        float | None, opt("Length of the wire, if not in the file.", "MM")
    ] = None,
    columns: Annotated[str | None, opt("Of displacement (or strain), force.", "NAME,NAME")] = None,
    units: Annotated[str | None, opt("Of both, if the file has none: mm,N.", "UNIT,UNIT")] = None,
    between: Annotated[str | None, opt("Forces to fit [N], on the last rise.", "LOW,HIGH")] = None,
    out: Annotated[
        Path | None, file_opt("Law, for wire= in ARM.toml.", "FILE.toml", "--out")
    ] = None,
    figure: FigureOption = None,
    as_json: JsonOption = False,
) -> int:
    """Fit the law EA(F) of a wire to its tensile test.

    TEST.csv may be the text file of a testing machine: with lines of titles, decimal commas, or a
    line of units.
    """
    limits = [-math.inf, math.inf]
    if between is not None:
        limits = options.parse_numbers("--between", between, (2,), "LOW,HIGH in N")
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
        "notes": fitted.notes,
    }
    return answer(as_json, read | fitted.to_dict(), f"{test}: {data.source}\n{fitted}")


def _pair(option: str, text: str | None) -> list[str] | None:
    """Split the text of an option at its comma; an entry with a comma has quotes."""
    if text is None:
        return None
    entries = [entry.strip() for entry in next(csv.reader([text], skipinitialspace=True), [])]
    if len(entries) != 2:
        raise misuse(option, f"{text!r} given; give two, separated by a comma.")
    return entries


Limits = tuple[float, float]

_LOOPS = "A line per reading. Columns: test; joints [deg]; direction (such as -z); force [N]; "
_LOOPS += "displacement [mm] along it (or x, y, z); minimum [N], or a tension per cable [N]; as "
_LOOPS += "examples/data/LOOPS.csv."
_FREE = "Parameter to find; repeat it: friction; rigidity (factor on EA); spring [N/mm] in series; "
_FREE += "lead, hole_radius, disk_offset, link_length [mm]; link_mass [g]; joint_stiffness, "
_FREE += "bending_stiffness [N m/rad, N m²]. Default bounds: half to "
_FREE += "twice the arm's own value; friction 0 to 1."


def identify_parameters(
    arm: options.ArmArgument,
    loops: Annotated[Path, typer.Argument(metavar="LOOPS.csv", help=_LOOPS)],
    free: Annotated[list[str], opt(_FREE, "NAME[@JOINT][=LOW:HIGH]")],
    displacement_std: Annotated[float, opt("Standard deviation of a reading.", "MM")],
    changes: options.SetOption = None,
    minimum: Annotated[float | None, opt("Least tension, if not in LOOPS.csv.", "N")] = None,
    tests: Annotated[
        int | None, opt("Plan the best N tests of LOOPS.csv instead.", "N", min=1)
    ] = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Find friction, rigidity and dimensions from weight tests.

    A test applies a force along a direction and removes it, with locked motors. The answer gives
    each parameter with a 95 % interval, and warns of parameters that the tests do not determine.
    """
    from cdsm.arm_parameters import ArmParameters
    from cdsm.identification.experiment_plan import plan_tests

    described = options.load_arm(arm, changes)
    ranges = _ranges(free)
    for name in ranges:
        if name.partition("@")[0] in ("slack", "gain"):
            problem = (
                "changes no weight test: positions of the tip show it (in Python, TipPosition)."
            )
            raise misuse("--free", f"{name} {problem}")
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
    if any(loop.displacements is None for loop in read):
        raise cdsm.FileError(loops, "has no readings: no column displacement [mm], or x, y, z.")
    bounds = {at: ranges[name] or _usual(name, start[at]) for at, name in labels.items()}
    for at, (low, high) in bounds.items():
        if not low < start[at] < high:  # of a friction of 0, no derivative shows what it does
            start[at] = (low + high) / 2.0
    identification = cdsm.identify(model_of, read, bounds, start=start)
    write_picture(figure, identification.plot)
    return answer(
        as_json, identification.to_dict(), identification, warnings=identification.warnings
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


def _usual(name: str, value: float) -> Limits:
    """Return the default bounds of a parameter of this value: friction 0 to 1, else ½ to twice."""
    if name.partition("@")[0] == "friction":
        return 0.0, 1.0
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

"""``cdsm fit``: the law of a wire or of a spring from its measurements."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import FigureOption, JsonOption, file_opt, opt
from cdsm.cli.output import answer, misuse, write, write_picture

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

"""``cdsm fit``: fit an elasticity to a tensile test."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import AsJson, Figure, file_opt, opt
from cdsm.cli.output import answer, misuse, write, write_picture


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help="Tensile test to read.")],
    gauge_length: Annotated[
        float | None, opt("Length of the wire, if not in the file.", "MM")
    ] = None,
    columns: Annotated[str | None, opt("Of displacement (or strain), force.", "NAME,NAME")] = None,
    units: Annotated[str | None, opt("Of both, if the file has none: mm,N.", "UNIT,UNIT")] = None,
    between: Annotated[str | None, opt("Forces to fit [N], on the last rise.", "LOW,HIGH")] = None,
    out: Annotated[
        Path | None, file_opt("Law, for wire= in ARM.toml.", "FILE.toml", "--out")
    ] = None,
    figure: Figure = None,
    as_json: AsJson = False,
) -> int:
    """Fit the law EA(F) of a wire to its tensile test.

    TEST.csv may be the text file of a testing machine: with lines of titles, decimal commas, or a
    line of units.
    """
    limits = [-math.inf, math.inf]
    if between is not None:
        limits = options.numbers("--between", between, (2,), "LOW,HIGH in N")
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

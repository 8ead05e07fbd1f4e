"""``cdsm fit``: fit an elasticity to a tensile test."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import AsJson, Figure
from cdsm.cli.output import answer, misuse, write, write_picture


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help="Tensile test to read.")],
    gauge_length: Annotated[
        float | None,
        typer.Option(help="Length of the tested wire [mm]; default: that of the file.", min=0.0),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME",
            help="Columns of displacement (or strain) and force; default: by names in English.",
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(metavar="UNIT,UNIT", help="Their units if the file has none, such as mm,N."),
    ] = None,
    between: Annotated[
        str | None,
        typer.Option(
            metavar="LOW,HIGH",
            help="Smallest and largest force to fit [N], on the last rise that reaches it.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        options.file_option(
            "--out", endings=(".toml",), help="Law to write, for wire= in ARM.toml."
        ),
    ] = None,
    figure: Figure = None,
    as_json: AsJson = False,
) -> int:
    """Fit the rigidity EA(F) of a wire to its tensile test; print a report, write its law.

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
    """Split the text of an option at its comma into two entries; an entry with a comma has quotes."""
    if text is None:
        return None
    entries = [entry.strip() for entry in next(csv.reader([text], skipinitialspace=True), [])]
    if len(entries) != 2:
        raise misuse(option, f"{text!r} given; give two, separated by a comma.")
    return entries

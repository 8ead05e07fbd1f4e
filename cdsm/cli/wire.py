"""``cdsm fit``: fit an elasticity to a tensile test."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.files import Picture, out_option
from cdsm.cli.options import AsJson
from cdsm.cli.output import answer, write, write_picture
from cdsm.cli.values import misuse


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help="Tensile test to read.")],
    gauge_length: Annotated[
        float | None,
        typer.Option(
            help="Length of the tested wire in mm; default: that of the file. A strain needs none.",
            min=0.0,
        ),
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
        typer.Option(
            metavar="UNIT,UNIT",
            help="Units of displacement and force if the file has none, such as mm,N.",
        ),
    ] = None,
    decimal: Annotated[
        str | None,
        typer.Option(metavar=".|,", help="Decimal mark; the other mark then separates thousands."),
    ] = None,
    between: Annotated[
        str | None,
        typer.Option(
            metavar="LOW,HIGH",
            help="Smallest and largest force in N to fit, on the last rise that reaches it.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        out_option(endings=(".toml",), metavar="WIRE.toml", help="Law of rigidity to write."),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Fit the rigidity of a wire to its tensile test; print a report, write its law and a figure.

    TEST.csv may be the text file of a testing machine: with lines of titles, decimal commas, or a
    line of units.
    """
    try:
        low, high = map(float, _pair("--between", between) or ("-inf", "inf"))
    except ValueError:
        raise misuse("--between", f"{between!r} given; give two numbers in N.") from None
    data = cdsm.read_tensile_csv(
        test,
        columns=_pair("--columns", columns),
        units=_pair("--units", units),
        decimal=decimal,
        gauge_length=None if gauge_length is None else gauge_length / 1000.0,
    )
    fitted = cdsm.fit_tensile_test(
        data.displacement, data.force, data.gauge_length, between=(low, high)
    )
    write(out, lambda file: fitted.elasticity.write(file))
    write_picture(figure, fitted.plot)
    read = {
        "read": data.source,
        "gauge_length_m": data.gauge_length,
        "domain_N": [fitted.elasticity.low, fitted.elasticity.high],
        "stages_N": {stage.name: [stage.low, stage.high] for stage in fitted.stages},
        "notes": fitted.notes,
    }
    answer(as_json, lambda: read | fitted.to_dict(), f"{test}: {data.source}\n{fitted}")


def _pair(option: str, text: str | None) -> list[str] | None:
    """Split the text of an option at its comma into two entries; an entry with a comma has quotes.

    Return None if ``text`` is None.
    """
    if text is None:
        return None
    entries = [entry.strip() for entry in next(csv.reader([text], skipinitialspace=True), [])]
    if len(entries) != 2:
        raise misuse(option, f"{text!r} given; give two, separated by a comma.")
    return entries

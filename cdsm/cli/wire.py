"""``cdsm fit``: fit an elasticity to a tensile test."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.files import Picture, file_option, out_option
from cdsm.cli.options import AsJson
from cdsm.cli.output import Json, answer, write, write_picture
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
            help="Columns of displacement (or strain) and force, by name or by number from 1 on; "
            "default: by the names in the header.",
        ),
    ] = None,
    skip: Annotated[int, typer.Option(help="Lines at the top to skip.")] = 0,
    units: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT,UNIT",
            help="Units of displacement and force if the file has none, such as mm,N.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        out_option(endings=(".toml",), metavar="WIRE.toml", help="Law of rigidity to write."),
    ] = None,
    tolerances: Annotated[
        Path | None,
        file_option(
            endings=(".toml",),
            metavar="T.toml",
            help="Tolerances to write: the 95 % band of the rigidity.",
        ),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Fit the rigidity of a wire to its tensile test; print a report, write its law and a figure.

    TEST.csv may be the text file of a testing machine: with lines of titles, names of columns in
    other languages, decimal commas, or a line of units.
    """
    from cdsm.support.progress import progress_bar

    length = None if gauge_length is None else gauge_length / 1000.0
    pairs = _pair("--columns", columns), _pair("--units", units)
    try:
        data = cdsm.read_tensile_csv(
            test, columns=pairs[0], skip=skip, units=pairs[1], gauge_length=length
        )
        with progress_bar("fitting"):
            fitted = cdsm.fit_tensile_test(data.displacement, data.force, data.gauge_length)
    except cdsm.TensileTestError as error:
        raise cdsm.TensileTestError(_as_options(str(error))) from None
    write(tolerances, lambda file: cdsm.Tolerances(rigidity=fitted.tolerance()).write(file))
    write(out, lambda file: fitted.elasticity.write(file))
    write_picture(figure, fitted.plot)
    read = f"{test}: {data.source}"
    answer(as_json, lambda: {"read": data.source, **_numbers(fitted)}, f"{read}\n{fitted}")


def _pair(option: str, text: str | None) -> list[str] | None:
    """Split the text of an option at its comma into two entries; an entry with a comma has quotes.

    Return None if ``text`` is None.
    """
    if text is None:
        return None
    entries = [entry.strip() for entry in next(csv.reader([text], skipinitialspace=True), [])]
    if len(entries) != 2:
        raise misuse(option, f"{text!r} given; give two, of displacement and force.")
    return entries


def _as_options(message: str) -> str:
    """Replace keywords in a message by options, e.g. ``units=('mm', 'N')`` by ``--units mm,N``."""
    message = message.replace("gauge_length= [m]", "--gauge-length [mm]")
    message = re.sub(r"(displacement|force)_unit= or ", "", message)
    message = re.sub(r"as (displacement|force)_unit=", "by --units", message)
    message = re.sub(r"(displacement|force)_unit=", "--units has ", message)

    def option(found: re.Match[str]) -> str:
        return f"--{found[1]} {','.join(entry.strip(chr(39)) for entry in found[2].split(', '))}"

    return re.sub(r"(columns|units)=\(([^)]*)\)", option, message)


def _numbers(fit: cdsm.TensileFit) -> Json:
    return {
        "gauge_length_m": fit.test.gauge_length,
        "domain_N": [fit.elasticity.low, fit.elasticity.high],
        "rms_N": fit.rms,
        "stages_N": {stage.name: [stage.low, stage.high] for stage in fit.stages},
        "tension_N": fit.tensions,
        "rigidity_N": fit.elasticity.rigidity(fit.tensions),
        "rigidity_low_N": fit.band.low,
        "rigidity_high_N": fit.band.high,
        "notes": fit.notes,
    }

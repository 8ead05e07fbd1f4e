"""``cdsm fit``: from a tensile test to an elasticity."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdsm._files import write_file
from cdsm.cli.options import Picture, console, reported
from cdsm.tensile import fit_tensile_test
from cdsm.tensile_data import read_tensile_csv
from cdsm.wire_file import write_elasticity


def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help="Tensile test to read.")],
    gauge_length: Annotated[
        float | None,
        typer.Option(help="Length of the tested wire in mm; default: what the file says."),
    ] = None,
    method: Annotated[str, typer.Option(help="monotone, or polynomial as in the paper.")] = (
        "monotone"
    ),
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Elasticity to write, as TOML.")
    ] = None,
    figure: Picture = None,
) -> None:
    """Fit the rigidity of a wire to its tensile test: report, and if wanted figure and TOML."""
    with reported():
        length = None if gauge_length is None else gauge_length / 1000.0
        data = read_tensile_csv(test, gauge_length=length)
        with console.status("fitting"):
            found = fit_tensile_test(data.displacement, data.force, data.gauge_length, method)
        typer.echo(str(found))
        if out is not None:
            typer.echo(f"written: {write_elasticity(found.elasticity, out)}")
        if figure is not None:
            typer.echo(f"written: {write_file(figure, found.plot().savefig)}")

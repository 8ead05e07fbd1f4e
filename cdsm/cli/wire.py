"""``cdsm fit``: fit an elasticity to a tensile test."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.options import AsJson, Picture
from cdsm.cli.output import Json, answer


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
    as_json: AsJson = False,
) -> None:
    """Fit the rigidity of a wire to its tensile test: report, and if wanted figure and TOML."""
    from cdsm.support.progress import progress_bar

    length = None if gauge_length is None else gauge_length / 1000.0
    data = cdsm.read_tensile_csv(test, gauge_length=length)
    with progress_bar("fitting"):
        fitted = cdsm.fit_tensile_test(data.displacement, data.force, data.gauge_length, method)
    if out is not None:
        typer.echo(f"written: {cdsm.write_elasticity(fitted.elasticity, out)}", err=True)
    if figure is not None:
        from cdsm.support.files import write_file

        typer.echo(f"written: {write_file(figure, fitted.plot().savefig)}", err=True)
    answer(as_json, lambda: _numbers(fitted), fitted)


def _numbers(fit: cdsm.TensileFit) -> Json:
    return {
        "method": fit.method,
        "gauge_length_m": fit.test.gauge_length,
        "domain_N": [fit.elasticity.domain.low, fit.elasticity.domain.high],
        "rms_N": fit.rms,
        "stages_N": {stage.name: [stage.low, stage.high] for stage in fit.stages},
        "tension_N": fit.tensions,
        "rigidity_N": fit.elasticity.rigidity(fit.tensions),
        "rigidity_low_N": None if fit.band is None else fit.band.low,
        "rigidity_high_N": None if fit.band is None else fit.band.high,
        "notes": fit.notes,
    }

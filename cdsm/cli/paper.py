"""``cdsm reproduce``: recompute the paper."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli.options import AsJson

_WIDE = 110
"""Smallest width of the terminal for the table of claims; below it, a claim is a few lines."""


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for the figures and tables.")
    ] = Path("reproduction"),
    kind: Annotated[
        Literal["pdf", "svg", "png"],
        typer.Option("--format", help="Kind of the figures; pdf and svg are vectors."),
    ] = "png",
    as_json: AsJson = False,
) -> None:
    """Recompute Figs. 3 to 8, 10, 12 and 13 of the paper: figures, table and numbers.

    The table is complete, with assumptions and other readings, in reproduction.md.
    """
    from cdsm.support.files import make_folder, write_text
    from cdsm.support.progress import track

    paper = cdsm.paper
    make_folder(out)
    results, written = [], []
    for compute in track(paper.FIGURES.values(), "recomputing the paper"):
        result = compute()
        results.append(result)
        figure = cdsm.plots.plot_paper(result)
        written.append(cdsm.plots.save_figure(figure, out / f"{result.name}.{kind}"))
    written.append(write_text(out / "reproduction.md", paper.to_markdown(results)))
    numbers = json.dumps(paper.to_dict(results), indent=1, allow_nan=False)
    written.append(write_text(out / "reproduction.json", numbers + "\n"))
    if as_json:
        typer.echo(numbers)
        return
    _show(paper.HEADER, paper.to_rows(results))
    typer.echo(paper.EXPLANATION)
    typer.echo("written: " + ", ".join(map(str, written)))


def _show(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on a wide terminal, else a few lines for each row."""
    from rich.console import Console
    from rich.table import Table

    screen = Console()
    if screen.width >= _WIDE:
        table = Table(*header)
        for row in rows:
            table.add_row(*row)
        screen.print(table)
        return
    for figure, quantity, *cells in rows:
        typer.echo(f"{figure}: {quantity}")
        for name, cell in zip(header[2:], cells, strict=True):
            typer.echo(f"    {name:<12} {cell}")

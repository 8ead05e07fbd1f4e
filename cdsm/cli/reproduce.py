"""``cdsm reproduce``: recompute the figures of the paper, and compare their numbers with ours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli.options import AsJson


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Folder for figures and tables.")
    ] = Path("reproduction"),
    kind: Annotated[
        Literal["pdf", "svg", "png"], typer.Option("--format", help="Format of the figures.")
    ] = "png",
    as_json: AsJson = False,
) -> int:
    """Recompute Figs. 3 to 8, 10, 12 and 13 of the paper: figures, table and numbers.

    Prints every number of the paper beside ours. reproduction.md also has what was assumed, and
    what other interpretations of the paper's text give.
    """
    from cdsm.support.files import make_folder, write_text
    from cdsm.support.format import aligned
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
        return 0
    rows = [(f"{row[0]}: {row[1]}", *row[2:5]) for row in paper.to_rows(results)]
    typer.echo("\n".join(aligned([("quantity", *paper.HEADER[2:5]), *rows])))
    typer.echo(f"\nall numbers, and what each is: {out / 'reproduction.md'}")
    typer.echo("written: " + ", ".join(map(str, written)))
    return 0

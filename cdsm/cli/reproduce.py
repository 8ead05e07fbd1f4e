"""``cdsm reproduce``: recompute the figures of the paper, and compare their numbers with ours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli.options import AsJson, opt


def reproduce(
    out: Annotated[Path, opt("Folder; default: reproduction.", "FOLDER")] = Path("reproduction"),
    kind: Annotated[Literal["pdf", "svg", "png"], opt("Of the figures.", None, "--format")] = "png",
    as_json: AsJson = False,
) -> int:
    """Recompute the figures and numbers of the paper.

    Writes Figs. 3 to 8, 10, 12 and 13, and prints every number of the paper beside ours.
    reproduction.md also has what was assumed, and what other readings of the paper give.
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
        written.append(cdsm.plots.save_figure(result.plot(), out / f"{result.name}.{kind}"))
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

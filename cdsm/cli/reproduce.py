"""``cdsm reproduce``: figures and numbers of the paper."""

from __future__ import annotations

import json
from itertools import zip_longest
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Literal

import cdsm
from cdsm.cli.options import JsonOption, opt
from cdsm.cli.output import answer

_WIDTHS = (34, 20, 20, 20)  # of the columns: the table fits a terminal of 100
_VERDICTS = """\
holds: within a fifth of the paper's number; sign only: the same direction, another size;
misprint: a digit of the paper is wrong. Three numbers are x, y and z."""


def reproduce(
    out: Annotated[Path, opt("Folder; default: reproduction.", "FOLDER")] = Path("reproduction"),
    kind: Annotated[Literal["pdf", "svg", "png"], opt("Of the figures.", None, "--format")] = "png",
    as_json: JsonOption = False,
) -> int:
    """Recompute the figures and numbers of the paper.

    Writes Figs. 3 to 8, 10, 12 and 13, and prints every number of the paper beside ours.
    reproduction.md also has what was assumed, and what other readings of the paper give.
    """
    from cdsm.support.files import make_folder, write_text
    from cdsm.support.format import aligned
    from cdsm.support.progress import show_progress

    paper = cdsm.paper
    make_folder(out)
    results = []
    written = []
    for compute in show_progress(paper.FIGURES.values(), "recomputing the paper"):
        result = compute()
        results.append(result)
        written.append(cdsm.plots.save_figure(result.plot(), out / f"{result.name}.{kind}"))
    written.append(write_text(out / "reproduction.md", paper.to_markdown(results)))
    numbers = paper.to_dict(results)
    text = json.dumps(numbers, indent=1, allow_nan=False)
    written.append(write_text(out / "reproduction.json", f"{text}\n"))
    rows: list[tuple[str, ...]] = [("quantity", "paper", "computed", "verdict")]
    for figure, quantity, printed, computed, _, verdict, *_ in paper.to_rows(results):
        cells = (f"{figure}: {quantity}", printed, computed, verdict)
        pairs = zip(cells, _WIDTHS, strict=True)
        rows += zip_longest(*(wrap(cell, width) for cell, width in pairs), fillvalue="")
    table = "\n".join([*aligned(rows), "", _VERDICTS])
    summary = f"all numbers, and what each is: {out / 'reproduction.md'}"
    return answer(as_json, numbers, table, f"{summary}\nwritten: {', '.join(map(str, written))}")

"""``cdsm design``: the best designs of an arm, and the chosen one as files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.options import JsonOption, opt
from cdsm.cli.output import Json, answer, misuse

_CHOOSE = "Design of the front to write; default: the compromise, nearest to the best of each goal."
_CHOOSE += " If the folder has designs already, there is no search."


def design(
    problem: Annotated[
        Path,
        typer.Argument(
            metavar="PROBLEM.toml",
            help="Problem and search (generations, population, seed), as examples/design.toml.",
        ),
    ],
    out: Annotated[Path, opt("Folder for the results.", "FOLDER")],
    choose: Annotated[int | None, opt(_CHOOSE, "N", min=0)] = None,
    as_json: JsonOption = False,
) -> int:
    """Find the best designs of an arm, and write the chosen one.

    The folder gets the Pareto front as table and figure, and the arm with its files. A deflection
    is how far the load moves the tip, to first order, with motors that are locked before it acts.
    """
    from cdsm.batch.distribution import checked_threads
    from cdsm.design.evaluation import Designs
    from cdsm.design.problem_file import read_problem
    from cdsm.design.search import best_of
    from cdsm.support.files import make_folder, write_text

    task, search = read_problem(problem)
    if (out / "arm.toml").exists() and not (out / "front.csv").exists():
        raise misuse("--out", f"{out} has an arm.toml that no search wrote; give another folder.")
    folder = make_folder(out)
    table = folder / "designs.csv"
    if choose is not None and table.exists():
        results = best_of(Designs.read(task, table), search.seed)
    else:
        results = cdsm.search_designs(
            task,
            generations=search.generations,
            population=search.population,
            seed=search.seed,
            jobs=checked_threads(None),
        )
        write_text(table, results.evaluated.to_csv())
    number = results.compromise if choose is None else choose
    front = write_text(folder / "front.csv", results.best.to_csv())
    if number >= (count := len(results.front)):
        designs = f"{number} given, but the front has the designs 0 to {count - 1}. See {front}"
        again = "repeat the command with one of them, which takes no search."
        raise misuse("--choose", f"{designs}, and {again}")
    paths = [
        table,
        front,
        cdsm.plots.save_figure(results.plot(), folder / "front.pdf"),
        cdsm.plots.save_figure(results.arm(number).plot(), folder / "arm.pdf"),
        *results.write_arm(folder, number),
    ]
    names = ", ".join(path.name for path in paths)
    written: Json = {"written": [str(path) for path in paths], "chosen": number}
    summary = f"design {number} is written to {folder}: {names}"
    return answer(as_json, results.to_dict() | written, results.describe(number), summary)

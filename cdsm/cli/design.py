"""``cdsm design``: find the best designs of an arm, and write the chosen one for the workshop."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.options import AsJson, opt
from cdsm.cli.output import Json, answer, misuse

_CHOOSE = "Design of the front to write; default: the compromise, nearest to the best of each goal."
_REFINE = "Improve the chosen design by SLSQP: one objective, continuous variables."


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
    refine: Annotated[bool, opt(_REFINE, None, "--refine")] = False,
    as_json: AsJson = False,
) -> int:
    """Find the best designs of an arm, and write the chosen one.

    The folder gets the Pareto front as table and figure, and the arm with its files. A deflection
    is how far the load moves the tip, to first order, with motors that are locked before it acts.
    """
    from cdsm.batch.inputs import checked_threads
    from cdsm.design.problem_file import read_problem
    from cdsm.design.refine import require_smooth
    from cdsm.support.files import make_folder, write_text
    from cdsm.support.validation import whole_number

    task, search = read_problem(problem)
    if (out / "arm.toml").exists() and not (out / "front.csv").exists():
        raise misuse("--out", f"{out} has an arm.toml that no search wrote; give another folder.")
    if refine:
        require_smooth(task)
    folder = make_folder(out)
    found = cdsm.search_designs(
        task,
        generations=search.generations,
        population=search.population,
        seed=search.seed,
        jobs=checked_threads(None),
    )
    number = found.compromise
    if choose is not None:
        number = whole_number("--choose", choose, 0, len(found.front) - 1)
    every = found.evaluated.to_csv()
    if refine:
        found, number = cdsm.refine_design(task, found.design(number)), 0
    paths = [
        write_text(folder / "designs.csv", every),
        write_text(folder / "front.csv", found.best.to_csv()),
        cdsm.plots.save_figure(found.plot(), folder / "front.pdf"),
        cdsm.plots.save_figure(found.arm(number).plot(), folder / "arm.pdf"),
        *found.write_arm(folder, number),
    ]
    names = ", ".join(path.name for path in paths)
    written: Json = {"written": [str(path) for path in paths], "chosen": number}
    said = f"design {number} is written to {folder}: {names}"
    return answer(as_json, found.to_dict() | written, found._text(number), said)

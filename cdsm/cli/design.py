"""``cdsm design``: find the best designs of an arm, and write the chosen one for the workshop."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli.files import out_folder
from cdsm.cli.options import AsJson
from cdsm.cli.output import answer
from cdsm.cli.values import misuse


def design(
    problem: Annotated[
        Path,
        typer.Argument(
            metavar="PROBLEM.toml", help="The problem; examples/design.toml is one with comments."
        ),
    ],
    out: Annotated[Path, out_folder(help="Folder for the results.")],
    generations: Annotated[
        int | None, typer.Option(help="Generations; default: those of the file, or 40.", min=1)
    ] = None,
    population: Annotated[
        int | None, typer.Option(help="Designs per generation; default: of the file, or 40.", min=4)
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed; default: that of the file, or 0.", min=0)
    ] = None,
    choose: Annotated[
        int | None,
        typer.Option(
            help="Number of the design on the front that is written; default: the compromise, the "
            "nearest to the best of every objective.",
            min=0,
        ),
    ] = None,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine",
            help="Improve the chosen design by SLSQP: one objective, continuous "
            "variables. Only designs.csv still has the designs of the search.",
        ),
    ] = False,
    jobs: Annotated[int | None, typer.Option(help="Processes; default: all cores.", min=1)] = None,
    as_json: AsJson = False,
) -> None:
    """Find the best designs of an arm; write the Pareto front, figures and the chosen arm.

    The deflection is how far the load moves the tip when the motors are locked before it acts. It
    is computed to first order, with the stiffness under the least tensions without the load.
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
    processes = checked_threads(jobs)
    found = cdsm.search_designs(
        task,
        generations=generations or search.generations,
        population=population or search.population,
        seed=search.seed if seed is None else seed,
        jobs=processes,
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
    written = {"written": [str(path) for path in paths], "chosen": number}
    answer(
        as_json,
        lambda: {**found.to_dict(), **written},
        found._text(number),
        f"design {number} is written to {folder}: {names}",
    )

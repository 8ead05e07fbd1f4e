"""Numbers that take minutes to measure: ``python -m docs.measured`` writes docs/measured.json.

The pages show the numbers of that file, with the machine and the date.
"""

import json
import os
import platform
import tempfile
import time
import warnings
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

FILE = Path(__file__).with_suffix(".json")
QUESTIONS = 100_000
POSTURES = 1_000_000


def honesty() -> str:
    """Return the table of wrong answers without a warning, in Markdown."""
    found = _numbers()
    rows = [
        [route, *(f"{count:,}".replace(",", " ") for count in row)]
        for route, *row in found["honesty"]
    ]
    return f"{_about(found)}.\n\n{_table(found['outcomes'], rows)}"


def costs() -> str:
    """Return the tables of run times, in Markdown."""
    found = _numbers()
    rows = [[f"{cell:.3g}" for cell in row] for row in found["microseconds"]]
    sweep = found["sweep"]
    return (
        f"{_about(found)}. Microseconds a posture, the best of several rounds: "
        "$K_\\theta$ under given tensions, then least tensions.\n\n"
        f"{_table(found['columns'], rows)}\n\n"
        f"{sweep['postures']:,} random postures of the virtual prototype (tensions, tip, "
        f"stiffness, margin) go into a store in {sweep['seconds']:.0f} s, in "
        f"{sweep['megabytes']:.0f} MB on disk."
    )


def _numbers() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def _about(found: dict[str, Any]) -> str:
    return f"Measured with cdsm {found['version']} on {found['machine']}"


def _table(header: list[str], rows: list[list[str]]) -> str:
    lines = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def measure() -> dict[str, Any]:
    """Measure everything; some ten minutes on a machine that does nothing else."""
    import cdsm
    from tests.benchmarks import honesty as asked

    os.environ["PYTHONWARNINGS"] = "ignore::UserWarning"  # random arms may share holes
    warnings.simplefilter("ignore", cdsm.CdsmWarning)
    from tests.benchmarks.test_table import COLUMNS, ROWS, cost, machine, runs
    from tests.benchmarks.verdicts import Outcome

    where = machine()
    microseconds = [[n, *(cost(*run) for run in runs(n, rows))] for n, rows in ROWS.items()]
    tally = asked.count(QUESTIONS, seed=0, processes=2)
    routes = list(dict.fromkeys((*asked.TENSION, *asked.STIFFNESS)))
    counts = [
        [route, *(tally.total(route, outcome, "") for outcome in (None, *Outcome))]
        for route in routes
    ]
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder, "map.zarr")
        arm = cdsm.presets.virtual_prototype()
        options: dict[str, Any] = {"minimum": 50.0, "progress": False}
        cdsm.sweep(arm, cdsm.RandomPoses(64), **options)  # compile, or load
        start = time.perf_counter()
        cdsm.sweep(arm, cdsm.RandomPoses(POSTURES), store=store, **options)
        took = time.perf_counter() - start
        size = sum(path.stat().st_size for path in store.rglob("*") if path.is_file())
    return {
        "version": cdsm.__version__,
        "machine": f"{where}, Python {platform.python_version()}, numpy {np.__version__}",
        "date": str(date.today()),
        "columns": ["joints", *COLUMNS],
        "microseconds": microseconds,
        "outcomes": ["route", "asked", *(each.value for each in Outcome)],
        "honesty": counts,
        "sweep": {"postures": POSTURES, "seconds": took, "megabytes": size / 1e6},
    }


if __name__ == "__main__":
    FILE.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")

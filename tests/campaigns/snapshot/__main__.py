"""Writes and compares; see :mod:`tests.campaigns.snapshot`."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from tests.campaigns.snapshot.comparison import compare
from tests.campaigns.snapshot.entries import Entries, clean
from tests.campaigns.snapshot.environment import FIXED, cdsm
from tests.campaigns.snapshot.jobs import JOBS, SLOW


def run(name: str) -> Entries:
    """Do a job in a folder of its own; what it raises, and what it warns of, are answers too."""
    found, home = Entries(), os.getcwd()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        os.chdir(folder)
        try:
            for each, value in JOBS[name]():
                if isinstance(value, Entries):
                    found.texts |= {f"{each}{key}": text for key, text in value.texts.items()}
                    found.arrays |= {f"{each}{key}": part for key, part in value.arrays.items()}
                else:
                    found.add(each, value)
        except Exception as error:
            found.add("CRASHED", f"{type(error).__name__}: {error}")
        finally:
            said = {clean(f"{each.category.__name__}: {each.message}") for each in warned}
            os.chdir(home)
    found.add("warnings", "\n".join(sorted(said)))
    return found


def write(folder: Path, chosen: Iterable[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    print(f"cdsm in {Path(cdsm.__file__).parent}")
    total = 0
    for name in chosen:
        start = time.perf_counter()
        found = run(name)
        np.savez(folder / f"{name}.npz", **found.arrays)
        text = json.dumps(found.texts, indent=0, ensure_ascii=True)
        (folder / f"{name}.json").write_text(text + "\n")
        count = len(found.texts) + len(found.arrays)
        total += count
        crash = f"  CRASHED: {found.texts['CRASHED']}" if "CRASHED" in found.texts else ""
        print(f"{name:<36}{count:>8}{time.perf_counter() - start:>8.1f} s{crash}", flush=True)
    print(f"{total} entries")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.snapshot")
    actions = parser.add_subparsers(dest="action", required=True)
    writing = actions.add_parser("write", help="write all answers of the tree in this folder")
    writing.add_argument("folder", type=Path)
    writing.add_argument("--tree", default=os.getcwd(), help="a checkout that is not this one")
    writing.add_argument("--all", action="store_true", help="the slow jobs too")
    writing.add_argument("--only", nargs="+", metavar="JOB", help="only jobs that begin so")
    comparing = actions.add_parser("compare", help="compare what two trees have answered")
    comparing.add_argument("first", type=Path)
    comparing.add_argument("second", type=Path)
    comparing.add_argument("--tolerance", type=float, default=0.0, metavar="RELATIVE")
    given = parser.parse_args()
    if given.action == "compare":
        raise SystemExit(compare(given.first, given.second, given.tolerance) > 0)
    wanted = {**os.environ, **FIXED, "CDSM_TREE": str(Path(given.tree).resolve())}
    if wanted != os.environ:
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], wanted)
    for module in ("studies", "problems", "values", "commands"):  # which name the jobs
        importlib.import_module(f"tests.campaigns.snapshot.{module}")
    chosen = [name for name in JOBS if given.all or name not in SLOW]
    if given.only:
        chosen = [name for name in JOBS if name.startswith(tuple(given.only))]
    write(given.folder.resolve(), chosen)


if __name__ == "__main__":
    main()

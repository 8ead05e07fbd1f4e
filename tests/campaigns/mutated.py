"""Files by the hundred thousand, each spoilt a little: what became of them, counted to the end.

python -m tests.campaigns.mutated [--files 100000] [--seed 0] [--processes 2]
                                  [--readers geometry urdf …]

Each is to be refused with an error of the library's own, or read. A fault does not stop the count.
Processes of 1 GB each read them, so that a file that ends Python, as one might that the C library
of NetCDF stumbles over, is told and counted, too. ``--block READER:SEED:FILES`` reads some again.
"""

import argparse
import faulthandler
import gc
import json
import math
import random
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from tests.campaigns.hostile import MUTATIONS, READERS, limit_memory, outcome, shuffled, whole_files
from tests.support.patience import HANGS

SLOW = {"store": 20, "store of an array": 20, "netcdf": 10}
"""By how much less of some there are: each takes as much longer to read as a text."""

BLOCK = 1000
"""Files of a text that one process reads."""


def spoilt(name: str, folder: Path, files: int, seed: int) -> Iterator[str]:
    """What became of so many files, one after the other; each is left there until the next."""
    path = folder / READERS[name].file
    whole, rng = path.read_bytes(), random.Random(f"{name} {seed}")
    # what is not text has no numbers or lines
    every = (shuffled,) if name == "netcdf" else tuple(MUTATIONS.values())
    for i in range(files):
        path.write_bytes(every[i % len(every)](whole, rng))
        try:
            yield outcome(READERS[name], path)
        except Exception as error:
            yield f"FAULT {type(error).__name__}: {str(error)[:300]}"
    path.write_bytes(whole)
    gc.collect()  # zarr leaves failed tasks, which Python tells of when it finds them


def _block(name: str, seed: int, files: int) -> None:
    """Read one block, and tell what became of each file on a line of its own."""
    warnings.simplefilter("error")
    with tempfile.TemporaryDirectory() as folder:
        whole_files(Path(folder))
        limit_memory()
        faulthandler.dump_traceback_later(HANGS, exit=True)
        for result in spoilt(name, Path(folder), files, seed):
            print(json.dumps(result), flush=True)
            faulthandler.dump_traceback_later(HANGS, exit=True)
        faulthandler.cancel_dump_traceback_later()


def read(name: str, seed: int, files: int) -> Counter[str]:
    """What became of a block of files, read by a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.campaigns.mutated", "--block", f"{name}:{seed}:{files}"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    counts = Counter(json.loads(line) for line in done.stdout.splitlines())
    if missing := files - counts.total():
        end = done.stderr[-1500:]
        counts[f"FAULT: Python ended with {done.returncode}, block {seed}: {end}"] += 1
        counts["not tried after a crash"] += missing - 1
    return counts


def told(counts: dict[str, Counter[str]]) -> str:
    """What became of the files, a line for every reader."""
    lines = []
    for name, each in [*counts.items(), ("all", sum(counts.values(), Counter[str]()))]:
        faults = sum(count for what, count in each.items() if what.startswith("FAULT"))
        rest = {what: n for what, n in sorted(each.items()) if not what.startswith("FAULT")}
        lines.append(f"{name}: {each.total()} files, {faults} faults, {rest}")
    return "\n".join(lines)


def main() -> None:
    """Count, or read one block again."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.mutated")
    parser.add_argument("--files", type=int, default=100_000, help="of all readers together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--readers", nargs="+", choices=list(READERS))
    parser.add_argument("--block", metavar="READER:SEED:FILES", help="read these again, in sight")
    chosen = parser.parse_args()
    if chosen.block:
        name, seed, files = chosen.block.split(":")
        _block(name, int(seed), int(files))
        return
    names = chosen.readers or list(READERS)
    share = sum(1.0 / SLOW.get(name, 1) for name in names)
    blocks = math.ceil(chosen.files / (BLOCK * share))
    counts = {name: Counter[str]() for name in names}
    console = Console()
    with ThreadPoolExecutor(chosen.processes) as pool, Progress(console=console) as progress:
        running = {
            pool.submit(read, name, 10_000 * chosen.seed + k, BLOCK // SLOW.get(name, 1)): name
            for k in range(blocks)
            for name in names
        }
        bar = progress.add_task("files", total=len(running))
        try:
            for future in as_completed(running):
                name, found = running[future], future.result()
                counts[name] += found
                for what in found:
                    if what.startswith("FAULT"):
                        progress.console.print(f"{name} {what}", markup=False, soft_wrap=True)
                progress.advance(bar)
        except KeyboardInterrupt:  # what was counted so far is still of interest
            pool.shutdown(cancel_futures=True)
    print(told(counts))
    total = sum(counts.values(), Counter[str]())
    raise SystemExit(any(what.startswith("FAULT") for what in total))


if __name__ == "__main__":
    main()

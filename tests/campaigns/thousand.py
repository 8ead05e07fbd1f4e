"""Arms by the thousand: what becomes of each, counted to the end.

python -m tests.campaigns.thousand [--arms 10000] [--seed 0] [--processes 2]
                                   [--kinds uniform mixed …]

Every arm is brought before all checks of :mod:`tests.campaigns.verified`. A fault does not
stop the count: it is told with the number of the arm, and ``--again KIND:NUMBER`` tries that arm
alone and shows the traceback. Processes of their own try the arms block by block, so that one that
crashes Python, or hangs, is told, too.
"""

import argparse
import faulthandler
import json
import math
import os
import subprocess
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import HypothesisException
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

import cdsm
from cdsm.support.values import Array
from tests.campaigns import verified
from tests.support import strategies
from tests.support.patience import HANGS

LOADED = 8
"""Of so many arms one is also brought to rest, one weighed, one buckled and one simulated: each
takes as long as all the rest."""

BLOCK = 400
"""Arms that one process tries."""

PLAIN = settings(database=None, deadline=None, suppress_health_check=list(HealthCheck))
chances = st.integers(0, 2**32 - 1)

FAULTS = ("wrong", "warned", "crashed")


def outcome(question: strategies.Question, tension: Array, chance: int) -> str:
    """What became of an arm: ``answered``, or where it was refused and by which error.

    Args:
        question: The arm, and what it is to hold.
        tension: Other tensions, which balance nothing (C,) [N].
        chance: Seed of what is random in the checks.

    Raises:
        AssertionError: A number is wrong. Anything else that is no CdsmError is a crash.
    """
    rng = np.random.default_rng(chance)
    arm, q, low, high, wrench = question
    stage = "at"
    try:
        pose = arm.at(q)
        verified.finite(pose)
        sure = verified.derivatives(pose, rng)
        verified.travels(arm, pose)
        stage = "stiffness of given tensions"
        K = cdsm.stiffness(pose, tension, wrench)
        verified.finite(K)
        sure &= verified.stiff(K, rng)
        stage = "distribute_tension"
        try:
            pull = cdsm.distribute_tension(pose, low, high, wrench)
        except cdsm.InfeasibleTension as error:
            lows = np.maximum(low, [cable.minimum for cable in arm.cables])
            highs = np.minimum(high, [cable.maximum for cable in arm.cables])
            verified.infeasible(pose, lows, highs, wrench, error)
            raise
        verified.finite(pull)
        verified.least(pull)
        stage = "stiffness"
        K = cdsm.stiffness(pose, pull)
        verified.finite(K)
        sure &= verified.stiff(K, rng)
        verified.batched(arm, q, low, high, wrench, K)
        chosen = chance % LOADED
        stage = ("equilibrium", "weight_test", "critical_tension", "to_mjcf", "")[min(chosen, 4)]
        if chosen == 0:
            verified.at_rest(pull, wrench + rng.normal(size=6) * 0.01 * abs(wrench).max())
        elif chosen == 1:
            verified.weighed(pull, K)
        elif chosen == 2:
            verified.buckles(pose, wrench)
        elif chosen == 3:
            verified.simulated(pull)
    except cdsm.CdsmError as error:
        verified.told(error, arm)
        if stage in ("at", "distribute_tension", "stiffness") and not isinstance(
            error, cdsm.InvalidInput
        ):
            verified.batched(arm, q, low, high, wrench, error)
        return f"{stage}: {type(error).__name__}"
    return "answered" if sure else "answered, derivatives unresolved"


def drawn(data: st.DataObject, kind: str) -> str:
    """What became of an arm of a kind, drawn with all that is asked of it."""
    faulthandler.dump_traceback_later(HANGS, exit=True)
    try:
        with warnings.catch_warnings(action="error"):
            # cables may share a hole, lengths may be extreme
            warnings.simplefilter("ignore", cdsm.CdsmWarning)
            question = data.draw(strategies.questions(strategies.ARMS[kind]))
            tension = data.draw(strategies.tensions(question.arm))
            return outcome(question, tension, data.draw(chances))
    finally:
        faulthandler.cancel_dump_traceback_later()


def tried(kind: str, arms: int) -> Counter[str]:
    """What became of so many arms of a kind, always the same; a fault is shrunk and raised."""
    counts: Counter[str] = Counter()

    @settings(PLAIN, max_examples=arms, derandomize=True)
    @given(st.data())
    def each(data: st.DataObject) -> None:
        counts[drawn(data, kind)] += 1

    each()
    return counts


# --- counting -------------------------------------------------------------------------------


def numbered(kind: str, number: int) -> str:
    """What became of the arm of this number, which owes nothing to any other."""
    found: list[str | Exception] = []

    @seed(number)
    @settings(PLAIN, max_examples=2, phases=(Phase.generate,))
    @given(chances, st.data())
    def each(first: int, data: st.DataObject) -> None:
        if not first:  # hypothesis begins with the simplest there is, the same for all seeds
            return
        try:
            found.append(drawn(data, kind))
        except HypothesisException:  # nothing to try: it draws another one
            raise
        except Exception as error:
            found.append(error)

    each()
    if isinstance(found[-1], Exception):
        raise found[-1]
    return found[-1]


def _block(kind: str, start: int, arms: int) -> None:
    """Try one block, and tell what became of each arm on a line of its own."""
    for number in range(start, start + arms):
        line = ""
        try:
            result = numbered(kind, number)
        except Exception as error:
            result = "crashed"
            if isinstance(error, AssertionError):
                result = "wrong"
            elif isinstance(error, Warning):
                result = "warned"
            last = traceback.extract_tb(error.__traceback__)[-1]
            line = f"{type(error).__name__} in {last.name}, {last.lineno}: {str(error)[:400]}"
            traceback.print_exception(error)
        print(json.dumps([number, result, line]), flush=True)


def _in_a_process(kind: str, start: int, arms: int) -> tuple[Counter[str], list[str]]:
    """What became of a block of arms, and its faults in words."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.campaigns.thousand", "--again", f"{kind}:{start}:{arms}"],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    counts = Counter(result for _, result, _ in lines)
    faults = [f"{kind}:{number} {result}: {line}" for number, result, line in lines if line]
    if missing := arms - len(lines):
        counts += Counter({"crashed": 1, "not tried after a crash": missing - 1})
        end = f"Python ended with {done.returncode}: {done.stderr[-1500:]}"
        faults.append(f"{kind}:{start + len(lines)} crashed: {end}")
    return counts, faults


def table(counts: dict[str, Counter[str]]) -> Table:
    """Of every kind the arms tried, answered, refused and at fault, and the refusals by name."""
    shown = Table("", *counts, "all")
    total = sum(counts.values(), Counter[str]())
    columns = [*counts.values(), total]

    def row(name: str, chosen: Callable[[str], bool], style: str = "") -> None:
        sums = [sum(n for what, n in each.items() if chosen(what)) for each in columns]
        shown.add_row(name, *map(str, sums), style=style)

    row("arms tried", lambda what: not what.startswith("not tried"), "bold")
    row("answered", lambda what: what.startswith("answered"), "bold")
    row("refused", lambda what: ": " in what, "bold")
    for fault in FAULTS:
        row(fault, lambda what, fault=fault: what == fault, "bold")  # type: ignore[misc]
    shown.add_section()
    for name in sorted(set(total) - set(FAULTS)):
        row(name, lambda what, name=name: what == name)  # type: ignore[misc]
    return shown


def main() -> None:
    """Count, or try one block again."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaigns.thousand")
    parser.add_argument("--arms", type=int, default=10_000, help="of all kinds together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--kinds", nargs="+", choices=list(strategies.ARMS))
    parser.add_argument("--again", metavar="KIND:NUMBER[:ARMS]", help="try these, in sight")
    chosen = parser.parse_args()
    if chosen.again:
        kind, start, *arms = chosen.again.split(":")
        _block(kind, int(start), int(*arms or [1]))
        return
    kinds = chosen.kinds or list(strategies.ARMS)
    blocks = math.ceil(chosen.arms / (BLOCK * len(kinds)))
    counts = {kind: Counter[str]() for kind in kinds}
    console = Console()
    with ThreadPoolExecutor(chosen.processes) as pool, Progress(console=console) as progress:
        bar = progress.add_task("arms", total=blocks * len(kinds) * BLOCK)
        running = {
            pool.submit(_in_a_process, kind, 1_000_000 * chosen.seed + k * BLOCK, BLOCK): kind
            for k in range(blocks)
            for kind in kinds
        }
        try:
            for future in as_completed(running):
                found, faults = future.result()
                counts[running[future]] += found
                for fault in faults:
                    progress.console.print(fault, markup=False, soft_wrap=True)
                progress.advance(bar, BLOCK)
        except KeyboardInterrupt:  # what was counted so far is still of interest
            pool.shutdown(cancel_futures=True)
    console.print(table(counts))
    total = sum(counts.values(), Counter[str]())
    raise SystemExit(any(total[fault] for fault in FAULTS))


if __name__ == "__main__":
    main()

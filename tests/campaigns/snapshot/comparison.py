"""Answers of two trees, compared bit by bit."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.entries import Entries, attempt


def read(folder: Path, name: str) -> Entries:
    found = Entries()
    found.texts = json.loads((folder / f"{name}.json").read_text())
    with np.load(folder / f"{name}.npz") as arrays:
        found.arrays = dict(arrays)
    return found


_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def differences(first: Entries, second: Entries, tolerance: float = 0.0) -> Iterator[str]:
    """A line or more for each entry that differs.

    Numbers, of texts as well, may differ by ``tolerance`` times the largest beside them.
    """
    one, other = ({**each.texts, **each.arrays} for each in (first, second))
    for name in [*one, *(name for name in other if name not in one)]:
        if name not in other or name not in one:
            yield f"{name}: only in the {'first' if name in one else 'second'}"
        elif tolerance and _close(one[name], other[name], tolerance):
            continue
        elif isinstance(one[name], str) and isinstance(other[name], str):
            if one[name] != other[name]:
                yield f"{name}: {_texts(one[name], other[name])}"
        elif said := _arrays(np.asarray(one[name]), np.asarray(other[name])):
            yield f"{name}: {said}"


def _close(one: Any, other: Any, tolerance: float) -> bool:
    if isinstance(one, str) and isinstance(other, str):
        if _NUMBER.sub("#", one) != _NUMBER.sub("#", other):
            return False
        one, other = (np.array(_NUMBER.findall(each), dtype=float) for each in (one, other))
    if np.shape(one) != np.shape(other) or np.asarray(one).dtype != np.float64:
        return False
    one, other = np.ravel(one), np.ravel(other)
    size = np.max(abs(one[np.isfinite(one)]), initial=0.0)
    return np.allclose(one, other, rtol=0.0, atol=tolerance * size, equal_nan=True)


def _texts(one: str, other: str) -> str:
    numbers = [
        attempt(float, re.sub(r"^np\.float64\((.*)\)$", r"\1", each)) for each in (one, other)
    ]
    if all(isinstance(number, float) for number in numbers):
        return _arrays(*map(np.asarray, numbers)) or f"{one} became {other}"
    lines = list(difflib.unified_diff(one.splitlines(), other.splitlines(), lineterm="", n=1))[2:]
    more = [f"… {len(lines) - 14} lines more"] if len(lines) > 14 else []
    return "\n    ".join(["text", *(line[:300] for line in lines[:14]), *more])


def _arrays(one: Any, other: Any) -> str:
    """How two arrays differ, or nothing if not in a bit."""
    if one.dtype != other.dtype or one.shape != other.shape:
        return f"{one.dtype} {one.shape} became {other.dtype} {other.shape}"
    if one.tobytes() == other.tobytes():
        return ""
    if one.dtype != np.float64:
        return f"{np.count_nonzero(one != other)} of {one.size} {one.dtype} differ"
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    if same.all():
        return "signs of zeros or NaNs differ"
    a, b = one[~same], other[~same]
    with np.errstate(all="ignore"):
        gap = abs(a - b)
        relative = gap / np.maximum(abs(a), abs(b))
        last = gap / np.spacing(np.maximum(abs(a), abs(b)))
    bits = f"last bits only, {last.max():.0f} units" if last.max() <= 16 else "MORE than last bits"
    return (
        f"{a.size} of {one.size} numbers differ, by up to {gap.max():.3g}, "
        f"relative {relative.max():.3g}: {bits}"
    )


def compare(first: Path, second: Path, tolerance: float) -> int:
    """Print what differs, and return how many entries do."""
    jobs = [{path.stem for path in folder.glob("*.json")} for folder in (first, second)]
    count = total = 0
    for name in sorted(jobs[0] ^ jobs[1]):
        print(f"{name}: only in {first if name in jobs[0] else second}")
        count += 1
    for name in sorted(jobs[0] & jobs[1]):
        one, other = read(first, name), read(second, name)
        total += len(one.texts) + len(one.arrays)
        for said in differences(one, other, tolerance):
            print(f"{name}: {said}")
            count += 1
    print(f"{total} entries compared, {count} differ")
    return count

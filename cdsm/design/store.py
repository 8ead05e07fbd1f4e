"""Record of the designs that a search has evaluated, so that a stopped search can resume.

The file has one line for the problem and one for each design. Numbers are written exactly, with all
bits. A search with the same seed asks for the same designs again, and gets the recorded results.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from cdsm.design.evaluation import Compute
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Found
from cdsm.errors import FileError, StoreError
from cdsm.support.files import as_path
from cdsm.support.values import Array
from cdsm.sweeps.description import attributes_of
from cdsm.sweeps.poses import poses_of

_MEANING = "deflection: without the load; all: held postures"
"""How some quantities are defined; a store written under other definitions is not resumed."""


class Store:
    """Record of evaluated designs; a design is found by the exact bits of its numbers.

    Args:
        path: The file; None keeps them in memory.
        problem: The problem.
        search: Other numbers on which the designs of a search depend, such as its seed.

    Raises:
        FileError: The file cannot be read or written.
        StoreError: The file has designs of another problem or another search.
    """

    def __init__(
        self, path: str | os.PathLike[str] | None, problem: DesignProblem, **search: int
    ) -> None:
        self._path: Path | None = None if path is None else as_path(path)
        self._found: dict[bytes, Found] = {}
        if self._path is None:
            return
        head = json.dumps({"problem": digest(problem), "of": str(problem), **search})
        try:
            if not self._path.exists():
                self._path.write_text(head + "\n", encoding="utf-8")
            self._read(self._path.read_text(encoding="utf-8"), head)
        except FileError:
            raise
        except (OSError, ValueError) as error:
            raise FileError(self._path, f"cannot be used as a record: {error}.") from None

    def _read(self, text: str, head: str) -> None:
        assert self._path is not None
        first, *lines = text.split("\n")
        if first != head:
            raise StoreError(
                self._path,
                "contains designs of another problem, of another seed or population, of an older "
                "cdsm, or no designs. Give another place for the results, or search as that time.",
            )
        for number, line in enumerate(lines[:-1], start=2):  # the last one is empty, or was cut off
            try:
                entry: dict[str, Any] = json.loads(line)
                row, values = (np.array([float.fromhex(x) for x in entry[k]]) for k in ("at", "is"))
            except (ValueError, KeyError, TypeError):
                raise FileError(
                    self._path,
                    f"line {number} is no record of a design; delete it, and that design is "
                    "computed again.",
                ) from None
            self._found[row.tobytes()] = Found(values, entry.get("fault", ""))
        if lines[-1]:
            whole = "\n".join([first, *lines[:-1], ""])
            self._path.write_text(whole, encoding="utf-8")

    def evaluated(self, designs: Array, compute: Compute) -> list[Found]:
        """Return the evaluations of designs (D, n); compute and record those that are new."""
        new = {row.tobytes(): row for row in designs if row.tobytes() not in self._found}
        if new:
            rows = np.array([*new.values()])
            self._add(rows, compute(rows))
        return [self._found[row.tobytes()] for row in designs]

    def _add(self, rows: Array, found: Iterable[Found]) -> None:
        lines = []
        for row, each in zip(rows, found, strict=True):
            self._found[row.tobytes()] = each
            entry: dict[str, Any] = {
                name: [x.hex() for x in numbers.tolist()]
                for name, numbers in (("at", row), ("is", each.values))
            }
            lines.append(json.dumps(entry | ({"fault": each.fault} if each.fault else {})))
        if self._path is not None:
            try:
                with self._path.open("a", encoding="utf-8") as file:
                    file.write("\n".join([*lines, ""]))
            except OSError as error:
                raise FileError(self._path, f"cannot be written: {error}.") from None


def digest(problem: DesignProblem) -> str:
    """Return a hash (SHA-256) of everything on which the quantities of a problem depend."""
    poses = poses_of(problem.arm, problem.postures)
    rest = [each.name for each in fields(problem) if each.name not in ("arm", "postures", "loads")]
    parts = [
        json.dumps(attributes_of(problem.arm)),
        repr([getattr(problem, name) for name in rest]),
        repr(problem.arm.gravity.tolist()),
        poses.description,
    ]
    data = "\n".join([*parts, _MEANING]).encode() + problem.postures_of(problem.arm).tobytes()
    data += problem.loads.tobytes()
    return hashlib.sha256(data).hexdigest()

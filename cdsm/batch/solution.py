"""Rows of a batch, computed in chunks by several threads, by compiled kernels or by numpy.

The arguments are already checked. A row is a posture, possibly of a variant of the arm. What numpy
computes is the source of the kernels, loaded without the compiler.
"""

from __future__ import annotations

import hashlib
import importlib.util
import logging
import os
import platform
import sys
import threading
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import numpy as np

from cdsm.batch.chunk import Chunk
from cdsm.batch.quantities import Codes, shapes_of
from cdsm.batch.rows import ArmRows, Body, rows_of
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array

Springs = Callable[[Array, Array, slice], Array]

# numbers of the poses of a chunk, compiled and by numpy, where a chunk has one block; 64 postures
# side by side are fastest, or 32 of long arms
_CACHE = 2**19
_WIDE = 2**21

PATIENCE = 20.0
"""Seconds that numpy may take for all batches of a process before the kernels are compiled."""

_SECONDS = 1e-7  # that numpy takes for a number of a pose, with all that follows from it

_log = logging.getLogger("cdsm")
_lock = threading.Lock()
_spent = 0.0


def kernels_for(arm: ArmRows, count: int) -> ModuleType:
    """Return the kernels for ``count`` more postures, compiled if they are or if it pays."""
    global _spent
    with _lock:
        _spent += _SECONDS * arm.size * count
        if _spent < PATIENCE and not (compiled.cache_info().currsize or _is_kept()):
            return plain()
        return compiled()


def compile_ahead() -> None:
    """Compile all kernels, unless numba has kept them on disk."""
    from cdsm import kernels
    from cdsm.presets import virtual_prototype

    arm = virtual_prototype()
    F = np.full((1, len(arm.cables)), 50.0)
    rows = Rows(
        arm=arm,
        q=np.full((1, arm.nv), 0.1),
        wrench=np.zeros((1, 6)),
        names=("along",),
        bounds=(F, np.full_like(F, np.inf)),
        directions=np.eye(3),
    )
    with np.errstate(all="ignore"):
        Chunk(rows, kernels, slice(1), 1, np.zeros(1, np.uint8), {}).quantities()
    _keep_record()


@cache
def compiled() -> ModuleType:
    """Import the compiled kernels, and compile those that numba has not kept."""
    from cdsm import kernels

    if not _is_kept():
        _log.warning("compiling the kernels of batches, once on this machine: half a minute")
    compile_ahead()
    return kernels


@cache
def plain() -> ModuleType:
    """Load the kernels once more, without the compiler."""
    name = "cdsm._plain_kernels"
    spec = importlib.util.spec_from_file_location(name, _source())
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    module.__dict__["COMPILED"] = False
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@cache
def _is_kept() -> bool:
    """Whether numba has kept all kernels on disk, for this source, version and machine."""
    record = _record()
    try:
        return record is not None and record.read_text(encoding="utf-8") == _stamp()
    except OSError:
        return False


def _keep_record() -> None:
    """Write down that all kernels are compiled and kept."""
    record = _record()
    if record is not None:
        with suppress(OSError):  # then another process asks numba again
            record.parent.mkdir(parents=True, exist_ok=True)
            record.write_text(_stamp(), encoding="utf-8")


def _record() -> Path | None:
    """Return the file that says what is kept; None if numba keeps nothing.

    The file is ours, in the folder that numba uses: what numba itself writes there has private
    names, and may be of another clone, interpreter or machine.
    """
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or _source().parent / "__pycache__")
    if not folder.is_dir() and not os.access(folder.parent, os.W_OK):  # numba keeps it elsewhere
        from cdsm import kernels

        path: str | None = kernels.along.stats.cache_path  # type: ignore[attr-defined]
        if path is None:
            return None
        folder = Path(path)
    owner = f"{_source()} {sys.implementation.cache_tag} {platform.node()}"
    return folder / f"cdsm-kernels-{hashlib.sha256(owner.encode()).hexdigest()[:16]}.txt"


def _stamp() -> str:
    """Return what numba asks of kernels that it has kept: the same source and version."""
    source = _source().stat()
    return f"{source.st_mtime_ns} {source.st_size} numba {version('numba')}"


def _source() -> Path:
    return Path(__file__).parents[1] / "kernels.py"


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """Postures of an arm, loads, and what is given or asked of them.

    An array of loads, tensions or bounds has one row for all, or one for each posture.

    Attributes:
        arm: The arm.
        q: Joint angles (N, nv).
        wrench: W (N, 6).
        names: The quantities to compute.
        tension: Given F (N, C) [N], or None.
        bounds: Lower and upper bounds of F to distribute, (N, C) each [N], or None.
        directions: Unit vectors (D, 3) of ``along``.
        body: Dimensions of each row, rows first; those of the arm by default.
        springs: Stiffness (n, C) of cables of lengths L (n, C) under F (n, C) in a slice of rows;
            −1 outside a law; those of the arm by default.
        check_limits: Whether rows beyond the joint limits are skipped.
    """

    arm: Manipulator
    q: Array
    wrench: Array
    names: Collection[str]
    tension: Array | None = None
    bounds: tuple[Array, Array] | None = None
    directions: Array = field(default_factory=partial(np.zeros, (0, 3)))
    body: Body | None = None
    springs: Springs | None = None
    check_limits: bool = True

    def solve(self, status: Codes, threads: int = 1) -> dict[str, Array]:
        """Compute the quantities by name (N, …); set the ``status`` (N,) of rows that are OK."""
        arm = self.arm
        table = rows_of(self.arm)
        count = len(self.q)
        kernels = kernels_for(table, count)
        width = 32 if arm.nv >= 80 else 64
        size = min(max(1, _WIDE // table.size), 2048)
        if kernels.COMPILED:
            size = width * max(1, _CACHE // (table.size * width))
        parts = [slice(first, first + size) for first in range(0, count, size)]
        shapes = shapes_of(arm.nv, len(arm.cables), len(self.directions))
        values = {name: np.empty((count, *shapes[name])) for name in self.names}

        scratch = threading.local()

        def fill(part: slice) -> None:
            memory = scratch.__dict__.setdefault("of", {})
            with np.errstate(all="ignore"):
                found = Chunk(self, kernels, part, width, status[part], memory).quantities()
            for name in self.names:
                values[name][part] = found[name]

        if threads == 1 or len(parts) < 2:
            for part in parts:
                fill(part)
            return values
        with ThreadPoolExecutor(min(threads, len(parts))) as pool:
            for _ in pool.map(fill, parts):  # an error cancels the chunks that have not begun
                pass
        return values

"""Compute rows in chunks, by several threads, with kernels that numba compiles or numpy runs."""

from __future__ import annotations

import hashlib
import importlib.util
import logging
import os
import platform
import sys
import threading
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.chunk import Chunk, Scratch
from cdsm.batch.quantities import Codes, shapes_of
from cdsm.batch.rows import ArmTables, ContactKernels, Rows, tables_of
from cdsm.batch.wrapped_rows import PLAIN, solve_wrapped
from cdsm.motors import refuse_shared
from cdsm.quantities import QUANTITIES

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


def choose_kernels(arm: ArmTables, count: int) -> ModuleType:
    """Choose the kernels for ``count`` more rows: compiled ones if they are at hand or pay.

    Compiling takes half a minute, once on a machine; numba keeps the result on disk. So compiled
    kernels run

    1. if this process has them already, or numba has kept them on disk, which
       ``python -m cdsm.batch`` does ahead;
    2. or if all rows that this process has computed and asked for, this time's included, would take
       numpy longer than PATIENCE. Then they are compiled now, with a message in the log.

    Else numpy runs the same source, some ten times slower. Both give the same numbers to rounding.
    """
    global _spent
    with _lock:
        _spent += _SECONDS * arm.size * count
        at_hand = compiled_kernels.cache_info().currsize > 0 or _is_kept()
        return compiled_kernels() if at_hand or _spent >= PATIENCE else numpy_kernels()


def compile_ahead() -> None:
    """Compile all kernels, unless numba has kept them on disk."""
    from cdsm.batch import kernels
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
        Chunk(rows, kernels, slice(1), 1, Scratch()).quantities()
    _keep_record()


@cache
def compiled_kernels() -> ModuleType:
    """Import the compiled kernels, and compile those that numba has not kept."""
    from cdsm.batch import kernels

    if not _is_kept():
        _log.warning("compiling the kernels of batches, once on this machine: half a minute")
    compile_ahead()
    return kernels


@cache
def numpy_kernels() -> ModuleType:
    """Load the source of the kernels once more, without the compiler."""
    return _without_compiler("kernels")


def contact_kernels(count: int) -> ContactKernels:
    """Choose the kernels of contacts for ``count`` rows; numba keeps the compiled ones on disk."""
    if count <= PLAIN:
        return _numpy_contact_kernels()
    from cdsm.batch.contact_kernels import fill_contacts
    from cdsm.batch.shift_kernels import add_shifts

    return ContactKernels(fill_contacts, add_shifts, compiled=True)


@cache
def _numpy_contact_kernels() -> ContactKernels:
    loops = {name: x for name, x in vars(numpy_kernels()).items() if not name.startswith("_")}
    fill_contacts = _without_compiler("contact_kernels", loops).fill_contacts
    add_shifts = _without_compiler("shift_kernels", loops).add_shifts
    return ContactKernels(fill_contacts, add_shifts, compiled=False)


def _without_compiler(module_name: str, names: Mapping[str, Any] | None = None) -> ModuleType:
    """Load the source of a module of kernels as ``_numpy_…``, which numba does not compile.

    ``names`` are what it would import from compiled kernels.
    """
    name = f"cdsm.batch._numpy_{module_name}"
    path = _source().with_stem(module_name)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    module.__dict__.update(names or {}, COMPILED=False)
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
        from cdsm.batch import kernels

        path: str | None = kernels.fill_along.stats.cache_path  # type: ignore[attr-defined]
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
    return Path(__file__).with_name("kernels.py")


def solve_rows(rows: Rows, threads: int = 1) -> tuple[dict[str, NDArray[Any]], Codes]:
    """Compute the quantities of all rows by name (N, …), and the status (N,) of each row."""
    if rows.bounds is not None:
        remedy = "Give tensions, or take distribute_tension(pose, assembly=) posture by posture."
        refuse_shared(rows.arm.motors, "minimum", remedy)
    if rows.arm.wraps is not None and rows.touching is None:
        return solve_wrapped(rows, threads, contact_kernels(len(rows.q)), solve_rows)
    table = tables_of(rows.arm, rows.touching.touches if rows.touching else None)
    count = len(rows.q)
    kernels = choose_kernels(table, count)
    width = 32 if rows.arm.nv >= 80 else 64
    size = min(max(1, _WIDE // table.size), 2048)
    if kernels.COMPILED:
        size = width * max(1, _CACHE // (table.size * width))
    parts = [slice(first, first + size) for first in range(0, count, size)]
    shapes = shapes_of(rows.arm.nv, len(rows.arm.cables), len(rows.directions))
    values: dict[str, NDArray[Any]] = {
        name: np.empty((count, *shapes[name]), np.bool_ if QUANTITIES[name].is_flag else np.float64)
        for name in rows.names
    }
    status = np.zeros(count, dtype=np.uint8)
    of_thread = threading.local()

    def fill(part: slice) -> None:
        """Compute one chunk; no other thread writes to its rows."""
        scratch = of_thread.__dict__.setdefault("scratch", Scratch())
        with np.errstate(all="ignore"):
            chunk = Chunk(rows, kernels, part, width, scratch)
            quantities = chunk.quantities()
        status[part] = chunk.status
        for name, value in quantities.items():
            values[name][part] = value

    if threads == 1 or len(parts) < 2:
        for part in parts:
            fill(part)
        return values, status
    with ThreadPoolExecutor(min(threads, len(parts))) as pool:
        for _ in pool.map(fill, parts):  # an error cancels the chunks that have not begun
            pass
    return values, status

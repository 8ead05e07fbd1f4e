"""Which kernels compute a batch: compiled ones, or the same source without the compiler."""

from __future__ import annotations

import importlib.util
import logging
import os
import sys
import threading
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

import cdsm.batch.rows as rows

PATIENCE = 20.0
"""Seconds that numpy may take for all batches of a process before the kernels are compiled."""

_SECONDS = 1e-7  # that numpy takes for a number of a pose, with all that follows from it

_log = logging.getLogger("cdsm")
_lock = threading.Lock()
_spent = 0.0


def kernels_for(arm: rows.ArmRows, count: int) -> ModuleType:
    """Return the kernels for ``count`` more postures, compiled if they are or if it pays."""
    global _spent
    with _lock:
        _spent += _SECONDS * arm.size * count
        if _spent < PATIENCE and not (compiled.cache_info().currsize or _is_kept()):
            return plain()
        return compiled()


def compile_ahead() -> None:
    """Compile all kernels, unless numba has kept them on disk."""
    import cdsm

    arm = rows.rows_of(cdsm.presets.virtual_prototype())
    nv, C, W = len(arm.order), len(arm.arm.pulls), 1
    from cdsm import kernels

    at = rows.Pose(*(np.empty((1, *shape, W)) for shape in arm.shapes.values()))
    q, wrench = np.zeros((1, nv, W)), np.zeros((1, 6, W))
    F, K, size = np.ones((1, C, W)), np.empty((1, 1, nv, nv, W)), np.empty((1, nv, W))
    kernels.pose(arm.arm, arm.body(W), q, wrench, at)
    kernels.guess(arm.arm, at, F, 2.0 * F, np.empty_like(F), np.empty((1, W), dtype=np.bool_))
    kernels.stiffness(arm.arm, at, F, F, wrench, K, size)
    u, out = np.eye(3), np.empty((1, 3, W))
    kernels.along(K, size, at.tip_jacobian, u, False, out, np.empty((1, W)))


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
    """Whether numba has kept the kernel that is compiled last, since the source was changed."""
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or _source().parent / "__pycache__")
    if not folder.is_dir() and not os.access(folder.parent, os.W_OK):  # numba keeps it elsewhere
        from cdsm import kernels

        folder = Path(kernels.along.stats.cache_path)  # type: ignore[attr-defined]
    changed = _source().stat().st_mtime
    return any(file.stat().st_mtime > changed for file in folder.rglob("kernels.along-*.nbi"))


def _source() -> Path:
    return Path(__file__).parents[1] / "kernels.py"

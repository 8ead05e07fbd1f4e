"""Where compiled kernels are kept, and when they are compiled again."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.patience import HANGS
from tests.support.processes import ROOT

CACHED = """
import numpy as np
from cdsm._former.compiling import at_once
from cdsm._former.tension import scaled_balance
with at_once():
    scaled_balance(np.zeros((1, 1)), *np.zeros((3, 1)), 1.0)
print(sum(scaled_balance.stats.cache_hits.values()))
"""

READ_ONLY = """
import sys
from numba.core.caching import _CacheLocator
ensure = _CacheLocator.ensure_cache_path
def refuse(self):
    if not self.get_cache_path().startswith(sys.argv[1]):
        raise OSError(30, "Read-only file system")
    ensure(self)
_CacheLocator.ensure_cache_path = refuse
"""


def run(program: str, *arguments: str, cwd: Path = ROOT, **environment: str) -> tuple[str, str]:
    """What a process prints, and what it writes to its error stream."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(cwd), **environment},
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=True,
    )
    return done.stdout.strip(), done.stderr


@pytest.mark.slow
def test_kernels_are_compiled_again_if_a_kernel_that_they_may_call_changes(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "cdsm", tmp_path / "cdsm", ignore=shutil.ignore_patterns("__pycache__"))
    cache = str(tmp_path / "cache")
    assert run(CACHED, cwd=tmp_path, NUMBA_CACHE_DIR=cache)[0] == "0"
    assert run(CACHED, cwd=tmp_path, NUMBA_CACHE_DIR=cache)[0] == "1"
    with (tmp_path / "cdsm/_former/bodies.py").open("a") as source:
        source.write("\n")
    assert run(CACHED, cwd=tmp_path, NUMBA_CACHE_DIR=cache)[0] == "0"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="folders for temporary files have other names")
def test_where_no_cache_folder_is_writable_kernels_are_kept_with_temporary_files(
    tmp_path: Path,
) -> None:
    for hits in ("0", "1"):
        out, log = run(READ_ONLY + CACHED, str(tmp_path), TMPDIR=str(tmp_path))
        assert out == hits
        assert log.count("no cache folder of numba is writable") == 1
    folder = tmp_path / f"cdsm-kernels-{os.getuid()}"
    assert folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o777)  # others could put their code there
    assert run(READ_ONLY + CACHED, str(tmp_path), TMPDIR=str(tmp_path))[0] == "0"

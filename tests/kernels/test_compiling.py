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
from cdsm.kernels.compiling import at_once
from cdsm.kernels.tension import scaled_balance
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


FIRST = """
import sys
import numpy as np
import cdsm
from cdsm.kernels import compiling
from cdsm.kernels.posture import single_pose
from cdsm.kernels.stiffness import single_stiffness
compiling._NEW = compiling._KEPT = float(sys.argv[1]), 2**15
arm = cdsm.presets.virtual_prototype()
for q in np.random.default_rng(5).uniform(-0.15, 0.15, (3, arm.nv)):
    pose = arm.at(q)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0))
    numbers = (pose.tip, pose.length_hessian, K.joint, K.compliance, K.cartesian, K.pseudoinverse())
    print(*(each.tobytes().hex() for each in numbers), K.along("z"), K.margin)
searched = cdsm.distribute_tensions(arm, [q, -q], 40.0, 40.0 + 1e3 * abs(q).max())
print(searched.values.tobytes().hex(), searched.status, cdsm.evaluate(
    arm, [q, -q], minimum=40.0, direction="z", outputs=("along", "cartesian", "margin")
)["along"].tobytes().hex())
narrow = cdsm.distribute_tensions(arm, [q, -q], 40.0, 40.0)
print(narrow.values.tobytes().hex(), narrow.status)
print(len(single_pose.signatures), len(single_stiffness.signatures), file=sys.stderr)
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
    with (tmp_path / "cdsm/kernels/bodies.py").open("a") as source:
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


def test_first_calls_compile_nothing_and_give_the_same_bits(tmp_path: Path) -> None:
    """A change of one bit between two runs of a script would look like a fault of the user's."""
    cache = str(tmp_path / "empty")
    first, said = run(FIRST, "60", NUMBA_CACHE_DIR=cache)
    assert said.split() == ["0", "0"]
    compiled, said = run(FIRST, "0")
    assert said.split()[-2:] == ["1", "1"]
    assert first == compiled

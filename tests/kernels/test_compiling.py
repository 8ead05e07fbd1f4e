"""Where compiled kernels are kept, and when they are compiled again."""

import importlib
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numba.core.dispatcher import Dispatcher

import cdsm
from cdsm.kernels.compiling import CacheFile
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


WIDE = """
import sys
import numpy as np
from cdsm.kernels.compiling import at_once
from cdsm.kernels.readings import set_margins
if sys.argv[1:]:
    with at_once():
        set_margins(np.ones((1, 2, 2, 1)), np.empty((1, 1)), None)
set_margins(np.ones((1, 2, 2, 4000)), np.empty((1, 4000)), 4000)
print(len(set_margins.signatures))
"""

MANY = """
import numpy as np
from cdsm.kernels.compiling import compiled

@compiled
def total(pair):
    return pair[0].sum() + pair[1].sum()

for count in (100, 2**15 + 1):
    total((np.ones(count), np.ones(100)))
    print(len(total.signatures))
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


def test_processes_that_compile_at_once_do_not_confuse_their_kernels(tmp_path: Path) -> None:
    one: Any = CacheFile(str(tmp_path), "kernel", "stamp")  # type: ignore[no-untyped-call]
    other: Any = CacheFile(str(tmp_path), "kernel", "stamp")  # type: ignore[no-untyped-call]
    late = other._load_index()
    one.save("posture", "code for a posture")
    with pytest.MonkeyPatch.context() as patch:  # the other has read the index before
        patch.setattr(other, "_load_index", lambda: late)
        other.save("block", "code for a block")
    one._save_data(one._data_name(1), "code for a posture")  # whoever writes last
    assert other.load("block") == "code for a block"
    assert one.load("posture") is None  # to be compiled again
    one.save("posture", "anew")
    assert (one.load("block"), other.load("posture")) == ("code for a block", "anew")
    assert len([*tmp_path.glob("*.nbc")]) == 2  # files without a signature are gone


def test_kernels_call_kernels_by_name() -> None:
    """Python runs the first calls; it would call a compiled kernel if that is reached by module."""
    for found in pkgutil.walk_packages(cdsm.__path__, "cdsm."):
        names = vars(importlib.import_module(found.name))
        for kernel in [each for each in names.values() if isinstance(each, Dispatcher)]:
            used = kernel.py_func.__globals__
            for name in kernel.py_func.__code__.co_names:
                other = used.get(name)
                assert not (isinstance(other, ModuleType) and other.__name__.startswith("cdsm"))


@pytest.mark.slow
def test_a_kernel_compiled_for_one_posture_is_not_compiled_for_the_first_blocks(
    tmp_path: Path,
) -> None:
    folder = str(tmp_path)
    assert run(WIDE, "first", NUMBA_CACHE_DIR=folder)[0] == "1"  # that of one posture
    assert run(WIDE, NUMBA_CACHE_DIR=folder)[0] == "0"  # which is in the cache now


def test_python_runs_no_call_with_many_numbers_in_a_record() -> None:
    """It took seconds for records of ten thousand postures, whose kernel was in the cache."""
    assert run(MANY)[0].split() == ["0", "1"]

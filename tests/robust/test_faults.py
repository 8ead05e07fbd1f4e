"""Faults, done for real: nothing is lost, nothing half-written, nothing left lying about.

pytest tests/robust/test_faults.py -s        prints what was left on disk after each
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

import cdsm
from tests.support.patience import HANGS
from tests.support.sweeps import short_arm

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

NAMESPACE = (
    ["unshare", "--mount"] if os.name == "posix" and os.getuid() == 0 else ["unshare", "-rm"]
)
"""Runs a command where what it mounts is seen by nobody else and ends with it."""


def told(fault: str, what: str, left: str) -> None:
    print(f"| {fault} | {what} | {left} |")


# --- a disk that is full, or read-only ------------------------------------------------------


def can_mount(folder: Path) -> bool:
    if shutil.which("unshare") is None:
        return False
    command = [*NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", str(folder)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, Any]]]:
    """What every writer said, and what was left, by fault: see :mod:`tests.support.disks`."""
    folder = tmp_path_factory.mktemp("disks")
    if not can_mount(folder):
        pytest.skip("needs Linux namespaces that can mount a small disk")
    command = [*NAMESPACE, sys.executable, "-W", "error", "-m", "tests.support.disks", str(folder)]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=HANGS, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    found: dict[str, list[dict[str, Any]]] = json.loads(done.stdout)
    for fault, answers in found.items():
        for each in answers:
            told(fault, each["what"], _in_words(each["left"]))
    return found


def _in_words(left: dict[str, str]) -> str:
    if "pending" in left:
        return f"{left['pending']} of 64 pending"
    files = {name: what for name, what in left.items() if "zarr" not in name}
    new = [f"{name}: {what}" for name, what in files.items() if what != "old"]
    return ", ".join(new) or f"the {len(files)} old files, nothing else"


WRITERS = (
    *("urdf", "geometry", "cables", "elasticity", "mjcf", "netcdf", "csv", "path plan"),
    "load history",
    *("cdsm urdf", "cdsm export", "cdsm fit", "cdsm fit --figure", "cdsm sweep", "cdsm map"),
    *("cdsm weigh", "cdsm reproduce"),
)


def assert_refused(answers: list[dict[str, Any]], reason: str) -> None:
    """Every writer named its file and the reason, and all files are the old ones."""
    for each in answers:
        if each["said"].startswith("2: "):  # refused by its option, before the command computed
            assert "the folder is read-only; choose another" in each["said"].replace("│ ", ""), each
        else:
            assert each["said"].startswith(("CdsmError: ", "1: ")), each
            assert "cannot be written: " in each["said"], each
            assert reason in each["said"] or "bytes are free there" in each["said"], each
            assert each["said"].count("error:") <= 1, each
        names = {name for name in each["left"] if not name.startswith("s.zarr/")}
        assert names == OLD_FILES, each
        assert {each["left"][name] for name in names} == {"old"}, each


OLD_FILES = {
    *(f"wanted{suffix}" for suffix in (".xml", ".urdf", ".toml", ".nc", ".csv", ".png")),
    *("fig5.png", "reproduction.md", "reproduction.json"),
}


def test_a_full_disk_leaves_what_was_there(refused: dict[str, list[dict[str, Any]]]) -> None:
    *files, new, store, again = refused["full disk"]
    assert [each["what"] for each in files][: len(WRITERS)] == list(WRITERS)
    assert_refused(files, "No space left on device")
    assert "s.zarr: cannot be created as a store: " in new["said"]
    assert set(new["left"]) == OLD_FILES  # not even the store begun
    assert "s.zarr: cannot be written: " in store["said"]
    assert "No space left" in store["said"]
    assert 0 < int(store["left"]["pending"]) < 64
    assert again["said"] == "the same bits"


def test_a_disk_that_became_read_only_keeps_what_was_there(
    refused: dict[str, list[dict[str, Any]]],
) -> None:
    *files, store, again = refused["read-only disk"]
    assert [each["what"] for each in files] == list(WRITERS)
    assert_refused(files, "Read-only file system")
    assert "s.zarr: cannot be written: " in store["said"]
    assert store["left"] == files[0]["left"]
    assert again["said"] == "the same bits"


# --- runs that are stopped ------------------------------------------------------------------

POSES = cdsm.RandomPoses(4000, 1)
SWEEP = """
import sys
import cdsm
from tests.support.sweeps import short_arm
cdsm.sweep(short_arm(), cdsm.RandomPoses(4000, 1), minimum=20.0, store=sys.argv[1], chunk=20)
"""


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return cdsm.sweep(short_arm(), POSES, minimum=20.0)


@contextmanager
def running(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    """Python with these arguments, ended whatever happens."""
    command = [sys.executable, *map(str, arguments)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for(reached: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Until something is there; the process has to be alive until then."""
    while not reached():
        assert process.poll() is None, process.communicate()
        time.sleep(0.002)


def blocks_done(path: Path) -> int:
    return len(list(path.glob("status/c/*")))


def pending(path: Path) -> int:
    return int((cdsm.read_sweep(path).status == cdsm.SweepStatus.PENDING).sum())


def test_a_run_killed_while_it_writes_comes_to_the_same_bits(
    tmp_path: Path, whole: xr.Dataset
) -> None:
    path = tmp_path / "s.zarr"
    with running("-c", SWEEP, path) as process:
        wait_for(lambda: blocks_done(path) >= 7, process)
        process.kill()
        process.wait()
    left = pending(path)
    told("killed run", "sweep store", f"{left} of 4000 pending")
    assert 0 < left <= 4000 - 20 * 6
    again = cdsm.sweep(short_arm(), POSES, minimum=20.0, store=path)
    xr.testing.assert_identical(again, whole)
    assert [each.name for each in tmp_path.iterdir()] == ["s.zarr"]


def test_an_interrupted_command_says_so_in_one_line_and_goes_on(tmp_path: Path) -> None:
    arm, path, out = tmp_path / "arm.toml", tmp_path / "s.zarr", tmp_path / "s.csv"
    short_arm().geometry.write(arm)
    out.write_text("old", encoding="utf-8")
    command = (
        "-m",
        "cdsm",
        "sweep",
        arm,
        "--wire",
        "1x19-1.2mm",
        "--random",
        100_000,
        "--out",
        out,
        "--resume",
        path,
    )
    with running(*command) as process:
        wait_for(lambda: blocks_done(path) >= 1, process)
        process.send_signal(signal.SIGINT)
        said, complained = process.communicate(timeout=HANGS)
    assert process.returncode == 130, complained
    assert said == ""
    assert [line.partition(":")[0] for line in complained.splitlines()] == ["interrupted"]
    left = pending(path)
    told("Ctrl-C", "cdsm sweep --resume", f"{left} of 100000 pending, old table as before")
    assert 0 < left < 100_000
    assert out.read_text(encoding="utf-8") == "old"
    assert {each.name for each in tmp_path.iterdir()} == {"arm.toml", "s.zarr", "s.csv"}
    poses = cdsm.RandomPoses(100_000, 0)
    described = cdsm.Manipulator(cdsm.Geometry.read(arm), cdsm.presets.STRAND_1X19)
    again = cdsm.sweep(described, poses, minimum=10.0, store=path, progress=False)
    assert pending(path) == 0
    xr.testing.assert_identical(again, cdsm.sweep(described, poses, minimum=10.0, progress=False))


def test_reproduce_that_is_killed_leaves_whole_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "reproduction.json").write_text("old", encoding="utf-8")
    with running("-m", "cdsm", "reproduce", "--out", out) as process:
        wait_for(lambda: len(list(out.glob("fig*.png"))) >= 2, process)
        process.kill()
        process.wait()
    shown = [path for path in out.iterdir() if not path.name.startswith(".")]
    told("killed run", "cdsm reproduce", ", ".join(sorted(path.name for path in shown)))
    assert (out / "reproduction.json").read_text(encoding="utf-8") == "old"
    for picture in out.glob("fig*.png"):
        data = picture.read_bytes()
        assert data.startswith(b"\x89PNG"), picture
        assert data.endswith(b"IEND\xaeB`\x82"), picture  # the mark at the end of every PNG
    # what the kill caught in writing lies aside, under a name of its own
    assert len(list(out.iterdir())) - len(shown) <= 1


def test_of_two_runs_at_once_on_one_store_one_may_be_told_to_wait(
    tmp_path: Path, whole: xr.Dataset
) -> None:
    path = tmp_path / "s.zarr"
    with running("-c", SWEEP, path) as first, running("-c", SWEEP, path) as second:
        complaints = [each.communicate(timeout=HANGS)[1] for each in (first, second)]
        codes = [first.returncode, second.returncode]
    assert 0 in codes
    for code, complaint in zip(codes, complaints, strict=True):
        if code != 0:
            assert "StoreError" in complaint
            assert "another run is writing to it; wait for it to end" in complaint
    told("two runs at once", "sweep store", f"whole, exit codes {codes}")
    assert [each.name for each in tmp_path.iterdir()] == ["s.zarr"]
    again = cdsm.sweep(short_arm(), POSES, minimum=20.0, store=path)
    xr.testing.assert_identical(again, whole)

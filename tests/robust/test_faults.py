"""Runs that are stopped: nothing is lost, nothing half-written, nothing left lying about."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import xarray as xr

import cdsm
from tests.support.patience import HANGS
from tests.support.sweeps import short_arm

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


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
        "--set",
        "wire=1x19-1.2mm",
        "--minimum",
        10,
        "--random",
        100_000,
        "--out",
        out,
        "--store",
        path,
    )
    with running(*command) as process:
        wait_for(lambda: blocks_done(path) >= 1, process)
        process.send_signal(signal.SIGINT)
        said, complained = process.communicate(timeout=HANGS)
    assert process.returncode == 130, complained
    assert said == ""
    told = [line.partition(":")[0] for line in complained.splitlines()]
    assert {*told[:-1]} <= {"sweep"}  # how far it was
    assert told[-1] == "interrupted"
    left = pending(path)
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
    assert [each.name for each in tmp_path.iterdir()] == ["s.zarr"]
    again = cdsm.sweep(short_arm(), POSES, minimum=20.0, store=path)
    xr.testing.assert_identical(again, whole)

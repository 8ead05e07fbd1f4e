"""Runs that are stopped: nothing is lost, nothing half-written, nothing left lying about."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import cdsm
from tests.support.patience import HANGS
from tests.support.sweeps import short_arm

ROOT = Path(__file__).parents[2]


def test_an_interrupted_command_says_so_in_one_line(tmp_path: Path) -> None:
    arm, path, out = (tmp_path / name for name in ("arm.toml", "s.zarr", "s.csv"))
    short_arm().geometry.write(arm)
    out.write_text("old", encoding="utf-8")
    words = f"-m cdsm sweep {arm} --set wire=1x19-1.2mm --minimum 10 --random 140000"
    command = [sys.executable, *words.split(), "--out", str(out), "--store", str(path)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=ROOT, text=True, **pipes) as process:  # type: ignore[call-overload]
        try:
            while not list(path.glob("status/c/*")):
                assert process.poll() is None, process.communicate()
                time.sleep(0.002)
            process.send_signal(signal.SIGINT)
            said, complained = process.communicate(timeout=HANGS)
        finally:
            process.kill()
    assert process.returncode == 130, complained
    assert said == ""
    told = [line.partition(":")[0] for line in complained.splitlines()]
    assert {*told[:-1]} <= {"sweep"}  # how far it was
    assert told[-1] == "interrupted"
    left = int((cdsm.read_sweep(path).status == cdsm.Status.PENDING).sum())
    assert 0 < left < 140_000  # tests/sweeps/test_store.py goes on from there
    assert out.read_text(encoding="utf-8") == "old"
    assert {each.name for each in tmp_path.iterdir()} == {"arm.toml", "s.zarr", "s.csv"}

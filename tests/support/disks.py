"""Everything that writes, against a disk that refuses: run in a mount namespace by test_faults.

python -m tests.support.disks FOLDER      prints for each fault what was said and left, as JSON

The folder is empty; what is mounted below it goes with the namespace.
"""

import hashlib
import json
import logging
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest.mock import Mock, patch

import numpy as np
import xarray as xr
from typer.testing import CliRunner

import cdsm
from cdsm import paper
from cdsm.cli import app
from tests.support.sweeps import short_arm

logging.getLogger("cdsm").setLevel(logging.ERROR)  # where no kernel is compiled yet

ARM = short_arm()
POSES = cdsm.RandomPoses(64, 1)
OUTPUTS = ("tension", "margin", "joint_stiffness")
OLD = b"what stood there before\n"
ENOUGH = 4 * 2**20
FAULTS = ("full disk", "read-only disk")
LARGE = ("netcdf", "csv", "cdsm fit --figure", "cdsm reproduce")


def write(path: Path) -> dict[str, Callable[[], object]]:
    """What writes a file at a path, by the name of the writer."""
    wire, pose = cdsm.LinearElasticity(48e3), ARM.at(np.full(ARM.nv, 0.1))
    pull = cdsm.distribute_tension(pose, 10.0)
    loaded = cdsm.load_cycle(pose, pull, np.eye(6)[2:3])
    swept = cdsm.sweep(ARM, POSES, minimum=20.0, outputs=OUTPUTS)
    plan = cdsm.plan_path(ARM, (0, 0, 1), 1e3, 10.0, 500.0, angles=np.full((20, ARM.nv), 0.1))
    table = path.with_suffix(".csv")
    return {
        "urdf": lambda: cdsm.write_urdf(ARM.geometry, path),
        "geometry": lambda: ARM.geometry.write(path),
        "cables": lambda: cdsm.write_cables(ARM.cables, path),
        "elasticity": lambda: wire.write(path),
        "mjcf": lambda: cdsm.write_mjcf(ARM, path, pose, pull),
        "netcdf": lambda: cdsm.write_sweep(swept, path.with_suffix(".nc")),
        "csv": lambda: cdsm.write_sweep(swept, table),
        "path plan": lambda: plan.write_csv(table),
        "load history": lambda: loaded.write(path.with_suffix(".nc")),
    }


def commands(folder: Path, path: Path) -> dict[str, list[object]]:
    """What writes files as a user calls it; the inputs lie elsewhere."""
    arm, test, swept = folder / "arm.toml", folder / "test.csv", folder / "swept.nc"
    ARM.write(arm)
    force = np.linspace(0.0, 300.0, 60)
    rows = "\n".join(f"{f / 50.0:.6f},{f}" for f in force)
    test.write_text(f"displacement [mm],force [N]\n{rows}\n", encoding="utf-8")
    cdsm.write_sweep(cdsm.sweep(ARM, POSES, minimum=20.0), swept)
    angles, picture = "5", path.with_suffix(".png")
    return {
        "cdsm urdf": ["urdf", arm, "-o", path.with_suffix(".urdf")],
        "cdsm export": ["export", arm, "--mjcf", path, "--angles", angles],
        "cdsm fit": ["fit", test, "--gauge-length", 500, "-o", path.with_suffix(".toml")],
        "cdsm fit --figure": ["fit", test, "--gauge-length", 500, "--figure", picture],
        "cdsm sweep": ["sweep", arm, "--random", 9, "--out", path.with_suffix(".nc")],
        "cdsm map": ["map", swept, "-o", picture],
        "cdsm weigh": ["weigh", arm, "--force", "0,0,-1", "--figure", picture],
        "cdsm reproduce": ["reproduce", "--out", path.parent],
    }


def left(folder: Path) -> dict[str, str]:
    """Every file below a folder, with what it holds: "old", or its size and hash."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != "ballast":
            data = path.read_bytes()
            digest = hashlib.sha256(data).hexdigest()[:8]
            found[str(path.relative_to(folder))] = (
                "old" if data == OLD else f"{len(data)} bytes {digest}"
            )
    return found


def said(run: Callable[[], object]) -> str:
    """The error of a writer, with its kind."""
    try:
        run()
    except BaseException as error:
        kind = "CdsmError" if isinstance(error, cdsm.CdsmError) else type(error).__name__
        return f"{kind}: {error}"
    return "nothing"


def called(arguments: list[object]) -> str:
    """The exit code of a command, and what it says."""
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return f"{type(result.exception).__name__}: {result.exception}"
    return f"{result.exit_code}: {' '.join(result.stderr.split())}"


def fill(folder: Path, spare: int) -> None:
    """Fill the disk of a folder up to so many bytes."""
    ballast = folder / "ballast"
    with suppress(OSError), ballast.open("wb", buffering=0) as file:
        while True:
            file.write(b"\0" * 4096)
    with ballast.open("r+b") as file:
        file.truncate(max(0, ballast.stat().st_size - spare))


def main(folder: Path) -> None:
    # one figure of ten: the folder is what is tested
    figures = {"fig5": paper.FIGURES["fig5"]}
    with patch.object(paper, "FIGURES", figures):
        print(json.dumps({fault: refused(fault, folder / fault) for fault in FAULTS}))


def refused(fault: str, folder: Path) -> list[dict[str, Any]]:
    """What everything that writes says, and leaves, under a fault."""
    disk, elsewhere = folder / "disk", folder / "elsewhere"
    folder.mkdir()
    disk.mkdir()
    elsewhere.mkdir()
    wanted = disk / "wanted.xml"
    runs: dict[str, Callable[[], str]] = {
        name: lambda run=run: said(run)  # type: ignore[misc]
        for name, run in write(wanted).items()
    }
    for name, arguments in commands(elsewhere, wanted).items():
        runs[name] = lambda given=arguments: called(given)  # type: ignore[misc]
    whole = cdsm.sweep(ARM, POSES, minimum=20.0, outputs=OUTPUTS)

    def sweep(**options: Any) -> xr.Dataset:
        return cdsm.sweep(
            ARM, POSES, minimum=20.0, outputs=OUTPUTS, store=disk / "s.zarr", chunk=4, **options
        )

    mount = ["mount", "-t", "tmpfs", "-o", f"size={ENOUGH}", "tmpfs", disk]
    subprocess.run(list(map(str, mount)), check=True)
    for suffix in (".xml", ".urdf", ".toml", ".nc", ".csv", ".png"):
        wanted.with_suffix(suffix).write_bytes(OLD)
    for name in ("fig5.png", "reproduction.md", "reproduction.json"):
        (disk / name).write_bytes(OLD)
    answers: list[dict[str, Any]] = []

    def record(name: str, words: str) -> None:
        answers.append({"what": name, "said": words, "left": left(disk)})

    if fault == "read-only disk":
        # a run that stops after its first block leaves a store with something to do
        with suppress(KeyboardInterrupt):
            _stopped(sweep)
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        for name, run in runs.items():
            record(name, run())
        record("sweep store", said(sweep))
        subprocess.run(["mount", "-o", "remount,rw", str(disk)], check=True)
    else:
        fill(disk, 0)
        for name, run in runs.items():
            record(name, run())
        fill(disk, 8192)
        for name in LARGE:  # which begin well
            record(f"{name}, some bytes", runs[name]())
        record("new sweep store", said(sweep))
        fill(disk, 200_000)
        words = said(sweep)
        status = cdsm.read_sweep(disk / "s.zarr").status
        pending = int((status == cdsm.SweepStatus.PENDING).sum())
        answers.append({"what": "sweep store", "said": words, "left": {"pending": str(pending)}})
        (disk / "ballast").unlink()
    xr.testing.assert_identical(sweep(), whole)
    record("sweep store, asked again", "the same bits")
    return answers


def _stopped(sweep: Callable[[], object]) -> None:
    from cdsm.sweeps import run

    write = Mock(side_effect=[run._write, KeyboardInterrupt])
    with patch.object(run, "_write", lambda *given: write()(*given)):
        sweep()


if __name__ == "__main__":
    main(Path(sys.argv[1]))

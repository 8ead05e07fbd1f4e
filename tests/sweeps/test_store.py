"""Sweeps on dask, in stores and files: the same numbers, also after a run was killed."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from distributed import Client, LocalCluster

import cdsm
from cdsm.batch import Batch
from cdsm.sweeps.files import write_sweep
from cdsm.sweeps.store import read_into_memory
from tests.support.patience import HANGS
from tests.support.sweeps import CASES, EVERYTHING, GRID, short_arm

ROOT = Path(__file__).parents[2]
POSES = cdsm.RandomPoses(1000, 1)


def swept(q: Any = GRID, **changes: Any) -> xr.Dataset:
    given = {"outputs": EVERYTHING, **CASES, **changes}
    return cdsm.sweep(given.pop("arm", short_arm()), q, **given)


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return swept()


def same(found: xr.Dataset, whole: xr.Dataset) -> bool:
    xr.testing.assert_allclose(found, whole, rtol=1e-10)
    assert found.attrs == whole.attrs
    assert found.status.dtype == np.int8
    return True


def test_a_chunked_sweep_is_lazy_and_has_the_same_numbers(whole: xr.Dataset) -> None:
    found = swept(GRID.angles(short_arm(), 2))
    assert all(each.chunks is not None for each in found.data_vars.values())
    assert len(found.status.chunks[0]) * len(found.status.chunks[1]) > 4
    assert same(found.compute(scheduler="synchronous"), whole)
    q = POSES.angles(short_arm(), 500)
    np.testing.assert_array_equal(q.compute(), POSES.angles(short_arm()))


def test_a_cluster_of_two_workers_has_the_same_numbers(tmp_path: Path) -> None:
    q, options = POSES.angles(short_arm(), 250), {"minimum": 20.0, "outputs": ("along", "tension")}
    alone = cdsm.sweep(short_arm(), POSES, **options)  # type: ignore[arg-type]
    workers = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0")
    with workers, Client(workers):
        lazy = cdsm.sweep(short_arm(), q, **options)  # type: ignore[arg-type]
        assert same(lazy.compute(), alone)
        kept = cdsm.sweep(short_arm(), q, store=tmp_path / "s.zarr", **options)  # type: ignore[arg-type]
        assert same(kept, alone)


def test_a_store_holds_what_a_sweep_in_memory_does(tmp_path: Path, whole: xr.Dataset) -> None:
    assert same(swept(store=tmp_path / "s.zarr"), whole)
    assert same(cdsm.read_sweep(tmp_path / "s.zarr"), whole)
    assert [path.name for path in tmp_path.iterdir()] == ["s.zarr"]  # nothing is left beside it


def test_ctrl_c_while_a_store_is_made_waits_for_the_threads_that_write_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = xr.Dataset.to_zarr

    def slowly(*args: Any, **options: Any) -> None:
        def late() -> None:
            time.sleep(0.3)
            write(*args, **options)

        thread = threading.Thread(target=late)  # as those of zarr
        thread.start()
        time.sleep(0.1)
        if "compute" in options:  # once
            os.kill(os.getpid(), signal.SIGINT)
        thread.join()

    monkeypatch.setattr(xr.Dataset, "to_zarr", slowly)
    with pytest.raises(KeyboardInterrupt):
        swept(store=tmp_path / "s.zarr")
    time.sleep(0.5)
    assert not list(tmp_path.iterdir())


def test_a_sweep_that_memory_cannot_hold_needs_a_store() -> None:
    half = np.arange(2**13)
    for poses in (cdsm.RandomPoses(2**26), cdsm.GridPoses({"joint1_1": half, "joint2_1": half})):
        with pytest.raises(cdsm.InvalidInput, match=r"2\^25 in memory"):
            swept(poses)


def test_an_empty_folder_becomes_a_store(tmp_path: Path) -> None:
    (tmp_path / "s.zarr").mkdir()
    poses = cdsm.RandomPoses(3)
    xr.testing.assert_equal(swept(poses, store=tmp_path / "s.zarr"), swept(poses))


def test_only_what_is_missing_is_computed(
    tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, q = tmp_path / "s.zarr", GRID.angles(short_arm(), 2)
    swept(q, store=path)
    for each in ("status/c/1/0/0/0", "margin/c/1/0/0/0"):  # as if killed before the status
        (path / each).unlink()
    left = cdsm.read_sweep(path).status == cdsm.Status.PENDING
    assert 0 < left.sum() < left.size
    calls: list[int] = []
    compute = cdsm.evaluate

    def counted(arm: cdsm.Manipulator, q: Any, **options: Any) -> Batch:
        calls.append(len(q))
        return compute(arm, q, **options)

    monkeypatch.setattr("cdsm.sweeps.cases.evaluate", counted)
    assert same(swept(store=path), whole)  # the chunks are those of the store
    assert sum(calls) == left.sum()


KILLED = """
import sys
import cdsm
from tests.support.sweeps import short_arm
arm = short_arm()
cdsm.sweep(arm, cdsm.RandomPoses(1000, 1).angles(arm, 20), minimum=20.0, store=sys.argv[1])
"""


def test_a_killed_run_goes_on_to_the_same_numbers(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], cwd=ROOT) as process:
        end = time.monotonic() + HANGS
        while len(list(path.glob("status/c/*"))) < 7:
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.002)
        os.kill(process.pid, signal.SIGKILL)
    left = cdsm.read_sweep(path).status == cdsm.Status.PENDING
    assert 0 < left.sum() < 1000
    again = cdsm.sweep(short_arm(), POSES, minimum=20.0, store=path)
    assert same(again, cdsm.sweep(short_arm(), POSES, minimum=20.0))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"minimum": [1.0, 20.0, 61.0]}, r"minimum(?s:.*)60\.0(?s:.*)61\.0"),
        ({"maximum": 99.0}, r"maximum(?s:.*)inf(?s:.*)99\.0"),
        ({"outputs": "margin"}, "outputs"),
        ({"arm": short_arm(spring=1e6)}, "series_stiffness is not given there, 1000000.0 here"),
        ({"q": cdsm.GridPoses({"joint1_1": [0.1]})}, "joint3_2"),
        ({"q": np.full((1, 6), 0.1)}, "pose"),
    ],
)
def test_a_store_of_another_sweep_is_refused_with_the_difference(
    changes: dict[str, Any], said: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "shared.zarr"
    if not path.exists():
        swept(store=path)
    with pytest.raises(cdsm.FileError, match=f"shared.zarr: contains a(?s:.*){said}"):
        swept(**changes, store=path)
    folder = path.with_name("folder.zarr")
    folder.mkdir(exist_ok=True)
    (folder / "notes.txt").touch()
    with pytest.raises(cdsm.FileError, match="folder"):
        swept(store=folder)


def law(factor: float) -> cdsm.Elasticity:
    return cdsm.Elasticity.from_rigidity(lambda F: factor * (1.0 + F / 50.0), 1.0, 500.0)


def test_a_store_with_another_law_of_the_user_names_the_cable_and_its_law(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    poses = cdsm.RandomPoses(4)
    cdsm.sweep(short_arm(law(1e4)), poses, minimum=20.0, store=path)
    with pytest.raises(cdsm.FileError) as caught:
        cdsm.sweep(short_arm(law(2e4)), poses, minimum=20.0, store=path)
    head, *lines = str(caught.value).splitlines()
    assert "contains a sweep of another arm" in head
    assert lines[0].startswith("  - cables.cable1_1.elasticity is 'Elasticity(low=1.0")
    assert all(len(line) < 300 for line in lines)
    same = cdsm.sweep(short_arm(law(1e4)), poses, minimum=20.0, store=path)
    assert (same.status == cdsm.Status.OK).any()


def test_a_store_of_another_version_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    cdsm.sweep(short_arm(), GRID, store=path, **CASES)
    about = path / "zarr.json"
    version = cdsm.read_sweep(path).attrs["source"]
    about.write_text(about.read_text().replace(version, "cdsm 0.0.1"))
    with pytest.raises(cdsm.FileError, match=f"made by cdsm 0.0.1, and this is {version}"):
        cdsm.sweep(short_arm(), GRID, store=path, **CASES)
    assert cdsm.read_sweep(path).attrs["source"] == "cdsm 0.0.1"  # reading is allowed


DAMAGE = """
import sys
from pathlib import Path
import cdsm
from tests.support.sweeps import short_arm
arm = short_arm()
q = cdsm.RandomPoses(240, 1).angles(arm, 20)
path = Path(sys.argv[1])
cdsm.sweep(arm, q, minimum=20.0, store=path)
for number in (3, 7):
    chunk = path / "status" / "c" / str(number)
    chunk.write_bytes(chunk.read_bytes()[:3])
cdsm.sweep(arm, q, minimum=20.0, store=path)
"""


def test_a_damaged_chunk_of_a_status_is_computed_again_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    command = [sys.executable, "-c", DAMAGE, str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=HANGS)
    assert done.returncode == 0
    assert done.stderr.splitlines() == ["sweep of arm resumes: 10 of 12 chunks are kept"]
    whole = cdsm.sweep(short_arm(), cdsm.RandomPoses(240, 1), minimum=20.0)
    assert same(cdsm.read_sweep(path), whole)


def test_a_damaged_chunk_of_an_output_is_named_with_what_to_delete(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    arm = short_arm()
    q = cdsm.RandomPoses(60, 1).angles(arm, 20)
    dataset = cdsm.sweep(arm, q, minimum=20.0, store=path)
    (path / "margin" / "c" / "1").write_bytes(b"no chunk")
    with pytest.raises(cdsm.FileError, match=r"margin, pose 20 to 39, .*Delete status/c/1 in it"):
        read_into_memory(dataset, path)
    (path / "status" / "c" / "1").unlink()
    again = cdsm.sweep(arm, q, minimum=20.0, store=path)
    assert same(read_into_memory(again, path), cdsm.sweep(arm, cdsm.RandomPoses(60, 1), minimum=20))


def test_a_second_writer_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "store"
    cdsm.sweep(short_arm(), GRID, store=store, **CASES)
    writer = "import sys; from pathlib import Path; from cdsm.sweeps.store import only_writer\n"
    writer += f"with only_writer(Path({str(store)!r})): print('locked', flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", writer], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"locked\n"
        with pytest.raises(cdsm.FileError, match="another sweep writes to it"):
            cdsm.sweep(short_arm(), GRID, store=store, **CASES)
        other.communicate(b"\n")
    cdsm.sweep(short_arm(), GRID, store=store, **CASES)


def test_netcdf_gives_the_same_sweep_back(tmp_path: Path, whole: xr.Dataset) -> None:
    path = write_sweep(whole, tmp_path / "s.nc")
    xr.testing.assert_identical(cdsm.read_sweep(path), whole)
    path = write_sweep(swept(store=tmp_path / "s.zarr"), path)
    assert same(cdsm.read_sweep(path), whole)
    with pytest.raises(cdsm.InvalidInput, match=r"ends neither in \.nc \(NetCDF\) nor in \.csv"):
        write_sweep(whole, tmp_path / "s.txt")
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(cdsm.FileError, match=r"other\.nc: is not a sweep of cdsm"):
        cdsm.read_sweep(tmp_path / "other.nc")


def test_csv_has_a_row_for_each_entry_and_a_column_for_each_component(
    tmp_path: Path, whole: xr.Dataset
) -> None:
    import pandas

    table = pandas.read_csv(write_sweep(whole, tmp_path / "s.csv"))
    names, joint = whole.status.attrs["flag_meanings"].split(), whole.joint_stiffness
    assert table["status"].tolist() == [names[i] for i in whole.status.values.ravel()]
    for header, variable in {
        "joint1_1 [rad]": whole.joint1_1,
        "joint2_1 [rad]": whole.joint2_1,
        "minimum [N]": whole.minimum,
        "force_z [N]": whole.force.sel(axis="z"),
        "tip_position_y [m]": whole.tip_position.sel(axis="y"),
        "tension_cable2_3 [N]": whole.tension.sel(cable="cable2_3"),
        "along_z [N m-1]": whole.along.sel(direction="z"),
        "isotropy": whole.isotropy,
        "joint_stiffness_joint1_1_joint2_2 [N m rad-1]": joint.sel(
            joint="joint1_1", joint_column="joint2_2"
        ),
    }.items():
        full = variable.broadcast_like(whole.status).transpose(*whole.status.dims)
        np.testing.assert_allclose(table[header], full.values.ravel(), rtol=1e-15, err_msg=header)

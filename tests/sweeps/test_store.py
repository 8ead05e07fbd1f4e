"""A sweep that was stopped goes on from what is on disk, to the same bits."""

import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import xarray as xr
import zarr

import cdsm
from cdsm.sweeps import description, run, store
from cdsm.sweeps.blocks import extents
from cdsm.sweeps.evaluation import BlockResult, SweepTask, evaluate
from cdsm.sweeps.specification import Specification
from tests.support.patience import HANGS
from tests.support.sweeps import CASES, GRID, STEEL, Deadly, short_arm

ROOT = Path(__file__).parents[2]
OUTPUTS = ("tip_position", "tension", "margin", "along")
CHUNK = 24
"""Two of the twelve postures a block, so six blocks."""


@pytest.fixture(scope="module")
def whole() -> xr.Dataset:
    return cdsm.sweep(short_arm(), GRID, outputs=OUTPUTS, **CASES)


def specified(**changes: Any) -> Specification:
    """What a sweep gives to its store."""
    found: list[Specification] = []

    def keep(path: Path, asked: Specification, extent: Any) -> None:
        found.append(asked)
        raise InterruptedError

    options = {"minimum": 9.0, "outputs": "margin", **changes}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(store, "opened", keep)
        with pytest.raises(InterruptedError):
            cdsm.sweep(short_arm(), GRID, **options, store="s")
    return found[0]


def kept(path: Path, **changes: Any) -> xr.Dataset:
    given = {"outputs": OUTPUTS, "chunk": CHUNK, **CASES, **changes}
    return cdsm.sweep(given.pop("arm", short_arm()), given.pop("q", GRID), store=path, **given)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many postures each call of the evaluation was for."""
    calls: list[int] = []

    def counting(task: SweepTask, q: Any, threads: int | None = None) -> BlockResult:
        calls.append(len(q))
        return evaluate(task, q, threads)

    monkeypatch.setattr(run, "evaluate", counting)
    return calls


def test_a_store_holds_what_a_sweep_in_memory_does(tmp_path: Path, whole: xr.Dataset) -> None:
    found = kept(tmp_path / "s.zarr")
    xr.testing.assert_identical(found, whole)
    assert list(found.variables) == list(whole.variables)
    for name, variable in found.variables.items():
        assert variable.dtype == whole[name].dtype
    assert [path.name for path in tmp_path.iterdir()] == ["s.zarr"]  # nothing is left beside it


def test_a_store_is_opened_once_to_be_read(
    tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(tmp_path / "s.zarr")
    opened: list[object] = []
    open_group = zarr.open_group

    def counted(*given: Any, **options: Any) -> Any:
        opened.append(given[0] if given else options["store"])
        return open_group(*given, **options)

    monkeypatch.setattr(zarr, "open_group", counted)
    xr.testing.assert_identical(cdsm.read_sweep(tmp_path / "s.zarr"), whole)
    assert opened.count(tmp_path / "s.zarr") == 1  # xarray, which opens it too, names it otherwise


def test_an_interrupted_run_goes_on_where_it_stopped(
    tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch, counted: list[int]
) -> None:
    path = tmp_path / "s.zarr"

    def interrupted(task: SweepTask, q: Any, threads: int | None = None) -> BlockResult:
        if len(counted) == 4:
            raise KeyboardInterrupt
        counted.append(len(q))
        return evaluate(task, q, threads)

    with monkeypatch.context() as patch:
        patch.setattr(run, "evaluate", interrupted)
        with pytest.raises(KeyboardInterrupt):
            kept(path)
    partly = cdsm.read_sweep(path)
    done = partly.status != cdsm.SweepStatus.PENDING
    assert int(done.sum()) == 4 * CHUNK
    xr.testing.assert_equal(partly.margin.where(done), whole.margin.where(done))
    assert bool(partly.margin.where(~done).isnull().all())
    del counted[:]
    xr.testing.assert_identical(kept(path, chunk=7), whole)  # the chunk is that of the store
    assert counted == [2, 2]
    del counted[:]
    xr.testing.assert_identical(kept(path), whole)
    assert counted == []


KILLED = """
import sys
import cdsm
from tests.support.sweeps import Deadly, short_arm
poses = cdsm.RandomPoses(64, 1)
cdsm.sweep(short_arm(Deadly(sys.argv[1])), poses, minimum=20.0, store=sys.argv[2], chunk=8)
"""


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_bits_of_one_that_was_not(tmp_path: Path) -> None:
    orders, path = tmp_path / "orders", tmp_path / "s.zarr"
    orders.mkdir()
    for order in ("0", "1", "2", "die"):  # at the fourth look at the rigidity
        (orders / order).touch()
    command = [sys.executable, "-c", KILLED, str(orders), str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, timeout=HANGS, check=False)
    assert done.returncode == -9, done.stderr
    assert not list(orders.iterdir())  # or it would kill the tests themselves
    status = cdsm.read_sweep(path).status
    pending = int((status == cdsm.SweepStatus.PENDING).sum())
    assert 8 <= pending <= 56
    arm, poses = short_arm(Deadly(str(orders))), cdsm.RandomPoses(64, 1)
    again = cdsm.sweep(arm, poses, minimum=20.0, store=path, chunk=8)
    xr.testing.assert_identical(again, cdsm.sweep(arm, poses, minimum=20.0))


@pytest.mark.parametrize("writes", [5, 6, 8, 9])
def test_a_run_may_stop_between_any_two_writes(
    writes: int, tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, done = tmp_path / "s.zarr", [0]
    write = zarr.Array.__setitem__

    def interrupted(*arguments: Any) -> None:
        if done[0] == writes:
            raise KeyboardInterrupt
        done[0] += 1
        write(*arguments)

    with store.opened(path, specified(**CASES, outputs=OUTPUTS), {"joint1_1": 1, "joint3_2": 2}):
        pass
    with monkeypatch.context() as patch:
        patch.setattr(zarr.Array, "__setitem__", interrupted)
        with pytest.raises(KeyboardInterrupt):
            kept(path)
    partly = cdsm.read_sweep(path)
    complete = partly.status != cdsm.SweepStatus.PENDING
    assert int(complete.sum()) == CHUNK * (writes // 5)  # four outputs, then the status
    for name in OUTPUTS:
        xr.testing.assert_equal(partly[name].where(complete), whole[name].where(complete))
    xr.testing.assert_identical(kept(path), whole)


def test_a_block_is_done_only_when_its_status_is_there(tmp_path: Path, whole: xr.Dataset) -> None:
    path = tmp_path / "s.zarr"
    kept(path)
    chunks = sorted(path.glob("status/c/**/*"))
    (path / "status/c/0/1/0/0/0").unlink()  # as if the run had stopped between the two
    (path / "margin/c/0/1/0/0/0").write_bytes((path / "margin/c/0/0/0/0/0").read_bytes())
    assert len(chunks) > 1
    xr.testing.assert_identical(kept(path), whole)


def test_a_missing_file_of_a_computed_block_is_named_and_computed_again(
    tmp_path: Path, whole: xr.Dataset, counted: list[int]
) -> None:
    path = tmp_path / "s.zarr"
    kept(path)
    del counted[:]
    for name in ("margin/c/0/1/0/0/0", "tip_position/c/0/1/0", "along/c/1/0/0/0/0/0"):
        (path / name).unlink()
    with pytest.raises(cdsm.FileError, match=r"s\.zarr/tip_position/c/0/1/0: is missing, al"):
        cdsm.read_sweep(path)
    xr.testing.assert_identical(kept(path), whole)
    assert counted == [2, 2]  # of six blocks
    # beyond the limits only tips and margins of NaN exist, for which there are no files
    assert bool((whole.status[2] == cdsm.SweepStatus.BEYOND_LIMITS).all())
    assert not (path / "margin/c/2/0/0/0/0").exists()
    xr.testing.assert_identical(cdsm.read_sweep(path), whole)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("margin/c/1/0/0/0/0", "Delete this file, then run the same sweep again"),
        ("status/c/1/0/0/0/0", "Delete this file, then run the same sweep again"),
        ("force/c/0/0", "Delete the store, and run the sweep again"),
    ],
)
def test_a_damaged_file_is_named_with_what_to_delete(
    name: str, remedy: str, tmp_path: Path, whole: xr.Dataset
) -> None:
    path = tmp_path / "s.zarr"
    kept(path)
    (path / name).write_bytes(b"damaged")
    said = rf"s\.zarr/{name}: is damaged \(.+\)\. {remedy}"
    with pytest.raises(cdsm.FileError, match=said):
        cdsm.read_sweep(path).load()
    with pytest.raises(cdsm.FileError, match=said):
        cdsm.write_sweep(kept(path), tmp_path / "s.nc")
    assert not (tmp_path / "s.nc").exists()
    (path / name).unlink()
    if "file" in remedy:
        xr.testing.assert_identical(kept(path), whole)


@pytest.mark.parametrize("version", [2, 3])
def test_a_sweep_that_xarray_wrote_is_read_but_not_resumed(
    version: Literal[2, 3], tmp_path: Path, whole: xr.Dataset
) -> None:
    path = tmp_path / "s.zarr"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the format of texts
        whole.to_zarr(path, zarr_format=version)
        xr.testing.assert_identical(cdsm.read_sweep(path), whole)
        with pytest.raises(cdsm.StoreError, match="was written by xarray; give another path"):
            kept(path)


def test_a_sweep_from_a_store_can_be_changed_in_memory_alone(tmp_path: Path) -> None:
    found = kept(tmp_path / "s.zarr")
    before = found.margin.values.copy()
    found.margin[0] = 7.0
    assert bool((found.margin[0] == 7.0).all())
    np.testing.assert_array_equal(cdsm.read_sweep(tmp_path / "s.zarr").margin, before)


def test_blocks_of_lost_workers_are_computed_when_asked_again(
    tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch, counted: list[int]
) -> None:
    path = tmp_path / "s.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(run, "evaluate", lambda *_: None)
        lost = kept(path)
    assert bool((lost.status == cdsm.SweepStatus.WORKER_LOST).all())
    assert bool(lost.tip_position.isnull().all())
    xr.testing.assert_identical(kept(path), whole)
    assert counted == [2] * 6


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"minimum": [1.0, 20.0, 61.0]}, r"minimum\[2\]: 60.0 in the store, 61.0 wanted"),
        ({"minimum": 20.0}, r"minimum: \[ 1. 20. 60.\] in the store, 20.0 wanted"),
        ({"maximum": 99.0}, "maximum: inf in the store, 99.0 wanted"),
        ({"wrench": np.zeros(6)}, "wrench: in the store alone"),
        ({"direction": (0, 0, 1)}, "direction: in the store alone"),
        ({"outputs": "margin"}, "outputs: along in the store alone"),
        ({"elasticity": STEEL}, "elasticity: in the store alone"),
        ({"elasticity": {"strand": STEEL, "steel": STEEL}}, "elasticity: .*StrandElasticity"),
        ({"arm": short_arm(spring=1e6)}, 'cables: .*"series_stiffness": null.* 1000000.0'),
        ({"q": cdsm.GridPoses({"joint1_1": [0.1]})}, "joint3_2: .* in the store, 0.0 wanted"),
        ({"q": np.zeros((1, 6))}, "pose: not in the store"),
    ],
)
def test_a_store_of_another_question_is_refused_with_the_difference(
    changes: dict[str, Any], said: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "shared.zarr"
    if not path.exists():
        kept(path)
    with pytest.raises(cdsm.StoreError, match=said) as caught:
        kept(path, **changes)
    assert caught.value.differences


def test_a_store_of_another_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept(tmp_path / "s.zarr")
    monkeypatch.setattr(description, "version", lambda _: "9.9")
    with pytest.raises(cdsm.StoreError, match=r"source: cdsm .* in the store, cdsm 9.9"):
        kept(tmp_path / "s.zarr")


def test_two_runs_cannot_write_to_one_store(tmp_path: Path) -> None:
    asked = specified()
    extent = extents(asked.poses.sizes, 4)
    again: dict[str, Any] = {"minimum": 9.0, "outputs": "margin"}
    with store.opened(tmp_path / "s.zarr", asked, extent):
        with pytest.raises(cdsm.StoreError, match="another run is writing to it"):
            cdsm.sweep(short_arm(), GRID, store=tmp_path / "s.zarr", **again)
        assert bool((cdsm.read_sweep(tmp_path / "s.zarr").status == 10).all())  # reading is fine
    cdsm.sweep(short_arm(), GRID, store=tmp_path / "s.zarr", **again)


def test_of_two_runs_that_make_a_store_at_once_the_first_one_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, asked = tmp_path / "s.zarr", specified()
    make, extent = store._make, extents(asked.poses.sizes, 4)
    first: list[int] = []

    def late(*arguments: Any) -> None:
        make(*arguments)
        first.append(path.stat().st_ino)
        make(*arguments)

    monkeypatch.setattr(store, "_make", late)
    with store.opened(path, asked, extent):
        assert first == [path.stat().st_ino]
    assert [each.name for each in tmp_path.iterdir()] == ["s.zarr"]


def nothing(path: Path) -> None:
    path.mkdir()


def a_file(path: Path) -> None:
    path.write_text("not a folder", encoding="utf-8")


def broken(path: Path) -> None:
    kept(path)
    (path / "margin" / "zarr.json").write_text("{", encoding="utf-8")


@pytest.mark.parametrize("prepare", [nothing, a_file, broken])
def test_what_is_no_store_is_named_and_left_alone(
    prepare: Callable[[Path], None], tmp_path: Path
) -> None:
    path = tmp_path / "s.zarr"
    prepare(path)
    before = sorted(tmp_path.glob("**/*"))
    with pytest.raises(cdsm.FileError, match=r"s\.zarr: "):
        kept(path)
    assert sorted(tmp_path.glob("**/*")) == before


def test_a_store_cannot_be_made_in_a_folder_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(cdsm.FileError, match=r"s\.zarr: the folder"):
        kept(tmp_path / "absent" / "s.zarr")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_refuses_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run, "_write", full)
    with pytest.raises(cdsm.FileError, match=r"s\.zarr: cannot be written: .*No space left"):
        kept(tmp_path / "s.zarr")


def test_a_law_of_another_function_is_another_question(tmp_path: Path) -> None:
    def swept(EA: float) -> xr.Dataset:
        law = cdsm.Elasticity.from_rigidity(lambda F: EA + 50.0 * F, 0.0, 5e3)
        arm = cdsm.Manipulator(short_arm().geometry, law)
        return cdsm.sweep(
            arm, GRID, minimum=20.0, outputs=["margin"], store=tmp_path / "s.zarr", progress=False
        )

    np.testing.assert_array_equal(swept(1e5).margin, swept(1e5).margin)
    with pytest.raises(cdsm.StoreError) as caught:
        swept(1e5 * (1.0 + 1e-9))
    assert len(caught.value.differences) == 1
    assert "cable_elasticities" in caught.value.differences[0]

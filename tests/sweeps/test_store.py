"""A sweep that was stopped goes on from what is on disk, to the same bits."""

import importlib
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
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


class Reticent(cdsm.Elasticity):
    """A law of the user's own that prints less than it depends on."""

    def __init__(self, rigidity: float) -> None:
        self.value = rigidity

    def __repr__(self) -> str:
        return "Reticent()"

    @property
    def domain(self) -> cdsm.Domain:
        return cdsm.Domain(0.0, 1e4)

    def rigidity(self, tension: Any) -> Any:
        return self.value + 0.0 * np.asarray(tension, dtype=np.float64)

    strain = rigidity
    energy = rigidity


def test_a_law_that_prints_alike_is_another_question(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    geometry = short_arm().geometry
    for rigidity in (1e5, 1e5):
        cdsm.sweep(
            cdsm.Manipulator(geometry, Reticent(rigidity)), GRID, outputs=["margin"], store=path
        )
    with pytest.raises(cdsm.StoreError):
        cdsm.sweep(cdsm.Manipulator(geometry, Reticent(1e3)), GRID, outputs=["margin"], store=path)


OWN = """
import numpy as np
import cdsm

class Own(cdsm.Elasticity):
    domain = cdsm.Domain({low}, {high})

    def rigidity(self, tension):
        F = np.asarray(tension, dtype=np.float64)
        return {factor} * (1e5 + 50.0 * F) + {bump} * ((F > {low}) & (F < 100.0))

    def strain(self, tension):
        F = np.asarray(tension, dtype=np.float64)
        return {stretch} * np.log1p(F / 2e3) / 50.0

    energy = strain
"""
"""A module of the user's own, to be edited between two runs."""

AS_IT_WAS = {"factor": 1.0, "bump": 0.0, "stretch": 1.0, "low": 0.0, "high": 5e3}


def own_law(folder: Path, patch: pytest.MonkeyPatch, **changes: float) -> cdsm.Elasticity:
    """The law of a module that has been written anew."""
    (folder / "own_law.py").write_text(OWN.format(**AS_IT_WAS | changes), encoding="utf-8")
    patch.syspath_prepend(folder)
    patch.setattr(sys, "dont_write_bytecode", True)
    patch.delitem(sys.modules, "own_law", raising=False)
    importlib.invalidate_caches()
    law: cdsm.Elasticity = importlib.import_module("own_law").Own()
    return law


@pytest.mark.parametrize("given", ["by the arm", "by name"])
@pytest.mark.parametrize(
    "change",
    [
        {"factor": 3.0},
        {"factor": 1.0 + 2.0**-50},
        {"bump": 1e-9},
        {"stretch": 1.01},
        {"low": 1e-3},
        {"high": 4999.0},
    ],
)
def test_a_law_whose_code_has_changed_is_noticed(
    given: str, change: dict[str, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def swept(**changes: float) -> xr.Dataset:
        law = own_law(tmp_path, monkeypatch, **changes)
        by_name = given == "by name"
        arm = short_arm() if by_name else cdsm.Manipulator(short_arm().geometry, law)
        return cdsm.sweep(
            arm,
            GRID,
            minimum=20.0,
            outputs=["margin"],
            elasticity={"mine": law, "other": STEEL} if by_name else None,
            store=tmp_path / "s.zarr",
            progress=False,
        )

    before = swept().margin.values
    np.testing.assert_array_equal(swept().margin.values, before)  # the same code, loaded again
    with pytest.raises(cdsm.StoreError) as caught:
        swept(**change)
    assert len(caught.value.differences) == 1
    attribute = "elasticity" if given == "by name" else "cable_elasticities"
    assert f"{attribute}: own_law.Own answers otherwise" in caught.value.differences[0]
    assert "its code has changed" in str(caught.value)
    np.testing.assert_array_equal(swept().margin.values, before)  # and changed back


def test_a_law_of_ones_own_is_described_alike_in_every_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = description.law_text(own_law(tmp_path, monkeypatch))
    script = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "from own_law import Own; from cdsm.sweeps.description import law_text\n"
        "print(law_text(Own()))"
    )
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", script],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == here


class Partial(Reticent):
    """A law that has no answer at some tensions of its domain, and takes one number at a time."""

    def rigidity(self, tension: Any) -> Any:
        (force,) = np.asarray(tension)
        if 10.0 < force < 20.0:
            raise cdsm.ElasticityRangeError("not here", [force])
        return np.array([np.nan if force > 5e3 else self.value])

    def strain(self, tension: Any) -> Any:
        raise NotImplementedError

    energy = strain


def test_a_law_need_not_answer_everywhere_to_be_described() -> None:
    text = description.law_text(Partial(1e5))
    assert text == description.law_text(Partial(1e5))
    assert text != description.law_text(Partial(1e4))


def test_what_differs_otherwise_is_no_change_of_code() -> None:
    one, other = (description.law_text(Reticent(value)) for value in (1e5, 1e4))
    assert description.changed_laws(one, other) == ()
    assert description.changed_laws(one, one) == ()
    assert description.changed_laws(repr(STEEL), repr(STEEL)) == ()


def test_bounds_of_a_cable_are_part_of_the_question(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    arm = short_arm()
    cdsm.sweep(arm, GRID, outputs=["margin"], store=path)
    tight = arm.with_cables([replace(cable, maximum=300.0) for cable in arm.cables])
    with pytest.raises(cdsm.StoreError):
        cdsm.sweep(tight, GRID, outputs=["margin"], store=path)

"""Sweeps as files: NetCDF to the same bits, CSV as a table anyone can read."""

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import cdsm
from cdsm.support.values import Array
from cdsm.sweeps import export
from tests.support.sweeps import CASES, EVERYTHING, GRID, short_arm


@pytest.fixture(scope="module")
def everything() -> xr.Dataset:
    return cdsm.sweep(short_arm(), GRID, outputs=EVERYTHING, **CASES)


def test_netcdf_gives_the_same_sweep_back(tmp_path: Path, everything: xr.Dataset) -> None:
    path = cdsm.write_sweep(everything, tmp_path / "s.nc")
    again = cdsm.read_sweep(path)
    xr.testing.assert_identical(again, everything)
    assert again.status.dtype == np.int8
    xr.testing.assert_identical(cdsm.read_sweep(cdsm.write_sweep(again, path)), everything)
    assert [each.name for each in tmp_path.iterdir()] == ["s.nc"]


def test_a_store_can_be_read_and_written_as_netcdf(tmp_path: Path, everything: xr.Dataset) -> None:
    store = tmp_path / "s.zarr"
    kept = cdsm.sweep(short_arm(), GRID, outputs=EVERYTHING, store=store, **CASES)
    cdsm.write_sweep(kept, tmp_path / "s.nc")
    xr.testing.assert_identical(cdsm.read_sweep(tmp_path / "s.nc"), everything)
    xr.testing.assert_identical(cdsm.read_sweep(store), everything)


SHOWN = ("tip_position", "tension", "margin", "along", "isotropy", "joint_stiffness")


def read(path: Path) -> dict[str, list[str]]:
    """The columns of a table."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return {name: [row[i] for row in rows] for i, name in enumerate(header)}


def numbers(column: list[str]) -> Array:
    return np.array([float(cell or "nan") for cell in column])


@pytest.mark.parametrize("rows", [7, 2**16])
def test_csv_has_a_row_for_each_entry_and_a_column_for_each_component(
    rows: int, tmp_path: Path, everything: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "_ROWS", rows)
    shown = [*SHOWN, "status"]
    table = read(cdsm.write_sweep(everything[shown], tmp_path / "s.csv"))
    names = everything.status.attrs["flag_meanings"].split()
    assert table["status"] == [names[i] for i in everything.status.values.ravel()]

    def column(name: str, *at: str) -> Array:
        variable = everything[name]
        inner = [dim for dim in variable.dims if dim not in everything.status.dims]
        picked = variable.sel(dict(zip(inner, at, strict=True)), drop=True)
        full = xr.broadcast(picked, everything.status)[0].transpose(*everything.status.dims)
        return np.asarray(full.values.ravel())

    for header, expected in (
        ("joint1_1 [rad]", column("joint1_1")),
        ("joint2_1 [rad]", column("joint2_1")),
        ("minimum [N]", column("minimum")),
        ("force_z [N]", column("force", "z")),
        ("tip_position_y [m]", column("tip_position", "y")),
        ("tension_cable2_3 [N]", column("tension", "cable2_3")),
        ("margin [N m rad-1]", column("margin")),
        ("along_z [N m-1]", column("along", "z")),
        ("isotropy", column("isotropy")),
        (
            "joint_stiffness_joint1_1_joint2_2 [N m rad-1]",
            column("joint_stiffness", "joint1_1", "joint2_2"),
        ),
    ):
        np.testing.assert_array_equal(numbers(table[header]), expected, err_msg=header)
    assert table["elasticity"] == column("elasticity").tolist()


def test_csv_of_a_single_entry_and_of_a_list_of_postures(tmp_path: Path) -> None:
    found = cdsm.sweep(short_arm(), np.full((3, 6), 0.1), minimum=20.0)
    table = read(cdsm.write_sweep(found, tmp_path / "s.csv"))
    assert table["pose"] == ["0", "1", "2"]
    assert table["q_joint2_2 [rad]"] == ["0.1"] * 3
    one = read(cdsm.write_sweep(found.isel(pose=1), tmp_path / "s.csv"))
    np.testing.assert_array_equal(numbers(one["margin [N m rad-1]"]), found.margin[1])


def test_what_is_no_sweep_is_named(tmp_path: Path, everything: xr.Dataset) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"ends neither in \.nc \(NetCDF\) nor in \.csv"):
        cdsm.write_sweep(everything, tmp_path / "s.txt")
    with pytest.raises(cdsm.FileError, match=r"the folder .*absent does not exist"):
        cdsm.write_sweep(everything, tmp_path / "absent" / "s.nc")
    with pytest.raises(cdsm.InvalidInput, match="the Dataset of a sweep is needed"):
        cdsm.write_sweep(3, tmp_path / "s.nc")  # type: ignore[arg-type]
    with pytest.raises(cdsm.InvalidInput, match="has no status"):
        cdsm.write_sweep(xr.Dataset({"a": 1.0}), tmp_path / "s.nc")
    with pytest.raises(cdsm.FileError, match=r"absent\.nc: does not exist"):
        cdsm.read_sweep(tmp_path / "absent.nc")
    (tmp_path / "text.nc").write_text("no", encoding="utf-8")
    with pytest.raises(cdsm.FileError, match=r"text\.nc: cannot be read as NetCDF"):
        cdsm.read_sweep(tmp_path / "text.nc")
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
    with pytest.raises(cdsm.FileError, match=r"other\.nc: is not a sweep of cdsm"):
        cdsm.read_sweep(tmp_path / "other.nc")


def test_a_failure_leaves_the_old_file(
    tmp_path: Path, everything: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "s.csv"
    path.write_text("old", encoding="utf-8")

    def broken(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(export, "tidy", broken)
    with pytest.raises(cdsm.FileError, match="No space left"):
        cdsm.write_sweep(everything, path)
    assert path.read_text(encoding="utf-8") == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["s.csv"]

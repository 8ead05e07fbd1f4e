"""Write and read files of sweeps: NetCDF with the complete Dataset, or CSV with a long table."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from cdsm.errors import FileError, InvalidInput
from cdsm.support.extras import need
from cdsm.support.files import as_path, write_file
from cdsm.support.tidy import check_sweep, checked_suffix, tidy, write_netcdf

if TYPE_CHECKING:
    import pandas
    import xarray

_ROWS = 2**16  # number of rows of a CSV table built at once


def write_sweep(dataset: xarray.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a sweep to a file, completely or not at all; return the path.

    Args:
        dataset: Result of :func:`~cdsm.sweeps.run.sweep`, or a part of it.
        path: The file; replaced if it exists. ``.nc`` writes NetCDF, which :func:`read_sweep` reads
            back bit by bit. ``.csv`` writes a row for each posture and case (elasticity, wrench and
            minimum). Each coordinate and each component of an output is a column, with the SI unit
            in the header. The status is a word; a value that does not exist is an empty cell.

    Raises:
        InvalidInput: ``dataset`` is not a sweep, or its status has a number without a word; or
            ``path`` ends neither in ``.nc`` nor in ``.csv``.
        MissingExtra: xarray or netCDF4 is not installed.
        FileError: The file cannot be written.
    """
    check_sweep(dataset)
    write = _write_table if checked_suffix(path) == ".csv" else write_netcdf
    return write_file(path, lambda aside: write(dataset, aside))


def sweep_to_pandas(dataset: xarray.Dataset) -> pandas.DataFrame:
    """Return a sweep as a table: a row for each posture and case, a column for each component.

    A case is a combination of elasticity, wrench and minimum. The columns are those of the CSV file
    of :func:`write_sweep`, with the SI unit in each name. The status is a word; a value that does
    not exist is NaN.

    Args:
        dataset: Result of :func:`~cdsm.sweeps.run.sweep`, or a part of it.

    Raises:
        InvalidInput: ``dataset`` is not a sweep, or its status has a number without a word.
        MissingExtra: xarray is not installed.
    """
    check_sweep(dataset)
    return tidy(dataset)


def read_sweep(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Read a sweep from a NetCDF file or from the folder of its store.

    Args:
        path: The ``.nc`` file of :func:`write_sweep`, or the folder given as ``store=``, even while
            its sweep is running; or a Zarr folder that xarray wrote.

    Raises:
        MissingExtra: xarray, netCDF4 or zarr is needed and not installed.
        FileError: The file does not exist, cannot be read, or is not a sweep; a file of the store
            is missing, or damaged (then also when its numbers are read).
    """
    need("sweep", "xarray")
    path = as_path(path)
    if path.is_dir():
        need("sweep", "zarr")
        from cdsm.sweeps import store  # needs zarr

        dataset = store.read(path)
    else:
        dataset = _read_netcdf(path)
    try:
        check_sweep(dataset)
    except InvalidInput:
        raise FileError(path, "is not a sweep of cdsm: it has no status.") from None
    return dataset


def _read_netcdf(path: Path) -> xarray.Dataset:
    need("sweep", "netCDF4")
    import xarray

    if not path.exists():
        raise FileError(path, f"does not exist (looked in {Path.cwd()}).")
    if not path.is_file():  # opening a pipe without a writer would wait forever
        raise FileError(path, "is not a regular file; give the path of a file.")
    try:
        with xarray.open_dataset(path, engine="netcdf4") as dataset:
            return dataset.load()
    except Exception as error:  # netCDF4 and xarray may raise anything
        given = "give the .nc of a sweep, or the folder of its store"
        raise FileError(path, f"cannot be read as NetCDF: {error}; {given}.") from None


def _write_table(dataset: xarray.Dataset, path: Path) -> None:
    status = dataset["status"]
    dim, size = next(iter(status.sizes.items()), (None, 1))
    step = max(1, _ROWS * size // max(1, status.size))
    with path.open("w", encoding="utf-8", newline="") as file:
        for start in range(0, size, step):
            part = dataset if dim is None else dataset.isel({dim: slice(start, start + step)})
            tidy(part).to_csv(file, index=False, header=start == 0, lineterminator="\n")

"""Files of sweeps: NetCDF, CSV, and stores, which are Zarr folders that a stopped run fills up.

A store is made with all coordinates and a ``status`` that is pending. A chunk of postures is then
one region of each variable; its ``status`` is written last.
"""

from __future__ import annotations

import logging
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from cdsm.errors import CdsmError, FileError, need
from cdsm.support.files import as_path, require_folder
from cdsm.support.progress import progress_bar
from cdsm.support.result import write_labelled
from cdsm.support.status import Status, check_sweep, tidy
from cdsm.sweeps.cases import Cases
from cdsm.sweeps.quantities import QUANTITIES

if TYPE_CHECKING:
    import xarray

_AT_ONCE = 8  # chunks that dask computes before they are written

_log = logging.getLogger("cdsm")


def write_sweep(dataset: xarray.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a sweep to a file, completely or not at all; return the path.

    Args:
        dataset: Result of :func:`~cdsm.sweep`, or a part of it.
        path: The file; replaced if it exists. ``.nc`` is NetCDF, which :func:`read_sweep` reads.
            ``.csv`` has a row for each posture and case, and a column for each coordinate and each
            component of an output, with the SI unit in the header. The status is a word.

    Raises:
        InvalidInput: ``dataset`` is not a sweep, or its status has a number without a word; or
            ``path`` ends neither in ``.nc`` nor in ``.csv``.
        CdsmError: xarray or netCDF4 is not installed.
        FileError: The file cannot be written.
    """
    check_sweep(dataset)

    def table() -> Any:
        rows = tidy(dataset)
        return rows.set_index(rows.columns[0])

    return write_labelled(path, table, dataset.drop_encoding)


def read_sweep(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Read a sweep from a NetCDF file or from the folder of its store.

    Args:
        path: The ``.nc`` file of :func:`write_sweep`, or the folder given as ``store=``, even while
            its sweep is running; its numbers are read when needed.

    Raises:
        CdsmError: xarray, netCDF4 or zarr is needed and not installed.
        FileError: The file does not exist, cannot be read, or is not a sweep.
    """
    path = as_path(path)
    need("sweep", "xarray", "zarr" if path.is_dir() else "netCDF4")
    import xarray

    if not path.exists():
        raise FileError(path, f"does not exist (looked in {Path.cwd()}).")
    try:
        if path.is_dir():
            found = xarray.open_dataset(path, engine="zarr", consolidated=False)
        elif path.is_file():  # opening a pipe without a writer would wait forever
            with xarray.open_dataset(path, engine="netcdf4") as dataset:
                found = dataset.load()
        else:
            raise FileError(path, "is not a regular file; give the path of a file.")
        check_sweep(found)
    except CdsmError as error:
        raise FileError(path, f"is not a sweep of cdsm: {error}") from None
    except Exception as error:  # netCDF4, zarr and xarray may raise anything
        given = "give the .nc of a sweep, or the folder of its store"
        raise FileError(path, f"cannot be read as NetCDF or Zarr: {error}; {given}.") from None
    rank = {name: i for i, name in enumerate((*QUANTITIES, "status"))}  # a folder has no order
    # what zarr makes of names, some versions of xarray cannot write to NetCDF
    names = {name: each for name, each in found.coords.items() if each.dtype.kind == "T"}
    found = found.assign_coords({name: each.astype(object) for name, each in names.items()})
    variables = sorted(found.data_vars, key=lambda name: rank.get(str(name), -1))
    return xarray.Dataset({name: found[name] for name in variables}, found.coords, found.attrs)


def stored(
    path: Path, cases: Cases, q: xarray.DataArray, by_dask: bool, progress: bool
) -> xarray.Dataset:
    """Compute what a store lacks, chunk by chunk; return the sweep that it then has.

    ``q`` is chunked. If ``by_dask``, the chunks are computed by dask, else in this process.
    """
    import dask.array

    lazy: Any = dask  # untyped
    try:
        if is_new := not path.exists():
            _make(path, cases.dataset(q))
        kept = read_sweep(path)
        sizes, dims = kept["status"].encoding["preferred_chunks"], q.dims[:-1]
        q = q.chunk({dim: sizes.get(dim, -1) for dim in dims})
        if not is_new:
            _require_same(path, kept.chunk(sizes), cases.dataset(q))  # chunk by chunk
        status, names = kept["status"].load(), [*kept.coords]
        slices = lazy.array.core.slices_from_chunks(tuple(q.chunksizes[dim] for dim in dims))
        regions = [dict(zip(dims, part, strict=True)) for part in slices]
        todo = [each for each in regions if (status.isel(each) == Status.PENDING).any()]
        if len(todo) < len(regions):
            shown = cases.arm.name, len(regions) - len(todo), len(regions)
            _log.warning("sweep of %s resumes: %d of %d chunks are kept", *shown)
        many = _AT_ONCE if by_dask else 1
        with progress_bar("sweep", len(todo), wanted=progress) as advance:
            for some in (todo[i : i + many] for i in range(0, len(todo), many)):
                angles = [q.isel(region) for region in some]
                if not by_dask:  # a Dataset of numbers is computed at once, by all threads
                    angles = lazy.compute(*angles, scheduler="synchronous")
                parts = lazy.compute(*(cases.dataset(each).drop_vars(names) for each in angles))
                for region, part in zip(some, parts, strict=True):
                    for each in (part.drop_vars("status"), part[["status"]]):  # status last
                        each.to_zarr(path, region=region, consolidated=False)
                    advance(1)
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be written: {error}.") from error
    return read_sweep(path)


def _make(path: Path, template: xarray.Dataset) -> None:
    """Make a store with the coordinates of a lazy sweep, in which every entry is pending."""
    require_folder(path)  # zarr would create it
    encoding = {"status": {"fill_value": np.int8(Status.PENDING)}}
    with TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as aside:
        made = Path(aside) / "store"
        template.to_zarr(made, compute=False, consolidated=False, encoding=encoding)
        template.coords.to_dataset().to_zarr(made, mode="r+", consolidated=False)
        made.rename(path)


def _require_same(path: Path, kept: xarray.Dataset, wanted: xarray.Dataset) -> None:
    """Raise FileError if a store has other outputs, coordinates or attributes than are wanted."""
    import xarray

    both = [
        each.drop_vars([*each.data_vars]).assign_attrs(source="", outputs=sorted(map(str, each)))
        for each in (kept, wanted)
    ]
    try:
        xarray.testing.assert_identical(*both)
    except AssertionError as difference:
        said = f"{difference}".replace("Left", "Store (L)").replace("right", "wanted sweep (R)")
        remedy = "Repeat that one, or give another path to store="
        raise FileError(path, f"contains another sweep. {remedy}.\n{said}") from None

"""Files of sweeps: NetCDF and CSV, and the Zarr folders of stores."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdsm.errors import CdsmError, FileError, need
from cdsm.quantities import names_of
from cdsm.support.files import as_path, missing_file
from cdsm.support.result import write_labelled
from cdsm.support.status import check_sweep, tidy

if TYPE_CHECKING:
    import xarray


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

    Example:
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> data = cdsm.sweep(arm, cdsm.RandomPoses(20), minimum=5.0, progress=False)
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder, "sweep.nc")
        ...     _ = data.to_netcdf(path)
        ...     again = cdsm.read_sweep(path)
        >>> again.sizes["pose"]
        20
    """
    path = as_path(path)
    need("sweep", "xarray", "zarr" if path.is_dir() else "netCDF4")
    import xarray

    if not path.exists():
        raise missing_file(path)
    try:
        if path.is_dir():
            dataset = xarray.open_dataset(path, engine="zarr", consolidated=False)
        else:
            with xarray.open_dataset(path, engine="netcdf4") as file:
                dataset = file.load()
        check_sweep(dataset)
    except CdsmError as error:
        raise FileError(path, f"is not a sweep of cdsm: {error}") from None
    except Exception as error:  # netCDF4, zarr and xarray may raise anything
        remedy = "give the .nc of a sweep, or the folder of its store"
        raise FileError(path, f"cannot be read as NetCDF or Zarr: {error}; {remedy}.") from None
    order = (*names_of("sweep"), "status")  # a folder has none
    rank = {name: i for i, name in enumerate(order)}
    # what zarr makes of names, some versions of xarray cannot write to NetCDF
    labels = {name: labels for name, labels in dataset.coords.items() if labels.dtype.kind == "T"}
    dataset = dataset.assign_coords({name: x.astype(object) for name, x in labels.items()})
    names = sorted(dataset.data_vars, key=lambda name: rank.get(str(name), -1))
    coordinates = {name: dataset.coords[name] for name in sorted(dataset.coords, key=str)}
    variables = {name: dataset[name].variable for name in names}  # without their coordinates
    return xarray.Dataset(variables, coordinates, dataset.attrs)

"""Turn results into labelled data: pandas tables and xarray Datasets."""

from __future__ import annotations

import itertools
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput, need
from cdsm.support.files import as_path, write_file

if TYPE_CHECKING:
    import pandas
    import xarray


def data_frame(
    columns: Mapping[str, NDArray[Any] | Sequence[object]],
    index: str,
    labels: NDArray[Any] | Sequence[object],
) -> pandas.DataFrame:
    """Build a pandas table from columns by name; ``labels`` are its index, called ``index``."""
    need("sweep", "pandas")
    import pandas

    return pandas.DataFrame(dict(columns), index=pandas.Index(labels, name=index))


def dataset(
    variables: Mapping[str, tuple[Sequence[str], NDArray[Any], str]],
    labels: Mapping[str, Sequence[object] | NDArray[Any]],
    **attributes: str,
) -> xarray.Dataset:
    """Build a Dataset from variables, given as (dimensions, values, SI unit) by name.

    ``labels`` are the coordinates of the dimensions; those that no variable has are left out.
    """
    need("sweep", "xarray")
    import xarray

    used = {dim for dims, _, _ in variables.values() for dim in dims}
    return xarray.Dataset(
        {
            name: (tuple(dims), values.copy(), {"units": unit})
            for name, (dims, values, unit) in variables.items()
        },
        {dim: list(values) for dim, values in labels.items() if dim in used},
        attributes,
    )


def write_labelled(
    path: str | os.PathLike[str],
    table: Callable[[], pandas.DataFrame],
    labelled: Callable[[], xarray.Dataset],
) -> Path:
    """Write ``table()`` to a ``.csv`` or ``labelled()`` to a ``.nc``; only this one is called."""
    if checked_suffix(path) == ".csv":
        return write_file(path, table().to_csv)
    data = labelled()
    return write_file(path, lambda aside: write_netcdf(data, aside))


def write_netcdf(dataset: xarray.Dataset, path: Path) -> None:
    """Write a Dataset to a NetCDF file; on failure, OSError also gives the free disk space."""
    try:
        dataset.to_netcdf(path, engine="netcdf4")
    except (RuntimeError, PermissionError) as error:  # HDF5 does not report a full disk
        free = shutil.disk_usage(path.parent).free
        raise OSError(f"{error} ({free} bytes are free there)") from None


def checked_suffix(path: str | os.PathLike[str]) -> str:
    """Return the suffix of a path, ``.csv`` or ``.nc``; raise InvalidInput for any other."""
    suffix = as_path(path).suffix.lower()
    if suffix not in (".nc", ".csv"):
        raise InvalidInput("path", f"{str(path)!r} ends neither in .nc (NetCDF) nor in .csv.")
    if suffix == ".nc":
        need("sweep", "netCDF4")
    return suffix


def check_sweep(dataset: object) -> None:
    """Raise :class:`~cdsm.InvalidInput` if an object is not the Dataset of a sweep."""
    need("sweep", "xarray")
    import xarray

    if not isinstance(dataset, xarray.Dataset):
        raise InvalidInput("dataset", f"{dataset!r} given; the Dataset of a sweep is needed.")
    if not {"flag_values", "flag_meanings"} <= set(dataset.get("status", xarray.DataArray()).attrs):
        raise InvalidInput("dataset", "has no status; the Dataset of a sweep is needed.")


def status_names(dataset: xarray.Dataset) -> dict[int, str]:
    """Return the name of each status of a sweep by its number, read from the attributes."""
    flags = dataset["status"].attrs
    values = np.atleast_1d(flags["flag_values"]).tolist()
    return dict(zip(values, flags["flag_meanings"].split(), strict=False))


def tidy(dataset: xarray.Dataset) -> pandas.DataFrame:
    """Turn the Dataset of a sweep into a pandas table with a row for each entry of ``status``.

    The columns are the components of all variables; their names contain the unit.
    """
    import pandas

    if not dataset["status"].ndim:
        dataset = dataset.expand_dims("entry")
    status = dataset["status"]
    columns: dict[str, NDArray[Any]] = {}
    for name in (*dataset.coords, *dataset.data_vars):
        variable = dataset[name]
        if name == "status" or (variable.dims == (name,) and name not in status.dims):
            continue  # coordinates of components appear in the names of the columns
        units = f" [{variable.units}]" if variable.attrs.get("units", "1") != "1" else ""
        inner = [dim for dim in variable.dims if dim not in status.dims]
        # along dimensions that the variable lacks, its values are repeated
        full = variable.broadcast_like(status).transpose(*status.dims, *inner).values
        labels = itertools.product(*(variable[dim].values.tolist() for dim in inner))
        for label, column in zip(labels, full.reshape(status.size, -1).T, strict=True):
            columns["_".join(map(str, (name, *label))) + units] = column
    words = status_names(dataset)
    columns["status"] = np.array([words.get(k, str(k)) for k in status.values.ravel().tolist()])
    return pandas.DataFrame(columns)

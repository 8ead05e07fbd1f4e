"""Datasets of sweeps, and the status of their entries."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput, need
from cdsm.status import ENTRY_STATUSES, Status
from cdsm.support.format import plural

if TYPE_CHECKING:
    import pandas
    import xarray


def summary(status: NDArray[np.uint8]) -> str:
    """Count the postures with each status in a text: ``9 postures: 8 OK, 1 SINGULAR``."""
    counts = np.bincount(status, minlength=len(ENTRY_STATUSES))
    parts = [
        f"{counts[cause]} {cause.name}"
        for cause in ENTRY_STATUSES
        if counts[cause] or cause == Status.OK
    ]
    return f"{plural(len(status), 'posture')}: {', '.join(parts)}"


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
    # coordinates that are read from a store come in any order
    coordinates = sorted(dataset.coords, key=lambda name: (name not in status.dims, str(name)))
    for name in (*coordinates, *dataset.data_vars):
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

"""Checks of the Dataset of a sweep: it needs a status with a word for each number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.extras import need

if TYPE_CHECKING:
    import xarray


def check_sweep(dataset: object) -> None:
    """Check that an object is the Dataset of a sweep.

    Raises:
        MissingExtra: xarray is not installed.
        InvalidInput: The object is not a Dataset, or has no status.
    """
    need("sweep", "xarray")
    import xarray

    if not isinstance(dataset, xarray.Dataset):
        raise InvalidInput("dataset", f"{dataset!r} given; the Dataset of a sweep is needed.")
    if "flag_meanings" not in dataset.get("status", xarray.DataArray()).attrs:
        raise InvalidInput("dataset", "has no status; the Dataset of a sweep is needed.")


def status_names(dataset: xarray.Dataset) -> dict[int, str]:
    """Return the word for each number of ``status``, read from the Dataset.

    Raises:
        InvalidInput: The Dataset does not have one word for each number.
    """
    flags = dataset["status"].attrs
    try:
        values = np.atleast_1d(flags["flag_values"]).tolist()
        return dict(zip(values, flags["flag_meanings"].split(), strict=True))
    except (KeyError, AttributeError, TypeError, ValueError):
        raise InvalidInput(
            "dataset", "its status has no word for each number; the Dataset of a sweep is needed."
        ) from None

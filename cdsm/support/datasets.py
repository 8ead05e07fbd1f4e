"""Checks of the xarray Dataset of a sweep: its ``status`` must have a word for each number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.extras import need

if TYPE_CHECKING:
    import xarray


def check_sweep(dataset: object) -> None:
    """Raise :class:`~cdsm.InvalidInput` if an object is not the Dataset of a sweep."""
    need("sweep", "xarray")
    import xarray

    if not isinstance(dataset, xarray.Dataset):
        raise InvalidInput("dataset", f"{dataset!r} given; the Dataset of a sweep is needed.")
    if "flag_meanings" not in dataset.get("status", xarray.DataArray()).attrs:
        raise InvalidInput("dataset", "has no status; the Dataset of a sweep is needed.")


def status_names(dataset: xarray.Dataset) -> dict[int, str]:
    """Return the word for each value of a sweep's ``status``; InvalidInput if there are none."""
    flags = dataset["status"].attrs
    try:
        values = np.atleast_1d(flags["flag_values"]).tolist()
        return dict(zip(values, flags["flag_meanings"].split(), strict=True))
    except (KeyError, AttributeError, TypeError, ValueError):
        raise InvalidInput(
            "dataset", "its status has no word for each number; the Dataset of a sweep is needed."
        ) from None

"""What the Dataset of a sweep must hold: a status, with a word for each of its numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.extras import need

if TYPE_CHECKING:
    import xarray


def check_sweep(dataset: object) -> None:
    """Raise what is wrong with a sweep.

    Raises:
        MissingExtra: xarray is not installed.
        InvalidInput: Not a Dataset with a status.
    """
    need("sweep", "xarray")
    import xarray

    if not isinstance(dataset, xarray.Dataset):
        raise InvalidInput("dataset", f"{dataset!r} given; the Dataset of a sweep is needed.")
    if "flag_meanings" not in dataset.get("status", xarray.DataArray()).attrs:
        raise InvalidInput("dataset", "has no status; the Dataset of a sweep is needed.")


def status_names(dataset: xarray.Dataset) -> dict[int, str]:
    """The words for the numbers of ``status``, as the Dataset itself has them.

    Raises:
        InvalidInput: They are not one word for each number.
    """
    flags = dataset["status"].attrs
    try:
        values = np.atleast_1d(flags["flag_values"]).tolist()
        return dict(zip(values, flags["flag_meanings"].split(), strict=True))
    except (KeyError, AttributeError, TypeError, ValueError):
        raise InvalidInput(
            "dataset", "its status has no word for each number; the Dataset of a sweep is needed."
        ) from None

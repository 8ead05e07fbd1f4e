"""Labelled Dataset with the results of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.sweeps.quantities import LOST, QUANTITIES, SweepStatus
from cdsm.sweeps.specification import Specification

if TYPE_CHECKING:
    from typing import Any

    import xarray

_OF_SLIDES = {"N m": "N", "N m rad-1": "N m-1"}
"""Units of torque and joint stiffness for joints that turn, and for joints that slide."""

EMPTY = {"status": np.int8(SweepStatus.PENDING)}
"""Initial value of ``status``; the initial value of all outputs is NaN."""


def empty(specification: Specification, name: str) -> NDArray[Any]:
    """Build an array for an output or ``status``, filled with its initial value."""
    try:
        return np.full(specification.shape(name), EMPTY.get(name, np.float64(np.nan)))
    except (MemoryError, ValueError):  # numpy raises ValueError for sizes beyond all memory
        entries = " x ".join(map(str, specification.shape(name)))
        raise InvalidInput(
            "outputs",
            f"{name} has {entries} entries, more than fits into memory; ask for less, or give "
            "store= a path.",
        ) from None


def to_dataset(specification: Specification, values: Mapping[str, NDArray[Any]]) -> xarray.Dataset:
    """Build a Dataset with the coordinates of a specification and the given outputs."""
    import xarray

    labels = specification.labels.items()
    dataset = xarray.Dataset(
        coords={name: (label.dims, label.values, label.attributes) for name, label in labels},
        attrs=dict(specification.attributes),
    )
    return dataset.assign(
        {
            name: (specification.dims(name), array, variable_attributes(specification, name))
            for name, array in values.items()
        }
    )


def variable_attributes(specification: Specification, name: str) -> dict[str, Any]:
    """Return the attributes of an output or of ``status`` in the Dataset."""
    if name != "status":
        quantity = QUANTITIES[name]
        units = _units(quantity.units, specification.task.arm.slides)
        return {"long_name": quantity.long_name, "units": units}
    outputs = specification.task.outputs
    lost = {
        kind: [name for name in outputs if QUANTITIES[name].stage in LOST[kind]]
        for kind in SweepStatus
    }
    missing = "; ".join(
        f"{kind.name.lower()}: {', '.join(lost[kind])}" for kind in lost if lost[kind]
    )
    return {
        "long_name": "what became of the entry",
        "units": "1",
        "flag_values": [int(kind) for kind in SweepStatus],
        "flag_meanings": " ".join(kind.name.lower() for kind in SweepStatus),
        "comment": f"NaN stands only where the status says so, in: {missing or 'nothing'}",
    }


def _units(turning: str, slides: NDArray[np.bool_]) -> str:
    """Return the units of a quantity for an arm whose joints turn or slide."""
    sliding = _OF_SLIDES.get(turning)
    if sliding is None or not slides.any():
        return turning
    return sliding if slides.all() else f"{turning} or {sliding}"

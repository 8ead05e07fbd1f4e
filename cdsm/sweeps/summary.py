"""What a sweep found, in a few lines: quantiles of its quantities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.quantities import QUANTITIES, display_for, si_of
from cdsm.support.format import aligned, largest_finite, one_unit, span
from cdsm.support.status import status_names
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

_SHARES: Final = {"least": 0.0, "5 %": 0.05, "median": 0.5, "95 %": 0.95, "most": 1.0}
"""Quantiles that are printed, by the head of their column."""


def numbers_of(dataset: xarray.Dataset) -> dict[str, tuple[str, Array]]:
    """Return the unit for people and the values of each quantity with one number an entry.

    The values (N,) are those that exist. A quantity with several directions has one for each.
    """
    entry = dataset["status"].dims
    numbers: dict[str, tuple[str, Array]] = {}
    for name in (name for name in dataset.data_vars if name in QUANTITIES):
        variable = dataset[name]
        columns: dict[str, Array] = {}
        if {*variable.dims} - {*entry} == {"direction"}:
            columns = {f"{name} {u}": part.values for u, part in variable.groupby("direction")}
        elif {*variable.dims} <= {*entry}:
            columns = {str(name): variable.values}
        for label, values in columns.items():
            unit, size = display_for(si_of(variable.units), largest_finite(values))
            numbers[label] = one_unit(unit.strip("1")), _existing(values / size)
    return numbers


def _existing(values: Array) -> Array:
    return values[~np.isnan(values)]


def quantile_lines(dataset: xarray.Dataset) -> list[str]:
    """Return quantiles of each quantity with one number an entry, as aligned lines."""
    rows = [("quantiles", "unit", *_SHARES, "entries")]
    for name, (unit, values) in numbers_of(dataset).items():
        if values.size:
            # of the values themselves: some may be infinite
            levels = np.quantile(values, [*_SHARES.values()], method="inverted_cdf")
            rows.append((name, unit, *(f"{x:.4g}" for x in levels), str(values.size)))
    return aligned(rows) if len(rows) > 1 else []


def curve_lines(dataset: xarray.Dataset) -> list[str]:
    """Return each quantity with one number an entry against the bounds that held, as lines.

    The only dimension of the entries is ``minimum``.
    """
    words = status_names(dataset)
    held = [span(low, "{:g}".format) for low in dataset["minimum_held"].values]
    columns: list[tuple[str, ...]] = [("least tension [N]", *held)]
    for name in (name for name in dataset.data_vars if name in QUANTITIES):
        variable = dataset[name]
        curves: dict[str, Array] = {}
        if variable.dims == ("minimum", "direction"):
            parts = variable.groupby("direction")
            curves = {
                str(name).replace("along", f"along {u}"): part.values.ravel() for u, part in parts
            }
        elif variable.dims == ("minimum",):
            curves = {str(name): variable.values}
        for label, values in curves.items():
            unit, size = display_for(si_of(variable.units), largest_finite(values))
            head = f"{label} [{one_unit(unit)}]" if unit.strip("1") else label
            columns.append((head, *map(_text, values / size)))
    columns.append(("status", *(words[code] for code in dataset["status"].values.tolist())))
    return aligned(list(zip(*columns, strict=True)))


def _text(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"

"""What a sweep found, in a few lines: quantiles of its quantities."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from cdsm.quantities import QUANTITIES, display_for, si_of
from cdsm.status import Status
from cdsm.support.format import aligned, key, largest_finite, one_unit, span
from cdsm.support.status import status_names
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

_SHARES: Final = {"least": 0.0, "5 %": 0.05, "median": 0.5, "95 %": 0.95, "most": 1.0}
"""Quantiles that are printed, by the head of their column."""


class Numbers(NamedTuple):
    """The numbers of a quantity along the entries of a sweep, as they are printed."""

    name: str  # in JSON: ``along_x``
    words: str  # in a table: ``along x``
    si_unit: str
    unit: str  # for people
    size: float  # of one such unit in SI
    values: Array  # of the entries [SI], NaN where it has none


def numbers_of(dataset: xarray.Dataset) -> Iterator[Numbers]:
    """Yield the numbers of each quantity with one number an entry, or one for each direction."""
    entry = {*dataset["status"].dims}
    held = (Status.OK.word, Status.IMMOBILE.word, Status.UNSTABLE.word)
    codes = [code for code, word in status_names(dataset).items() if word in held]
    has_tensions = dataset["status"].isin(codes)
    for name in (str(name) for name in dataset.data_vars if name in QUANTITIES):
        variable = dataset[name]
        if QUANTITIES[name].is_flag:
            variable = variable.where(has_tensions).assign_attrs(variable.attrs)
        columns: dict[str, Array] = {}
        if {*variable.dims} - entry == {"direction"}:
            columns = {f"{name} {u}": part.values for u, part in variable.groupby("direction")}
        elif {*variable.dims} <= entry:
            columns = {name: variable.values}
        for words, values in columns.items():
            si_unit = si_of(variable.units)
            unit, size = display_for(si_unit, largest_finite(values))
            yield Numbers(
                words.replace(" ", "_"), words, si_unit, one_unit(unit.strip("1")), size,
                np.asarray(values.ravel(), dtype=float),
            )  # fmt: skip


def quantiles(dataset: xarray.Dataset) -> dict[str, dict[str, object]]:
    """Return quantiles of each quantity with one number an entry, by the words of its table.

    Those of entries without a value do not count; a quantity without any has none.
    """
    table: dict[str, dict[str, object]] = {}
    for numbers in numbers_of(dataset):
        known = numbers.values[~np.isnan(numbers.values)]
        if known.size:
            # of the values themselves: some may be infinite
            levels = np.quantile(known, [*_SHARES.values()], method="inverted_cdf")
            row: dict[str, object] = dict(zip(_SHARES, levels.tolist(), strict=True))
            table[numbers.words] = {"unit": numbers.si_unit, **row, "entries": known.size}
    return table


def quantile_lines(dataset: xarray.Dataset) -> list[str]:
    """Return quantiles of each quantity with one number an entry, as aligned lines."""
    rows = [("quantiles", "unit", *_SHARES, "entries")]
    table = quantiles(dataset)
    for numbers in numbers_of(dataset):
        if (marks := table.get(numbers.words)) is not None:
            texts = [f"{float(str(marks[name])) / numbers.size:.4g}" for name in _SHARES]
            rows.append((numbers.words, numbers.unit, *texts, str(marks["entries"])))
    return aligned(rows) if len(rows) > 1 else []


def curve(dataset: xarray.Dataset) -> dict[str, object]:
    """Return each quantity with one number an entry against the bounds that held, in SI.

    The only dimension of the entries is ``minimum``.
    """
    words = status_names(dataset)
    columns: dict[str, object] = {"least_tension_N": dataset["minimum_held"].values.min(axis=-1)}
    columns |= {
        key(numbers.name, numbers.si_unit): numbers.values for numbers in numbers_of(dataset)
    }
    return columns | {"status": [words[code] for code in dataset["status"].values.tolist()]}


def curve_lines(dataset: xarray.Dataset) -> list[str]:
    """Return the numbers of :func:`curve` as aligned lines."""
    words = status_names(dataset)
    held = [span(low, "{:g}".format) for low in dataset["minimum_held"].values]
    columns: list[tuple[str, ...]] = [("least tension [N]", *held)]
    for numbers in numbers_of(dataset):
        head = f"{numbers.words} [{numbers.unit}]" if numbers.unit else numbers.words
        columns.append((head, *map(_text, numbers.values / numbers.size)))
    columns.append(("status", *(words[code] for code in dataset["status"].values.tolist())))
    return aligned(list(zip(*columns, strict=True)))


def _text(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"

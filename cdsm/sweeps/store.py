"""Store of a sweep: a Zarr folder that a stopped run fills up.

It is made with all coordinates and a ``status`` that is pending. A chunk of postures is one region
of each variable; its ``status`` is written last.
"""

from __future__ import annotations

import fcntl
import itertools
import logging
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from cdsm.errors import LINES, FileError, listed
from cdsm.status import Status
from cdsm.support.files import require_folder
from cdsm.support.progress import progress_bar
from cdsm.sweeps.cases import CASES
from cdsm.sweeps.dataset import Labelled
from cdsm.sweeps.files import read_sweep

if TYPE_CHECKING:
    import xarray

    Region = dict[str, slice]  # of a chunk: a slice of each dimension of the postures

CHUNK = 2
"""A chunk of a store has so many times the postures that are computed together."""

_LONGEST = 80  # characters of a value in a message
_AT_ONCE = 8  # chunks that dask computes before they are written
_DAMAGE = (RuntimeError, ValueError)  # what the decoders of chunks raise

_log = logging.getLogger("cdsm")


def sweep_to_store(
    path: Path, cases: Labelled, q: xarray.DataArray, by_dask: bool, progress: bool
) -> xarray.Dataset:
    """Compute what a store lacks of chunked ``q``, by dask or in this process; return it whole."""
    try:
        is_new = not path.exists() or (path.is_dir() and not [*path.iterdir()])
        if is_new:
            _make(path, cases.dataset(q))
        with only_writer(path):
            stored = read_sweep(path)
            chunks = stored["status"].encoding["preferred_chunks"]
            q = q.chunk({dim: chunks.get(dim, -1) for dim in q.dims[:-1]})
            if not is_new:
                _require_same(path, stored, cases.dataset(q))
            regions = _regions(stored["status"])
            pending = [region for region in regions if _is_pending(stored["status"], region)]
            done = len(regions) - len(pending)
            if done:
                counts = (cases.arm.name, done, len(regions))
                _log.warning("sweep of %s resumes: %d of %d chunks are kept", *counts)
            with progress_bar("sweep", len(pending), wanted=progress) as advance:
                many = _AT_ONCE if by_dask else 1
                for start in range(0, len(pending), many):
                    some = pending[start : start + many]
                    _compute(path, cases, q, some, by_dask)
                    advance(len(some))
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be written: {error}.") from error
    return read_sweep(path)


def read_into_memory(dataset: xarray.Dataset, path: Path) -> xarray.Dataset:
    """Load the Dataset of a store; FileError names a damaged chunk, and how to compute it again."""
    try:
        return dataset.load()
    except _DAMAGE as error:
        damage = f"is damaged ({error}); delete it, and repeat the sweep."
    for region in _regions(dataset["status"]):
        for name in map(str, dataset.data_vars):
            try:
                dataset[name].isel(region).load()
            except _DAMAGE as error:
                remedy = f"Delete {_chunk_of_status(dataset, region)} in it, and repeat the sweep"
                damage = f"is damaged: {name}, {_place(region)}, is not readable ({error}). "
                damage += f"{remedy}: it computes this part again."
                raise FileError(path, damage) from None
    raise FileError(path, damage)


@contextmanager
def only_writer(path: Path) -> Iterator[None]:
    """Lock a store; FileError if another sweep writes to it. The lock ends with its process."""
    folder = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            problem = "another sweep writes to it; wait for that one, or give another path to store"
            raise FileError(path, f"{problem}.") from None
        yield
    finally:
        os.close(folder)


def _regions(status: xarray.DataArray) -> list[Region]:
    """Return the region of each chunk of a store, by the chunks of its ``status``."""
    chunks = status.encoding["preferred_chunks"]
    dims = [str(dim) for dim in status.dims if dim not in CASES]
    starts = [range(0, status.sizes[dim], chunks[dim]) for dim in dims]
    return [
        {dim: slice(first, first + chunks[dim]) for dim, first in zip(dims, corner, strict=True)}
        for corner in itertools.product(*starts)
    ]


def _is_pending(status: xarray.DataArray, region: Region) -> bool:
    """Whether a region is still to compute, since it is not finished or its status is damaged."""
    try:
        return bool((status.isel(region) == Status.PENDING).any())
    except _DAMAGE:
        return True


def _chunk_of_status(dataset: xarray.Dataset, region: Region) -> str:
    """Return the file of the status of a region in the store."""
    status = dataset["status"]
    chunks = status.encoding["preferred_chunks"]
    numbers = [region[str(d)].start // chunks[d] if d in region else 0 for d in status.dims]
    return "/".join(map(str, ("status", "c", *numbers)))


def _place(region: Region) -> str:
    """Return a region as text, such as ``pose 0 to 19``."""
    return ", ".join(f"{dim} {part.start} to {part.stop - 1}" for dim, part in region.items())


def _compute(
    path: Path, cases: Labelled, q: xarray.DataArray, regions: Sequence[Region], by_dask: bool
) -> None:
    """Compute some regions, and write each into the store, its status last."""
    import dask

    lazy: Any = dask  # untyped
    angles = [q.isel(region) for region in regions]
    if not by_dask:  # a Dataset of numbers is computed at once, by all threads
        angles = lazy.compute(*angles, scheduler="synchronous")
    datasets = lazy.compute(*(cases.dataset(part) for part in angles))
    for region, dataset in zip(regions, datasets, strict=True):
        values = dataset.drop_vars([*dataset.coords])
        for part in (values.drop_vars("status"), values[["status"]]):
            part.to_zarr(path, region=region, consolidated=False)


def _make(path: Path, template: xarray.Dataset) -> None:
    """Make a store with the coordinates of a lazy sweep, in which every entry is pending."""
    require_folder(path)  # zarr would create it
    encoding = {"status": {"fill_value": np.int8(Status.PENDING)}}

    def fill(folder: Path) -> Path:
        template.to_zarr(folder, compute=False, consolidated=False, encoding=encoding)
        template.coords.to_dataset().to_zarr(folder, mode="r+", consolidated=False)
        return folder

    with (
        TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as aside,
        ThreadPoolExecutor(1) as writer,  # Ctrl-C waits for it, not for the threads of zarr
    ):
        writer.submit(fill, Path(aside) / "store").result().rename(path)


def _require_same(path: Path, stored: xarray.Dataset, wanted: xarray.Dataset) -> None:
    """Raise FileError if a store is of another version, arm, question or set of postures."""
    import xarray

    source = stored.attrs.get("source")
    if source != wanted.attrs["source"]:
        raise FileError(
            path,
            f"was made by {source}, and this is {wanted.attrs['source']}, which may give other "
            "numbers. Give another path to store, or resume it with that version.",
        )
    remedy = "Repeat that one, or give another path to store."
    arms = _differences(stored.attrs["arm"], wanted.attrs["arm"])
    if arms:
        raise FileError(path, f"contains a sweep of another arm. {remedy}{listed(arms, 8, LINES)}")
    questions = [
        dataset.drop_vars([*dataset.data_vars]).assign_attrs(outputs=sorted(map(str, dataset)))
        for dataset in (stored.chunk(stored["status"].encoding["preferred_chunks"]), wanted)
    ]
    try:
        xarray.testing.assert_identical(*questions)
    except AssertionError as error:
        text = f"{error}".replace("Left", "Store (L)").replace("right", "wanted sweep (R)")
        raise FileError(path, f"contains another sweep. {remedy}\n{text}") from None


def _differences(stored: str, wanted: str) -> list[str]:
    """Return the keys by which two arms differ, with their values; the arms are TOML."""
    old = _by_key(tomllib.loads(stored))
    new = _by_key(tomllib.loads(wanted))
    return [
        f"{key} is {_brief(old.get(key))} there, {_brief(new.get(key))} here"
        for key in {**old, **new}
        if old.get(key) != new.get(key)
    ]


def _by_key(table: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    """Return the values of a nested table by key, such as ``cables.cable1_1.slack``."""
    values: dict[str, object] = {}
    for key, value in table.items():
        if isinstance(value, list) and all(isinstance(entry, dict) for entry in value):
            value = {str(entry.get("name", i)): entry for i, entry in enumerate(value, start=1)}
        if isinstance(value, dict):
            values |= _by_key(value, f"{prefix}{key}.")
        else:
            values[f"{prefix}{key}"] = value
    return values


def _brief(value: object) -> str:
    """Return a value as a text of one line."""
    text = "not given" if value is None else repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"

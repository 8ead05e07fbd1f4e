"""Store of a sweep: a Zarr folder that keeps computed blocks, so a stopped run can continue.

A block of postures is one chunk (a file) in each array. A chunk is written to a temporary file,
which is then renamed. The ``status`` of a block is written last: if it is not pending, all outputs
of the block exist.
"""

from __future__ import annotations

import fcntl
import itertools
import os
import secrets
import shutil
from collections.abc import Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core.indexing import (
    CopyOnWriteArray,
    IndexingSupport,
    LazilyIndexedArray,
    MemoryCachedArray,
    explicit_indexing_adapter,
)

from cdsm.errors import LINES, FileError, StoreError, listed
from cdsm.support.files import require_folder
from cdsm.sweeps.quantities import QUANTITIES
from cdsm.sweeps.specification import EMPTY, Specification
from cdsm.sweeps.status import exists

if TYPE_CHECKING:
    import xarray
    from xarray.core.indexing import ExplicitIndexer

_ORDER = "order"  # attribute with the names of all variables in order, since a folder has no order


@contextmanager
def opened(
    path: Path, specification: Specification, extent: Mapping[str, int]
) -> Iterator[Mapping[str, Any]]:
    """Open or create the store at ``path``; yield the arrays of outputs and ``status``, by name.

    ``extent`` is the size of a chunk of a new store. The store is locked against other runs; the
    system removes the lock when the process ends. Raises StoreError if the store has another sweep
    or is locked.
    """
    import zarr

    made = not path.exists() and _make(path, specification, extent)
    try:
        folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise FileError(path, f"cannot be opened as a store: {error.strerror}.") from None
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(path, "another run is writing to it; wait for it to end.") from None
        except OSError as error:
            raise FileError(path, f"cannot be locked: {error.strerror}.") from None
        if not made:
            _check(path, specification)
        group: Any = zarr.open_group(path, mode="r+", use_consolidated=False)
        if _ORDER not in group.attrs:
            raise StoreError(path, "was written by xarray; give another path to store=.")
        if not made:
            for _, computed in _gaps(path, group):
                group["status"][computed] = EMPTY["status"]
        yield {name: group[name] for name in specification.variables}
    finally:
        os.close(folder)


def read(path: Path) -> xarray.Dataset:
    """Return the Dataset of a store; its numbers are read from disk when needed.

    A Dataset that xarray wrote to a Zarr folder is read completely.
    """
    found, group = _dataset(path)
    gap = None if group is None else next(_gaps(path, group), None)
    if gap is not None:
        raise FileError(
            gap[0],
            "is missing, although the status says that this part of the sweep is computed. Run "
            "the same sweep again: with store= it computes what is missing.",
        )
    return found


def _dataset(path: Path) -> tuple[xarray.Dataset, Any]:
    """Return the Dataset of a store, and its Zarr group, or None if xarray wrote the folder."""
    import xarray
    import zarr

    for described in (path / "zarr.json", *path.glob("*/zarr.json")):
        if described.exists() and not described.is_file():  # reading a pipe would wait forever
            raise FileError(path, f"is not a sweep's store: {described.name} is not a file.")
    try:
        found: xarray.Dataset = xarray.open_zarr(path, chunks=None, consolidated=False)
        order = found.attrs.pop(_ORDER, None)
        if order is None:
            found.load()
    except Exception as error:  # zarr, its codecs and the file system may raise anything
        raise FileError(path, f"is not a sweep's store: {error}.") from None
    group: Any = None
    if order is not None:
        group = zarr.open_group(path, mode="r", use_consolidated=False)

        def told(names: Iterable[Hashable]) -> dict[Hashable, Any]:
            return {
                name: (found[name].dims, _once(path, group[name]), found[name].attrs)
                for name in names
            }

        found = found.assign(told(found.data_vars)).assign_coords(
            told(found.coords.keys() - found.indexes.keys())
        )
    for name in found.variables:
        if found[name].dtype.kind in "OT":  # texts are objects or numpy's StringDType
            texts = np.array(found[name].values.tolist())
            found = found.assign_coords({name: (found[name].dims, texts, found[name].attrs)})
        found[name].encoding = {}  # a NetCDF file must not inherit the encoding of the store
    if order is not None:
        found = found[[name for name in order if name in found.variables]]
    return found, group


def _once(path: Path, array: Any) -> Any:
    """Return an array that is read from the store when first needed, and then stays in memory."""
    lazy: Any = LazilyIndexedArray(_OnDisk(path, array))
    return MemoryCachedArray(CopyOnWriteArray(lazy))  # type: ignore[no-untyped-call]


class _OnDisk(BackendArray):
    """Array of a store that xarray reads when needed; FileError if one of its files is damaged."""

    def __init__(self, path: Path, array: Any) -> None:
        self.path, self.array = path, array
        self.shape, self.dtype = array.shape, array.dtype

    def __getitem__(self, key: ExplicitIndexer) -> Any:
        return explicit_indexing_adapter(key, self.shape, IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        try:
            return self.array.oindex[key]
        except Exception as error:  # zarr, its codecs and the file system may raise anything
            raise _damage(self.path, self.array, error) from None


def _damage(path: Path, array: Any, error: Exception) -> FileError:
    """Return a FileError that names the first damaged file of an array of the store at ``path``."""
    for place in np.ndindex(array.cdata_shape):
        try:
            array.blocks[place]
        except Exception as reason:  # as in _OnDisk
            file = path / array.basename / array.metadata.encode_chunk_key(place)
            remedy = "Delete this file, then run the same sweep again: store= keeps all else"
            if array.basename not in (*QUANTITIES, "status"):
                remedy = "Delete the store, and run the sweep again"
            return FileError(file, f"is damaged ({reason}). {remedy}.")
    return FileError(path, f"{array.basename} cannot be read: {error}.")


def _gaps(path: Path, group: Any) -> Iterator[tuple[Path, tuple[slice, ...]]]:
    """Yield each output file that is missing although its block is computed.

    With each file go the slices of the block in ``status``.
    """
    status = group["status"]
    outputs = [group[name] for name in QUANTITIES if name in group]
    try:
        codes = status[...]
    except Exception as error:  # as in _OnDisk
        raise _damage(path, status, error) from None
    for place in np.ndindex(status.cdata_shape):
        block = tuple(slice(i * n, (i + 1) * n) for i, n in zip(place, status.chunks, strict=True))
        at = dict(zip(status.metadata.dimension_names, place, strict=True))
        for array in outputs:
            chunk = tuple(at.get(dim, 0) for dim in array.metadata.dimension_names)
            file = path / array.basename / array.metadata.encode_chunk_key(chunk)
            # a chunk of NaN alone has no file
            if not file.exists() and exists(QUANTITIES[array.basename].stage, codes[block]).any():
                yield file, block


def _make(path: Path, specification: Specification, extent: Mapping[str, int]) -> bool:
    """Make an empty store at ``path`` with chunks of the size ``extent``; return True.

    The store is written to a folder beside ``path``, which is then renamed. Returns False if
    another run has made a store at ``path`` in the meantime.
    """
    import zarr
    from zarr.codecs import ZstdCodec

    require_folder(path)  # zarr would create it
    aside = path.with_name(f".{path.name}-{secrets.token_hex(4)}")
    frame = specification.frame
    try:
        labels = frame.assign_attrs({_ORDER: [*frame.coords, *specification.variables]})
        for name, label in frame.coords.items():
            if label.dtype.kind == "U":  # the format has no texts of fixed width
                labels[name] = label.astype(object)
        labels.to_zarr(aside, mode="w-", zarr_format=3, consolidated=False)
        group = zarr.open_group(aside, mode="r+", use_consolidated=False)
        for name in specification.variables:
            dims, shape = specification.dims(name), specification.shape(name)
            fill = EMPTY.get(name, np.float64(np.nan))
            group.create_array(
                name,
                shape=shape,
                chunks=tuple(extent.get(dim, size) for dim, size in zip(dims, shape, strict=True)),
                dtype=fill.dtype,
                fill_value=fill,
                compressors=ZstdCodec(level=1),  # higher levels gain nothing on numbers
                dimension_names=dims,
                attributes=specification.attributes(name),
            )
        try:
            aside.rename(path)
        except OSError:
            if not path.exists():
                raise
            return False
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be created as a store: {error}.") from None
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return True


def _check(path: Path, specification: Specification) -> None:
    """Raise a StoreError that lists the differences between a store and the specification."""
    (stored, _), wanted = _dataset(path), specification.frame
    held, asked = {str(name) for name in stored.data_vars}, {*specification.variables}
    different = [f"outputs: {each} in the store alone" for each in sorted(held - asked)]
    different += [f"outputs: {each} not in the store" for each in sorted(asked - held)]
    for name in {**stored.coords, **wanted.coords}:
        if name not in wanted.coords:
            different.append(f"{name}: in the store alone")
        elif name not in stored.coords:
            different.append(f"{name}: not in the store")
        else:
            different += _difference(str(name), stored[name].values, wanted[name].values)
    for name in {**stored.attrs, **wanted.attrs}:
        theirs, ours = (str(each.attrs.get(name, "nothing")) for each in (stored, wanted))
        if theirs != ours:  # shown from a few characters before the first difference
            pairs = enumerate(itertools.zip_longest(theirs, ours))
            start = max(0, next(i for i, (one, other) in pairs if one != other) - 30)
            different.append(_mismatch(str(name), theirs[start:], ours[start:]))
    if different:
        raise StoreError(
            path,
            "contains another sweep; repeat that one, or give another path to store=:"
            + listed(different, 8, LINES),
            different,
        )


def _difference(name: str, stored: NDArray[Any], wanted: NDArray[Any]) -> list[str]:
    """Return a text about the first difference of two arrays, in a list; empty if they are equal.

    ``name`` is the coordinate of which the store has the values ``stored``, not ``wanted``.
    """
    if stored.shape == wanted.shape:
        places = np.argwhere(stored != wanted)
        if not len(places):
            return []
        place = tuple(places[0].tolist())
        name += str(list(place)) if place else ""
        stored, wanted = stored[place], wanted[place]
    return [_mismatch(name, stored, wanted)]


def _mismatch(what: str, stored: object, wanted: object) -> str:
    return f"{what}: {_short(stored)} in the store, {_short(wanted)} wanted"


def _short(value: object) -> str:
    text = " ".join(str(value).split())
    return text if len(text) <= 80 else f"{text[:77]}..."

"""Run a sweep in memory, on dask or into a store, and its files: NetCDF, CSV and Zarr.

A store is a Zarr folder that a stopped run fills up. It is made with all coordinates and a
``status`` that is pending. A chunk of postures is then one region of each variable; its ``status``
is written last.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.distribution import check_wrench_rows
from cdsm.errors import CdsmError, FileError, InvalidInput, need
from cdsm.manipulator import Manipulator
from cdsm.quantities import names_of, require_name
from cdsm.status import Status
from cdsm.support.files import as_path, require_folder
from cdsm.support.progress import progress_bar
from cdsm.support.result import write_labelled
from cdsm.support.status import check_sweep, tidy
from cdsm.support.validation import (
    NO_WRENCH,
    XYZ,
    Direction,
    checked_quantity,
    flag,
    instance,
    sequence_of,
    text,
    unit_directions,
)
from cdsm.sweeps.cases import DEFAULT, require
from cdsm.sweeps.dataset import Labelled, only_writer, read_into_memory
from cdsm.sweeps.poses import PoseSet, angles_of, distinct
from cdsm.tension import checked_bounds

if TYPE_CHECKING:
    import xarray

_CHUNK = 2  # a chunk of a store has so many times the postures that are computed together
_AT_ONCE = 8  # chunks that dask computes before they are written

_log = logging.getLogger("cdsm")


def sweep(
    arm: Manipulator,
    q: PoseSet | ArrayLike | xarray.DataArray,
    *,
    minimum: ArrayLike = 0.0,
    maximum: float = np.inf,
    wrench: ArrayLike | Mapping[str, ArrayLike] = NO_WRENCH,
    direction: Direction | Sequence[Direction] | Mapping[str, Direction] = XYZ,
    outputs: Iterable[str] = DEFAULT,
    worst_friction: bool = False,
    diameter: float = 0.0,
    store: str | os.PathLike[str] | None = None,
    progress: bool = True,
) -> xarray.Dataset:
    """Compute the stiffness at many postures, for all combinations of the given argument values.

    At each posture the tensions F are the least that balance the arm (Eqs. 13, 17), and the
    stiffness is that under F (Eq. 16). A failure sets the ``status`` of its entry, see
    :class:`~cdsm.Status`; NaN stands only where the status says so. Coordinates and variables have
    ``long_name`` and ``units`` (SI). The attribute ``arm`` is the ARM.toml of the arm.

    Args:
        arm: The arm.
        q: Postures: :class:`~cdsm.GridPoses` (a dimension for each joint of the grid),
            :class:`~cdsm.PathPoses`, :class:`~cdsm.RandomPoses`, joint angles (N, nv) [rad]
            (dimension ``pose``), or a DataArray of joint angles with the dimension ``joint``. If
            the DataArray is chunked, the result is a lazy Dataset: dask computes it, on the cluster
            whose client is active, when it is needed. A chunk costs some 30 ms of its own.
        minimum: Lower bound of all tensions [N]. Several bounds make the dimension ``minimum``.
        maximum: Upper bound of all tensions [N]; inf for no bound.
        wrench: Wrench at ``tool0`` in base axes (6,): force [N], then moment [N m]. Several, (W, 6)
            or by name, make the dimension ``wrench``.
        direction: Direction of ``along``: an axis such as ``"z"``, or (3,), any length. Several,
            axes, (D, 3) or by name, make the dimension ``direction``.
        outputs: Names of quantities, as the reference lists them.
        worst_friction: As for :func:`~cdsm.distribute_tension`: all segments of the cables stay
            within the bounds, whatever loads came before. Then the bounds at the motors are
            narrower.
        diameter: Diameter of the cables [m], for clearances.
        store: Zarr folder to which results are written chunk by chunk, so that they need not fit
            into memory. A new run with the same arguments computes only the chunks that are
            missing. The returned Dataset reads from the store when needed. The chunks of a chunked
            DataArray are those of the store.
        progress: Show a bar, if there is a terminal.

    Returns:
        Dataset of the outputs [SI] and ``status``. The dimensions of each are those of the
        postures; then ``wrench`` and ``minimum``, if several are given and the output depends on
        them; then its own, such as ``cable``.

    Raises:
        InvalidInput: An argument is wrong; the error names it and the reason. A joint or an output
            does not exist.
        CdsmError: xarray, dask, or zarr for a store, is not installed.
        FileError: The store cannot be created, read or written, or has another sweep.
    """
    need("sweep", "xarray", "dask", *(["zarr"] if store is not None else []))
    names = (outputs,) if isinstance(outputs, str) else tuple(sequence_of("outputs", outputs, str))
    if not names or len({*names}) < len(names):
        raise InvalidInput(
            "outputs", f"{names} given; name some of {', '.join(names_of('sweep'))}, once."
        )
    lows = distinct("minimum", minimum)
    for low in lows.tolist():
        checked_bounds(instance("arm", arm, Manipulator), low, maximum)
    loads, wrenches = _named(wrench)
    ways, directions = _named(direction)
    W = check_wrench_rows(wrenches, len(wrenches))
    u = unit_directions("direction", directions)
    cases = Labelled(
        arm=arm,
        outputs=tuple(require_name("output", name, "sweep") for name in names),
        wrench=np.atleast_2d(W),
        minimum=lows,
        maximum=checked_quantity("maximum", maximum, "tension", zero=True, infinite=True),
        direction=np.atleast_2d(u),
        worst_friction=worst_friction,
        diameter=diameter,
        names={
            "wrench": None if W.ndim == 1 else loads or range(len(W)),
            "minimum": None if np.ndim(minimum) == 0 else lows.tolist(),
            "direction": None if u.ndim == 1 else ways or range(len(u)),
        },
    )
    require(cases.outputs, arm, cases.maximum, worst_friction, diameter)
    given = getattr(q, "chunks", None) is not None
    shown = flag("progress", progress)
    if store is None:
        return cases.dataset(angles_of(arm, q), shown)
    angles = angles_of(arm, q, _CHUNK * cases.together)
    return _stored(as_path(store), cases, angles, given, shown)


def _named(value: Any) -> tuple[Sequence[str] | None, Any]:
    """Return the names of several vectors, if they have any, and the vectors."""
    if isinstance(value, Mapping):
        return [text("name", name) for name in value], [*value.values()]
    words = isinstance(value, (list, tuple)) and all(isinstance(each, str) for each in value)
    return value if words else None, value


def write_sweep(dataset: xarray.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a sweep to a file, completely or not at all; return the path.

    Args:
        dataset: Result of :func:`~cdsm.sweep`, or a part of it.
        path: The file; replaced if it exists. ``.nc`` is NetCDF, which :func:`read_sweep` reads.
            ``.csv`` has a row for each posture and case, and a column for each coordinate and each
            component of an output, with the SI unit in the header. The status is a word.

    Raises:
        InvalidInput: ``dataset`` is not a sweep, or its status has a number without a word; or
            ``path`` ends neither in ``.nc`` nor in ``.csv``.
        CdsmError: xarray or netCDF4 is not installed.
        FileError: The file cannot be written.
    """
    check_sweep(dataset)

    def table() -> Any:
        rows = tidy(dataset)
        return rows.set_index(rows.columns[0])

    return write_labelled(path, table, dataset.drop_encoding)


def read_sweep(path: str | os.PathLike[str]) -> xarray.Dataset:
    """Read a sweep from a NetCDF file or from the folder of its store.

    Args:
        path: The ``.nc`` file of :func:`write_sweep`, or the folder given as ``store=``, even while
            its sweep is running; its numbers are read when needed.

    Raises:
        CdsmError: xarray, netCDF4 or zarr is needed and not installed.
        FileError: The file does not exist, cannot be read, or is not a sweep.
    """
    path = as_path(path)
    need("sweep", "xarray", "zarr" if path.is_dir() else "netCDF4")
    import xarray

    if not path.exists():
        raise FileError(path, f"does not exist (looked in {Path.cwd()}).")
    try:
        if path.is_dir():
            found = xarray.open_dataset(path, engine="zarr", consolidated=False)
        else:
            with xarray.open_dataset(path, engine="netcdf4") as dataset:
                found = dataset.load()
        check_sweep(found)
    except CdsmError as error:
        raise FileError(path, f"is not a sweep of cdsm: {error}") from None
    except Exception as error:  # netCDF4, zarr and xarray may raise anything
        given = "give the .nc of a sweep, or the folder of its store"
        raise FileError(path, f"cannot be read as NetCDF or Zarr: {error}; {given}.") from None
    order = (*names_of("sweep"), "status")  # a folder has none
    rank = {name: i for i, name in enumerate(order)}
    # what zarr makes of names, some versions of xarray cannot write to NetCDF
    names = {name: each for name, each in found.coords.items() if each.dtype.kind == "T"}
    found = found.assign_coords({name: each.astype(object) for name, each in names.items()})
    variables = sorted(found.data_vars, key=lambda name: rank.get(str(name), -1))
    return xarray.Dataset({name: found[name] for name in variables}, found.coords, found.attrs)


def _stored(
    path: Path, cases: Labelled, q: xarray.DataArray, by_dask: bool, progress: bool
) -> xarray.Dataset:
    """Compute what a store lacks of chunked ``q``, by dask or in this process; return it whole."""
    import dask.array

    lazy: Any = dask  # untyped
    try:
        if is_new := not path.exists() or (path.is_dir() and not [*path.iterdir()]):
            _make(path, cases.dataset(q))
        with only_writer(path):
            kept = read_sweep(path)
            sizes = kept["status"].encoding["preferred_chunks"]
            dims = q.dims[:-1]
            q = q.chunk({dim: sizes.get(dim, -1) for dim in dims})
            if not is_new:
                _require_same(path, kept.chunk(sizes), cases.dataset(q))  # chunk by chunk
            status = read_into_memory(kept["status"], path)
            names = [*kept.coords]
            slices = lazy.array.core.slices_from_chunks(tuple(q.chunksizes[dim] for dim in dims))
            regions = [dict(zip(dims, part, strict=True)) for part in slices]
            todo = [each for each in regions if (status.isel(each) == Status.PENDING).any()]
            if len(todo) < len(regions):
                shown = cases.arm.name, len(regions) - len(todo), len(regions)
                _log.warning("sweep of %s resumes: %d of %d chunks are kept", *shown)
            many = _AT_ONCE if by_dask else 1
            with progress_bar("sweep", len(todo), wanted=progress) as advance:
                for some in (todo[i : i + many] for i in range(0, len(todo), many)):
                    angles = [q.isel(region) for region in some]
                    if not by_dask:  # a Dataset of numbers is computed at once, by all threads
                        angles = lazy.compute(*angles, scheduler="synchronous")
                    parts = lazy.compute(*(cases.dataset(each).drop_vars(names) for each in angles))
                    for region, part in zip(some, parts, strict=True):
                        for each in (part.drop_vars("status"), part[["status"]]):  # status last
                            each.to_zarr(path, region=region, consolidated=False)
                        advance(1)
    except FileError:
        raise
    except OSError as error:
        raise FileError(path, f"cannot be written: {error}.") from error
    return read_sweep(path)


def _make(path: Path, template: xarray.Dataset) -> None:
    """Make a store with the coordinates of a lazy sweep, in which every entry is pending."""
    require_folder(path)  # zarr would create it
    encoding = {"status": {"fill_value": np.int8(Status.PENDING)}}

    def fill(made: Path) -> Path:
        template.to_zarr(made, compute=False, consolidated=False, encoding=encoding)
        template.coords.to_dataset().to_zarr(made, mode="r+", consolidated=False)
        return made

    with (
        TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as aside,
        ThreadPoolExecutor(1) as writer,  # Ctrl-C waits for it, not for the threads of zarr
    ):
        writer.submit(fill, Path(aside) / "store").result().rename(path)


def _require_same(path: Path, kept: xarray.Dataset, wanted: xarray.Dataset) -> None:
    """Raise FileError if a store has other outputs, coordinates or attributes than are wanted."""
    import xarray

    both = [
        each.drop_vars([*each.data_vars]).assign_attrs(source="", outputs=sorted(map(str, each)))
        for each in (kept, wanted)
    ]
    try:
        xarray.testing.assert_identical(*both)
    except AssertionError as difference:
        said = f"{difference}".replace("Left", "Store (L)").replace("right", "wanted sweep (R)")
        remedy = "Repeat that one, or give another path to store"
        lines = zip(*(str(each.attrs["arm"]).splitlines() for each in both), strict=False)
        arms = "".join(f"\nIts arm has {a!r}, not {b!r}." for a, b in lines if a != b)
        raise FileError(path, f"contains another sweep. {remedy}.\n{said}{arms:.600}") from None

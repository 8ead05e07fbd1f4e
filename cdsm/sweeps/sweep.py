"""Run a sweep in memory, on dask or into a store."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, Loads
from cdsm.batch.distribution import check_load_rows
from cdsm.dead_loads import Load
from cdsm.errors import InvalidInput, need
from cdsm.loads import LoadsLike, has_loads, loads_of
from cdsm.manipulator import Manipulator
from cdsm.quantities import names_of, require_name
from cdsm.support.files import as_path
from cdsm.support.validation import (
    NO_WRENCH,
    XYZ,
    Direction,
    checked_quantity,
    flag,
    instance,
    number_array,
    sequence_of,
    text,
    unit_directions,
)
from cdsm.sweeps.cases import DEFAULT, require
from cdsm.sweeps.dataset import Labelled
from cdsm.sweeps.poses import PoseSet, angles_of, distinct
from cdsm.sweeps.store import CHUNK, sweep_to_store
from cdsm.tension import checked_bounds

if TYPE_CHECKING:
    import xarray


def sweep(
    arm: Manipulator,
    q: PoseSet | ArrayLike | xarray.DataArray,
    *,
    minimum: ArrayLike = 0.0,
    maximum: float = np.inf,
    wrench: LoadsLike | Mapping[str, LoadsLike] | Sequence[LoadsLike] = NO_WRENCH,
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
        wrench: Wrench at ``tool0`` in base axes (6,): force [N], then moment [N m]; or loads on any
            links, a dict of wrenches by link or a list of :class:`~cdsm.Load`. Several, (W, 6), a
            list of cases, or a dict of cases by name (no link has one of these names), make the
            dimension ``wrench``. Loads on links have the dimension ``load``, and are told by the
            coordinates ``load_link``, ``load_point``, ``load_force`` and ``load_moment``.
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

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> data = cdsm.sweep(arm, cdsm.RandomPoses(50, seed=1), minimum=5.0, progress=False)
        >>> float(data["along"].sel(direction="z").median().round(0))
        2732.0
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
    applied, loads = _cases_of(arm, wrench)
    ways, directions = _named(direction)
    u = unit_directions("direction", directions)
    cases = Labelled(
        arm=arm,
        outputs=tuple(require_name("output", name, "sweep") for name in names),
        applied=applied,
        minimum=lows,
        maximum=checked_quantity("maximum", maximum, "tension", zero=True, infinite=True),
        direction=np.atleast_2d(u),
        worst_friction=worst_friction,
        diameter=diameter,
        names={
            "wrench": loads,
            "minimum": None if np.ndim(minimum) == 0 else lows.tolist(),
            "direction": None if u.ndim == 1 else ways or range(len(u)),
        },
    )
    require(cases.outputs, arm, cases.maximum, worst_friction, diameter)
    by_dask = getattr(q, "chunks", None) is not None
    is_shown = flag("progress", progress)
    if store is None:
        return cases.dataset(angles_of(arm, q), is_shown)
    angles = angles_of(arm, q, CHUNK * cases.together)
    return sweep_to_store(as_path(store), cases, angles, by_dask, is_shown)


def _cases_of(arm: Manipulator, value: Any) -> tuple[tuple[Applied, ...], Sequence[object] | None]:
    """Return what acts in each case, and the names or numbers of cases; None: there is one."""
    links = {*arm.body.link_names}
    one = isinstance(value, (Load, Loads)) or (
        {*value} <= links
        if isinstance(value, Mapping)
        else isinstance(value, (list, tuple))
        and (not value or any(isinstance(load, Load) for load in value))
    )
    if one:
        return (loads_of(arm, value),), None
    names, wrenches = _named(value)
    if isinstance(wrenches, (list, tuple)) and any(map(has_loads, wrenches)):
        labels = names or range(len(wrenches))
        pairs = zip(labels, wrenches, strict=True)
        return tuple(loads_of(arm, case, f"wrench[{name!r}]") for name, case in pairs), labels
    rows = number_array("wrench", wrenches)
    if not rows.size:
        raise InvalidInput("wrench", f"shape {rows.shape} given: no case; give one (6,) or more.")
    W = check_load_rows(arm, rows, len(np.atleast_1d(rows))).at_tip
    return tuple(np.atleast_2d(W)), None if W.ndim == 1 else names or range(len(W))


def _named(value: Any) -> tuple[Sequence[str] | None, Any]:
    """Return the names of several vectors, if they have any, and the vectors."""
    if isinstance(value, Mapping):
        return [text("name", name) for name in value], [*value.values()]
    words = isinstance(value, (list, tuple)) and all(isinstance(name, str) for name in value)
    return value if words else None, value

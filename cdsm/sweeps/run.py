"""Run a sweep, in memory or into a store, on this machine or on a cluster."""

from __future__ import annotations

import logging
import os
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.inputs import checked_threads
from cdsm.errors import FileError
from cdsm.manipulator import Manipulator
from cdsm.measures.rows import SLOW
from cdsm.support.directions import XYZ, Direction, unit_direction
from cdsm.support.extras import need
from cdsm.support.files import as_path
from cdsm.support.progress import progress_bar
from cdsm.support.validation import NO_WRENCH, flag, instance, whole_number, wrench_vector
from cdsm.sweeps.arguments import bounds_of, laws_of, outputs_of, vectors_of
from cdsm.sweeps.blocks import Block, blocks, extents, postures
from cdsm.sweeps.cluster import checked_client, on_cluster
from cdsm.sweeps.evaluation import BlockResult, SweepTask, evaluate
from cdsm.sweeps.poses import PoseSet, poses_of
from cdsm.sweeps.quantities import DEFAULT
from cdsm.sweeps.specification import Specification
from cdsm.sweeps.status import SweepStatus
from cdsm.wires.elasticity import Elasticity

if TYPE_CHECKING:
    import xarray
    from distributed import Client

_log = logging.getLogger("cdsm")

_SLOW_POSTURES = 500  # in a block whose measures take milliseconds, so that the bar moves
_NUMBERS = 2**18  # default number of joint angles in a block: some tenths of a second of work


def sweep(
    arm: Manipulator,
    q: PoseSet | ArrayLike,
    *,
    minimum: ArrayLike = 0.0,
    maximum: float = np.inf,
    elasticity: Elasticity | Mapping[str, Elasticity] | None = None,
    wrench: ArrayLike | Mapping[str, ArrayLike] = NO_WRENCH,
    direction: Direction | Sequence[Direction] | Mapping[str, Direction] = XYZ,
    outputs: Iterable[str] = DEFAULT,
    worst_friction: bool = False,
    diameter: float = 0.0,
    store: str | os.PathLike[str] | None = None,
    client: Client | None = None,
    chunk: int | None = None,
    progress: bool = True,
) -> xarray.Dataset:
    """Compute the stiffness at many postures, for all combinations of the given argument values.

    At each posture the tensions F are the least that balance the arm (Eqs. 13, 17), and the
    stiffness is that under F (Eq. 16). A failure sets the ``status`` of its entry, see
    :class:`~cdsm.SweepStatus`; NaN stands only where the status says so. Coordinates and variables
    have ``long_name`` and ``units`` (SI). The attributes describe geometry, cables and version.

    Args:
        arm: The arm.
        q: Postures: :class:`~cdsm.GridPoses` (a dimension for each joint of the grid),
            :class:`~cdsm.PathPoses`, :class:`~cdsm.RandomPoses`, or joint
            angles (N, nv) [rad] (dimension ``pose``).
        minimum: Lower bound of all tensions [N]. Several bounds make the dimension ``minimum``.
        maximum: Upper bound of all tensions [N]; inf for no bound.
        elasticity: Law of all cables; None keeps the laws of the arm. Several by name make the
            dimension ``elasticity``.
        wrench: Wrench at ``tool0`` in base axes (6,): force [N], then moment [N m]. Several, (W, 6)
            or by name, make the dimension ``wrench``.
        direction: Direction of ``along``: an axis such as ``"z"``, or (3,), any length. Several,
            axes, (D, 3) or by name, make the dimension ``direction``.
        outputs: Names of quantities: keys of :data:`~cdsm.sweeps.quantities.QUANTITIES`.
        worst_friction: As for :func:`~cdsm.distribute_tension`: all segments of the cables stay
            within the bounds, whatever loads came before. Then the bounds at the motors are
            narrower.
        diameter: Diameter of the cables [m], for clearances.
        store: Zarr folder to which entries are written during the run. A new run with the same
            arguments computes only missing entries, including those of lost workers. The results
            are then the same, bit by bit, as without interruption. The returned Dataset reads from
            the store when needed.
        client: Client of a dask cluster; the run waits while the cluster has no workers. None uses
            the threads of this machine.
        chunk: Number of stiffness matrices per block; an existing store keeps its own number.
        progress: Show a bar with rate and time left, if there is a terminal.

    Returns:
        Dataset of the outputs [SI] and ``status``. The dimensions of each are those of the
        postures; then ``elasticity``, ``wrench`` and ``minimum``, if several are given and the
        output depends on them; then its own, such as ``cable``.

    Raises:
        InvalidInput: An argument is wrong; the error names it and the reason.
        UnknownName: A joint or an output does not exist.
        MissingExtra: xarray, zarr or distributed is not installed.
        FileError: The store cannot be created, read or written.
        StoreError: The store has another sweep, or another run is writing to it.
        ClusterError: The client is closed, the scheduler is gone, or a worker cannot compute.
    """
    need("sweep", "xarray", *(["zarr"] if store is not None else []))
    flag("progress", progress)
    if client is not None:
        checked_client(client)
    poses = poses_of(instance("arm", arm, Manipulator), q)
    minima, maximum = bounds_of(minimum, maximum)
    task = SweepTask(
        arm=arm,
        laws=laws_of(elasticity),
        wrenches=vectors_of("wrench", wrench, wrench_vector),
        minima=minima,
        maximum=maximum,
        directions=vectors_of("direction", direction, unit_direction),
        outputs=outputs_of(outputs),
        worst_friction=worst_friction,
        diameter=diameter,
    )
    specification = Specification(task, poses)
    most = _NUMBERS // arm.nv if chunk is None else whole_number("chunk", chunk, 1)
    if chunk is None and not SLOW.isdisjoint(task.outputs):
        most = min(most, _SLOW_POSTURES * task.cases)
    extent = extents(poses.sizes, most // task.cases)
    if store is None:
        values = {name: specification.empty(name) for name in specification.variables}
        _run(specification, values, extent, client, progress)
        return specification.dataset(values)

    from cdsm.sweeps import store as stores  # needs zarr

    path = as_path(store)
    with stores.opened(path, specification, extent) as arrays:
        kept = dict(zip(poses.sizes, arrays["status"].chunks, strict=False))
        _run(specification, arrays, kept, client, progress, path)
    return stores.read(path)


def _run(
    specification: Specification,
    arrays: Mapping[str, Any],
    extent: Mapping[str, int],
    client: Client | None,
    progress: bool,
    path: Path | None = None,
) -> None:
    """Compute all blocks that are pending or were lost, and write the results into ``arrays``.

    ``extent`` is the size of a block along each dimension. ``arrays`` are numpy arrays by name, or
    zarr arrays of the store at ``path``.
    """
    task, poses = specification.task, specification.poses
    every = blocks(poses.sizes, extent)
    todo = [block for block in every if _is_pending(specification, arrays["status"], block)]
    total, left = (sum(map(postures, some)) * task.cases for some in (every, todo))
    _log.info("sweep of %s: %d of %d entries to compute", task.arm.name, left, total)
    if left < total:
        _log.warning(
            "sweep of %s resumes: %d of %d entries are kept", task.arm.name, total - left, total
        )
    answers: Iterable[tuple[Block, BlockResult | None]]
    if client is None:
        answers = _side_by_side(specification, todo)
    else:
        answers = on_cluster(client, specification, todo)
    with progress_bar("sweep", total, total - left, wanted=progress, rate=True) as advance:
        for block, answer in answers:
            try:
                _write(specification, arrays, block, answer)
            except OSError as error:
                raise FileError(path, f"cannot be written: {error}.") from error
            advance(postures(block) * task.cases)


def _side_by_side(
    specification: Specification, blocks: Sequence[Block]
) -> Iterator[tuple[Block, BlockResult]]:
    """Compute blocks in parallel threads; yield each with its result, in the order of ``blocks``.

    If the machine has more threads than there are blocks, each block uses several threads.
    """
    task, poses, cores = specification.task, specification.poses, checked_threads(None)
    workers = max(1, min(cores, len(blocks)))
    waiting: deque[tuple[Block, Future[BlockResult]]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        for block in blocks:
            running = pool.submit(evaluate, task, poses.angles(block), cores // workers)
            waiting.append((block, running))
            if len(waiting) > workers:
                first, done = waiting.popleft()
                yield first, done.result()
        for first, done in waiting:
            yield first, done.result()


def _is_pending(specification: Specification, status: Any, block: Block) -> bool:
    found = status[specification.region("status", block)]
    return bool(np.isin(found, (SweepStatus.PENDING, SweepStatus.WORKER_LOST)).any())


def _write(
    specification: Specification,
    arrays: Mapping[str, Any],
    block: Block,
    answer: BlockResult | None,
) -> None:
    if answer is None:
        arrays["status"][specification.region("status", block)] = np.int8(SweepStatus.WORKER_LOST)
        return
    for name in specification.variables:  # status last: unless pending, all outputs are written
        region = specification.region(name, block)
        arrays[name][region] = answer[name].reshape([part.stop - part.start for part in region])

"""Compute a sweep on a dask cluster, block by block; a block is lost only if its workers die."""

from __future__ import annotations

import itertools
import secrets
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib.metadata import version
from typing import TYPE_CHECKING

from cdsm.errors import CdsmError, ClusterError, InvalidInput
from cdsm.support.extras import need
from cdsm.support.values import Array
from cdsm.sweeps.blocks import Block
from cdsm.sweeps.evaluation import BlockResult, SweepTask, evaluate
from cdsm.sweeps.specification import Specification

if TYPE_CHECKING:
    from distributed import Client, Future

_QUEUED = 2
"""Number of blocks submitted per thread of the cluster, so that no thread waits for work."""

_GO_ON = "What a store holds is kept: run the same again with store= to go on from there."


def checked_client(client: object) -> None:
    """Check that an object is a dask client which is synchronous and open."""
    need("dask", "distributed")
    from distributed import Client

    if not isinstance(client, Client) or client.asynchronous:
        raise InvalidInput("client", f"{client!r} given; a synchronous dask Client is needed.")
    if client.status in ("closing", "closed"):
        raise ClusterError(f"the client is {client.status}; give one that is open.")


def on_cluster(
    client: Client, specification: Specification, blocks: Iterable[Block]
) -> Iterator[tuple[Block, BlockResult | None]]:
    """Compute blocks on a cluster; yield each with its result as soon as it is finished.

    If a worker dies, dask gives its blocks to other workers, at most ``allowed-failures`` times.
    Then dask gives up these blocks, even those that the worker had not begun. They are submitted
    once more at the end, one after the other. The result of a block that dask gives up again is
    None.
    """
    from distributed import as_completed
    from distributed.protocol.pickle import dumps  # pickles classes of a notebook by value

    payload, ours = dumps(specification.task), version("cdsm-stiffness")

    def submitted(block: Block) -> Future[BlockResult]:
        key = f"cdsm-sweep-{secrets.token_hex(8)}"
        return client.submit(_on_worker, payload, ours, specification.poses.angles(block), key=key)

    waiting, given_up = iter(blocks), []
    running: dict[object, tuple[Future[BlockResult], Block]] = {}
    finished = as_completed()
    try:
        while True:
            room = _QUEUED * max(1, sum(client.ncores().values())) - len(running)
            for block in itertools.islice(waiting, max(0, room)):
                future = submitted(block)
                running[future.key] = future, block
                finished.add(future)
            if not running:
                break
            future, block = running.pop(next(finished).key)
            answer = _answer(future)
            if answer is None:
                given_up.append(block)
            else:
                yield block, answer
        for block in given_up:
            yield block, _answer(submitted(block))
    except CdsmError:
        raise
    except Exception as error:
        if client.status == "running":
            raise
        raise ClusterError(f"the client is {client.status} ({error}). {_GO_ON}") from error
    finally:
        if client.status == "running":
            client.cancel([future for future, _ in running.values()])


def _answer(future: Future[BlockResult]) -> BlockResult | None:
    from distributed import CancelledError, KilledWorker

    try:
        answer: BlockResult = future.result()
    except KilledWorker:
        return None
    except CdsmError:
        raise
    except (CancelledError, OSError) as error:
        raise ClusterError(f"the scheduler has gone ({error}). {_GO_ON}") from error
    except Exception as error:
        raise ClusterError(
            f"a worker failed: {error!r}. Workers need the same cdsm, and modules of your own that "
            "define an elasticity, where they can import them."
        ) from error
    return answer


def _on_worker(payload: bytes, client_version: str, q: Array) -> BlockResult:
    ours = version("cdsm-stiffness")
    if ours != client_version:
        raise ClusterError(
            f"a worker has cdsm {ours}, the client {client_version}; install the same."
        )
    # one thread, since dask runs one task in each of its threads
    return evaluate(_task(payload), q, threads=1)


@lru_cache(maxsize=4)
def _task(payload: bytes) -> SweepTask:
    """Unpickle a task; a worker keeps it, since to build its arm again takes milliseconds."""
    from distributed.protocol.pickle import loads

    task: SweepTask = loads(payload)
    return task

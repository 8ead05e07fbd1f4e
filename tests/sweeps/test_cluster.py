"""A cluster computes the bits one machine does, also when its workers die."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import dask
import numpy as np
import pytest
import xarray as xr
from distributed import Client, LocalCluster

import cdsm
from cdsm.sweeps import cluster, run
from tests.support.sweeps import CASES, EVERYTHING, GRID, Deadly, short_arm

pytestmark = pytest.mark.slow

POSES = cdsm.RandomPoses(64, 1)


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    settings = {
        "distributed.scheduler.allowed-failures": 0,  # a block is given up with its first worker
        "distributed.comm.retry.count": 0,
        "distributed.logging.distributed": "critical",  # deaths are what these tests are about
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as workers,
        Client(workers) as client,
    ):
        yield client


def test_a_cluster_computes_the_same_bits(client: Client) -> None:
    whole = cdsm.sweep(short_arm(), GRID, outputs=EVERYTHING, **CASES)
    found = cdsm.sweep(short_arm(), GRID, outputs=EVERYTHING, chunk=24, client=client, **CASES)
    xr.testing.assert_identical(found, whole)


class Unknown(Deadly):
    """A law that a worker cannot read."""

    def __reduce__(self) -> Any:
        return int, ("no law",)


def test_what_fails_on_a_worker_is_told(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(cdsm.ClusterError, match="a worker failed: ValueError"):
        cdsm.sweep(short_arm(Unknown("none")), POSES, minimum=20.0, client=client)
    monkeypatch.setattr(cluster, "version", lambda _: "9.9")
    with pytest.raises(cdsm.ClusterError, match=r"a worker has cdsm .*, the client 9\.9"):
        cdsm.sweep(short_arm(), POSES, minimum=20.0, client=client)


def orders(folder: Path, *names: str) -> str:
    folder.mkdir()
    for name in names:
        (folder / name).touch()
    return str(folder)


def test_a_worker_that_dies_costs_nothing_but_time(client: Client, tmp_path: Path) -> None:
    law = Deadly(orders(tmp_path / "orders", "0", "1", "die"))
    found = cdsm.sweep(short_arm(law), POSES, minimum=20.0, chunk=8, client=client)
    assert not list(Path(law.folder).iterdir())  # it did
    xr.testing.assert_identical(found, cdsm.sweep(short_arm(law), POSES, minimum=20.0))


def test_a_block_that_kills_its_workers_is_marked_and_tried_again_when_asked(
    client: Client, tmp_path: Path
) -> None:
    q = np.zeros((24, 6))
    q[8:16] = 0.3  # the middle one of three blocks, and only this, pulls hard
    pull = cdsm.sweep(short_arm(), q, minimum=20.0, outputs="tension").tension
    low = float(pull[:8].max())
    assert float(pull[8:16].max()) > 1.01 * low
    law = Deadly(orders(tmp_path / "orders", "die1", "die2"), low=low)
    arm, path = short_arm(law), tmp_path / "s.zarr"
    found = cdsm.sweep(arm, q, minimum=20.0, chunk=8, client=client, store=path)
    assert not list(Path(law.folder).iterdir())  # or it would kill the tests themselves
    whole = cdsm.sweep(arm, q, minimum=20.0)
    lost = found.status == cdsm.SweepStatus.WORKER_LOST
    np.testing.assert_array_equal(lost, np.repeat([False, True, False], 8))
    xr.testing.assert_equal(found.where(~lost), whole.where(~lost))
    assert bool(found.tip_position.where(lost).isnull().all())
    again = cdsm.sweep(arm, q, minimum=20.0, store=path)
    xr.testing.assert_identical(again, whole)


def test_a_cluster_that_is_gone_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as workers,
        Client(workers) as client,
    ):
        monkeypatch.setattr(run, "_write", lambda *_: workers.close())
        with pytest.raises(cdsm.ClusterError, match="run the same again with store= to go on"):
            cdsm.sweep(short_arm(), POSES, minimum=20.0, chunk=1, client=client)


def test_a_closed_client_is_told() -> None:
    with (
        LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as workers,
        Client(workers) as client,
    ):
        pass
    with pytest.raises(cdsm.ClusterError, match="the client is closed; give one that is open"):
        cdsm.sweep(short_arm(), POSES, minimum=20.0, client=client)

"""Clearances and worst friction in sweeps: the numbers of the single posture."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import cdsm
from tests.support.sweeps import STEEL, short_arm

Status = cdsm.SweepStatus

DIAMETER = 1.2e-3
LOADS = {"none": np.zeros(6), "hung": np.array([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])}
MAXIMUM = 150.0
SHORT = cdsm.TabulatedElasticity((0.0, 60.0, 75.0), (0.0, 60.0 / 48e3, 75.0 / 48e3))
LAWS = {"steel": STEEL, "short": SHORT}
OUTPUTS = (
    "tension", "payload", "force_radius", "margin", "along",
    "cable_clearance", "link_clearance", "disk_clearance",
)  # fmt: skip


def rough_arm() -> cdsm.Manipulator:
    return short_arm().with_friction(0.1)


def swept(worst: bool, **changes: Any) -> xr.Dataset:
    given = {
        "minimum": [5.0, 60.0, 149.9],
        "maximum": MAXIMUM,
        "wrench": LOADS,
        "elasticity": LAWS,
        "outputs": OUTPUTS,
        "worst_friction": worst,
        "diameter": DIAMETER,
        **changes,
    }
    return cdsm.sweep(rough_arm(), cdsm.RandomPoses(8, 1), progress=False, **given)


def single(
    pose: cdsm.Posture, minimum: float, load: Any, worst: bool
) -> tuple[Status, dict[str, Any]]:
    """Status and measures of one entry, by the functions of a posture."""
    clear = cdsm.clearance(pose, DIAMETER)
    found: dict[str, Any] = {
        f"{kind}_clearance": getattr(clear, f"{kind}s") for kind in ("cable", "link", "disk")
    }
    bounds: Any = (minimum, MAXIMUM, load)
    try:
        pull = cdsm.distribute_tension(pose, *bounds, worst_friction=worst)
    except cdsm.InfeasibleTension:
        return Status.INFEASIBLE, found
    except cdsm.InvalidInput:  # friction leaves nothing between the bounds
        assert worst
        return Status.INFEASIBLE, found
    found["tension"] = pull.values
    polytope = cdsm.force_polytope(pose, *bounds, worst_friction=worst)
    found["force_radius"] = polytope.radius
    ways = [polytope.normals @ u for u in np.eye(3)]
    found["payload"] = [(polytope.offsets[n > 1e-9] / n[n > 1e-9]).min() for n in ways]
    try:
        K = cdsm.stiffness(pose, pull)
    except cdsm.ElasticityRangeError:
        return Status.OUTSIDE_ELASTICITY, found
    found["margin"] = K.margin
    found["along"] = [K.along(u) for u in np.eye(3)]
    return Status.OK if K.is_stable else Status.UNSTABLE, found


@pytest.mark.parametrize("worst", [False, True])
def test_measures_of_a_sweep_are_those_of_the_posture(worst: bool) -> None:
    dataset = swept(worst)
    seen: set[int] = set()
    for i in np.ndindex(*(dataset.sizes[dim] for dim in dataset.status.dims)):
        entry = dataset.isel(dict(zip(dataset.status.dims, i, strict=True)))
        arm = rough_arm()
        law = LAWS[str(entry.elasticity.item())]
        arm = cdsm.Manipulator(arm.geometry, law, gravity=arm.gravity).with_friction(0.1)
        load = LOADS[str(entry.wrench.item())]
        status, found = single(arm.at(entry.q.values), float(entry["minimum"]), load, worst)
        assert int(entry.status) == status
        seen.add(int(status))
        for name in OUTPUTS:
            if name not in found:
                assert np.isnan(entry[name].values).all(), name
                continue
            # linear programs end at the same corner, facets of the hull near it
            rtol = 1e-7 if name in ("payload", "force_radius") else 1e-12
            np.testing.assert_allclose(entry[name], found[name], rtol=rtol, err_msg=name)
    assert seen >= {Status.OK, Status.INFEASIBLE, Status.OUTSIDE_ELASTICITY}


def test_worst_friction_takes_payload_and_costs_tension() -> None:
    free, rough = swept(False), swept(True)
    both = (free.status == Status.OK) & (rough.status == Status.OK)
    assert both.any()
    for name in ("payload", "force_radius"):
        assert bool(((rough[name] < free[name]) | ~both).all()), name
    more = (rough.tension**2).sum("cable") > (free.tension**2).sum("cable")
    assert bool((more | ~both).all())
    assert "worst_friction" in rough.attrs
    assert rough.attrs["model"] == f"stiffness {free.attrs['model']}; tensions with friction"
    assert "worst_friction" not in free.attrs
    assert rough.diameter == DIAMETER
    assert rough.diameter.attrs["units"] == "m"


@pytest.mark.parametrize("chunk", [1, 7])
def test_blocks_and_a_stopped_run_change_no_bit(chunk: int, tmp_path: Path) -> None:
    path = tmp_path / "MAP.zarr"
    whole = swept(True)
    xr.testing.assert_identical(swept(True, chunk=chunk, store=path).load(), whole)
    import zarr

    group: Any = zarr.open_group(path, mode="r+")
    group["status"][3:8], group["margin"][3:8] = Status.PENDING, np.nan
    xr.testing.assert_identical(swept(True, chunk=chunk, store=path).load(), whole)
    with pytest.raises(cdsm.StoreError, match=r"diameter: 0\.0012 in the store"):
        swept(True, store=path, diameter=1e-3)
    with pytest.raises(cdsm.StoreError, match="worst_friction: "):
        swept(False, store=path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"worst_friction": True}, "worst_friction: .* has no friction in its holes; leave it out"),
        ({"worst_friction": 1}, "worst_friction: 1 given"),
        ({"diameter": -1.0}, "diameter"),
    ],
)
def test_what_a_measure_lacks_is_named(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.sweep(short_arm(), np.zeros((1, 6)), minimum=20.0, **changes)

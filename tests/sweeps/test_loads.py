"""Sweeps over loads on links."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.core.test_loads import THREE, Q, universal

DOWN = [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]
CASES = {"empty": np.zeros(6), "hung": {"link2": DOWN, "link3": DOWN}, "three": THREE}
OUTPUTS = ("tension", "along", "payload", "force_radius")


def test_cases_of_loads_on_links(tmp_path: Path) -> None:
    arm = universal()
    q = np.outer([1.0, 0.5], Q)
    bounds = {"minimum": 20.0, "maximum": 300.0}
    dataset = cdsm.sweep(arm, q, wrench=CASES, outputs=OUTPUTS, **bounds)
    assert dataset["along"].dims == ("pose", "wrench", "direction")
    for i, name in enumerate(CASES):
        assert dataset["wrench"].values[i] == name
        for row in range(2):
            pose = arm.at(q[row])
            entry = dataset.isel(pose=row, wrench=i)
            tension = cdsm.distribute_tension(pose, 20.0, 300.0, CASES[name])
            np.testing.assert_allclose(entry["tension"], tension.values, rtol=1e-9)
            K = cdsm.stiffness(pose, tension)
            np.testing.assert_allclose(entry["along"], [K.along(u) for u in "xyz"], rtol=1e-9)
            held = cdsm.payload(pose, "x", 20.0, 300.0, CASES[name])
            assert entry["payload"].values[0] == pytest.approx(held.limits["tension"], rel=1e-6)
            radius = cdsm.force_polytope(pose, 20.0, 300.0, CASES[name]).radius
            assert entry["force_radius"] == pytest.approx(radius, rel=1e-6)
    assert dataset["load_force"].dims == ("wrench", "load", "axis")
    assert dataset["load_link"].values.tolist() == ["link2", "link3", "link2"]
    np.testing.assert_array_equal(dataset["load_point"][2], THREE[0].point)
    np.testing.assert_array_equal(dataset["load_force"].sel(wrench="hung").isel(load=0), DOWN[:3])
    np.testing.assert_array_equal(dataset["load_moment"].isel(wrench=2, load=1), [0, 0, 0.05])
    np.testing.assert_array_equal(dataset["force"].sel(wrench="three"), THREE[2].force)
    stored = cdsm.sweep(arm, q, wrench=CASES, outputs=OUTPUTS, store=tmp_path / "store", **bounds)
    np.testing.assert_array_equal(stored["along"].values, dataset["along"].values)
    assert stored["load_link"].values.tolist() == ["link2", "link3", "link2"]


@pytest.mark.parametrize("one", [{"link2": DOWN}, cdsm.Load("link2", (0, 0, -2)), [THREE[0]]])
def test_one_set_of_loads_is_one_case(one: object) -> None:
    dataset = cdsm.sweep(universal(), Q[None], minimum=20.0, wrench=one, outputs="margin")  # type: ignore[arg-type]
    assert "wrench" not in dataset.dims
    assert dataset["load_link"].values.tolist() == ["link2"]


def test_several_sets_have_numbers() -> None:
    wrench = [{"link2": DOWN}, {"link3": DOWN}]
    dataset = cdsm.sweep(universal(), Q[None], minimum=20.0, wrench=wrench, outputs="margin")
    assert dataset["wrench"].values.tolist() == [0, 1]
    assert len({*dataset["margin"].values.ravel().tolist()}) == 2


def test_a_wrong_case_is_named() -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"wrench\['hung'\]\.link: .*'lnik2'"):
        cdsm.sweep(universal(), Q[None], wrench={"hung": {"lnik2": DOWN}})

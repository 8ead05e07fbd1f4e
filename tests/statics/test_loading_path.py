"""Paths of slow loading agree with load cycles; their first-order changes with differences."""

from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.statics.loading_path import LoadingPath, same_segments
from cdsm.support.values import Array

Q = np.deg2rad([15.0, 15.0, -10.0])
SIZES = {
    "friction": 0.1,
    "rigidity": 48e3,
    "lead": 0.3,
    "hole_radius": 0.025,
    "disk_offset": 0.012,
    "link_mass": 0.1,
}
NONE = np.zeros(6)
U = np.array([0.0, 0.6, -0.8])
FORCES = np.outer([2.0, 5.0, 8.0, 10.0, 7.0, 4.0, 0.0, -3.0, 2.0], U)


def arm(rigidity: float = 48e3, **sizes: float) -> cdsm.Manipulator:
    chosen: Any = {name: x for name, x in (SIZES | sizes).items() if name != "rigidity"}
    geometry = cdsm.Geometry.hinged(
        joints=3,
        twist=np.deg2rad(30.0),
        cables_per_joint=2,
        link_length=0.06,
        base_length=0.02,
        **chosen,
    )
    return cdsm.Manipulator(geometry, elasticity=cdsm.LinearElasticity(rigidity))


PULL = cdsm.distribute_tension(arm().at(Q), 50.0).values


def path(forces: Array = FORCES, **sizes: float) -> LoadingPath:
    return LoadingPath.of(arm(**sizes).at(Q), PULL, NONE, forces)


def test_tips_are_those_of_a_load_cycle_within_a_part_in_500_of_the_motion() -> None:
    wrenches = np.c_[FORCES, np.zeros((len(FORCES), 3))]
    cycle = cdsm.load_cycle(arm().at(Q), PULL, wrenches, accuracy=1e-5)
    motion = abs(cycle.displacement).max()
    assert abs(path().tips - cycle.tip).max() < 2e-3 * motion
    # without friction nothing is remembered: the same rests but for rounding
    smooth = LoadingPath.of(arm(friction=0.0).at(Q), PULL, NONE, FORCES)
    for tip, wrench in zip(smooth.tips, wrenches, strict=True):
        rest = cdsm.equilibrium(arm(friction=0.0).at(Q), PULL, wrench)
        np.testing.assert_allclose(tip, rest.pose.tip[:3, 3], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("name", SIZES)
def test_an_arm_beside_gives_the_derivative_by_any_size(name: str) -> None:
    h = 1e-5 * SIZES[name]
    sizes: Any = [{name: SIZES[name] + s * h} for s in (1.0, -1.0)]
    searched = path(**sizes[0]).tips - path(**sizes[1]).tips
    beside = [path().beside(arm(**each).at(Q), PULL, NONE) for each in sizes]
    # a hole that starts or stops within 1e-5 of a size bends the difference
    assert abs(beside[0] - beside[1] - searched).max() < 3e-5 * abs(searched).max()


def test_an_arm_beside_errs_by_the_square_of_its_distance() -> None:
    here, errors = path(), []
    for step in (1e-4, 1e-5):
        sizes: Any = {"rigidity": 48e3 * (1.0 + step)}
        near = here.beside(arm(**sizes).at(Q), PULL, NONE)
        errors.append(abs(near - path(**sizes).tips).max())
    assert errors[0] / errors[1] == pytest.approx(100.0, rel=0.5)


def test_a_lead_of_none_is_another_chain() -> None:
    assert same_segments(arm().at(Q), arm(lead=0.2).at(Q))
    assert not same_segments(arm().at(Q), arm(lead=0.0).at(Q))

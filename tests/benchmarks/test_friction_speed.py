"""Speed of loads with friction, against equilibria without it."""

import numpy as np

import cdsm
from cdsm import presets
from tests.benchmarks.timing import Clock


def test_load_takes_at_most_eight_equilibria(clock: Clock | None) -> None:
    arm = presets.virtual_prototype(cdsm.LinearElasticity(48e3), lead=0.3, friction=0.1)
    pose = arm.at(np.full(10, presets.TEN_DEGREES))
    pull = cdsm.distribute_tension(pose, 50.0)
    wrenches = np.zeros((10, 6))
    wrenches[:, 2] = np.arange(1, 11)

    def loaded() -> cdsm.LoadHistory:
        return cdsm.load_cycle(pose, pull, wrenches)

    frictionless = cdsm.equilibrium(pose, pull, wrenches[-1]).displacement[2]
    assert 0.5 < loaded().displacement[-1, 2] / frictionless < 1.0
    if clock:
        clock.race(
            "a load with friction, n = 5, over an equilibrium",
            loaded,
            lambda: [cdsm.equilibrium(pose, pull, wrench) for wrench in wrenches],
            most=8.0,
            fast_repeat=1,
            rounds=8,
        )

"""Speed with friction: stuck stiffness, loads, bands, against what is frictionless or naive."""

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.benchmarks.timing import Clock
from tests.friction.test_band import dense_program


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


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_proved_band_takes_some_linear_programs(clock: Clock | None, friction: float) -> None:
    """Proof and wider neighbourhoods included: at μ = 0.3 the first one is too small."""
    arm = presets.virtual_prototype(cdsm.LinearElasticity(48e3), lead=0.3, friction=friction)
    pose = arm.at(np.full(10, presets.TEN_DEGREES))
    F = cdsm.distribute_tension(pose, 50.0).values

    def band() -> cdsm.RestBand:
        return cdsm.rest_band(pose, F, "z")

    found = band()
    assert found.proved
    assert 0.9 * dense_program(pose, F, found.direction) < found.high
    if clock:
        clock.race(
            f"proved band, n = 5, μ = {friction}, over its two naive linear programs",
            band,
            lambda: [dense_program(pose, F, sign * found.direction) for sign in (-1.0, 1.0)],
            most=5.0 if friction == 0.3 else 3.0,
            fast_repeat=1,
            rounds=8,
        )

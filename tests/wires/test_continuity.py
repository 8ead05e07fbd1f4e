"""A user's own law is sampled when the arm is made: jumps are refused, kinks pass."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike

import cdsm
from cdsm.support.values import Array
from cdsm.wires.continuity import find_jump
from tests.support import arms


class Own(cdsm.Elasticity):
    """A law of the user's own with any rigidity; it counts the tensions it is asked for."""

    def __init__(self, rigidity: Callable[[Array], Array], low: float = 0.0, high: float = 500.0):
        self.function, self.low, self.high, self.asked = rigidity, low, high, 0

    @property
    def domain(self) -> cdsm.Domain:
        return cdsm.Domain(self.low, self.high)

    def rigidity(self, tension: ArrayLike) -> Array:
        F = np.asarray(tension, dtype=np.float64)
        self.asked += F.size
        return self.function(F)

    def strain(self, tension: ArrayLike) -> Array:
        raise NotImplementedError

    energy = strain


def step(at: float, height: float) -> Callable[[Array], Array]:
    return lambda F: 1e4 + 20.0 * F + height * (at < F)


CONTINUOUS: dict[str, Own] = {
    "constant": Own(lambda F: np.full_like(F, 1e5)),
    "kink": Own(lambda F: np.interp(F, [0.0, 31.0, 500.0], [1e3, 1e5, 1.1e5])),
    "steep": Own(lambda F: 1e4 * (1.0 + 50.0 / (1.0 + np.exp(-(F - 100.0) / 1e-6)))),
    "upright at its low end": Own(lambda F: 1e5 * np.sqrt(F - 2.2), 2.2),
    "no end": Own(lambda F: 1e4 + 60.0 * F, 0.0, math.inf),
    "waves": Own(lambda F: 1e4 * (2.0 + np.sin(F))),
    "rounding": Own(lambda F: 1e4 * (1.0 + 1e-6 * np.sin(1e9 * F))),
}


@pytest.mark.parametrize("name", CONTINUOUS)
def test_continuous_laws_pass_after_few_evaluations(name: str) -> None:
    law = CONTINUOUS[name]
    law.asked = 0
    assert find_jump(law) is None
    assert law.asked < 10_000


@pytest.mark.parametrize("at", [1e-3, 31.0, 123.456, 499.999])
@pytest.mark.parametrize("height", [-900.0, 100.0, 1e6])
@pytest.mark.parametrize("high", [500.0, math.inf])
def test_jumps_are_found_where_they_are(at: float, height: float, high: float) -> None:
    jump = find_jump(Own(step(at, height), 0.0, high))
    assert jump is not None
    assert jump.tension == pytest.approx(at, rel=1e-11)
    assert jump.above - jump.below == pytest.approx(height, rel=1e-6)


def test_law_that_fails_is_left_to_its_use() -> None:
    def fails(F: Array) -> Array:
        raise RuntimeError

    for law in (Own(fails), Own(lambda F: F * math.nan), Own(lambda F: np.zeros(3))):
        assert find_jump(law) is None


def test_arm_refuses_a_jump_by_name() -> None:
    geometry = arms.random_arm(1, 2).geometry
    laws: list[cdsm.Elasticity] = [cdsm.presets.STRAND_1X19] * len(geometry.cables)
    laws[1] = Own(step(31.0, 500.0))
    name = cdsm.serpentine_cables(geometry, cdsm.presets.STRAND_1X19)[1].name
    said = f"{name} is discontinuous at 31 N: it changes from 10620 to 11120 N.*TabulatedElasticity"
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.Manipulator(geometry, laws)
    laws[1] = CONTINUOUS["kink"]
    cdsm.Manipulator(geometry, laws)

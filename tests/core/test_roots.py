"""Newton's method inside a bracket."""

from collections.abc import Callable

import numpy as np
import pytest

from cdsm.support.roots import rising_root
from cdsm.support.values import Array


@pytest.mark.parametrize(
    ("stretch", "slope"),
    [
        # from afar Newton's step leaves the bracket
        (np.arctan, lambda F: 1.0 / (1.0 + F * F)),
        # everywhere but at the root it goes twice too far
        (np.cbrt, lambda F: np.cbrt(np.maximum(abs(F), 1e-300)) ** -2.0 / 3.0),
        # it makes but two thirds of the way
        (lambda F: F**3, lambda F: 3.0 * F * F + 1e-300),
    ],
    ids=["arctan", "cube root", "cube"],
)
def test_every_rising_law_has_its_root_found_from_anywhere(
    stretch: Callable[[Array], Array], slope: Callable[[Array], Array]
) -> None:
    root = np.linspace(1.0, 99.0, 15)
    for start in (0.0, 1.0, 42.0, 100.0):
        found, rise = rising_root(
            np.zeros(15),
            np.full(15, start),
            np.zeros(15),
            np.full(15, 100.0),
            lambda F: stretch(F - root),
            lambda F: slope(F - root),
        )
        # error over slope is what settles it, of the cube a third of the distance
        np.testing.assert_allclose(found, root, rtol=1e-10)
        np.testing.assert_array_equal(rise, slope(found - root))

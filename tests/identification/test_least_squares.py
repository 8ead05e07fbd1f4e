"""Least squares between bounds: the map of the unit cube, and differences beside an end."""

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm.identification.least_squares import METHODS, Box, LeastSquares, NoModelError
from cdsm.support.values import Array


def test_box_maps_the_unit_cube_on_the_bounds_and_back() -> None:
    box = Box(np.array([[-1.0, 3.0], [1e-3, 1e4], [1.0, 100.0], [1.0, 99.0]]))
    for point in np.random.default_rng(0).uniform(size=(20, 4)):
        values = box.parameters(point)
        assert ((box.low <= values) & (values <= box.high)).all()
        np.testing.assert_allclose(box.point(values), point, rtol=0.0, atol=1e-14)
        slope = (box.parameters(point + 1e-7) - box.parameters(point - 1e-7)) / 2e-7
        np.testing.assert_allclose(box.derivative(point), slope, rtol=1e-6)
    np.testing.assert_array_equal(box.parameters(np.zeros(4)), box.low)
    np.testing.assert_array_equal(box.parameters(np.ones(4)), box.high)
    # by the logarithm from a factor of 100 on
    np.testing.assert_allclose(box.parameters(np.full(4, 0.5)), [1.0, np.sqrt(10.0), 10.0, 50.0])


def problem(end: float) -> LeastSquares:
    """r = (a², a b − 1) of a model that ends at a = end."""

    def residuals(values: dict[str, float]) -> Array:
        a, b = values.values()
        if a > end:
            raise NoModelError("too much")
        return np.array([a * a, a * b - 1.0])

    return LeastSquares(residuals, 2, {"a": (0.0, 1.0), "b": (-1.0, 1.0)})


@pytest.mark.parametrize("a", [0.0, 0.5, 0.8])
@pytest.mark.parametrize(("central", "tolerance"), [(False, 1e-6), (True, 1e-9)])
def test_jacobian_holds_at_bounds_and_at_the_end_of_the_model(
    a: float, central: bool, tolerance: float
) -> None:
    jacobian = problem(0.8).jacobian(np.array([a, 0.75]), central=central)
    np.testing.assert_allclose(jacobian, [[2.0 * a, 0.0], [0.5, 2.0 * a]], atol=tolerance)


def test_where_there_is_no_model_residuals_are_infinite_and_the_reason_is_kept() -> None:
    here, beyond = np.array([0.5, 0.5]), np.array([0.9, 0.5])
    assert problem(0.8).failure(here) is None
    assert np.isinf(problem(0.8).residuals(beyond)).all()
    assert str(problem(0.8).failure(beyond)) == "too much"
    with pytest.raises(
        cdsm.InvalidInput, match=r"free: at a = 0, b = 0 .* none for a slightly smaller"
    ):
        problem(0.0).jacobian(np.array([0.0, 0.5]))


def test_search_moves_the_parameters_it_may() -> None:
    best = problem(1.0).search(
        np.array([0.5, 0.25]), method="dogbox", tolerances=(1e-12,) * 3, most=100, over=[1]
    )
    np.testing.assert_allclose(best, [0.5, 1.0])


def test_both_searches_in_turn_leave_a_bound_along_a_curved_valley() -> None:
    def residuals(p: dict[str, float]) -> Array:
        x, y = p["x"], p["y"]
        return np.array([30.0 * (y - x * (x + 0.3)), x - 0.9, 0.3 * (y - 0.2)])

    problem = LeastSquares(residuals, 3, {"x": (0.0, 1.0), "y": (0.0, 1.0)})
    goals, corner = (1e-4, 1e-6, 1e-8), np.ones(2)
    point = corner
    for method in METHODS:
        point = problem.search(point, method=method, tolerances=goals, most=50)
    # x solves the problem on the curve y = x (x + 0.3), from which y differs by 1e-4
    x = brentq(lambda x: x - 0.9 + 0.09 * (x * (x + 0.3) - 0.2) * (2.0 * x + 0.3), 0.0, 1.0)
    assert point == pytest.approx([x, x * (x + 0.3)], abs=1e-3)
    alone = problem.search(corner, method="dogbox", tolerances=goals, most=50)
    assert problem.cost(alone) > 1.1 * problem.cost(point)

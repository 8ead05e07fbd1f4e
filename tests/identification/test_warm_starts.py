"""Weight loops that begin at equilibria computed nearby: the same answers, in fewer evaluations."""

from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.warm_starts import WarmStarts
from cdsm.statics.solve import Balance
from tests.identification.test_loops import FREE, PLANNED, hinge, measured


@pytest.fixture
def evaluations(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Count evaluations of the balance of the arm."""
    count = [0]
    evaluate = Balance.__call__

    def counted(balance: Balance, x: Any) -> Any:
        count[0] += 1
        return evaluate(balance, x)

    monkeypatch.setattr(Balance, "__call__", counted)
    return count


def test_a_loop_from_its_own_path_is_the_same_in_two_fifths_of_the_evaluations(
    evaluations: list[int],
) -> None:
    pose = hinge().at(PLANNED[0].angles)
    tension = cdsm.distribute_tension(pose, 200.0)
    moved, paths = PLANNED[0].follow(pose, tension)
    cold = evaluations[0]
    again, _ = PLANNED[0].follow(pose, tension, paths)
    np.testing.assert_allclose(again, moved, atol=1e-13)
    assert evaluations[0] - cold <= 0.4 * cold


def test_paths_extrapolate_along_each_parameter() -> None:
    x = np.array([1.0, 2.0])
    path = ({0.5: x, 1.0: 2.0 * x},)
    # one parameter moves the first equilibrium, the other both; at the second step a part is new
    beside = {
        0: (1e-6, {0: ({0.5: x + 3e-6, 1.0: 2.0 * x},)}),
        1: (-1e-6, {0: ({0.5: x, 0.75: x, 1.0: 2.0 * x + 1e-6},)}),
    }
    starts = WarmStarts(np.array([0.2, 0.7]), {0: path}, beside)
    (found,) = starts.at(np.array([0.3, 0.9]))[0]
    np.testing.assert_allclose(found[0.5], x + 0.3, rtol=1e-8)
    np.testing.assert_allclose(found[1.0], 2.0 * x - 0.2, rtol=1e-8)
    assert set(found) == {0.5, 1.0}


def test_derivatives_do_not_depend_on_where_searches_begin() -> None:
    loops = measured(0)
    point = np.array([0.3, 0.5])
    cold = LeastSquares(hinge, None, loops, FREE)
    first = cold.jacobian(point)
    warm = LeastSquares(hinge, None, loops, FREE)
    warm.jacobian(np.array([0.25, 0.55]))
    np.testing.assert_allclose(warm.jacobian(point), first, rtol=1e-6, atol=1e-6 * abs(first).max())

"""Linear programs where the simplex method ends undecided, as with scipy 1.14.0."""

from typing import Any

import numpy as np
import pytest
import scipy.optimize

import cdsm
from cdsm.measures import program
from cdsm.support.linear_program import (
    INFEASIBLE,
    OPTIMAL,
    UNBOUNDED,
    least,
    proved_largest,
)
from tests.support.arms import mixed_arm, random_posture


@pytest.fixture
def undecided(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Make the simplex method tell nothing; return the methods that are called."""
    called: list[str] = []
    solve = scipy.optimize.linprog

    def told(*args: Any, method: str, **rest: Any) -> Any:
        called.append(method)
        found = solve(*args, method=method, **rest)
        return scipy.optimize.OptimizeResult(found, status=4) if method == "highs" else found

    monkeypatch.setattr(scipy.optimize, "linprog", told)
    return called


def test_interior_points_decide_what_the_simplex_method_does_not(undecided: list[str]) -> None:
    rows = {"A_ub": np.array([[1.0, 2.0]]), "b_ub": np.array([3.0])}
    found = least(np.array([-1.0, -3.0]), **rows)
    assert (found.status, found.fun) == (OPTIMAL, pytest.approx(-4.5))
    assert least(np.array([1.0, 1.0]), **rows, bounds=(2.0, None)).status == INFEASIBLE
    assert least(np.array([1.0, 1.0]), **rows, bounds=(None, 0.0)).status == UNBOUNDED
    assert undecided == ["highs", "highs-ipm"] * 3


def test_bound_by_weak_duality_is_the_maximum_and_infeasible_programs_have_none() -> None:
    # max 3 x + y with x + 2 y ≤ 4, x − y = 1 and 0 ≤ x, y ≤ 10: at x = 2, y = 1
    G, h, A, b = np.array([[1.0, 2.0]]), np.array([4.0]), np.array([[1.0, -1.0]]), np.array([1.0])
    ends = np.zeros(2), np.full(2, 10.0)
    found, bound = proved_largest(np.array([3.0, 1.0]), G, h, A, b, *ends)
    np.testing.assert_allclose([-found.fun, bound], 7.0, rtol=1e-12)
    found, bound = proved_largest(np.array([3.0, 1.0]), G, -h, A, b, *ends)
    assert found.status == INFEASIBLE
    assert np.isnan(bound)


def test_a_polytope_is_the_same_by_every_method(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    pose = random_posture(mixed_arm(), 2)
    found = [cdsm.force_polytope(pose, 1.0, 200.0)]
    monkeypatch.setattr(program, "single_largest", lambda *_: False)
    found.append(cdsm.force_polytope(pose, 1.0, 200.0))
    called = request.getfixturevalue("undecided")
    found.append(cdsm.force_polytope(pose, 1.0, 200.0))
    assert "highs-ipm" in called
    for other in found[1:]:
        assert other.margin() == pytest.approx(found[0].margin(), rel=1e-8)
        assert other.volume == pytest.approx(found[0].volume, rel=1e-8)

"""Planned experiments: optimal by a textbook design, and what they will determine."""

from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.identification.experiment_plan import greedy
from cdsm.identification.least_squares import LeastSquares
from tests.identification.test_loops import FREE, TRUE, hinge

ASKED: Any = {
    "postures": [[-0.4], [0.0], [0.4]],
    "directions": "-z",
    "weights": [6.0, 24.0],
    "minimum": 200.0,
    "tests": 3,
    "displacement_std": 5e-6,
    "steps": 2,
}
PLAN = cdsm.plan_experiment(hinge, TRUE, **ASKED)


def test_plans_are_as_good_as_the_textbook_s_and_next_to_the_best() -> None:
    """Regression of 1, x, x² at places from −1 to 1: a third each at −1, 0 and 1."""
    rows = np.array([[1.0, x, x * x] for x in np.linspace(-1.0, 1.0, 21)])
    counts = greedy(np.einsum("ni,nj->nij", rows, rows), 6)
    assert counts[[0, 10, 20]].tolist() == [2, 2, 2]
    for seed in range(3):
        J = np.random.default_rng(seed).normal(size=(6, 2, 3))
        information = np.einsum("nki,nkj->nij", J, J)
        most = max(
            float(np.linalg.det(information[list(chosen)].sum(axis=0)))
            for chosen in combinations_with_replacement(range(6), 4)
        )
        found = np.linalg.det(np.tensordot(greedy(information, 4), information, 1))
        assert (found / most) ** (1.0 / 3.0) > 0.9


def test_a_plan_says_what_it_will_determine() -> None:
    assert len(PLAN.tests) == PLAN.counts.sum() == 3
    assert PLAN.undetermined == ()
    # the covariance is that of the linearised fit to the chosen loops
    loops = [loop.simulated(hinge()) for loop in PLAN.tests]
    problem = LeastSquares(hinge, None, loops, FREE)
    point = problem.point(np.array(list(TRUE.values())))
    J = problem.jacobian(point, central=True) / problem.slope(point)
    np.testing.assert_allclose(PLAN.std, np.sqrt(np.diag(np.linalg.inv(J.T @ J))), rtol=1e-3)
    plan = cdsm.plan_experiment(hinge, TRUE, **(ASKED | {"postures": [[0.4], [3.0]]}))
    assert [label for label, _ in plan.failures] == ["posture 2, -z, 6 N", "posture 2, -z, 24 N"]


def test_what_no_candidate_determines_is_said_before_anything_is_built() -> None:
    def by_product(friction: float, area: float, modulus: float) -> cdsm.Manipulator:
        return hinge(friction, area * modulus)

    values = {"friction": 0.1, "area": 1e-6, "modulus": 48e9}
    plan = cdsm.plan_experiment(by_product, values, **ASKED)
    assert plan.undetermined == ("area", "modulus")
    (combination,) = plan.open_combinations
    assert "area" in combination
    with pytest.raises(cdsm.InvalidInput, match="no candidate determines colour"):
        cdsm.plan_experiment(lambda colour: hinge(), {"colour": 1.0}, **ASKED)


@pytest.mark.parametrize(
    ("values", "changes", "said"),
    [
        (TRUE, {"postures": []}, r"postures.*\(n, nv\)"),
        (TRUE, {"postures": [[3.0]]}, "none of 2 candidates can be tested.*posture 1"),
        (TRUE, {"weights": [-5.0]}, "weights.*positive"),
        (TRUE, {"directions": "down"}, "down"),
        ({"viscosity": 1.0}, {}, "viscosity"),
    ],
)
def test_bad_questions_name_the_offender(
    values: dict[str, float], changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(cdsm.CdsmError, match=f"(?s){said}"):
        cdsm.plan_experiment(hinge, values, **(ASKED | changes))

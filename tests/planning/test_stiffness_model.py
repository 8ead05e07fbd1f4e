"""K_θ(F) and the constraints on it: values of the public stiffness, derivatives by differences."""

import numpy as np
import pytest

import cdsm
from cdsm.planning.objectives import along_constraints
from cdsm.planning.stiffness_model import (
    Constraints,
    Evaluation,
    StiffnessModel,
)
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import central_difference
from tests.support.locked import soft_hinge, some_arm

MOMENT = np.array([0.2, -0.1, 0.3, 0.01, -0.02, 0.03])


@pytest.fixture(params=["linear", "all laws"])
def model(request: pytest.FixtureRequest) -> StiffnessModel:
    if request.param == "linear":
        arm = arms.random_arm(1, 2, "universal", cdsm.LinearElasticity(2e4))
    else:
        arm = some_arm("universal-3-8-all")
    return StiffnessModel(arms.random_posture(arm, 11, 0.25), 60.0, 300.0, MOMENT, 1e-4)


def constraints(model: StiffnessModel) -> Constraints:
    """Two directions, far from their targets."""
    return along_constraints(model, np.eye(3)[1:], np.array([1e4, 2e4]))


def place(model: StiffnessModel) -> Evaluation:
    """Off all bounds and kinks; balance does not matter."""
    return model.at(np.random.default_rng(2).uniform(70.0, 200.0, model.region.low.size))


def test_values_are_those_of_the_public_stiffness(model: StiffnessModel) -> None:
    here = place(model)
    K = cdsm.stiffness(model.pose, here.F, wrench=MOMENT)
    np.testing.assert_allclose(here.K, K.joint, rtol=1e-12, atol=1e-12 * abs(K.joint).max())
    assert here.reserve == pytest.approx(K.margin - model.floor, rel=1e-9)
    c = constraints(model).at(here).values
    np.testing.assert_allclose(c, [K.along([0, 1, 0]) / 1e4 - 1, K.along([0, 0, 1]) / 2e4 - 1])


def test_derivatives_are_those_of_the_values(model: StiffnessModel) -> None:
    here, c = place(model), constraints(model)
    y = np.random.default_rng(3).normal(size=c.targets.size)

    def values(F: Array) -> Array:
        return c.at(model.at(F)).values

    def gradient(F: Array) -> Array:
        return y @ c.at(model.at(F)).jacobian

    def reserve(F: Array) -> Array:
        return np.array(model.at(F).reserve)

    def reserve_gradient(F: Array) -> Array:
        return model.at(F).reserve_gradient

    there = c.at(here)
    # second derivatives of laws are differences themselves, good for five digits
    for f, derivative, tolerance in (
        (values, there.jacobian, 1e-6),
        (gradient, there.hessian(y), 1e-4),
        (reserve, here.reserve_gradient, 1e-6),
        (reserve_gradient, here.reserve_hessian(), 1e-4),
    ):
        size = abs(derivative).max()
        found = central_difference(f, here.F, 0.02)
        np.testing.assert_allclose(found, derivative, atol=tolerance * size)


def test_way_back_ends_where_stability_begins() -> None:
    model = StiffnessModel(soft_hinge().at([0.0]), 10.0, 1000.0, np.zeros(6), 1e-4)
    anchor = model.at(np.full(2, 100.0))
    edge = anchor.backtracked(np.full(2, 900.0))
    assert edge is not None
    assert 0.0 <= edge.reserve < 1e-9 * model.scale
    inside = anchor.backtracked(np.full(2, 50.0))
    assert inside is not None
    np.testing.assert_array_equal(inside.F, 50.0)
    assert model.at(np.full(2, 800.0)).backtracked(np.full(2, 900.0)) is None

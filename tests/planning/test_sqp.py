"""Searches end where the conditions of first order hold, also in the sharp bend of Eq. 19."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import cdsm
from cdsm import presets
from cdsm.planning.objectives import along_constraints
from cdsm.planning.sqp import EFFORT, HIGHEST, MET, NEAREST, Program, search
from cdsm.planning.stiffness_model import Evaluation, StiffnessModel
from cdsm.support.values import Array
from tests.support import arms
from tests.support.locked import STRAND

UP = np.array([[0.0, 0.0, 1.0]])
KINK = 31.0


def at_the_bend(seed: int) -> tuple[StiffnessModel, Program]:
    """Strands of which some end at 31 N, where more tension pays much less than below."""
    pose = arms.random_posture(arms.random_arm(seed, 2, "universal", STRAND), seed, 0.3)
    model = StiffnessModel(pose, 10.0, 200.0, np.zeros(6), 1e-4)
    anchor = model.at(cdsm.distribute_tension(pose, 30.0).values)
    target = cdsm.stiffness(pose, anchor.F).along(UP[0])
    constraints = along_constraints(model, UP, np.array([target]))
    return model, Program(model.region, anchor, constraints, EFFORT, 30.0)


@pytest.mark.parametrize("seed", range(4))
def test_no_feasible_step_has_less_effort_not_even_across_the_bend(seed: int) -> None:
    model, program = at_the_bend(seed)
    found = search(program, program.anchor)
    F = found.evaluation.F
    assert abs(found.values).max() <= MET
    assert abs(model.region.imbalance(F)).max() < 1e-9 * F.max()
    rng, tried = np.random.default_rng(seed), 0
    for size in (0.3, 1e-2, 1e-3):
        for _ in range(60):
            start = F + size * model.region.null @ rng.normal(size=model.region.null.shape[1])
            start = np.clip(start, model.region.low, model.region.high)
            nearby = model.region.nearest(start, model.region.low, model.region.high)
            assert nearby is not None
            c = float(program.constraints.at(model.at(nearby)).values[0])
            if c >= 0.0:  # stiff enough: then it takes more effort
                assert np.linalg.norm(nearby) > np.linalg.norm(F) * (1.0 - 1e-9)
                tried += 1
    assert tried > 20


def test_some_optima_are_in_the_bend_and_found_from_either_side() -> None:
    met = 0
    for seed in range(4):
        model, program = at_the_bend(seed)
        ends = []
        for minimum in (15.0, 30.0, 40.0):
            F = cdsm.distribute_tension(model.pose, minimum).values
            ends.append(search(program, model.at(F)).evaluation.F)
        np.testing.assert_allclose(ends[1:], [ends[0]] * 2, rtol=1e-6)
        met += int((abs(ends[0] - KINK) < 2.0).sum())
    assert met > 0


def test_other_objectives() -> None:
    model, program = at_the_bend(1)
    start = program.anchor
    for objective, better in ((HIGHEST, -1.0), (NEAREST, 0.0)):
        other = Program(model.region, start, program.constraints, objective, 30.0)
        end = search(other, model.at(cdsm.distribute_tension(model.pose, 15.0).values))
        value = float(end.values[0])
        assert value > 0.0 if better else abs(value) < 1e-6


def with_slsqp(program: Program, start: Evaluation) -> Array:
    """Tensions of least effort by SLSQP, with the values and gradients that a search has."""
    region, model, unit = program.region, start.model, program.unit
    scale = unit / model.scale

    def c(x: Array) -> Any:
        return program.constraints.at(model.at(unit * x))

    balance = region.rows @ region.least.values / unit
    found: Any = minimize(
        lambda x: (0.5 * float(x @ x), x),
        start.F / unit,
        jac=True,
        method="SLSQP",
        bounds=np.column_stack([region.low, region.high]) / unit,
        constraints=[
            {
                "type": "eq",
                "fun": lambda x: region.rows @ x - balance,
                "jac": lambda x: region.rows,
            },
            {"type": "eq", "fun": lambda x: c(x).values, "jac": lambda x: unit * c(x).jacobian},
            {
                "type": "ineq",
                "fun": lambda x: model.at(unit * x).reserve / model.scale,
                "jac": lambda x: scale * model.at(unit * x).reserve_gradient,
            },
        ],
        options={"ftol": 1e-12, "maxiter": 300},
    )
    return np.asarray(unit * found.x)


@pytest.mark.parametrize("seed", range(4))
def test_slsqp_with_the_same_gradients_ends_at_the_same_tensions(seed: int) -> None:
    rng, one = np.random.default_rng(seed), presets.virtual_prototype()
    pose = one.at(presets.TEN_DEGREES * rng.uniform(-1.0, 1.0, one.nv))
    target = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 100.0)).along(UP[0])
    model = StiffnessModel(pose, 50.0, 800.0, np.zeros(6), 1e-4)
    start = model.at(model.region.least.values)
    constraints = along_constraints(model, UP, np.array([0.98 * target]))
    program = Program(model.region, start, constraints, EFFORT, model.region.scale)
    F = search(program, start).evaluation.F
    np.testing.assert_allclose(with_slsqp(program, start), F, rtol=1e-6)

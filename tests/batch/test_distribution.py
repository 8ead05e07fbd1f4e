"""Tensions at many postures: each row the optimum of the single posture, or proof of none."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import qpsolvers

import cdsm
from cdsm.batch import Tensions
from cdsm.support.values import Array
from tests.batch.test_evaluation import custom_arm
from tests.support.arms import STEEL, mixed_arm, random_arm, readme_geometry

EXACT = 1e-9
"""Of the largest tension: what the single posture's solver is verified to."""

ARMS: dict[str, Callable[[], cdsm.Manipulator]] = {
    "universal, three cables": lambda: random_arm(1, 4),
    "hinged": lambda: random_arm(2, 6, "hinged"),
    "one hinge": lambda: random_arm(8, 1, "hinged"),
    "mixed": mixed_arm,
    "custom": custom_arm,
    "strands": cdsm.presets.virtual_prototype,
    "shallow": lambda: shallow_arm(5),
}


def shallow_arm(joints: int) -> cdsm.Manipulator:
    """Disks so near the joints that many postures cannot be held."""
    sizes = {"link_length": 0.04, "base_length": 0.02, "disk_offset": 0.005, "hole_radius": 0.03}
    geometry = readme_geometry(joints=joints, link_mass=0.5, lead=0.0, joint_limit=0.33, **sizes)
    return cdsm.Manipulator(geometry, STEEL, gravity=(0.0, -9.81, 0.0))


def postures(arm: cdsm.Manipulator, rows: int, reach: float, seed: int = 0) -> Array:
    rng = np.random.default_rng([seed, arm.nv])
    return rng.uniform(-reach, reach, (rows, arm.nv)) * arm.upper


def loads(rows: int, seed: int = 0) -> Array:
    rng = np.random.default_rng([seed, 3])
    wrench: Array = rng.normal(0.0, 2.0, (rows, 6))
    wrench[:, 3:] *= 0.05
    return wrench


def assert_same_as_alone(pull: Tensions) -> tuple[int, int]:
    """Compare with the single posture, row by row; how many are feasible, and how many not."""
    arm, (rows, count) = pull.arm, pull.values.shape
    low, high = (np.broadcast_to(each, (rows, count)) for each in (pull.minimum, pull.maximum))
    wrench = np.broadcast_to(pull.wrench, (rows, 6))
    counts = [0, 0]
    for r in range(rows):
        try:
            single = cdsm.distribute_tension(arm.at(pull.q[r]), low[r], high[r], wrench[r]).values
        except cdsm.InfeasibleTension:
            assert pull.status[r] == cdsm.Status.INFEASIBLE, r
            assert np.isnan(pull.values[r]).all()
            counts[1] += 1
            continue
        assert pull.status[r] == cdsm.Status.OK, r
        np.testing.assert_allclose(
            pull.values[r], single, rtol=0.0, atol=EXACT * max(single.max(), 1e-6), err_msg=str(r)
        )
        counts[0] += 1
    return counts[0], counts[1]


# --- the same as the single posture ---------------------------------------------------------


@pytest.mark.usefixtures("kernels")
@pytest.mark.parametrize("name", ARMS)
def test_every_row_is_the_optimum_of_the_single_posture(name: str) -> None:
    arm = ARMS[name]()
    q = postures(arm, 25, 0.5)
    pull = cdsm.distribute_tensions(arm, q, 10.0, wrench=loads(25))
    feasible, _ = assert_same_as_alone(pull)
    assert feasible


@pytest.mark.parametrize("name", ["universal, three cables", "hinged", "custom"])
def test_bounds_of_all_kinds(name: str) -> None:
    arm = ARMS[name]()
    rng = np.random.default_rng(7)
    rows, count = 20, len(arm.cables)
    q, wrench = postures(arm, rows, 0.4), loads(rows, 1)
    low = rng.uniform(0.0, 20.0, (rows, count))
    free = cdsm.distribute_tensions(arm, q, low, wrench=wrench)
    assert free.ok.any()
    # upper bounds that bite: some cables at their minimum, fixed, and most under the largest of F
    high = np.maximum(low, 0.9 * free.values.max(axis=1, keepdims=True))
    bounded = cdsm.distribute_tensions(arm, q, low, high, wrench)
    assert_same_as_alone(bounded)
    if name != "hinged":  # where the other cable of the pair would have nothing left to choose
        fixed = np.full_like(high, np.inf)
        fixed[:, 0] = low[:, 0]
        assert_same_as_alone(cdsm.distribute_tensions(arm, q, low, fixed, wrench))
    # bounds that are one number, or one for each cable
    assert_same_as_alone(cdsm.distribute_tensions(arm, q, 3.0, 500.0, wrench[0]))
    assert_same_as_alone(cdsm.distribute_tensions(arm, q, low[0], high.max(axis=0)))


@pytest.mark.usefixtures("kernels")
@pytest.mark.parametrize(
    ("arm", "reach", "minimum"),
    [(cdsm.presets.virtual_prototype(), 1.0, 50.0), (shallow_arm(3), 0.9, 5.0)],
)
def test_near_the_joint_limits_no_guess_is_wrong_and_every_proof_holds(
    arm: cdsm.Manipulator, reach: float, minimum: float
) -> None:
    """A few cables pull a hundred times the bound; of many rows there are no tensions."""
    pull = cdsm.distribute_tensions(arm, postures(arm, 120, reach), minimum)
    feasible, infeasible = assert_same_as_alone(pull)
    assert feasible > 10
    assert infeasible > 5


def test_rounding_on_a_joint_that_no_cable_turns_is_no_missing_torque() -> None:
    """A twist about x moves no hole apart: what gravity does there is 1e-20 N m, and nothing."""
    twist = cdsm.Joint(axes=((1.0, 1e-18, 0.0),), disk_offset=0.01)
    bend = cdsm.Joint(axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), disk_offset=0.01)
    geometry = cdsm.Geometry(
        base_length=0.05,
        hole_radius=0.03,
        joints=(bend, twist),
        links=(cdsm.Link(length=0.05, mass=0.5),) * 2,
        cables=tuple(cdsm.CableRoute(joint=k, angle=2.1 * j) for k in (1, 2) for j in range(3)),
    )
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e5), gravity=(-1.0, 9.0, -0.3))
    q = np.zeros(3)
    single = cdsm.distribute_tension(arm.at(q), 5.0)
    batch = cdsm.distribute_tensions(arm, [q], 5.0)
    assert batch.status.tolist() == [cdsm.Status.OK]
    np.testing.assert_allclose(batch.values[0], single.values, rtol=1e-9)


def test_rows_that_the_solver_leaves_open_are_infeasible_only_with_a_proof(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arm = shallow_arm(3)
    q, wrench = postures(arm, 60, 0.9), 0.1 * loads(60)
    expected = cdsm.distribute_tensions(arm, q, 5.0, wrench=wrench)
    assert 5 < np.count_nonzero(expected.ok) < 55
    truth = qpsolvers.solve_problem

    def finds_nothing(*arguments: Any, **options: Any) -> qpsolvers.Solution:
        solution = truth(*arguments, **options)
        solution.found = False
        return solution

    monkeypatch.setattr(qpsolvers, "solve_problem", finds_nothing)
    found = cdsm.distribute_tensions(arm, q, 5.0, wrench=wrench)
    np.testing.assert_array_equal(found.status[~expected.ok], expected.status[~expected.ok])
    lost = found.status[expected.ok]
    assert set(lost.tolist()) <= {cdsm.Status.OK, cdsm.Status.SOLVER_FAILED}

    def breaks_down(*_: object, **__: object) -> None:
        raise qpsolvers.SolverError("it broke down")

    monkeypatch.setattr(qpsolvers, "solve_problem", breaks_down)
    found = cdsm.distribute_tensions(arm, q, 5.0, wrench=wrench)
    np.testing.assert_array_equal(found.status[~expected.ok], expected.status[~expected.ok])
    coupled = cdsm.Manipulator(readme_geometry(coupled=True), STEEL)
    found = cdsm.distribute_tensions(coupled, postures(coupled, 20, 0.1), 5.0)  # without guesses
    lost = found.status == cdsm.Status.SOLVER_FAILED
    assert lost.any()
    assert np.isnan(found.values[lost]).all()

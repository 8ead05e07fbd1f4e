"""The kernel of small linear programs against HiGHS, and the batches that it computes."""

import numpy as np
import pytest

import cdsm
from cdsm.measures.rows import capacity_margins, payloads
from cdsm.measures.simplex import single_largest
from cdsm.support.linear_program import INFEASIBLE, OPTIMAL, UNBOUNDED, least
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_arm


def random_program(seed: int) -> tuple[Array, Array, Array, Array, Array]:
    """Cost, equations and bounds; some free, some fixed, some degenerate, some without a corner."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 8))
    n = m + int(rng.integers(0, 8))
    A = rng.uniform(-1.0, 1.0, (m, n)) * (rng.random((m, n)) < 0.7)
    low = np.where(rng.random(n) < 0.2, -np.inf, rng.integers(-2, 1, n))
    high = np.where(rng.random(n) < 0.3, np.inf, rng.integers(0, 3, n))
    inside = np.clip(rng.integers(-1, 2, n), low, high)
    # at corners of the bounds the program is degenerate; a shift makes some infeasible
    b = A @ inside + (seed % 3 == 0) * rng.uniform(-1.0, 1.0, m)
    return rng.uniform(-1.0, 1.0, n), A, b, low, high


def test_what_the_kernel_proves_is_the_best_and_it_proves_what_exists() -> None:
    kinds = dict.fromkeys((OPTIMAL, INFEASIBLE, UNBOUNDED), 0)
    unproved = 0
    for seed in range(1500):
        cost, A, b, low, high = random_program(seed)
        x = np.empty_like(cost)
        proved = single_largest(cost, A, b, low, high, x)
        found = least(-cost, A_eq=A, b_eq=b, bounds=np.column_stack([low, high]))
        kinds[found.status] += 1
        if found.status != OPTIMAL:
            assert not proved
            continue
        unproved += not proved
        if proved:
            assert cost @ x == pytest.approx(-found.fun, abs=1e-8)
            assert abs(A @ x - b).max() < 1e-9
            assert ((low - 1e-9 <= x) & (x <= high + 1e-9)).all()
    assert min(kinds.values()) > 100
    # HiGHS is asked for the others: equations that depend on each other
    assert unproved < 0.02 * kinds[OPTIMAL]


LOW, HIGH = 5.0, 120.0


@pytest.mark.parametrize("arm", [mixed_arm(), random_arm(0, 3), random_arm(1, 3, "hinged")])
def test_rows_are_single_postures(arm: cdsm.Manipulator) -> None:
    rng = np.random.default_rng(3)
    q = 0.4 * rng.uniform(arm.lower, arm.upper, (12, arm.nv))
    W = np.zeros((12, 6))
    W[:, 2] = -0.5
    directions = np.eye(3)
    held = []
    for n, row in enumerate(q):
        try:
            cdsm.distribute_tension(arm.at(row), LOW, HIGH, W[n])
            held.append(n)
        except cdsm.InfeasibleTension:
            continue
    q, W = q[held], W[held]
    bounds = np.full(len(q), LOW), HIGH
    force, margin = payloads(arm, q, W, *bounds, directions), capacity_margins(arm, q, W, *bounds)
    assert len(q)
    for n, row in enumerate(q):
        pose = arm.at(row)
        single = [cdsm.payload(pose, u, LOW, HIGH, W[n]).limits["tension"] for u in directions]
        assert force[n] == pytest.approx(single, rel=1e-9)
        # Qhull merges facets that rounding sets apart
        assert margin[n] == pytest.approx(
            cdsm.force_polytope(pose, LOW, HIGH, W[n]).margin(), rel=1e-7, abs=1e-9
        )


def test_a_sweep_maps_payload_and_capacity_margin() -> None:
    arm = random_arm(0, 2)
    q = [[0.0] * arm.nv, [0.1] * arm.nv]
    outputs = ["payload", "capacity_margin"]
    found = cdsm.sweep(arm, q, minimum=[1.0, 5.0], maximum=150.0, direction="z", outputs=outputs)
    for n, row in enumerate(q):
        for m, low in enumerate((1.0, 5.0)):
            pose = arm.at(row)
            here = found.isel(pose=n, minimum=m)
            polytope = cdsm.force_polytope(pose, low, 150.0)
            assert here["capacity_margin"] == pytest.approx(polytope.margin(), rel=1e-8)
            along = cdsm.payload(pose, "z", low, 150.0).limits["tension"]
            assert here["payload"] == pytest.approx(along, rel=1e-9)
    with pytest.raises(cdsm.InvalidInput, match="maximum: capacity_margin needs a finite one"):
        cdsm.sweep(arm, q, minimum=1.0, outputs=outputs)

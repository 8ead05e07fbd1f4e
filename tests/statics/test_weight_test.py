"""The weight test: closed forms of one hinge, the linear prediction, buckling, friction."""

import math
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support.arms import prototype, readme_geometry
from tests.support.locked import (
    LENGTH,
    MOMENT,
    balanced,
    compressed,
    half,
    hinge,
    pulls,
    restoring,
    soft_hinge,
)


@pytest.mark.parametrize("angle", [0.004, 0.3, -0.2])
def test_weight_on_a_hinge_goes_as_far_as_the_closed_form_says(angle: float) -> None:
    # the tip is at (ℓ cos θ, −ℓ sin θ): a force f along z turns it with −f ℓ cos θ
    force = -restoring(angle) / (LENGTH * math.cos(angle))
    test = cdsm.weight_test(hinge(limit=0.5).at([0.0]), [20.0, 20.0], [0.0, 0.0, force], steps=3)
    expected = [LENGTH * (math.cos(angle) - 1.0), 0.0, -LENGTH * math.sin(angle)]
    np.testing.assert_allclose(test.displacement, expected, rtol=1e-11, atol=1e-15)
    np.testing.assert_array_equal(test.displacement, test.displacements[-1])
    assert test.stiffness == pytest.approx(force / expected[2], rel=1e-11)
    np.testing.assert_allclose(sorted(test.tensions[-1]), sorted(pulls(angle)), rtol=1e-11)
    np.testing.assert_allclose(test.loads, abs(force) * np.array([1, 2, 3]) / 3.0, rtol=1e-15)
    # K_θ = Σ F L'' + k L'² = −2·20 N·h/2 + 2 (EA + F) R²/2h; along z, K_θ/ℓ²
    stiff = (2.0 * half(1.0, 0.0)[1] ** 2 * 2020.0 / 0.02 - 20.0 * 0.01) / LENGTH**2
    assert test.tangent == pytest.approx(stiff, rel=1e-12)
    np.testing.assert_allclose(test.tangent_displacement, [0, 0, force / stiff], atol=1e-15)


@pytest.mark.parametrize("name", ["universal-3-8-all", "universal-5-9-strand", "mixed-3-0-all"])
def test_small_weights_measure_the_stiffness_along(name: str) -> None:
    pose, pull = balanced(name)
    u = np.array([0.0, 0.6, -0.8])
    along = cdsm.stiffness(pose, pull).along(u)
    errors = np.array(
        [
            [test.stiffness / along - 1.0, *(test.displacement / test.tangent_displacement - 1.0)]
            for size in (0.1, 0.05, 0.025)
            for test in [cdsm.weight_test(pose, pull, size * u)]
        ]
    )
    # the first order is the curvature of the force-displacement curve
    np.testing.assert_allclose(errors[:-1] / errors[1:], 2.0, rtol=0.05)
    a, b, c = errors
    assert abs(a - 6.0 * b + 8.0 * c).max() / 3.0 < 1e-6
    assert cdsm.weight_test(pose, pull, u).tangent == pytest.approx(along, rel=1e-12)


def test_steps_lead_to_the_same_end_on_a_curve() -> None:
    pose, pull = prototype()
    force = np.array([0.0, 0.0, -20.0])
    once, often = (cdsm.weight_test(pose, pull, force, steps=n) for n in (1, 8))
    np.testing.assert_allclose(often.displacement, once.displacement, rtol=1e-9)
    # the strand gets stiffer as it is pulled, in other cables softer: no straight line
    secants = often.loads / -often.displacements[:, 2]
    assert (np.diff(secants) < 0.0).all()
    assert secants[0] == pytest.approx(often.tangent, rel=0.02)
    assert abs(secants[-1] / often.tangent - 1.0) > 0.01
    for rest, load in zip(often.states, often.loads, strict=True):
        np.testing.assert_allclose(rest.wrench, [0, 0, -load, 0, 0, 0], rtol=1e-14)
        assert rest.reference is pose


# --- buckling -------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 7])
def test_buckling_under_the_load_says_at_which_part_of_it(steps: int) -> None:
    # K_θ = 1.6 − P/10 of the soft hinge: it gives way at 16 N
    pose = soft_hinge(limit=1.2).at([0.0])
    with pytest.raises(cdsm.EquilibriumError, match=r"buckles at .* joint1 buckles") as caught:
        cdsm.weight_test(pose, [20.0, 20.0], [-20.0, 0.0, 0.0], steps=steps)
    assert caught.value.load_factor == pytest.approx(0.8, abs=2.0**-11)
    assert caught.value.load_factor < 0.8
    assert caught.value.joint == "joint1"
    # just below, it stands
    cdsm.weight_test(pose, [20.0, 20.0], [-15.9, 0.0, 0.0], steps=steps)


def test_buckling_under_a_weight_says_its_mass() -> None:
    pose = soft_hinge(limit=1.2).with_gravity([-9.81, 0.0, 0.0]).at([0.0])
    with pytest.raises(cdsm.EquilibriumError, match=r"under 16 N \(1\.631 kg\)"):
        cdsm.weight_test(pose, [20.0, 20.0], [-20.0, 0.0, 0.0])


def test_arm_that_snaps_through_has_buckled() -> None:
    # where bending softens the hinge, a small moment makes it snap before the straight one buckles
    moment, pretension = 2e-3, 150.0
    pose = soft_hinge().at([0.0])
    with pytest.raises(cdsm.EquilibriumError, match="buckles") as caught:
        cdsm.weight_test(pose, [pretension] * 2, [-7.0, 0.0, 0.0], wrench=moment * MOMENT)
    angles = np.linspace(0.0, 0.6, 6001)

    def stands(load: float) -> bool:
        energy = np.array([compressed(q, load, pretension) - moment * q for q in angles])
        return bool((np.diff(energy) > 0.0).any())  # there is a dip before it goes down

    low, high = 0.0, 7.0
    for _ in range(12):
        middle = (low + high) / 2.0
        low, high = (middle, high) if stands(middle) else (low, middle)
    assert caught.value.load_factor * 7.0 == pytest.approx(low, abs=0.01)
    assert low < 5.3  # the straight one: (2.034 − 1.5)·10 = 5.34 N
    # equilibrium() goes on to where it comes to rest
    W = moment * MOMENT - 7.0 * np.eye(6)[0]
    assert cdsm.equilibrium(pose, [pretension] * 2, W).at_limit == ("joint1",)


# --- friction in the holes: stuck below, sliding above --------------------------------------


def rough(mu: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    return prototype(cdsm.LinearElasticity(48e3), lead=0.3, friction=mu)


def test_small_weights_measure_the_stuck_arm_and_increments_of_large_ones_the_frictionless() -> (
    None
):
    pose, pull = rough(0.1)
    small = cdsm.weight_test(pose, pull, [0.0, 0.0, 0.3])
    assert small.history is not None
    # of an independent program: 0.71 N, 257.4 N/mm, 36.2 N/mm
    assert small.breakaway_load == pytest.approx(0.71, abs=0.01)
    assert small.stiffness == pytest.approx(257.4e3, rel=2e-3)
    assert small.stiffness == pytest.approx(small.stuck, rel=1e-3)
    assert small.tangent == pytest.approx(36.2e3, rel=2e-3)
    assert not small.history.sliding[-1].any()
    assert small.sliding_load == np.inf
    large = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0], steps=2)
    assert large.history is not None
    assert large.stiffness == pytest.approx(51.75e3, rel=1e-3)
    increment = 2.5 / (large.displacements[1] - large.displacements[0])[2]
    assert increment == pytest.approx(large.tangent, rel=0.25)
    np.testing.assert_array_equal(large.tensions[-1, 0], large.history.tensions[0][-1, 0])


def test_from_the_sliding_load_on_the_tangent_is_near_the_frictionless_one_of_the_same_load() -> (
    None
):
    pose, pull = rough(0.1)
    test = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0], steps=20)
    assert test.history is not None
    assert test.sliding_load is not None
    assert 0.7 < test.sliding_load < 3.0
    for k, state in enumerate(test.states):
        ratio = test.history.stiffness(k + 1).along("z") / state.along("z")
        assert (ratio <= 1.25) == (test.loads[k] >= test.sliding_load)
    # strands stiffen with the load: the tangent without the weight is no measure of sliding
    geometry = readme_geometry(lead=0.3, friction=0.05)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    pose = arm.at(np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]))
    loose = cdsm.distribute_tension(pose, 5.0)
    stiffening = cdsm.weight_test(pose, loose, [0.0, 0.0, -5.0], steps=8)
    assert stiffening.history is not None
    assert stiffening.sliding_load is not None
    assert stiffening.sliding_load < 5.0
    assert stiffening.history.stiffness(-1).along("z") > 1.5 * stiffening.tangent


def test_straight_arm_holds_no_cable() -> None:
    arm = presets.virtual_prototype(
        cdsm.LinearElasticity(48e3), lead=0.3, friction=0.2, gravity=(0.0, 0.0, 0.0)
    )
    pose = arm.at(np.zeros(arm.nv))
    test = cdsm.weight_test(pose, np.full(15, 50.0), [0.0, 0.0, 0.01])
    assert test.breakaway_load == test.sliding_load == 0.0
    assert test.stuck == pytest.approx(test.tangent, rel=1e-9)


# --- the question ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("force", "steps", "said"),
    [
        ([0.0, 0.0, 0.0], 1, "force"),
        ([0.0, 0.0, 1e-9], 1, "rounding only.* hang at least"),
        ([0.0, 1.0, math.nan], 1, "force"),
        ([0.0, 0.0, 1.0], 0, "steps"),
        ([0.0, 0.0, 1.0], 1.5, "steps"),
    ],
)
def test_bad_input_is_named(force: Any, steps: Any, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.weight_test(hinge().at([0.0]), [20.0, 20.0], force, steps=steps)

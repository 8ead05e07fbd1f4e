"""The dimensionless balance, and what makes an answer of it the optimum."""

import itertools

import numpy as np

from cdsm.kernels import tension as tension_kernels


def test_balance_is_scaled_by_powers_of_two_and_so_without_rounding() -> None:
    rng = np.random.default_rng(0)
    for lever, pull, reach in itertools.product((3e-9, 0.02, 40.0), (0.0, 1e-4, 7e5), (0.3, 30.0)):
        J = lever * rng.uniform(0.1, 1.0, (5, 3)) * rng.choice([-1.0, 1.0], (5, 3))
        J[0, 0], J[1, 1] = (
            -0.9 * tension_kernels.NO_ARM * reach,
            1.1 * tension_kernels.NO_ARM * reach,
        )
        torque = rng.normal(size=3) * lever
        low, high = pull * rng.uniform(0.0, 1.0, 5), np.full(5, np.inf)
        scaled = tension_kernels.Scaled(
            *tension_kernels.scaled_balance(J, torque, low, high, reach)
        )
        assert scaled.arm == 2.0 ** np.ceil(np.log2(abs(J).max()))
        largest = max((abs(torque) / scaled.arm).max(), low.max())
        assert scaled.force == 2.0 ** np.ceil(np.log2(largest))
        J[0, 0] = 0.0  # rounding of the reach, as of a cable that meets the axis
        np.testing.assert_array_equal(scaled.A * scaled.arm, J.T)
        np.testing.assert_array_equal(scaled.b * scaled.arm * scaled.force, torque)
        np.testing.assert_array_equal(scaled.low * scaled.force, low)
        np.testing.assert_array_equal(scaled.high, high)
    nothing = tension_kernels.scaled_balance(
        np.zeros((2, 1)), np.zeros(1), np.zeros(2), np.ones(2), 1.0
    )
    assert nothing[4:] == (1.0, 1.0)


def test_only_what_is_pressed_against_a_bound_or_outside_is_set_onto_it() -> None:
    low, high, r = 1.0, 3.0, 1e-9
    cases = (
        # x, multiplier, where it is set
        (low + 0.9 * r, -0.5, low),
        (low + 1.1 * r, -0.5, low + 1.1 * r),  # further away than rounding
        (low + 0.9 * r, 0.0, low + 0.9 * r),  # nothing presses it
        (low + 0.9 * r, 0.5, low + 0.9 * r),  # pressed the other way
        (low - 0.5, 0.0, low),
        (low - 0.5, 0.5, low),
        (low, 0.0, low),
        (2.0, -9.0, 2.0),
        (high, 0.0, high),
        (high + 0.5, 0.0, high),
        (high + 0.5, -0.5, high),
        (high - 0.9 * r, -0.5, high - 0.9 * r),
        (high - 0.9 * r, 0.0, high - 0.9 * r),
        (high - 1.1 * r, 0.5, high - 1.1 * r),
        (high - 0.9 * r, 0.5, high),
    )
    x, z, expected = np.array(cases).T
    bounds = np.full(x.size, low), np.full(x.size, high)
    np.testing.assert_array_equal(tension_kernels.settled(x, z, *bounds, r), expected)

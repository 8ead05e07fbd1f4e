"""The dimensionless balance, and what makes an answer of it the optimum."""

import math

import numpy as np

from cdsm._former import tension as tension_kernels
from cdsm.support.values import Array, frozen
from tests.support.kernels import block, from_python

# --- certificates ---------------------------------------------------------------------------

set_optimal = from_python(tension_kernels.set_optimal)
empty_certificate = from_python(tension_kernels.certificate)
set_infeasible = from_python(tension_kernels.set_infeasible)

J2 = np.array([[0.03, 0.0], [-0.03, 0.0], [0.0, 0.02], [0.01, -0.02]])


def certified(F: Array, y: Array, low: Array, high: Array, b: Array | None = None) -> bool:
    torque = J2.T @ F if b is None else b
    scratch = empty_certificate(2, 4, 2)
    # beside a posture that has no optimum
    arguments = (
        block(np.stack([each, np.ones_like(each)])) for each in (J2, torque, low, high, F, y)
    )
    set_optimal(*arguments, scratch, 2)
    return bool(scratch.certified[0] == 1.0)


def is_infeasible(J: Array, b: Array, low: Array, high: Array, v: Array) -> bool:
    scratch = empty_certificate(2, 4, 2)
    # beside a posture that is feasible
    beside = (J, 0.0 * b, 0.0 * low, high, v)
    arguments = (block(np.stack(pair)) for pair in zip((J, b, low, high, v), beside, strict=True))
    set_infeasible(*arguments, scratch, 2)
    assert scratch.certified[1] == 0.0
    return bool(scratch.certified[0] == 1.0)


def test_an_optimum_is_accepted_and_every_fault_refused() -> None:
    low, high = np.full(4, 5.0), np.array([np.inf, np.inf, 40.0, np.inf])
    y = np.array([500.0, 2500.0])
    F = np.clip(J2 @ y, low, high)  # the optimum for the torque it makes
    assert F[1] == F[3] == 5.0
    assert F[2] == 40.0
    assert certified(F, y, low, high)
    assert not certified(F, y + np.array([1e-3, 0.0]), low, high)  # free cable off J y
    assert not certified(F, y, low, high, J2.T @ F + np.array([1e-8, 0.0]))  # out of balance
    assert not certified(F, y, np.array([5.0, 5.1, 5.0, 5.0]), high)  # below a bound
    assert not certified(F, y, low, np.full(4, 39.0))  # above one
    # at a bound from which it would rather go
    assert not certified(F, np.array([500.0, 1500.0]), low, high)
    assert not certified(
        F, np.array([500.0, 6e3]), np.array([5.0, 5.0, 40.0, 5.0]), np.full(4, 90.0)
    )


def test_a_proof_of_infeasibility_is_accepted_and_its_opposite_refused() -> None:
    low, high = frozen(np.zeros(4)), frozen(np.full(4, 10.0))
    reach = 0.03 * 10 + 0.01 * 10  # the most the cables turn the first joint
    v = np.array([1.0, 0.0])
    assert is_infeasible(J2, np.array([reach + 1e-6, 0.0]), low, high, v)
    assert not is_infeasible(J2, np.array([reach - 1e-6, 0.0]), low, high, v)
    assert not is_infeasible(J2, np.array([reach + 1e-6, 0.0]), low, high, -v)
    assert not is_infeasible(J2, np.array([reach, 0.0]), low, high, v)
    # a cable without a maximum pulls as much as is wanted
    high = frozen(np.array([math.inf, 10.0, 10.0, 10.0]))
    assert not is_infeasible(J2, np.array([1e6, 0.0]), low, high, v)
    assert is_infeasible(J2, np.array([-1e6, 0.0]), low, high, -v)

"""Derivatives of stiffness by the tensions, against central differences."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.differences import assert_second_order, central_difference
from tests.support.locked import ARMS, TABLE, balanced, original_lengths

U = np.array([0.3, -0.5, 0.8])


def pulled(name: str, moment: bool) -> cdsm.Stiffness:
    """An arm of all laws, springs and force-controlled cables, its tensions off all kinks."""
    pose, pull = balanced(name, moment=moment)
    F = pull.values + np.random.default_rng(3).uniform(5.0, 9.0, pull.values.size)
    K = cdsm.stiffness(pose, F, pull.wrench)
    assert abs(np.subtract.outer(F, [31.0, *TABLE.tensions])).min() > 0.5
    assert K.is_stable
    return K


@pytest.mark.parametrize("moment", [False, True])
@pytest.mark.parametrize("name", ARMS)
def test_gradients_are_derivatives(name: str, moment: bool) -> None:
    K = pulled(name, moment)
    gradient = cdsm.stiffness_gradient(K)
    assert (abs(K.load - K.load.T).max() > 0.0) == (moment and K.posture.arm.nv > 1)
    reads: list[tuple[Callable[[cdsm.Stiffness], Any], Array]] = [
        (lambda K: K.cable_stiffness, np.diag(gradient.cable_stiffness)),
        (lambda K: K.joint, gradient.joint),
        (lambda K: K.along(U), gradient.along(U)),
        (lambda K: K.margin, gradient.margin),
    ]
    if K.posture.arm.nv > 2:
        reads.append((lambda K: K.cartesian, gradient.cartesian))
    for read, analytic in reads:

        def f(F: Array, read: Callable[[cdsm.Stiffness], Any] = read) -> Array:
            return np.asarray(read(cdsm.stiffness(K.posture, F, K.wrench)))

        # tables are C1 in strain only: differences stay on one side of their points, 0.5 N away
        near: Any = {"step": 0.25, "size": 10.0 * abs(f(K.tension)).max(), "tolerance": 1e-7}
        assert_second_order(f, np.moveaxis(analytic, 0, -1), K.tension, **near)
    force = np.array([cable.control == "force" for cable in K.posture.arm.cables])
    np.testing.assert_array_equal(gradient.joint[force], K.posture.length_hessian[force])


def test_gradient_at_an_equilibrium_is_that_at_its_posture() -> None:
    """The motors pay out what another tension there takes: l_0 changes with it, L does not."""
    pose, pull = balanced("universal-3-8-all")
    rest = cdsm.equilibrium(pose, pull, 2.0 * pull.wrench)
    arm, there = pose.arm, rest.pose
    assert abs(there.cable_lengths / pose.cable_lengths - 1.0).max() > 1e-5

    def springs(F: Array) -> Array:
        free = original_lengths(there, F)
        k = [
            float(cable.tangent_stiffness(f, l0)) if cable.control == "position" else 0.0
            for cable, f, l0 in zip(arm.cables, F, free, strict=True)
        ]
        return np.array(k)

    expected = np.diag(central_difference(springs, rest.tension, 2.0**-8))
    slope = cdsm.stiffness_gradient(rest.stiffness).cable_stiffness
    # second differences of a strand leave 1e-6 of its third derivative
    np.testing.assert_allclose(slope, expected, rtol=1e-6, atol=1e-9 * abs(expected).max())

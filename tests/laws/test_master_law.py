"""The law that certifies Eq. 16 whole: K_θ is the Hessian of the total potential.

    U(q) = Σ_c k_c (L_c − l_c)²/2 + Σ_c F_c L_c + V(q) − f·x(q)

for springs that are l_c long at rest, whose motors are locked, cables whose motors hold their
tension F_c, weight and a dead force f at the tip. Nothing but lengths and places enters, so every
sign in K_θ is settled by it, and l_c by the tension that the spring has. A moment has no potential;
with one, K_θ is the derivative of the torque that is out of balance.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import assert_second_order, gravity_energy

EA = 226e3
"""Axial rigidity [N] of all cables here."""

STEP = 2.0**-6
"""Second differences divide rounding by h², so they need a larger step than first ones do."""

# what the step leaves of h⁶ where segments of cable get short; rounding is a tenth of it
TOLERANCE = 5e-9

# tension times length of all cables; weight or force times length
SIZES = {"active": 100.0, "passive": 100.0, "gravity": 1.0, "load": 1.0}


def _arm(name: str, control: str) -> cdsm.Manipulator:
    """An arm with cables all locked, locked behind springs, force-controlled, or of each kind."""
    kind, _, joints = name.partition("-")
    plain = arms.mixed_arm() if kind == "mixed" else arms.random_arm(3, int(joints), kind)
    law = cdsm.LinearElasticity(EA)
    springs = np.random.default_rng(5).uniform(2e4, 1e6, len(plain.cables))
    cables = [
        replace(
            cable,
            elasticity=law,
            series_stiffness=springs[c]
            if control == "spring" or (control == "each" and c % 3 == 1)
            else np.inf,
            control="force"
            if control == "force" or (control == "each" and c % 3 == 2)
            else "position",
        )
        for c, cable in enumerate(plain.cables)
    ]
    return cdsm.Manipulator(plain.geometry, cables=cables, gravity=plain.gravity)


def _stiffness(name: str, control: str, moment: bool = False) -> cdsm.Stiffness:
    arm = _arm(name, control)
    pose = arms.random_posture(arm, 11)
    wrench = arms.random_wrench(4, moment)
    return cdsm.stiffness(pose, arms.random_tension(arm, 4), wrench=wrench)


def _springs(K: cdsm.Stiffness) -> tuple[Array, Array]:
    """Constant k of each cable and its length at rest l (C,), so that k (L − l) = F.

    A wire of original length l_0 behind a spring: l = l_0, 1/k = l_0/EA + 1/k_s, one equation for
    l_0. Under force control k = 0.
    """
    L = K.posture.cable_lengths
    k, rest = np.zeros(L.size), L.copy()
    for c, cable in enumerate(K.posture.arm.cables):
        if cable.control == "position":

            def missing(l0: float, c: int = c, cable: cdsm.Cable = cable) -> float:
                compliance = l0 / EA + 1.0 / cable.series_stiffness
                return float(L[c]) - l0 - float(K.tension[c]) * compliance

            rest[c] = brentq(missing, 0.0, float(L[c]), xtol=1e-16)
            k[c] = 1.0 / (rest[c] / EA + 1.0 / cable.series_stiffness)
    return k, rest


def _energies(K: cdsm.Stiffness) -> dict[str, Callable[[Array], Array]]:
    """The potential that each part of K_θ is the Hessian of."""
    start = K.posture.cable_lengths
    k, _ = _springs(K)

    def at(q: Array) -> cdsm.Posture:
        return K.posture.arm.at(q, check_limits=False)

    return {
        "active": lambda q: np.array(K.tension @ (at(q).cable_lengths - start)),
        "passive": lambda q: np.array(k @ (at(q).cable_lengths - start) ** 2 / 2.0),
        "gravity": lambda q: np.array(gravity_energy(at(q))),
        "load": lambda q: np.array(-K.wrench[:3] @ at(q).tip[:3, 3]),
    }


def _total(K: cdsm.Stiffness) -> Callable[[Array], Array]:
    """U but for a constant: of locked springs their energy, not what Eq. 16 makes of it."""
    parts, start = _energies(K), K.posture.cable_lengths
    k, rest = _springs(K)
    held, free = k > 0.0, np.where(k > 0.0, 0.0, K.tension)

    def total(q: Array) -> Array:
        L = K.posture.arm.at(q, check_limits=False).cable_lengths
        # (L − l)² − (L_0 − l)², lest the constant take digits
        springs = k[held] @ ((L - start) * (L + start - 2.0 * rest))[held] / 2.0
        return np.array(springs + free @ (L - start) + parts["gravity"](q) + parts["load"](q))

    return total


def _assert_hessian(
    energy: Callable[[Array], Array], matrix: Array, q: Array, size: float = 100.0
) -> None:
    assert_second_order(energy, matrix, q, order=2, step=STEP, size=size, tolerance=TOLERANCE)


ARMS = ["universal-1", "universal-3", "universal-5", "hinged-2", "hinged-4", "mixed"]
CONTROLS = ["position", "spring", "force", "each"]


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", ARMS)
def test_master_law_joint_stiffness_is_hessian_of_total_potential(name: str, control: str) -> None:
    K = _stiffness(name, control)
    _assert_hessian(_total(K), K.joint, K.posture.q)
    np.testing.assert_array_equal(K.joint, K.active + K.passive + K.gravity + K.load)
    # under force control no passive part is left, and the active one is
    np.testing.assert_allclose(K.cable_stiffness, _springs(K)[0], rtol=1e-12)
    assert abs(K.active).max() > 0.01


@pytest.mark.parametrize("part", SIZES)
@pytest.mark.parametrize("name", ARMS)
def test_master_law_holds_part_by_part(name: str, part: str) -> None:
    K = _stiffness(name, "spring")
    _assert_hessian(_energies(K)[part], getattr(K, part), K.posture.q, SIZES[part])


@pytest.mark.parametrize("part", SIZES)
@pytest.mark.parametrize("name", ["universal-3", "mixed"])
def test_master_law_notices_a_wrong_sign(name: str, part: str) -> None:
    # force control, lest the passive part dwarf the others; but then there is no passive part
    K = _stiffness(name, "spring" if part == "passive" else "force")
    with pytest.raises(AssertionError, match="fall at the rates"):
        _assert_hessian(_total(K), K.joint - 2.0 * getattr(K, part), K.posture.q)


def _unbalanced_torque(K: cdsm.Stiffness, wrench: Array) -> Callable[[cdsm.Posture], Array]:
    """∂U/∂q at other postures; with a moment, which has no U, what stands in its place."""
    k, start = _springs(K)[0], K.posture.cable_lengths

    def torque(pose: cdsm.Posture) -> Array:
        tension = K.tension + k * (pose.cable_lengths - start)
        return tension @ pose.length_jacobian + pose.gravity_torque - wrench @ pose.jacobian

    return torque


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", ARMS)
def test_joint_stiffness_is_derivative_of_unbalanced_torque_with_a_moment(
    name: str, control: str
) -> None:
    K = _stiffness(name, control, moment=True)
    torque = _unbalanced_torque(K, K.wrench)
    np.testing.assert_allclose(K.residual, torque(K.posture), rtol=0.0, atol=1e-13)

    def f(q: Array) -> Array:
        return torque(K.posture.arm.at(q, check_limits=False))

    assert_second_order(f, K.joint, K.posture.q)

"""What must not change, what must change how, and one arm worked out by hand."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdsm
from cdsm.support.values import Array
from tests.support import arms

# the same examples every time, and no files; numba compiles during the first one
REPEATABLE = settings(derandomize=True, database=None, deadline=None, max_examples=15)

SEEDS = st.integers(0, 10_000)
NAMES = ("universal-2", "universal-3", "universal-5", "hinged-3", "hinged-6", "mixed")


def _arm(name: str, seed: int = 0) -> cdsm.Manipulator:
    if name == "mixed":
        return arms.mixed_arm()
    kind, joints = name.split("-")
    return arms.random_arm(seed, int(joints), kind)


def _close(found: Array, expected: Array, relative: float) -> None:
    """Equal to a part of the largest entry."""
    atol = relative * abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol)


# A rigid motion of everything: base, weight and load


def _turn(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _turned_arm(arm: cdsm.Manipulator, angle: float) -> cdsm.Manipulator:
    """The arm with its joint axes, its holes and its weight turned about x."""
    R = _turn(angle)
    geometry = arm.geometry
    turned = replace(
        geometry,
        joints=tuple(
            replace(joint, axes=tuple(tuple((R @ axis).tolist()) for axis in joint.axes))
            for joint in geometry.joints
        ),
        cables=tuple(replace(cable, angle=cable.angle + angle) for cable in geometry.cables),
    )
    return cdsm.Manipulator(
        turned, [cable.elasticity for cable in arm.cables], gravity=R @ arm.gravity
    )


@given(name=st.sampled_from(NAMES), seed=SEEDS, angle=st.floats(-3.2, 3.2))
@REPEATABLE
def test_rigid_motion_keeps_joint_stiffness_and_turns_compliance(
    name: str, seed: int, angle: float
) -> None:
    arm = _arm(name, seed)
    pose = arms.random_posture(arm, seed)
    F, W = arms.random_tension(arm, seed), arms.random_wrench(seed)
    K = cdsm.stiffness(pose, F, wrench=W)
    both = np.kron(np.eye(2), _turn(angle))
    moved = _turned_arm(arm, angle).at(pose.q)
    turned = cdsm.stiffness(moved, F, wrench=both @ W)

    _close(moved.cable_lengths, pose.cable_lengths, 1e-14)
    _close(moved.length_jacobian, pose.length_jacobian, 1e-13)
    _close(moved.jacobian, both @ pose.jacobian, 1e-13)
    _close(moved.gravity_torque, pose.gravity_torque, 1e-13)
    for part in ("active", "passive", "gravity", "load", "joint"):
        _close(getattr(turned, part), getattr(K, part), 1e-12)
    # the inverse multiplies rounding by the condition number, up to 1e3
    _close(turned.compliance, both @ K.compliance @ both.T, 1e-10)
    u = np.array([0.48, -0.6, 0.64])
    assert turned.along(both[:3, :3] @ u) == pytest.approx(K.along(u), rel=1e-9)
    _close(turned.cartesian, both[:3, :3] @ K.cartesian @ both[:3, :3].T, 1e-9)


# The order of the cables


@pytest.mark.parametrize("name", NAMES)
def test_order_of_cables_does_not_matter(name: str) -> None:
    arm = _arm(name)
    materials = [cdsm.LinearElasticity(1e5 * (1 + c)) for c in range(len(arm.cables))]
    cables = [replace(c, elasticity=m) for c, m in zip(arm.cables, materials, strict=True)]
    order = np.random.default_rng(3).permutation(len(cables))
    plain = cdsm.Manipulator(arm.geometry, cables=cables, gravity=arm.gravity)
    shuffled = cdsm.Manipulator(
        arm.geometry, cables=[cables[c] for c in order], gravity=arm.gravity
    )
    q = arms.random_posture(arm, 2, reach=0.3).q
    W = arms.random_wrench(2)
    minimum = np.random.default_rng(4).uniform(10.0, 50.0, len(cables))
    pull = cdsm.distribute_tension(plain.at(q), minimum, wrench=W)
    other = cdsm.distribute_tension(shuffled.at(q), minimum[order], wrench=W)
    _close(other.values, pull.values[order], 1e-9)

    K = cdsm.stiffness(plain.at(q), pull.values, wrench=W)
    L = cdsm.stiffness(shuffled.at(q), pull.values[order], wrench=W)
    np.testing.assert_array_equal(L.cable_stiffness, K.cable_stiffness[order])
    np.testing.assert_array_equal(L.posture.length_hessian, K.posture.length_hessian[order])
    # sums over cables in another order
    _close(L.joint, K.joint, 1e-14)
    _close(L.shares((0, 0, 1)).passive, K.shares((0, 0, 1)).passive[order], 1e-10)


# Units


@pytest.mark.parametrize(("length", "force"), [(2.0, 1.0), (1.0, 10.0), (0.5, 3.0)])
@pytest.mark.parametrize("name", NAMES)
def test_joint_stiffness_grows_with_all_lengths_and_with_all_forces(
    name: str, length: float, force: float
) -> None:
    """Torques grow with both; springs, of the same EA, soften as they get longer."""
    arm = _arm(name)
    g = arm.geometry
    longer = replace(
        g,
        base_length=length * g.base_length,
        hole_radius=length * g.hole_radius,
        joints=tuple(replace(j, disk_offset=length * j.disk_offset) for j in g.joints),
        links=tuple(replace(link, length=length * link.length) for link in g.links),
        cables=tuple(replace(c, lead=length * c.lead) for c in g.cables),
    )
    laws = [cdsm.LinearElasticity(force * float(c.elasticity.rigidity(0.0))) for c in arm.cables]
    other = cdsm.Manipulator(longer, laws, gravity=force * arm.gravity)
    pose = arms.random_posture(arm, 4, reach=0.3)
    W = arms.random_wrench(4)
    pull = cdsm.distribute_tension(pose, 20.0, 400.0, wrench=W)
    more = force * W * np.repeat([1.0, length], 3)
    again = cdsm.distribute_tension(other.at(pose.q), force * 20.0, force * 400.0, wrench=more)
    _close(again.values, force * pull.values, 1e-9)
    K = cdsm.stiffness(pose, pull)
    L = cdsm.stiffness(again.posture, force * pull.values, wrench=more)
    for part in ("active", "passive", "gravity", "load", "joint"):
        _close(getattr(L, part), length * force * getattr(K, part), 1e-13)
    _close(L.cable_stiffness, force / length * K.cable_stiffness, 1e-13)
    _close(L.compliance[:3, :3], length / force * K.compliance[:3, :3], 1e-11)
    _close(L.compliance[3:, 3:], K.compliance[3:, 3:] / (length * force), 1e-11)


# Eq. 17


def _problem(seed: int, name: str) -> tuple[cdsm.Posture, Array, Array, Array]:
    """A posture, bounds that are active below and often above, and a wrench."""
    arm = _arm(name, seed)
    pose = arms.random_posture(arm, seed, reach=0.3)
    W = arms.random_wrench(seed)
    rng = np.random.default_rng([seed, 3])
    low = rng.uniform(5.0, 30.0, len(arm.cables))
    least = cdsm.distribute_tension(pose, low, wrench=W).values
    # other tensions in balance that pull less on some cables: between the two is a maximum that
    # the least tensions break and the others keep; rounded, so that last digits ask nothing else
    raised = low + 60.0 * rng.integers(0, 2, low.size)
    other = cdsm.distribute_tension(pose, raised, wrench=W).values
    return pose, low, np.where(other < least - 0.5, np.round((other + least) / 2.0, 6), 200.0), W


# in most draws the other tensions pull less on no cable; in the first row they do
PROBLEMS = [
    *[(0, "universal-5"), (2, "universal-5"), (1, "universal-3"), (3, "mixed")],
    *[(5, "universal-1"), (1, "hinged-6"), (0, "universal-2"), (1, "hinged-3")],
]


@pytest.mark.parametrize("solver", ["daqp", "osqp", "clarabel"])
@pytest.mark.parametrize(("seed", "name"), PROBLEMS)
def test_eq17_tensions_satisfy_the_optimality_conditions(seed: int, name: str, solver: str) -> None:
    """Which make them the only ones: all solvers agree."""
    pose, low, high, W = _problem(seed, name)
    pull = cdsm.distribute_tension(pose, low, high, W, solver=solver)
    F, J = pull.values, pose.length_jacobian
    # Eq. 13, written out
    balance = J.T @ F - (pose.jacobian.T @ W - pose.gravity_torque)
    assert abs(balance).max() < 1e-10
    np.testing.assert_allclose(pull.residual, balance, rtol=0.0, atol=1e-13)
    # a bound is a bound: not crossed by the last bit
    above, below = F - low, high - F
    assert above.min() >= 0.0
    assert below.min() >= 0.0
    at_low, at_high = above < 1e-7, below < 1e-7
    free = ~at_low & ~at_high
    assert at_low.any()
    # and what stands there has its value, not one beside it
    np.testing.assert_array_equal(np.where(at_low, low, high)[~free], F[~free])
    assert at_high.any() == (high < 200.0).any()  # as the least tensions break each such maximum
    # F = J_L λ + μ with μ = 0 on free cables, which settle λ, μ >= 0 at the lower bound, <= 0 at
    # the upper one
    multiplier, _, rank, _ = np.linalg.lstsq(J[free], F[free])
    assert rank == pose.arm.nv
    excess = F - J @ multiplier
    scale = abs(F).max()
    assert abs(excess[free]).max() < 1e-9 * scale
    assert excess[at_low].min() > -1e-9 * scale
    assert excess[at_high].max(initial=-np.inf) < 1e-9 * scale
    assert set(pull.at_minimum) == {pose.arm.cables[c].name for c in np.flatnonzero(at_low)}
    assert set(pull.at_maximum) == {pose.arm.cables[c].name for c in np.flatnonzero(at_high)}


# One hinge and its two cables, by hand


class Hinge:
    """By elementary geometry: hinge about y, half angle a = θ/2, holes at z = ±R.

    The cable from (−h, 0, ±R) to the hole that turns from (h, 0, ±R) is 2(h cos a ± R sin a) long,
    because both holes are as far from the hinge and the chord between them halves the angle.
    """

    h, R, length, base, lead, mass = 0.012, 0.03, 0.1, 0.05, 0.2, 0.4
    EA = 2e5
    gravity = (1.5, 0.7, -9.0)
    sides = np.array([1.0, -1.0])  # hole at +z first

    def __init__(self, angle: float) -> None:
        self.angle = angle
        c, s = math.cos(angle / 2.0), math.sin(angle / 2.0)
        segment = 2.0 * (self.h * c + self.sides * self.R * s)
        self.L = self.lead + segment
        self.J = -self.h * s + self.sides * self.R * c
        self.H = -segment / 4.0
        c, s = math.cos(angle), math.sin(angle)
        gx, _, gz = self.gravity
        arm = self.mass * self.length / 2.0  # the weight at mid-link, (cos θ, 0, −sin θ)
        self.gravity_torque = arm * (gx * s + gz * c)
        self.gravity_stiffness = arm * (gx * c - gz * s)
        self.tip = np.array([self.base + self.length * c, 0.0, -self.length * s])
        self.jacobian = np.array([-self.length * s, 0.0, -self.length * c, 0.0, 1.0, 0.0])

    def torque(self, W: Array) -> float:
        """What the cables have to hold: −J_Lᵀ F = g − J_Xᵀ W."""
        return float(self.jacobian @ W) - self.gravity_torque

    def tension(self, W: Array, minimum: float) -> Array:
        """One cable at the minimum, the other as torque balance asks."""
        above = (self.torque(W) - self.J[1] * minimum) / self.J[0]
        below = (self.torque(W) - self.J[0] * minimum) / self.J[1]
        return np.array([above, minimum] if above >= minimum else [minimum, below])

    def load_stiffness(self, W: Array) -> float:
        fx, fz = W[0], W[2]
        return self.length * float(fx * math.cos(self.angle) - fz * math.sin(self.angle))

    def k(self, F: Array) -> Array:
        """Of wires that were l_0 = L/(1 + F/EA) long before they were pulled."""
        return self.EA / (self.L / (1.0 + F / self.EA))

    def joint_stiffness(self, W: Array, F: Array) -> float:
        elastic = float(self.k(F) @ self.J**2)
        return float(F @ self.H) + elastic + self.gravity_stiffness + self.load_stiffness(W)

    def manipulator(self) -> cdsm.Manipulator:
        geometry = cdsm.Geometry.hinged(
            joints=1,
            twist=0.0,
            link_length=self.length,
            base_length=self.base,
            disk_offset=self.h,
            hole_radius=self.R,
            link_mass=self.mass,
            lead=self.lead,
        )
        return cdsm.Manipulator(geometry, cdsm.LinearElasticity(self.EA), gravity=self.gravity)


WRENCHES = [
    np.zeros(6),
    np.array([2.0, -1.0, 30.0, 0.3, 0.0, -0.2]),
    np.array([-4.0, 3.0, -25.0, 0.1, 0.6, 0.2]),
]


@pytest.mark.parametrize("W", WRENCHES, ids=["none", "up", "down"])
@pytest.mark.parametrize("angle", [-0.6, -0.2, 0.1, 0.5])
def test_one_hinge_by_hand(angle: float, W: Array) -> None:
    by_hand = Hinge(angle)
    pose = by_hand.manipulator().at([angle])
    np.testing.assert_allclose(pose.tip[:3, 3], by_hand.tip, rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(pose.jacobian[:, 0], by_hand.jacobian, rtol=0.0, atol=1e-16)
    np.testing.assert_allclose(pose.cable_lengths, by_hand.L, rtol=1e-15)
    np.testing.assert_allclose(pose.length_jacobian[:, 0], by_hand.J, rtol=1e-14)
    np.testing.assert_allclose(pose.length_hessian[:, 0, 0], by_hand.H, rtol=1e-13)
    assert pose.gravity_torque[0] == pytest.approx(by_hand.gravity_torque, rel=1e-14)

    pull = cdsm.distribute_tension(pose, minimum=50.0, wrench=W)
    F = by_hand.tension(W, 50.0)
    assert F.max() > 51.0
    np.testing.assert_allclose(pull.values, F, rtol=1e-9)

    K = cdsm.stiffness(pose, F, wrench=W)
    np.testing.assert_allclose(K.cable_stiffness, by_hand.k(F), rtol=1e-15)
    assert K.active[0, 0] == pytest.approx(float(F @ by_hand.H), rel=1e-13)
    assert K.active[0, 0] < 0.0
    assert K.passive[0, 0] == pytest.approx(float(by_hand.k(F) @ by_hand.J**2), rel=1e-13)
    assert K.gravity[0, 0] == pytest.approx(by_hand.gravity_stiffness, rel=1e-13)
    assert K.load[0, 0] == pytest.approx(by_hand.load_stiffness(W), rel=1e-13)
    joint = by_hand.joint_stiffness(W, F)
    assert K.joint[0, 0] == pytest.approx(joint, rel=1e-14)
    assert K.margin == pytest.approx(joint, rel=1e-14)
    # the tip moves on a circle: along x by l sin θ, along z by l cos θ per radian, along y not
    length = by_hand.length
    assert K.along((1, 0, 0)) == pytest.approx(joint / (length * math.sin(angle)) ** 2, rel=1e-13)
    assert K.along((0, 0, 1)) == pytest.approx(joint / (length * math.cos(angle)) ** 2, rel=1e-13)
    assert K.along((0, 1, 0)) == math.inf
    tangent = by_hand.jacobian
    np.testing.assert_allclose(
        K.compliance, np.outer(tangent, tangent) / joint, rtol=0.0, atol=1e-13 / joint
    )


# Definitions


def _stiff(name: str, seed: int, moment: bool) -> cdsm.Stiffness:
    pose = arms.random_posture(_arm(name, seed), seed, reach=0.4)
    W = arms.random_wrench(seed, moment)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, wrench=W))


CASES = [(name, seed) for name in NAMES for seed in range(3)]
case = pytest.mark.parametrize(("name", "seed"), CASES, ids=[f"{n}-arm{s}" for n, s in CASES])


@case
def test_cartesian_quantities_by_their_definitions(name: str, seed: int) -> None:
    K: Any = _stiff(name, seed, moment=True)
    J = K.posture.jacobian
    C = J @ np.linalg.inv(K.joint) @ J.T
    # inverses lose the digits of their condition numbers, some 1e3 for K_θ, 1e4 for C_vv
    _close(K.compliance, C, 1e-11)
    _close(K.cartesian, np.linalg.inv(C[:3, :3]).astype(np.float64), 1e-9)
    v = J[:3]
    right = v.T @ np.linalg.inv(v @ v.T)
    for term in ("active", "passive", "gravity", "load", "joint"):
        _close(K.pseudoinverse(term), right.T @ getattr(K, term) @ right, 1e-9)
    for u in (*np.eye(3), np.array([2.0, -1.0, 0.5])):
        unit = u / np.linalg.norm(u)
        assert K.along(u) == pytest.approx(1.0 / (unit @ C[:3, :3] @ unit), rel=1e-9)


@case
def test_shares_sum_to_stiffness_along(name: str, seed: int) -> None:
    K = _stiff(name, seed, moment=True)
    J, H = K.posture.jacobian, K.posture.length_hessian
    for u in (*np.eye(3), np.array([2.0, -1.0, 0.5])):
        shares = K.shares(u)
        assert shares.total == pytest.approx(K.along(u), rel=1e-11)
        motion = np.linalg.inv(K.joint) @ J[:3].T @ shares.direction * K.along(u)
        assert shares.passive.sum() == pytest.approx(motion @ K.passive @ motion, rel=1e-10)
        stretch = K.posture.length_jacobian @ motion
        _close(shares.passive, K.cable_stiffness * stretch**2, 1e-10)
        _close(shares.active, K.tension * np.einsum("cij,i,j->c", H, motion, motion), 1e-10)
        assert shares.gravity == pytest.approx(motion @ K.gravity @ motion, rel=1e-9)
        assert shares.load == pytest.approx(motion @ K.load @ motion, rel=1e-9)
        np.testing.assert_array_equal(shares.cables, shares.passive + shares.active)


@case
def test_tip_held_sideways_is_stiffer_and_least_motion_stiffer_still(name: str, seed: int) -> None:
    """1/C_uu <= (C_vv⁻¹)_uu <= (J⁺ᵀ K J⁺)_uu for a symmetric positive definite K_θ."""
    K = _stiff(name, seed, moment=False)
    _close(K.joint, K.joint.T, 1e-14)
    assert K.is_stable
    for u in (*np.eye(3), *np.random.default_rng(seed).normal(0.0, 1.0, (5, 3))):
        unit = u / np.linalg.norm(u)
        free, held = K.along(unit), float(unit @ K.cartesian @ unit)
        least = float(unit @ K.pseudoinverse() @ unit)
        assert 0.0 < free <= held * (1.0 + 1e-9)
        assert held <= least * (1.0 + 1e-9)
    # and not by accident the same three numbers
    if K.posture.arm.nv > 5:
        assert least > 1.001 * held
    assert held > 1.001 * free


@pytest.mark.parametrize("name", ["universal-1", "universal-3", "hinged-3"])
def test_straight_arm_cannot_move_along_itself(name: str) -> None:
    arm = _arm(name)
    K = cdsm.stiffness(arm.at(np.zeros(arm.nv)), arms.random_tension(arm, 0))
    for x in ((1.0, 0.0, 0.0), (-5.0, 0.0, 0.0)):
        assert K.along(x) == math.inf
        with pytest.raises(cdsm.SingularStiffness):
            K.shares(x)
    assert 0.0 < K.along((0, 1, 0)) < math.inf
    compute: list[Callable[[], Array]] = [lambda: K.cartesian, lambda: K.pseudoinverse("passive")]
    for cartesian in compute:
        with pytest.raises(cdsm.SingularStiffness, match="cannot move") as caught:
            cartesian()
        np.testing.assert_allclose(abs(caught.value.direction), (1.0, 0.0, 0.0), atol=1e-15)


@pytest.mark.parametrize("units", [1.0, 1e-7, 1e9])
def test_what_is_singular_does_not_depend_on_the_units_of_a_joint(units: float) -> None:
    pose = arms.random_posture(arms.random_arm(1, 2, "hinged"), 1)
    K, nothing = cdsm.stiffness(pose, arms.random_tension(pose.arm, 1)), np.zeros((2, 2))
    scale = np.diag([1.0, units])
    for coupling, regular in ((0.5, True), (1.0 - 3e-8, True), (1.0 - 3e-9, False)):
        matrix = scale @ np.array([[1.0, coupling], [coupling, 1.0]]) @ scale
        terms = {"active": nothing, "passive": matrix, "gravity": nothing, "load": nothing}
        other = replace(K, terms={**K.terms, **terms}, joint=matrix)
        if regular:
            moved = np.linalg.solve(matrix, pose.jacobian.T)
            np.testing.assert_allclose(other.compliance, pose.jacobian @ moved, rtol=1e-6)
        else:
            with pytest.raises(cdsm.SingularStiffness, match="about to buckle") as caught:
                _ = other.compliance
            way = scale @ caught.value.direction
            np.testing.assert_allclose(way[0], -way[1], rtol=1e-6)

"""Kernels of the batch by themselves: weight by Pinocchio, linear algebra by LAPACK."""

import itertools

import numpy as np
import pytest
from numpy.typing import ArrayLike

from cdsm.batch import linear_algebra
from cdsm.kernels import bodies as body_kernels
from cdsm.kernels import segments
from cdsm.kernels import stiffness as stiffness_kernels
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tree import Frames, Routing, forward_kinematics
from cdsm.rigid_body import RigidBody
from cdsm.support.validation import Array
from tests.laws.test_derivatives import BRANCH_JOINT, BRANCHES


def test_tree_that_branches_weighs_what_pinocchio_says() -> None:
    inertial = (
        '<inertial><origin xyz="0.02 -0.01 0.03" rpy="0.1 0.2 0.3"/><mass value="{}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    names = [
        ("root", "trunk", "0 1 0", "0.1 0 0"),
        ("trunk", "a", "0 0.6 0.8", "0.1 0.05 0"),
        ("a", "a2", "1 0 0", "0.1 0.02 0.01"),
        ("trunk", "b", "0 0 1", "0.1 -0.05 0"),
        ("b", "b2", "0.6 0.8 0", "0.08 0 0.03"),
    ]
    joints = "\n".join(
        BRANCH_JOINT.format(parent=parent, child=child, axis=axis, xyz=xyz)
        for parent, child, axis, xyz in names
    )
    urdf = BRANCHES.format(joints)
    for mass, link in enumerate(("trunk", "a", "b", "a2", "b2"), start=1):
        urdf = urdf.replace(
            f'<link name="{link}"/>', f'<link name="{link}">{inertial.format(mass)}</link>'
        )
    for tip in ("a2", "b", "root"):
        body = RigidBody(urdf, tip, np.array([1.0, -3.0, -9.0]))
        tree, masses = body.tree(), body.masses()
        q = np.array([0.2, -0.3, 0.4, 0.5, -0.6])
        count = q.size + 1
        rotation = np.full((count, 3, 3), np.nan)  # nothing may stay as it was
        origin, axis = np.full((2, count, 3), np.nan)
        frames = Frames(origin, axis, np.empty(tree.slide.shape), np.empty((0, 3)))
        none, points = np.empty(0, dtype=np.intp), np.empty((0, 3))
        routing = Routing(none, points, np.empty((0, 5), dtype=np.intp), none, np.empty(0))
        forward_kinematics(tree, routing, q, rotation, frames)
        for filled, of_base in ((origin, 0.0), (axis, 0.0), (rotation, np.eye(3))):
            assert np.isfinite(filled).all()
            np.testing.assert_array_equal(filled[0], of_base)
        pose, jacobian = np.full((4, 4), np.nan), np.zeros((6, q.size))
        body_kernels.tip_jacobian(tree.parent, masses, rotation, frames, pose, jacobian)
        heavy, torque = np.full((count, 7), np.nan), np.full(q.size, np.nan)
        slope = np.zeros((q.size, q.size))
        body_kernels.gravity_torque(tree, masses, rotation, frames, heavy, torque)
        body_kernels.add_gravity_stiffness(tree.parent, heavy, slope)
        segments.mirror(slope)

        state = body.state(q)
        assert abs(state.gravity_torque).min() > 0.01
        np.testing.assert_allclose(pose, state.tip, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(jacobian, state.jacobian, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(torque, state.gravity_torque, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(slope, state.gravity_stiffness, rtol=0.0, atol=1e-14)


def test_passive_term_is_a_sum_over_cables_however_sparse_their_moment_arms() -> None:
    rng = np.random.default_rng(0)
    for _ in range(300):
        J = rng.normal(size=rng.integers(1, [9, 7])) * 10.0 ** rng.integers(-3, 3)
        J[rng.random(J.shape) < rng.random()] = 0.0
        k = rng.uniform(0.0, 1e-2, len(J))
        before = rng.normal(size=(J.shape[1],) * 2)
        got = before.copy()
        stiffness_kernels.add_passive_stiffness(J, k, got)
        expected = before + np.triu(np.einsum("c,ci,cj->ij", k, J, J))
        np.testing.assert_allclose(got, expected, rtol=1e-13, atol=1e-15)


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


def symmetric(values: ArrayLike, seed: int = 0) -> Array:
    """A matrix of these eigenvalues."""
    values = np.asarray(values, dtype=np.float64)
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(values.size, values.size)))[0]
    return np.asarray((Q * values) @ Q.T)


SPECTRA: dict[str, ArrayLike] = {
    "one": [3.0],
    "one, negative": [-3.0],
    "zero": [0.0],
    "two": [1.0, 2.0],
    "a pair": [2.0, 2.0],
    "the smallest a pair": [-1.0, -1.0, 5.0, 7.0],
    "the smallest nearly a pair": [1.0, 1.0 + 1e-9, 5.0, 7.0],
    "all alike": [4.0] * 10,
    "five alike, negative": [-4.0] * 5 + [1.0, 2.0, 3.0, 4.0, 5.0],
    "singular": [0.0, 1.0, 2.0, 3.0],
    "zeros": [0.0] * 6,
    "far apart": [1e-9, 1.0, 1e9],
    "far apart and negative": [-1e9, 1e-9, 1.0],
    "tiny": [1e-200, 2e-200, 5e-200],
    "huge": [-1e150, 2e150, 5e150],
    "many": np.linspace(-3.0, 8.0, 40),
}


@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("turned", [True, False])
def test_smallest_eigenvalue(name: str, turned: bool) -> None:
    values = np.asarray(SPECTRA[name])
    A = symmetric(values) if turned else np.diag(values[::-1])
    expected = np.linalg.eigvalsh((A + A.T) / 2.0)[0]
    found = linear_algebra.smallest_eigenvalue((A + A.T) / 2.0, np.empty((4, len(values))))
    # what rounding the matrix can change: some units in the last place of its norm
    assert abs(found - expected) <= 1e-14 * max(1, len(values) / 4) * abs(values).max()


def test_smallest_eigenvalue_of_random_matrices() -> None:
    rng = np.random.default_rng(3)
    for _ in range(500):
        n = int(rng.integers(1, 25))
        A = rng.normal(size=(n, n)) * 10.0 ** rng.integers(-5, 6)
        A = A + A.T
        expected = np.linalg.eigvalsh(A)[0]
        found = linear_algebra.smallest_eigenvalue(A.copy(), np.empty((4, n)))
        assert abs(found - expected) <= 2e-14 * np.linalg.norm(A, 2)


@pytest.mark.parametrize("exponent", range(-323, 1, 7))
def test_smallest_eigenvalue_of_nearly_diagonal_matrices(exponent: int) -> None:
    rng = np.random.default_rng(5)
    for n in (2, 3, 4, 9):
        A = np.diag(rng.normal(size=n)) + float(f"1e{exponent}") * symmetric(rng.normal(size=n))
        A = (A + A.T) / 2.0
        found = linear_algebra.smallest_eigenvalue(A.copy(), np.empty((4, n)))
        assert abs(found - np.linalg.eigvalsh(A)[0]) <= 2e-14 * np.linalg.norm(A, 2)


def test_singular_values_of_three_rows() -> None:
    rng = np.random.default_rng(4)
    for n in (1, 2, 3, 10, 31):
        for scale in ((1.0, 1.0, 1.0), (1.0, 1e-3, 1e-7), (1e6, 0.0, 1.0)):
            A = rng.normal(size=(3, 3)) @ np.diag(scale) @ rng.normal(size=(3, n))
            rows_, left, values = A.copy(), np.empty((3, 3)), np.empty(3)
            linear_algebra.singular_values(rows_, left, values)
            expected = np.linalg.svd(A, compute_uv=False)
            size = expected.max()
            np.testing.assert_allclose(
                np.sort(values)[::-1][: expected.size], expected, atol=1e-14 * size
            )
            np.testing.assert_allclose(
                left @ (values[:, None] * rows_), A, rtol=0.0, atol=1e-14 * size
            )
            np.testing.assert_allclose(left.T @ left, np.eye(3), rtol=0.0, atol=1e-14)


def test_elimination_solves_and_tells_of_singular_matrices() -> None:
    rng = np.random.default_rng(5)
    for n in (1, 2, 5, 20):
        A, B = rng.normal(size=(n, n)), rng.normal(size=(n, 4))
        A[0, 0] = 0.0 if n > 1 else 2.0  # rows have to be exchanged
        M = np.hstack([A, B])
        ratio = linear_algebra.eliminate(M)
        assert 0.0 < ratio <= 1.0
        np.testing.assert_allclose(M[:, n:], np.linalg.solve(A, B), rtol=1e-10)
    assert linear_algebra.eliminate(np.array([[1.0, 2.0, 1.0], [2.0, 4.0, 1.0]])) == 0.0
    assert linear_algebra.eliminate(np.zeros((3, 4))) == 0.0

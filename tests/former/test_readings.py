"""Readings of K_θ by themselves: as LAPACK has them, and where they do not exist."""

import math

import numpy as np
import pytest

from cdsm._former import readings
from cdsm._former.read import read
from cdsm.support.values import Array, frozen

Matrices = tuple[Array, Array, Array, Array, Array]


def terms(seed: int, nv: int) -> Matrices:
    """K_θ, not symmetric, and its active, passive, gravity and load term."""
    rng = np.random.default_rng(seed)
    active, gravity, load = 0.1 * rng.normal(size=(3, nv, nv))
    half = rng.normal(size=(nv, nv + 2))
    passive = half @ half.T
    a, p, g, w = map(frozen, (active + active.T, passive, gravity + gravity.T, load))
    return frozen(a + p + g + w), a, p, g, w


def read_one(
    K: Array, parts: Array, JX: Array, u: Array, *names: str
) -> tuple[int, dict[str, Array]]:
    """The status and some readings of one posture, without the axes of blocks."""
    status = np.full((1, 1), readings.READ)
    matrix, held, jacobian = (
        np.ascontiguousarray(each)[None, :, :, None] for each in (K, parts, JX)
    )
    found = read(matrix, held, jacobian, np.ascontiguousarray(u), names, status, None)
    return int(status[0, 0]), {name: value[0, ..., 0] for name, value in found.items()}


def all_of(matrices: Matrices, JX: Array, u: Array) -> tuple[int, Array, Array, Array]:
    parts = np.sum([abs(term) for term in matrices[1:]], axis=0)
    names = ("along", "compliance", "cartesian")
    status, found = read_one(matrices[0], parts, JX, u, *names)
    return status, found["along"], found["compliance"], found["cartesian"]


def pseudoinverse_of(K: Array, JX: Array) -> tuple[int, Array]:
    status, found = read_one(K, K, JX, np.zeros((0, 3)), "pseudoinverse")
    return status, found["pseudoinverse"]


@pytest.mark.parametrize("nv", [3, 4, 10, 25])
def test_readings_are_their_formulas(nv: int) -> None:
    matrices = terms(nv, nv)
    K = matrices[0]
    rng = np.random.default_rng(nv)
    JX, u = rng.normal(size=(6, nv)), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    status, along, compliance, cartesian = all_of(matrices, JX, u)
    C = JX @ np.linalg.inv(K) @ JX.T
    assert status == readings.READ
    np.testing.assert_allclose(compliance, C, rtol=0.0, atol=1e-11 * abs(C).max())
    np.testing.assert_allclose(along, [1.0 / (v @ C[:3, :3] @ v) for v in u], rtol=1e-9)
    expected = np.linalg.inv(C[:3, :3])
    np.testing.assert_allclose(cartesian, expected, rtol=0.0, atol=1e-9 * abs(expected).max())
    pinv = np.linalg.pinv(JX[:3])
    status, pseudoinverse = pseudoinverse_of(K, JX)
    np.testing.assert_allclose(pseudoinverse, pinv.T @ K @ pinv, rtol=1e-9)


def test_a_tip_that_cannot_move_has_no_matrix_and_is_infinitely_stiff_there() -> None:
    matrices = terms(0, 5)
    JX = np.random.default_rng(0).normal(size=(6, 5))
    JX[0] = 0.0
    status, along, compliance, cartesian = all_of(matrices, JX, np.eye(3))
    assert status == readings.IMMOBILE
    assert along[0] == math.inf
    assert np.isfinite(along[1:]).all()
    assert np.isfinite(compliance).all()
    assert np.isnan(cartesian).all()
    status, pseudoinverse = pseudoinverse_of(matrices[0], JX)
    assert status == readings.IMMOBILE
    assert np.isnan(pseudoinverse).all()


@pytest.mark.parametrize("units", [1.0, 1e-4, 1e4])
def test_what_is_singular_does_not_depend_on_the_units_of_a_joint(units: float) -> None:
    """Just above REGULAR times its parts K_θ has an inverse, just below it has none."""
    rng = np.random.default_rng(1)
    D = np.diag([1.0, units, 1.0, 1.0])
    Q = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    JX = rng.normal(size=(6, 4))
    for part, singular in ((0.9, True), (1.1, False)):
        parts = np.eye(4) + np.diag([0.3] * 3, 1) + np.diag([0.3] * 3, -1)
        scaled = (Q * [part * readings.REGULAR, 0.5, 0.6, 0.7]) @ Q.T
        # two terms that sum to K, their magnitudes to parts in the joints' own units
        plus, minus = (parts + scaled) / 2.0, (scaled - parts) / 2.0
        K, active, passive = (frozen(D @ each @ D) for each in (scaled, plus, minus))
        zero = frozen(np.zeros((4, 4)))
        status, along, *_ = all_of((K, active, passive, zero, zero), JX, np.eye(3))
        assert (status == readings.SINGULAR) == singular
        assert np.isnan(along).all() == singular


def test_a_joint_that_nothing_holds_is_singular() -> None:
    K = frozen(np.diag([1.0, 0.0, 2.0]))
    zero = frozen(np.zeros((3, 3)))
    status, *_ = all_of((K, K, zero, zero, zero), np.ones((6, 3)), np.eye(3))
    assert status == readings.SINGULAR

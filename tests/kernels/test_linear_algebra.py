"""Dense linear algebra of small matrices, as LAPACK has it."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from cdsm.kernels import linear_algebra
from cdsm.support.values import Array


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


@pytest.mark.parametrize("exponent", [-323, -300, -158, -30, -20, -16, -12, -8, -4, -1])
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

"""Dense linear algebra of small matrices, as LAPACK has it."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from cdsm._former import linear_algebra
from cdsm.support.values import Array
from tests.support.kernels import block, from_python

_smallest_eigenvalue = from_python(linear_algebra.smallest_eigenvalue)
_eliminate = from_python(linear_algebra.eliminate)


def smallest_eigenvalues(matrices: Array) -> Array:
    """The smallest eigenvalue of each matrix (W, n, n), as a block and one by one."""
    width, n, _ = matrices.shape
    found = np.empty(width)
    _smallest_eigenvalue(block(matrices), np.empty((4 * n + 10, width)), found, width)
    for w, matrix in enumerate(matrices):
        alone = np.empty(1)
        _smallest_eigenvalue(block(matrix[None]), np.empty((4 * n + 10, 1)), alone, None)
        assert alone[0] == found[w]  # to the last bit
    return found


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
    (found,) = smallest_eigenvalues(((A + A.T) / 2.0)[None])
    # what rounding the matrix can change: some units in the last place of its norm
    assert abs(found - expected) <= 1e-14 * max(1, len(values) / 4) * abs(values).max()


def test_smallest_eigenvalue_of_random_matrices() -> None:
    rng = np.random.default_rng(3)
    for _ in range(150):
        width, n = rng.integers(1, [6, 25])
        A = rng.normal(size=(width, n, n)) * 10.0 ** rng.integers(-5, 6, (width, 1, 1))
        A = A + A.transpose(0, 2, 1)
        expected = np.linalg.eigvalsh(A)[:, 0]
        norms = np.linalg.norm(A, 2, axis=(1, 2))
        assert (abs(smallest_eigenvalues(A) - expected) <= 2e-14 * norms).all()


@pytest.mark.parametrize("exponent", [-323, -300, -158, -30, -20, -16, -12, -8, -4, -1])
def test_smallest_eigenvalue_of_nearly_diagonal_matrices(exponent: int) -> None:
    rng = np.random.default_rng(5)
    for n in (2, 3, 4, 9):
        A = np.diag(rng.normal(size=n)) + float(f"1e{exponent}") * symmetric(rng.normal(size=n))
        A = (A + A.T) / 2.0
        (found,) = smallest_eigenvalues(A[None])
        assert abs(found - np.linalg.eigvalsh(A)[0]) <= 2e-14 * np.linalg.norm(A, 2)


def test_elimination_solves_and_tells_of_singular_matrices() -> None:
    rng = np.random.default_rng(5)
    for n in (1, 2, 5, 20):
        A, B = rng.normal(size=(4, n, n)), rng.normal(size=(4, n, 4))
        A[:2, 0, 0] = 0.0 if n > 1 else 2.0  # rows have to be exchanged in some matrices
        M, pivots = block(np.concatenate([A, B], axis=2)), np.empty((4, 4))
        _eliminate(M, pivots, 4)
        assert (pivots[0] > 0.0).all()
        assert (pivots[0] <= pivots[1]).all()
        np.testing.assert_allclose(M[:, n:], block(np.linalg.solve(A, B)), rtol=1e-9)
    singular = np.array([[[1.0, 2.0, 1.0], [2.0, 4.0, 1.0]], [[0.0] * 3] * 2])
    pivots = np.empty((4, 2))
    _eliminate(block(singular), pivots, 2)
    np.testing.assert_array_equal(pivots[0], 0.0)

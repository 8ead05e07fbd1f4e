"""The curvature that the quadratic programs get; the other kernels are tested where they serve."""

from typing import Any

import numpy as np
import pytest

from cdsm.kernels.compiling import at_once
from cdsm.kernels.interpreting import python_kernel
from cdsm.planning import kernels
from cdsm.planning.kernels import convex


def test_curvature_is_positive_and_untouched_where_it_was_on_the_free_steps() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        basis = np.linalg.qr(rng.normal(size=(7, 7)))[0]
        null, held = np.ascontiguousarray(basis[:, :4]), rng.normal(size=(1, 7))
        W = rng.normal(size=(7, 7))
        W = W + W.T
        made = convex(W, null, held)
        assert np.linalg.eigvalsh(made)[0] > 0.0
        free = null @ np.linalg.svd(held @ null)[2][1:].T
        inner = free.T @ W @ free
        if np.linalg.eigvalsh(inner)[0] > 0.1:
            np.testing.assert_allclose(free.T @ made @ free, inner, atol=1e-12)
        positive = W @ W + np.eye(7)
        made = convex(positive, null, np.zeros((0, 7)))
        np.testing.assert_allclose(null.T @ made @ null, null.T @ positive @ null, atol=1e-11)


@pytest.mark.parametrize("nv", [2, 5, 10])
def test_first_calls_in_python_give_the_bits_of_compiled_ones(nv: int) -> None:
    rng = np.random.default_rng(nv)
    count = nv + 3
    hessian, J = rng.normal(size=(count, nv, nv)), rng.normal(size=(count, nv))
    hessian += hessian.transpose(0, 2, 1)
    F, k, slope, bend = rng.uniform(1.0, 2.0, size=(4, count))
    rows, weights = rng.normal(size=(2, nv)), rng.normal(size=(3, 2, 2))
    basis = np.ascontiguousarray(np.linalg.qr(rng.normal(size=(count, count)))[0][:, :3])
    K = 20.0 * np.eye(nv) + rng.normal(size=(nv, nv))
    _, right, left, inverse = kernels.tip_stiffness(K, rows)
    np.testing.assert_allclose(inverse @ K, np.eye(nv), atol=1e-12)
    geometry = hessian, J, slope
    calls: list[tuple[Any, Any]] = [
        (kernels.stiffness_at, (K, hessian, J, F, k)),
        (kernels.tip_stiffness, (K, rows)),
        (kernels.form_by_tension, (*geometry, left, right)),
        (kernels.constraint_jacobian, (*geometry, weights, left, right)),
        (kernels.constraint_hessian, (*geometry, bend, weights[0], inverse, rows, left, right)),
        (convex, (np.diag(F) - 1.2, basis, rng.normal(size=(1, count)))),
    ]
    for kernel, arguments in calls:
        with at_once():
            one = kernel(*arguments)
        other = python_kernel(kernel.py_func, wide=False)(*arguments)
        pairs = zip(one, other, strict=True) if isinstance(one, tuple) else [(one, other)]
        assert all(np.array_equal(*pair) for pair in pairs)

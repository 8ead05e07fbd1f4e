"""The curvature that the quadratic programs get; the other kernels are tested where they serve."""

import numpy as np

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

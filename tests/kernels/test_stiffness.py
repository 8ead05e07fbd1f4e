"""Terms of K_θ by themselves; their sum is checked by tests/laws."""

import numpy as np

from cdsm.kernels import stiffness as stiffness_kernels


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

"""Terms of K_θ by themselves; their sum is checked by tests/laws."""

import numpy as np

from cdsm._former import stiffness as stiffness_kernels
from tests.support.kernels import block, from_python

add_passive_stiffness = from_python(stiffness_kernels.add_passive_stiffness)


def test_passive_term_is_a_sum_over_cables_however_sparse_their_moment_arms() -> None:
    rng = np.random.default_rng(0)
    for _ in range(300):
        count, nv, width = rng.integers(1, [9, 7, 4])
        J = rng.normal(size=(width, count, nv)) * 10.0 ** rng.integers(-3, 3)
        J[rng.random(J.shape) < rng.random()] = 0.0
        k = rng.uniform(0.0, 1e-2, (width, count))
        before = rng.normal(size=(width, nv, nv))
        got = block(before)
        add_passive_stiffness(block(J), block(k), got, np.empty((6, width)), width)
        expected = before + np.triu(np.einsum("wc,wci,wcj->wij", k, J, J))
        np.testing.assert_allclose(got, block(expected), rtol=1e-13, atol=1e-15)

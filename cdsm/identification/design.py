"""Optimal design of experiments: which tests determine parameters best, and how far from best.

Test i has the Fisher information M_i = J_iᵀ J_i (r, r). J_i are the derivatives of its readings, in
standard deviations, with respect to the r parameters. If each test i is made n_i times, the
information is M = M_0 + Σ n_i M_i, where M_0 is the prior information. The covariance of the
parameters is C = M⁻¹. The matrix L (s, r) gives the s wanted quantities, as linear combinations of
the r parameters. (In other modules L is a cable length.) The criterion of a design is
f = det(L C Lᵀ)^(−1/s) (D-optimal) or f = 1/tr(L C Lᵀ) (A-optimal). The best design has the largest
f. Both criteria are concave and homogeneous in the information, so no design of N tests has a
larger f than

    f · (tr M_0 G + N max_i tr M_i G) / tr M G,   G = C Lᵀ (L C Lᵀ)⁻¹ L C (D) or C Lᵀ L C (A).

This is the equivalence theorem (Kiefer and Wolfowitz 1960; Pukelsheim, Optimal Design of
Experiments, 1993, chapter 7). The multiplicative algorithm (Silvey, Titterington and Torsney 1978)
finds the best n_i as real numbers, the exchange algorithm (Fedorov 1972) as whole numbers.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from cdsm.support.values import Array

Criterion = Literal["D", "A"]

_ITERATIONS = 2000  # steps that find shares, at most
_OPTIMAL = 0.999  # proved efficiency at which the search for shares ends
_GAIN = 1e-9  # smallest gain of ln f that is worth an exchange


class Design(NamedTuple):
    """Problem of experimental design: which N of n candidate tests determine parameters best."""

    information: Array  # M_i (n, r, r) of each of n candidates, for r parameters
    known: Array  # M_0 (r, r), the prior information
    wanted: Array  # L (s, r): s wanted combinations of the parameters
    criterion: Criterion  # ``"D"`` or ``"A"``
    tests: int  # number N of tests

    def value(self, M: Array) -> Array:
        """Compute ln f (…) of information matrices M (…, r, r), with the criterion f of the design.

        A larger f is better. A singular matrix gives −inf.
        """
        regular = np.linalg.cond(M) < 1e14
        C = np.linalg.inv(np.where(regular[..., None, None], M, np.eye(M.shape[-1])))
        covariance = self.wanted @ C @ self.wanted.T
        if self.criterion == "A":
            found = -np.log(np.trace(covariance, axis1=-2, axis2=-1))
        else:
            found = -np.linalg.slogdet(covariance)[1] / len(self.wanted)
        return np.where(regular, found, -np.inf)

    def total(self, counts: Array) -> Array:
        """Compute the information M_0 + Σ n_i M_i (r, r); ``counts`` (n,) are the numbers n_i."""
        return np.asarray(self.known + np.tensordot(counts, self.information, 1))

    def sensitivities(self, M: Array) -> tuple[Array, float]:
        """Compute tr M_i G (n,), and a proved lower bound of the efficiency f/f_best of a design.

        ``M`` (r, r) is the information of the design. tr M_i G is proportional to the gain from one
        more test i; the docstring of the module defines G. The bound is between 0 and 1.
        """
        C = np.linalg.inv(M)
        right = C @ self.wanted.T
        if self.criterion == "D":
            G = right @ np.linalg.solve(self.wanted @ right, right.T)
        else:
            G = right @ right.T
        each = np.einsum("nij,ji->n", self.information, G)
        most = float(np.sum(self.known * G)) + self.tests * float(each.max())
        return each, float(np.sum(M * G)) / most

    def shares(self) -> Array:
        """Compute the best repetitions n_i (n,) of the tests as real numbers, with the sum N."""
        counts = np.full(len(self.information), self.tests / len(self.information))
        power = 1.0 if self.criterion == "D" else 0.5
        for _ in range(_ITERATIONS):
            each, efficiency = self.sensitivities(self.total(counts))
            if efficiency > _OPTIMAL:
                break
            counts = counts * each**power
            counts *= self.tests / counts.sum()
        return np.asarray(counts)

    def whole(self, shares: Array) -> Array:
        """Compute whole repetitions (n,) from real ones, ``shares`` (n,).

        They are rounded. Then single tests are exchanged for others as long as the criterion f
        rises.
        """
        counts = np.floor(shares)
        left = self.tests - int(counts.sum())
        counts[np.argsort(counts - shares)[:left]] += 1.0
        here = self.value(self.total(counts))
        while True:
            best, exchange = here + _GAIN, None
            for i in np.flatnonzero(counts):
                without = self.total(counts) - self.information[i]
                values = self.value(without + self.information)
                j = int(values.argmax())
                if values[j] > best:
                    best, exchange = values[j], (i, j)
            if exchange is None:
                return counts
            counts[exchange[0]] -= 1.0
            counts[exchange[1]] += 1.0
            here = best

    def best(self) -> tuple[Array, float]:
        """Find the best whole repetitions (n,) of the tests, and a proved lower bound of f/f_best.

        f is the criterion of this design, f_best that of the best possible one. The bound is
        between 0 and 1.
        """
        shares = self.shares()
        counts = self.whole(shares)
        M, ideal = self.total(counts), self.total(shares)
        if not np.isfinite(self.value(M)):
            return counts, 0.0
        by_shares = np.exp(self.value(M) - self.value(ideal)) * self.sensitivities(ideal)[1]
        return counts, min(1.0, max(self.sensitivities(M)[1], float(by_shares)))

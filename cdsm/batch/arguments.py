"""Arguments of the kernel ``evaluate_rows``: arrays of the arm, the postures, the outputs."""

from __future__ import annotations

from typing import NamedTuple

from cdsm._former.bodies import Masses
from cdsm._former.serpentine_guess import Blocks
from cdsm._former.tree import Indices, Routing, Tree
from cdsm.batch.layout import Flags
from cdsm.support.values import Array, frozen


class Arm(NamedTuple):
    """An arm with nv joint coordinates and C cables, as arrays for ``evaluate_rows``."""

    tree: Tree  # joints
    routing: Routing  # cables
    masses: Masses  # masses on the joints, and place of the tip
    lowest: Array  # lower joint limits (nv,) [rad]
    highest: Array  # upper joint limits (nv,) [rad]
    blocks: Blocks  # joints and cables in the order in which tensions are guessed
    smallest_arm: float  # moment arms below this are rounding errors, and count as 0 [m]
    linear: Array  # EA (1 + ε) = a + b F of linear laws: a (C,) [N], b (C,); 0 for others (2, C)
    series: Array  # 1/k_series of each cable (C,) [m/N]
    rest: Array  # tension at which the series spring of each cable is unstrained (C,) [N]


class Rows(NamedTuple):
    """Inputs of b postures.

    An array has 1 row if all postures have the same values, and no row if the values are not given.
    """

    q: Array  # joint angles (b, nv) [rad]
    wrench: Array  # W (b, 6)
    tension: Array  # F (b, C) [N]; none if tensions are distributed or not needed
    low: Array  # lower bounds (b, C) [N] of distributed tensions
    high: Array  # upper bounds (b, C) [N]
    rigidity: Array  # EA (1 + ε) (b, C) [N], −1 outside the domain; none if all laws are linear

    def take(self, rows: slice | Indices) -> Rows:
        """Return the inputs of some ``rows``; an array with one row for all stays as it is."""
        return Rows(*(frozen(each[rows]) if len(each) > 1 else each for each in self))


class Asked(NamedTuple):
    """The quantities that a batch must compute; :mod:`cdsm.batch.layout` gives each a number."""

    start: Indices  # index in the record at which each quantity begins
    stored: Flags  # whether the kernel copies each quantity to its output
    last: int  # largest number of a quantity that is needed


class Kept(NamedTuple):
    """Arrays that ``evaluate_rows`` fills for the readings of K_θ, such as ``along``.

    There are B blocks of W postures. B is 0 for an array that no requested reading needs.
    """

    joint: Array  # K_θ (B, nv, nv, W)
    parts: Array  # sum of the magnitudes of the four terms of K_θ (B, nv, nv, W)
    jacobian: Array  # J_X (B, 6, nv, W), zero before the kernel fills it

    def first(self, blocks: int) -> Kept:
        """Return the same arrays for the first ``blocks`` blocks only."""
        return Kept(*(each[:blocks] for each in self))

"""Arguments of the fused kernel as records of arrays: the arm, the postures, what is asked."""

from __future__ import annotations

from typing import NamedTuple

from cdsm.batch.layout import Flags
from cdsm.kernels.bodies import Masses
from cdsm.kernels.serpentine_guess import Blocks
from cdsm.kernels.stuck import Holes
from cdsm.kernels.tree import Indices, Routing, Tree
from cdsm.kernels.wires import Wires
from cdsm.support.values import Array, frozen


class Arm(NamedTuple):
    """Arm with nv joint coordinates and C cables."""

    tree: Tree  # joints
    routing: Routing  # cables
    masses: Masses  # masses on the joints, and place of the tip
    lowest: Array  # lower joint limits (nv,) [rad]
    highest: Array  # upper joint limits (nv,) [rad]
    blocks: Blocks  # of joints and cables, from which tensions are guessed
    smallest_arm: float  # moment arms below this are rounding in the balance of tensions [m]
    laws: Wires  # laws of the cables; EA is 0 under force control
    wires: Wires  # the same for cables that stick: EA is not 0 under force control
    holes: Holes  # holes, leads and series springs of the cables


class Rows(NamedTuple):
    """What is given for b postures; one row if it is the same for all, none if it is not given."""

    q: Array  # joint angles (b, nv) [rad]
    wrench: Array  # W (b, 6)
    tension: Array  # F (b, C) [N]; none if tensions are distributed or not needed
    low: Array  # lower bounds (b, C) [N] of distributed tensions
    high: Array  # upper bounds (b, C) [N]
    rigidity: Array  # EA (1 + ε) (b, C) [N], −1 outside the domain; none if kernels know all laws
    wire: Array  # the same of the laws ``wires`` of the arm

    def take(self, rows: slice | Indices) -> Rows:
        """Return some of the rows."""
        return Rows(*(frozen(each[rows]) if len(each) > 1 else each for each in self))


class Asked(NamedTuple):
    """Quantities that are asked for, by their numbers in the layout."""

    start: Indices  # index in the record at which each quantity begins
    stored: Flags  # whether the kernel stores each quantity
    last: int  # largest number of a quantity that is needed
    slides: bool  # whether the passive stiffness of cables that slide freely is needed
    sticks: bool  # whether the passive stiffness of cables that stick is needed


class Kept(NamedTuple):
    """Arrays from which readings are computed: B blocks of W postures; W is the last axis.

    Arrays that no reading needs have no blocks.
    """

    joint: Array  # K_θ (B, nv, nv, W)
    parts: Array  # sum of the magnitudes of its terms (B, nv, nv, W)
    jacobian: Array  # J_X (B, 6, nv, W), zero before the kernel fills it
    stuck: Array  # K_θ while the cables stick (B, nv, nv, W)
    stuck_parts: Array  # sum of the magnitudes of its terms (B, nv, nv, W)

    def first(self, blocks: int) -> Kept:
        """Return the first blocks."""
        return Kept(*(each[:blocks] for each in self))

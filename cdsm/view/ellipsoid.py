"""Ellipsoid of the displacements of the tip, as a surface for the scene."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from cdsm.support.values import Array, frozen

ELLIPSOID_GRID: Final = (13, 25)
"""Number of points of a drawn ellipsoid: from pole to pole, and around its axis."""

_LARGEST = 0.3  # largest half axis of a drawn ellipsoid, as a fraction of the arm's length


class Ellipsoid(NamedTuple):
    """Ellipsoid of the tip displacements C_vv f under all forces f of 1 N, to be drawn."""

    surface: Array  # points of the drawn surface (3, 13, 25) [m]
    scale: float  # drawn displacement over true displacement [-], a power of ten

    def __str__(self) -> str:
        large = max(self.scale, 1.0)
        small = max(1.0 / self.scale, 1.0)
        return f"where 1 N moves the tip, scale {large:g}:{small:g}"


def ellipsoid(compliance: Array, tip: Array, length: float) -> Ellipsoid | None:
    """Scale the ellipsoid of C_vv (3, 3) [m/N] at the tip (3,) to 3 to 30 % of ``length`` [m].

    None if no force moves the tip.
    """
    longest = float(np.linalg.norm(compliance, 2))
    if longest == 0.0:
        return None
    rows, columns = ELLIPSOID_GRID
    turn, down = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, columns), np.linspace(0.0, np.pi, rows))
    force = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)])
    scale = 10.0 ** math.floor(math.log10(_LARGEST * length / longest))
    moved = scale * np.einsum("ij,j...->i...", compliance, force)
    return Ellipsoid(frozen(moved + tip[:, None, None]), scale)

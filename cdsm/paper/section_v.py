"""What Section V of the paper prints of its experiments, in SI units."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdsm._checks import frozen

AXES: Final = ("x", "y", "z")

TABLE_II: Final = frozen(
    1e3
    * np.array(
        [
            [4.08, 2.23, 8.88],
            [4.86, 7.45, 10.31],
            [5.76, 7.24, 16.43],
            [8.21, 9.94, 27.54],
            [12.71, 10.29, 35.25],
        ]
    )
)
"""Stiffness in x, y, z (5, 3) [N/m], measured at tensions rising from 3 to 86 N (Table II)."""

TENSIONS: Final = frozen(np.linspace(3.0, 86.0, 5))
"""Those tensions [N]: the paper gives the first and the last, evenly spaced ones are assumed."""

POSTURE: Final = frozen(np.deg2rad([-12.0, -18.0, -20.0]))
"""Joint angles of Table II [rad] (Section V-C)."""

DROPS: Final = (0.17, 0.40)
"""Largest reductions in y with tension, of two configurations (Fig. 12)."""

RISES: Final = (7.93, 12.25)
"""Increments in y, (last − first)/first, from the softest to the stiffest spring (Fig. 13)."""

CHECK: Final = 139.0
"""Calculated stiffness in z [N/m] of the accuracy check; 131 was measured (Section V-B)."""

HYBRID: Final = 1890.0
"""Stiffness of the hybrid cables of Fig. 12 [N/m]: strand and spring together."""

NAMES: Final = (
    *(f"Table II, {axis}, {tension:g} N" for tension in TENSIONS for axis in AXES),
    *("Fig. 12, first", "Fig. 12, second", "Fig. 13, first", "Fig. 13, second"),
    "V-B, z",
)
"""What each of the 20 numbers is."""

"""Numbers in Section V of the paper, which describes its experiments, in SI units."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdsm.support.values import frozen

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
"""Measured stiffness in x, y, z (5, 3) [N/m], at tensions rising from 3 to 86 N (Table II)."""

TABLE_II_SWAPPED: Final = frozen(
    np.where(np.isin(np.arange(5), (1, 2, 3))[:, None], TABLE_II[:, [1, 0, 2]], TABLE_II)
)
"""Table II with x and y exchanged in rows 2 to 4 (5, 3) [N/m].

By the caption of Fig. 10 and Section V-C, y is the least of the three. The printed table
contradicts this in exactly these rows: 7.45 > 4.86, 7.24 > 5.76, 9.94 > 8.21. In these rows y also
falls, from 7.45 to 7.24. With the exchange, y is the least in every row and always rises. The
increments from the first to the last row do not change.
"""

TENSIONS: Final = frozen(np.linspace(3.0, 86.0, 5))
"""Tensions of the rows of Table II (5,) [N]: first and last are given, even spacing is assumed."""

POSTURE: Final = frozen(np.deg2rad([-12.0, -18.0, -20.0]))
"""Joint angles of Table II (3,) [rad] (Section V-C)."""

DROPS: Final = (0.17, 0.40)
"""Largest reductions of stiffness in y with tension [-], of two configurations (Fig. 12)."""

RISES: Final = (7.93, 12.25)
"""Increments of stiffness in y, (last − first)/first, from softest to stiffest spring (Fig. 13)."""

CHECK: Final = 139.0
"""Calculated stiffness in z [N/m] of the accuracy check (Section V-B)."""

MEASURED: Final = 131.0
"""Measured stiffness in z [N/m] of the accuracy check."""

HYBRID: Final = 1890.0
"""Stiffness of the hybrid cables (strand and spring together) of Fig. 12 [N/m]."""

# Conditions that the paper does not state, fitted with presets.fitted_prototype to its 20 numbers

TENSION_OFFSET: Final = 17.3
"""Actual minus reported tension of the force-controlled cables [N]."""

SECOND_POSTURE: Final = frozen(np.deg2rad([-30.0, -30.0, 7.28]))
"""Joint angles of the second configuration of Figs. 12 and 13 (3,) [rad]; the first is POSTURE."""

HIGHEST_TENSION: Final = 34.4
"""Highest tension in Fig. 12 [N]; the lowest is 3 N, as in Table II."""

HYBRID_TENSION: Final = 3.0
"""Tension in Fig. 13, and in the accuracy check with the hybrid cables of Fig. 12 [N]."""

STIFFEST: Final = 8.04 * HYBRID
"""Stiffness of the stiffest hybrid cables of Fig. 13 [N/m]; Fig. 11 gives no numbers."""

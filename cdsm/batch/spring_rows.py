"""Springs with laws in a batch: their torques and tangents are computed here, not by kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.joint_springs import Springs
from cdsm.support.values import Array


class SpringRows(NamedTuple):
    """What the springs of n joints are in each of N rows."""

    linear: Array  # (n,) 1 for linear springs and joints without one, 0 for those with laws
    torque: Array  # M (N, n) of the laws; 0 elsewhere
    tangent: Array  # k (N, n) of all springs

    @classmethod
    def at(cls, springs: Springs, angles: Array, coefficients: Array) -> SpringRows | None:
        """Compute them at the angles θ (N, n) of all joints; None if no spring has a law.

        ``coefficients``, (n,) or (N, n), are k of linear springs and the factor on each law.
        """
        if not springs.laws:
            return None
        linear = np.ones(len(springs.joints))
        linear[[*springs.laws]] = 0.0
        factor = (1.0 - linear) * coefficients
        tangent = linear * coefficients + factor * springs.law_stiffness(angles)
        return cls(linear, factor * springs.law_torque(angles), tangent)

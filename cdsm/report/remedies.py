"""Changes that would make an unstable arm stable.

Each remedy multiplies one quantity by a factor s at which the smallest eigenvalue λ of K_θ is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cdsm.errors import CdsmError
from cdsm.stiffness_matrix import Remedy, Stiffness, stiffness
from cdsm.tension import distribute_tension

# factors s that are tried, from 1 away, each row up to the first that makes the arm stable
_STIFFER: Final = ((10.0, 100.0, 1000.0),)  # few, since λ rises with s
_MORE_OR_LESS: Final = np.geomspace(1.0, 100.0, 21)[1:], np.geomspace(1.0, 1e-3, 31)[1:]


def find_remedies(K: Stiffness) -> Iterator[Remedy]:
    """Yield the remedies of an unstable arm; none if friction or another l_0 makes it unstable.

    Stiffer wires, stiffer springs and, of distributed tensions, other lower bounds are tried at the
    same posture and wrench.
    """
    pose = K.posture
    distribution = K.distribution
    cables = pose.arm.cables

    def stiffer(wire: float = 1.0, spring: float = 1.0) -> float:
        changed = [
            replace(
                cable,
                elasticity=cable.elasticity.scaled(wire),
                series_stiffness=spring * cable.series_stiffness,
            )
            for cable in cables
        ]
        there = pose.arm.with_cables(changed).at(pose.q, check_limits=False)
        return stiffness(there, K.tension, K.applied).margin

    if stiffness(pose, K.tension, K.applied).margin > 0.0:
        return
    if pose.arm.laws.held:
        yield Remedy("wire", _factor(stiffer, _STIFFER))
    if pose.arm.laws.series[cables.position_controlled].any():
        yield Remedy("spring", _factor(lambda s: stiffer(spring=s), _STIFFER))
    if distribution is not None and distribution.least and distribution.minimum_held.any():
        low = distribution.minimum_held
        high = distribution.maximum_held
        solver = distribution.solver

        def tension(s: float) -> float:
            least = np.where(low < high, s * low, low)
            return stiffness(pose, distribute_tension(pose, least, high, K.applied, solver)).margin

        yield Remedy("tension", _factor(tension, _MORE_OR_LESS))


def _factor(margin: Callable[[float], float], rows: Iterable[Iterable[float]]) -> float | None:
    """Return the factor nearest to 1 at which ``margin``, which is negative at 1, is zero."""
    from scipy.optimize import brentq  # slow to import

    factors: list[float] = []
    for row in rows:
        before = 1.0
        try:
            for s in row:
                if margin(s) > 0.0:
                    factors.append(brentq(margin, before, s, xtol=1e-300, rtol=1e-12))
                    break
                before = s
        except CdsmError:  # beyond what the arm, its laws or its bounds allow
            continue
    return min(factors, key=lambda s: abs(math.log(s)), default=None)

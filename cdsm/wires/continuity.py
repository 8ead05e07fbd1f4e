"""Search for discontinuities of a user-defined law, since K_θ needs a continuous EA(F)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.elasticity import Elasticity, LinearElasticity, SlackBelow
from cdsm.wires.laws import StrandElasticity, TabulatedElasticity

_SAMPLES = np.linspace(0.0, 1.0, 257) ** 3  # shares of the domain, more at low tension
_LARGEST_TENSION = 1e5  # [N], end of an infinite domain: more than any cable carries
_JUMP = 1e-4  # share of EA: a smaller step counts as rounding of the law


class Jump(NamedTuple):
    """Discontinuity of the rigidity EA(F) of a law."""

    tension: float  # at which it is [N]
    below: float  # EA just below this tension [N]
    above: float  # EA just above this tension [N]


def find_jump(law: Elasticity) -> Jump | None:
    """Find the largest discontinuity of the rigidity of a user-defined law; None if there is none.

    EA is sampled at 257 tensions. Each interval is then halved, and the half with the larger change
    of EA is kept, until the change is below 1e-4 of EA or the interval is as narrow as rounding. A
    discontinuity much smaller than the change of EA over an interval may be missed. If the law
    raises an error, the result is None: the first use of the law will report that error.
    """
    if isinstance(law, SlackBelow):
        law = law.law
    if isinstance(law, (LinearElasticity, StrandElasticity, TabulatedElasticity)):
        return None
    try:
        with np.errstate(all="ignore"):
            return _bisect(law)
    except Exception:  # a user-defined law may raise anything
        return None


def _bisect(law: Elasticity) -> Jump | None:
    low, high = law.domain.first, law.domain.high
    if math.isinf(high):
        high = max(_LARGEST_TENSION, 2.0 * low)
    F = low + (high - low) * _SAMPLES
    F[-1] = high  # the sum may miss the end by rounding
    EA = np.asarray(law.rigidity(F), dtype=np.float64)
    a, b, below, above = F[:-1], F[1:], EA[:-1], EA[1:]
    threshold = _JUMP * np.maximum(abs(below), abs(above))
    jumps: list[Jump] = []
    while a.size:
        steep = abs(above - below) > threshold  # false for NaN
        narrow = b - a <= 4.0 * np.spacing(b)
        found = np.stack([b, below, above], axis=1)[steep & narrow]
        jumps += [Jump(*row) for row in found.tolist()]
        a, b, below, above, threshold = (
            x[steep & ~narrow] for x in (a, b, below, above, threshold)
        )
        if not a.size:
            break
        middle = (a + b) / 2.0
        EA = np.asarray(law.rigidity(middle), dtype=np.float64)
        lower = abs(EA - below) >= abs(above - EA)
        a, below = np.where(lower, a, middle), np.where(lower, below, EA)
        b, above = np.where(lower, middle, b), np.where(lower, EA, above)
    return max(jumps, key=lambda jump: abs(jump.above - jump.below), default=None)

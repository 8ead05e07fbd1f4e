"""Remedies for an unstable arm: stiffer wires or springs, or other tensions.

Each multiplies one quantity by a factor s at which the smallest eigenvalue λ of K_θ is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, final

import numpy as np

from cdsm.errors import CdsmError
from cdsm.support.format import rounded
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

_QUANTITIES: Final = {"wire": "EA of wires", "spring": "k_series", "tension": "lower bounds"}
# factors s that are tried, from 1 away, each row up to the first that makes the arm stable
_STIFFER: Final = ((10.0, 100.0, 1000.0),)  # few, since λ rises with s
_MORE_OR_LESS: Final = np.geomspace(1.0, 100.0, 21)[1:], np.geomspace(1.0, 1e-3, 31)[1:]


@final
@dataclass(frozen=True)
class Remedy:
    """Change of one quantity of an unstable arm; made by :attr:`Stiffness.remedies`.

    ``change`` is ``"wire"``: EA of all wires; ``"spring"``: all k_series; ``"tension"``: the lower
    bounds. ``factor`` [-] is the one nearest to 1 at which the arm becomes stable, None if none is.
    """

    change: Literal["wire", "spring", "tension"]
    factor: float | None

    def __str__(self) -> str:
        what, s = _QUANTITIES[self.change], self.factor
        if s is None:
            return f"no other {what} alone would hold it"
        times = f"{rounded(s, up=s > 1.0)} times as high, or {'more' if s > 1.0 else 'less'}"
        return f"it would hold with {what} {times}"


def verdict(K: Stiffness) -> str:
    """Return a sentence about an unstable arm: which joint buckles most, and the margin."""
    arm, worst = K.posture.arm, int(abs(K.critical_direction).argmax())
    margin = f"the smallest eigenvalue of K_θ is {K.margin:.4g} {arm.stiffness_unit()}"
    return f"UNSTABLE: the arm buckles, {arm.joint_names[worst]} most; {margin}"


def find_remedies(K: Stiffness) -> Iterator[Remedy]:
    """Yield the remedies of an unstable arm; none if friction or another l_0 makes it unstable."""
    from cdsm.stiffness_matrix.assembly import stiffness  # here, since it needs this module

    pose, given = K.posture, K.distribution
    cables = pose.arm.cables

    def stiffer(wire: float = 1.0, spring: float = 1.0) -> float:
        stiff = [(each.elasticity.scaled(wire), spring * each.series_stiffness) for each in cables]
        pairs = zip(cables, stiff, strict=True)
        changed = [replace(c, elasticity=law, series_stiffness=k) for c, (law, k) in pairs]
        there = pose.arm.with_cables(changed).at(pose.q, check_limits=False)
        return stiffness(there, K.tension, K.wrench).margin

    if stiffness(pose, K.tension, K.wrench).margin > 0.0:
        return
    if pose.arm._laws.held:
        yield Remedy("wire", _factor(stiffer, _STIFFER))
    if pose.arm._laws.series[cables.position_controlled].any():
        yield Remedy("spring", _factor(lambda s: stiffer(spring=s), _STIFFER))
    if given is not None and given.least and given.minimum.any():
        low, high, solver = given.minimum, given.maximum, given.solver

        def tension(s: float) -> float:
            least = np.where(low < high, s * low, low)
            return stiffness(pose, distribute_tension(pose, least, high, K.wrench, solver)).margin

        yield Remedy("tension", _factor(tension, _MORE_OR_LESS))


def _factor(margin: Callable[[float], float], rows: Iterable[Iterable[float]]) -> float | None:
    """Return the factor nearest to 1 at which ``margin``, which is negative at 1, is zero."""
    from scipy.optimize import brentq  # slow to import

    found: list[float] = []
    for row in rows:
        before = 1.0
        try:
            for s in row:
                if margin(s) > 0.0:
                    found.append(brentq(margin, before, s, xtol=1e-300, rtol=1e-12))
                    break
                before = s
        except CdsmError:  # beyond what the arm, its laws or its bounds allow
            continue
    return min(found, key=lambda s: abs(math.log(s)), default=None)

"""Remedies for an unstable arm: stiffer wires or springs, or other tensions.

An arm is unstable if the smallest eigenvalue λ of the symmetric part of K_θ is not positive. Each
remedy multiplies one quantity by a factor s and changes no other; λ(s) = 0 is solved by bracketing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, final

import numpy as np

from cdsm.errors import CdsmError
from cdsm.support.format import rounded, span
from cdsm.support.values import Array
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

Change = Literal["wire", "spring", "tension"]

_SAID: Final = {
    "wire": ("wires {times} times as stiff{bound}: EA {new} kN, now {old} kN", 1e3),
    "spring": ("series springs of {new} N/mm{bound}, now {old} N/mm", 1e3),
    "tension": ("a least tension of {new} N{bound}, now {old} N", 1.0),
}

_STIFFER: Final = ((10.0, 100.0, 1000.0),)  # few, since λ rises with s
_MORE_OR_LESS: Final = np.geomspace(1.0, 100.0, 21)[1:], np.geomspace(1.0, 1e-3, 31)[1:]
"""Factors s that are tried, from 1 away, each row up to the first that makes the arm stable."""


@final
@dataclass(frozen=True)
class Remedy:
    """Change of one quantity of an unstable arm; made by :attr:`Stiffness.remedies`.

    Attributes:
        change: ``"wire"`` (EA of all wires), ``"spring"`` (all series springs) or ``"tension"``
            (the lower bounds of the tensions).
        factor: Factor [-] nearest to 1 that makes the arm stable if the quantity is multiplied by
            it; None if no factor that was tried does.
        text: The change in words, with the new and the present values.
    """

    change: Change
    factor: float | None
    text: str

    def __str__(self) -> str:
        return self.text


def verdict(K: Stiffness) -> str:
    """Return a sentence about an unstable arm: which joint buckles most, and the margin."""
    arm, motion = K.posture.arm, abs(K.critical_direction)
    return (
        f"UNSTABLE: the arm buckles, {arm.joint_names[int(motion.argmax())]} most; the smallest "
        f"eigenvalue of K_θ is {K.margin:.4g} {arm.stiffness_unit()}"
    )


def advice(K: Stiffness) -> tuple[str, ...]:
    """Return lines of text about an unstable arm: the changes that would make it stable."""
    holding = [f"  {each}" for each in K.remedies if each.factor is not None]
    if holding:
        return "it would hold, by each of these alone, with", *holding
    tried = ", ".join(each.change for each in K.remedies)
    return (f"no other {tried} alone would hold it: change the posture, the load or the arm",)


def find_remedies(K: Stiffness) -> Iterator[Remedy]:
    """Yield the remedies of an unstable arm, one per quantity; see :attr:`Stiffness.remedies`.

    None if only friction, or lengths l_0 of another posture, make the arm unstable.
    """
    from cdsm.stiffness_matrix.assembly import stiffness  # here, since it needs this module

    pose, cables, given = K.posture, K.posture.arm.cables, K.distribution
    held = [c for c, cable in enumerate(cables) if cable.control == "position"]

    def stiffer(wire: float = 1.0, spring: float = 1.0) -> float:
        changed = list(cables)
        for c in held:
            law, k = cables[c].elasticity.scaled(wire), spring * cables[c].series_stiffness
            changed[c] = replace(cables[c], elasticity=law, series_stiffness=k)
        there = pose.arm.with_cables(changed).at(pose.q, check_limits=False)
        return stiffness(there, K.tension, K.wrench).margin

    if stiffness(pose, K.tension, K.wrench).margin > 0.0:
        return
    if held:
        EA = [float(cables[c].elasticity.rigidity(K.tension[c])) for c in held]
        yield _remedy("wire", np.array(EA), stiffer, _STIFFER)
    if springs := [k for c in held if math.isfinite(k := cables[c].series_stiffness)]:
        yield _remedy("spring", np.array(springs), lambda s: stiffer(spring=s), _STIFFER)
    if given is not None and given.least and given.minimum.any():
        low, high = given.minimum, given.maximum

        def tension(s: float) -> float:
            least = np.where(low < high, s * low, low)
            pull = distribute_tension(pose, least, high, K.wrench, given.solver)
            return stiffness(pose, pull).margin

        yield _remedy("tension", low, tension, _MORE_OR_LESS)


def _remedy(
    change: Change, now: Array, margin: Callable[[float], float], rows: Iterable[Iterable[float]]
) -> Remedy:
    """Find the factor nearest to 1 and put it into words; ``now`` are the present values."""
    found = [s for row in rows if (s := _first_zero(margin, row)) is not None]
    if not found:
        return Remedy(change, None, f"no other {change} holds the arm")
    s = min(found, key=lambda s: abs(math.log(s)))
    up, (form, unit) = s > 1.0, _SAID[change]
    new = span(s * now / unit, lambda value: rounded(value, up=up))
    words = {"times": rounded(s, up=up), "bound": " or more" if up else " or less"}
    return Remedy(change, s, form.format(**words, new=new, old=span(now / unit)))


def _first_zero(margin: Callable[[float], float], factors: Iterable[float]) -> float | None:
    """Return a factor s before the first with a positive margin, at which margin(s) is zero."""
    from scipy.optimize import brentq  # slow to import

    before = 1.0
    for s in factors:
        try:
            if margin(s) > 0.0:
                return float(brentq(margin, before, s, xtol=1e-300, rtol=1e-12))
        except CdsmError:  # beyond what the arm, its laws or its bounds allow
            return None
        before = s
    return None

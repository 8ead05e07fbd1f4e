"""Remedies for an unstable arm: stiffer wires or springs, other tensions or disk offsets.

An arm is unstable if the smallest eigenvalue λ of the symmetric part of K_θ is not positive. Each
remedy multiplies one quantity by a factor s and changes no other. After a change of tension bounds
or disk offsets, the tensions are distributed again. λ(s) = 0 is solved by bracketing; dλ/d ln s is
a central difference.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.errors import CdsmError, GeometryError
from cdsm.geometry.cables import serpentine_cables
from cdsm.kernels.read import read_margin
from cdsm.posture import Posture
from cdsm.support.format import rounded, span
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness

Change = Literal["wire", "spring", "tension", "disk offset"]

_STIFFER: Final = tuple(np.geomspace(1.0, 1e3, 31)[1:].tolist())
"""Factors s that are tried on wires and springs, in wide steps, since λ increases with s."""

_MORE: Final = tuple(np.geomspace(1.0, 1e2, 61)[1:].tolist())
_LESS: Final = tuple(np.geomspace(1.0, 1e-3, 91)[1:].tolist())
"""Factors s that are tried on tensions and disk offsets, in steps of 8 %, since λ may also fall."""

_STEP = 1e-5
"""Step of ln s in the central difference of λ; truncation and rounding stay below 1e-9 of λ."""

_SAID: Final = {
    "wire": ("wires {times} times as stiff{bound}: EA {new} kN, now {old} kN", 1e3),
    "spring": ("series springs of {new} N/mm{bound}, now {old} N/mm", 1e3),
    "tension": ("a least tension of {new} N{bound}, now {old} N", 1.0),
    "disk offset": ("disk offsets of {new} mm{bound}, now {old} mm", 1e-3),
}


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Remedy(ReadOnlyState):
    """Change of one quantity of an unstable arm; made by :attr:`Stiffness.remedies`.

    Attributes:
        change: ``"wire"`` (EA of all wires), ``"spring"`` (all series springs), ``"tension"`` (the
            lower bounds of the tensions) or ``"disk offset"``.
        now: Current values of this quantity: EA(F) (n,) [N] of the position-controlled cables,
            k_series (n,) [N/m] of those with a spring, lower bounds (C,) [N], or disk offsets
            (joints,) [m].
        factor: Factor [-] nearest to 1 that makes the arm stable if all these values are multiplied
            by it; None if no factor that was tried does.
        slope: dλ/d ln(factor) at the current values [N m/rad], λ the smallest eigenvalue of K_θ.
            An increase by 1 % changes λ by 0.01 times the slope. None if a small change is not
            admissible.
    """

    change: Change
    now: Array
    factor: float | None
    slope: float | None

    def __str__(self) -> str:
        if self.factor is None:
            return f"no other {self.change} holds the arm"
        form, unit = _SAID[self.change]
        up = self.factor > 1.0
        return form.format(
            times=rounded(self.factor, up=up),
            bound=" or more" if up else " or less",
            new=span(self.now * self.factor / unit, partial(rounded, up=up)),
            old=span(self.now / unit),
        )


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

    There are none if K_θ includes friction, or original lengths of another posture, and the arm
    would be stable without them.
    """
    pose, arm = K.posture, K.posture.arm
    locked = [cable for cable in arm.cables if cable.control == "position"]

    def margin(changed: Posture, tension: Array) -> float:
        """Compute the smallest eigenvalue of K_θ of a changed arm under tensions (C,) [N]."""
        k = changed.arm._laws.stiffness(changed.cable_lengths, tension)
        return read_margin(changed._joint_stiffness(tension, k, K.wrench)[-1])

    def changed(cables: tuple[Cable, ...]) -> Posture:
        return arm.with_cables(cables).at(pose.q, check_limits=False)

    def wire(factor: float) -> float:
        return margin(changed(tuple(_stiffer(each, factor) for each in arm.cables)), K.tension)

    def spring(factor: float) -> float:
        stiffer = (
            replace(each, series_stiffness=factor * each.series_stiffness) for each in arm.cables
        )
        return margin(changed(tuple(stiffer)), K.tension)

    if margin(pose, K.tension) > 0.0:  # K has terms that are not those of this arm
        return
    if locked:
        pairs = zip(arm.cables, K.tension, strict=True)
        rigidity = [float(c.elasticity.rigidity(F)) for c, F in pairs if c.control == "position"]
        yield _remedy("wire", rigidity, wire, _STIFFER)
    if sprung := [k for each in locked if math.isfinite(k := each.series_stiffness)]:
        yield _remedy("spring", sprung, spring, _STIFFER)
    given = K.distribution
    if given is None or not given.least:
        return

    def distributed(there: Posture, low: Array) -> float:
        found = distribute_tension(there, low, given.maximum, K.wrench, given.solver)
        return margin(there, found.values)

    def tension(factor: float) -> float:
        low = given.minimum
        return distributed(pose, np.where(low < given.maximum, factor * low, low))

    def offset(factor: float) -> float:
        return distributed(changed(_with_disks(K, factor)), given.minimum)

    if given.minimum.any():
        yield _remedy("tension", given.minimum, tension, _LESS, _MORE)
    if _is_in_holes(K):
        offsets = [joint.disk_offset for joint in arm.geometry.joints]
        yield _remedy("disk offset", offsets, offset, _LESS, _MORE)


def _remedy(
    change: Change, now: ArrayLike, margin: Callable[[float], float], *factors: tuple[float, ...]
) -> Remedy:
    found = [f for row in factors if (f := _first_zero(margin, row)) is not None]
    slope: float | None
    try:
        slope = (margin(math.exp(_STEP)) - margin(math.exp(-_STEP))) / (2.0 * _STEP)
    except CdsmError:
        slope = None
    nearest = min(found, key=lambda factor: abs(math.log(factor)), default=None)
    return Remedy(change=change, now=frozen(np.array(now)), factor=nearest, slope=slope)


def _first_zero(margin: Callable[[float], float], factors: tuple[float, ...]) -> float | None:
    """Return a factor s at which margin(s), the smallest eigenvalue, is zero; None: none found.

    ``factors`` are tried in order, until the margin is positive or cannot be computed. The zero is
    before the factor with a positive margin.
    """
    from scipy.optimize import brentq  # slow to import

    before = 1.0
    for factor in factors:
        try:
            if margin(factor) > 0.0:
                return float(brentq(margin, before, factor, xtol=1e-300, rtol=1e-12))
        except CdsmError:  # beyond what the arm, its laws or its bounds allow
            return None
        before = factor
    return None


def _is_in_holes(K: Stiffness) -> bool:
    """Return whether all cables run through the holes of the disks as the geometry defines them.

    Only then can a change of the disk offsets be tried.
    """
    arm = K.posture.arm
    if not arm.is_serpentine or len(arm.cables) != len(arm.geometry.cables):
        return False
    return _with_disks(K, 1.0) == arm.cables


def _with_disks(K: Stiffness, factor: float) -> tuple[Cable, ...]:
    """Return the cables of the arm if all disk offsets were multiplied by ``factor``.

    Raises GeometryError if disks would touch at this posture.
    """
    arm = K.posture.arm
    joints = (
        replace(each, disk_offset=factor * each.disk_offset, limit=None)
        for each in arm.geometry.joints
    )
    geometry = replace(arm.geometry, joints=tuple(joints))
    axes = [len(joint.axes) for joint in geometry.joints]
    if factor < 1.0 and (abs(K.posture.q) > np.repeat(geometry.joint_limits, axes)).any():
        raise GeometryError(["disks touch"])
    moved = serpentine_cables(geometry, [cable.elasticity for cable in arm.cables])
    return tuple(
        replace(cable, sites=other.sites) for cable, other in zip(arm.cables, moved, strict=True)
    )


def _stiffer(cable: Cable, factor: float) -> Cable:
    if cable.control == "force":
        return cable
    return replace(cable, elasticity=cable.elasticity.scaled(factor))

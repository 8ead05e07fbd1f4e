"""Bounds of the tensions: what was asked for, and what holds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support import validation
from cdsm.support.validation import bound, flag
from cdsm.support.values import Array, frozen

_WIRE = 1.0 - 1e-9  # of the tension at which a spring leaves no wire


class Bounds(NamedTuple):
    """Bounds of the tensions at a posture, (C,) [N] each.

    Attributes:
        minimum: Lower bounds that were asked for.
        maximum: Upper bounds that were asked for; inf for none.
        minimum_held: Lower bounds that hold.
        maximum_held: Upper bounds that hold; inf for none.
    """

    minimum: Array
    maximum: Array
    minimum_held: Array
    maximum_held: Array


def bounds_at(
    pose: Posture,
    minimum: ArrayLike,
    maximum: ArrayLike,
    worst_friction: bool = False,
    *,
    fixed: Mapping[str, float] | None = None,
    within_laws: bool = False,
) -> Bounds:
    """Check the bounds that were asked for, and compute those that hold at a posture.

    The cables' own bounds narrow them; ``worst_friction`` narrows them by exp(Σ μ φ) of the holes,
    and ``within_laws`` to the domains of the laws of position-controlled cables, and to tensions at
    which their springs leave wire. ``fixed`` tensions
    [N] by cable replace both bounds. Raises InvalidInput if bounds contradict each other; those
    ``within_laws`` may, for then no tensions are within the laws.
    """
    arm = pose.arm
    asked = _asked(arm, minimum, maximum)
    low, high = _narrowed(arm, *asked)
    if flag("worst_friction", worst_friction):
        low, high = _narrowed_by_friction(pose, low, high)
    if within_laws:
        last = np.minimum(arm.laws.high, _WIRE * arm.laws.largest_tensions(pose.cable_lengths))
        low = frozen(np.maximum(low, arm.laws.low))
        high = frozen(np.minimum(high, last))
    if fixed:
        low, high = _fixed(arm, low, high, fixed)
    return Bounds(*asked, low, high)


def checked_bounds(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, rows: int | None = None
) -> tuple[Array, Array]:
    """Check bounds for all postures; return those that hold with the cables' own, (C,) [N] each.

    With ``rows``, a bound may also have the shape (rows, C). Invalid bounds raise InvalidInput.
    """
    return _narrowed(arm, *_asked(arm, minimum, maximum, rows))


def _asked(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, rows: int | None = None
) -> tuple[Array, Array]:
    count = len(arm.cables)
    return bound("minimum", minimum, count, rows), bound("maximum", maximum, count, rows)


def _narrowed(arm: Manipulator, low: Array, high: Array) -> tuple[Array, Array]:
    """Narrow bounds (…, C) [N] to the cables' own; raise InvalidInput if they contradict."""
    lowest, highest = arm.laws.narrowed(low, high)
    allowed = (low >= 0.0) & (low < math.inf) & (lowest <= highest)
    if allowed.all():
        return lowest, highest
    at = tuple(np.argwhere(~allowed)[0].tolist())
    asked, limit, floor, ceiling = (
        float(np.broadcast_to(values, allowed.shape)[at]) for values in (low, high, lowest, highest)
    )
    cable = arm.cables[at[-1]].name + (f" in row {at[0]}" if len(at) > 1 else "")
    if not 0.0 <= asked < math.inf:
        only = "cables only pull, so it must be finite and not negative"
        raise InvalidInput("minimum", f"{asked:g} N given for {cable}; {only}.")
    whose = "the cable's own "
    problem = f"{ceiling:g} N ({whose * (ceiling < limit)}maximum) for {cable} is below {floor:g} N"
    problem += f" ({whose * (floor > asked)}minimum); raise the one or lower the other."
    raise InvalidInput("maximum", problem)


def _narrowed_by_friction(pose: Posture, low: Array, high: Array) -> tuple[Array, Array]:
    """Narrow bounds (C,) [N] at the motors so that all segments keep them."""
    loss = np.exp(friction_exponents(pose))
    low = frozen(low * loss)
    high = frozen(high / loss)
    c = int(np.argmax(low - high))
    if low[c] > high[c]:
        contradiction = f"would need {low[c]:.4g} N or more and {high[c]:.4g} N or less"
        remedy = f"{contradiction} at its motor; raise maximum or lower minimum."
        raise InvalidInput("worst_friction", f"{pose.arm.cables[c].name} {remedy}")
    return low, high


def _fixed(
    arm: Manipulator, low: Array, high: Array, fixed: Mapping[str, float]
) -> tuple[Array, Array]:
    """Replace the bounds (C,) [N] of cables with fixed tensions by these."""
    low = low.copy()
    high = high.copy()
    for name, value in fixed.items():
        c = arm.cables.number_of(name)
        low[c] = validation.checked_quantity(f"fixed[{name!r}]", value, "tension", zero=True)
        high[c] = low[c]
    return frozen(low), frozen(high)


def friction_exponents(pose: Posture) -> Array:
    """Compute Σ μ φ (C,) [-] over the holes of each cable, with the friction μ and wrap angle φ."""
    chains = pose.segments.chains
    friction = pose.segments.grip
    total = np.bincount(chains.cable[chains.hole], friction, len(pose.arm.cables))
    return np.asarray(total, dtype=np.float64)

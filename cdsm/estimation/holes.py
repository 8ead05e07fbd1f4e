"""What is known of the friction in each hole before the balance is used.

Behind hole i the tension is e^{s_i} times that before it, |s_i| ≤ μ β_i with the friction μ and the
wrap angle β. Unknown directions have s_i = μ β_i (a_c + b_i): the holes of a cable mostly slide the
same way, so that they share a_c ~ N(0, 1), and each has a small part b_i of its own. Where the
direction is known, s_i = ∓μ β_i within a tenth, which holes of one cable share: it is that of μ.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.friction.capstan import can_stick
from cdsm.posture import Posture
from cdsm.support.format import plural
from cdsm.support.validation import number_array, one_of
from cdsm.support.values import Array

_OWN = 1.0 / 30.0  # variance of b: of what holes of one cable do not share
_KNOWN = 0.1  # standard deviation of s over μ β where the direction is known

SlidingLike = ArrayLike | Mapping[str, ArrayLike]
"""How cables last slid: 1 taken in, −1 let out, 0 unknown; one number, (C,), or by cable names."""


class Holes(NamedTuple):
    """Exponents s of all holes (P,)."""

    mean: Array  # expected s
    bound: Array  # most by which s can be off it, where the direction is unknown; else 0
    covariance: Array  # of s (P, P), for the weights of the balance
    known: Array  # its part where the direction is known (P, P)


def holes_of(
    pose: Posture, sliding: Array, taut: NDArray[np.bool_], followed: Array | None = None
) -> Holes:
    """Describe the holes of cables that are ``taut`` (C,).

    ``sliding`` (P,) is 1 where the cable was taken in, −1 let out, 0 unknown; there s is expected
    to be that of a ``followed`` history (P,), whose errors are those of single holes; or else 0.
    """
    segments = pose.segments
    cable = segments.chains.cable[segments.chains.hole]
    grip = np.where(can_stick(pose) & taut[cable], segments.grip, 0.0)
    is_known = sliding != 0.0
    expected = 0.0 * grip if followed is None else np.clip(followed, -grip, grip)
    mean = np.where(is_known, -sliding * grip, expected)
    bound = np.where(is_known, 0.0, grip + abs(mean))
    spread = np.where(is_known, _KNOWN * grip, 0.0)
    same = cable[:, None] == cable
    known = same * np.outer(spread, spread)
    if followed is None:
        unknown = same * np.outer(bound, bound) + np.diag(_OWN * bound**2)
    else:
        unknown = np.diag(np.where(is_known, 0.0, grip) ** 2 / 3.0)
    covariance = known + unknown
    return Holes(mean, bound, covariance, known)


def sliding_of(pose: Posture, sliding: SlidingLike | None) -> Array:
    """Return how the cables slid at each hole (P,): 1, −1 or 0; InvalidInput for others.

    A dict has a number for a cable, or one for each of its holes, from the motor on.
    """
    chains = pose.segments.chains
    cables = pose.arm.cables.names
    of_hole = chains.cable[chains.hole]
    if sliding is None:
        return np.zeros(of_hole.size)
    if not isinstance(sliding, Mapping):
        values = _directions("sliding", sliding)
        if values.shape not in ((), (len(cables),)):
            raise InvalidInput(
                "sliding",
                f"shape {values.shape} given; give one number, one for each of the "
                f"{len(cables)} cables, or a dict by the names of cables.",
            )
        return np.broadcast_to(values, (len(cables),))[of_hole]
    found = np.zeros(of_hole.size)
    for name, value in sliding.items():
        mine = of_hole == cables.index(one_of("cable", name, cables))
        values = _directions(f"sliding[{name!r}]", value)
        if values.shape not in ((), (mine.sum(),)):
            raise InvalidInput(
                f"sliding[{name!r}]",
                f"shape {values.shape} given; give one number, or one for each of its "
                f"{plural(int(mine.sum()), 'hole')}, from the motor on.",
            )
        found[mine] = values
    return found


def _directions(name: str, value: Any) -> Array:
    directions = number_array(name, value)
    if (wrong := directions[~np.isin(directions, (-1.0, 0.0, 1.0))]).size:
        raise InvalidInput(
            name,
            f"{wrong.flat[0]:g} given; give 1 where the cable was last taken in, -1 where it was "
            "let out, 0 where that is unknown.",
        )
    return directions

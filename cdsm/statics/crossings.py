"""Quantities that change their sign at an event, and the roots of them within a step.

Each event has such a quantity: the tension of a cable that goes slack, the way of a joint to its
stop. A step whose ends differ in sign is searched by Brent's method, with the equilibrium solved
anew at each trial.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from cdsm.statics.events import Kind
from cdsm.statics.pieces import PRECISION, root
from cdsm.support.values import Array

ROUNDING = 1e-9  # a quantity below this part of its scale is zero


class HasShare(Protocol):
    """An equilibrium under a share of a load."""

    @property
    def share(self) -> float:
        """The share [-]."""


S = TypeVar("S", bound=HasShare)


class Watched(NamedTuple, Generic[S]):
    """Quantities (m,) that become negative at an event, what they are, and their scales."""

    kinds: tuple[Kind, ...]
    places: tuple[str, ...]
    value: Callable[[S], Array]
    scale: Callable[[S], Array]


def crossings(
    at: Callable[[float], S],
    here: S,
    there: S,
    watch: Watched[S],
    precision: float = PRECISION,
) -> list[tuple[int, float]]:
    """Return which quantities become negative between two equilibria, and the shares.

    ``precision`` is that of a share, relative to the step.
    """
    low = here.share
    high = there.share
    before = watch.value(here)
    after = watch.value(there)
    none = ROUNDING * watch.scale(here)
    found = list[tuple[int, float]]()
    known = {low: before, high: after}

    def value(share: float, i: int) -> float:
        if share not in known:
            known[share] = watch.value(at(share))
        return float(known[share][i])

    for i in np.flatnonzero((before >= -none) & (after < -none)).tolist():
        share = low
        if before[i] > none[i]:
            share = root(partial(value, i=i), low, high, precision * (high - low))
        found.append((i, share))
    return found

"""Quantities that change their sign at an event, and the roots of them within a step.

Each event has such a quantity: the tension of a cable that goes slack, the way of a joint to its
stop. A step whose ends differ in sign is searched by Brent's method, with the equilibrium solved
anew at each trial.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from functools import partial
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.routing import Indices
from cdsm.statics.contact_events import contact_kinds
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


def label_watched(
    arm: Manipulator, of_cables: Iterable[tuple[Kind, Indices]]
) -> tuple[list[Kind], list[str], Indices]:
    """Return kinds and places of what any arm is watched for, and which of its stops exist.

    They are those ``of_cables``, the indices of which are given, of stops, and of contacts.
    """
    pairs = [(kind, arm.cables.names[c]) for kind, indices in of_cables for c in indices]
    stops = np.flatnonzero(np.isfinite([arm.lower, arm.upper]))  # of joints with limits
    pairs += [("stop", arm.joint_names[i % arm.nv]) for i in stops]
    kinds = [kind for kind, _ in pairs]
    places = [place for _, place in pairs]
    of_contacts, contacts = contact_kinds(arm)
    return kinds + of_contacts, places + contacts, stops


class Between(Generic[S]):
    """Equilibria between two ends of a step, each found from those next to it.

    So a search from one side of a jump stays on it, however near the jump is. ``solve`` finds an
    equilibrium under a share, given the next ones below and above it; None if there is none.
    """

    def __init__(self, solve: Callable[[float, S, S], S | None], here: S, there: S) -> None:
        self._solve = solve
        self._found = [here, there]

    def find(self, share: float) -> S | None:
        """Return the equilibrium under a share of the step; None if there is none nearby."""
        k = bisect_left(self._found, share, key=lambda stage: stage.share)
        if k < len(self._found) and self._found[k].share == share:
            return self._found[k]
        stage = self._solve(share, self._found[k - 1], self._found[k])
        if stage is not None:
            self._found.insert(k, stage)
        return stage

    def at(self, share: float) -> S:
        """Return the equilibrium under a share; where there is none, the next known one above."""
        stage = self.find(share)
        if stage is None:
            stage = next(known for known in self._found if known.share > share)
        return stage

    def before(self, share: float, value: Callable[[S], float]) -> S:
        """Return the last equilibrium known up to a share at which ``value`` is not negative."""
        known = [stage for stage in self._found if stage.share <= share]
        return next((stage for stage in reversed(known) if value(stage) >= 0.0), known[0])


def crossings(
    between: Between[S],
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
            known[share] = watch.value(between.at(share))
        return float(known[share][i])

    for i in np.flatnonzero((before >= -none) & (after < -none)).tolist():
        share = low
        if before[i] > none[i]:
            share = root(partial(value, i=i), low, high, precision * (high - low))
        found.append((i, share))
    return found

"""Events of an arm with friction that is loaded slowly: roots on the way to each load.

The loading is followed anew, from event to event: at each, the history up to there is kept, so it
does not matter how long the steps are. From there on the equilibrium is a function of the share of
the step. :mod:`cdsm.statics.slow_watch` has the quantities that change their sign at events.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cdsm.statics.events import Event, PathPart
from cdsm.statics.quasi_static import (
    Action,
    EquilibriumPath,
    QuasiStaticArm,
    QuasiStaticState,
)
from cdsm.statics.slow_walk import Walk
from cdsm.statics.slow_watch import watched_slowly
from cdsm.support.progress import show_progress
from cdsm.support.values import Array, frozen


class Way(NamedTuple):
    """A slow loading, from which its events are located when they are asked for."""

    arm: QuasiStaticArm
    start: QuasiStaticState
    loads: tuple[Action, ...]  # at the end of each step
    substeps: tuple[int, ...]
    paths: tuple[EquilibriumPath, ...]  # the equilibria on the way to each load
    parts: tuple[PathPart | None, ...]  # of forward statics, each step
    begin: float = 0.0  # share of the first step that the start has behind it


def slow_events(way: Way, holes: Sequence[str]) -> tuple[tuple[Event, ...], Array]:
    """Locate the events on a way; return them with the joint coordinates at each (m, nv) [rad].

    ``holes`` (P,) are the names of the holes.
    """
    walk = Walk(way.arm, way.start, watched_slowly(way.arm, holes))
    ways = zip(way.loads, way.substeps, way.paths, way.parts, strict=True)
    for k, (load, substeps, near, part) in enumerate(show_progress([*ways], "events")):
        if part == "pull":
            walk.along_path(k, load, near)
        else:
            walk.to_load(k, load, substeps, near, once=part == "load")
    size = way.arm.reference.q.size
    events = tuple(_told(event, way) for event in walk.events)
    return events, frozen(np.array(walk.angles).reshape(-1, size))


def _told(event: Event, way: Way) -> Event:
    """Return an event with the part of the way on which it lies, as a share of all of it."""
    assert event.step is not None
    begin = 0.0 if event.step else way.begin
    share = begin + (1.0 - begin) * event.share
    return replace(event, share=share, part=way.parts[event.step])

"""Cables over pulleys as arrays for the kernels: what rows share, and what is computed of each."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.manipulator import Manipulator
from cdsm.routing import Indices
from cdsm.support.values import Array, frozen


class PathArrays(NamedTuple):
    """Cables while they touch T of the pulleys: E entries of paths, R runs between two sites."""

    frame: Indices  # of each entry (E,)
    point: Array  # its place in this frame (E, 3) [m]
    centre: Indices  # entry of each pulley (T,)
    axis: Array  # in its frame (T, 3)
    radius: Array  # r (T,) [m]
    groove: NDArray[np.bool_]  # whether it has a groove (T,)
    turns: Indices  # whole turns beyond Φ in (−90°, 270°] (T,)
    cable: Indices  # of each pulley (T,)
    start: Indices  # entries at which runs of pulleys begin (R,)
    end: Indices  # and end (R,)
    low: Indices  # where the pulleys of each run begin, and the last ones end (R+1,)
    site: Array  # sites of the routing in their frames (P, 3) [m]; contacts: anywhere
    node: Indices  # sites of the routing that are arrivals, then those of departures (2T,)
    fixed: Array  # length of cables without arcs that no joint changes (C,) [m]
    pieces: Indices  # segments at grooves, pulley from which they come, and to which they go; or −1
    helices: Indices  # smooth pulleys between sites, segments before and behind; on a rim −1 (H, 3)
    coupled: bool  # whether smooth pulleys have neighbours, which the kernels do not know


class ContactArrays(NamedTuple):
    """What the kernel ``fill_contacts`` computes of B blocks of W postures."""

    entry: Array  # (B, E, 3, W) [m]
    axis: Array  # (B, T, 3, W)
    contact: Array  # arrivals, then departures (B, 2T, 3, W) [m]
    turn: Array  # sine and cosine of Φ, times a positive number (B, T, 2, W)
    angle: Array  # Φ (B, T, W) [rad]
    slope: Array  # tan γ of the helix (B, T, W)
    arc: Array  # wrapped length (B, T, W) [m]
    fault: Array  # outcome of each pulley, as in cdsm.pulleys.contacts (B, T, W)
    unsettled: Array  # 1 where contacts of a run do not converge (B, W)
    site: Array  # sites of the routing in their frames (B, P, 3, W) [m]
    fixed: Array  # length of cables that no joint changes (B, C, W) [m]


def shapes_of_contacts(paths: PathArrays) -> tuple[tuple[int, ...], ...]:
    """Return the shapes of :class:`ContactArrays` for one posture."""
    T = len(paths.centre)
    of_pulley = ((T, 2), (T,), (T,), (T,), (T,))
    sites = (len(paths.site), 3)
    return (len(paths.frame), 3), (T, 3), (2 * T, 3), *of_pulley, (), sites, paths.fixed.shape


@lru_cache(maxsize=64)
def paths_of(arm: Manipulator, touches: tuple[bool, ...]) -> PathArrays:
    """Return the arrays of cables over these of the pulleys, made once."""
    wraps = arm.wraps
    assert wraps is not None
    pattern = wraps.pattern(touches)
    routing = pattern.routing
    chosen = pattern.pulley
    T = len(chosen)
    runs = []
    low = [0]
    for run in wraps.rows:
        count = sum(touches[run.low : run.high])
        if count:
            runs.append(run)
            low.append(low[-1] + count)
    ends = pattern.ends
    pieces = []
    for g, s in enumerate(ends.segment.tolist()):
        side = [-1, -1]
        for contact in np.flatnonzero(ends.free & (ends.piece == g)).tolist():
            if wraps.groove[chosen[contact % T]]:
                side[int(contact < T)] = contact % T
        if max(side) >= 0 and routing.sign[s].any():
            pieces.append((s, *side))
    segment = np.where(ends.free, ends.segment[ends.piece] if ends.segment.size else 0, -1)
    smooth = np.flatnonzero(~wraps.groove[chosen])
    alone = [t for t, end in pairwise(low) if end - t == 1]
    helices = [(t, segment[t], segment[T + t]) for t in smooth.tolist() if t in alone]
    return PathArrays(
        frame=wraps.row,
        point=wraps.point,
        centre=frozen(wraps.entry[chosen]),
        axis=frozen(wraps.local_axis[chosen]),
        radius=frozen(wraps.radius[chosen]),
        groove=frozen(wraps.groove[chosen]),
        turns=_indices(wraps.pulleys[i].turns for i in chosen.tolist()),
        cable=frozen(pattern.cable.copy()),
        start=_indices(run.start for run in runs),
        end=_indices(run.end for run in runs),
        low=_indices(low),
        site=routing.point,
        node=frozen(pattern.contact.copy()),
        fixed=routing.fixed,
        pieces=frozen(np.array(pieces, np.intp).reshape(-1, 3)),
        helices=frozen(np.array(helices, np.intp).reshape(-1, 3)),
        coupled=len(helices) < len(smooth),
    )


def _indices(values: Iterable[int]) -> Indices:
    return frozen(np.array(list(values), np.intp))

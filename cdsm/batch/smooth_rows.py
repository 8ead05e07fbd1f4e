"""Shifts at many postures by numpy, where smooth pulleys follow others: their shifts are coupled.

The kernel ``add_shifts`` has those of grooves, and of smooth pulleys between two sites.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.pulleys.contact_shifts import Shifts
from cdsm.pulleys.wraps import Pattern
from cdsm.routing import Routing, Spans
from cdsm.support.values import Array


class Directions(NamedTuple):
    """Segments and joints in N rows."""

    segment: Array  # direction, and 1/length of each segment (N, S, 4)
    motion: Array  # d of each joint of each segment (N, S, m, 3)
    axis: Array  # z of all joints (N, joints, 3)


class PulleyPlaces(NamedTuple):
    """Pulleys and contacts in N rows, as in :class:`~cdsm.batch.path_arrays.ContactArrays`."""

    entry: Array  # (N, E, 3) [m]
    axis: Array  # (N, T, 3)
    contact: Array  # (N, 2T, 3) [m]
    angle: Array  # (N, T) [rad]
    slope: Array  # (N, T)
    arc: Array  # (N, T) [m]


@lru_cache(maxsize=64)
def _pattern(arm: Manipulator, touches: tuple[bool, ...]) -> tuple[Pattern, Routing]:
    """Return a pattern, and its routing with derivatives by all joints."""
    assert arm.wraps is not None
    pattern = arm.wraps.pattern(touches)
    return pattern, replace(pattern.routing, coupling=None)


def smooth_shifts(
    arm: Manipulator,
    touches: tuple[bool, ...],
    at: Directions,
    places: PulleyPlaces,
    tension: Array,
) -> Array:
    """Compute what all shifts add to H_L·F (N, n, n), by all joints, under F (N, C)."""
    wraps = arm.wraps
    assert wraps is not None
    pattern, routing = _pattern(arm, touches)
    N = len(tension)
    segment = pattern.ends.segment
    pulley = pattern.pulley
    sign = routing.sign[segment]
    joint = np.where(sign == 0.0, 0, routing.path[segment])

    def one_behind_another(x: Array) -> Array:
        """Make (3, N·n, …) of vectors (N, n, …, 3)."""
        flat = x.reshape(-1, *x.shape[2:])
        return np.ascontiguousarray(np.moveaxis(flat, -1, 0))

    piece = at.segment[:, segment]
    spans = Spans(
        length=1.0 / piece[:, :, 3].ravel(),
        direction=one_behind_another(piece[:, :, :3]),
        axis=one_behind_another(sign[:, :, None] * at.axis[:, joint]),
        motion=one_behind_another(at.motion[:, segment]),
        rate=np.zeros(0),
    )
    T = len(pulley)
    centre = places.entry[:, wraps.entry[pulley]]
    radial = places.contact - np.concatenate([centre, centre], axis=1)
    shifts = Shifts(
        routing=routing,
        spans=spans,
        ends=pattern.ends.repeated(N),
        radial=radial.reshape(N, 2, T, 3).transpose(3, 1, 0, 2).reshape(3, -1),
        axis=one_behind_another(places.axis),
        radius=np.tile(wraps.radius[pulley], N),
        groove=np.tile(wraps.groove[pulley], N),
        arc=places.arc.ravel(),
        angle=places.angle.ravel(),
        slope=places.slope.ravel(),
        postures=N,
    )
    added = shifts.hessian_of_each(tension[:, routing.cable[segment]])
    return np.broadcast_to(added, (N, routing.joint_count, routing.joint_count))

"""Events of an arm without friction on a branch of equilibria, found as roots.

What an arm is watched for changes its sign there (:mod:`cdsm.statics.crossings`). A quantity that
only dips below zero within a step is noticed by the cubic through its ends and their slopes. Where
the branch ends, the arm loses its stability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied, combined, scaled
from cdsm.manipulator import Manipulator
from cdsm.routing import Indices
from cdsm.statics.contact_events import contact_kind, contact_values
from cdsm.statics.continuation import follow
from cdsm.statics.crossings import Between, Watched, crossings, label_watched
from cdsm.statics.events import Event, Kind, buckling_joint
from cdsm.statics.hung_loads import total_force
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.pieces import Model, Stage, dip, equilibrium_near, slope, stage_at
from cdsm.support.values import Array

_ALONG = 1e-9  # 1 − cosine of the largest angle between a weight and gravity
_DEPTH = 4  # most halvings of a step in which a quantity may dip below zero


def watched(arm: LockedArm, maximum: Array | None = None) -> Watched[Stage]:
    """Return what an arm without friction is watched for, while its load grows.

    ``maximum`` (C,) [N] are the largest tensions; None: the cables' own.
    """
    cables = arm.reference.arm.cables
    most = np.array([cable.maximum for cable in cables]) if maximum is None else maximum
    laws = [cable.elasticity for cable in cables]
    held = cables.position_controlled & (not arm.tension_held)
    limited = np.flatnonzero(np.isfinite(most))
    low = np.array([law.low for law in laws])
    high = np.array([law.high for law in laws])
    begun = np.flatnonzero(held & (low > 0.0))
    ended = np.flatnonzero(held & np.isfinite(high))
    of_cables: tuple[tuple[Kind, Indices], ...] = (
        ("maximum", limited),
        ("law", begun),
        ("law", ended),
    )
    kinds, places, stops = label_watched(arm.reference.arm, of_cables)
    tensions = sum(indices.size for _, indices in of_cables)
    angles = len(kinds) - tensions

    def value(stage: Stage) -> Array:
        locked = stage.arm
        F = locked.continued_tensions(stage.pose)
        gaps = stage.balance.gaps(stage.point.x).ravel()[stops]
        within = (most - F)[limited], (F - low)[begun], (high - F)[ended]
        return np.concatenate([*within, gaps, contact_values(stage.pose)])

    def scale(stage: Stage) -> Array:
        size = max(float(abs(stage.point.state.tension).max(initial=0.0)), 1e-300)
        return np.append(np.full(tensions, size), np.ones(angles))

    return Watched(tuple(kinds), tuple(places), value, scale)


def mass_of(arm: Manipulator, u: Array, force: float) -> float | None:
    """Return the mass [kg] whose weight is ``force`` [N] along u; None if u is not gravity's."""
    g = float(np.linalg.norm(arm.gravity))
    if g == 0.0 or u @ arm.gravity < (1.0 - _ALONG) * g:
        return None
    return force / g


def events_on(
    model: Model, branch: Sequence[Stage], watch: Watched[Stage], force: float, goal: float
) -> tuple[Event, ...]:
    """Locate the events on a branch of equilibria, in the order of their loads.

    If the branch ends before the share ``goal``, the last event is the loss of stability. ``force``
    [N] is the growing force at the share 1.
    """
    events = list[Event]()
    names = branch[0].pose.arm.cables.names
    if branch[0].taut is not None:
        taut = branch[0].arm.continued_tensions(branch[0].pose) >= 0.0
        events += _gone_slack(names, taut, branch[0], force)
    for here, there in pairwise(branch):
        if there.snapped:
            events.append(_loss(here, force))
        else:
            events += _within(model, here, there, watch, force)
        if here.taut is not None:
            events += _gone_slack(names, here.taut, there, force)
    last = branch[-1]
    if last.share < goal:
        events.append(_loss(last, force))
    order = sorted(events, key=lambda event: (event.share, event.kind == "buckling"))
    return tuple(replace(event, load=abs(event.load)) for event in order)


def _gone_slack(
    names: Sequence[str], before: NDArray[np.bool_], stage: Stage, force: float
) -> list[Event]:
    """Return the events of the cables that are no longer taut from a stage on."""
    assert stage.taut is not None
    gone = np.flatnonzero(before & ~stage.taut).tolist()
    return [Event("slack", names[c], stage.share, stage.share * force) for c in gone]


def _loss(stage: Stage, force: float) -> Event:
    """Return the loss of stability at the end of a branch."""
    taut = stage.taut
    assert taut is not None
    K = stage.arm.keeping(taut).at_pose(stage.pose).stiffness
    joint = buckling_joint(K, stage.point.out, stage.pose.arm.joint_names)
    return Event("buckling", joint, stage.share, stage.share * force)


def events_under(arm: LockedArm, load: Applied, maximum: Array) -> tuple[Event, ...]:
    """Locate the events while a load grows on a locked arm that its reference balances.

    ``maximum`` (C,) [N] are the largest tensions.
    """

    def model(share: float) -> LockedArm:
        return arm.under(combined(arm.wrench, scaled(load, share)))

    start = stage_at(model, arm.reference, np.zeros(arm.reference.q.size), 0.0)
    branch = follow(model, start, 1.0)
    force = float(np.linalg.norm(total_force(load)))
    return events_on(model, branch, watched(arm, maximum), force, 1.0)


def _within(
    model: Model,
    here: Stage,
    there: Stage,
    watch: Watched[Stage],
    force: float,
    depth: int = _DEPTH,
) -> list[Event]:
    """Return the events between two equilibria of a branch."""

    def solve(share: float, below: Stage, above: Stage) -> Stage | None:
        return equilibrium_near(model, share, below) or equilibrium_near(model, share, above)

    share = _dip(model, here, there, watch) if depth else None
    if share is not None:
        middle = equilibrium_near(model, share, here)
        if middle is not None:
            return [
                *_within(model, here, middle, watch, force, depth - 1),
                *_within(model, middle, there, watch, force, depth - 1),
            ]
    between = Between(solve, here, there)
    events = list[Event]()
    for i, share in crossings(between, here, there, watch):
        before = between.before(share, lambda stage, i=i: float(watch.value(stage)[i]))  # type: ignore[misc]
        kind = contact_kind(watch.kinds, i, before.pose)
        events.append(Event(kind, watch.places[i], share, share * force))
    return events


def _dip(model: Model, here: Stage, there: Stage, watch: Watched[Stage]) -> float | None:
    """Return a share between two equilibria at which a quantity may be negative, or None."""
    step = there.share - here.share
    if not ((watch.value(here) > 0.0) & (watch.value(there) > 0.0)).any():
        return None
    first, last = [
        (watch.value(end), step * slope(model, end, watch.value)) for end in (here, there)
    ]
    part = dip(first, last)
    return None if part is None else here.share + part * step

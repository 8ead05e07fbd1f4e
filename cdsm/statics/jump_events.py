"""Events within one sub-step of slow loading, also where the arm jumps in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdsm.statics.contact_events import contact_angles, contact_kind
from cdsm.statics.crossings import Between, Watched, crossings
from cdsm.statics.events import LIMIT_POINT, Event, Kind, buckling_joint
from cdsm.statics.hung_loads import total_force
from cdsm.statics.quasi_static import Action, QuasiStaticArm, QuasiStaticState, Substep
from cdsm.statics.sliding import reached_without_snap
from cdsm.statics.slow_snaps import path_end
from cdsm.statics.slow_watch import SlowStage, known_point
from cdsm.statics.solve import Balance
from cdsm.support.values import Array

_HALVINGS = 48  # of a sub-step in which the arm loses its stability
ROOT_PRECISION = 1e-12  # of a root, relative to its sub-step: equilibria are no better
_SINCE: tuple[Kind, ...] = ("slack", "maximum", "law", "stop")  # what a jump may bring about


def events_within(
    arm: QuasiStaticArm, part: Substep, watch: Watched[SlowStage]
) -> list[tuple[Kind, str, SlowStage, str]]:
    """Return the events of a sub-step in their order; of a snap, with its cause."""

    def balance(share: float) -> Balance:
        return arm.balance(part.before, part.before.load.interpolate(part.after.load, share))

    def solve(share: float, below: SlowStage, above: SlowStage) -> SlowStage | None:
        f = balance(share)
        guesses = [*guesses_between(share, below, above), part.before.x]
        point = reached_without_snap(f, guesses, part.before.arm_state.pose.q)
        return None if point is None else SlowStage(share, point, f)

    f = arm.balance(part.before, part.before.load)
    here = SlowStage(0.0, known_point(f, part.before.arm_state, part.before.x), f)
    f = arm.balance(part.before, part.after.load)
    there = SlowStage(1.0, known_point(f, part.after.arm_state, part.after.x), f)
    last = there
    if part.snapped:
        last = here
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            stage = solve(middle, last, there)
            low, high, last = (low, middle, last) if stage is None else (middle, high, stage)
    end = path_end(balance, last, watch) if part.snapped else None
    between = Between(solve, here, last)
    roots = sorted(crossings(between, here, last, watch, ROOT_PRECISION), key=lambda root: root[1])
    events = [
        (kind_at(watch, i, between, share), watch.places[i], between.at(share), "")
        for i, share in roots
    ]
    if end is not None:
        last = end.stage
        K = last.point.state.stiffness
        joint = buckling_joint(K, last.point.out, arm.reference.arm.joint_names)
        events.append(("buckling", joint, last, end.cause))
        new = (watch.value(last) >= 0.0) & (watch.value(there) < 0.0)
        events += [
            (watch.kinds[i], watch.places[i], there._replace(share=last.share), "")
            for i in np.flatnonzero(new).tolist()
            if watch.kinds[i] in _SINCE
        ]
    return events


def jump(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    action: Callable[[float], Action],
    way: tuple[float, float],
    step: int,
    watch: Watched[SlowStage],
    latest: tuple[float, str],
) -> tuple[QuasiStaticState, list[Event], list[Array]]:
    """Go on where no equilibrium is near, in ever smaller steps, or by a jump.

    ``way`` are the shares of the step at the begin and the end; ``latest`` share and words of the
    last event. Returns the state at the end, the events, and the joint coordinates at each.
    """
    begin, goal = way
    parts = list[Substep]()
    events = list[Event]()
    angles = list[Array]()
    arm.step_to(before, action(goal), 1, f"the step to load {step}", seen=parts.append)
    for part in parts:
        for kind, place, stage, reason in events_within(arm, part, watch):
            share = part.begin + stage.share * (part.end - part.begin)
            share = begin + share * (goal - begin)
            cause = reason
            at_once = abs(share - latest[0]) <= ROOT_PRECISION
            if kind == "buckling" and cause != LIMIT_POINT and at_once:
                cause = latest[1]
            force = float(np.linalg.norm(total_force(action(share).wrench)))
            events.append(Event(kind, place, share, force, step, cause=cause))
            angles.append(stage.point.state.pose.q)
    return parts[-1].after, events, angles


def guesses_between(share: float, below: SlowStage, above: SlowStage) -> list[Array]:
    """Return where the search for an equilibrium begins, between two that are known.

    A step of a cable's length at a pulley lies between them: begin on the near side of it.
    """
    part = (share - below.share) / (above.share - below.share)
    straight = below.point.x + part * (above.point.x - below.point.x)
    before, after = (contact_angles(stage.point.state.pose) > 0.0 for stage in (below, above))
    guesses = [straight, below.point.x]
    return guesses if np.array_equal(before, after) else guesses[::-1]


def kind_at(watch: Watched[SlowStage], i: int, between: Between[SlowStage], share: float) -> Kind:
    """Return the kind of event i, at a share."""
    before = between.before(share, lambda stage: float(watch.value(stage)[i]))
    return contact_kind(watch.kinds, i, before.point.state.pose)

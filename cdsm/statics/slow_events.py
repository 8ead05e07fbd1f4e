"""Events of an arm with friction that is loaded slowly: roots on the way to each load.

The loading is followed anew, from event to event: at each, the history up to there is kept, so it
does not matter how long the steps are. From there on the equilibrium is a function of the share of
the step. :mod:`cdsm.statics.slow_watch` has the quantities that change their sign at events.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from cdsm.statics.contact_events import contact_angles, contact_kind
from cdsm.statics.crossings import ROUNDING, Between, Watched, crossings
from cdsm.statics.events import Event, Kind, buckling_joint
from cdsm.statics.hung_loads import total_force
from cdsm.statics.pieces import root
from cdsm.statics.quasi_static import (
    Action,
    ChainArmState,
    EquilibriumPath,
    QuasiStaticArm,
    QuasiStaticState,
    Substep,
)
from cdsm.statics.sliding import continued_sliding
from cdsm.statics.slow_watch import SlowStage, known_point, watched_slowly
from cdsm.support.progress import show_progress
from cdsm.support.values import Array, frozen

_ZERO = 0.1  # part of this rounding that ends the search for a root
_NEXT = 4.0  # the way to look for the next event, over that to the last one
_LEAST = 2.0**-6  # least way between events that are located one by one, over a sub-step
_HALVINGS = 48  # of a sub-step in which the arm loses its stability
_PRECISION = 1e-12  # of a root, relative to its sub-step: equilibria are no better
_SINCE: tuple[Kind, ...] = ("slack", "maximum", "law", "stop")  # what a jump may bring about


class Way(NamedTuple):
    """A slow loading, from which its events are located when they are asked for."""

    arm: QuasiStaticArm
    start: QuasiStaticState
    loads: tuple[Action, ...]  # at the end of each step
    substeps: tuple[int, ...]
    paths: tuple[EquilibriumPath, ...]  # the equilibria on the way to each load


def slow_events(way: Way, holes: Sequence[str]) -> tuple[tuple[Event, ...], Array]:
    """Locate the events on a way; return them with the joint coordinates at each (m, nv) [rad].

    ``holes`` (P,) are the names of the holes.
    """
    walk = _Walk(way.arm, way.start, watched_slowly(way.arm, holes))
    ways = zip(way.loads, way.substeps, way.paths, strict=True)
    for k, (load, substeps, near) in enumerate(show_progress([*ways], "events")):
        walk.to_load(k, load, substeps, near)
    size = way.arm.reference.q.size
    return tuple(walk.events), frozen(np.array(walk.angles).reshape(-1, size))


class _Walk:
    """Slow loading from event to event."""

    def __init__(
        self, arm: QuasiStaticArm, start: QuasiStaticState, watch: Watched[SlowStage]
    ) -> None:
        self._arm = arm
        self._watch = watch
        self._state = start
        self.events = list[Event]()
        self.angles = list[Array]()
        f = arm.balance(start, start.load)
        self._here = SlowStage(0.0, known_point(f, start.arm_state, start.x), f)
        self._values = watch.value(self._here)
        self._none = ROUNDING * watch.scale(self._here)
        self._passed = self._values < -self._none  # which quantities are negative
        self._slips = np.array([kind == "slip" for kind in watch.kinds], dtype=np.bool_)

    def to_load(self, step: int, load: Action, substeps: int, near: EquilibriumPath) -> None:
        """Go to a load in sub-steps, and note the events."""
        begin = self._state.load
        self._here = self._here._replace(share=0.0)
        part = 1.0 / substeps
        least = _LEAST * part
        while self._here.share < 1.0:
            before = self._here.share
            goal = before + part if before + 1.5 * part < 1.0 else 1.0
            if not self._go(step, begin, load, goal, least, near):
                part = max(part / 2.0, least)
            elif self._here.share < goal:  # the next event is likely to be as near as this one
                part = max(_NEXT * (self._here.share - before), least)
            else:
                part = min(2.0 * part, 1.0 / substeps)

    def _go(
        self,
        step: int,
        begin: Action,
        load: Action,
        goal: float,
        least: float,
        near: EquilibriumPath,
    ) -> bool:
        """Go to the next event, or to the share ``goal`` of the step; False if it is too far.

        Within ``least`` all events are located from one history: they are close together.
        """

        def action(share: float) -> Action:
            return begin.interpolate(load, share)

        def near_points(share: float, guesses: list[Array]) -> SlowStage | None:
            f = self._arm.balance(self._state, action(share))
            point = continued_sliding(f, [*guesses, self._state.x], self._state.arm_state.pose.q)
            return None if point is None else SlowStage(share, point, f)

        def solve(share: float, below: SlowStage, above: SlowStage) -> SlowStage | None:
            return near_points(share, _guesses(share, below, above))

        there = near_points(goal, [near[goal]] if goal in near else [])
        close = goal - self._here.share <= 1.5 * least
        if there is None and not close:
            return False
        if there is None:
            self._jump(step, action, goal)
            return True
        between = Between(solve, self._here, there)
        if close:
            roots = self._roots(between, there)
        else:
            passed, stage = self._first(between, there)
            if passed and stage.share - self._here.share < least:
                return False
            roots = [(i, stage) for i in passed]
            there = stage
        self._stand(there, action(there.share))
        for i, stage in roots:
            self._passed[i] = True
            kind = _kind(self._watch, i, between, stage.share)
            force = float(np.linalg.norm(total_force(action(stage.share).wrench)))
            self.events.append(Event(kind, self._watch.places[i], stage.share, force, step))
            self.angles.append(stage.point.state.pose.q)
        return True

    def _roots(self, between: Between[SlowStage], there: SlowStage) -> list[tuple[int, SlowStage]]:
        """Return all quantities that pass before ``there``, and where, in their order."""
        after = self._watch.value(there)
        roots = list[tuple[int, SlowStage]]()
        for i in np.flatnonzero(~self._passed & (after < -self._none)).tolist():
            share = self._root(between, there, i, {there.share: after})
            roots.append((i, between.find(share) or there))
        return sorted(roots, key=lambda root: root[1].share)

    def _root(
        self,
        between: Between[SlowStage],
        there: SlowStage,
        i: int,
        known: dict[float, Array],
        end: float | None = None,
    ) -> float:
        """Return the share at which a quantity is 0 before ``there``, or ``end``."""
        if self._values[i] <= self._none[i]:
            return self._here.share

        def value(share: float) -> float:
            if share == self._here.share:
                return float(self._values[i])
            if share not in known:
                known[share] = self._watch.value(between.at(share))
            at = float(known[share][i])
            return at if abs(at) > _ZERO * self._none[i] else 0.0

        end = there.share if end is None else end
        if value(end) >= 0.0:
            return end
        precision = _PRECISION * (there.share - self._here.share)
        return root(value, self._here.share, end, precision)

    def _first(self, between: Between[SlowStage], there: SlowStage) -> tuple[list[int], SlowStage]:
        """Return the quantities that pass first before ``there``, and where; else ``there``."""
        before = self._values
        after = self._watch.value(there)
        known = {there.share: after}
        passes = np.flatnonzero(~self._passed & (after < -self._none))
        if not passes.size:
            return [], there
        share = there.share
        parts = before[passes] / (before[passes] - after[passes])
        for i in passes[parts.argsort()].tolist():
            root = self._root(between, there, i, known, share)
            if root < share:
                first = i
            share = root
        stage = between.find(share) or there
        now = self._watch.value(stage) <= self._none
        now[first] = True
        now &= ~self._passed & ((after < -self._none) | self._slips)  # some slide for a moment only
        return np.flatnonzero(now).tolist(), stage

    def _stand(self, stage: SlowStage, load: Action) -> None:
        """Keep the history up to an equilibrium."""
        state = stage.point.state
        assert isinstance(state, ChainArmState)
        self._state = QuasiStaticState(load, state, stage.point.x, stage.point.stop_torque)
        self._here = stage
        self._values = self._watch.value(stage)
        self._none = ROUNDING * self._watch.scale(stage)
        self._passed &= self._values <= self._none
        self._passed |= self._values < -self._none

    def _jump(self, step: int, action: Callable[[float], Action], goal: float) -> None:
        """Go to ``goal`` where no equilibrium is near, in ever smaller steps, or by a jump."""
        parts = list[Substep]()
        begin = self._here.share
        what = f"the step to load {step}"
        self._arm.step_to(self._state, action(goal), 1, what, seen=parts.append)
        for part in parts:
            for kind, place, stage in _within(self._arm, part, self._watch):
                share = part.begin + stage.share * (part.end - part.begin)
                share = begin + share * (goal - begin)
                self.events.append(
                    Event(
                        kind,
                        place,
                        share,
                        float(np.linalg.norm(total_force(action(share).wrench))),
                        step,
                    )
                )
                self.angles.append(stage.point.state.pose.q)
        after = parts[-1].after
        f = self._arm.balance(after, after.load)
        point = known_point(f, after.arm_state, after.x)._replace(stop_torque=after.stop_torque)
        self._stand(SlowStage(goal, point, f), after.load)


def _within(
    arm: QuasiStaticArm, part: Substep, watch: Watched[SlowStage]
) -> list[tuple[Kind, str, SlowStage]]:
    """Return the events of a sub-step in their order."""

    def solve(share: float, below: SlowStage, above: SlowStage) -> SlowStage | None:
        f = arm.balance(part.before, part.before.load.interpolate(part.after.load, share))
        guesses = [*_guesses(share, below, above), part.before.x]
        point = continued_sliding(f, guesses, part.before.arm_state.pose.q)
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
    between = Between(solve, here, last)
    roots = sorted(crossings(between, here, last, watch, _PRECISION), key=lambda root: root[1])
    events = [
        (_kind(watch, i, between, share), watch.places[i], between.at(share)) for i, share in roots
    ]
    if part.snapped:
        K = last.point.state.stiffness
        joint = buckling_joint(K, last.point.out, arm.reference.arm.joint_names)
        events.append(("buckling", joint, last))
        new = (watch.value(last) >= 0.0) & (watch.value(there) < 0.0)
        events += [
            (watch.kinds[i], watch.places[i], there._replace(share=last.share))
            for i in np.flatnonzero(new).tolist()
            if watch.kinds[i] in _SINCE
        ]
    return events


def _guesses(share: float, below: SlowStage, above: SlowStage) -> list[Array]:
    """Return where the search for an equilibrium begins, between two that are known.

    A step of a cable's length at a pulley lies between them: begin on the near side of it.
    """
    part = (share - below.share) / (above.share - below.share)
    straight = below.point.x + part * (above.point.x - below.point.x)
    before, after = (contact_angles(stage.point.state.pose) > 0.0 for stage in (below, above))
    guesses = [straight, below.point.x]
    return guesses if np.array_equal(before, after) else guesses[::-1]


def _kind(watch: Watched[SlowStage], i: int, between: Between[SlowStage], share: float) -> Kind:
    """Return the kind of event i, at a share."""
    before = between.before(share, lambda stage: float(watch.value(stage)[i]))
    return contact_kind(watch.kinds, i, before.point.state.pose)

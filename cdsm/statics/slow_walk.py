"""Slow loading with friction that is followed anew, from event to event.

At each event the history up to there is kept, and where a cable stops to slide, too. From there on
the equilibrium is a function of the share of the step. It is searched on pieces on which cables
slide in the same holes (:mod:`cdsm.statics.sliding_pieces`); where that fails, with friction in all
holes at once, in steps so small that events come one by one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from cdsm.statics.crossings import ROUNDING, Between, Watched
from cdsm.statics.events import Event, Kind, event_words
from cdsm.statics.hung_loads import total_force
from cdsm.statics.jump_events import ROOT_PRECISION, guesses_between, jump, kind_at
from cdsm.statics.pieces import root
from cdsm.statics.quasi_static import (
    Action,
    ChainArmState,
    EquilibriumPath,
    QuasiStaticArm,
    QuasiStaticState,
)
from cdsm.statics.sliding import reached_without_snap
from cdsm.statics.sliding_pieces import dip_within, on_piece, stop_of_slip, ways_of
from cdsm.statics.slow_watch import SlowStage, known_point
from cdsm.support.values import Array

_ZERO = 0.1  # part of this rounding that ends the search for a root
_NEXT = 4.0  # the way to look for the next event, over that to the last one
_LEAST = 2.0**-6  # least way between events that are located one by one, over a sub-step
_FINEST = 2.0**-6  # least way to where a cable stops to slide in a hole, over a sub-step

_Acting = Callable[[float], Action]  # what acts at a share of the step


class Walk:
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
        # what holds the arm at its reference may be a stop
        pushed = start.load.holding * f.unit / f.k
        pushes = np.where(pushed > 0.0, f.gaps(start.x)[0], f.gaps(start.x)[1]) <= ROUNDING
        x = start.x - np.where(pushes, pushed, 0.0)
        self._here = SlowStage(0.0, known_point(f, start.arm_state, x), f)
        self._values = watch.value(self._here)
        self._none = ROUNDING * watch.scale(self._here)
        self._passed = self._values < -self._none  # which quantities are negative
        self._latest = math.nan, ""  # share and words of the last event of the step
        self._slips = np.array([kind == "slip" for kind in watch.kinds], dtype=np.bool_)
        self._hole = arm.reference.segments.chains.hole  # segment before each hole (P,)
        self._ways = ways_of(start.arm_state)
        self._wanted = np.ones(len(watch.kinds), dtype=np.bool_)  # what is looked for
        self._news = self._wanted  # what counts as an event
        self._once = False  # whether a hole in which the cable began to slide is news no more

    def along_path(self, step: int, load: Action, near: EquilibriumPath) -> None:
        """Go to a load in the sub-steps of its path, and note the events but for slips."""
        action = partial(self._state.load.interpolate, load)
        self._here = self._here._replace(share=0.0)
        self._latest = math.nan, ""
        self._wanted = ~self._slips
        for goal in sorted(near):
            while self._here.share < goal:
                self._go(step, action, goal, math.inf, near)
        self._wanted = np.ones_like(self._slips)

    def to_load(
        self, step: int, load: Action, substeps: int, near: EquilibriumPath, *, once: bool
    ) -> None:
        """Go to a load in sub-steps, and note the events; of a hole its first slip if ``once``."""
        action = partial(self._state.load.interpolate, load)
        self._here = self._here._replace(share=0.0)
        self._latest = math.nan, ""
        self._once = once
        self._news = ~(self._slips & self._passed) if once else np.ones_like(self._slips)
        part = 1.0 / substeps
        least = _LEAST * part
        while self._here.share < 1.0:
            before = self._here.share
            done = math.floor(before * substeps * (1.0 + ROUNDING))
            goal = min(1.0, (done + 1.0) / substeps)
            if self._go_on_piece(step, action, goal):
                continue
            goal = before + part if before + 1.5 * part < 1.0 else 1.0
            if not self._go(step, action, goal, least, near):
                part = max(part / 2.0, least)
            elif self._here.share < goal:  # the next event is likely to be as near as this one
                part = max(_NEXT * (self._here.share - before), least)
            else:
                part = min(2.0 * part, 1.0 / substeps)

    def _go_on_piece(self, step: int, action: _Acting, goal: float) -> bool:
        """Go to the next event, or to ``goal``, while cables slide as they do; False: not found."""
        keep = np.zeros((2, self._ways.size), dtype=np.bool_)
        keep[:, self._hole] = self._open[self._slips].reshape(2, -1)

        def solve(share: float, below: SlowStage, above: SlowStage) -> SlowStage | None:
            guess = guesses_between(share, below, above)[0] if above is not below else below.point.x
            found = on_piece(self._arm, self._state, action(share), self._ways, keep, guess)
            return None if found is None else SlowStage(share, found[1], found[0])

        finest = _FINEST * (goal - self._here.share)
        while True:
            there = solve(goal, self._here, self._here)
            if there is None and goal - self._here.share < finest:
                return False
            if there is None:
                goal = self._here.share + (goal - self._here.share) / 4.0
                continue
            turn = stop_of_slip(self._arm, self._state, self._ways, (self._here, there), action)
            if turn is None or turn - self._here.share < finest:
                break
            goal = turn
        between = Between(solve, self._here, there)
        dip = self._dip(there, action)
        middle = there if dip is None else between.find(dip)
        if middle is None:  # such as where a cable is slack
            return False
        passed, stage = self._first(between, middle if self._negative(middle).any() else there)
        f = self._arm.balance(self._state, action(stage.share))
        point = reached_without_snap(f, [stage.point.x], self._state.arm_state.pose.q)
        if point is None:
            return False
        confirmed = SlowStage(stage.share, point, f)
        left = abs(self._watch.value(confirmed)) - ROUNDING * self._watch.scale(confirmed)
        if (left[passed] > 0.0).any():
            return False
        self._stand(confirmed, action(stage.share))
        for i in passed:
            self._note(step, i, confirmed, kind_at(self._watch, i, between, stage.share), action)
        return True

    def _note(self, step: int, i: int, stage: SlowStage, kind: Kind, action: _Acting) -> None:
        """Note an event: quantity i has become negative at ``stage``."""
        self._passed[i] = True
        self._latest = stage.share, event_words(kind, self._watch.places[i])
        if self._slips[i]:
            count = self._hole.size
            self._ways[self._hole[i % count]] = 1 if i < count else -1
            if not self._news[i]:
                return
            if self._once:
                self._news[[i % count, i % count + count]] = False
        force = float(np.linalg.norm(total_force(action(stage.share).wrench)))
        self.events.append(Event(kind, self._watch.places[i], stage.share, force, step))
        self.angles.append(stage.point.state.pose.q)

    def _go(
        self, step: int, action: _Acting, goal: float, least: float, near: EquilibriumPath
    ) -> bool:
        """Go to the next event, or to the share ``goal`` of the step; False if it is too far.

        Within ``least`` all events are located from one history: they are close together.
        """

        def near_points(share: float, guesses: list[Array]) -> SlowStage | None:
            f = self._arm.balance(self._state, action(share))
            starts = [*guesses, self._state.x]
            point = reached_without_snap(f, starts, self._state.arm_state.pose.q)
            return None if point is None else SlowStage(share, point, f)

        def solve(share: float, below: SlowStage, above: SlowStage) -> SlowStage | None:
            return near_points(share, guesses_between(share, below, above))

        there = near_points(goal, [near[goal]] if goal in near else [])
        close = goal - self._here.share <= 1.5 * least
        if there is None and not close:
            return False
        if there is None:
            self._jump(step, action, goal)
            return True
        between = Between(solve, self._here, there)
        dip = self._dip(there, action)
        middle = None if dip is None else between.find(dip)
        if middle is not None and self._negative(middle).any():
            there = middle
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
            self._note(step, i, stage, kind_at(self._watch, i, between, stage.share), action)
        return True

    @property
    def _open(self) -> NDArray[np.bool_]:
        """Which quantities (m,) are an event if they become negative."""
        return ~self._passed & self._wanted

    def _negative(self, stage: SlowStage) -> NDArray[np.bool_]:
        """Return which quantities (m,) have become negative at a stage, which is an event."""
        return self._open & (self._watch.value(stage) < -self._none)

    def _dip(self, there: SlowStage, action: _Acting) -> float | None:
        """Return a share before ``there`` at which a quantity may be negative, or None."""
        ends = self._here, there
        positive = self._open & (self._values > self._none)
        return dip_within(self._arm, self._state, action, self._ways, ends, self._watch, positive)

    def _roots(self, between: Between[SlowStage], there: SlowStage) -> list[tuple[int, SlowStage]]:
        """Return all quantities that pass before ``there``, and where, in their order."""
        after = self._watch.value(there)
        roots = list[tuple[int, SlowStage]]()
        for i in np.flatnonzero(self._negative(there)).tolist():
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
        precision = ROOT_PRECISION * (there.share - self._here.share)
        return root(value, self._here.share, end, precision)

    def _first(self, between: Between[SlowStage], there: SlowStage) -> tuple[list[int], SlowStage]:
        """Return the quantities that pass first before ``there``, and where; else ``there``."""
        before = self._values
        after = self._watch.value(there)
        known = {there.share: after}
        passes = np.flatnonzero(self._negative(there))
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
        now &= self._open & ((after < -self._none) | self._slips)  # some slide for a moment only
        return np.flatnonzero(now).tolist(), stage

    def _stand(self, stage: SlowStage, load: Action) -> None:
        """Keep the history up to an equilibrium."""
        state = stage.point.state
        assert isinstance(state, ChainArmState)
        self._state = QuasiStaticState(load, state, stage.point.x, stage.point.stop_torque)
        self._here = stage
        self._ways = ways_of(state)
        self._values = self._watch.value(stage)
        self._none = ROUNDING * self._watch.scale(stage)
        self._passed &= self._values <= self._none
        self._passed |= self._values < -self._none

    def _jump(self, step: int, action: _Acting, goal: float) -> None:
        """Go to ``goal`` where no equilibrium is near, in ever smaller steps, or by a jump."""
        way = self._here.share, goal
        after, events, angles = jump(
            self._arm, self._state, action, way, step, self._watch, self._latest
        )
        self.events += events
        self.angles += angles
        f = self._arm.balance(after, after.load)
        point = known_point(f, after.arm_state, after.x)._replace(stop_torque=after.stop_torque)
        self._stand(SlowStage(goal, point, f), after.load)

"""Sequential quadratic programming among the admissible tensions of a stable arm.

    min f(F) so that c(F) = 0,  J_Lᵀ F = τ,  low ≤ F ≤ high,  λ_min(K_θ) ≥ floor

With exact second derivatives, a trust region, and an exact penalty on c. Every iterate is stable.
With constant rigidities K_θ is affine in F, the stable tensions are a convex set, and the stiffness
along a direction is a concave function; nothing here relies on it, but it is why so few steps do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdsm.planning import kernels
from cdsm.planning.admissible import Admissible, solve
from cdsm.planning.stiffness_model import Field, Point, Reading, Sight, drawn_back
from cdsm.support.validation import Array

MET: Final = 1e-9
"""A number wanted to be zero is so if its magnitude is not above this."""

_ITERATIONS = 100
_FIRST_REGION = 4.0
_SMALLEST_REGION = 1e-13
_FLOOR = 1e-6
"""Curvatures below this part of the largest are raised to it: the solver needs them positive."""

_PENALTIES = (10.0, 1e8)
"""First and largest price of c in f."""

_ROUNDING = 1e-15
_ARRIVED = 1e-10
"""A step this small, of tensions and of c, ends a search: the next would be its square."""

_DOUBT = 1.02
"""An effort foreseen, squared, is trusted to this factor."""

_PREMIUM = 3.0
"""The price of c over its multiplier: above one it is exact, and the lower the longer the steps."""


@dataclass(frozen=True)
class Goal:
    """f = effort·½‖(F − centre)/unit‖² + linear·Σc + square·½‖c‖², and whether c = 0 is asked."""

    effort: float = 0.0
    linear: float = 0.0
    square: float = 0.0
    constrained: bool = False


EFFORT: Final = Goal(effort=1.0, constrained=True)
HIGHEST: Final = Goal(linear=-1.0)
LOWEST: Final = Goal(linear=1.0)
NEAREST: Final = Goal(square=1.0)


@dataclass(frozen=True, eq=False)
class Task:
    """What is sought, and among what.

    Attributes:
        region: The admissible tensions.
        field: K_θ over them.
        anchor: A stable point well inside, towards which steps are drawn back that leave the
            stable tensions.
        reading: c.
        goal: f.
        unit: What effort is counted in [N]: of the order of the tensions sought.
        centre: Tensions (C,) [N] that effort is counted from, or 0.
    """

    region: Admissible
    field: Field
    anchor: Point
    reading: Reading
    goal: Goal
    unit: float
    centre: Array | float = 0.0

    def look(self, point: Point) -> Sight:
        """C at a point."""
        return self.reading.of(point)

    def merit(self, sight: Sight, penalty: float) -> float:
        """f, and the price of c."""
        goal, c = self.goal, sight.values
        x = (sight.point.F - self.centre) / self.unit
        merit = 0.5 * goal.effort * float(x @ x)
        if goal.constrained:
            return merit + penalty * _price(c)
        return merit + goal.linear * float(c.sum()) + 0.5 * goal.square * float(c @ c)

    def met(self, sight: Sight) -> bool:
        """Whether c = 0, if that is asked for."""
        return not self.goal.constrained or bool((abs(sight.values) <= MET).all())

    def better(self, one: Sight, other: Sight) -> bool:
        """Whether one end of a search beats another by more than rounding."""
        if self.met(one) != self.met(other):
            return self.met(one)
        penalty = 0.0 if self.met(one) else _PENALTIES[1]
        a, b = self.merit(one, penalty), self.merit(other, penalty)
        return a < b - MET * abs(b)


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended, and after how many steps."""

    sight: Sight
    iterations: int


class _Model(NamedTuple):
    """f, c and a convex curvature of the Lagrangian, by d = ΔF/size."""

    size: float
    g: Array
    c: Array
    G: Array
    W: Array


class _Limits(NamedTuple):
    """The trust region in sizes, and bounds (C,) [N]."""

    radius: float
    low: Array
    high: Array


class _Step(NamedTuple):
    """A step d, the multipliers of c and of stability, and how far the merit should fall."""

    d: Array
    y: Array
    z: float
    predicted: float

    @property
    def length(self) -> float:
        """Its largest entry."""
        return float(abs(self.d).max(initial=0.0))


def search(task: Task, start: Point, *, confined: bool = False) -> Found:
    """A local optimum from a stable point.

    Args:
        task: What is sought.
        start: Where to begin.
        confined: Whether to stay where no rigidity jumps.
    """
    region, goal = task.region, task.goal
    here = task.look(start)
    y, z = np.zeros(here.values.size if goal.constrained else 0), 0.0
    penalty, radius, steps = _PENALTIES[0], _FIRST_REGION, 0
    confined = confined or not any(region.jumps)
    while steps < _ITERATIONS and radius >= _SMALLEST_REGION:
        steps += 1
        piece = region.piece(here.point.F)
        limits = _Limits(radius, *(piece if confined else (region.low, region.high)))
        model = _model(task, here, y, z)
        step, penalty = _step(task, here, model, penalty, limits)
        y, z = step.y, step.z
        small = step.length <= _ARRIVED and bool((abs(model.c) <= _ARRIVED).all())
        if small or step.predicted <= _ROUNDING * max(1.0, abs(task.merit(here, penalty))):
            if not confined:
                confined = True  # once more, as if no rigidity jumped beyond the piece
            elif not task.met(here) and penalty < _PENALTIES[1]:
                penalty = min(100.0 * penalty, _PENALTIES[1])  # at rest, but for so low a price
            else:
                break
            continue
        there, gain = _moved(task, here, model, step, penalty, limits)
        if there is not None and gain >= 1e-4 * step.predicted:
            here = there
            if gain > 0.5 * step.predicted:
                radius = max(radius, 3.0 * step.length)
            elif gain < 0.25 * step.predicted:
                radius = step.length / 2.0
        elif not confined and _leaves(piece, here.point.F + model.size * step.d):
            confined = True  # what looked good on this side of a jump is not on the other
        else:
            radius = step.length / 4.0
    return Found(here, steps)


def promises(task: Task, start: Point, best: Sight) -> bool:
    """Whether a search confined to the range of a point may end with less effort than the best.

    Judged by one quadratic program. Where the stiffness is concave it is optimistic about targets
    that are stiffer; of others, and of other goals, it says yes in doubt.
    """
    if not (task.goal.constrained and task.met(best)):
        return True
    here = task.look(start)
    model = _model(task, here, np.zeros(here.values.size), 0.0)
    limits = _Limits(_FIRST_REGION, *task.region.piece(start.F))
    d = _step(task, here, model, _PENALTIES[1], limits)[0].d
    ahead = task.merit(here, 0.0) + float(model.g @ d + 0.5 * d @ model.W @ d)
    return ahead <= _DOUBT * task.merit(best, 0.0)


def _model(task: Task, here: Sight, y: Array, z: float) -> _Model:
    goal, region, point, c = task.goal, task.region, here.point, here.values
    size = max(region.scale, float(point.F.max()))
    relative = size / task.unit
    G = here.slopes * size
    weights = y if goal.constrained else goal.linear + goal.square * c
    g = goal.effort * relative * (point.F - task.centre) / task.unit
    W = here.curvature(weights) * size**2
    W[np.diag_indices(len(W))] += goal.effort * relative**2
    if not goal.constrained:
        g = g + weights @ G
        W += goal.square * G.T @ G
        c, G = np.zeros(0), np.zeros((0, g.size))
    held = G
    if z > 0.0:
        W -= z * size**2 / task.field.scale * point.reserve_curvature()
        held = np.vstack([G, point.reserve_slope()])
    return _Model(size, g, c, G, kernels.convex(W, region.null, held, _FLOOR))


def _step(
    task: Task, here: Sight, model: _Model, penalty: float, limits: _Limits
) -> tuple[_Step, float]:
    """The step that the model recommends, and the price of c that it takes.

    Its variables are d and, for each c, by how much it is missed on either side.
    """
    region, point, size = task.region, here.point, model.size
    count, rank = model.g.size, len(region.rows)
    P, q, A, b, low, high, cut = kernels.elastic_program(
        region.rows,
        region.imbalance(point.F) / size,
        model.G,
        model.c,
        -point.reserve_slope() * size / task.field.scale,
        model.W,
        model.g,
        np.maximum(np.minimum((limits.low - point.F) / size, 0.0), -limits.radius),
        np.minimum(np.maximum((limits.high - point.F) / size, 0.0), limits.radius),
    )
    cuts = cut, np.array([max(point.reserve, 0.0) / task.field.scale])
    missed = np.arange(count, len(q))
    best, miss = None, math.inf
    while True:
        P[missed, missed] = q[missed] = penalty
        found = solve(P, q, (A, b), (low, high), cuts)
        if found is None:
            break
        before, miss = miss, float(found.x[missed].sum())
        if best is not None and miss > 0.9 * before:
            penalty /= 10.0  # the last rise did not help
            break
        best = found
        if miss <= MET:  # then no more than the multiplier is needed
            needed = _PREMIUM * float(abs(found.y[rank:]).max(initial=0.0))
            penalty = max(_PENALTIES[0], min(penalty, needed))
            break
        if penalty >= _PENALTIES[1]:
            break
        penalty *= 10.0
    if best is None:
        return _Step(np.zeros(count), np.zeros(model.c.size), 0.0, 0.0), penalty
    d = best.x[:count]
    cheaper = _price(model.c) - _price(model.c + model.G @ d)
    predicted = penalty * cheaper - float(model.g @ d + 0.5 * d @ model.W @ d)
    return _Step(d, best.y[rank:], float(best.z[0]), predicted), penalty


def _moved(
    task: Task, here: Sight, model: _Model, step: _Step, penalty: float, limits: _Limits
) -> tuple[Sight | None, float]:
    """What is seen after a step, if that is stable, and by how much the merit has fallen."""

    def after(d: Array) -> tuple[Sight | None, float]:
        F = np.clip(here.point.F + model.size * d, limits.low, limits.high)
        point = drawn_back(task.field, F, task.anchor)
        if point is None:
            return None, -math.inf
        there = task.look(point)
        return there, task.merit(here, penalty) - task.merit(there, penalty)

    there, gain = after(step.d)
    if there is not None and gain < 0.75 * step.predicted and model.c.size:
        # c bends away from its tangent: aim at where it is met beyond the bend
        bent = model._replace(c=there.values - model.G @ step.d)
        other, more = after(_step(task, here, bent, penalty, limits)[0].d)
        if more > gain:
            return other, more
    return there, gain


def _leaves(piece: tuple[Array, Array], F: Array) -> bool:
    """Whether tensions F (C,) [N] are outside a piece."""
    return bool(((piece[0] > F) | (piece[1] < F)).any())


def _price(c: Array) -> float:
    return float(abs(c).sum() + 0.5 * (c @ c))

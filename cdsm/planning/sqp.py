r"""Sequential quadratic programming over the admissible tensions of a stable arm.

    min f(F)   subject to   c(F) = 0,  J_Lᵀ F = τ,  low ≤ F ≤ high,  λ_min(K_θ(F)) ≥ floor.

c are the constraints on the stiffness, τ = J_Xᵀ W − g is the torque that the cables balance. Only c
and the last condition, reserve = λ_min − floor ≥ 0, are nonlinear. Every iterate balances the arm
and is stable, so K_θ can be inverted there. scipy's SLSQP with the same gradients ends at the same
tensions, but needs twice to a hundred times the evaluations, and with finite differences three
times as long (tests/benchmarks/test_planning_speed.py).

**The quadratic program of a step.** Let d = ΔF/size (size: the largest tension), g = ∂f/∂d and
G = ∂c/∂d. L = f + y·c − z·reserve, with the multipliers y and z of the step before. Solve

    min ½ dᵀ W d + g·d + ρ Σ(s + t) + ½ ρ Σ(s² + t²)
    subject to  J_Lᵀ d = 0,  c + G d = s − t,  s, t ≥ 0,  reserve + ∂reserve·d ≥ 0,
             bounds,  |d_c| ≤ radius.

s and t are the positive and the negative violations of c. Their weight ρ (``price``) makes the
penalty exact if it exceeds the largest multiplier of c. It rises tenfold until c is met, or until a
rise does not help. Then it falls to three times the multiplier: a large ρ shortens the steps along
a curved c.

**The curvature W.** W is the exact Hessian of L, made positive definite by
:func:`cdsm.planning.kernels.convex` on the steps that keep the balance, c and, if z > 0, the
reserve. If it is positive definite there already, the last steps converge quadratically.

**The trust region.** A step is accepted if the merit f + ρ (‖c‖₁ + ½ ‖c‖²) falls by at least 1e-4
of the prediction. If c bends away from its tangent, a second program uses the value of c after the
step (second-order correction). A step that leaves the stable tensions is moved back towards an
anchor, a stable point well inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdsm.planning import kernels
from cdsm.planning.admissible import Admissible, solve
from cdsm.planning.stiffness_model import Constraints, ConstraintValues, Evaluation
from cdsm.support.values import Array

MET: Final = 1e-9  # largest magnitude of a constraint that counts as met
_ITERATIONS = 100
_FIRST_RADIUS = 4.0
_SMALLEST_RADIUS = 1e-13
_FIRST_PRICE, _LARGEST_PRICE = 10.0, 1e8
_PREMIUM = 3.0  # price over the largest multiplier: above one the penalty is exact
_ROUNDING = 1e-15
_ARRIVED = 1e-10  # smaller steps and misses end a search: the next ones are of their square's size


class Objective(NamedTuple):
    """Objective f = linear·Σc + square·½‖c‖², where c are the values of the constraints.

    If ``effort`` is True, f is ½‖(F − centre)/unit‖² instead, subject to c = 0. :class:`Program`
    has ``centre`` and ``unit``.
    """

    linear: float = 0.0
    square: float = 0.0
    effort: bool = False


EFFORT: Final = Objective(effort=True)
HIGHEST: Final = Objective(linear=-1.0)
LOWEST: Final = Objective(linear=1.0)
NEAREST: Final = Objective(square=1.0)


@dataclass(frozen=True, eq=False)
class Program:
    """Nonlinear program: minimise an objective over the admissible tensions of a stable arm."""

    region: Admissible  # the admissible tensions
    anchor: Evaluation  # stable point well inside, towards which steps are moved back
    constraints: Constraints  # c(F) = 0
    objective: Objective  # f(F)
    unit: float  # unit of the effort [N], of the order of the tensions in the solution
    centre: Array | float = 0.0  # tensions (C,) [N] at which the effort is zero, or 0

    def merit(self, at: ConstraintValues, price: float) -> float:
        """Return the merit: f; if f is the effort, plus a penalty ``price`` · (‖c‖₁ + ½ ‖c‖²)."""
        c = at.values
        if self.objective.effort:
            x = (at.evaluation.F - self.centre) / self.unit
            return 0.5 * float(x @ x) + price * _miss(c)
        return self.objective.linear * float(c.sum()) + 0.5 * self.objective.square * float(c @ c)

    def met(self, at: ConstraintValues) -> bool:
        """Return whether all |c| ≤ 1e-9 [-]; True if no c = 0 is asked (f is not the effort)."""
        return not self.objective.effort or bool((abs(at.values) <= MET).all())

    def better(self, one: ConstraintValues, other: ConstraintValues) -> bool:
        """Return whether ``one`` is better than ``other``.

        It is better if it alone meets c = 0, or if both or neither meet it and its merit is lower.
        """
        if self.met(one) != self.met(other):
            return self.met(one)
        price = 0.0 if self.met(one) else _LARGEST_PRICE
        a, b = self.merit(one, price), self.merit(other, price)
        return a < b - MET * abs(b)


def search(program: Program, start: Evaluation) -> ConstraintValues:
    """Find a local optimum from the stable point ``start``."""
    region, iterate = program.region, program.constraints.at(start)
    multipliers = np.zeros(iterate.values.size if program.objective.effort else 0)
    step, radius = _Step(np.zeros_like(start.F), multipliers, 0.0, 0.0, _FIRST_PRICE), _FIRST_RADIUS
    for _ in range(_ITERATIONS):
        if radius < _SMALLEST_RADIUS:
            break
        local = _LocalModel(program, iterate, step, (region.low, region.high), radius)
        step = local.step(step.price, local.c)
        length = float(abs(step.d).max(initial=0.0))
        small = length <= _ARRIVED and bool((abs(local.c) <= _ARRIVED).all())
        if small or step.predicted <= _ROUNDING * max(1.0, abs(program.merit(iterate, step.price))):
            if program.met(iterate) or step.price >= _LARGEST_PRICE:
                break
            # converged, but only at this low price
            step = step._replace(price=min(100.0 * step.price, _LARGEST_PRICE))
            continue
        candidate, fall = local.take(step)
        if candidate is not None and fall >= 1e-4 * step.predicted:
            iterate = candidate
            if fall > 0.5 * step.predicted:
                radius = max(radius, 3.0 * length)
            elif fall < 0.25 * step.predicted:
                radius = length / 2.0
        else:
            radius = length / 4.0
    return iterate


class _Step(NamedTuple):
    """Step of a search: the solution of the quadratic program at an iterate."""

    d: Array  # ΔF/size (C,)
    y: Array  # multipliers of c
    z: float  # multiplier of the reserve λ_min − floor
    predicted: float  # fall of the merit
    price: float  # weight of the violation of c in the merit


class _LocalModel:
    """Quadratic program at an iterate, for the step d = ΔF/size.

    ``before`` is the previous step. ``bounds`` (low, high) limit the tensions [N], and ``radius``
    limits |d_c| of each cable.
    """

    def __init__(
        self,
        program: Program,
        iterate: ConstraintValues,
        before: _Step,
        bounds: tuple[Array, Array],
        radius: float,
    ) -> None:
        objective, evaluation = program.objective, iterate.evaluation
        self.program, self.iterate, self.bounds, self.radius = program, iterate, bounds, radius
        self.size = size = max(program.region.scale, float(evaluation.F.max()))
        c, G = iterate.values, iterate.jacobian * size
        if objective.effort:
            relative = size / program.unit
            g = relative * (evaluation.F - program.centre) / program.unit
            W = iterate.hessian(before.y) * size**2
            W[np.diag_indices(len(W))] += relative**2
        else:
            # c is part of f, whose Hessian gets a Gauss-Newton term; no constraint is left
            weights = objective.linear + objective.square * c
            g = weights @ G
            W = iterate.hessian(weights) * size**2 + objective.square * G.T @ G
            c, G = np.zeros(0), np.zeros((0, g.size))
        normals = G
        if before.z > 0.0:  # stability was active: its curvature counts, on steps that keep it
            W -= before.z * size**2 / evaluation.model.scale * evaluation.reserve_hessian()
            normals = np.vstack([G, evaluation.reserve_gradient])
        self.g, self.c, self.G = g, c, G
        self.W = kernels.convex(W, program.region.null, normals)

    def step(self, price: float, c: Array) -> _Step:
        """Solve the quadratic program for constraint values ``c`` (n,) at d = 0.

        ``price`` is the first weight ρ of their violation; it is raised until they are met.
        """
        region, evaluation, size = self.program.region, self.iterate.evaluation, self.size
        count, rank, m = self.g.size, len(region.rows), c.size
        low, high = ((bound - evaluation.F) / size for bound in self.bounds)
        scale, none = evaluation.model.scale, np.zeros(2 * m)
        # variables: d, s and t
        misses = np.arange(count, count + 2 * m)
        P, q = np.zeros((count + 2 * m, count + 2 * m)), np.append(self.g, none)
        A = np.zeros((rank + m, count + 2 * m))
        P[:count, :count] = self.W
        A[:rank, :count], A[rank:, :count] = region.rows, self.G
        A[rank:, misses[:m]], A[rank:, misses[m:]] = -np.eye(m), np.eye(m)
        b = np.append(region.imbalance(evaluation.F) / size, -c)
        # d = 0 stays admissible, even if rounding has put F beyond a bound
        box = (
            np.append(np.maximum(np.minimum(low, 0.0), -self.radius), none),
            np.append(np.minimum(np.maximum(high, 0.0), self.radius), none + np.inf),
        )
        stability = np.append(-evaluation.reserve_gradient * size / scale, none)
        cuts = stability[None], np.array([max(evaluation.reserve, 0.0) / scale])
        best, miss = None, math.inf
        while True:  # raise the penalty until c is met, then lower it to what is needed
            P[misses, misses] = q[misses] = price
            found = solve(P, q, (A, b), box, cuts)
            if found is None:
                break
            before, miss = miss, float(found.x[misses].sum())
            if miss > 0.9 * before:
                price /= 10.0  # the last rise did not help
                break
            best = found
            if miss <= MET:
                needed = _PREMIUM * float(abs(found.y[rank:]).max(initial=0.0))
                price = max(_FIRST_PRICE, min(price, needed))
                break
            if price >= _LARGEST_PRICE:
                break
            price *= 10.0
        if best is None:
            return _Step(np.zeros(count), np.zeros(m), 0.0, 0.0, price)
        d = best.x[:count]
        cheaper = _miss(c) - _miss(c + self.G @ d)
        predicted = price * cheaper - float(self.g @ d + 0.5 * d @ self.W @ d)
        return _Step(d, best.y[rank:], float(best.z[0]), predicted, price)

    def take(self, step: _Step) -> tuple[ConstraintValues | None, float]:
        """Take a step; return the new point and the fall of the merit.

        An unstable point is moved back towards the anchor. If that finds no stable point, the
        result is None and -inf. If there are constraints c, and the merit falls by less than 3/4 of
        the prediction, a step with the second-order correction is tried too. The larger fall
        counts.
        """
        candidate, fall = self._after(step.d, step.price)
        if candidate is not None and fall < 0.75 * step.predicted and self.c.size:
            # second-order correction: use the value of c after the step, not of its tangent
            corrected = self.step(step.price, candidate.values - self.G @ step.d)
            other, more = self._after(corrected.d, step.price)
            if more > fall:
                return other, more
        return candidate, fall

    def _after(self, d: Array, price: float) -> tuple[ConstraintValues | None, float]:
        program, iterate = self.program, self.iterate
        F = np.clip(iterate.evaluation.F + self.size * d, *self.bounds)
        evaluation = program.anchor.backtracked(F)
        if evaluation is None:
            return None, -math.inf
        candidate = program.constraints.at(evaluation)
        return candidate, program.merit(iterate, price) - program.merit(candidate, price)


def _miss(c: Array) -> float:
    return float(abs(c).sum() + 0.5 * (c @ c))

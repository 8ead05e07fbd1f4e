"""The joint angles nearest a guess among those that answer a question best, within the limits.

A question is a misfit r(q) of no dimension. Of the joint angles with r = 0 those are wanted that
solve

    min ½‖q − guess‖²   so that   r(q) = 0   and   lower ≤ q ≤ upper,

and where there are none, the joint angles of the least ½‖r‖². Both are the limit ε → 0 of

    min ½‖r‖² + ½ε‖q − guess‖²   so that   lower ≤ q ≤ upper,

a least-squares problem of full rank, however many joints are redundant and however many equations
are. scipy solves it for falling ε, each from the last, so that the search goes out from the guess;
Newton's method, with the limits held that it ends on, then takes the step to ε = 0.

Of 108 poses that arms of 3 to 20 joints can reach, this reached all, to rounding, and all answers
meet the conditions for nearest. SLSQP reached 56, and 103 from a least-squares answer; quadratic
programs in sequence (DAQP) 83. pink weighs the target against the posture: it came within 1e-6 of
93, or within 1e-9 of 102 of which 20 were nearest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from cdsm.support.validation import Array

Limits = NDArray[np.int_]
"""Which limit each joint rests on (nv,): −1 the lower, 1 the upper, 0 none."""

# fewer stages end at an answer farther from the guess more often, more only take longer
_WEIGHTS = (1e-2, 1e-4, 1e-6, 1e-8)
"""The falling ε."""

_STARTS = 12
"""Random postures to search from where the guess leads to no answer."""

_NEAR = 1e-6
"""Misfit that may yet turn out to be none."""

_SINGULAR, _FLAT = 1e-9, 1e-12
"""Singular values, and eigenvalues, this part of the largest are zero."""

_LONGEST, _ATTEMPTS = 0.2, 60
"""Longest step of Newton's method [rad], as a curvature holds no further, and most steps."""

_SETTLED = 1e-11
"""Misfit and slope at which Newton's method has settled; it usually gets to 1e-15."""


class Question(Protocol):
    """A misfit of no dimension, as a function of joint angles."""

    def misfit(self, q: Array) -> tuple[Array, Array]:
        """Misfit r (m,) and ∂r/∂q (m, nv)."""

    def curvature(self, q: Array, weight: Array) -> Array:
        """Σ_a weight_a ∂²r_a/∂q² (nv, nv) where r = 0."""

    def hessian(self, q: Array) -> Array:
        """Second derivative of ½‖r‖² (nv, nv), also where r is not zero."""


class Problem(NamedTuple):
    """What :func:`nearest` solves.

    Attributes:
        question: The misfit that is to be least.
        lower: Lower limits (nv,) [rad].
        upper: Upper limits (nv,) [rad].
        guess: The joint angles wanted near (nv,) [rad], within the limits.
    """

    question: Question
    lower: Array
    upper: Array
    guess: Array


class Answer(NamedTuple):
    """Where a search ended.

    Attributes:
        angles: Joint angles (nv,) [rad], within the limits.
        misfit: ‖r‖ there [-].
        iterations: How often r was evaluated.
    """

    angles: Array
    misfit: float
    iterations: int


def nearest(problem: Problem, tolerance: float) -> Answer:
    """The joint angles nearest a guess among those of a misfit up to a tolerance, or of the least.

    Nearest in a neighbourhood, as every search that goes downhill: another way to fold the arm
    may be nearer. Where the guess leads to no answer, random postures, always the same ones, are
    tried in turn.
    """
    q, iterations = problem.guess, 0
    for weight in _WEIGHTS[:-1]:
        q, _, count = _fit(problem, q, weight, 1e-4)
        iterations += count
    best = _finished(problem, q)
    iterations += best.iterations
    random = np.random.default_rng(0)
    for _ in range(_STARTS):
        if best.misfit <= tolerance:
            break
        found = _finished(problem, random.uniform(problem.lower, problem.upper))
        iterations += found.iterations
        # the first is nearest the guess: another that is better by rounding alone is not wanted
        if found.misfit < (1.0 - 1e-6) * best.misfit:
            best = found
    return best._replace(iterations=iterations)


def _finished(problem: Problem, start: Array) -> Answer:
    """The answer that a start leads to, to the last digit where Newton's method gets there."""
    q, held, iterations = _fit(problem, start, _WEIGHTS[-1], 1e-6)
    best, held, count = _active(_to_fit, problem, q, held)
    iterations += count
    if best is None:  # singular: the search alone must do
        best, held, count = _fit(problem, q, 1e-14, 1e-15)
        iterations += count
    if _size(problem, best) < _NEAR:
        closer, _, count = _active(_to_guess, problem, best, held)
        iterations += count
        if closer is not None:
            best = closer
    return Answer(best, _size(problem, best), iterations)


def _size(problem: Problem, q: Array) -> float:
    return float(np.linalg.norm(problem.question.misfit(q)[0]))


def _fit(
    problem: Problem, start: Array, weight: float, tolerance: float
) -> tuple[Array, Limits, int]:
    """Solve for one ε: joint angles, the limits they rest on, and the effort."""
    question, lower, upper, guess = problem
    root = math.sqrt(weight)
    pull = root * np.eye(guess.size)
    found = least_squares(
        lambda q: np.concatenate([question.misfit(q)[0], root * (q - guess)]),
        np.clip(start, lower, upper),
        lambda q: np.vstack([question.misfit(q)[1], pull]),
        bounds=(lower, upper),
        method="dogbox",  # unlike trf it goes exactly onto a limit, and says which
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
        max_nfev=100,
    )
    return found.x, found.active_mask, int(found.nfev)


class _Step(NamedTuple):
    """A step of Newton's method for the free joints.

    Attributes:
        move: The step (free,) [rad].
        slope: Derivative by all joint angles (nv,) of what is to be least, answers kept.
        error: How far the joint angles are from optimal.
        convex: Whether they are near a minimum, not a saddle.
    """

    move: Array
    slope: Array
    error: float
    convex: bool


_Newton = Callable[[Problem, Array, NDArray[np.bool_]], _Step]


def _to_guess(problem: Problem, q: Array, free: NDArray[np.bool_]) -> _Step:
    """Step to min ½‖q − guess‖² so that r = 0: to r = 0 by the shortest way, then along it."""
    r, J = problem.question.misfit(q)
    away = q - problem.guess
    left, values, right = np.linalg.svd(J[:, free])
    rank = int(np.count_nonzero(values > _SINGULAR * values.max(initial=0.0)))
    inverse = left[:, :rank] / values[:rank]
    row, null = right[:rank], right[rank:]
    weight = -inverse @ (row @ away[free])
    slope = away + weight @ J
    H = (np.eye(q.size) + problem.question.curvature(q, weight))[np.ix_(free, free)]
    move = -(r @ inverse) @ row
    along, convex = _downhill(null @ H @ null.T, null @ (slope[free] + H @ move))
    error = max(float(np.linalg.norm(r)), float(abs(null @ slope[free]).max(initial=0.0)))
    return _Step(move + along @ null, slope, error, convex)


def _to_fit(problem: Problem, q: Array, free: NDArray[np.bool_]) -> _Step:
    """Step to min ½‖r‖²."""
    r, J = problem.question.misfit(q)
    slope = r @ J
    move, convex = _downhill(problem.question.hessian(q)[np.ix_(free, free)], slope[free])
    error = float(abs(slope[free]).max(initial=0.0)) / max(1.0, float(np.linalg.norm(r)))
    return _Step(move, slope, error, convex)


def _downhill(H: Array, slope: Array) -> tuple[Array, bool]:
    """Step of Newton's method, turned round where H curves down; none where H is flat."""
    values, vectors = np.linalg.eigh((H + H.T) / 2.0)
    flat = abs(values) <= _FLAT * abs(values).max(initial=0.0)
    rate = np.where(flat, math.inf, abs(values))
    return -vectors @ ((slope @ vectors) / rate), bool((values[~flat] > 0.0).all())


def _active(
    newton: _Newton, problem: Problem, q: Array, held: Limits
) -> tuple[Array | None, Limits, int]:
    """Newton's method with the right limits held: angles, None if it fails; limits, and effort."""
    _, lower, upper, _ = problem
    held, iterations = held.copy(), 0
    for _ in range(2 * q.size + 5):
        q = np.where(held < 0, lower, np.where(held > 0, upper, q))
        q, slope, count = _settled(newton, problem, q, held == 0)
        iterations += count
        if slope is None:
            break
        beyond = (q > upper).astype(np.int_) - (q < lower)
        q = np.clip(q, lower, upper)
        pull = held * slope  # positive: it would rather leave the limit
        if beyond.any():
            held = np.where(beyond != 0, beyond, held)
        elif pull.max() > _SETTLED:
            held[pull.argmax()] = 0
        else:
            return q, held, iterations
    return None, held, iterations


def _settled(
    newton: _Newton, problem: Problem, q: Array, free: NDArray[np.bool_]
) -> tuple[Array, Array | None, int]:
    """Newton's method for the free joints: the angles, the slope there unless it fails, effort."""
    least = math.inf
    for count in range(1, _ATTEMPTS + 1):
        step = newton(problem, q, free)
        # below this, and no longer falling fast, only rounding is left
        done = step.error < _SETTLED and step.error > 0.5 * least
        if step.convex and (done or step.error == 0.0):
            return q, step.slope, count
        least = min(least, step.error)
        q = q.copy()
        q[free] += step.move * min(1.0, _LONGEST / float(abs(step.move).max(initial=_LONGEST)))
    return q, None, _ATTEMPTS

"""Where a body comes to rest: r(q) = 0 between stops, found downhill and finished by Newton.

The torque r that is out of balance need not be the gradient of a potential. A step p is judged by
the work ∫ r·dq along it, with K = ∂r/∂q to the fourth order of its length

    ½ (r₀ + r₁)·p + (pᵀK₀p − pᵀK₁p)/12,

which stays exact where the difference of two potentials would be rounding. Where r is a gradient
this is the trust-region method with the exact Hessian, which goes down and leaves saddles. Near the
end every step is a full one of Newton's method, with K complete and not just its symmetric part.

scipy's trust-exact does not serve: it needs a potential, which a moment at the tip has not, and
knows no stops.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar, final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from cdsm.errors import CdsmError
from cdsm.support.validation import Array

_ATTEMPTS = 200
"""Steps before giving up; arms that come to rest at all need up to 130, and mostly below 10."""

_FIRST, _WIDEST = 0.2, 0.5
"""Radius of the trust region [rad] to begin with, and at most, so as not to skip a valley."""

FLAT = 1e-12
"""Eigenvalues of K this part of the largest are rounding: the state is neutral."""

_POOR, _GOOD, _ACCEPTED = 0.25, 0.75, 0.05
"""Work over predicted work below which the radius shrinks, above which it grows, and above which a
step is accepted (Nocedal and Wright, Numerical Optimization, 2006, algorithm 4.1)."""


class State(Protocol):
    """The body at some place."""

    @property
    def q(self) -> Array:
        """The place (nv,)."""

    @property
    def torque(self) -> Array:
        """Torque r that is out of balance (nv,)."""

    @property
    def stiffness(self) -> Array:
        """Its derivative K (nv, nv)."""

    @property
    def rounding(self) -> Array:
        """How much of r is rounding (nv,)."""


_State = TypeVar("_State", bound=State)


@final
@dataclass(frozen=True)
class RestSearch(Generic[_State]):
    """Where a search for rest ended.

    Attributes:
        state: The last state.
        at_stop: Which coordinates rest on a stop that pushes (nv,).
        history: Largest |r| of the others, at every accepted state.
        iterations: Number of steps tried.
        converged: Whether r of the others is rounding and no direction leads further down.
        convex: Whether K was positive definite for the others all the way.
    """

    state: _State
    at_stop: NDArray[np.bool_]
    history: tuple[float, ...]
    iterations: int
    converged: bool
    convex: bool


class _Free(NamedTuple):
    """The coordinates of a state that no stop holds.

    Attributes:
        at_stop: Which coordinates a stop holds (nv,).
        indices: The others.
        spectrum: Eigenvalues and eigenvectors of the symmetric part of K for these.
        imbalance: Their largest |r|.
        balanced: Whether their r is rounding.
        flat: Eigenvalues up to this size are rounding.
        lowest: The lowest eigenvalue; inf if no coordinate is free.
    """

    at_stop: NDArray[np.bool_]
    indices: NDArray[np.intp]
    spectrum: tuple[Array, Array]
    imbalance: float
    balanced: bool
    flat: float
    lowest: float

    @classmethod
    def of(cls, state: State, lower: Array, upper: Array) -> _Free:
        q, torque, rounding = state.q, state.torque, state.rounding
        # a stop can push, but not pull
        at_stop = ((q <= lower) & (torque > rounding)) | ((q >= upper) & (torque < -rounding))
        indices = np.flatnonzero(~at_stop)
        spectrum = _spectrum(state.stiffness, indices)
        size = abs(torque[indices])
        return cls(
            at_stop=at_stop,
            indices=indices,
            spectrum=spectrum,
            imbalance=float(size.max(initial=0.0)),
            balanced=bool((size <= rounding[indices]).all()),
            flat=FLAT * abs(spectrum[0]).max(initial=0.0),
            lowest=float(spectrum[0].min(initial=math.inf)),
        )


def find_rest(
    evaluate: Callable[[Array, _State], _State], start: _State, lower: Array, upper: Array
) -> RestSearch[_State]:
    """Go from a state to where the body comes to rest.

    Args:
        evaluate: From a place (nv,) and a state near it to the state there. It raises a CdsmError
            where there is none.
        start: Where to begin.
        lower: Lower stops (nv,).
        upper: Upper stops (nv,).
    """
    state, radius = start, _FIRST
    free = _Free.of(state, lower, upper)
    history, convex = [free.imbalance], free.lowest > free.flat
    for iteration in range(_ATTEMPTS):
        done = free.balanced and free.lowest >= -free.flat
        q, expected = (state.q, 0.0) if done else _trial(state, free, lower, upper, radius)
        # balanced at a saddle, but only the stops bar the way down
        if done or (free.balanced and expected == 0.0):
            return RestSearch(state, free.at_stop, tuple(history), iteration, True, convex)
        if expected == 0.0:
            radius /= 4.0
            continue
        try:
            trial = evaluate(q, state)
            quality = work(state, trial) / expected
        except CdsmError:  # sites of a cable coincide there, say
            quality = -math.inf
        length = float(np.linalg.norm(q - state.q))
        if quality < _POOR:
            radius = length / 4.0
        elif quality > _GOOD and length > 0.8 * radius:
            radius = min(2.0 * radius, _WIDEST)
        if quality > _ACCEPTED:
            state, free = trial, _Free.of(trial, lower, upper)
            history.append(free.imbalance)
            convex = convex and free.lowest > free.flat
    return RestSearch(state, free.at_stop, tuple(history), _ATTEMPTS, False, convex)


def work(before: State, after: State) -> float:
    """∫ r·dq on the straight line from one state to another."""
    step = after.q - before.q
    change = step @ before.stiffness @ step - step @ after.stiffness @ step
    return float((before.torque + after.torque) @ step / 2.0 + change / 12.0)


def _trial(
    state: State, free: _Free, lower: Array, upper: Array, radius: float
) -> tuple[Array, float]:
    """The next place (nv,), and the work that the quadratic model predicts for it.

    The work is negative, or zero if no step goes down.
    """
    # what is left of r at a saddle is rounding, and must not decide which way to leave it
    torque, signs = (0.0 * state.torque, (1.0, -1.0)) if free.balanced else (state.torque, (1.0,))
    q, expected = state.q, 0.0
    for sign in signs:
        end = _descend(state, torque, free, lower, upper, radius, sign)
        change = end - state.q
        predicted = float(change @ torque + change @ state.stiffness @ change / 2.0)
        if predicted < expected * (1.0 + 1e-9):  # of two that predict the same the first
            q, expected = end, predicted
    return q, expected


def _spectrum(stiffness: Array, free: NDArray[np.intp]) -> tuple[Array, Array]:
    """Eigenvalues, rising, and eigenvectors of the symmetric part of K for some coordinates."""
    K = stiffness[np.ix_(free, free)]
    values, vectors = np.linalg.eigh((K + K.T) / 2.0)
    return values, vectors


def _descend(
    state: State,
    torque: Array,
    free: _Free,
    lower: Array,
    upper: Array,
    radius: float,
    sign: float,
) -> Array:
    """Down the quadratic model; where a coordinate meets its stop the path goes on without it."""
    q, indices, spectrum = state.q.copy(), free.indices, free.spectrum
    while indices.size and radius > 0.0:
        r = torque + state.stiffness @ (q - state.q)
        K = state.stiffness[np.ix_(indices, indices)]
        step = _step(r[indices], K, *spectrum, radius, sign)
        stop = np.where(step > 0.0, upper[indices], lower[indices])
        over = abs(step) > abs(stop - q[indices])
        part = np.divide(stop - q[indices], step, out=np.ones(step.size), where=over)
        first = over & (part == part.min())
        q[indices] = np.where(first, stop, q[indices] + part.min() * step)
        radius -= float(part.min() * np.linalg.norm(step))
        if not np.count_nonzero(first):
            break
        indices = indices[~first]
        spectrum = _spectrum(state.stiffness, indices)
    return q


def _step(
    torque: Array, stiffness: Array, values: Array, vectors: Array, radius: float, sign: float
) -> Array:
    """The step that goes down most within the radius: min r·p + ½ pᵀKp so that |p| <= radius.

    The sign decides between p and −p where r does not.
    """
    along = vectors.T @ torque
    size, largest = float(np.linalg.norm(along)), float(abs(values).max())
    if size == 0.0 and values[0] >= 0.0:
        return np.zeros(torque.size)
    if values[0] > FLAT * largest:
        newton = -np.linalg.solve(stiffness, torque)
        if np.linalg.norm(newton) <= radius:
            return np.asarray(newton)
    # p = −(K + σ)⁻¹ r with the σ that makes it as long as the radius, sought from the smallest σ
    # allowed: near a saddle it is larger by a rounding of σ only
    lifted = values + max(0.0, -values[0])
    least = FLAT * max(largest, size / radius)

    def excess(shift: float) -> float:
        return float(1.0 / radius - 1.0 / np.linalg.norm(along / (lifted + shift)))

    if size > 0.0 and excess(least) > 0.0:
        # the relative tolerance alone decides
        shift = brentq(excess, least, 2.0 * size / radius, xtol=1e-300, rtol=1e-6)
        return np.asarray(vectors @ (-along / (lifted + shift)))
    # r has no part along the lowest eigenvector, as on the ridge of a saddle
    inner = vectors @ (-along / (lifted + least))
    down = vectors[:, 0] * np.sign(vectors[abs(vectors[:, 0]).argmax(), 0])
    return np.asarray(inner + sign * math.sqrt(max(radius**2 - inner @ inner, 0.0)) * down)

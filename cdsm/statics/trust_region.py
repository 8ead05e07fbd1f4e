"""Where a body comes to rest: r(q) = 0 between stops, found downhill and finished by Newton.

The torque r that is out of balance need not be the gradient of a potential. A step p is judged by
the work ∫ r·dq along it, with K = ∂r/∂q to the fourth order of its length

    ½ (r₀ + r₁)·p + (pᵀK₀p − pᵀK₁p)/12,

and to the digit where the difference of two potentials would be rounding. Where r is a gradient
this is the trust-region method with the exact Hessian, which goes down and leaves saddles; near the
end every step is a full one of Newton's method, with K complete and not just its symmetric part.
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

_TINY = 1e-290
"""Where all of K is smaller than float64 has digits for, a shift to divide by all the same."""


class Point(Protocol):
    """What is known where the body has been."""

    @property
    def q(self) -> Array:
        """Where (nv,)."""

    @property
    def torque(self) -> Array:
        """Torque r that is out of balance (nv,)."""

    @property
    def stiffness(self) -> Array:
        """Its derivative K (nv, nv)."""

    @property
    def rounding(self) -> Array:
        """How much of r is rounding (nv,)."""


_Point = TypeVar("_Point", bound=Point)


@final
@dataclass(frozen=True)
class Settled(Generic[_Point]):
    """Where the search ended.

    Attributes:
        point: The last point.
        pressed: Which coordinates rest on a stop that pushes (nv,).
        history: Largest |r| of the others, at every point that was accepted.
        iterations: Number of steps tried.
        steady: Whether r of the others is rounding and no direction leads further down.
        convex: Whether K was positive definite for the others all the way.
    """

    point: _Point
    pressed: NDArray[np.bool_]
    history: tuple[float, ...]
    iterations: int
    steady: bool
    convex: bool


class _View(NamedTuple):
    """What is seen from a point.

    Attributes:
        pressed: Which coordinates a stop holds (nv,).
        free: The others.
        spectrum: Eigenvalues and eigenvectors of the symmetric part of K for these.
        still: Whether their r is rounding.
        flat: Eigenvalues up to this size are rounding.
    """

    pressed: NDArray[np.bool_]
    free: NDArray[np.intp]
    spectrum: tuple[Array, Array]
    still: bool
    flat: float

    @property
    def lowest(self) -> float:
        return float(self.spectrum[0].min(initial=math.inf))


def settle(
    evaluate: Callable[[Array, _Point], _Point], start: _Point, lower: Array, upper: Array
) -> Settled[_Point]:
    """Go from a point to where the body comes to rest.

    Args:
        evaluate: From a place (nv,) and a point near it to the point there. A CdsmError says that
            it does not exist.
        start: Where to begin.
        lower: Lower stops (nv,).
        upper: Upper stops (nv,).
    """
    here, radius = start, _FIRST
    view = _seen(here, lower, upper)
    history, convex = [_largest(here, view)], view.lowest > view.flat
    for iteration in range(_ATTEMPTS):
        done = view.still and view.lowest >= -view.flat
        q, expected = (here.q, 0.0) if done else _way_down(here, view, lower, upper, radius)
        if done or (view.still and expected == 0.0):  # or else only the stops are in the way
            return Settled(here, view.pressed, tuple(history), iteration, True, convex)
        if expected == 0.0:
            radius /= 4.0
            continue
        try:
            there = evaluate(q, here)
            quality = work(here, there) / expected
        except CdsmError:  # sites of a cable coincide there, say
            quality = -math.inf
        length = float(np.linalg.norm(q - here.q))
        if quality < 0.25:
            radius = length / 4.0
        elif quality > 0.75 and length > 0.8 * radius:
            radius = min(2.0 * radius, _WIDEST)
        if quality > 0.05:
            here, view = there, _seen(there, lower, upper)
            history.append(_largest(here, view))
            convex = convex and view.lowest > view.flat
    return Settled(here, view.pressed, tuple(history), _ATTEMPTS, False, convex)


def _seen(here: Point, lower: Array, upper: Array) -> _View:
    pressed = _pressed(here, lower, upper)
    free = np.flatnonzero(~pressed)
    spectrum = _spectrum(here.stiffness, free)
    still = bool((abs(here.torque[free]) <= here.rounding[free]).all())
    return _View(pressed, free, spectrum, still, FLAT * abs(spectrum[0]).max(initial=0.0))


def _largest(here: Point, view: _View) -> float:
    return float(abs(here.torque[view.free]).max(initial=0.0))


def _way_down(
    here: Point, view: _View, lower: Array, upper: Array, radius: float
) -> tuple[Array, float]:
    """Where to go next (nv,), and the work that the quadratic model promises for it, negative.

    Zero if it promises none.
    """
    # what is left of r at a saddle is rounding, and must not decide which way to leave it
    torque, signs = (0.0 * here.torque, (1.0, -1.0)) if view.still else (here.torque, (1.0,))
    q, expected = here.q, 0.0
    for sign in signs:
        end = _descend(here, torque, view.free, view.spectrum, lower, upper, radius, sign)
        change = end - here.q
        promise = float(change @ torque + change @ here.stiffness @ change / 2.0)
        if promise < expected * (1.0 + 1e-9):  # of two that promise the same the first
            q, expected = end, promise
    return q, expected


def _pressed(here: Point, lower: Array, upper: Array) -> NDArray[np.bool_]:
    """Which coordinates are held by a stop (nv,): it can push, but not pull."""
    q, torque = here.q, here.torque
    return ((q <= lower) & (torque > here.rounding)) | ((q >= upper) & (torque < -here.rounding))


def _spectrum(stiffness: Array, free: NDArray[np.intp]) -> tuple[Array, Array]:
    """Eigenvalues, rising, and eigenvectors of the symmetric part of K for some coordinates."""
    K = stiffness[np.ix_(free, free)]
    values, vectors = np.linalg.eigh((K + K.T) / 2.0)
    return values, vectors


def work(here: Point, there: Point) -> float:
    """∫ r·dq on the straight way from one point to another."""
    step = there.q - here.q
    change = step @ here.stiffness @ step - step @ there.stiffness @ step
    return float((here.torque + there.torque) @ step / 2.0 + change / 12.0)


def _descend(
    here: Point,
    torque: Array,
    free: NDArray[np.intp],
    spectrum: tuple[Array, Array],
    lower: Array,
    upper: Array,
    radius: float,
    sign: float,
) -> Array:
    """Where a way down the quadratic model leads that bends where it meets a stop."""
    q = here.q.copy()
    while free.size and radius > 0.0:
        slope = torque + here.stiffness @ (q - here.q)
        K = here.stiffness[np.ix_(free, free)]
        step = _step(slope[free], K, *spectrum, radius, sign)
        stop = np.where(step > 0.0, upper[free], lower[free])
        over = abs(step) > abs(stop - q[free])
        part = np.divide(stop - q[free], step, out=np.ones(step.size), where=over)
        first = over & (part == part.min())
        q[free] = np.where(first, stop, q[free] + part.min() * step)
        radius -= float(part.min() * np.linalg.norm(step))
        if not np.count_nonzero(first):
            break
        free = free[~first]
        spectrum = _spectrum(here.stiffness, free)
    return q


def _step(
    torque: Array, stiffness: Array, values: Array, vectors: Array, radius: float, sign: float
) -> Array:
    """The step that goes down most within the radius: min r·p + ½ pᵀKp so that |p| <= radius.

    The sign decides where r leaves it open whether to go one way or the other.
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
    least = max(FLAT * max(largest, size / radius), _TINY)

    def excess(shift: float) -> float:
        return float(1.0 / radius - 1.0 / np.linalg.norm(along / (lifted + shift)))

    if size > 0.0 and excess(least) > 0.0:
        shift = brentq(excess, least, 2.0 * size / radius, xtol=1e-300, rtol=1e-6)
        return np.asarray(vectors @ (-along / (lifted + shift)))
    # r has no part along the lowest eigenvector, as on the ridge of a saddle
    inner = vectors @ (-along / (lifted + least))
    down = vectors[:, 0] * np.sign(vectors[abs(vectors[:, 0]).argmax(), 0])
    return np.asarray(inner + sign * math.sqrt(max(radius**2 - inner @ inner, 0.0)) * down)

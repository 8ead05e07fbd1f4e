"""Find the equilibrium r(q) = 0 between stops: a trust-region search that ends with Newton steps.

The residual torque r need not be the gradient of a potential. So the search judges a step p not by
the change of a potential, but by the work ∫ r·dq along it. With K = ∂r/∂q, the work is

    ½ (r₀ + r₁)·p + (pᵀK₀p − pᵀK₁p)/12

to the fourth order of |p|. Subscripts 0 and 1 denote the start and the end of the step. The formula
stays accurate where the difference of two potentials would be rounding. If r is a gradient, this is
the trust-region method with the exact Hessian, which decreases the potential and leaves saddle
points. Near the end every step is a full Newton step with the complete K, not only its symmetric
part.

scipy's trust-exact does not fit: it has no stops, and it needs a potential, which a moment at the
tip does not have. BFGS takes thirty times as long to minimise the potential of a pure force
(tests/benchmarks/test_equilibrium_speed.py).
"""

from __future__ import annotations

import math
from typing import Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError
from cdsm.posture import Posture
from cdsm.support.values import Array

_ATTEMPTS = 200
"""Largest number of iterations. Arms with an equilibrium need up to 130, usually below 10."""

_FIRST, _WIDEST = 0.2, 0.5
"""Initial and largest trust-region radius [rad]. Longer steps might skip the nearest minimum."""

FLAT = 1e-12
"""Eigenvalues of K below this part of the largest one are rounding: the arm is neutral there."""

_POOR, _GOOD, _ACCEPTED = 0.25, 0.75, 0.05
"""Ratios of work to predicted work: the radius shrinks below the first, grows above the second, and
a step is accepted above the third (Nocedal and Wright, Numerical Optimization, 2006, alg. 4.1)."""


class Iterate(Protocol):
    """State of an arm at one posture, balanced or not, as :func:`find_rest` needs it."""

    @property
    def pose(self) -> Posture:
        """The posture."""

    @property
    def torque(self) -> Array:
        """Residual torque r minus the torque of :meth:`with_external_torque` (nv,) [N m]."""

    @property
    def rounding(self) -> Array:
        """Rounding error of the residual torque r (nv,) [N m]."""

    @property
    def stiffness(self) -> Array:
        """Derivative ∂r/∂q of the residual torque r (nv, nv) [N m/rad]."""

    def with_external_torque(self, torque: Array | float) -> Self:
        """Return this state with the attribute ``torque`` = r − the argument (nv,) [N m].

        A search for zero then finds r = the argument: the equilibrium of an arm on whose joints
        this torque also acts, and so holds back a part of the load.
        """


State = TypeVar("State", bound=Iterate)


class Loaded(Protocol[State]):
    """Loaded arm as :func:`find_rest` needs it: its state at any joint angles, and its stops."""

    def moved(self, q: Array, near: State) -> State:
        """Compute the state at joint angles ``q`` (nv,) [rad].

        The search for the tensions starts from ``near``, the state at a posture close by. Raises
        CableError if two sites coincide.
        """

    @property
    def stops(self) -> tuple[Array, Array]:
        """Lowest and highest joint angles, (nv,) [rad] each, at which stops end the motion."""


class RestSearch(NamedTuple, Generic[State]):
    """Result of :func:`find_rest`; free joints are those not at a stop."""

    state: State  # the last iterate
    at_stop: NDArray[np.bool_]  # which joints rest on a stop that pushes (nv,)
    history: tuple[float, ...]  # largest |torque| [N m] of free joints at every accepted iterate
    iterations: int  # number of steps tried
    converged: bool  # free joints are balanced, and no motion between the stops does negative work
    convex: bool  # whether K of the free joints was positive definite at every iterate


class _Free(NamedTuple):
    """Free joints of an iterate (no stop holds them), with their torques and eigenvalues of K."""

    at_stop: NDArray[np.bool_]  # which joints a stop holds (nv,)
    indices: NDArray[np.intp]  # indices of the free joints
    spectrum: tuple[Array, Array]  # eigenvalues and eigenvectors of K (symmetric part), free joints
    imbalance: float  # largest |torque| [N m] of a free joint
    balanced: bool  # whether the torques of all free joints are rounding
    flat: float  # eigenvalues up to this size are rounding
    lowest: float  # lowest eigenvalue; inf if no joint is free

    @classmethod
    def of(cls, state: Iterate, lower: Array, upper: Array) -> _Free:
        q, torque, rounding = state.pose.q, state.torque, state.rounding
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
    loaded: Loaded[State], start: State, holding: Array | float = 0.0
) -> RestSearch[State]:
    """Find the stable posture near ``start`` at which the residual torque r is ``holding``.

    ``holding`` is (nv,) [N m]; with 0 the posture is an equilibrium. A joint at a stop need not be
    balanced: the stop gives the missing torque.
    """
    stops = loaded.stops
    state, radius = start.with_external_torque(holding), _FIRST
    free = _Free.of(state, *stops)
    history, convex = [free.imbalance], free.lowest > free.flat
    for iteration in range(_ATTEMPTS):
        done = free.balanced and free.lowest >= -free.flat
        q, expected = (state.pose.q, 0.0) if done else _trial(state, free, stops, radius)
        # balanced at a saddle, and the stops bar every way down
        if done or (free.balanced and expected == 0.0):
            return RestSearch(state, free.at_stop, tuple(history), iteration, True, convex)
        if expected == 0.0:
            radius /= 4.0
            continue
        try:
            trial = loaded.moved(q, state).with_external_torque(holding)
            quality = work(state, trial) / expected
        except CdsmError:  # for example, two sites of a cable coincide
            quality = -math.inf
        length = float(np.linalg.norm(q - state.pose.q))
        if quality < _POOR:
            radius = length / 4.0
        elif quality > _GOOD and length > 0.8 * radius:
            radius = min(2.0 * radius, _WIDEST)
        if quality > _ACCEPTED:
            state, free = trial, _Free.of(trial, *stops)
            history.append(free.imbalance)
            convex = convex and free.lowest > free.flat
    return RestSearch(state, free.at_stop, tuple(history), _ATTEMPTS, False, convex)


def work(before: Iterate, after: Iterate) -> float:
    """Compute the work ∫ r·dq [J] of the residual torque from ``before`` straight to ``after``."""
    step = after.pose.q - before.pose.q
    change = step @ before.stiffness @ step - step @ after.stiffness @ step
    return float((before.torque + after.torque) @ step / 2.0 + change / 12.0)


def _trial(
    state: Iterate, free: _Free, stops: tuple[Array, Array], radius: float
) -> tuple[Array, float]:
    """Return the joint angles (nv,) to try next, and the predicted work [J] of the step to them.

    The angles are at most ``radius`` [rad] from ``state``. For a step p the quadratic model r·p +
    ½ pᵀKp predicts the work. It is 0 if no step between the stops decreases the model.
    """
    # at a saddle r is rounding and must not decide the way to leave it
    torque, signs = (0.0 * state.torque, (1.0, -1.0)) if free.balanced else (state.torque, (1.0,))
    q, expected = state.pose.q, 0.0
    for sign in signs:
        end = _descend(state, torque, free, stops, radius, sign)
        change = end - state.pose.q
        predicted = float(change @ torque + change @ state.stiffness @ change / 2.0)
        if predicted < expected * (1.0 + 1e-9):  # if equal, keep the first
            q, expected = end, predicted
    return q, expected


def _spectrum(stiffness: Array, free: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return eigenvalues (ascending) and eigenvectors of K's symmetric part, ``free`` joints only.

    ``stiffness`` is K (nv, nv), ``free`` has the n indices of these joints.
    """
    K = stiffness[np.ix_(free, free)]
    values, vectors = np.linalg.eigh((K + K.T) / 2.0)
    return values, vectors


def _descend(
    state: Iterate,
    torque: Array,
    free: _Free,
    stops: tuple[Array, Array],
    radius: float,
    sign: float,
) -> Array:
    """Return joint angles (nv,) that decrease the quadratic model r·p + ½ pᵀKp of the work.

    A joint that reaches its stop halts there, and the others go on. The path from ``state`` is at
    most ``radius`` [rad] long. ``torque`` is r at ``state``; if it is zero, ``sign`` (±1) chooses
    between the two opposite directions in which the model decreases.
    """
    (lower, upper), q, indices, spectrum = stops, state.pose.q.copy(), free.indices, free.spectrum
    while indices.size and radius > 0.0:
        r = torque + state.stiffness @ (q - state.pose.q)
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
    """Return the step p that minimises r·p + ½ pᵀKp with |p| ≤ ``radius``; r is ``torque``.

    ``values`` and ``vectors`` are the eigenvalues and eigenvectors of K. If r = 0, ``sign`` chooses
    between the minima p and −p.
    """
    along = vectors.T @ torque
    size, largest = float(np.linalg.norm(along)), float(abs(values).max())
    if size == 0.0 and values[0] >= 0.0:
        return np.zeros(torque.size)
    if values[0] > FLAT * largest:
        newton = -np.linalg.solve(stiffness, torque)
        if np.linalg.norm(newton) <= radius:
            return np.asarray(newton)
    # p = −(K + σ)⁻¹ r, with σ such that |p| is the radius. The search starts at the smallest σ
    # allowed: near a saddle the root is larger by rounding only.
    lifted = values + max(0.0, -values[0])
    least = FLAT * max(largest, size / radius)

    def excess(shift: float) -> float:
        return float(1.0 / radius - 1.0 / np.linalg.norm(along / (lifted + shift)))

    if size > 0.0 and excess(least) > 0.0:
        from scipy.optimize import brentq  # slow to import, and rarely needed

        # the relative tolerance alone decides
        shift = brentq(excess, least, 2.0 * size / radius, xtol=1e-300, rtol=1e-6)
        return np.asarray(vectors @ (-along / (lifted + shift)))
    # r has no component along the lowest eigenvector, as on the ridge of a saddle
    inner = vectors @ (-along / (lifted + least))
    down = vectors[:, 0] * np.sign(vectors[abs(vectors[:, 0]).argmax(), 0])
    return np.asarray(inner + sign * math.sqrt(max(radius**2 - inner @ inner, 0.0)) * down)

"""Equilibria of an arm whose cables slide in holes: K = ∂r/∂q is not symmetric there.

Where the symmetric part of K is positive definite, every motion costs work, and the searches of
:mod:`cdsm.statics.solve` find the equilibrium. Sliding cables can make it indefinite though nothing
is lost: a motion along which θᵀKθ < 0 turns the slip around in some hole, where the cable then
sticks, and resists. What holds on is the answer to the slow load. Moved slowly against an equal
damping c of all joints, c dq/dt = −r(q), the arm comes back while all eigenvalues of K have
positive real parts; then det K > 0, and the path of equilibria goes on in one way only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from cdsm.errors import CdsmError, EquilibriumError
from cdsm.readings import least_real_part
from cdsm.statics.solve import BALANCED, FAR, Balance, Point, continued, settle, stable_between
from cdsm.support.values import Array

_NEWTON = 30  # most steps of Newton's method; near an equilibrium it takes 3 to 6
_SHORTEST = 2.0**-10  # least part of a step
_EXACT = 1e-12  # |f| that ends Newton's method, over its scale
_DAMPED = 500  # most steps of a damped motion
_SYMMETRIC = 1e-6  # a K that is less skew, relative, is symmetric but for rounding

_REMEDY = (
    "Take more substeps, less friction, or a smaller load; without friction (friction=0) there is "
    "another answer."
)


def continued_sliding(f: Balance, guesses: Iterable[Array], before: Array) -> Point | None:
    """Find the stable equilibrium near the angles ``before`` (nv,), also where cables slide.

    It is that of :func:`~cdsm.statics.solve.continued`. Where there is none, and K is not
    symmetric, it is one at which all eigenvalues of K have positive real parts. The arm may snap
    through on the way to it: :func:`is_held_to` tells.
    """
    starts = [*guesses]
    found = continued(f, starts, before)
    if found is None:
        ends = (_newton(f, f.attempt(x), before) for x in starts)
        found = next((point for point in ends if point is not None), None)
    return found


def is_held_to(f: Balance, before: Array, there: Point) -> bool:
    """Return whether the arm is stable on the way from the angles ``before`` to an equilibrium."""

    def least(K: Array) -> float:
        return least_real_part(K)[0]

    try:
        return stable_between(lambda q: f(q / f.unit).state, before, there.state.pose.q, least)
    except CdsmError:  # such as where two sites coincide
        return False


def reached_without_snap(f: Balance, guesses: Iterable[Array], before: Array) -> Point | None:
    """Find the stable equilibrium near ``before`` (nv,) to which the arm does not snap, or None."""
    found = continued_sliding(f, guesses, before)
    return found if found is not None and is_held_to(f, before, found) else None


def settle_sliding(f: Balance, q: Array, reached: float, load: str) -> Point:
    """Find the stable equilibrium to which the arm comes from the angles q (nv,).

    Where work alone does not lead to one, and K is not symmetric, the arm moves slowly against
    damping. Raises EquilibriumError, which says that the part ``reached`` of ``load`` was borne.
    """
    try:
        return settle(f, q, reached, load)
    except EquilibriumError as error:
        start = f.attempt(q / f.unit)
        if start is None or not _is_skew(start):
            raise
        found = _damped(f, start)
        if found is not None:
            return found
        problem = f"{error.problem}; K_θ is not symmetric, since cables slide in their holes"
        parts = error.residual, error.load_factor, error.joint
        raise EquilibriumError(problem, *parts, _REMEDY) from None


def is_stable(point: Point) -> bool:
    """Return whether K of the joints off their stops has eigenvalues with positive real parts."""
    free = np.flatnonzero(~point.out)
    return not free.size or least_real_part(point.slope[np.ix_(free, free)])[0] > 0.0


def _is_skew(point: Point) -> bool:
    """Return whether K of the joints off their stops is not symmetric."""
    free = np.flatnonzero(~point.out)
    K = point.slope[np.ix_(free, free)]
    return bool(abs(K - K.T).max(initial=0.0) > _SYMMETRIC * abs(K).max(initial=0.0))


def _newton(f: Balance, here: Point | None, before: Array) -> Point | None:
    """Return a stable equilibrium with a skew K by Newton's method, near ``before``; or None."""
    for _ in range(_NEWTON):
        if here is None or here.off <= _EXACT:
            break
        there = _shortened(f, here, f.limited(here.x, -_solved(here.slope, here.value)))
        if there is None:
            break
        if abs(f.inside(there.x) * f.unit - before).max() > FAR:
            return None
        here = there
    if here is None or here.off > BALANCED or not _is_skew(here) or not is_stable(here):
        return None
    return here


def _damped(f: Balance, here: Point) -> Point | None:
    """Return where a motion against damping ends at a stable equilibrium; None if it does not.

    The steps of implicit Euler are longer the smaller |f| is, so the last ones are Newton's.
    """
    damping = f.k
    identity = np.eye(here.x.size)
    for _ in range(_DAMPED):
        if here.off <= _EXACT:
            break
        step = f.limited(here.x, -_solved(here.slope + damping * identity, here.value))
        there = f.attempt(here.x + step)
        if there is None:
            damping *= 4.0
            continue
        damping *= min(max(there.off / here.off, 0.1), 4.0)
        here = there
    return here if here.off <= BALANCED and is_stable(here) else None


def _shortened(f: Balance, here: Point, step: Array) -> Point | None:
    """Return the point after a step, or a part of it, at which |f| is smaller; or None."""
    part = 1.0
    size = float(np.linalg.norm(here.value))
    while part >= _SHORTEST:
        there = f.attempt(here.x + part * step)
        if there is not None and np.linalg.norm(there.value) < size:
            return there
        part /= 2.0
    return None


def _solved(K: Array, torque: Array) -> Array:
    """Solve K x = torque; x is not finite where K is singular."""
    try:
        return np.asarray(np.linalg.solve(K, torque))
    except np.linalg.LinAlgError:
        return np.full_like(torque, math.nan)

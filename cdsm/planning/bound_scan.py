"""Scan a fixed posture for stability over many lower bounds of tension, or many load factors.

A scan varies one number, which is called ``place`` below: the lower bound of all tensions [N], or
the load factor [-]. The argument ``at`` is a function of this number. It distributes the least
tensions and returns the stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Literal

import numpy as np

from cdsm.errors import ElasticityRangeError, InfeasibleTension, SolverError
from cdsm.manipulator import Manipulator
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

SAMPLES: Final = 96
"""Number of bounds or factors in a scan. A stable range narrower than one step is not seen."""

PRECISION: Final = 1e-12
"""Relative precision of a bound or factor that is found by bisection or root finding."""

_ABOVE: Final = 1.0 + 1e-9
"""Factor just above the low end of a law: rounding may put a tension just below its bound."""

Limit = Literal["buckling", "infeasible", "elasticity", "none"]

StiffnessAt = Callable[[float], Stiffness]
"""Function from a lower bound of tension [N], or a load factor [-], to the stiffness."""


def failure_at(at: StiffnessAt, place: float) -> Limit:
    """Return why the arm fails at the lower bound [N] or load factor [-] ``place``.

    The reason is ``"buckling"`` (K_θ is not positive definite), ``"infeasible"`` (no tensions
    balance the arm), ``"elasticity"`` (a tension is outside the domain of its law), or ``"none"``
    if the arm is stable. ``at(place)`` computes its stiffness.
    """
    try:
        return "none" if at(place).is_stable else "buckling"
    except (InfeasibleTension, SolverError):  # a solver may fail on the very edge
        return "infeasible"
    except ElasticityRangeError:
        return "elasticity"


def _balances(at: StiffnessAt, place: float) -> bool:
    """Return whether tensions within the domains of their laws balance the arm at ``place``."""
    return failure_at(at, place) in ("none", "buckling")


def tension_domain(arm: Manipulator) -> tuple[float, float]:
    """Return the range (low, high) [N] in which the lower bound of all tensions may lie.

    ``high`` is at most the maximum of every cable. The range is within the domain of the law of
    every position-controlled cable.
    """
    laws = [each.elasticity for each in arm.cables if each.control == "position"]
    low = max((each.low for each in laws), default=0.0) * _ABOVE
    ends = [*(each.high for each in laws), *(each.maximum for each in arm.cables)]
    return low, min(ends)


def last_true(true: Callable[[float], bool], a: float, b: float) -> tuple[float, float]:
    """Find by bisection where the condition ``true`` changes from True at a to False at b.

    Returns two numbers whose relative difference is :data:`PRECISION`. The condition is True at the
    first and False at the second.
    """
    nothing = PRECISION**2 * b  # a may be zero, and the condition false right above it
    while b - a > max(PRECISION * b, nothing):
        middle = (a + b) / 2.0
        a, b = (middle, b) if true(middle) else (a, middle)
    return a, b


def scan_end(at: StiffnessAt, low: float, highest: float) -> float:
    """Return where a scan of the lower bound of tension from ``low`` may end, at most ``highest``.

    All are in [N]. The scan ends where no tensions within the domains of their laws balance the
    arm. If tensions balance it at every bound, the scan ends where the terms of K_θ that grow with
    the tension outweigh all others: these terms alone decide whether the arm is stable beyond.
    """
    if math.isinf(highest):
        # At large bounds the tensions grow in proportion to the bound. The active part of K_θ
        # grows with them, and so does the passive part, by the strain of the wires. The smallest
        # eigenvalue of their sum decides the sign, at the latest where it equals the rest.
        far = 1e9
        growth = -math.inf
        highest = far
        if _balances(at, far):
            outer, K = at(far), at(low)
            growth, active = (
                float(np.linalg.eigvalsh((part + part.T) / 2.0)[0]) / far
                for part in (outer.joint, outer.active)
            )
            rest = float(np.linalg.norm(K.joint, 2) + np.linalg.norm(K.active, 2))
            # a passive part that grows faster may be small at first: then the active part decides
            slower = min(abs(growth), abs(active))
            highest = min(2.0 * rest / slower, far) if slower > 0.0 else far
        highest = max(highest, 2.0 * low)
        while growth < 0.0 and highest < far and _balances(at, highest) and at(highest).is_stable:
            highest *= 2.0  # the law may stiffen further
    return (
        highest
        if _balances(at, highest)
        else last_true(lambda b: b >= RANGES["tension"].low and _balances(at, b), low, highest)[0]
    )


def log_samples(low: float, high: float) -> Array:
    """Return lower bounds of tension (N,) from ``low`` to ``high`` [N], even on a log scale.

    The first bound is ``low``. All others are in the four decades below ``high``.
    """
    if high <= low:
        return np.array([low])
    return np.unique([low, *np.geomspace(max(low, 1e-4 * high), high, SAMPLES)])


def stable_ranges(
    at: StiffnessAt, low: float, high: float
) -> tuple[Array, Array, tuple[tuple[float, float], ...]]:
    """Scan lower bounds from ``low`` to ``high`` [N]; return bounds, margins and stable ranges.

    The margins (N,) [N m/rad] are the smallest eigenvalues of K_θ at the N bounds. In a stable
    range (low, high) [N] they are positive.
    """

    def margin(place: float) -> float:
        return at(place).margin

    places = log_samples(low, high)
    margins = np.array([margin(place) for place in places.tolist()])
    stable = np.concatenate([[False], margins > 0.0, [False]])
    edges = [
        float(sign_change(margin, places[i - 1], places[i]))
        if 0 < i < len(places)
        else float(places[0 if i == 0 else -1])
        for i in np.flatnonzero(stable[1:] != stable[:-1])
    ]
    return places, margins, tuple(zip(edges[::2], edges[1::2], strict=True))


def sign_change(f: Callable[[float], float], a: float, b: float) -> float:
    """Find the lower bound or load factor between a and b at which ``f`` changes its sign."""
    from scipy.optimize import brentq  # slow to import

    root: float = brentq(lambda x: f(float(x)), a, b, xtol=1e-300, rtol=PRECISION)
    return root

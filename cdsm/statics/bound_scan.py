"""Scan of a held posture over the lower bound of the tensions, or over a load factor.

A place is a lower bound [N] or a load factor; the stiffness there is that of the least tensions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Literal

import numpy as np
from scipy.optimize import brentq

from cdsm.errors import ElasticityRangeError, InfeasibleTension, SolverError
from cdsm.manipulator import Manipulator
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.validation import RANGES, Array

SAMPLES: Final = 96
"""Places that are evaluated; a stable range narrower than a step is not seen."""

PRECISION: Final = 1e-12
"""Relative precision of a place that is found between two others."""

_ABOVE: Final = 1.0 + 1e-9
"""The low end of a domain may be excluded; this far above it everything is defined."""

Limit = Literal["buckling", "infeasible", "elasticity", "none"]

StiffnessAt = Callable[[float], Stiffness]
"""The stiffness at a place."""


def failure_at(at: StiffnessAt, place: float) -> Limit:
    """Why the arm does not hold at a place; ``"none"`` if it holds."""
    try:
        return "none" if at(place).is_stable else "buckling"
    except (InfeasibleTension, SolverError):  # on the very edge a solver may find nothing either
        return "infeasible"
    except ElasticityRangeError:
        return "elasticity"


def _balances(at: StiffnessAt, place: float) -> bool:
    """Whether tensions balance the arm within the domains of the elasticities."""
    return failure_at(at, place) in ("none", "buckling")


def tension_domain(arm: Manipulator) -> tuple[float, float]:
    """Tensions [N] that all cables may carry, within the domains of their elasticities.

    Force-controlled cables do not use their elasticity.
    """
    domains = [each.elasticity.domain for each in arm.cables if each.control == "position"]
    low = max((each.low for each in domains), default=0.0) * _ABOVE
    ends = [*(each.high for each in domains), *(each.maximum for each in arm.cables)]
    return low, min(ends)


def last_true(true: Callable[[float], bool], a: float, b: float) -> tuple[float, float]:
    """The last place from a, where something is true, and the next to b, where it is not."""
    nothing = PRECISION**2 * b  # a may be zero, and true nowhere above
    while b - a > max(PRECISION * b, nothing):
        middle = (a + b) / 2.0
        a, b = (middle, b) if true(middle) else (a, middle)
    return a, b


def scan_end(at: StiffnessAt, low: float, highest: float) -> float:
    """The end of a scan of the lower bound from ``low`` on [N], at most ``highest``.

    It is where no tensions balance the arm within the domains of the elasticities. If they do at
    every bound, it is where the terms of K_θ that grow with the tension decide its sign.
    """
    if math.isinf(highest):
        # at large bounds tensions grow in proportion to the bound, and so do the active part and,
        # with the strain of the wires, the passive one: the smallest eigenvalue of their sum
        # decides at the latest where it equals the rest
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
            # a passive part that grows faster may be small before: then the active one decides
            slower = min(abs(growth), abs(active))
            highest = min(2.0 * rest / slower, far) if slower > 0.0 else far
        highest = max(highest, 2.0 * low)
        while growth < 0.0 and highest < far and _balances(at, highest) and at(highest).is_stable:
            highest *= 2.0  # an elasticity of the user's own may go on stiffening
    return (
        highest
        if _balances(at, highest)
        else last_true(lambda b: b >= RANGES["tension"].low and _balances(at, b), low, highest)[0]
    )


def log_samples(low: float, high: float) -> Array:
    """Bounds (N,) [N] from low to high, evenly spread on a logarithmic scale of four decades."""
    if high <= low:
        return np.array([low])
    return np.unique([low, *np.geomspace(max(low, 1e-4 * high), high, SAMPLES)])


def stable_ranges(
    at: StiffnessAt, low: float, high: float
) -> tuple[Array, Array, tuple[tuple[float, float], ...]]:
    """Bounds looked at (N,) [N], margin at each (N,) [N m/rad], and where the arm is stable."""

    def margin(place: float) -> float:
        return at(place).margin

    places = log_samples(low, high)
    margins = np.array([margin(place) for place in places.tolist()])
    edges, ends = [], []
    for i in range(len(places)):
        if margins[i] > 0.0 and (i == 0 or margins[i - 1] <= 0.0):
            edges.append(places[i] if i == 0 else sign_change(margin, places[i - 1], places[i]))
        if margins[i] > 0.0 and (i + 1 == len(places) or margins[i + 1] <= 0.0):
            last = i + 1 == len(places)
            ends.append(places[i] if last else sign_change(margin, places[i], places[i + 1]))
    return places, margins, tuple((float(a), float(b)) for a, b in zip(edges, ends, strict=True))


def sign_change(f: Callable[[float], float], a: float, b: float) -> float:
    """Where a function changes its sign between two places."""
    root: float = brentq(lambda x: f(float(x)), a, b, xtol=1e-300, rtol=PRECISION)
    return root

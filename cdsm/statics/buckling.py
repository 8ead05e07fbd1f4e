"""Buckling: tension or load makes the joint stiffness of a fixed posture singular.

The elasticity of the cables stiffens an arm. Their tension usually softens it (active part of
Eq. 16). With stiff cables the elasticity always outweighs the tension. With soft springs or long
leads (lead: the straight cable between its actuator and the base disk) there is a critical tension.
Above it K_θ is not positive definite and the arm buckles under any load. This module keeps the
posture fixed and takes the tensions of :func:`~cdsm.distribute_tension`.
:func:`~cdsm.equilibrium` computes where an arm with locked motors moves when it buckles.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.posture import Posture
from cdsm.statics.bound_scan import (
    SAMPLES,
    failure_at,
    last_true,
    scan_end,
    stable_ranges,
    tension_domain,
)
from cdsm.statics.buckling_results import CriticalLoad, CriticalTension
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import NO_WRENCH, bound, instance, wrench_vector
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_LARGEST_FACTOR: Final = 1e6
"""The search for a critical load doubles the load factor while it is below this number.

If the arm is stable under all factors tried, the last of which is above half of it, the critical
factor is infinite.
"""

_SHOWN: Final = 10.0  # largest load factor of the curve if the critical factor is infinite


def critical_tension(pose: Posture, wrench: ArrayLike = NO_WRENCH) -> CriticalTension:
    """Compute the lower bound F_min [N] of tension at which K_θ stops being positive definite.

    F_min is the lower bound of all cables. :func:`~cdsm.distribute_tension` computes the tensions,
    and :func:`~cdsm.stiffness` computes K_θ, of which the symmetric part is examined.

    Args:
        pose: The posture, which stays fixed.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].

    Raises:
        InvalidInput: ``wrench`` has the wrong shape or is not finite.
        InfeasibleTension: No tensions balance the arm.
        ElasticityRangeError: Even the least tensions are outside the domains of the elasticities.
    """
    arm = instance("pose", pose, Posture).arm
    W = wrench_vector("wrench", wrench)

    def at(minimum: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, minimum, wrench=W))

    low, highest = tension_domain(arm)
    at(low)  # raises the reason if no tensions balance the arm
    high = scan_end(at, low, highest)
    places, margins, stable = stable_ranges(at, low, high)
    buckles = [b for _, b in stable if b < high]
    if buckles:
        minimum = where = buckles[0]
    elif stable:
        minimum, where = math.inf, float(places[int(np.argmin(margins))])
    else:
        minimum = where = low
    K = at(where)
    return CriticalTension(
        posture=pose,
        wrench=W,
        minimum=minimum,
        mode=_mode(K),
        tension=K.tension,
        stable=stable,
        examined=(low, high),
        bounds=frozen(places),
        margins=frozen(margins),
    )


def critical_load(
    pose: Posture,
    wrench: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    *,
    carried: ArrayLike = NO_WRENCH,
) -> CriticalLoad:
    """Compute the factor λ up to which an arm at a fixed posture is stable under λ W + carried.

    Args:
        pose: The posture, which stays fixed. Tensions are distributed again for every load.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; not zero.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,).
        carried: Constant wrench (6,) at ``tool0`` that always acts, such as the weight of a tool.

    Raises:
        InvalidInput: ``wrench`` is zero; or ``wrench``, ``carried`` or a bound is invalid.
        InfeasibleTension: No tensions balance the arm under its own weight and ``carried``.
        ElasticityRangeError: A tension without the load is outside the domain of its elasticity.
    """
    count = len(instance("pose", pose, Posture).arm.cables)
    W = wrench_vector("wrench", wrench)
    always = wrench_vector("carried", carried)
    low, high = bound("minimum", minimum, count), bound("maximum", maximum, count)
    if not W.any():
        raise InvalidInput("wrench", "is zero, and so is any multiple of it; give a load.")

    @cache
    def at(factor: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, low, high, always + factor * W))

    factor, limit = 0.0, failure_at(at, 0.0)
    at(factor)  # raises the reason if no tensions balance the arm
    stable = [0.0]
    if limit == "none":
        end = 1e-3
        while end < _LARGEST_FACTOR and failure_at(at, end) == "none":
            stable.append(end)
            end *= 2.0
        if end < _LARGEST_FACTOR:
            # the doubling may have stepped over the first failure
            places = np.linspace(0.0, end, SAMPLES).tolist()
            first = next(i for i, place in enumerate(places) if failure_at(at, place) != "none")
            ends = places[first - 1], places[first]
            factor, beyond = last_true(lambda x: failure_at(at, x) == "none", *ends)
            stable = [*places[:first], factor]
            limit = failure_at(at, beyond)
        else:
            factor = math.inf
    K = at(min(factor, _LARGEST_FACTOR / 2.0))
    factors = [each for each in stable if each < _SHOWN or math.isfinite(factor)]
    return CriticalLoad(
        posture=pose,
        wrench=W,
        carried=always,
        factor=factor,
        limit=limit,
        mode=_mode(K),
        tension=K.tension,
        factors=frozen(np.array(factors)),
        margins=frozen(np.array([at(each).margin for each in factors])),
    )


def _mode(K: Stiffness) -> Array:
    """Return the buckling mode (nv,): the unit eigenvector of the smallest eigenvalue of K_θ.

    The sign makes its largest entry positive.
    """
    mode = K.critical_direction
    return frozen(mode * np.sign(mode[abs(mode).argmax()]))

"""Derivatives of segment tensions with respect to joint angles, for sticking and sliding cables.

Segment j of length l_j and unstrained length a_j has the tension T_j = f(ε_j), with the strain ε_j
= l_j/a_j − 1 and the law f of its wire. Let k = ∂T/∂l = EA/a and κ = −∂T/∂a = k (1 + ε). If the
joint angles change by δθ, and the length δa_j of wire slides into the segment, T_j changes by

    δT_j = k_j g_j·δθ − κ_j δa_j,   g_j = ∂l_j/∂θ.

No wire passes a hole in which the cable sticks. If the cable slides in a hole, the segments before
and after it belong to one block. No wire leaves a block, so Σ δa_j over its segments is zero.
:func:`~cdsm._former.chain_problem.chain_tangent` computes the δT_j of a block. Without friction,
each cable is one block: this gives the frictionless stiffness.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm._former.chain_problem import chain_tangent
from cdsm.posture import Posture
from cdsm.segments import STRAIGHT
from cdsm.support.values import Array, frozen

_ROUNDING = 1e-12  # a hole never slides if its |x_i| − y_i is below this part of the largest |x_i|
_SLACK = 1e-100  # tension [N] that replaces zero, since the kernel takes logarithms

Flags = NDArray[np.bool_]


def holding(pose: Posture) -> Flags:
    """Return in which holes a cable can stick (P,): those with friction where the cable bends."""
    segments = pose.segments
    return np.asarray((segments.chains.friction > 0.0) & (segments.wrap > STRAIGHT))


def tension_gradient(pose: Posture, tension: Array, sliding: Flags) -> Array:
    """Compute ∂T/∂θ (S, nv) [N/rad] of the segments at checked tensions T (S,) [N].

    ``sliding`` marks the holes (P,) in which the cable slides: there the larger tension is exp(μ φ)
    times the smaller. A cable always slides in holes in which it cannot stick; see :func:`holding`.
    Raises ElasticityRangeError if a tension is outside the domain of its law.
    """
    segments = pose.segments
    chains, laws, length = segments.chains, pose.arm._segment_laws, segments.lengths
    k = laws.stiffness(length, tension)
    # (1 + ε) of the wire: the spring in series is part of the length
    wire = length - laws.series * (tension - laws.rest)
    stretch = wire / laws.original_lengths(length, tension)
    start = chains.start
    forced = np.where(k[start[:-1]] == 0.0, tension[start[:-1]], np.nan)
    with np.errstate(divide="ignore"):  # a motor that holds the tension: k = 0, and nothing follows
        compliance = np.where(k > 0.0, 1.0 / (k * stretch), 0.0)
    slides = np.zeros(length.size, dtype=np.bool_)
    slides[chains.hole] = sliding | ~holding(pose)
    friction = np.zeros_like(segments.length_jacobian)
    friction[chains.hole] = chains.friction[:, None] * segments.wrap_jacobian
    T = np.where(tension > 0.0, tension, _SLACK)
    gradient = segments.length_jacobian
    return frozen(chain_tangent(start, forced, stretch, compliance, T, slides, gradient, friction))


def first_order_loads(pose: Posture, tension: Array, gradient: Array, motion: Array) -> Array:
    """Compute the load W_i (P,) [N] of :func:`~cdsm.breakaway` in each hole; inf: never.

    ``tension`` is T (S,) [N], ``gradient`` ∂T/∂θ (S, nv) [N/rad] while all cables stick, ``motion``
    dθ/dW (nv,) [rad/N].
    """
    segments = pose.segments
    chains, slack = segments.chains, tension == 0.0
    relative = (gradient @ motion) / np.where(slack, 1.0, tension)
    change = abs(relative[chains.hole + 1] - relative[chains.hole])
    rate = change - chains.friction * (segments.wrap_jacobian @ motion)
    # a slack cable holds nothing: any pull moves it
    grip = np.where(slack[chains.hole], 0.0, segments.grip)
    least = _ROUNDING * float(change.max(initial=0.0))
    loads = np.divide(grip, rate, out=np.full(rate.size, math.inf), where=rate > least)
    return np.where(holding(pose), loads, math.inf)

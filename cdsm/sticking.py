"""How the tensions of the segments of cables follow the joints, where holes hold or slide.

A segment of length l and natural length a has the tension T = f(l/a − 1). With k = ∂T/∂l = EA/a and
κ = −∂T/∂a = k (1 + ε), a motion δθ and a flow δa of wire change it by

    δT_j = k_j g_j·δθ − κ_j δa_j,   g_j = ∂l_j/∂θ.

A hole that holds lets nothing through. Segments that sliding holes join are a block: in it
Σ δa_j = 0, and δT_j follows from :func:`~cdsm.kernels.chain_problem.chain_tangent`. The torque of
the cables changes by Σ_j T_j H_j δθ + Σ_j g_j δT_j. If each hole holds, δT_j = k_j g_j·δθ: each
segment is a spring of its own. If no hole has friction, each cable is one block: the frictionless
stiffness.

A force of 1 N at the tip of a stuck arm moves the joints by θ̇, and pulls at hole i, between the
segments j and j + 1. To first order it begins to slide under the load

    W_i = μ φ_i/(|x_i| − y_i),   x_i = (∂ln T_{j+1}/∂θ − ∂ln T_j/∂θ)·θ̇,   y_i = μ ∂φ_i/∂θ·θ̇.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm.kernels.breakaway import ROUNDING
from cdsm.kernels.chain_problem import chain_tangent
from cdsm.kernels.chains import STRAIGHT
from cdsm.posture import Posture
from cdsm.support.values import Array, frozen

_SLACK = 1e-100
"""Tension [N] that stands for zero, since the kernel takes logarithms: a spring without force."""

Flags = NDArray[np.bool_]


def holding(pose: Posture) -> Flags:
    """Return which holes (P,) can hold a cable: those with friction at which the cable turns."""
    segments = pose.segments
    return np.asarray((segments.chains.friction > 0.0) & (segments.wrap > STRAIGHT))


def tension_gradient(pose: Posture, tension: Array, sliding: Flags) -> Array:
    """Compute ∂T/∂θ (S, nv) [N/rad] of the segments at checked tensions T (S,) [N].

    Args:
        pose: The posture.
        tension: T of each segment, within the domain of its law. At holes that slide, the larger
            tension is exp(μ φ) times the smaller.
        sliding: Whether each hole (P,) slides. Holes that cannot hold always do.

    Raises:
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
    """
    model, segments = pose.arm._model, pose.segments
    chains, laws, length = segments.chains, model.segment_laws, segments.lengths
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
    """Compute the loads W_i (P,) [N] at which the holes of a stuck arm begin to slide; inf: never.

    Args:
        pose: The posture.
        tension: T (S,) [N].
        gradient: ∂T/∂θ (S, nv) [N/rad] of the stuck arm.
        motion: θ̇ (nv,) [rad/N].
    """
    segments = pose.segments
    chains, slack = segments.chains, tension == 0.0
    relative = (gradient @ motion) / np.where(slack, 1.0, tension)
    pull = abs(relative[chains.hole + 1] - relative[chains.hole])
    rate = pull - chains.friction * (segments.wrap_jacobian @ motion)
    # a slack cable holds nothing: any pull moves it
    grip = np.where(slack[chains.hole], 0.0, chains.friction * segments.wrap)
    least = ROUNDING * float(pull.max(initial=0.0))
    loads = np.divide(grip, rate, out=np.full(rate.size, math.inf), where=rate > least)
    return np.where(holding(pose), loads, math.inf)

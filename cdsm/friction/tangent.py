"""How the tensions of the segments of cables follow the joints, where holes hold or slide.

A segment of length l and natural length a has the tension T = f(l/a − 1). With k = ∂T/∂l = EA/a and
κ = −(∂T/∂a) = k (1 + ε), a motion δθ and a flow δa of wire change it by

    δT_j = k_j g_j·δθ − κ_j δa_j,   g_j = ∂l_j/∂θ.

A hole that holds lets nothing through. Segments that sliding holes join are a block. In a block
Σ δa_j = 0, and the tensions keep the ratios r_j = T_j/T_a = exp ρ_j to those of its first segment
a, with ρ_j = Σ σ_i μ_i φ_i over the holes between. σ = ±1 says which side pulls. Therefore

    δT_a = Σ_j (k_j g_j·δθ − T_j δρ_j)/κ_j / Σ_j (r_j/κ_j),   δT_j = r_j δT_a + T_j δρ_j,

and δT_a = 0 if a is the first segment of a force-controlled cable. The torque of the cables changes
by Σ_j T_j H_j δθ + Σ_j g_j δT_j. If each hole holds, δT_j = k_j g_j·δθ: each segment is a spring of
its own. If no hole has friction, each cable is one block: the frictionless stiffness.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdsm.kernels.chains import STRAIGHT
from cdsm.posture import Posture
from cdsm.support.values import Array, frozen

Signs = NDArray[np.int8]


def holding(pose: Posture) -> NDArray[np.bool_]:
    """Return which holes (P,) can hold a cable: those with friction at which the cable turns."""
    segments = pose.segments
    return np.asarray((segments.chains.friction > 0.0) & (segments.wrap > STRAIGHT))


def tension_gradient(pose: Posture, tension: Array, sliding: Signs) -> Array:
    """Compute ∂T/∂θ (S, nv) [N/rad] of the segments at checked tensions T (S,) [N].

    Args:
        pose: The posture.
        tension: T of each segment, within the domain of its law.
        sliding: σ of each hole (P,): 0 where it holds; else the sign of ln T_(j+1) − ln T_j. Holes
            that cannot hold always slide.

    Raises:
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
    """
    model, segments = pose.arm._model, pose.segments
    chains, laws = segments.chains, model.segment_laws
    length, g = segments.lengths, segments.length_jacobian
    k = laws.stiffness(length, tension)
    # a/l of the wire, 1/(1 + ε): the spring in series is part of l
    wire = length - laws.series * (tension - laws.rest)
    natural = laws.original_lengths(length, tension)
    slack = np.divide(natural, wire, out=np.ones_like(length), where=wire != 0.0)

    joined = (sliding != 0) | ~holding(pose)
    before = chains.hole[joined] + 1  # segments that continue the block of the segment before them
    starts = np.ones(length.size, dtype=np.bool_)
    starts[before] = False
    block, first = np.cumsum(starts) - 1, np.flatnonzero(starts)

    grip = sliding[joined] * chains.friction[joined]
    step, step_gradient = np.zeros(length.size), np.zeros_like(g)
    step[before] = grip * segments.wrap[joined]
    step_gradient[before] = grip[:, None] * segments.wrap_jacobian[joined]
    ratio = np.exp(_within(step, block, first))
    pull = tension[:, None] * _within(step_gradient, block, first)  # T_j ∂ρ_j/∂θ

    with np.errstate(divide="ignore", invalid="ignore"):  # a motor that holds force: k = 0
        soft = slack / k
        driven = np.add.reduceat(slack[:, None] * g - soft[:, None] * pull, first, axis=0)
        common = driven / np.add.reduceat(ratio * soft, first)[:, None]
    common[block[k == 0.0]] = 0.0
    return frozen(ratio[:, None] * common[block] + pull)


def _within(values: Array, block: NDArray[np.intp], first: NDArray[np.intp]) -> Array:
    """Add values (S, …) up along each block; those of the first segments are zero."""
    total = np.cumsum(values, axis=0)
    return np.asarray(total - total[first][block])

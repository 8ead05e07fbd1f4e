"""Stiffness of an arm whose cables stick, and the load at which one slides.

All segments of a cable start with its tension, as after shaking the arm; the motors are locked.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Final, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from cdsm.friction.capstan import ChainProblem, ChainState, chain_tangent
from cdsm.posture import Posture
from cdsm.segments import STRAIGHT
from cdsm.stiffness_matrix import Friction, Stiffness, assemble, checked_tension
from cdsm.support.format import coordinates
from cdsm.support.result import Result, unit
from cdsm.support.validation import SMALLEST, Direction, unit_direction
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

_NEVER: Final = 1e-12  # a hole never slides if its |x_i| − y_i is below this part of all |x_i|
_STUCK: Final = 1e9  # ratio of tensions that no hole reaches

Flags = NDArray[np.bool_]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Breakaway(Result):
    """Load at which the first cable of a stuck arm begins to slide, and its hole.

    Attributes:
        stiffness: :func:`stuck_stiffness`, which a weight below ``load`` measures.
        direction: Unit direction u (3,) of the force, base axes.
        load: The breakaway load [N], in addition to the wrench of ``stiffness``. It is 0 if no
            cable can stick, inf if the force moves no joint.
        hole_loads: First-order load at which the cable begins to slide in each hole (P,) [N]; inf
            for holes in which it never begins to slide, or cannot stick.
        cable: Name of the cable that slides first; empty if ``load`` is 0 or inf.
        site: Number of its hole among the sites of ``cable``, from 1; 0 if ``load`` is 0 or inf.
        link: Name of the link that has this hole; empty if ``load`` is 0 or inf.
    """

    _headline = "load"

    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "axis"))
    load: float = field(metadata=unit("N"))
    hole_loads: Array = field(metadata=unit("N", "hole"))
    cable: str = field(metadata=unit("1"))
    site: int = field(metadata=unit("1"))
    link: str = field(metadata=unit("1"))

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    def __str__(self) -> str:
        said = f"breakaway along {coordinates(self.direction)}: {self.load:.4g} N"
        where = f", first at site {self.site} of {self.cable} ({self.link})"
        return said + where * bool(self.cable)


def stuck_stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Stiffness:
    """Compute the stiffness while all cables stick: weights below :func:`breakaway` measure it.

    Each segment j between two holes is a separate spring k_j = EA(F)/a_j with the length l_j and
    the rest length a_j: K_θ = Σ_j (F H_j + k_j g_j g_jᵀ) + gravity + load, with g_j = ∂l_j/∂θ and
    H_j = ∂²l_j/∂θ². If the cable sticks in its first hole, lead, series spring and force-controlled
    motor have no effect. A cable cannot stick in a hole without friction, or through which it goes
    straight: the segments on both sides are one spring. Without friction, K_θ is that of
    :func:`~cdsm.stiffness`; with it, larger: the difference is positive semidefinite.

    :func:`~cdsm.stiffness` explains the arguments and the errors.
    """
    F, W = checked_tension(pose, tension, wrench)
    none = np.zeros(pose.segments.wrap.size, dtype=np.bool_)
    given = tension if isinstance(tension, Tension) else None
    return assemble_segments(pose, F[pose.segments.chains.cable], none, W, "stuck", given)


def breakaway(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: ArrayLike | None = None,
) -> Breakaway:
    """Compute the force along a direction at which the first cable begins to slide in a hole.

    A weight below this load measures :func:`stuck_stiffness`. The cable begins to slide in hole i,
    between segments j and j + 1 with the tensions T, where |ln T_{j+1} − ln T_j| = μ φ_i, with the
    friction coefficient μ and the wrap angle φ_i. The stuck arm is at θ + W dθ/dW under the load W,
    and dθ/dW = K_θ⁻¹ J_vᵀ u is taken at half the first-order load; on random arms the result is
    within 1e-4 of a simulated one up to μ = 0.3. To first order it is the smallest of

        W_i = μ φ_i/(|x_i| − y_i),   x_i = d(ln T_{j+1} − ln T_j)/dW,   y_i = μ dφ_i/dW.

    Args:
        pose: The posture.
        tension: F (C,) [N], as for :func:`~cdsm.stiffness`; a residual torque is kept as a load.
        direction: u (3,) of the force in base axes, any length, or an axis such as ``"-z"``.
        wrench: W (6,) at ``tool0`` before the force acts; only with your own tensions.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`, or ``direction`` is not a direction.
        ElasticityRangeError: A tension leaves the domain of its cable's elasticity.
        SingularStiffness: The stuck arm is about to buckle.
    """
    u = unit_direction("direction", direction)
    K, segments = stuck_stiffness(pose, tension, wrench), pose.segments
    chains, loads = segments.chains, np.full(segments.wrap.size, math.inf)
    sticks = can_stick(pose)
    if math.isfinite(K.along(u)):
        assert K.tension_gradient is not None
        motion = np.asarray(np.linalg.solve(K.joint, u @ pose.jacobian[:3]), np.float64)
        F, slack = K.tension[chains.cable], K.tension[chains.cable] == 0.0
        relative = K.tension_gradient @ motion / np.where(slack, 1.0, F)
        change = abs(relative[chains.hole + 1] - relative[chains.hole])
        rate = change - chains.friction * (segments.wrap_jacobian @ motion)
        # a slack cable holds nothing: any pull moves it
        exponent = np.where(slack[chains.hole], 0.0, segments.grip)
        slides = sticks & (rate > _NEVER * change.max(initial=0.0))
        loads[slides] = exponent[slides] / rate[slides]
    load = float(loads.min()) if sticks.any() else 0.0
    cable, site, link = "", 0, ""
    if 0.0 < load < math.inf:
        load, hole = _first_slip(K, u, load, motion)
        first, site = pose.arm.cables[chains.cable[chains.hole[hole]]], int(chains.site[hole]) + 1
        cable, link = first.name, first.sites[site - 1].link
    where: Any = {"cable": cable, "site": site, "link": link}
    return Breakaway(stiffness=K, direction=u, load=load, hole_loads=frozen(loads), **where)


def _first_slip(K: Stiffness, u: Array, load: float, motion: Array) -> tuple[float, int]:
    """Return the load [N] along u (3,) at which a stuck arm first slides, and the hole.

    ``load`` and ``motion`` (nv,) [rad/N] are those of first order.
    """
    pose, arm = K.posture, K.posture.arm
    segments, forced = pose.segments, ~arm.cables.position_controlled
    chains, T = segments.chains, K.tension[segments.chains.cable]
    problem = ChainProblem(arm.cables, chains.start, K.tension, arm.original_length == "unstrained")
    wire, ratio = problem.rest_lengths(segments.lengths, T), np.ones(T.size)
    ratio[chains.hole[can_stick(pose)]] = _STUCK

    def at(load: float, motion: Array) -> tuple[Posture, Array]:
        moved = arm.at(pose.q + load * motion, check_limits=False)
        held = np.where(forced, K.tension, np.nan)
        return moved, problem.settle(moved.segments.lengths, wire, ratio, held, T).tension

    def excess(load: float) -> Array:
        moved, T = at(load, motion)
        rise = np.diff(np.log(np.maximum(T, SMALLEST)))[chains.hole]
        return np.where(can_stick(pose), abs(rise) - moved.segments.grip, -np.inf)

    half, T = at(load / 2.0, motion)
    wrench = K.wrench + load / 2.0 * np.append(u, np.zeros(3))
    none = np.zeros(chains.hole.size, dtype=np.bool_)
    there = assemble_segments(half, T, none, wrench, "stuck")
    motion = np.asarray(np.linalg.solve(there.joint, u @ half.jacobian[:3]), np.float64)
    if excess(2.0 * load).max() > 0.0:
        load = float(brentq(lambda load: excess(load).max(), 0.0, 2.0 * load, rtol=1e-6))
    return load, int(excess(load).argmax())


def can_stick(pose: Posture) -> Flags:
    """Return in which holes a cable can stick (P,): those with friction where the cable bends."""
    segments = pose.segments
    return np.asarray((segments.chains.friction > 0.0) & (segments.wrap > STRAIGHT))


def assemble_segments(
    pose: Posture,
    tension: Array,
    sliding: Flags,
    wrench: Array,
    friction: Friction,
    distribution: Tension | None = None,
) -> Stiffness:
    """Compute the stiffness from checked tensions T (S,) [N] of the segments.

    ``sliding`` (P,) marks the holes in which cables slide. Raises ElasticityRangeError if a tension
    is outside the domain of its law.
    """
    segments, laws = pose.segments, pose.segments.chains.laws
    chains, length = segments.chains, segments.lengths
    k = laws.stiffness(length, tension)
    # (1 + ε) of the wire: the spring in series is part of the length
    rest_length = laws.original_lengths(length, tension)
    stretch = (length - laws.series * (tension - laws.rest)) / rest_length
    compliance = np.divide(1.0, k * stretch, out=np.zeros_like(k), where=k > 0.0)
    slides = np.zeros(length.size, dtype=np.bool_)
    slides[chains.hole] = sliding | ~can_stick(pose)
    turning = np.zeros_like(segments.length_jacobian)
    turning[chains.hole] = chains.friction[:, None] * segments.wrap_jacobian
    T = np.where(tension > 0.0, tension, 1e-100)  # a slack segment would have no weight
    state = ChainState(T, rest_length, np.zeros_like(T), slides, stretch, compliance)
    forced = k[chains.start[:-1]] == 0.0
    gradient = chain_tangent(chains.start, forced, state, segments.length_jacobian, turning)
    passive, active = segments.length_jacobian.T @ gradient, segments.active(tension)
    if friction == "stuck":
        passive = (passive + passive.T) / 2.0  # symmetric but for rounding
    F = frozen(tension[chains.start[:-1]])
    k = pose.arm._laws.stiffness(pose.cable_lengths, F)
    frictionless = assemble(pose, F, wrench, k, distribution)
    return replace(
        frictionless,
        active=active,
        passive=frozen(passive),
        joint=frozen(
            active + passive + frictionless.gravity + frictionless.load + frictionless.springs
        ),
        friction=friction,
        segment_tension=frozen(tension),
        tension_gradient=frozen(gradient),
    )

"""Breakaway: the load at which the first cable of a stuck arm begins to slide in a hole.

To first order, the cable begins to slide in hole i under the load W_i
(:mod:`cdsm.stiffness_matrix.sticking`). Newton's method starts at the smallest W_i. It finds the
load at which the arm, with all its cables stuck, reaches the friction bound of a hole: there the
larger one of the tensions on both sides is exp(μ φ) times the smaller one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import EquilibriumError, InvalidInput
from cdsm.friction.chain_problem import ChainProblem
from cdsm.friction.stuck import assemble_segments, stuck_stiffness
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.sticking import SLACK, first_order_loads, holding
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import coordinates
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension

_UNREACHED = 1e300  # ratio of tensions that no hole reaches: with it cables stick under every load
_REACHED = 1e-9  # relative excess over the friction bound of a hole that counts as rounding

_ITERATIONS = 50
"""Largest number of Newton steps; usually 3 to 5, and more if another hole slides first."""

_CONVERGED = 1e-10
"""Relative change of the load that ends the search: the remaining error is its square."""

_ROUNDING = 1e-5
"""Newton's method has ended if the relative changes of the load are at most this and no longer get
smaller. Rounding is large because tensions are EA times a difference of lengths, and a hole through
which the cable goes almost straight has almost no friction."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Breakaway(ReadOnlyState):
    """Load at which the first cable of a stuck arm begins to slide, and the hole where it does.

    Attributes:
        stiffness: Stiffness of the stuck arm, which a weight below ``load`` measures; see
            :func:`stuck_stiffness`.
        direction: Unit direction u (3,) of the force, base axes.
        load: The breakaway load [N], in addition to the wrench of ``stiffness``; 0 without
            friction; inf if no cable ever slides because the force moves no joint.
        first_order: The breakaway load in closed form [N], to first order in the load.
        hole_loads: First-order load at which the cable begins to slide in each hole (P,) [N]; inf
            for holes in which it never begins to slide, or cannot stick.
        cable: Name of the cable that slides first; None if the load is 0 or inf.
        site: Number of the hole where it slides first, among the sites of ``cable``, from 1; None
            if ``cable`` is None.
        link: Name of the link that has this hole; None if ``cable`` is None.
    """

    stiffness: Stiffness
    direction: Array
    load: float
    first_order: float
    hole_loads: Array
    cable: str | None
    site: int | None
    link: str | None

    def __repr__(self) -> str:
        return f"<Breakaway at {self.load:.4g} N along {coordinates(self.direction)}>"

    def __str__(self) -> str:
        said = f"breakaway along {coordinates(self.direction)}: {self.load:.4g} N"
        if self.cable is None:
            return said
        return f"{said}, first at site {self.site} of {self.cable} ({self.link})"


def breakaway(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: ArrayLike | None = None,
) -> Breakaway:
    """Compute the force along a direction at which the first cable begins to slide in a hole.

    All segments of a cable start with its tension, as after shaking the arm, and motors are locked.
    A weight below this load measures :func:`stuck_stiffness`.

    Args:
        pose: The posture.
        tension: A :class:`~cdsm.Tension` or your own tensions (C,) [N], as for
            :func:`~cdsm.stiffness`. If they do not balance the arm, the residual torque is kept as
            a constant load.
        direction: u (3,) of the force in base axes, any length, or an axis such as ``"-z"``.
        wrench: W (6,) at ``tool0`` in base axes before the force acts: force [N], then moment
            [N m]; only with your own tensions.

    Raises:
        InvalidInput: An argument is invalid for :func:`~cdsm.stiffness`, or ``direction`` is not a
            direction.
        ElasticityRangeError: A tension leaves the domain of its cable's elasticity.
        SingularStiffness: The stuck arm is about to buckle.
        EquilibriumError: The stuck arm buckles below the load found.
    """
    u = unit_direction("direction", direction)
    K = stuck_stiffness(pose, tension, wrench)
    loads, motion = hole_loads(K, u)
    first = float(loads.min()) if holding(pose).any() else 0.0
    load = first
    where: tuple[str | None, int | None, str | None] = (None, None, None)
    if 0.0 < first < math.inf:
        load, hole = _reached(K, u, motion)
    if 0.0 < load < math.inf:
        chains = pose.segments.chains
        cable, site = pose.arm.cables[chains.cable[chains.hole[hole]]], int(chains.site[hole])
        where = cable.name, site + 1, cable.sites[site].link
    return Breakaway(
        stiffness=K,
        direction=u,
        load=load,
        first_order=first,
        hole_loads=frozen(loads),
        cable=where[0],
        site=where[1],
        link=where[2],
    )


def hole_loads(K: Stiffness, u: Array) -> tuple[Array, Array]:
    """Compute the first-order load W_i (P,) [N] at which the cable begins to slide in each hole.

    Also returns the joint motion per force dθ/dW (nv,) [rad/N]. ``K`` is the stuck stiffness, ``u``
    (3,) the unit direction of the force.
    """
    T, gradient = segment_state(K)
    motion = K._along(u)[1]
    return first_order_loads(K.posture, T, gradient, motion), motion


def _reached(K: Stiffness, u: Array, motion: Array) -> tuple[float, int]:
    """Return the least load [N] at which the stuck arm reaches the friction bound of a hole.

    Also returns the index of this hole. ``motion`` (nv,) is dθ/dW [rad/N] for a force along ``u``
    (3,). Newton's method for joint angles and load starts at the first-order result. If another
    hole is beyond its friction bound at the solution, the search is repeated for that hole. Raises
    EquilibriumError if it does not converge.
    """
    pose, arm = K.posture, K.posture.arm
    chains, sticks = pose.segments.chains, holding(pose)
    problem = ChainProblem(arm.cables, chains.start, K.tension, arm.original_length == "unstrained")
    T, gradient = segment_state(K)
    natural = problem.natural(pose.segments.lengths, T)
    forced = ~arm.cables.position_controlled
    ratio, none = np.ones(T.size), np.zeros(sticks.size, dtype=np.bool_)
    ratio[chains.hole[sticks]] = _UNREACHED
    load, hole = _first(pose, T, gradient @ motion, motion)
    if math.isinf(load):
        return load, hole
    q, T, last = pose.q + load * motion, T + load * (gradient @ motion), math.inf
    for _ in range(_ITERATIONS):
        moved = arm.at(q, check_limits=False)
        lengths, wrap = moved.segments.lengths, moved.segments.wrap
        settled = problem.settle(lengths, natural, ratio, np.where(forced, K.tension, np.nan), T)
        T = np.maximum(settled.tension, SLACK)
        wrench = K.wrench.copy()
        wrench[:3] += load * u
        now = assemble_segments(moved, frozen(T), none, frozen(wrench), "stuck")
        log_ratio = np.log(T[chains.hole + 1] / T[chains.hole])
        beyond = np.where(sticks, abs(log_ratio) - moved.segments.grip, -1.0)
        _, gradient = segment_state(now)
        relative = gradient / T[:, None]
        slope = (
            np.sign(log_ratio[hole])
            * (relative[chains.hole[hole] + 1] - relative[chains.hole[hole]])
            - chains.friction[hole] * moved.segments.wrap_jacobian[hole]
        )
        torque = u @ moved.jacobian[:3]
        bordered = np.block([[now.joint, -torque[:, None]], [slope[None], np.zeros((1, 1))]])
        residual = now.residual - K.residual
        step = np.linalg.solve(bordered, -np.append(residual, beyond[hole]))
        q, T, load = q + step[:-1], T + gradient @ step[:-1], load + float(step[-1])
        change, last = last, abs(step[-1]) / load
        if last <= _CONVERGED or change / 2.0 <= last <= _ROUNDING:
            worst = int(beyond.argmax())
            if beyond[worst] <= (_REACHED + 4.0 * last) * chains.friction[worst] * wrap[worst]:
                return load, hole
            hole, last = worst, math.inf
    raise EquilibriumError(
        f"the stuck arm has no equilibrium up to a load of {load:.4g} N",
        residual,
        0.0,
        arm.joint_names[int(abs(residual).argmax())],
    )


def _first(pose: Posture, T: Array, growth: Array, motion: Array) -> tuple[float, int]:
    """Find the least load [N] at which the tensions T + load · growth reach a friction bound.

    T (S,) are in [N], ``growth`` (S,) is dT/dW [-] and ``motion`` (nv,) dθ/dW [rad/N]. Returns the
    load and the index of the hole that reaches its bound.
    """
    chains, ratio = pose.segments.chains, np.exp(pose.segments.grip)
    turning = T[chains.hole] * chains.friction * (pose.segments.wrap_jacobian @ motion)
    before, after = growth[chains.hole], growth[chains.hole + 1]
    rate = np.maximum(after - ratio * before, before - ratio * after) - ratio * turning
    reached = holding(pose) & (rate > 0.0)
    grip = (ratio - 1.0) * T[chains.hole]
    loads = np.divide(grip, rate, out=np.full(rate.size, math.inf), where=reached)
    return float(loads.min()), int(loads.argmin())


def segment_state(K: Stiffness) -> tuple[Array, Array]:
    """Return the segment tensions T (S,) [N] and ∂T/∂θ (S, nv) [N/rad] that ``K`` stores.

    ``K`` is the stiffness of a stuck or sliding arm; a frictionless one raises InvalidInput.
    """
    if K.segment_tension is None or K.tension_gradient is None:
        raise InvalidInput("stiffness", "is frictionless; give one of stuck_stiffness.")
    return K.segment_tension, K.tension_gradient

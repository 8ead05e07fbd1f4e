"""Polyhedron that contains all states of rest of an arm with friction near a reference.

A state of rest near a reference has joint angles θ_0 + δ and segment tensions T with

    Σ_j T_j g_j(θ) + g(θ) − J_X(θ)ᵀ W = the same at the reference    (equilibrium)
    Σ_j l_j(θ)/(1 + ε(T_j)) = the same at the reference               (wire of a locked motor)
    exp(−μ φ_i(θ)) ≤ T_{j+1}/T_j ≤ exp(μ φ_i(θ))                      (friction at each hole)

l_j and T_j are the length and the tension of segment j, g_j is the gradient of l_j, and ΔT the
change of T. To first order in δ and ΔT these conditions describe a polyhedron. Two linear programs
give the largest and the smallest displacement of the tip in it. All neglected terms, including
terms of nonlinear laws, are bounded in a neighbourhood |δ_i| ≤ ρ_i, |ΔT_j| ≤ ρ_T, and the bounds
are added to the right-hand sides. The polyhedron so enlarged contains all states of rest in the
neighbourhood:

- δ is a sum of one motion per hole. So quadratic and cubic forms of δ are sums over two and three
  holes, bounded term by term. This bounds the terms of second and third order of lengths, tip
  displacement, and torques of weight and wrench. :mod:`~cdsm.friction.remainders` bounds the rest.
- The wrap angles are replaced by their tangents, or by constants, with bounded errors.
- Over a range |ΔT| ≤ ρ_T of tensions, 1/(1 + ε) decreases, and lies between two parallel lines.
- Products of δ and ΔT are at most the products of ρ and ρ_T.

The maximum that the solver returns is not a proof. Its multipliers give one, by weak duality.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from cdsm.cable import Cable
from cdsm.errors import ElasticityRangeError, SolverError
from cdsm.friction.neighbourhood import Neighbourhood
from cdsm.friction.remainders import TOO_FAR, Bends, Remainders
from cdsm.kernels.stiffness import single_length_hessian, single_load_stiffness
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.linear_program import OPTIMAL, proved_largest
from cdsm.support.validation import LARGEST
from cdsm.support.values import Array, frozen

_CELLS = 8192  # number of tension intervals; within each, the strain is only known to increase


class Maximum(NamedTuple):
    """Maximum of a linear program over the polyhedron."""

    value: float  # the solver's answer
    bound: float  # proved upper bound
    reach: float  # largest |variable| of the solution; 1 is the border of the neighbourhood


class RestStates:
    """Polyhedron that contains all states of rest with |δ| ≤ ρ and |ΔT| ≤ ρ_T.

    δ are the changes of the joint angles, ΔT those of the segment tensions, from the reference. The
    reference is the state of the frictionless stiffness ``K``; ``near`` gives ρ and ρ_T. The
    variables are δ/ρ, ΔT/ρ_T, and one slack variable per equation, which stands for the neglected
    terms of the equation, within proved bounds.
    """

    def __init__(self, K: Stiffness, near: Neighbourhood, bends: Bends) -> None:
        from scipy.sparse import csc_array

        pose, cables = K.posture, K.posture.arm.cables
        within, apart, nv = near.joints, near.tensions, near.joints.size
        if apart.max() > LARGEST:
            raise SolverError("highs", TOO_FAR)
        segments = pose.segments
        chains, g, length = segments.chains, segments.length_jacobian, segments.lengths
        cable, start = chains.cable, chains.start
        F, far = K.tension[cable], Remainders(K, within)
        routing, frames, count = segments._routing, segments._frames, np.arange(length.size)
        H = single_length_hessian(
            routing.segment, routing.joint, *frames, np.ones(length.size), count, length.size
        )
        turned, straight = near.largest(H), near.largest(g)
        low = -near.falls / apart
        high = np.ones(length.size)
        for c, each in enumerate(cables):
            if each.control == "force":
                low[start[c]] = high[start[c]] = 0.0

        # Σ ΔT g + (Σ F H + ∂g/∂θ − ∂(J_Xᵀ W)/∂θ) δ + slack = 0
        balance = np.hstack([(K.active + K.gravity + K.load) * within, (g * apart[:, None]).T])
        off = apart @ turned + (F + apart) @ far.gradient + near.curved(bends.body) + far.body
        self._torque = abs(balance).max(axis=1)
        self._torque = np.where(self._torque > 0.0, self._torque, 1.0)
        rows, slack = [balance / self._torque[:, None]], [np.c_[-off, off] / self._torque[:, None]]
        for c, each in enumerate(cables):
            if each.control == "position":
                row, ends = _locked(K, c, near, far, H, straight)
                scale = abs(row).max()
                rows.append(row / scale)
                slack.append(np.array([ends]) / scale)
        equations, width = np.vstack(rows), np.vstack(slack)
        lowest = np.concatenate([-np.ones(nv), low, width[:, 0]])
        highest = np.concatenate([np.ones(nv), high, width[:, 1]])
        sparse = csc_array(np.hstack([equations, np.eye(len(equations))]))
        none = np.zeros(len(equations))
        # G x ≤ h, A x = 0 and the bounds of x, as proved_largest takes them
        self._program = *_cone(K, near, far, lowest.size), sparse, none, lowest, highest
        self._pose, self._near, self._tip, self._tension = pose, near, far.tip, F
        self._bends = bends

    def displacement(self, u: Array) -> Maximum:
        """Compute the largest displacement [m] of the tip along a unit direction u (3,).

        Only ``bound`` of the result includes the terms of higher order.
        """
        near, cost = self._near, np.zeros(self._program[-1].size)
        cost[: near.joints.size] = (u @ self._pose.jacobian[:3]) * near.joints
        found = self._maximum(cost)
        tip_joints = self._pose.arm._body.tip_joints
        force = np.append(u, np.zeros(3))
        curved = single_load_stiffness(self._pose.jacobian, force, tip_joints)
        more = float(near.curved(curved)) + near.cubed(self._bends.of_wrench(force)) + self._tip
        return found._replace(bound=found.bound + more)

    def tensions(self, chosen: Iterable[int]) -> Array:
        """Compute the least and the largest tension (n, 2) [N] of each ``chosen`` segment."""
        bounds = []
        for j in chosen:
            cost = np.zeros(self._program[-1].size)
            cost[self._near.joints.size + j] = 1.0
            ends = np.array([-self._maximum(-cost).bound, self._maximum(cost).bound])
            bounds.append(self._tension[j] + self._near.tensions[j] * ends)
        return frozen(np.maximum(np.array(bounds), 0.0))

    def load(self, u: Array) -> float:
        """Compute an upper bound of the forces [N] along u (3,) that friction holds without motion.

        No larger force is balanced by any state in the polyhedron, which must have ρ = 0.
        """
        from scipy.sparse import csc_array, hstack

        cone, cone_high, equations, none, low, high = self._program
        torque = (u @ self._pose.jacobian[:3]) / self._torque
        most = int(abs(torque).argmax())
        if torque[most] == 0.0:
            return math.inf
        column = np.zeros((none.size, 1))
        column[: torque.size, 0] = -torque
        largest = abs(equations[[most], :]) @ np.maximum(-low, high)
        bound = 1.01 * float(largest[0]) / abs(torque[most])
        widened = (
            csc_array(hstack([cone, csc_array((cone.shape[0], 1))])),
            cone_high,
            csc_array(hstack([equations, csc_array(column)])),
            none,
            np.append(low, -bound),
            np.append(high, bound),
        )
        return self._maximum(np.append(np.zeros(low.size), 1.0), widened).bound

    def _maximum(self, cost: Array, program: tuple[Any, ...] | None = None) -> Maximum:
        """Maximise cost · x over the polyhedron, or under the constraints of ``program``."""
        scale = float(abs(cost).max())
        if scale == 0.0:
            return Maximum(0.0, 0.0, 0.0)
        found, bound = proved_largest(cost / scale, *(program or self._program))
        if found.status != OPTIMAL:
            raise SolverError("highs", f"finds no state of rest: {found.message}")
        states = self._near.joints.size + self._near.tensions.size
        reach = float(abs(found.x[:states]).max())
        return Maximum(-scale * found.fun, scale * bound, reach)


def _locked(
    K: Stiffness, c: int, near: Neighbourhood, far: Remainders, H: Array, straight: Array
) -> tuple[Array, tuple[float, float]]:
    """Return the linear equation of cable ``c``, whose locked motor keeps the length of its wire.

        b (Σ g·δ − ΔT_1/k_series) + b′ Σ l ΔT + slack = 0

    The sums are over the segments of the cable. At the reference, a segment has the length l with
    the gradient g. ΔT is the change of its tension. ΔT_1, that of the first segment, also stretches
    the series spring. b = 1/(1 + ε) is taken at the reference tension F; b′ is the mean slope of b
    over the range of tensions. The slack variable stands for the neglected terms. The docstring of
    the module defines δ, ρ and ρ_T.

    Args:
        K: Stiffness at the reference.
        c: Index of the cable.
        near: The neighbourhood, which gives ρ and ρ_T.
        far: Bounds of the neglected terms of the lengths.
        H: Hessians of the lengths of all S segments (S, nv, nv).
        straight: Largest |g·δ| of each segment (S,).

    Returns:
        The coefficients (1, nv + S) of δ/ρ and ΔT/ρ_T, and the bounds (low, high) of the slack.
    """
    pose, cable = K.posture, K.posture.arm.cables[c]
    segments, apart, nv = pose.segments, near.tensions, near.joints.size
    g, length, first = segments.length_jacobian, segments.lengths, segments.chains.start[c]
    of = slice(first, segments.chains.start[c + 1])
    fall, rise = float(near.falls[of].max()), float(apart[of].max())
    unstrained = pose.arm.original_length == "unstrained"
    wire = _Wire.of(cable, float(K.tension[c]), fall, rise, unstrained)
    spring = 1.0 / cable.series_stiffness
    row = np.zeros((1, nv + length.size))
    row[0, :nv] = wire.share * g[of].sum(axis=0) * near.joints
    row[0, nv:][of] = length[of] * wire.slope * apart[of]
    row[0, nv + first] -= spring * wire.share * apart[first]
    # l departs from its tangent by δᵀHδ/2 and a third-order part
    longer = near.curved(H[of].sum(axis=0)) + far.length[of].sum()
    whole, lost = float(length[of].sum()), wire.share * float(longer)
    each_longer = straight[of] + near.curved(H[of]) + far.length[of]
    lost += float(each_longer.sum()) * wire.change
    lost += spring * abs(np.array(wire[:2]) - cable.elasticity.rest).max() * wire.change
    # a slack cable has more wire than its segments are long
    spare = whole * wire.change + lost if wire.least == 0.0 else 0.0
    return row, (whole * wire.below - lost, whole * wire.above + lost + spare)


def _cone(K: Stiffness, near: Neighbourhood, far: Remainders, size: int) -> tuple[Any, Array]:
    """Return A and b of the friction cone A x ≤ b: T_{j+1} ≤ e^{μφ} T_j and T_j ≤ e^{μφ} T_{j+1}.

    x (``size``,) are the variables of :class:`RestStates`. ``far`` bounds the remainders of the
    wrap angles φ. With ψ = μ (φ(θ) − φ_0), e^ψ ≤ 1 + ψ + ψ²/2 e^|ψ|. A contains the linear part of
    ψ if φ is differentiable; otherwise b contains a bound of ψ.
    """
    from scipy.sparse import csc_array

    segments = K.posture.segments
    chains, hole, nv = segments.chains, segments.chains.hole, near.joints.size
    F, apart = K.tension[chains.cable], near.tensions
    ratio, mu = np.exp(segments.grip), chains.friction
    smooth = np.isfinite(far.wrap)
    slope = np.where(smooth[:, None], mu[:, None] * segments.wrap_jacobian, 0.0)
    linear = near.largest(slope)
    rest = mu * np.where(smooth, far.wrap, far.turn)
    most = linear + rest
    with np.errstate(over="ignore"):  # a neighbourhood as wide as that holds no band
        curved = rest + most**2 / 2.0 * np.exp(most)
    if not np.isfinite(curved).all():
        raise SolverError("highs", TOO_FAR)
    blocks, bounds = [], []
    for here, there in ((hole, hole + 1), (hole + 1, hole)):
        rows = np.zeros((hole.size, size))
        index, scale = np.arange(hole.size), np.maximum(F[here], apart[here])
        rows[:, :nv] = -(ratio * F[here] / scale)[:, None] * slope * near.joints
        rows[index, nv + there] = apart[there] / scale
        rows[index, nv + here] = -ratio * apart[here] / scale
        free = apart[here] * linear + (F[here] + apart[here]) * curved
        blocks.append(rows)
        bounds.append(((ratio - 1.0) * F[here] + ratio * free) / scale)
    return csc_array(np.vstack(blocks)), np.concatenate(bounds)


class _Wire(NamedTuple):
    """Two parallel lines that bound b = 1/(1 + ε) of a cable over a range of tensions.

    b_F + slope ΔT + below ≤ b ≤ b_F + slope ΔT + above, and |b − b_F| ≤ change. b_F is b at the
    reference tension F, and ΔT = T − F.
    """

    least: float  # lowest tension [N]
    most: float  # highest tension [N]
    share: float  # b_F, which is b at the reference
    slope: float  # [1/N]
    below: float
    above: float
    change: float

    @classmethod
    def of(cls, cable: Cable, F: float, fall: float, rise: float, unstrained: bool) -> _Wire:
        """Bound b = 1/(1 + ε) for tensions of a locked cable from F − fall to F + rise [N].

        If ``unstrained`` is False, ε is the strain minus the strain under F.
        """
        law = cable.elasticity
        strain = float(law.strain(F))
        offset = 0.0 if unstrained else strain
        least, most = F - fall, F + rise
        at = np.linspace(least, most, _CELLS + 1)
        outside = [F for F in (least, most) if not law.low <= F <= law.high]
        if outside:
            raise ElasticityRangeError(
                f"of a band; the elasticity is defined on {law._span} only. Raise the tensions, "
                "or use an elasticity that covers them",
                outside,
                cables=[cable.name],
            )
        b = 1.0 / (1.0 + law.strain(at) - offset)
        share = 1.0 / (1.0 + strain - offset)
        slope = float((b[-1] - b[0]) / (most - least)) if most > least else 0.0
        line = share + slope * (at - F)
        return cls(
            least=least,
            most=most,
            share=share,
            slope=slope,
            below=float((b[1:] - line[:-1]).min(initial=0.0)),
            above=float((b[:-1] - line[1:]).max(initial=0.0)),
            change=float(max(b[0] - share, share - b[-1])),
        )

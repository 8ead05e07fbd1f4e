"""Numba kernel of derivatives of a stiffness with respect to dimensions and masses of an arm.

All of them follow from the derivatives of one scalar. With a fixed joint motion z,

    Φ = zᵀ K_θ z = Σ_c (F_c L̈_c + k_c L̇_c²) − Σ_b m_b γ·ẍ_b − f·ẍ_tip − m·ω̇_tip,

where a dot is the derivative along q̇ = z, q̈ = 0. The cables c have lengths L, tensions F and
stiffnesses k; the bodies b have masses m_b and centres of mass x_b. γ is the acceleration of
gravity, W = (f, m) the load at the tip, and ω the angular velocity of a link. If z is
the unit eigenvector of the smallest eigenvalue of K_θ, this eigenvalue has the same gradient as Φ.
For the compliance κ = uᵀ J_v K_θ⁻¹ J_vᵀ u, with z = K_θ⁻¹ J_vᵀ u kept constant,

    dκ = −dΨ,    Ψ = Φ − 2 u·ẋ_tip.

Masses, tensions and stiffnesses k are factors in Ψ. Dimensions change Ψ through the positions x,
velocities ẋ and accelerations ẍ of points: cable sites, centres of mass and the tip. The kernel
computes X = ∂Ψ/∂x, V = ∂Ψ/∂ẋ and A = ∂Ψ/∂ẍ of each point, and from them the derivatives with
respect to

- the position of a point in its link: a displacement δ changes x by δ, ẋ by ω × δ and ẍ by ω̇ × δ +
  ω × (ω × δ);
- the origin of a joint in its parent link: all points beyond the joint are displaced in this way,
  with ω and ω̇ of the parent link;
- a joint angle: the points beyond the joint turn, and their motion relative to the parent link
  turns with them.

One pass over the cables and one over the points of each joint give all derivatives. Finite
differences would take two evaluations of K_θ for each derivative.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.bodies import Masses
from cdsm._former.compiling import Index, compiled, inner
from cdsm._former.motion import Motion, cross, dot, move, pull_back, set_motion, to_frame
from cdsm._former.tree import Indices, Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array


@inner
def _add_cable(
    begin: Index,
    end: Index,
    tension: float,
    stiffness: float,
    slope: float,
    pull: float,
    point: Array,
    weight: Array,
) -> tuple[float, float]:
    """Add the derivatives of F L̈ + k L̇² + p L̇ of one cable to ``weight``; return L̈ and L̇.

    The cable has the sites from ``begin`` to ``end`` − 1. ``tension`` is F, ``stiffness`` k,
    ``pull`` a factor p, and ``slope`` ∂k/∂L. ``point`` (N, 3, 3) has x, ẋ and ẍ of each point, and
    ``weight`` (N, 3, 3) the derivatives X, V and A with respect to them.
    """
    rate = bend = 0.0
    u, v, w = np.empty(3), np.empty(3), np.empty(3)
    for turn in range(2):  # first L̇, which the derivatives need
        by_rate, by_length = 2.0 * stiffness * rate + pull, slope * rate * rate
        for a in range(begin, end - 1):
            b = a + 1
            for r in range(3):
                u[r] = point[b, 0, r] - point[a, 0, r]
                v[r] = point[b, 1, r] - point[a, 1, r]
                w[r] = point[b, 2, r] - point[a, 2, r]
            length = math.sqrt(dot(u, u))
            for r in range(3):
                u[r] /= length
            along, square, drift = dot(u, v), dot(v, v), dot(u, w)
            if turn == 0:
                rate += along
                bend += (square - along * along) / length + drift
                continue
            for r in range(3):
                across = (v[r] - along * u[r]) / length  # ∂ℓ̇/∂x
                by_x = (
                    -2.0 * along * across / length
                    - (square - along * along) / (length * length) * u[r]
                    + (w[r] - drift * u[r]) / length
                )
                x = tension * by_x + by_rate * across + by_length * u[r]
                xdot = 2.0 * tension * across + by_rate * u[r]
                weight[b, 0, r] += x
                weight[a, 0, r] -= x
                weight[b, 1, r] += xdot
                weight[a, 1, r] -= xdot
                weight[b, 2, r] += tension * u[r]
                weight[a, 2, r] -= tension * u[r]
    return bend, rate


@inner
def _by_joint(
    i: Index,
    before: Index,
    frames: tuple[Array, Array, Array],
    motion: Motion,
    row: Indices,
    beyond: Array,
    point: Array,
    weight: Array,
    spin: Array,
    spin_rate: Array,
    tip: Index,
    placement: Array,
) -> float:
    """Return ∂Ψ/∂q_i of joint i, and fill ``placement`` with the derivative by its origin.

    ``placement`` (3,) is the derivative with respect to the joint's origin, in base axes.
    ``before`` is the row of the joint's parent, and ``beyond`` (nv+1,) is not 0 for the rows that
    the joint moves. ``frames`` are origin, axis and slide of all joints. For each point, ``row``
    has the row of its joint, ``point`` x, ẋ and ẍ, and ``weight`` X, V and A. ``spin`` and
    ``spin_rate`` (3,) are ∂Ψ/∂ω and ∂Ψ/∂ω̇ of the tip, whose row is ``tip``.
    """
    origin, axis, slide = frames
    turning, rate, velocity, acceleration = motion
    w, e = turning[before], rate[before]
    arm, v, a, back, scratch = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    total, moment = np.zeros(3), np.zeros(3)
    # a sliding joint moves its own origin relative to the parent
    for n in range(row.shape[0]):
        if beyond[row[n]] == 0.0:
            continue
        pull_back(w, e, weight[n], scratch, back)  # leaves A × ω in scratch
        for r in range(3):
            total[r] += back[r]
            arm[r] = point[n, 0, r] - origin[before, r]
        move(w, e, arm, v, a)
        for r in range(3):  # motion relative to the parent link, then Coriolis
            v[r] = point[n, 1, r] - velocity[before, r] - v[r]
        for r in range(3):
            p, q = (r + 1) % 3, (r + 2) % 3
            a[r] = (
                point[n, 2, r] - acceleration[before, r] - a[r] - 2.0 * (w[p] * v[q] - w[q] * v[p])
            )
            arm[r] = point[n, 0, r] - origin[i, r]
            scratch[r] = weight[n, 1, r] + 2.0 * scratch[r]
        A = weight[n, 2]
        for r in range(3):
            p, q = (r + 1) % 3, (r + 2) % 3
            moment[r] += (
                arm[p] * back[q]
                - arm[q] * back[p]
                + v[p] * scratch[q]
                - v[q] * scratch[p]
                + a[p] * A[q]
                - a[q] * A[p]
            )
    if beyond[tip] != 0.0:  # ω and ω̇ of the tip
        cross(spin_rate, w, scratch)
        for r in range(3):
            v[r] = turning[tip, r] - w[r]
            scratch[r] += spin[r]
        for r in range(3):
            p, q = (r + 1) % 3, (r + 2) % 3
            a[r] = rate[tip, r] - e[r] - (w[p] * v[q] - w[q] * v[p])
        for r in range(3):
            p, q = (r + 1) % 3, (r + 2) % 3
            moment[r] += v[p] * scratch[q] - v[q] * scratch[p]
            moment[r] += a[p] * spin_rate[q] - a[q] * spin_rate[p]
    for r in range(3):
        placement[r] = total[r]
    derivative = dot(axis[i], moment)
    return derivative + dot(slide[i], total) if slide.shape[0] else derivative


@compiled
def single_gradient(
    tree: Tree,
    routing: Routing,
    masses: Masses,
    q: Array,
    first: Indices,
    z: Array,
    velocity: Array,
    tension: Array,
    stiffness: Array,
    slope: Array,
    pull: Array,
    wrench: Array,
    bent: float,
    turned: float,
) -> tuple[float, Array, Array, Array, Array, Array, Array, Array, Array]:
    """Compute Ψ of one posture, and its derivatives while z, v, p and W = (f, m) are constant.

        Ψ = Σ_c (F_c L̈_c + k_c L̇_c² + p_c L̇_c) + v·ẋ_tip
            − a (Σ_b m_b γ·ẍ_b + f·ẍ_tip + m·ω̇_tip) − b (Σ_b m_b γ·ẋ_b + f·ẋ_tip + m·ω_tip)

    With a = 1 and p = b = 0, Ψ is zᵀ K_θ z + v·ẋ_tip. With F = k = v = a = 0, b = 1 and p the
    tensions, Ψ is zᵀ (J_Lᵀ p + g − J_Xᵀ W), the work of the residual of Eq. 13 on the motion z.

    The symbols are those at the top of the module. ``first`` (C+1,) is the first site of each
    cable. v is ``velocity`` (3,), F ``tension`` (C,), k ``stiffness`` (C,), ∂k/∂L ``slope`` (C,), p
    ``pull`` (C,), W ``wrench`` (6,), a ``bent`` and b ``turned``.

    Returns:
        Ψ, and its derivatives with respect to q (nv,), the sites in the frames of their joints (P,
        3), the origins of the joints in their parents (nv+1, 3), the centres of mass (nv+1, 3), the
        position of the tip (3,), the masses (nv+1,), the tensions at constant k (C,), and k (C,).
        The derivative with respect to the length of a lead is ``slope`` times the derivative with
        respect to k.
    """
    parent, order, row = tree.parent, tree.order, routing.row
    mass, gravity, tip = masses.mass, masses.gravity, masses.tip
    frames = empty_frames(tree, routing, 1)
    rows, sites, nv = parent.shape[0], row.shape[0], q.shape[0]
    rotation = np.empty((rows, 3, 3, 1))
    forward_kinematics(tree, routing, q.reshape(nv, 1), np.empty((2, 1)), rotation, frames, None)
    origin, axis = frames.origin.reshape(rows, 3), frames.axis.reshape(rows, 3)
    slide = frames.slide.reshape(tree.slide.shape[0], 3)
    still = np.zeros((4, rows, 3))
    motion = Motion(still[0], still[1], still[2], still[3])
    set_motion(tree, origin, axis, slide, z, motion)
    turning, rate, moving, acceleration = motion
    # all points: sites, centres of mass, tip
    count = sites + rows + 1
    at = np.empty(count, dtype=np.intp)
    x, weight = np.empty((count, 3, 3)), np.zeros((count, 3, 3))
    arm, v, a = np.empty(3), np.empty(3), np.empty(3)
    for n in range(count):
        at[n] = row[n] if n < sites else n - sites if n < sites + rows else tip
        i = at[n]
        for r in range(3):
            if n < sites:
                arm[r] = frames.site[n, r, 0] - origin[i, r]
            else:
                local = masses.centre[i] if n < sites + rows else masses.point
                arm[r] = (
                    rotation[i, r, 0, 0] * local[0]
                    + rotation[i, r, 1, 0] * local[1]
                    + rotation[i, r, 2, 0] * local[2]
                )
        move(turning[i], rate[i], arm, v, a)
        for r in range(3):
            x[n, 0, r] = origin[i, r] + arm[r]
            x[n, 1, r] = moving[i, r] + v[r]
            x[n, 2, r] = acceleration[i, r] + a[r]
    value = 0.0
    by_tension, by_stiffness = np.empty(tension.shape[0]), np.empty(tension.shape[0])
    for c in range(tension.shape[0]):
        bend, speed = _add_cable(
            first[c], first[c + 1], tension[c], stiffness[c], slope[c], pull[c], x, weight
        )
        by_tension[c], by_stiffness[c] = bend, speed * speed
        value += tension[c] * bend + stiffness[c] * speed * speed + pull[c] * speed
    by_mass = np.empty(rows)
    for i in range(rows):
        n = sites + i
        by_mass[i] = -bent * dot(gravity, x[n, 2]) - turned * dot(gravity, x[n, 1])
        value += mass[i] * by_mass[i]
        for r in range(3):
            weight[n, 1, r] = -turned * mass[i] * gravity[r]
            weight[n, 2, r] = -bent * mass[i] * gravity[r]
    last, spin, spin_rate = count - 1, np.empty(3), np.empty(3)
    for r in range(3):
        weight[last, 1, r] = velocity[r] - turned * wrench[r]
        weight[last, 2, r] = -bent * wrench[r]
        spin[r] = -turned * wrench[3 + r]
        spin_rate[r] = -bent * wrench[3 + r]
        value += weight[last, 1, r] * x[last, 1, r] + weight[last, 2, r] * x[last, 2, r]
    value += dot(spin, turning[tip]) + dot(spin_rate, rate[tip])
    by_q, by_point, by_origin = np.empty(nv), np.empty((count, 3)), np.zeros((rows, 3))
    back, scratch = np.empty(3), np.empty(3)
    for n in range(count):
        i = at[n]
        pull_back(turning[i], rate[i], weight[n], scratch, back)
        to_frame(rotation[i], back, by_point[n])
    beyond = np.empty(rows)
    for k in range(rows - 1):
        i = order[k]
        for other in range(rows):
            beyond[other] = 0.0
        beyond[i] = 1.0
        for other in range(k + 1, rows - 1):
            beyond[order[other]] = beyond[parent[order[other]]]
        by_q[i - 1] = _by_joint(
            i, parent[i], (origin, axis, slide), motion, at, beyond, x, weight, spin, spin_rate,
            tip, back,
        )  # fmt: skip
        to_frame(rotation[parent[i]], back, by_origin[i])
    by_site, by_centre, by_tip = by_point[:sites], by_point[sites:last], by_point[last]
    return value, by_q, by_site, by_origin, by_centre, by_tip, by_mass, by_tension, by_stiffness

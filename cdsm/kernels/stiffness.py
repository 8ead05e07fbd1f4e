"""Numba kernels of the terms of Eq. 16, for single postures and for batches."""

from __future__ import annotations

import numpy as np

from cdsm.kernels.compiling import compiled, upwards
from cdsm.kernels.segments import add_length_hessian, mirror
from cdsm.kernels.tree import Frames, Indices
from cdsm.support.values import Array


@compiled
def cable_stiffness(
    length: Array, tension: Array, rigidity: Array, linear: Array, series: Array, rest: Array
) -> Array:
    """Compute the stiffness k of each cable (C,) [N/m]; see :func:`set_cable_stiffness`.

    EA (1 + ε) is ``rigidity``, or rigidity + tension (EA + F) where ``linear`` (C,) is one.
    """
    stretched, stiffness = np.empty(length.shape[0]), np.empty(length.shape[0])
    for c in range(length.shape[0]):
        stretched[c] = rigidity[c] + linear[c] * tension[c]
    set_cable_stiffness(length, tension, stretched, series, rest, stiffness)
    return stiffness


@compiled
def set_cable_stiffness(
    length: Array, tension: Array, rigidity: Array, series: Array, rest: Array, stiffness: Array
) -> None:
    """Fill k = 1/(l_0/EA + 1/k_series) (C,) [N/m]; 0 where EA is 0, for motors that hold force.

    The length of the wire is the cable length L without the series spring, ℓ = L − (F −
    F_0)/k_series. Therefore l_0/EA = ℓ/(EA (1 + ε)). ``rigidity`` is EA (1 + ε) [N], ``series`` is
    1/k_series [m/N], and ``rest`` is F_0 [N], the tension at which the springs are at rest. All
    arrays are (C,).
    """
    for c in range(length.shape[0]):
        stiffness[c] = 0.0
        if rigidity[c] > 0.0:
            wire = length[c] - series[c] * (tension[c] - rest[c])
            stiffness[c] = 1.0 / (wire / rigidity[c] + series[c])


@compiled
def joint_stiffness(
    segment: Indices,
    joint: Indices,
    origin: Array,
    axis: Array,
    slide: Array,
    site: Array,
    jacobian: Array,
    length_jacobian: Array,
    gravity: Array,
    tension: Array,
    cable_stiffness: Array,
    wrench: Array,
    tip_joints: Indices,
) -> tuple[Array, Array, Array, Array]:
    """Compute the active, passive and load terms of Eq. 16 and the sum of all four, (nv, nv).

    Python passes the arrays of routing and frames one by one: the two named tuples took 3 of 16 µs.
    """
    nv = jacobian.shape[1]
    active, passive = np.zeros((1, nv, nv)), np.zeros((nv, nv))
    slot = np.zeros(tension.shape[0], dtype=np.intp)
    frames = Frames(origin, axis, slide, site)
    add_length_hessian(segment, joint, frames, tension, slot, active)
    add_passive_stiffness(length_jacobian, cable_stiffness, passive)
    mirror(passive)
    load = load_stiffness(jacobian, wrench, tip_joints)
    return active[0], passive, load, active[0] + passive + gravity + load


@compiled
def add_passive_stiffness(length_jacobian: Array, cable_stiffness: Array, passive: Array) -> None:
    """Add J_Lᵀ K_L J_L to a matrix (nv, nv), for i ≤ j only."""
    J, k = length_jacobian, cable_stiffness
    count, nv = J.shape
    for c in range(0, count, 3):  # three cables at a time: a third of the memory accesses
        d, e = min(c + 1, count - 1), min(c + 2, count - 1)
        kd, ke = k[d] if d > c else 0.0, k[e] if e > d else 0.0
        last = nv  # only the joints before its end change a cable's length
        while (
            last > 0 and J[c, last - 1] == 0.0 and J[d, last - 1] == 0.0 and J[e, last - 1] == 0.0
        ):
            last -= 1
        for i in range(last):
            x, y, z = k[c] * J[c, i], kd * J[d, i], ke * J[e, i]
            for j in upwards(i, last):
                passive[i, j] += x * J[c, j] + y * J[d, j] + z * J[e, j]


@compiled
def load_stiffness(jacobian: Array, wrench: Array, tip_joints: Indices) -> Array:
    """Compute −∂(J_Xᵀ W)/∂θ (nv, nv) of a constant wrench W (6,): row torque, column angle."""
    result = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    add_load_stiffness(jacobian, wrench, tip_joints, result)
    return result


@compiled
def add_load_stiffness(jacobian: Array, wrench: Array, tip_joints: Indices, load: Array) -> None:
    """Add −∂(J_Xᵀ W)/∂θ to a matrix (nv, nv).

    ``tip_joints`` are the joints that move the tip, base first. Of two joints, a is the earlier and
    b the later: ∂v_i/∂θ_j = z_a × v_b. ∂z_i/∂θ_j = z_j × z_i if joint j is before joint i, else 0.
    """
    fx, fy, fz = wrench[0], wrench[1], wrench[2]
    mx, my, mz = wrench[3], wrench[4], wrench[5]
    for s in range(tip_joints.shape[0]):
        a = np.uint64(tip_joints[s])
        zx, zy, zz = jacobian[3, a], jacobian[4, a], jacobian[5, a]
        # f·(z × v) = (f × z)·v, m·(z × z_b) = (m × z)·z_b
        gx, gy, gz = fy * zz - fz * zy, fz * zx - fx * zz, fx * zy - fy * zx
        hx, hy, hz = my * zz - mz * zy, mz * zx - mx * zz, mx * zy - my * zx
        load[a, a] -= gx * jacobian[0, a] + gy * jacobian[1, a] + gz * jacobian[2, a]
        for t in upwards(s + 1, tip_joints.shape[0]):
            b = np.uint64(tip_joints[t])
            force = gx * jacobian[0, b] + gy * jacobian[1, b] + gz * jacobian[2, b]
            moment = hx * jacobian[3, b] + hy * jacobian[4, b] + hz * jacobian[5, b]
            load[a, b] -= force
            load[b, a] -= force + moment

"""The fused kernel: from joint angles, tensions and wrenches to all that is asked for, row by row.

The physics is that of :mod:`cdsm.kernels.segments`, which the single posture uses too, and of
:mod:`cdsm.kernels.bodies`; here it is only strung together, without allocating anything per row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.batch.layout import (
    ACTIVE,
    ALONG,
    BEYOND_LIMITS,
    CABLE_LENGTHS,
    CABLE_STIFFNESS,
    CARTESIAN,
    COINCIDENT_SITES,
    COMPLIANCE,
    GRAVITY,
    GRAVITY_TORQUE,
    IMMOBILE,
    JACOBIAN,
    JOINT,
    LENGTH_JACOBIAN,
    LOAD,
    MARGIN,
    OK,
    OUTSIDE_ELASTICITY,
    PASSIVE,
    PSEUDOINVERSE,
    RESIDUAL,
    SINGULAR,
    TIP,
    Codes,
)
from cdsm.kernels.bodies import Masses, add_gravity_stiffness, gravity_torque, tip_jacobian
from cdsm.kernels.compiling import compiled, inlined, threaded
from cdsm.kernels.readings import IMMOBILE as NOT_MOBILE
from cdsm.kernels.readings import SINGULAR as NOT_REGULAR
from cdsm.kernels.readings import Readings, Wanted, read_stiffness, sum_terms, workspace
from cdsm.kernels.segments import add_segment_derivatives, mirror
from cdsm.kernels.stiffness import add_load_stiffness, add_passive_stiffness, set_cable_stiffness
from cdsm.kernels.tree import Frames, Indices, Routing, Tree, forward_kinematics
from cdsm.support.validation import Array


class Arm(NamedTuple):
    """What does not change from row to row.

    Attributes:
        tree: The joints.
        routing: The cables.
        masses: What the joints carry, and the tip.
        lowest: Lower joint limits (nv,) [rad].
        highest: Upper joint limits (nv,) [rad].
        series: 1/k_series of the cables (C,) [m/N].
        rest: Tension at which these springs are at rest (C,) [N].
    """

    tree: Tree
    routing: Routing
    masses: Masses
    lowest: Array
    highest: Array
    series: Array
    rest: Array


@compiled
def _is_beyond(q: Array, lowest: Array, highest: Array) -> bool:
    """Whether an angle is beyond its limits."""
    beyond = False
    for i in range(q.shape[0]):
        beyond = beyond or q[i] < lowest[i] or q[i] > highest[i]
    return beyond


@threaded
def evaluate_rows(
    arm: Arm,
    q: Array,
    tension: Array,
    rigidity: Array,
    wrench: Array,
    directions: Array,
    start: Indices,
    wanted: Indices,
    out: Array,
    status: Codes,
) -> None:
    """Fill the status (b,) and, one after the other, the wanted quantities of every row, (b, …).

    Args:
        arm: The arm.
        q: Joint angles (b, nv) [rad].
        tension: F (b, C) [N].
        rigidity: EA (1 + ε) (b, C) [N]; 0 under force control, negative where there is none.
        wrench: W (b, 6).
        directions: Unit vectors (D, 3) of ``along``.
        start: Where the quantities begin in a record.
        wanted: Numbers of quantities, rising.
        out: What is wanted, NaN where it does not exist.
        status: As it is known beforehand: OK, or that there are no tensions; then as it is found.
    """
    tree, routing, masses, lowest, highest, series, rest = arm
    parent, fixed = tree.parent, routing.fixed
    nv, count, bodies = q.shape[1], fixed.shape[0], parent.shape[0]
    site = np.empty((routing.row.shape[0], 3))
    slide = np.empty(tree.slide.shape)
    frames = Frames(np.empty((bodies, 3)), np.empty((bodies, 3)), slide, site)
    rotation, left_factor, carried = (
        np.empty((bodies, 3, 3)),
        np.empty((nv, 3)),
        np.empty((bodies, 7)),
    )
    slot = np.zeros(count, dtype=np.intp)

    record = np.zeros(start[start.shape[0] - 1])
    tip = _matrix(record, start, TIP, 4)
    JX = _matrix(record, start, JACOBIAN, 6)
    L = _vector(record, start, CABLE_LENGTHS)
    J = _matrix(record, start, LENGTH_JACOBIAN, count)
    g = _vector(record, start, GRAVITY_TORQUE)
    gravity = _matrix(record, start, GRAVITY, nv)
    residual = _vector(record, start, RESIDUAL)
    active = _vector(record, start, ACTIVE).reshape((1, nv, nv))
    load = _matrix(record, start, LOAD, nv)
    k = _vector(record, start, CABLE_STIFFNESS)
    passive = _matrix(record, start, PASSIVE, nv)
    K = _matrix(record, start, JOINT, nv)
    readings = Readings(
        _vector(record, start, MARGIN),
        _matrix(record, start, PSEUDOINVERSE, 3),
        _vector(record, start, ALONG),
        _matrix(record, start, COMPLIANCE, 6),
        _matrix(record, start, CARTESIAN, 3),
    )

    asked, last = np.zeros(start.shape[0] - 1, dtype=np.bool_), 0
    for w in range(wanted.shape[0]):
        last = wanted[w]
        asked[last] = True
    curved = active if last > GRAVITY else np.empty((0, nv, nv))
    read = Wanted(asked[MARGIN], asked[PSEUDOINVERSE], asked[COMPLIANCE], asked[CARTESIAN])
    work = workspace(nv, directions.shape[0], read)

    for b in range(q.shape[0]):
        beyond, coincident = _is_beyond(q[b], lowest, highest), -1
        if not beyond:
            forward_kinematics(tree, routing, q[b], rotation, frames)
            for c in range(count):
                L[c] = fixed[c]
            for i in range(start[LENGTH_JACOBIAN], start[LENGTH_JACOBIAN + 1]):
                record[i] = 0.0
            if last >= GRAVITY:
                for i in range(start[GRAVITY], start[JOINT]):
                    record[i] = 0.0
            coincident = add_segment_derivatives(
                routing, frames, tension[b], slot, left_factor, L, J, curved
            )
        known = 0
        if beyond:
            status[b] = BEYOND_LIMITS
        elif coincident >= 0:
            status[b] = COINCIDENT_SITES
        else:
            known = GRAVITY + 1
            tip_jacobian(parent, masses, rotation, frames, tip, JX)
            gravity_torque(tree, masses, rotation, frames, carried, g)
            if last >= GRAVITY:
                add_gravity_stiffness(parent, carried, gravity)
                mirror(gravity)
            if last > GRAVITY and status[b] == OK:
                known = LOAD + 1
                _imbalance(tension[b], J, wrench[b], JX, g, residual)
                mirror(active[0])
                add_load_stiffness(JX, wrench[b], masses.tip_joints, load)
                if last > LOAD and (rigidity[b] < 0.0).any():
                    status[b] = OUTSIDE_ELASTICITY
                elif last > LOAD:
                    known = CARTESIAN + 1
                    set_cable_stiffness(L, tension[b], rigidity[b], series, rest, k)
                    add_passive_stiffness(J, k, passive)
                    mirror(passive)
                    sum_terms(active[0], passive, gravity, load, K, work.parts)
                    if last > JOINT:
                        found = read_stiffness(K, JX, directions, read, work, readings)
                        if found == NOT_REGULAR:
                            status[b] = SINGULAR
                            known = PSEUDOINVERSE + 1
                        elif found == NOT_MOBILE:
                            status[b] = IMMOBILE
        _keep(record, start, known, wanted, b, out)


@inlined
def _vector(record: Array, start: Indices, quantity: int) -> Array:
    """The place of a quantity in the record."""
    return record[start[quantity] : start[quantity + 1]]


@inlined
def _matrix(record: Array, start: Indices, quantity: int, rows: int) -> Array:
    """The place of a matrix in the record."""
    part = record[start[quantity] : start[quantity + 1]]
    return part.reshape((rows, part.shape[0] // rows))


@compiled
def _imbalance(
    tension: Array, J: Array, wrench: Array, JX: Array, g: Array, residual: Array
) -> None:
    """Fill what is left of Eq. 13, J_Lᵀ F − J_Xᵀ W + g (nv,)."""
    for i in range(g.shape[0]):
        residual[i] = g[i]
        for a in range(6):
            residual[i] -= wrench[a] * JX[a, i]
    for c in range(J.shape[0]):
        for i in range(g.shape[0]):
            residual[i] += tension[c] * J[c, i]


@compiled
def _keep(record: Array, start: Indices, known: int, wanted: Indices, b: int, out: Array) -> None:
    """Copy the wanted ones of the quantities known, which are the first so many, to out[b]."""
    at = 0
    for w in range(wanted.shape[0]):
        first, end = start[wanted[w]], start[wanted[w] + 1]
        exists = wanted[w] < known
        for i in range(end - first):
            out[b, at + i] = record[first + i] if exists else math.nan
        at += end - first

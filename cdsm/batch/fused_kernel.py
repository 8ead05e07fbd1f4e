"""Fused kernel that computes all requested quantities of many postures, one after the other.

The physics is in :mod:`cdsm.kernels`. This kernel calls it without allocating memory per posture.
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
from cdsm.kernels.readings import (
    READ,
    Readings,
    Wanted,
    read_stiffness,
    sum_terms,
    workspace,
)
from cdsm.kernels.readings import SINGULAR as NOT_REGULAR
from cdsm.kernels.segments import add_segment_derivatives, mirror
from cdsm.kernels.stiffness import add_load_stiffness, add_passive_stiffness, set_cable_stiffness
from cdsm.kernels.tree import Frames, Indices, Routing, Tree, forward_kinematics
from cdsm.support.values import Array


class Arm(NamedTuple):
    """Arrays of the arm, equal for all postures.

    Attributes:
        tree: The joints.
        routing: The cables.
        masses: Masses on the joints, and place of the tip.
        lowest: Lower joint limits (nv,) [rad].
        highest: Upper joint limits (nv,) [rad].
        series: 1/k_series of the cables (C,) [m/N].
        rest: Tension at which the series springs are at rest (C,) [N].
    """

    tree: Tree
    routing: Routing
    masses: Masses
    lowest: Array
    highest: Array
    series: Array
    rest: Array


class Row(NamedTuple):
    """Quantities of one posture: views of its record, which stores them one after the other.

    Attributes:
        tip: (4, 4).
        JX: J_X (6, nv).
        L: Cable lengths (C,).
        J: J_L (C, nv).
        g: Gravity torque (nv,).
        gravity: (nv, nv).
        residual: (nv,).
        active: (1, nv, nv).
        load: (nv, nv).
        k: Cable stiffness (C,).
        passive: (nv, nv).
        K: K_θ (nv, nv).
        readings: Margin, pseudoinverse, along, compliance and cartesian, read from K_θ.
    """

    tip: Array
    JX: Array
    L: Array
    J: Array
    g: Array
    gravity: Array
    residual: Array
    active: Array
    load: Array
    k: Array
    passive: Array
    K: Array
    readings: Readings


class Scratch(NamedTuple):
    """Temporary arrays of the kernels, used again at every posture."""

    frames: Frames
    rotation: Array
    left_factor: Array
    carried: Array
    slot: Indices


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
    """Fill the status (b,) and the requested quantities (b, …) of every posture.

    Args:
        arm: The arm.
        q: Joint angles (b, nv) [rad].
        tension: F (b, C) [N].
        rigidity: EA (1 + ε) (b, C) [N]; 0 under force control, negative outside the domain.
        wrench: W (b, 6).
        directions: Unit vectors (D, 3) of ``along``.
        start: Index in the record at which each quantity begins.
        wanted: Numbers of the requested quantities, rising.
        out: The requested quantities in one row per posture; NaN where they do not exist.
        status: On entry OK, or why no tensions were found; on return the status of the posture.
    """
    # numba counts references at every access to a field, which costs 0.5 µs per posture. So all
    # fields are unpacked here, and the stages below are one function.
    tree, routing, masses, lowest, highest, series, rest = arm
    parent, fixed = tree.parent, routing.fixed
    nv, count = q.shape[1], fixed.shape[0]
    frames, rotation, left_factor, carried, slot = _scratch(arm, nv)
    record = np.zeros(start[start.shape[0] - 1])
    row = _views(record, start, nv, count)
    tip, JX, L, J, g, gravity, residual, active, load, k, passive, K, readings = row
    last, is_wanted = 0, np.zeros(start.shape[0] - 1, dtype=np.bool_)
    for w in range(wanted.shape[0]):
        last = wanted[w]
        is_wanted[last] = True
    read = Wanted(
        is_wanted[MARGIN], is_wanted[PSEUDOINVERSE], is_wanted[COMPLIANCE], is_wanted[CARTESIAN]
    )
    work = workspace(nv, directions.shape[0], read)
    # the active term costs as much as lengths and moment arms; without slots it is not computed
    active_slots = active if last > GRAVITY else np.empty((0, nv, nv))

    for b in range(q.shape[0]):
        # quantities of the joint angles alone
        if _is_beyond(q[b], lowest, highest):
            status[b] = BEYOND_LIMITS
            _copy(record, start, 0, wanted, b, out)
            continue
        forward_kinematics(tree, routing, q[b], rotation, frames)
        for c in range(count):
            L[c] = fixed[c]
        _clear(record, start[LENGTH_JACOBIAN], start[LENGTH_JACOBIAN + 1])
        if last >= GRAVITY:
            _clear(record, start[GRAVITY], start[JOINT])
        coincident = add_segment_derivatives(
            routing.segment,
            routing.joint,
            frames,
            tension[b],
            slot,
            left_factor,
            L,
            J,
            active_slots,
        )
        if coincident >= 0:
            status[b] = COINCIDENT_SITES
            _copy(record, start, 0, wanted, b, out)
            continue
        tip_jacobian(parent, masses, rotation, frames, tip, JX)
        gravity_torque(tree, masses, rotation, frames, carried, g)
        if last >= GRAVITY:
            add_gravity_stiffness(parent, carried, gravity)
            mirror(gravity)
        known = GRAVITY + 1

        # quantities that need tensions
        if last > GRAVITY and status[b] == OK:
            _set_residual(tension[b], J, wrench[b], JX, g, residual)
            mirror(active[0])
            add_load_stiffness(JX, wrench[b], masses.tip_joints, load)
            known = LOAD + 1

        # quantities that need the rigidity of the cables
        if last > LOAD and known > LOAD:
            if (rigidity[b] < 0.0).any():
                status[b] = OUTSIDE_ELASTICITY
            else:
                set_cable_stiffness(L, tension[b], rigidity[b], series, rest, k)
                add_passive_stiffness(J, k, passive)
                mirror(passive)
                sum_terms(active[0], passive, gravity, load, K, work.parts)
                known = JOINT + 1

        # readings of K_θ
        if last > JOINT and known > JOINT:
            found = read_stiffness(K, JX, directions, read, work, readings)
            known = PSEUDOINVERSE + 1 if found == NOT_REGULAR else CARTESIAN + 1
            if found != READ:
                status[b] = SINGULAR if found == NOT_REGULAR else IMMOBILE
        _copy(record, start, known, wanted, b, out)


@compiled
def _views(record: Array, start: Indices, nv: int, cables: int) -> Row:
    """Return views of the quantities in a record."""
    return Row(
        _matrix(record, start, TIP, 4),
        _matrix(record, start, JACOBIAN, 6),
        _vector(record, start, CABLE_LENGTHS),
        _matrix(record, start, LENGTH_JACOBIAN, cables),
        _vector(record, start, GRAVITY_TORQUE),
        _matrix(record, start, GRAVITY, nv),
        _vector(record, start, RESIDUAL),
        _vector(record, start, ACTIVE).reshape((1, nv, nv)),
        _matrix(record, start, LOAD, nv),
        _vector(record, start, CABLE_STIFFNESS),
        _matrix(record, start, PASSIVE, nv),
        _matrix(record, start, JOINT, nv),
        Readings(
            _vector(record, start, MARGIN),
            _matrix(record, start, PSEUDOINVERSE, 3),
            _vector(record, start, ALONG),
            _matrix(record, start, COMPLIANCE, 6),
            _matrix(record, start, CARTESIAN, 3),
        ),
    )


@compiled
def _scratch(arm: Arm, nv: int) -> Scratch:
    bodies = arm.tree.parent.shape[0]
    return Scratch(
        Frames(
            np.empty((bodies, 3)),
            np.empty((bodies, 3)),
            np.empty(arm.tree.slide.shape),
            np.empty((arm.routing.row.shape[0], 3)),
        ),
        np.empty((bodies, 3, 3)),
        np.empty((nv, 3)),
        np.empty((bodies, 7)),
        np.zeros(arm.routing.fixed.shape[0], dtype=np.intp),  # all cables add to one matrix
    )


@inlined
def _vector(record: Array, start: Indices, quantity: int) -> Array:
    """Return a quantity of the record as a vector."""
    return record[start[quantity] : start[quantity + 1]]


@inlined
def _matrix(record: Array, start: Indices, quantity: int, rows: int) -> Array:
    """Return a quantity of the record as a matrix with the given number of rows."""
    part = record[start[quantity] : start[quantity + 1]]
    return part.reshape((rows, part.shape[0] // rows))


@compiled
def _is_beyond(q: Array, lowest: Array, highest: Array) -> bool:
    """Check whether an angle is beyond its limits."""
    beyond = False
    for i in range(q.shape[0]):
        beyond = beyond or q[i] < lowest[i] or q[i] > highest[i]
    return beyond


@compiled
def _clear(record: Array, first: int, end: int) -> None:
    for i in range(first, end):
        record[i] = 0.0


@compiled
def _set_residual(
    tension: Array, J: Array, wrench: Array, JX: Array, g: Array, residual: Array
) -> None:
    """Compute the residual of Eq. 13, J_Lᵀ F − J_Xᵀ W + g (nv,)."""
    for i in range(g.shape[0]):
        residual[i] = g[i]
        for a in range(6):
            residual[i] -= wrench[a] * JX[a, i]
    for c in range(J.shape[0]):
        for i in range(g.shape[0]):
            residual[i] += tension[c] * J[c, i]


@compiled
def _copy(record: Array, start: Indices, known: int, wanted: Indices, b: int, out: Array) -> None:
    """Copy the requested quantities to out[b]; NaN if their number is ``known`` or higher."""
    at = 0
    for w in range(wanted.shape[0]):
        first, end = start[wanted[w]], start[wanted[w] + 1]
        exists = wanted[w] < known
        for i in range(end - first):
            out[b, at + i] = record[first + i] if exists else math.nan
        at += end - first

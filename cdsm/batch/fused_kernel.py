"""Fused kernel: one kernel that computes the quantities of many postures up to K_θ, in blocks.

The physics is in :mod:`cdsm._former`, whose kernels this one calls. Memory is allocated once for
all blocks. Readings of K_θ, such as ``along``, are computed later from its results.
"""

from __future__ import annotations

import numpy as np

from cdsm._former.bodies import gravity_torque, set_gravity_stiffness, tip_jacobian
from cdsm._former.compiling import Index, Width, inlined, lanes, threaded, upwards
from cdsm._former.distribution import distribute, keep_balance, set_arms, set_torque
from cdsm._former.records import clear, copy, fetch, matrix, mirror, store, vector
from cdsm._former.segments import (
    SHORTEST_SEGMENT,
    add_length_hessian,
    segment_scratch,
    set_lengths,
)
from cdsm._former.serpentine_guess import empty_guess
from cdsm._former.serpentine_multipliers import set_proof
from cdsm._former.stiffness import (
    add_passive_stiffness,
    set_cable_stiffness,
    set_load_stiffness,
    sum_terms,
)
from cdsm._former.tension import Balance, certificate, set_infeasible
from cdsm._former.tree import Indices, empty_frames, forward_kinematics
from cdsm.batch.arguments import Arm, Asked, Kept, Rows
from cdsm.batch.layout import (
    ACTIVE,
    BEYOND_LIMITS,
    CABLE_LENGTHS,
    CABLE_STIFFNESS,
    COINCIDENT_SITES,
    GRAVITY,
    GRAVITY_TORQUE,
    INFEASIBLE,
    JACOBIAN,
    JOINT,
    LENGTH_JACOBIAN,
    LOAD,
    OK,
    OUTSIDE_ELASTICITY,
    PASSIVE,
    POSTPONED,
    RESIDUAL,
    TENSION,
    TIP,
    UNDECIDED,
    Codes,
)
from cdsm.support.values import Array


@threaded
def evaluate_rows(
    arm: Arm,
    given: Rows,
    asked: Asked,
    width: int,
    kept: Kept,
    balance: Balance,
    out: Array,
    status: Codes,
) -> None:
    """Fill the status (b,) and the requested quantities (b, …) of every posture, up to K_θ.

    Args:
        arm: The arm.
        given: The postures and their loads.
        asked: The requested quantities.
        width: W, the number of postures in a block.
        kept: Arrays to fill, from which the readings are computed.
        balance: Arrays (b, …) to fill with the moment arms and torques of UNDECIDED postures, and
            the tensions of POSTPONED ones. They have no rows if no tensions are distributed.
        out: To fill: the requested quantities, one row per posture; NaN where they do not exist.
        status: On entry OK, or the reason why no tensions were found; on return the status of each
            posture. UNDECIDED: the guess gave neither the tensions nor a proof that there are none.
            POSTPONED: the guess gave the tensions, but for less than two thirds of the postures of
            the block. Quantities that depend on tensions are then computed later, together with
            other such postures.
    """
    tree, routing, masses, blocks = arm.tree, arm.routing, arm.masses, arm.blocks
    start, stored, joint = asked.start, asked.stored, kept.joint
    rows, nv, cables, bodies = (
        given.q.shape[0],
        given.q.shape[1],
        routing.fixed.shape[0],
        tree.parent.shape[0],
    )

    # the quantities: views of a record, one after the other; the posture is the last axis of all
    record = np.zeros((start[start.shape[0] - 1], width))
    tip = matrix(record, start, TIP, 4)
    own_JX = matrix(record, start, JACOBIAN, 6)
    L = vector(record, start, CABLE_LENGTHS)
    J = matrix(record, start, LENGTH_JACOBIAN, cables)
    g = vector(record, start, GRAVITY_TORQUE)
    gravity = matrix(record, start, GRAVITY, nv)
    F = vector(record, start, TENSION)
    residual = vector(record, start, RESIDUAL)
    active = matrix(record, start, ACTIVE, nv)
    load = matrix(record, start, LOAD, nv)
    k = vector(record, start, CABLE_STIFFNESS)
    passive = matrix(record, start, PASSIVE, nv)
    K = matrix(record, start, JOINT, nv)

    # scratch, used again for every block
    angles, loads = np.empty((nv, width)), np.empty((6, width))
    stretched, least = np.empty((cables, width)), np.empty((cables, width))
    most, none = np.empty((cables, width)), np.empty((0, nv, width))
    frames, segments = empty_frames(tree, routing, width), segment_scratch(nv, width)
    rotation, carried = np.empty((bodies, 3, 3, width)), np.empty((bodies, 7, width))
    guess, check = empty_guess(blocks, nv, cables, width), certificate(nv, cables, width)
    arms, torque = np.empty((cables, nv, width)), np.empty((nv, width))
    zero = np.zeros((cables, width))
    six, shortest = np.empty((6, width)), np.empty(width)
    code, known = np.empty(width, dtype=np.intp), np.empty(width, dtype=np.intp)
    slot = np.zeros(cables, dtype=np.intp)

    for first in range(0, rows, width):
        block = first // width
        JX = kept.jacobian[block] if kept.jacobian.shape[0] else own_JX
        fetch(given.q, first, angles, width)
        fetch(given.wrench, first, loads, width)
        fetch(given.tension, first, F, width)
        fetch(given.low, first, least, width)
        fetch(given.high, first, most, width)
        fetch(given.rigidity, first, stretched, width)

        # quantities of the joint angles alone
        forward_kinematics(tree, routing, angles, six, rotation, frames, width)
        set_lengths(routing, frames, segments, L, J, shortest, width)
        tip_jacobian(tree.parent, masses, rotation, frames, tip, JX, width)
        if kept.jacobian.shape[0] and stored[JACOBIAN]:
            copy(JX, own_JX, width)
        gravity_torque(tree, masses, rotation, frames, carried, g, width)
        for w in lanes(width):
            code[w] = status[min(first + np.intp(w), rows - 1)]
            known[w] = GRAVITY + 1
            if shortest[w] < SHORTEST_SEGMENT:
                code[w], known[w] = COINCIDENT_SITES, 0
            if _is_beyond(angles, arm.lowest, arm.highest, w):
                code[w], known[w] = BEYOND_LIMITS, 0

        # quantities that need tensions
        reached = asked.last
        if asked.last > GRAVITY:
            set_torque(JX, loads, g, torque, width)
            if given.low.shape[0]:
                set_arms(J, arm.smallest_arm, arms, width)
                distribute(blocks, arms, torque, least, most, guess, check, F, width)
                for w in lanes(width):
                    if code[w] == OK and not (check.certified[w] == 1.0 and guess.failed[w] < 0.0):
                        code[w] = UNDECIDED
                failing = 0
                for w in lanes(width):
                    failing += 1 if code[w] == UNDECIDED and guess.failed[w] >= 0.0 else 0
                if failing and blocks.row.shape[0]:
                    set_proof(blocks, arms, guess, check.y, zero, width)
                    set_infeasible(arms, torque, least, most, guess.y, check, width)
                    for w in lanes(width):
                        if code[w] == UNDECIDED and check.certified[w] == 1.0:
                            code[w] = INFEASIBLE
                for w in lanes(width):
                    if code[w] == UNDECIDED and first + np.intp(w) < rows:
                        keep_balance(arms, torque, balance, first + np.intp(w), w)
                held = 0
                for w in lanes(width):
                    held += 1 if code[w] == OK else 0
                if asked.last > TENSION and 3 * held < 2 * width:
                    reached = TENSION
                    for w in lanes(width):
                        code[w] = POSTPONED if code[w] == OK else code[w]
                    for c in upwards(0, cables):
                        for w in lanes(min(width, rows - first)):
                            balance.tension[first + np.intp(w), c] = F[c, w]
            _note(code, LOAD, known, width)
        if reached > TENSION or stored[GRAVITY]:
            set_gravity_stiffness(tree.parent, carried, gravity, width)
            if stored[GRAVITY]:
                mirror(gravity, width)
        if reached > TENSION:
            if stored[RESIDUAL]:
                set_torque(J, F, torque, residual, width)
            clear(active, width)
            hessian = active.reshape(1, nv, nv, width)
            add_length_hessian(
                routing.segment, routing.joint, frames, F, slot, segments, hessian, width
            )
            if stored[ACTIVE]:
                mirror(active, width)
            set_load_stiffness(JX, loads, masses.tip_joints, load, six, width)

        # quantities that need the rigidity of the cables
        if reached > LOAD:
            if not given.rigidity.shape[0]:
                _set_linear(arm.linear, F, stretched, width)
            _note_outside(code, stretched, width)
            set_cable_stiffness(L, F, stretched, arm.series, arm.rest, k, width)
            clear(passive, width)
            add_passive_stiffness(J, k, passive, six, width)
            if stored[PASSIVE]:
                mirror(passive, width)
            own_K, sizes = (joint[block], kept.parts[block]) if joint.shape[0] else (K, none)
            sum_terms(active, passive, gravity, load, own_K, sizes, width)
            if joint.shape[0] and stored[JOINT]:
                copy(own_K, K, width)
            _note(code, JOINT, known, width)
        store(record, start, stored, code, known, first, out, status)


@inlined
def _note(code: Indices, number: int, known: Indices, width: Width) -> None:
    """Set ``known`` to ``number`` + 1 where ``code`` is OK: quantities 0 to ``number`` exist."""
    for w in lanes(width):
        if code[w] == OK:
            known[w] = number + 1


@inlined
def _set_linear(linear: Array, tension: Array, rigidity: Array, width: Width) -> None:
    """Fill ``rigidity`` (C, W) [N] with EA (1 + ε) of linear laws at F (C, W) [N]."""
    for c in range(tension.shape[0]):
        for w in lanes(width):
            rigidity[c, w] = linear[0, c] + linear[1, c] * tension[c, w]


@inlined
def _note_outside(code: Indices, rigidity: Array, width: Width) -> None:
    """Replace the code OK by OUTSIDE_ELASTICITY where a rigidity is negative."""
    for w in lanes(width):
        if code[w] == OK and _is_negative(rigidity, w):
            code[w] = OUTSIDE_ELASTICITY


@inlined
def _is_negative(rigidity: Array, w: Index) -> bool:
    negative = False
    for c in range(rigidity.shape[0]):
        negative = negative or rigidity[c, w] < 0.0
    return negative


@inlined
def _is_beyond(q: Array, lowest: Array, highest: Array, w: Index) -> bool:
    beyond = False
    for i in range(q.shape[0]):
        beyond = beyond or q[i, w] < lowest[i] or q[i, w] > highest[i]
    return beyond

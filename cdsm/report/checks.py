"""Check the terms of K_θ, balance (Eq. 13), and optimality of the tensions (Eq. 17).

The torques J_Lᵀ F, g and −J_Xᵀ W are compared with ∂U/∂θ of the potentials of cables, weight and
load, and the terms of K_θ with the derivatives of these torques: together, K_θ = ∂²U/∂θ². A moment
at the tip has no potential; its work by a small rotation takes its place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.differentiate import jacobian
from scipy.linalg import null_space
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from cdsm.batch.evaluation import evaluate
from cdsm.errors import CdsmError, listed
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.report import Comparison, Verdict
from cdsm.support.values import Array

TERMS = ("active", "passive", "gravity", "load", "springs", "joint")
TORQUES = ("cable torque", "gravity torque", "load torque")

TOLERANCE = 1e-6
"""Largest residual of balance, KKT residual and error of a term, relative to what they are of."""

_SMALL = 1e-3  # a term below this fraction of the whole is compared to this fraction of it
_SAME = 1e-10  # K and the batch agree to this fraction of the largest entry of K_θ
_EDGE = 0.01  # no derivative is taken within this fraction of F of an end of a law
_STEP = 1e-3  # largest step [rad], or in arm lengths
_CHANGE = 4e-3  # largest change of a tension in a step, as a fraction of the tension


def balance_error(K: Stiffness) -> tuple[float, str, float]:
    """Return the largest residual of Eq. 13 [N m], its joint, and the residual per torque [-]."""
    left = abs(K.residual * joint_unit(K))
    worst = int(left.argmax())
    most = float(left.max())
    return most, K.posture.arm.joint_names[worst], most / (float(_torque_sizes(K).sum()) or 1.0)


def optimality(K: Stiffness) -> tuple[float | None, float | None]:
    """Return ``bound_violation`` and ``kkt_residual`` of :class:`~cdsm.stiffness_matrix.Report`."""
    F = K.tension
    tension = K.distribution
    if tension is None:
        return None, None
    below = tension.minimum - F
    above = F - tension.maximum
    size = float(F.max()) or 1.0
    violation = max(0.0, float(np.maximum(below, above).max())) / size
    if not tension.least:
        return violation, None
    free = null_space((K.posture.length_jacobian * joint_unit(K)).T).T  # where J_L λ has no part
    low = below >= -TOLERANCE * size
    high = above >= -TOLERANCE * size
    bounds = np.hstack([-free[:, low], free[:, high]])
    left = nnls(bounds, -free @ F)[1] if bounds.size else np.linalg.norm(free @ F)
    return violation, float(left / (np.linalg.norm(F) or 1.0))


def compared(K: Stiffness) -> tuple[Comparison, ...]:
    """Compare the terms of K_θ, K_θ, the torques of Eq. 13, and the batch, in this order."""
    pose = K.posture
    arm = K.posture.arm
    W = K.wrench
    nv = K.posture.arm.nv
    unit = joint_unit(K)
    states = zip(arm.cables, K.tension, K.cable_stiffness, strict=True)
    moved = [c for c, (b, F, k) in enumerate(states) if b.control == "position" and F + k > 0.0]
    edge = listed([each for c in moved for each in _edges(K, c)], 3)

    def derived(places: Array) -> Array:
        """Compute three potentials and five torques (3 + 5 nv, …) at ``places`` (nv, …)."""
        poses = [arm.at(pose.q + x * unit, check_limits=False) for x in places.reshape(nv, -1).T]
        longer = np.array([each.cable_lengths for each in poses]) - pose.cable_lengths
        F = np.tile(K.tension, (len(poses), 1))
        stored = K.tension * longer
        for c in () if edge else moved:
            cable = arm.cables[c]
            free = float(K.free_lengths[c])
            start = K.tension[c]
            F[:, c] = cable.tension(cable.elongation(start, free) + longer[:, c], free)
            stored[:, c] = cable.energy(F[:, c], free) - cable.energy(start, free)
        rows = []
        for there, tension, energy in zip(poses, F, stored, strict=True):
            turn = Rotation.from_matrix(there.tip[:3, :3] @ pose.tip[:3, :3].T).as_rotvec()
            work = W[:3] @ (there.tip[:3, 3] - pose.tip[:3, 3]) + W[3:] @ turn
            weight = arm.body.potential_energy(there.q)
            J = there.length_jacobian
            g = there.gravity_torque
            J_X = there.jacobian
            torques = [K.tension @ J, (tension - K.tension) @ J, g, -W @ J_X, there.spring_torque]
            rows.append(
                np.concatenate([[energy.sum(), weight, -work], (np.array(torques) * unit).ravel()])
            )
        return np.asarray(np.array(rows).T / scale[:, None]).reshape(-1, *places.shape[1:])

    torques = np.array([K.tension @ pose.length_jacobian, pose.gravity_torque, -W @ pose.jacobian])
    terms = np.array([getattr(K, name) for name in TERMS]) * unit[:, None] * unit
    sizes = _torque_sizes(K)
    largest = abs(terms).max(axis=(1, 2))
    sizes = sizes + _SMALL * sizes.sum()
    largest = largest + _SMALL * largest[-1]
    scale = np.concatenate([sizes, np.repeat(largest[:-1], nv)])
    scale[scale == 0.0] = 1.0
    tolerances = {"atol": TOLERANCE / 10.0, "rtol": 0.0}
    failure = ""
    options = {"initial_step": _step(K, moved), "order": 4, "maxiter": 6}
    try:
        found = jacobian(derived, np.zeros(nv), tolerances=tolerances, **options)
        both = np.array([found.df, found.error]) * scale[:, None]
    except CdsmError as error:  # outside a law, or two sites meet
        both = np.zeros((2, scale.size, nv))
        failure = str(error)
    matrices = both[:, 3:].reshape(2, 5, nv, nv)
    matrices = np.concatenate([matrices, matrices.sum(axis=1, keepdims=True)], axis=1)
    why = [failure or (edge if name in ("passive", "joint") else "") for name in TERMS]
    return (
        *map(_compare, TERMS, terms, *matrices, TOLERANCE * largest, why),
        *map(_compare, TORQUES, torques * unit, *both[:, :3], TOLERANCE * sizes, [failure] * 3),
        _compare("batch", terms, _batch(K) * unit[:, None] * unit, 0.0, _SAME * largest[-1], ""),
    )


def _compare(
    name: str, given: Array, value: Array, error: Array | float, most: float, reason: str
) -> Comparison:
    """Compare ``given`` with another ``value`` of the estimated ``error``."""
    off = float(abs(given - value).max())
    bound = float(np.max(error))
    if not reason and most < off <= 3.0 * bound:
        reason = "the finite differences do not converge"
    unit = "N m" if name in TORQUES else "N m/rad"
    verdict: Verdict = "not possible" if reason else "agrees" if off <= most else "DIFFERS"
    return Comparison(name, unit, float(abs(given).max()), off, bound, verdict, reason)


def _batch(K: Stiffness) -> Array:
    """Compute the terms of K and K_θ (6, nv, nv) by :func:`cdsm.evaluate`."""
    arm = K.posture.arm
    slack = (K.tension == 0.0) & (K.cable_stiffness == 0.0)
    if slack.any():  # in an equilibrium, slack cables give nothing
        pairs = zip(arm.cables, slack, strict=True)
        arm = arm.with_cables([replace(b, control="force") if free else b for b, free in pairs])
    q = K.posture.q[None]
    batch = evaluate(arm, q, K.tension, K.wrench, TERMS, check_limits=False)
    return np.array([batch[name][0] for name in TERMS])


def _edges(K: Stiffness, c: int) -> list[str]:
    """Return why the tension of a cable cannot follow its length in both directions, if so."""
    cable = K.posture.arm.cables[c]
    F = float(K.tension[c])
    low = cable.elasticity.low
    high = cable.elasticity.high
    if F == 0.0:
        return [f"{cable.name} is slack (0 N), and K_θ counts it as if it were taut"]
    said = f"{cable.name} at {F:.4g} N is within {_EDGE:.0%} of an end of its law"
    near = min(abs(F - low), abs(F - high)) <= _EDGE * F
    return [f"{said}, {low:g} to {high:g} N"] if near else []


def _step(K: Stiffness, moved: list[int]) -> float:
    """Return the first step of the differences: small enough for all tensions."""
    rise = K.cable_stiffness * abs(K.posture.length_jacobian * joint_unit(K)).max(axis=1)
    taut = [c for c in moved if K.tension[c] * rise[c] > 0.0]
    return float(min([_STEP, *(_CHANGE * K.tension[taut] / rise[taut])]))


def joint_unit(K: Stiffness) -> Array:
    """Return the unit of each joint (nv,): 1 rad, or the arm's length [m] for a prismatic joint."""
    return np.where(K.posture.arm.slides, K.posture.arm.length, 1.0)


def _torque_sizes(K: Stiffness) -> Array:
    """Return the largest entries (3,) [N m] of |J_L|ᵀ F, |g| and |J_X|ᵀ |W|."""
    pose = K.posture
    pulled = K.tension @ abs(pose.length_jacobian)
    loaded = abs(K.wrench) @ abs(pose.jacobian)
    torques = np.array([pulled, abs(pose.gravity_torque), loaded]) * joint_unit(K)
    return np.asarray(torques.max(axis=1))

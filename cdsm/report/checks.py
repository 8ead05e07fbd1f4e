"""Check the terms of K_θ, balance (Eq. 13), and optimality of the tensions (Eq. 17).

The torque of each term is compared with ∂U/∂θ of its energy, and the term of K_θ with the
derivative of this torque: together, K_θ = ∂²U/∂θ². A moment at the tip has no potential; its work
by a small rotation takes its place.
"""

from __future__ import annotations

import numpy as np
from scipy.differentiate import jacobian
from scipy.linalg import null_space
from scipy.optimize import nnls

from cdsm.applied import without_cables
from cdsm.batch.evaluation import evaluate
from cdsm.batch.rows import without_kernel
from cdsm.definition import Term
from cdsm.errors import CdsmError, listed
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.report import Agreement, Comparison
from cdsm.stiffness_matrix.verdict import TOLERANCE, imbalance_of
from cdsm.support.values import Array
from cdsm.terms import ConstantPull, Stretch, torque_size

_SMALL = 1e-3  # a term below this fraction of the whole is compared to this fraction of it
_SAME = 1e-10  # K and the batch agree to this fraction of the largest entry of K_θ
_EDGE = 0.01  # no derivative is taken within this fraction of F of an end of a law
_STEP = 1e-3  # largest step [rad], or in arm lengths
_CHANGE = 4e-3  # largest change of a tension in a step, as a fraction of the tension


def balance_error(K: Stiffness) -> tuple[float, str, float]:
    """Return the largest residual of Eq. 13 [N m], its joint, and the residual per torque [-]."""
    joint, torque, relative = imbalance_of(K.posture, K.tension, K.applied, K.residual)
    return torque, K.posture.arm.joint_names[joint], relative


def optimality(K: Stiffness) -> tuple[float | None, float | None]:
    """Return ``bound_violation`` and ``kkt_residual`` of :class:`~cdsm.stiffness_matrix.Report`."""
    F = K.tension
    tension = K.distribution
    if tension is None:
        return None, None
    below = tension.minimum_held - F
    above = F - tension.maximum_held
    size = float(F.max()) or 1.0
    violation = max(0.0, float(np.maximum(below, above).max())) / size
    if not tension.least:
        return violation, None
    free = null_space(
        (K.posture.length_jacobian * K.posture.arm.levers).T
    ).T  # where J_L λ has no part
    low = below >= -TOLERANCE * size
    high = above >= -TOLERANCE * size
    bounds = np.hstack([-free[:, low], free[:, high]])
    left = nnls(bounds, -free @ F)[1] if bounds.size else np.linalg.norm(free @ F)
    return violation, float(left / (np.linalg.norm(F) or 1.0))


def compared(K: Stiffness) -> tuple[Comparison, ...]:
    """Compare the terms of K_θ, K_θ, the torques of all terms, and the batch, in this order."""
    pose = K.posture
    arm = pose.arm
    unit = K.posture.arm.levers
    terms = _terms(K)
    edge = listed([reason for c in _moved(K) for reason in _edges(K, c)], 3)
    followed = [term for term in terms if not edge or term.name != "passive"]

    def derived(places: Array) -> Array:
        """Compute n energies and n torques (n + n nv, …) at ``places`` (nv, …)."""
        places_of = places.reshape(arm.nv, -1).T
        poses = [arm.at(pose.q + x * unit, check_limits=False) for x in places_of]
        columns = []
        for moved in poses:
            energies = [term.energy(moved) for term in followed]
            columns.append(np.append(energies, [term.torque(moved) * unit for term in followed]))
        values = np.transpose(columns) / scale[:, None]
        return np.asarray(values.reshape(-1, *places.shape[1:]))

    names = [term.name for term in terms]
    torques = np.array([term.torque(pose) for term in terms]) * unit
    matrices = np.array([*K.terms.values(), K.joint]) * unit[:, None] * unit
    torque_sizes = _torque_sizes(K)
    torque_sizes = torque_sizes + _SMALL * torque_sizes[np.array(names) != "passive"].sum()
    sizes = abs(matrices).max(axis=(1, 2))
    sizes = sizes + _SMALL * sizes[-1]
    known = [names.index(term.name) for term in followed]
    scale = np.concatenate([torque_sizes[known], np.repeat(sizes[known], arm.nv)])
    scale[scale == 0.0] = 1.0

    slopes = np.zeros((2, len(terms), arm.nv))  # of the energies: values, and error estimates
    changes = np.zeros((2, len(terms) + 1, arm.nv, arm.nv))  # of the torques; last their sum
    failure = ""
    tolerances = {"atol": TOLERANCE / 10.0, "rtol": 0.0}
    options = {"initial_step": _step(K), "order": 4, "maxiter": 6}
    try:
        result = jacobian(derived, np.zeros(arm.nv), tolerances=tolerances, **options)
        both = np.array([result.df, result.error]) * scale[:, None]
        slopes[:, known] = both[:, : len(known)]
        changes[:, known] = both[:, len(known) :].reshape(2, -1, arm.nv, arm.nv)
        changes[:, -1] = changes[:, :-1].sum(axis=1)
    except CdsmError as error:  # outside a law, or two sites meet
        failure = str(error)
    rows = [*names, "joint"]
    torque_rows = [f"{name} torque" for name in names]
    why = [failure or edge * (name in ("passive", "joint")) for name in rows]
    return (
        *map(_compare, rows, matrices, *changes, TOLERANCE * sizes, why),
        *map(_compare, torque_rows, torques, *slopes, TOLERANCE * torque_sizes, why[:-1]),
        _batch_comparison(K, rows, matrices, _SAME * sizes[-1]),
    )


def _terms(K: Stiffness) -> tuple[Term, ...]:
    """Return the terms of the energy, with K's posture as their reference, in the order of K."""
    pose = K.posture
    wires = K.tension, K.cable_stiffness, K.free_lengths, pose.cable_lengths
    stretch = Stretch(*wires, motors=pose.arm.motors.yielding)
    return ConstantPull(K.tension), stretch, *without_cables(pose, K.applied, pose)


def _compare(
    name: str, matrix: Array, value: Array, error: Array | float, most: float, reason: str
) -> Comparison:
    """Compare a matrix or torque with another ``value`` of the estimated ``error``."""
    off = float(abs(matrix - value).max())
    bound = float(np.max(error))
    if not reason and most < off <= 3.0 * bound:
        reason = "the finite differences do not converge"
    unit = "N m" if name.endswith("torque") else "N m/rad"
    verdict: Agreement = "not possible" if reason else "agrees" if off <= most else "DIFFERS"
    return Comparison(name, unit, float(abs(matrix).max()), off, bound, verdict, reason)


def _batch_comparison(K: Stiffness, names: list[str], matrices: Array, most: float) -> Comparison:
    """Compare the terms of K and K_θ (n, nv, nv) with those of :func:`cdsm.evaluate`."""
    arm = K.posture.arm
    unit = K.posture.arm.levers
    if lacking := without_kernel(arm):
        return _compare("batch", matrices, matrices, 0.0, most, f"no kernel for {listed(lacking)}")
    slack = (K.tension == 0.0) & (K.cable_stiffness == 0.0)
    if slack.any():  # in an equilibrium, slack cables give nothing
        arm = arm.with_forced(slack)
    q = K.posture.q[None]
    batch = evaluate(arm, q, K.tension, K.applied, names, check_limits=False)
    values = np.array([batch[name][0] for name in names]) * unit[:, None] * unit
    return _compare("batch", matrices, values, 0.0, most, "")


def _moved(K: Stiffness) -> list[int]:
    """Return the numbers of the cables whose tension follows their length."""
    locked = K.posture.arm.cables.position_controlled
    moved: list[int] = np.flatnonzero(locked & (K.tension + K.cable_stiffness > 0.0)).tolist()
    return moved


def _edges(K: Stiffness, c: int) -> list[str]:
    """Return why the tension of a cable cannot follow its length in both directions, if so."""
    cable = K.posture.arm.cables[c]
    F = float(K.tension[c])
    low = cable.elasticity.low
    high = cable.elasticity.high
    if F == 0.0:
        return [f"{cable.name} is slack (0 N), and K_θ counts it as if it were taut"]
    problem = f"{cable.name} at {F:.4g} N is within {_EDGE:.0%} of an end of its law"
    near = min(abs(F - low), abs(F - high)) <= _EDGE * F
    return [f"{problem}, {low:g} to {high:g} N"] if near else []


def _step(K: Stiffness) -> float:
    """Return the first step of the differences: small enough for all tensions."""
    rise = K.cable_stiffness * abs(K.posture.length_jacobian * K.posture.arm.levers).max(axis=1)
    taut = [c for c in _moved(K) if K.tension[c] * rise[c] > 0.0]
    return float(min([_STEP, *(_CHANGE * K.tension[taut] / rise[taut])]))


def _torque_sizes(K: Stiffness) -> Array:
    """Return the largest magnitude (n,) [N m] of the torque of each term."""
    unit = K.posture.arm.levers
    return np.array([(torque_size(term, K.posture) * unit).max() for term in _terms(K)])

"""Find the equilibrium of a loaded arm whose motors are locked.

:func:`equilibrium` solves r(q) = 0 for the residual torque r, with ∂r/∂q = K_θ. The tension F(q) of
every position-controlled cable follows from its elongation, with nonlinear elasticity and series
springs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import EquilibriumError, InvalidInput
from cdsm.posture import Posture
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.locked_motors import Iterate, LoadedArm
from cdsm.statics.trust_region import RestSearch, find_rest
from cdsm.stiffness_matrix import stiffness
from cdsm.support.format import place
from cdsm.support.validation import wrench_vector
from cdsm.support.values import frozen
from cdsm.tension import Tension

_SMALLEST_STEP = 2.0**-6  # smallest load step that is tried

_CLOSE = 1e-3
"""Two sites of a cable meet if their distance is below this part of the reference distance."""


def equilibrium(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Equilibrium:
    """Compute the equilibrium of an arm under a dead wrench, its motors locked at a reference.

    Solve r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0 (Eq. 13). The elongation of a cable is its elongation at
    the reference plus its change of length. For a pure force the solution is a minimum of the
    potential of cables, weight and load: the search leaves saddle points, so an arm that buckles
    comes to rest away from the posture that became unstable. Joint limits act as stops.

    The whole load acts from the start. It is divided into steps only if the search fails. If
    several equilibria exist, slow loading (:func:`~cdsm.weight_test`) may reach another one.

    Args:
        pose: The reference posture, within the joint limits.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N], which need not balance the arm.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Default: the wrench
            of the ``Tension``, or zero.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`, or the posture is beyond a joint limit.
        ElasticityRangeError: A tension at the reference or at the equilibrium is outside the domain
            of its law. A law does not say how a cable becomes slack or yields.
        EquilibriumError: No equilibrium was found. The error names the part of the load that was
            reached. If two sites of a cable meet (disks overlap), it also names this cable.
    """
    reference = stiffness(pose, tension, None if isinstance(tension, Tension) else wrench)
    W = reference.wrench if wrench is None else wrench_vector("wrench", wrench)
    require_between_stops(pose)
    loaded = LoadedArm(pose, reference.tension, W)
    start = loaded.at(pose, reference.tension)
    # try the whole load first; in a smaller step a torque holds part of the load back
    imbalance, reached, step = start.torque, 0.0, 1.0
    while True:
        goal = min(1.0, reached + step)
        search = find_rest(loaded, start, (1.0 - goal) * imbalance)
        if search.converged and goal == 1.0:
            return settled(loaded, search)
        if search.converged:
            start, reached, step = search.state, goal, 2.0 * step
        elif step > _SMALLEST_STEP:
            step /= 2.0
        else:
            raise no_rest(pose, search, reached)


def require_between_stops(pose: Posture) -> None:
    """Raise InvalidInput if a joint is beyond its stop."""
    arm, q = pose.arm, pose.q
    beyond = arm._beyond_limits(q)
    if np.count_nonzero(beyond):
        i = int(beyond.argmax())
        unit = arm.joint_units[i]
        stop = arm.lower[i] if q[i] < arm.lower[i] else arm.upper[i]
        raise InvalidInput(
            "pose",
            f"{arm.joint_names[i]} = {place(q[i], unit)} is beyond its stop at "
            f"{place(stop, unit)}, where no motor can be locked; start within the joint limits, or "
            "widen joint_limit.",
        )


def settled(loaded: LoadedArm, search: RestSearch[Iterate]) -> Equilibrium:
    """Return the result of a converged ``search`` as an :class:`~cdsm.Equilibrium`.

    Raises ElasticityRangeError if a tension is outside the domain of its law.
    """
    K = search.state.K
    loaded.require_domains(K.tension)
    reaction = np.where(search.at_stop, K.residual, 0.0)
    return Equilibrium(
        reference=loaded.reference,
        reference_tension=loaded.tension,
        wrench=loaded.wrench,
        stiffness=K,
        reaction=frozen(reaction),
        residual=frozen(K.residual - reaction),
    )


def no_rest(
    reference: Posture, search: RestSearch[Any], reached: float, load: str = "the load"
) -> EquilibriumError:
    """Return the error of a ``search`` that found no equilibrium, to be raised by the caller.

    The arm was in equilibrium up to the part ``reached`` [-] of the load, which the error text
    calls ``load``. The error has the residual torque at the last iterate, and the name of the joint
    where it is largest. It also names a cable of which two neighbouring sites meet: their distance
    is less than 1/1000 of that at ``reference``.
    """
    pose = search.state.pose
    residual = frozen(np.where(search.at_stop, 0.0, search.state.torque))
    worst = int(abs(residual).argmax())
    joint = pose.arm.joint_names[worst]
    problem = (
        f"the arm finds no stable place to rest beyond {100.0 * reached:.3g} % of {load}; at the "
        f"last iterate {abs(residual[worst]):.4g} {pose.arm.torque_unit(worst)} are out of balance "
        f"at {joint}"
    )
    before, after = reference.cable_paths, pose.cable_paths
    for cable, *paths in zip(pose.arm.cables, before, after, strict=True):
        apart, left = (np.linalg.norm(np.diff(path, axis=0), axis=1) for path in paths)
        if (left < _CLOSE * apart).any():
            return EquilibriumError(
                f"{problem}, where two neighbouring sites of {cable.name} meet: disks touch there, "
                "and the cable has no direction",
                residual,
                reached,
                joint,
                "Set joint_limit to where disks touch, or leave it out; then the joint rests on "
                "its stop.",
            )
    return EquilibriumError(problem, residual, reached, joint)

"""Search for the equilibrium of a loaded arm whose motors are locked."""

from __future__ import annotations

from numpy.typing import ArrayLike

from cdsm.posture import Posture
from cdsm.statics.at_rest import Equilibrium
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import (
    Balance,
    Point,
    continued,
    equilibrium_error,
    settle,
    stable_between,
)
from cdsm.stiffness_matrix import stiffness
from cdsm.support.validation import wrench_vector
from cdsm.support.values import Array
from cdsm.tension import Tension


def equilibrium(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Equilibrium:
    """Compute the equilibrium of an arm under a dead wrench, its motors locked at a reference.

    Solve r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0 (Eq. 13). The elongation of a cable is its elongation at
    the reference plus its change of length. For a pure force the solution is a minimum of the
    potential of cables, weight and load: the search leaves saddle points, so an arm that buckles
    comes to rest away from the posture that became unstable. Joint limits act as stops.

    The whole load acts from the start. If several equilibria exist, slow loading
    (:func:`~cdsm.weight_test`) may reach another one.

    Args:
        pose: The reference posture, within the joint limits.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N], which need not balance the arm.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Default: the wrench
            of the ``Tension``, or zero.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`. The posture is beyond a joint limit.
        ElasticityRangeError: A tension at the reference or at the equilibrium is outside the domain
            of its law. A law does not say how a cable becomes slack or yields.
        EquilibriumError: No equilibrium was found. If two sites of a cable meet (disks overlap),
            the error names this cable.
    """
    K = stiffness(pose, tension, None if isinstance(tension, Tension) else wrench)
    W = K.wrench if wrench is None else wrench_vector("wrench", wrench)
    pose.arm._angles(pose.q, True)  # within the joint limits
    return locked_equilibrium(LockedArm(pose, K.tension, W))


def locked_equilibrium(arm: LockedArm) -> Equilibrium:
    """Return the equilibrium to which an arm descends from its reference; see :func:`equilibrium`.

    Raises ElasticityRangeError and EquilibriumError.
    """
    f = Balance(arm.at, arm.reference, arm.at_pose(arm.reference))
    found, converged = settle(f, arm.reference.q)
    if not converged:
        raise equilibrium_error(arm.reference, found, 0.0)
    return as_equilibrium(arm, found)


def followed(arm: LockedArm, before: Posture, stop_torque: Array) -> Point | None:
    """Follow a stable equilibrium while load or motors change a little, without a jump.

    It is at the posture ``before``, where the stops push with ``stop_torque`` (nv,) [N m].
    """
    f = Balance(arm.at, arm.reference, arm.at_pose(before))
    found = continued(f, (before.q / f.unit - stop_torque * f.unit / f.k,), before.q)
    if found is not None and stable_between(arm.at, before.q, found.state.pose.q):
        return found
    return None


def as_equilibrium(arm: LockedArm, found: Point, branch: float = 1.0) -> Equilibrium:
    """Return a solution as an Equilibrium; ElasticityRangeError if a tension is outside its law."""
    position = arm.reference.arm.cables.position_controlled
    return Equilibrium(
        reference=arm.reference,
        reference_tension=arm.tension,
        stiffness=arm.stiffness(found.state.pose),
        stop_torque=found.stop_torque,
        _model=arm,
        motors="tension" if arm.tension_held or not position.any() else "locked",
        branch=branch,
    )

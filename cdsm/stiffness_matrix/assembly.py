"""Compute K_θ from a posture, cable tensions and a wrench (Eq. 16)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, without_cables
from cdsm.definition import Term
from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike, loads_of
from cdsm.manipulator import ANOTHER_ARM
from cdsm.posture import Posture
from cdsm.stiffness_matrix.value import Stiffness
from cdsm.support.validation import NO_WRENCH, instance
from cdsm.support.values import Array, frozen, total
from cdsm.tension import Tension
from cdsm.terms import ConstantPull, Stretch


def stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: LoadsLike | None = None
) -> Stiffness:
    """Compute the joint stiffness with its terms (Eq. 16), and the Cartesian stiffness.

    `K_θ = H_L·F + J_Lᵀ K_L J_L + ∂g/∂θ − ∂(J_Xᵀ W)/∂θ` [N m/rad], and the stiffness of springs, if
    there are any: the derivative of the joint torque, motors and load held.

    Args:
        pose: The posture.
        tension: The result of :func:`~cdsm.distribute_tension` at this posture, or your own
            tensions (C,) [N], balanced or not; see :attr:`Stiffness.residual`.
        wrench: W (6,) at ``tool0`` in base axes, with your own tensions only: force [N], then
            moment [N m]; default zero. Or loads on any links: a dict of wrenches (6,) by link, or
            a list of :class:`~cdsm.Load`.

    Raises:
        InvalidInput: A shape is wrong, a tension negative, or of another posture or arm.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> print(f"{1e-3 * K.along('z'):.3f} N/mm, stable: {K.is_stable}")
        2.105 N/mm, stable: True
    """
    F, W = checked_tension(pose, tension, wrench)
    k = pose.arm.laws.stiffness(pose.cable_lengths, F)
    return assemble_stiffness(pose, F, W, k, tension if isinstance(tension, Tension) else None)


def checked_tension(
    pose: Posture, tension: Tension | ArrayLike, wrench: LoadsLike | None
) -> tuple[Array, Applied]:
    """Check the arguments of :func:`stiffness`; return tensions F (C,) [N], and what acts."""
    arm = instance("pose", pose, Posture).arm
    if not isinstance(tension, Tension):
        F = arm.cables.tension_vector(tension)
        return F, loads_of(arm, NO_WRENCH if wrench is None else wrench)
    if tension.posture is not pose:
        if not np.array_equal(tension.posture.q, pose.q):
            raise InvalidInput("tension", "is of another posture; distribute it at this one.")
        if not tension.posture.equals(pose):
            raise InvalidInput("tension", f"was distributed for {ANOTHER_ARM}")
    if wrench is not None:
        raise InvalidInput("wrench", "comes with the Tension; leave it out here.")
    return tension.values, tension.applied


def assemble_stiffness(
    pose: Posture,
    tension: Array,
    wrench: Applied,
    cable_stiffness: Array,
    distribution: Tension | None = None,
    free_length: Array | None = None,
) -> Stiffness:
    """Compute K_θ (Eq. 16) from checked, read-only arrays; :class:`Stiffness` explains them."""
    stretch = Stretch(tension, cable_stiffness, motors=pose.arm.motors.yielding)
    summands: tuple[Term, ...] = ConstantPull(tension), stretch, *without_cables(pose, wrench)
    terms = {term.name: frozen(term.stiffness(pose)) for term in summands}
    return Stiffness(
        posture=pose,
        tension=tension,
        applied=wrench,
        cable_stiffness=cable_stiffness,
        terms=terms,
        joint=frozen(total([*terms.values()])),
        free_length=free_length,
        distribution=distribution,
    )

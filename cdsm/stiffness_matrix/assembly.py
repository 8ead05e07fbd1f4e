"""Compute K_θ from a posture, cable tensions and a wrench (Eq. 16)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import ANOTHER_ARM
from cdsm.posture import Posture
from cdsm.stiffness_matrix.value import Stiffness
from cdsm.support.validation import NO_WRENCH, instance, vector, wrench_vector
from cdsm.support.values import Array
from cdsm.tension import Tension


def stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Stiffness:
    """Compute the joint stiffness with its four terms (Eq. 16), and the Cartesian stiffness.

    Args:
        pose: The posture.
        tension: The result of :func:`~cdsm.distribute_tension` at this posture, or your own
            tensions (C,) [N], not negative. These may be out of balance; see
            :attr:`Stiffness.residual`.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; default zero. Only
            for your own tensions, since a :class:`~cdsm.Tension` has its own wrench.

    Raises:
        InvalidInput: An argument has the wrong shape or is not numbers, a tension is negative, the
            tensions are of another posture or arm, or a wrench is given with a ``Tension``.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
    """
    F, W = checked_tension(pose, tension, wrench)
    k = pose.arm._laws.stiffness(pose.cable_lengths, F)
    return assemble(pose, F, W, k, tension if isinstance(tension, Tension) else None)


def checked_tension(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None
) -> tuple[Array, Array]:
    """Check the arguments of :func:`stiffness`; return tensions F (C,) [N] and wrench W (6,)."""
    arm = instance("pose", pose, Posture).arm
    if isinstance(tension, Tension):
        if not np.array_equal(tension.posture.q, pose.q):
            raise InvalidInput(
                "tension", "was distributed at another posture; distribute it at this one."
            )
        if not tension.posture._equals(pose):
            raise InvalidInput("tension", f"was distributed for {ANOTHER_ARM}")
        if wrench is not None:
            raise InvalidInput("wrench", "comes with the Tension; leave it out here.")
        F, W = tension.values, tension.wrench
    else:
        F = vector("tension", tension, len(arm.cables), "one tension [N] per cable", "tension")
        W = wrench_vector("wrench", NO_WRENCH if wrench is None else wrench)
        if np.count_nonzero(F < 0.0):
            c = int(F.argmin())
            raise InvalidInput(
                "tension", f"{F[c]:g} N given for {arm.cables[c].name}; cables only pull."
            )
    return F, W


def assemble(
    pose: Posture,
    tension: Array,
    wrench: Array,
    cable_stiffness: Array,
    distribution: Tension | None = None,
    free_length: Array | None = None,
) -> Stiffness:
    """Compute K_θ (Eq. 16) from arguments that are checked, and arrays that are read-only.

    ``tension`` is F (C,) [N], ``wrench`` W (6,) and ``cable_stiffness`` the diagonal of K_L (C,)
    [N/m]. ``distribution`` and ``free_length`` are stored in the result; see :class:`Stiffness`.
    """
    active, passive, load, parts, joint = pose._joint_stiffness(tension, cable_stiffness, wrench)
    return Stiffness(
        posture=pose,
        tension=tension,
        wrench=wrench,
        cable_stiffness=cable_stiffness,
        active=active,
        passive=passive,
        gravity=pose.gravity_stiffness,
        load=load,
        joint=joint,
        _parts=parts,
        free_length=free_length,
        distribution=distribution,
    )

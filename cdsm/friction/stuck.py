"""Stiffness of an arm whose cables stick in all their holes, or slide in some of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdsm.friction.sticking import Flags, tension_gradient
from cdsm.posture import Posture, load_stiffness
from cdsm.stiffness_matrix import Friction, Stiffness, checked_tension
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension


def stuck_stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Stiffness:
    """Compute the stiffness while all cables stick: weights below :func:`breakaway` measure it.

    All segments of a cable have its tension F, as after shaking the arm. Each segment j between two
    holes is a separate spring k_j = EA(F)/a_j with the length l_j and the natural length a_j (at
    zero strain): K_θ = Σ_j (F H_j + k_j g_j g_jᵀ) + gravity + load, with g_j = ∂l_j/∂θ and H_j =
    ∂²l_j/∂θ². If the cable sticks in its first hole, lead, series spring and force-controlled motor
    have no effect. A cable cannot stick in a hole without friction, or through which it goes
    straight: the segments on both sides are one spring. Without friction, K_θ is that of
    :func:`~cdsm.stiffness`. With friction, it is larger: the difference is positive semidefinite.

    :func:`~cdsm.stiffness` explains the arguments and the errors.
    """
    F, W = checked_tension(pose, tension, wrench)
    T = F[pose.segments.chains.cable]
    none = np.zeros(len(pose.segments.wrap), dtype=np.bool_)
    given = tension if isinstance(tension, Tension) else None
    return assemble_segments(pose, T, none, W, "stuck", given)


def assemble_segments(
    pose: Posture,
    tension: Array,
    sliding: Flags,
    wrench: Array,
    friction: Friction,
    distribution: Tension | None = None,
) -> Stiffness:
    """Compute the stiffness from checked tensions T (S,) [N] of the segments.

    ``sliding`` (P,) marks the holes in which cables slide. The result stores ``friction``
    (``"stuck"`` or ``"sliding"``) and ``distribution``.
    """
    segments = pose.segments
    gradient = tension_gradient(pose, tension, sliding)
    active = segments.active(tension)
    passive = segments.length_jacobian.T @ gradient
    if friction == "stuck":
        passive = (passive + passive.T) / 2.0  # symmetric but for rounding
    load = load_stiffness(pose.jacobian, wrench, pose.arm._body.tip_joints)
    F = tension[segments.chains.start[:-1]]
    return Stiffness(
        posture=pose,
        tension=frozen(F),
        wrench=wrench,
        cable_stiffness=pose.arm._laws.stiffness(pose.cable_lengths, F),
        active=frozen(active),
        passive=frozen(passive),
        gravity=pose.gravity_stiffness,
        load=frozen(load),
        joint=frozen(active + passive + pose.gravity_stiffness + load),
        distribution=distribution,
        friction=friction,
        segment_tension=frozen(tension),
        tension_gradient=gradient,
    )

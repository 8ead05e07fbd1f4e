"""Stiffness of an arm whose cables stick in all their holes, or slide in some of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.kernels.stiffness import single_load_stiffness
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Friction, Stiffness, checked_tension
from cdsm.stiffness_matrix.sticking import Flags, tension_gradient
from cdsm.support.validation import NO_WRENCH, instance, number_array, vector, wrench_vector
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

_RATIO = 1e-9  # largest relative deviation of a ratio of tensions that counts as rounding


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


def sliding_stiffness(
    pose: Posture, tension: ArrayLike, sliding: ArrayLike, wrench: ArrayLike | None = None
) -> Stiffness:
    """Compute the stiffness while cables slide in some holes, in the given directions.

    The segments on both sides of such a hole share their wire, and the ratio of their tensions
    stays exp(±μ φ). K_θ = Σ_j (T_j H_j + g_j ∂T_j/∂θ) + gravity + load, with the tension T_j, the
    gradient g_j and the Hessian H_j of the length of segment j. It is not symmetric, and may be
    softer than the frictionless stiffness in some joint motions. It is valid as long as the cables
    slide in the same holes and directions.

    Args:
        pose: The posture.
        tension: T (S,) [N] of the segments of :attr:`Posture.segments`, not negative; or F (C,) [N]
            at the actuators, from which the tensions beyond each sliding hole follow.
        sliding: One sign per hole of :attr:`Posture.segments`, (P,): 0 where the cable sticks; 1
            where the tension of the next segment, farther from the motor, is larger by the factor
            exp(μ φ); −1 where it is smaller by this factor.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; default zero.

    Raises:
        InvalidInput: An argument has the wrong shape or is not numbers, a tension is negative, or
            friction does not allow the ratio of the tensions on both sides of a hole.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
    """
    chains = instance("pose", pose, Posture).segments.chains
    signs = vector("sliding", sliding, len(chains.hole), "one sign per hole")
    wrong = np.flatnonzero(~np.isin(signs, (-1.0, 0.0, 1.0)))
    if wrong.size:
        hole = int(wrong[0])
        raise InvalidInput(
            "sliding", f"{signs[hole]:g} given for hole {hole + 1}; a sign is -1, 0 or 1."
        )
    T = number_array("tension", tension, "tension")
    grip = signs * chains.friction * pose.segments.wrap
    if T.shape == (len(pose.arm.cables),) and len(T) != len(chains.segments):
        step = np.zeros(len(chains.segments))
        step[chains.hole + 1] = grip
        total = np.cumsum(step)
        T = (T * np.exp(-total[chains.start[:-1]]))[chains.cable] * np.exp(total)
    T = vector("tension", T, len(chains.segments), "one tension [N] per segment, or per cable")
    if T.min() < 0.0:
        raise InvalidInput("tension", f"{T.min():g} N given; cables only pull.")
    _require_friction(pose, T, signs)
    W = wrench_vector("wrench", NO_WRENCH if wrench is None else wrench)
    return assemble_segments(pose, T, signs != 0.0, W, "sliding")


def _require_friction(pose: Posture, tension: Array, signs: Array) -> None:
    """Raise InvalidInput if friction does not allow the ratio of tensions at one of the holes.

    ``tension`` is (S,) [N]. ``signs`` (P,) is the argument ``sliding`` of
    :func:`sliding_stiffness`: where the cable slides, the ratio must be exp(±μ φ).
    """
    chains = pose.segments.chains
    before, after = tension[chains.hole], tension[chains.hole + 1]
    grip = np.exp(pose.segments.grip)
    low, high = np.where(signs > 0.0, grip, 1.0 / grip), np.where(signs < 0.0, 1.0 / grip, grip)
    beyond = (after < before * low * (1.0 - _RATIO)) | (after > before * high * (1.0 + _RATIO))
    if beyond.any():
        hole = int(beyond.argmax())
        cable = pose.arm.cables[chains.cable[chains.hole[hole]]]
        raise InvalidInput(
            "tension",
            f"{before[hole]:.6g} and {after[hole]:.6g} N beside site {chains.site[hole] + 1} of "
            f"{cable.name}: the ratio is {low[hole]:.6g} to {high[hole]:.6g} in this "
            "posture. A LoadHistory has the posture of each load, pose(i), and stiffness(i).",
        )


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
    model, segments = pose.arm._model, pose.segments
    gradient = tension_gradient(pose, tension, sliding)
    active = segments.tension_stiffness(tension).sum(axis=0)
    passive = segments.length_jacobian.T @ gradient
    if friction == "stuck":
        passive = (passive + passive.T) / 2.0  # symmetric but for rounding
    load = single_load_stiffness(pose.jacobian, wrench, model.masses.tip_joints)
    terms = active, passive, pose.gravity_stiffness, load
    F = tension[segments.chains.start[:-1]]
    return Stiffness(
        posture=pose,
        tension=frozen(F),
        wrench=wrench,
        cable_stiffness=model.laws.stiffness(pose.cable_lengths, F),
        active=frozen(active),
        passive=frozen(passive),
        gravity=pose.gravity_stiffness,
        load=frozen(load),
        joint=frozen(active + passive + pose.gravity_stiffness + load),
        _parts=frozen(np.sum(np.abs(terms), axis=0)),
        distribution=distribution,
        friction=friction,
        segment_tension=frozen(tension),
        tension_gradient=gradient,
    )

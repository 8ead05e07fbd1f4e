"""Small vibrations of an arm about a posture: K_θ φ = ω² M φ.

M is the joint-space mass matrix of the links; cables have no mass here. Where K_θ is not positive
definite a motion does not vibrate but grows, and has a rate instead of a frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from scipy.linalg import eigh

from cdsm._checks import Array, ReadOnlyState, frozen, instance
from cdsm.errors import InvalidInput, SingularMass
from cdsm.posture import Posture
from cdsm.stiffness import Stiffness
from cdsm.urdf import CROSS_INERTIA, CROSS_MASS

_MASSLESS = 1e-12
"""An eigenvalue of M this part of the largest is that of a motion without mass."""

_STAND_IN = 0.02
"""Part of a motion's kinetic energy that may be in stand-in masses: 1 % of its frequency."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Modes(ReadOnlyState):
    """Natural modes of an arm, with the stiffness they follow from; made by :func:`modes`.

    Of the nv modes S vibrate and the others, none if the arm is stable, grow. All arrays are
    read-only. Shapes are columns of joint angles, mass-normalised and orthogonal in M and K_θ:
    φᵀMφ = 1 and φᵀK_θφ = ω², so their unit is rad/(√kg m); the largest entry is positive.

    Attributes:
        stiffness: K_θ with the posture, tensions and wrench it belongs to.
        mass: M (nv, nv) [kg m²].
        frequencies: ω/2π (S,) [Hz], the lowest first.
        shapes: φ of the modes that vibrate (nv, S) [rad/(√kg m)].
        growth_rates: √(−ω²) of the modes that do not (n,) [1/s], the fastest first: a deflection
            grows by e in the inverse of it.
        growth_shapes: φ of these (nv, n) [rad/(√kg m)].
    """

    stiffness: Stiffness
    mass: Array
    frequencies: Array
    shapes: Array
    growth_rates: Array
    growth_shapes: Array

    @property
    def is_stable(self) -> bool:
        """Whether all modes vibrate."""
        return not self.growth_rates.size

    def __repr__(self) -> str:
        name = self.stiffness.posture.arm.name
        if not self.is_stable:
            return f"<Modes of {name}, UNSTABLE>"
        return f"<Modes of {name}, {self.frequencies[0]:.4g} to {self.frequencies[-1]:.4g} Hz>"

    def __str__(self) -> str:
        rows = [f"{'mode':<6}{'frequency [Hz]':>16}  {'moves most':<12}"]
        rows += [
            f"{number:<6}{frequency:>16.4g}  {joint:<12}".rstrip()
            for number, (frequency, joint) in enumerate(
                zip(self.frequencies, self._leading(self.shapes), strict=True), start=1
            )
        ]
        rows += [
            f"UNSTABLE: a deflection, most of it at {joint}, grows by e in {1.0 / rate:.4g} s"
            if rate
            else f"UNSTABLE: a deflection, most of it at {joint}, meets no resistance"
            for rate, joint in zip(
                self.growth_rates.tolist(), self._leading(self.growth_shapes), strict=True
            )
        ]
        return "\n".join(rows)

    def _leading(self, shapes: Array) -> list[str]:
        """Name of the joint that moves most in each shape."""
        names = self.stiffness.posture.arm.joint_names
        return [names[i] for i in abs(shapes).argmax(axis=0)]


def modes(pose: Posture, stiffness: Stiffness) -> Modes:
    """Natural frequencies and mode shapes at a posture: K_θ φ = ω² M φ.

    K_θ is taken by its symmetric part, which it is but under a moment at the tip. The modes are
    those of a small vibration about the posture if the tensions balance the arm there, see
    :attr:`Stiffness.residual <cdsm.stiffness.Stiffness.residual>`; friction and damping are left
    out.

    Args:
        pose: The posture.
        stiffness: K_θ there, the answer of :func:`~cdsm.stiffness.stiffness` at this posture.

    Returns:
        The modes. An arm that buckles is an answer: its ``is_stable`` is false.

    Raises:
        InvalidInput: The stiffness is that of another posture.
        SingularMass: A motion of the arm moves no link of any mass, so it has no frequency.
    """
    arm = instance("pose", pose, Posture).arm
    there = instance("stiffness", stiffness, Stiffness).posture
    if there is not pose and not (there.arm == arm and np.array_equal(there.q, pose.q)):
        raise InvalidInput("stiffness", "was taken at another posture; take it at this one.")
    M = arm._body.mass_matrix(pose.q)
    spectrum, motions = np.linalg.eigh(M)
    if spectrum[0] <= _MASSLESS * spectrum[-1]:
        motion = motions[:, 0]
        raise SingularMass(
            f"a motion of {arm.joint_names[int(abs(motion).argmax())]} moves no link of any mass. "
            "Give the links a mass and moments of inertia.",
            frozen(motion.copy()),
        )
    shares, motions = eigh(_stand_in_mass(pose), M)
    if shares[-1] > _STAND_IN:
        motion = motions[:, -1] / np.linalg.norm(motions[:, -1])
        raise SingularMass(
            f"a motion of {arm.joint_names[int(abs(motion).argmax())]} moves links of no mass, or "
            f"of hardly any: {100.0 * shares[-1]:.3g} % of its kinetic energy is that of crosses "
            "and massless links, whose mass only stands in. Give the links their link_mass.",
            frozen(motion),
        )
    squares, shapes = eigh((stiffness.joint + stiffness.joint.T) / 2.0, M)
    largest = np.take_along_axis(shapes, abs(shapes).argmax(axis=0)[None], axis=0)
    shapes = shapes * np.sign(largest)
    vibrates = squares > 0.0
    return Modes(
        stiffness=stiffness,
        mass=frozen(M),
        frequencies=frozen(np.sqrt(squares[vibrates]) / (2.0 * math.pi)),
        shapes=frozen(shapes[:, vibrates]),
        growth_rates=frozen(np.sqrt(-squares[~vibrates])),
        growth_shapes=frozen(shapes[:, ~vibrates]),
    )


def _stand_in_mass(pose: Posture) -> Array:
    """The part of M (nv, nv) that crosses and massless links have, so that simulators take them."""
    M = np.zeros((pose.arm.nv, pose.arm.nv))
    if not pose.arm.is_serpentine:
        return M
    origin, axis = pose._frames.origin[1:], pose._frames.axis[1:]
    for k, (joint, link) in enumerate(
        zip(pose.arm.geometry.joints, pose.arm.geometry.links, strict=True), start=1
    ):
        stand_ins = {f"cross{k}": 0.0} if len(joint.axes) == 2 else {}
        if link.mass == 0.0:
            stand_ins[f"link{k}"] = link.length / 2.0
        for name, x in stand_ins.items():
            place = pose.link_pose(name)
            moved = pose.arm._body.locate(name)[0]
            angular = axis[:moved]
            linear = np.cross(angular, place[:3, 3] + x * place[:3, 0] - origin[:moved])
            M[:moved, :moved] += (
                CROSS_MASS * linear @ linear.T + CROSS_INERTIA * angular @ angular.T
            )
    return M

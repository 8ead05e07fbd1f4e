"""Small vibrations of an arm about a posture: K_θ φ = ω² M φ.

M is the joint-space mass matrix of the links. Cables have no mass here. If K_θ is not positive
definite, some motions grow exponentially. Such a motion has a growth rate instead of a frequency.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, final

import numpy as np
from scipy.linalg import eigh

import cdsm
from cdsm.errors import InvalidInput, SingularMass
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import aligned
from cdsm.support.result import Result, unit
from cdsm.support.validation import instance
from cdsm.support.values import Array, frozen
from cdsm.urdf import CROSS_INERTIA, CROSS_MASS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MASSLESS = 1e-12  # a motion has no mass if its eigenvalue of M is below this part of the largest

_STAND_IN = 0.02
"""Largest part of a mode's kinetic energy that placeholder masses of massless links may have.

With this part they lower the frequency by 1 %.
"""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Modes(Result):
    """Natural modes of an arm and the stiffness from which they follow; made by :func:`modes`.

    S of the nv modes vibrate. The other modes grow; a stable arm has none of them. All arrays are
    read-only. Shapes are columns of joint angles, mass-normalised and orthogonal in M and K_θ:
    φᵀMφ = 1 and φᵀK_θφ = ω². A shape has the unit rad/(√kg m); its largest entry is positive.

    Attributes:
        stiffness: K_θ with its posture, tensions and wrench.
        mass: M (nv, nv) [kg m²].
        frequencies: ω/2π (S,) [Hz], ascending.
        shapes: φ of the modes that vibrate (nv, S) [rad/(√kg m)].
        growth_rates: √(−ω²) of the modes that grow (n,) [1/s], the fastest first. A deflection
            grows by a factor e in the time 1/rate.
        growth_shapes: φ of the modes that grow (nv, n) [rad/(√kg m)].
    """

    _headline = "frequencies"

    stiffness: Stiffness
    mass: Array = field(metadata=unit("kg m²", "joint", "joint_column"))
    frequencies: Array = field(metadata=unit("Hz", "mode"))
    shapes: Array = field(metadata=unit("1", "joint", "mode"))
    growth_rates: Array = field(metadata=unit("1/s", "growth"))
    growth_shapes: Array = field(metadata=unit("1", "joint", "growth"))

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    @property
    def is_stable(self) -> bool:
        """Whether all modes vibrate."""
        return not self.growth_rates.size

    def plot(self) -> Figure:
        """Plot the arm in mm, deflected by a few modes: growing modes first, then the lowest."""
        return cdsm.plots.plot_modes(self)

    def __str__(self) -> str:
        found = zip(self.frequencies, self._leading(self.shapes), strict=True)
        rows = aligned(
            [("mode", "frequency [Hz]", "moves most")]
            + [(str(k), f"{frequency:.4g}", joint) for k, (frequency, joint) in enumerate(found, 1)]
        )
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
        """Return the name of the joint that moves most in each of the ``shapes`` (nv, n)."""
        names = self.stiffness.posture.arm.joint_names
        return [names[i] for i in abs(shapes).argmax(axis=0)]


def modes(pose: Posture, stiffness: Stiffness) -> Modes:
    """Compute natural frequencies and mode shapes at a posture: K_θ φ = ω² M φ.

    The symmetric part of K_θ is used. A skew part, which a moment at the tip or sliding cables add,
    is left out. The modes describe a small vibration about the posture, without losses by friction
    or damping. They are valid only if the tensions balance the arm there, see
    :attr:`Stiffness.residual <cdsm.Stiffness.residual>`.

    Args:
        pose: The posture.
        stiffness: K_θ, the result of :func:`~cdsm.stiffness` at this posture.

    Returns:
        The modes. If the arm buckles, ``is_stable`` is false; this is not an error.

    Raises:
        InvalidInput: ``stiffness`` belongs to another posture or arm.
        SingularMass: A motion of the arm moves only massless links, so it has no frequency.
    """
    arm = instance("pose", pose, Posture).arm
    if not instance("stiffness", stiffness, Stiffness).posture._equals(pose):
        raise InvalidInput(
            "stiffness", "belongs to another posture or arm; compute it for this one."
        )
    M = arm._body.mass_matrix(pose.q)
    spectrum, motions = np.linalg.eigh(M)
    if spectrum[0] <= _MASSLESS * spectrum[-1]:
        raise _massless(pose, motions[:, 0])
    shares, motions = eigh(_stand_in_mass(pose), M)
    if shares[-1] > _STAND_IN:
        motion = motions[:, -1] / np.linalg.norm(motions[:, -1])
        raise SingularMass(
            f"a motion of {arm.joint_names[int(abs(motion).argmax())]} moves links of no mass, or "
            f"of hardly any: {100.0 * shares[-1]:.3g} % of its kinetic energy is that of crosses "
            "and massless links, which have placeholder masses. Give the links their link_mass.",
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
    """Compute the part of the mass matrix M (nv, nv) [kg m²] that placeholder masses add.

    The URDF gives such masses to massless links and to the crosses of universal joints.
    """
    if not pose.arm.is_serpentine:
        return np.zeros((pose.arm.nv, pose.arm.nv))
    inertia, stand_ins = CROSS_INERTIA * np.eye(3), []
    for k, (joint, link) in enumerate(
        zip(pose.arm.geometry.joints, pose.arm.geometry.links, strict=True), start=1
    ):
        if len(joint.axes) == 2:
            stand_ins.append(Carried(f"cross{k}", CROSS_MASS, np.zeros(3), inertia))
        if link.mass == 0.0:
            centre = np.array([link.length / 2.0, 0.0, 0.0])
            stand_ins.append(Carried(f"link{k}", CROSS_MASS, centre, inertia))
    return mass_matrix(pose, stand_ins)


def motions(stiffness: Stiffness, M: Array) -> tuple[Array, Array]:
    """Solve K_θ φ = ω² M φ: return ω² (nv,) [1/s²], ascending, and the shapes φ (nv, nv).

    The shapes are columns with φᵀMφ = 1. M is (nv, nv). Raises SingularMass if it is not positive
    definite.
    """
    # scaled by joint: the mass of the last link may be rounding beside that of the arm
    unit = 1.0 / np.sqrt(M.diagonal())
    K, M = (matrix * unit * unit[:, None] for matrix in (stiffness.joint, M))
    try:
        squares, shapes = eigh((K + K.T) / 2.0, M)
    except np.linalg.LinAlgError:  # M is not positive definite
        raise _massless(stiffness.posture, unit * np.linalg.eigh(M)[1][:, 0]) from None
    return squares, unit[:, None] * shapes


def _massless(pose: Posture, motion: Array) -> SingularMass:
    joint = pose.arm.joint_names[int(abs(motion).argmax())]
    return SingularMass(
        f"a motion of {joint} moves no link of any mass. "
        "Give the links a mass and moments of inertia.",
        frozen(motion / np.linalg.norm(motion)),
    )


class Carried(NamedTuple):
    """Rigid body that a link carries; its centre and inertia are in the frame of the link."""

    link: str
    mass: float  # m [kg]
    centre: Array  # centre of mass (3,) [m]
    inertia: Array  # I about the centre of mass (3, 3) [kg m²]


def mass_matrix(pose: Posture, carried: Iterable[Carried]) -> Array:
    """Compute the joint-space mass matrix (nv, nv) [kg m²] of the bodies ``carried`` alone.

    M = Σ (m J_vᵀ J_v + J_ωᵀ I J_ω). J_v and J_ω are the Jacobians of the velocity of the centre of
    mass and of the angular velocity of a body.
    """
    body, M = pose.arm._body, np.zeros((pose.arm.nv, pose.arm.nv))
    for link, mass, centre, inertia in carried:
        place = pose.link_pose(link)
        joints = np.array(body.joints_to(body.locate(link)[0]), dtype=np.intp) - 1
        angular, R = pose._twist[3:, joints], place[:3, :3]
        linear = pose._twist[:3, joints] + np.cross(angular.T, R @ centre + place[:3, 3]).T
        turned = angular.T @ R
        M[np.ix_(joints, joints)] += mass * linear.T @ linear + turned @ inertia @ turned.T
    return M

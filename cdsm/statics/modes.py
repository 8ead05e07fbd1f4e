"""Small vibrations of an arm about a posture: K_θ φ = ω² M φ.

M is the joint-space mass matrix of the links; cables have no mass. If K_θ is not positive definite,
some motions grow exponentially, with a growth rate instead of a frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import final

import numpy as np

from cdsm.errors import SingularStiffness
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import aligned
from cdsm.support.result import Result, unit
from cdsm.support.validation import instance
from cdsm.support.values import Array, Plotted, frozen
from cdsm.urdf import placeholder_of

_LIGHT = 50.0  # a joint that moves less than so many times the placeholders moves no mass


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Modes(Result, Plotted):
    """Natural modes of an arm and the stiffness from which they follow; made by :func:`modes`.

    S of the nv modes vibrate. The other modes grow; a stable arm has none of them. Shapes are
    columns of joint angles, mass-normalised and orthogonal in M and `K_θ`: `φᵀ M φ = 1` and
    `φᵀ K_θ φ = ω²`. A shape has the unit [rad/(√kg m)]; its largest entry is positive.

    Attributes:
        stiffness: `K_θ` with its posture, tensions and wrench.
        mass: M (nv, nv) [kg m²].
        frequencies: ω/2π (S,) [Hz], ascending.
        shapes: φ of the modes that vibrate (nv, S) [rad/(√kg m)].
        growth_rates: `√(−ω²)` of the modes that grow (n,) [1/s], the fastest first. A deflection
            grows by a factor e in the time 1/rate.
        growth_shapes: φ of the modes that grow (nv, n) [rad/(√kg m)].
    """

    _headline = "frequencies"
    _posture_from = "stiffness.posture"
    _figure = "plot_modes"

    stiffness: Stiffness
    mass: Array = field(metadata=unit("kg m²", "joint", "joint_column"))
    frequencies: Array = field(metadata=unit("Hz", "mode"))
    shapes: Array = field(metadata=unit("1", "joint", "mode"))
    growth_rates: Array = field(metadata=unit("1/s", "growth"))
    growth_shapes: Array = field(metadata=unit("1", "joint", "growth"))

    @property
    def is_stable(self) -> bool:
        """Whether all modes vibrate."""
        return not self.growth_rates.size

    def __str__(self) -> str:
        names = np.array(self.stiffness.posture.arm.joint_names)
        leading = [
            names[abs(shapes).argmax(axis=0)] for shapes in (self.shapes, self.growth_shapes)
        ]
        rows = [("mode", "frequency [Hz]", "moves most")]
        for k, frequency in enumerate(self.frequencies):
            rows.append((str(k + 1), f"{frequency:.4g}", leading[0][k]))
        lines = aligned(rows)
        for rate, joint in zip(self.growth_rates.tolist(), leading[1], strict=True):
            grows = f"grows by e in {1.0 / rate:.4g} s" if rate else "meets no resistance"
            lines.append(f"UNSTABLE: a deflection, most of it at {joint}, {grows}")
        return "\n".join(lines)


def modes(stiffness: Stiffness) -> Modes:
    """Compute natural frequencies and mode shapes at the posture of a stiffness: `K_θ φ = ω² M φ`.

    The symmetric part of `K_θ` is used. A skew part, which a moment at the tip or sliding cables
    add, is left out. The modes describe a small vibration about the posture, without losses by
    friction or damping. They are valid only if the tensions balance the arm there, see
    :attr:`Stiffness.residual <cdsm.Stiffness.residual>`. If the arm buckles, ``is_stable`` is
    false; this is not an error.

    Args:
        stiffness: `K_θ`, the result of :func:`~cdsm.stiffness`; it has its posture.

    Raises:
        InvalidInput: ``stiffness`` is no Stiffness.
        SingularStiffness: A joint moves no mass, or hardly more than the placeholders of crosses
            and massless links.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> cdsm.modes(K).frequencies[:2].round(2).tolist()  # Hz
        [10.24, 10.97]
    """
    pose = instance("stiffness", stiffness, Stiffness).posture
    arm = pose.arm
    M = arm.body.mass_matrix(pose.q)
    if arm.is_serpentine:
        _require_mass(pose, M)
    squares, shapes = vibrations(stiffness, M)
    shapes *= np.sign(shapes[abs(shapes).argmax(axis=0), np.arange(arm.nv)])
    vibrates = squares > 0.0
    return Modes(
        stiffness=stiffness,
        mass=frozen(M),
        frequencies=frozen(np.sqrt(squares[vibrates]) / (2.0 * math.pi)),
        shapes=frozen(shapes[:, vibrates]),
        growth_rates=frozen(np.sqrt(-squares[~vibrates])),
        growth_shapes=frozen(shapes[:, ~vibrates]),
    )


def _require_mass(pose: Posture, M: Array) -> None:
    """Raise SingularStiffness if the mass that a joint moves is that of placeholders."""
    arm = pose.arm
    light = M.diagonal() < _LIGHT * _placeholder_matrix(pose).diagonal()
    joint = int(np.where(light, M.diagonal(), math.inf).argmin())
    if light[joint]:
        raise SingularStiffness(
            f"{arm.joint_names[joint]} moves links of no mass, or of hardly any: its frequency "
            "would be that of placeholders. Give the links their link_mass, or a backbone its "
            "mass_per_length or disk_mass.",
            frozen(np.eye(arm.nv)[joint]),
        )


def _placeholder_matrix(pose: Posture) -> Array:
    """Compute the mass matrix (nv, nv) [kg m²] of the placeholders in the URDF of an arm."""
    body = pose.arm.body
    geometry = pose.arm.geometry
    chain = geometry.chain
    placements = body.link_placements(pose.q)
    linear, angular = np.split(body.state(pose.q).twist, 2)
    columns = [body.all_joints.index(axis.name) for axis in chain.axes]
    M = np.zeros((linear.shape[1], linear.shape[1]))
    for moved_by, link in enumerate(chain.bodies):  # the joints before a link move it
        mass, inertia = placeholder_of(geometry, link)
        centre = placements[link.name] @ [link.length / 2.0, 0.0, 0.0, 1.0]
        moving = columns[:moved_by]
        turning = angular[:, moving]
        velocity = linear[:, moving] + np.cross(turning, centre[:3], axis=0)
        M[np.ix_(moving, moving)] += mass * velocity.T @ velocity + inertia * turning.T @ turning
    return body.coupling.square(M) if body.coupling else M


def vibrations(stiffness: Stiffness, M: Array) -> tuple[Array, Array]:
    """Solve K_θ φ = ω² M φ: return ω² (nv,) [1/s²], ascending, and the shapes φ (nv, nv).

    The shapes are columns with φᵀMφ = 1. M is (nv, nv). Raises SingularStiffness if it is not
    positive definite.
    """
    from scipy.linalg import eigh  # slow to import

    # scaled by joint: the mass of the last link may be rounding beside that of the arm
    scale = 1.0 / np.sqrt(np.where(M.diagonal() > 0.0, M.diagonal(), 1.0))
    K, scaled = (matrix * scale * scale[:, None] for matrix in (stiffness.joint, M))
    try:
        squares, shapes = eigh((K + K.T) / 2.0, scaled)
    except np.linalg.LinAlgError:  # M is not positive definite
        motion = np.linalg.eigh(M)[1][:, 0]
        joint = stiffness.posture.arm.joint_names[int(abs(motion).argmax())]
        problem = f"a motion of {joint} moves no link of any mass. "
        problem += "Give the links a mass and moments of inertia."
        raise SingularStiffness(problem, frozen(motion)) from None
    return squares, scale[:, None] * shapes

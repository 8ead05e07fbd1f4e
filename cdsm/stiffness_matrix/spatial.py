"""Compliance and stiffness of the tip as 6 × 6 matrices, in any frame and at any point of the tip.

The point moves with the tip as if it were fixed to it. With the lever r from the tip to the point,
a wrench at the point acts at the tip as Tᵀ W, and the point moves by T times the motion of the tip:

    T = [[R, −R [r]×], [0, R]],        C_point = T C Tᵀ,        K_point = C_point⁻¹,

with the rotation R from base axes to those of the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.posture import Posture
from cdsm.support.format import coordinates
from cdsm.support.result import Result, unit
from cdsm.support.validation import one_of, vector
from cdsm.support.values import Array, frozen

_RANK = 1e-9  # smallest singular value of J_X, over the largest, with which a motion exists


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SpatialStiffness(Result):
    """Stiffness (6, 6) of the tip in a frame and at a point; made by :meth:`Stiffness.spatial`.

    ``np.asarray(...)`` is :attr:`stiffness`: wrench per motion, the linear part first: [N/m], [N],
    [N m/rad]. Cables at 0 N count as taut.

    Attributes:
        posture: The posture.
        frame: The link whose axes they have, or ``"base"``.
        point: The point (3,) [m], from the base's origin in base axes.
        stiffness: K (6, 6), inverse of ``compliance``.
        compliance: C (6, 6): motion per wrench.
    """

    posture: Posture
    frame: str = field(metadata=unit("1"))
    point: Array = field(metadata=unit("m", "axis"))
    stiffness: Array = field(metadata=unit("1", "motion", "motion_column"))
    compliance: Array = field(metadata=unit("1", "motion", "motion_column"))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.stiffness, dtype) if copy else np.asarray(self.stiffness, dtype)

    def __str__(self) -> str:
        rows = [" ".join(f"{value:>11.4g}" for value in row) for row in self.stiffness]
        where = f"axes of {self.frame}, at {coordinates(1e3 * self.point)} mm"
        return "\n".join([f"stiffness of the tip, {where} [N/m, N, N m/rad]", *rows])


def transform(pose: Posture, frame: str, at: str | ArrayLike) -> tuple[Array, Array]:
    """Return T (6, 6) from motions of the tip in base axes to those asked for, and the point (3,).

    Raises InvalidInput if there is no such link, or the point is not (3,).
    """
    placements = pose.arm.body.link_placements(pose.q)
    tip = pose.tip[:3, 3]
    R = np.eye(3)
    if frame != "base":
        R = placements[one_of("frame", frame, ("base", *placements))][:3, :3].T
    if isinstance(at, str):
        names = ("tip", *placements)
        point = tip if at == "tip" else placements[one_of("link for at=", at, names)][:3, 3]
    else:
        point = vector("at", at, 3, "a point (3,) [m] in base axes, or the name of a link")
    x, y, z = point - tip
    lever = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.block([[R, -R @ lever], [np.zeros((3, 3)), R]])
    return T, frozen(np.array(point, np.float64))


def require_six_motions(pose: Posture) -> None:
    """Raise SingularStiffness if the tip lacks one of its six motions; the error names it."""
    length = pose.arm.length
    scale = np.repeat([1.0, length], 3)  # rotations count with the arm's length as lever
    U, sizes, _ = np.linalg.svd(pose.jacobian * scale[:, None])
    rank = int((sizes > _RANK * sizes.max(initial=0.0)).sum())
    if rank == 6:
        return
    missing = U[:, -1] * scale  # wrench that moves no joint
    force, moment = missing[:3], missing[3:] / length
    parts = []
    for words, part in (("move along", force), ("turn about", moment)):
        if (size := np.linalg.norm(part)) > 1e-6:
            axis = np.round(part / size * np.sign(part[abs(part).argmax()]), 9)
            parts.append(f"{words} {coordinates(axis, 'z.3g')}")
    motion = " and ".join(parts)
    once = " at once" if len(parts) > 1 else ""
    raise SingularStiffness(
        f"the tip has {rank} of 6 motions, so a 6 × 6 stiffness does not exist: it cannot "
        f"{motion}{once} (base axes, at the tip). compliance_at(...) exists; or bend the joints "
        "differently.",
        frozen(missing),
    )


def invert_scaled(C: Array, length: float) -> Array:
    """Compute C⁻¹ (6, 6), its rotations counted with a length [m] as lever."""
    scale = np.repeat([1.0, length], 3)
    return np.asarray(np.linalg.inv(C * scale[:, None] * scale) * scale[:, None] * scale)


def frame_name(frame: object) -> str:
    """Return the name of a frame; InvalidInput if it is no text."""
    if not isinstance(frame, str):
        raise InvalidInput("frame", f"{frame!r} given; give 'base' or the name of a link.")
    return frame

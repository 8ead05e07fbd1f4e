"""Where the tip of an arm with friction may rest, to first order."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.friction.stick import breakaway
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import coordinates
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import Direction, unit_direction
from cdsm.support.values import Array
from cdsm.tension import Tension

_WIDE: Final = 0.01  # half-width over the length of the arm beyond which first order misleads


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class RestBand(Result):
    """First-order range of the tip positions at which an arm with locked motors may rest.

    The reference is the posture of ``stiffness``, with one tension in all segments of each cable.
    Few load histories end beyond the band: up to μ = 0.1 by less than 2 % of its half-width, at
    μ = 0.2 to 0.3 by about a tenth. Near buckling the band is far too wide: ``warnings`` say so.

    Attributes:
        stiffness: Frictionless K of the reference, with its posture, tensions and wrench.
        direction: Unit direction u (3,) of the displacement, base axes.
        half_width: Largest displacement of the tip from the reference along ±u [m].
        breakaway: Force [N] along u at which the first cable slides in a hole, if all segments of a
            cable have its tension; see :func:`breakaway`.
    """

    _headline = "half_width"

    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "axis"))
    half_width: float = field(metadata=unit("m"))
    breakaway: float = field(metadata=unit("N"))

    @quantity("m")
    def low(self) -> float:
        """Least displacement of the tip from the reference along u [m]: −half_width."""
        return -self.half_width

    @quantity("m")
    def high(self) -> float:
        """Largest displacement of the tip from the reference along u [m]: half_width."""
        return self.half_width

    @property
    def _posture(self) -> Posture:
        return self.stiffness.posture

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that say where first order misleads; empty if there are none."""
        said = () if self.stiffness.is_stable else self.stiffness.warnings[:1]
        if self.half_width > _WIDE * self._posture.arm.length:
            said += (
                f"FAR TOO WIDE: ±{1e3 * self.half_width:.3g} mm is more than "
                f"{100.0 * _WIDE:g} % of the arm's length; near buckling the tip rests closer.",
            )
        return said

    def __str__(self) -> str:
        rough = self._posture.segments.chains.friction.max(initial=0.0) > 0.1
        said = (
            f"first-order band: the tip rests within ±{1e3 * self.half_width:.4g} mm along "
            f"{coordinates(self.direction)} of this posture, whatever loads came before; "
            f"breakaway load {self.breakaway:.4g} N\n(few loads pass it, by "
            f"{'about 10' if rough else 'less than 2'} %; near buckling it is far too wide)"
        )
        return "\n".join([*self.warnings, said])


def rest_band(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: ArrayLike | None = None,
) -> RestBand:
    """Compute how far along a direction the tip may rest, whatever loads came before.

    The reference is the posture with the given tension in all segments of each cable. There the
    position-controlled motors are locked; force-controlled motors hold the tension. Any other loads
    may have acted before ``wrench``. The half-width is of first order in μ (:func:`half_width`):
    the arm, the wrap angles and the laws EA(F) are linearised at the reference.

    Arguments and errors are those of :func:`breakaway`; ``wrench`` is the load that acts now, and
    ``direction`` that of the displacement. SingularStiffness also if the frictionless K_θ is.
    """
    K = stiffness(pose, tension, wrench)
    u = unit_direction("direction", direction)
    first = breakaway(pose, tension, u, wrench).load
    return RestBand(stiffness=K, direction=u, half_width=half_width(K, u), breakaway=first)


def half_width(K: Stiffness, u: Array) -> float:
    """Compute the largest first-order displacement [m] along u (3,) of the tip at rest.

    Let ln T change by s_i at hole i, |s_i| ≤ μ φ_i. S (S, P) [N] gives the changes S s of the
    segment tensions while the joints are held: a locked motor keeps the wire, so in each cable
    their mean, weighted with the compliances, is 0; a force-controlled motor holds the first
    segment. With G = ∂l/∂θ the joints move by −K_θ⁻¹ Gᵀ S s: the largest displacement is
    Σ_i |uᵀ J_v K_θ⁻¹ Gᵀ S|_i μ φ_i. Raises SingularStiffness if the frictionless ``K`` is singular.
    """
    K.along(u)
    segments = K.posture.segments
    chains, F = segments.chains, K.tension[segments.chains.cable]
    with np.errstate(divide="ignore"):
        soft = 1.0 / segments.chains.laws.stiffness(segments.lengths, F)
    forced = np.isinf(soft)  # the first segment of a force-controlled cable
    soft[forced] = 0.0
    own = chains.cable[:, None] == chains.cable[chains.hole]  # segments of the hole's cable (S, P)
    after = own & (np.arange(F.size)[:, None] > chains.hole)
    mean = np.where(forced @ own, 0.0, (soft @ after) / (soft @ own))
    S = F[chains.hole] * (after - mean * own)
    pull = np.linalg.solve(K.joint.T, u @ K.posture.jacobian[:3])
    return float(abs(pull @ segments.length_jacobian.T @ S) @ segments.grip)

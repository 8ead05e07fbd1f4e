"""How the stiffness changes with the cable tensions: its derivatives, and where it saturates."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm import readings
from cdsm.errors import CdsmError, InvalidInput
from cdsm.loads import LoadsLike, loads_of
from cdsm.motors import refuse_shared
from cdsm.planning.tension_space import LARGEST_TENSION, form_by_tension, unstable
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import aligned, coordinates, stiffness_text, without_rounding
from cdsm.support.result import Result, unit
from cdsm.support.validation import NO_WRENCH, Direction, bound, instance, scalar, unit_direction
from cdsm.support.values import Array, draw, frozen
from cdsm.tension import Tension, distribute_tension
from cdsm.terms import passive_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 200  # bounds of a curve of saturation, evenly on a scale of logarithms
_SMALLEST = 1e-4  # second bound of such a curve at least, over the last one


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessGradient(Result):
    """Derivatives of a stiffness with respect to the cable tensions.

    Each has the name of the attribute or method of :class:`~cdsm.Stiffness` that it differentiates.
    Posture and wrench are fixed. A change of one tension alone breaks the balance (Eq. 13), so
    multiply the derivatives by changes ΔF that keep it: `J_Lᵀ ΔF = 0`.

    Attributes:
        stiffness: K; the derivatives are taken at its tensions.
        cable_stiffness: dk_c/dF_c (C,) [1/m] of each cable; 0 under force control.
    """

    _headline = "cable_stiffness"
    _rows = "cable"
    _posture_from = "stiffness.posture"

    stiffness: Stiffness
    cable_stiffness: Array = field(metadata=unit("1/m", "cable"))

    @cached_property
    def joint(self) -> Array:
        """`∂K_θ/∂F` (C, nv, nv) [m/rad²]: one symmetric matrix per cable."""
        J = self._driven
        slope = self.cable_stiffness[:, None, None]
        return frozen(self.stiffness.posture.length_hessian + slope * J[:, :, None] * J[:, None])

    @cached_property
    def _driven(self) -> Array:
        """Gradients of the lengths (C, nv) [m/rad], less by how far motors yield."""
        K = self.stiffness
        return _driven(K, np.zeros(K.tension.size, dtype=np.bool_))

    @cached_property
    def margin(self) -> Array:
        """`∂λ_min/∂F = vᵀ ∂K_θ/∂F v` (C,) [m/rad²], with the unit eigenvector v of `λ_min`.

        `λ_min` is the smallest eigenvalue of the symmetric part of `K_θ`. A multiple eigenvalue has
        no gradient. The result then belongs to one of its eigenvectors; the product with ΔF is an
        upper bound of the change of `λ_min`, to first order.
        """
        v = self.stiffness.critical_direction[:, None]
        form = form_by_tension(
            self.stiffness.posture, self.cable_stiffness, v, v, driven=self._driven
        )
        return frozen(form[:, 0, 0])

    @cached_property
    def cartesian(self) -> Array:
        """`∂(C_vv)⁻¹/∂F` (C, 3, 3) [1/m], with the translational block `C_vv` of the compliance.

        Raises SingularStiffness if `K_θ` is singular, or the tip hardly moves in some direction.
        """
        slope = self.cable_stiffness
        return frozen(
            self._through(
                np.eye(3), self.stiffness.cartesian, self.stiffness.joint, slope, self._driven
            )
        )

    def along(self, direction: Direction) -> Array:
        """Return `∂s/∂F` (C,) [1/m] of the stiffness s = ``K.along(u)``, u being ``direction``.

        `∂s/∂F = s² (K_θ⁻ᵀ J_vᵀ u)ᵀ ∂K_θ/∂F (K_θ⁻¹ J_vᵀ u)`, with the translational rows `J_v` of
        the tip Jacobian. Of cables at 0 N, those that the force does not stretch are left out; the
        gradient then holds while they stay at 0 N. Raises InvalidInput if ``direction`` is not an
        axis or a nonzero (3,), and SingularStiffness if `K_θ` is singular or the tip cannot move
        along u.
        """
        u = unit_direction("direction", direction)
        K = self.stiffness
        K.require_mobile(u)
        along, motion = K.tip_response(u)
        loose = K.loose(motion)
        k = np.where(loose, K.cable_stiffness, 0.0)
        J = K.posture.length_jacobian
        taut = readings.remove_cables(K.joint, J, k)
        soft = K.posture.arm.motors.yielding
        if soft is not None:
            taut = K.joint - K.passive + passive_stiffness(J, K.cable_stiffness - k, soft)
        slope = np.where(loose, 0.0, self.cable_stiffness)
        driven = _driven(K, loose)
        return frozen(self._through(u[None], np.array([[along]]), taut, slope, driven)[:, 0, 0])

    def _through(self, U: Array, X: Array, K: Array, slope: Array, driven: Array) -> Array:
        """Return Mᵀ ∂K_θ/∂F M (C, r, r), the derivative of X = (U C_vv Uᵀ)⁻¹ (r, r).

        M = K_θ⁻¹ (U J_v)ᵀ X is the joint motion per motion of the tip. The left one is of
        K_θᵀ, which differs if a moment acts on the tip.
        """
        rows = U @ self.stiffness.posture.jacobian[:3]
        left = np.linalg.solve(K.T, rows.T) @ X.T
        right = np.linalg.solve(K, rows.T) @ X
        return form_by_tension(self.stiffness.posture, slope, left, right, driven=driven)

    def __str__(self) -> str:
        arm = self.stiffness.posture.arm
        smallest = f"smallest joint stiffness [{arm.stiffness_unit()}]"
        columns = (without_rounding(slopes) for slopes in (self.cable_stiffness / 1e3, self.margin))
        rows = [["cable", "cable stiffness [N/mm]", smallest]]
        for name, *values in zip(arm.cables.names, *columns, strict=True):
            rows.append([name, *(f"{value:z.4g}" for value in values)])
        return "\n".join(["change per 1 N of tension in one cable", *aligned(rows)])


def _driven(K: Stiffness, loose: NDArray[np.bool_]) -> Array:
    """Compute Pᵀ J_L (C, nv) [m/rad] with K_eff = P K_L, of which some cables are ``loose`` (C,).

    dK_eff = P dK_L Pᵀ: these are the gradients of the lengths if all motors are rigid, P = 1.
    """
    soft = K.posture.arm.motors.yielding
    J = K.posture.length_jacobian
    if soft is None:
        return J
    return np.asarray(soft.transmission(np.where(loose, 0.0, K.cable_stiffness)).T @ J)


def stiffness_gradient(stiffness: Stiffness) -> StiffnessGradient:
    """Compute the derivatives of a stiffness K with respect to the cable tensions.

    `∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ`, with the gradient `J_c` and the Hessian `H_c` of the length
    of cable c and `k′_c = dk_c/dF_c`. `k′_c` includes `dEA/dF` and the series spring. Where motors
    yield, `J_c` is that of `Pᵀ J_L`, with `K_eff = P K_L` (:attr:`Stiffness.wire_stiffness`). For
    example, ``stiffness_gradient(K).along(u)`` is the gradient of ``K.along(u)``.

    Raises:
        InvalidInput: ``stiffness`` is not a frictionless ``Stiffness``.
        ElasticityRangeError: A tension is outside the domain of its elasticity.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> slope = cdsm.stiffness_gradient(K).along("z")
        >>> print(f"cable1_2: {slope[1]:.3f} N/m per N")
        cable1_2: 25.760 N/m per N
    """
    K = instance("stiffness", stiffness, Stiffness).require_frictionless()
    slope = K.posture.arm.laws.stiffness_slope(K.tension, K.cable_stiffness)
    return StiffnessGradient(stiffness=K, cable_stiffness=slope)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Saturation(Result):
    """Stiffness as a function of the lower bound of the tensions; made by :func:`saturation`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        fraction: Part of the largest stiffness [-] that counts as saturated.
        bound: The least lower bound [N] at which the stiffness is ``fraction`` of the largest; inf
            if nothing ends the curve, and the stiffness still rises at its last bound.
        stiffest: The lower bound [N] with the largest stiffness: an end of the curve, or one above
            which tension softens the arm.
        tension: The least tensions with the lower bound ``bound`` or, if that is inf, the last one.
        stiffness: `K_θ` under these tensions.
        limit: What ends the curve: UNSTABLE (the arm buckles), INFEASIBLE or SOLVER_FAILED (no
            tensions balance it), OUTSIDE_ELASTICITY (a tension leaves the domain of its cable),
            AT_MAXIMUM (the upper bound of a tension), or OK (nothing).
        minimum: Lower bounds of the curve (n,) [N], ascending, the last but one step before its
            end.
        along: Stiffness along u under the least tensions with these bounds (n,) [N/m].
    """

    _headline = "bound"
    _rows = "minimum"

    direction: Array = field(metadata=unit("1", "axis"))
    fraction: float = field(metadata=unit("1"))
    bound: float = field(metadata=unit("N"))
    stiffest: float = field(metadata=unit("N"))
    tension: Tension = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    limit: Status = field(metadata=unit("1"))
    minimum: Array = field(metadata=unit("N", "minimum"))
    along: Array = field(metadata=unit("N/m", "minimum"))

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.tension.posture

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the stiffness and its terms over the lower bound of all tensions; return the axes.

        Other options are those of :func:`cdsm.plots.plot_stiffness_over_tension`.
        """
        axes: Axes = draw("plot_stiffness_over_tension", self, ax=ax, **options)
        return axes

    def __str__(self) -> str:
        end = self.minimum[-1]
        along = f"the stiffness along {coordinates(self.direction)}"
        most = f"{along} is at most {stiffness_text(self.along.max())}, at a lower bound of "
        lines = [f"{most}{self.stiffest:.4g} N"]
        if math.isinf(self.bound):
            lines = [f"{along} does not saturate: it still rises at {end:.4g} N"]
        else:
            lines.append(f"saturates at {self.bound:.4g} N: {100.0 * self.fraction:.3g} % of that")
        if self.minimum[0] < self.stiffest < end:
            lines.append(f"above {self.stiffest:.4g} N tension makes the arm softer")
        model = frictionless_model(self.posture.arm)
        limit = "" if self.limit is Status.OK else f", where {self.limit.message}"
        return "\n".join([*lines, f"looked at up to {end:.4g} N{limit} ({model})"])


def saturation(
    pose: Posture,
    direction: Direction,
    minimum: float = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    fraction: float = 0.95,
) -> Saturation:
    """Find the lower bound above which more tension adds little stiffness.

    With F*(b), the least tensions with the lower bound b (Eq. 17), s(b) is the stiffness along u.
    The result is the least b at which s is ``fraction`` of its largest value, interpolated between
    200 bounds. A strand starts soft (Section IV-C). Where its rigidity has levelled off, more
    tension has two small effects: the active part of `K_θ` (Eq. 16) usually softens the arm, and
    the wires stiffen since their original lengths fall. Series springs and leads weaken the second.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: First lower bound [N]. If the domains of the elasticities begin higher, or the arm
            becomes stable at a higher one, the curve begins there.
        maximum: Upper bound of the tensions [N], for all cables or (C,). Without it, and where no
            elasticity ends, the curve ends at 1000 times the largest of the least tensions.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; or loads on links.
        fraction: Part of the largest stiffness, above 0, at most 1 [-].

    Raises:
        InvalidInput: ``minimum`` exceeds ``maximum``; or another argument is invalid.
        InfeasibleTension: No tensions balance the arm even at the smallest lower bound.
        ElasticityRangeError: The tensions at the smallest lower bound are outside the elasticities.
        SingularStiffness: The tip cannot move along u, or the arm is stable at no lower bound.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> saturated = cdsm.saturation(pose, "z")
        >>> f"with {saturated.bound:.0f} N {1e-3 * saturated.stiffness.along('z'):.2f} N/mm"
        'with 213 N 86.85 N/mm'
    """
    arm = instance("pose", pose, Posture).arm
    u = unit_direction("direction", direction)
    refuse_shared(arm.motors, "saturation")
    part = scalar("fraction", fraction)
    start = scalar("minimum", minimum)
    if not 0.0 < part <= 1.0:
        raise InvalidInput("fraction", f"{part:g} given; 0 < fraction <= 1 is needed.")
    load = loads_of(arm, wrench)
    ceiling = bound("maximum", maximum, len(arm.cables))

    @cache
    def at(lower: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, lower, ceiling, load))

    distribute_tension(pose, start, ceiling, load)  # raises if minimum exceeds maximum
    low = max(start, float(arm.laws.low.max()))
    at(low).require_mobile(u)
    highest = [(LARGEST_TENSION * max(float(at(low).tension.max()), 1.0), Status.OK)]
    highest += [(end, Status.OUTSIDE_ELASTICITY) for end in arm.laws.high.tolist()]
    own_maximum = arm.laws.narrowed(ceiling, ceiling)[1]
    highest += [(float(tension), Status.AT_MAXIMUM) for tension in own_maximum]
    high, limit = min(highest, key=lambda end: end[0])
    stable: list[float] = []
    tried = [low, *np.geomspace(max(low, _SMALLEST * high), max(low, high), _SAMPLES)[1:].tolist()]
    for lower in tried:
        try:
            if at(lower).margin_without_slack > 0.0:
                stable.append(lower)
            elif stable:
                limit = Status.UNSTABLE
                break
        except CdsmError as error:
            if error.status.is_fault:
                raise
            limit = error.status
            break
    if not stable:
        stiffnesses = [at(b) for b in tried if b < lower] or [at(low)]
        least = f"least tensions with lower bounds from {low:.4g} to {lower:.4g} N"
        raise unstable(max(stiffnesses, key=lambda K: K.margin), least)
    bounds = np.array(stable)
    along = np.array([at(lower).along(u) for lower in stable])
    top = int(along.argmax())
    first = int((along >= part * along[top]).argmax())
    beside = slice(max(first - 1, 0), first + 1)
    where = float(np.interp(part * along[top], along[beside], bounds[beside]))
    if limit is Status.OK and top == len(stable) - 1 and first > 0:
        where = math.inf
    K = at(min(where, stable[-1]))
    assert K.distribution is not None
    return Saturation(
        direction=u,
        fraction=part,
        bound=where,
        stiffest=stable[top],
        tension=K.distribution,
        stiffness=K,
        limit=limit,
        minimum=frozen(bounds),
        along=frozen(along),
    )

"""Stiffness of an arm whose cables stick, the load at which one slides, and where the tip may rest.

All segments of a cable start with its tension, as after shaking the arm; the motors are locked.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from cdsm.applied import combined, force_at, jacobian_at
from cdsm.dead_loads import LinkPoint
from cdsm.friction.capstan import ChainProblem, assemble_segments, can_stick
from cdsm.loads import LoadsLike, link_point
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, checked_tension, stiffness
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.format import coordinates
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import SMALLEST, Direction, unit_direction
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

_NEVER: Final = 1e-12  # a hole never slides if its |x_i| − y_i is below this part of all |x_i|
_STUCK: Final = 1e9  # ratio of tensions that no hole reaches
_WIDE: Final = 0.01  # half-width over the length of the arm beyond which first order misleads


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Breakaway(Result):
    """Load at which the first cable of a stuck arm begins to slide, and its hole.

    Attributes:
        stiffness: :func:`stuck_stiffness`, which a weight below ``load`` measures.
        direction: Unit direction u (3,) of the force, base axes.
        load: The breakaway load [N], in addition to the wrench of ``stiffness``. It is 0 if no
            cable can stick, inf if the force moves no joint.
        hole_loads: First-order load at which the cable begins to slide in each hole (P,) [N]; inf
            for holes in which it never begins to slide, or cannot stick.
        cable: Name of the cable that slides first; empty if ``load`` is 0 or inf.
        site: Number of its hole among the sites of ``cable``, from 1; 0 if ``load`` is 0 or inf.
        link: Name of the link that has this hole; empty if ``load`` is 0 or inf.
    """

    _headline = "load"
    _posture_from = "stiffness.posture"

    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "axis"))
    load: float = field(metadata=unit("N"))
    hole_loads: Array = field(metadata=unit("N", "hole"))
    cable: str = field(metadata=unit("1"))
    site: int = field(metadata=unit("1"))
    link: str = field(metadata=unit("1"))

    def __str__(self) -> str:
        text = f"breakaway along {coordinates(self.direction)}: {self.load:.4g} N"
        where = f", first at site {self.site} of {self.cable} ({self.link})"
        return text + where * bool(self.cable)


def stuck_stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: LoadsLike | None = None
) -> Stiffness:
    """Compute the stiffness while all cables stick: weights below :func:`breakaway` measure it.

    Each segment j between two holes is a separate spring `k_j = EA(F)/a_j` with the length `l_j`
    and the rest length `a_j`: `K_θ = Σ_j (F H_j + k_j g_j g_jᵀ) + gravity + load`, with
    `g_j = ∂l_j/∂θ` and `H_j = ∂²l_j/∂θ²`. If the cable sticks in its first hole, lead, series
    spring and force-controlled motor have no effect. A cable cannot stick in a hole without
    friction, or through which it goes straight: the segments on both sides are one spring. Without
    friction, `K_θ` is that of :func:`~cdsm.stiffness`; with it, larger: the difference is positive
    semidefinite.

    :func:`~cdsm.stiffness` explains the arguments and the errors.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(friction=0.1)
        >>> pose = arm.at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> K = cdsm.stiffness(pose, F)  # as if all holes slid without friction
        >>> stuck = cdsm.stuck_stiffness(pose, F)
        >>> print(f"{1e-3 * K.along('z'):.2f}, stuck {1e-3 * stuck.along('z'):.2f} N/mm")
        2.10, stuck 6.30 N/mm
    """
    F, W = checked_tension(pose, tension, wrench)
    none = np.zeros(pose.segments.wrap.size, dtype=np.bool_)
    distribution = tension if isinstance(tension, Tension) else None
    return assemble_segments(pose, F[pose.segments.chains.cable], none, W, "stuck", distribution)


def breakaway(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: LoadsLike | None = None,
    link: str | None = None,
    point: ArrayLike | None = None,
) -> Breakaway:
    """Compute the force along a direction at which the first cable begins to slide in a hole.

    A weight below this load measures :func:`stuck_stiffness`. The cable begins to slide in hole i,
    between segments j and j + 1 with the tensions T, where `|ln T_{j+1} − ln T_j| = μ φ_i`, with
    the friction coefficient μ and the wrap angle `φ_i`. The stuck arm is at `θ + W dθ/dW` under the
    load W, and `dθ/dW = K_θ⁻¹ J_vᵀ u` is taken at half the first-order load; on random arms the
    result is within 1e-4 of a simulated one up to μ = 0.3. To first order it is the smallest of

        `W_i = μ φ_i/(|x_i| − y_i)`,   `x_i = d(ln T_{j+1} − ln T_j)/dW`,   `y_i = μ dφ_i/dW`.

    Args:
        pose: The posture.
        tension: F (C,) [N], as for :func:`~cdsm.stiffness`; a residual torque is kept as a load.
        direction: u (3,) of the force in base axes, any length, or an axis such as ``"-z"``.
        wrench: W (6,) at ``tool0`` before the force acts, or loads on links; only with your own
            tensions.
        link: Link on which the force acts; None: at the tip.
        point: Where on it, as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`, or ``direction`` is not a direction.
        ElasticityRangeError: A tension leaves the domain of its cable's elasticity.
        SingularStiffness: The stuck arm is about to buckle.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(friction=0.1)
        >>> pose = arm.at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> print(cdsm.breakaway(pose, F, "-y"))
        breakaway along (0, -1, 0): 0.06066 N, first at site 9 of cable5_3 (link4)
    """
    u = unit_direction("direction", direction)
    K = stuck_stiffness(pose, tension, wrench)
    at = link_point(pose.arm, link, point)
    J_v = jacobian_at(pose, at)[:3]
    segments = pose.segments
    chains = segments.chains
    loads = np.full(segments.wrap.size, math.inf)
    sticks = can_stick(pose)
    if sticks.any() and math.isfinite(K.tip_response(u, J_v=J_v)[0]):
        assert K.tension_gradient is not None
        motion = np.asarray(np.linalg.solve(K.joint, u @ J_v), np.float64)
        F = K.tension[chains.cable]
        slack = K.tension[chains.cable] == 0.0
        relative = K.tension_gradient @ motion / np.where(slack, 1.0, F)
        change = abs(relative[chains.hole + 1] - relative[chains.hole])
        rate = change - chains.friction * (segments.wrap_jacobian @ motion)
        # a slack cable holds nothing: any pull moves it
        exponent = np.where(slack[chains.hole], 0.0, segments.grip)
        slides = sticks & (rate > _NEVER * change.max(initial=0.0))
        loads[slides] = exponent[slides] / rate[slides]
    load = float(loads.min()) if sticks.any() else 0.0
    cable = ""
    site = 0
    link = ""
    if 0.0 < load < math.inf:
        load, hole = _first_slip(K, u, load, motion, at)
        first = pose.arm.cables[chains.cable[chains.hole[hole]]]
        site = int(chains.site[hole]) + 1
        cable = first.name
        link = getattr(first.sites[site - 1], "link", "a sheath")
    where: Any = {"cable": cable, "site": site, "link": link}
    return Breakaway(stiffness=K, direction=u, load=load, hole_loads=frozen(loads), **where)


def _first_slip(
    K: Stiffness, u: Array, load: float, motion: Array, point: LinkPoint | None
) -> tuple[float, int]:
    """Return load [N] and hole of first slip along u; ``load``, ``motion`` [rad/N]: first order."""
    pose = K.posture
    arm = K.posture.arm
    segments = pose.segments
    forced = ~arm.cables.position_controlled
    chains = segments.chains
    T = K.tension[segments.chains.cable]
    problem = ChainProblem(arm.cables, chains.start)
    wire = problem.rest_lengths(segments.lengths, T)
    ratio = np.ones(T.size)
    ratio[chains.hole[can_stick(pose)]] = _STUCK

    def at(load: float, motion: Array) -> tuple[Posture, Array]:
        moved = arm.at(pose.q + load * motion, check_limits=False)
        held = np.where(forced, K.tension, np.nan)
        return moved, problem.settle(moved.segments.lengths, wire, ratio, held, T).tension

    def excess(load: float) -> Array:
        moved, T = at(load, motion)
        rise = np.diff(np.log(np.maximum(T, SMALLEST)))[chains.hole]
        return np.where(can_stick(pose), abs(rise) - moved.segments.grip, -np.inf)

    half, T = at(load / 2.0, motion)
    wrench = combined(K.applied, force_at(point, load / 2.0 * u))
    none = np.zeros(chains.hole.size, dtype=np.bool_)
    J_half = jacobian_at(half, point)[:3]
    there = assemble_segments(half, T, none, wrench, "stuck")
    motion = np.asarray(np.linalg.solve(there.joint, u @ J_half), np.float64)
    if excess(2.0 * load).max() > 0.0:
        load = float(brentq(lambda load: excess(load).max(), 0.0, 2.0 * load, rtol=1e-6))
    return load, int(excess(load).argmax())


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
    _posture_from = "stiffness.posture"

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
    def warnings(self) -> tuple[str, ...]:
        """Sentences that say where first order misleads; empty if there are none."""
        warnings = [] if self.stiffness.is_stable else [describe_buckling(self.stiffness)]
        if self.half_width > _WIDE * self.stiffness.posture.arm.length:
            warnings.append(
                f"FAR TOO WIDE: ±{1e3 * self.half_width:.3g} mm is more than "
                f"{100.0 * _WIDE:g} % of the arm's length; near buckling the tip rests closer."
            )
        return tuple(warnings)

    def __str__(self) -> str:
        rough = self.stiffness.posture.segments.chains.friction.max(initial=0.0) > 0.1
        band = (
            f"first-order band: the tip rests within ±{1e3 * self.half_width:.4g} mm along "
            f"{coordinates(self.direction)} of this posture, whatever loads came before; "
            f"breakaway load {self.breakaway:.4g} N\n(few loads pass it, by "
            f"{'about 10' if rough else 'less than 2'} %; near buckling it is far too wide)"
        )
        return "\n".join([*self.warnings, band])


def rest_band(
    pose: Posture,
    tension: Tension | ArrayLike,
    direction: Direction,
    wrench: LoadsLike | None = None,
) -> RestBand:
    """Compute how far along a direction the tip may rest, whatever loads came before.

    The reference is the posture with the given tension in all segments of each cable. There the
    position-controlled motors are locked; force-controlled motors hold the tension. Any other loads
    may have acted before ``wrench``. The half-width is of first order in μ (:func:`half_width`):
    the arm, the wrap angles and the laws EA(F) are linearised at the reference.

    Arguments and errors are those of :func:`breakaway`; ``wrench`` is the load that acts now, and
    ``direction`` that of the displacement. SingularStiffness also if the frictionless `K_θ` is.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(friction=0.1)
        >>> pose = arm.at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> band = cdsm.rest_band(pose, F, "-y")
        >>> print(f"{1e3 * band.half_width:.4f} mm")
        0.0933 mm
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
    chains = segments.chains
    F = K.tension[segments.chains.cable]
    with np.errstate(divide="ignore"):
        soft = 1.0 / segments.chains.laws.stiffness(segments.lengths, F)
    forced = np.isinf(soft)  # the first segment of a force-controlled cable
    soft[forced] = 0.0
    own = chains.own
    after = chains.behind
    mean = np.where(forced @ own, 0.0, (soft @ after) / (soft @ own))
    S = F[chains.hole] * (after - mean * own)
    pull = np.linalg.solve(K.joint.T, u @ K.posture.jacobian[:3])
    return float(abs(pull @ segments.length_jacobian.T @ S) @ segments.grip)

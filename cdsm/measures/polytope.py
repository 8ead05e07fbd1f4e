"""Forces at the tip that tensions balance: the largest along a direction, and all of them.

Forces x (k,) [N] act at the tip along the columns of U (3, k), besides the wrench W. They balance
if J_Lᵀ F − J_vᵀ U x = J_Xᵀ W − g (Eq. 13) with minimum ≤ F ≤ maximum. All such x are a polytope;
its largest a · x is a linear program.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.applied import Applied, Loaded, jacobian_at, required_torque
from cdsm.dead_loads import LinkPoint
from cdsm.errors import CdsmError, InvalidInput, solver_failed
from cdsm.loads import LoadsLike, link_point, loads_of
from cdsm.motors import refuse_shared
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.format import coordinates, plural
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import NO_WRENCH, instance
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import bounds_at, distribute_tension
from cdsm.tension.solvers import Solution, maximise

_NO_MOTION = 1e-9
"""Smaller singular values of J_v, divided by the arm length, count as zero: no tip motion there."""

_OUTSIDE = 1e-8  # smaller distances from a hull, relative to its size, count as zero


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForcePolytope(Result, Plotted, Loaded):
    """All forces at the tip that an arm can balance; made by :func:`force_polytope`.

    The forces f (3,) [N] in base axes act at the tip, or ``point``, besides what is ``applied``.
    The polytope is the set of all f with ``normals`` @ f ≤ ``offsets``.

    Attributes:
        posture: The posture.
        applied: What always acts: W (6,) at the tip, or loads on links.
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        vertices: Corners (n, 3) [N].
        faces: Triangles of the surface (m, 3), as indices of ``vertices``; (0, 3) for a flat
            polytope.
        normals: Outward unit normals of the n facets (n, 3) [-].
        offsets: Distance of each facet from the force zero (n,) [N]; negative if zero is outside.
        unbounded: Unit directions (n, 3) in which the tip cannot move, as many as there are; the
            links balance any force along them, and ``vertices`` have no component along them.
        point: Where the forces act; None: the tip.
    """

    _headline = "radius"
    _figure = "plot_force_polytope"

    posture: Posture
    applied: Applied
    minimum: Array = field(metadata=unit("N", "cable"))
    maximum: Array = field(metadata=unit("N", "cable"))
    vertices: Array = field(metadata=unit("N", "vertex", "axis"))
    faces: NDArray[np.intp]
    normals: Array = field(metadata=unit("1", "facet", "axis"))
    offsets: Array = field(metadata=unit("N", "facet"))
    unbounded: Array = field(metadata=unit("1", "immobile", "axis"))
    point: LinkPoint | None = None

    @quantity("N")
    def radius(self) -> float:
        """Distance of the force zero from the nearest facet [N]; negative if zero is outside.

        The arm balances every force up to ``radius``, in all directions.
        """
        return float(self.offsets.min(initial=math.inf))

    @quantity("1", "axis")
    def worst_direction(self) -> Array:
        """Unit direction (3,) in which the largest force that the arm can balance is smallest."""
        nearest = self.normals[self.offsets == self.offsets.min(initial=math.inf)]
        return np.asarray(np.vstack([nearest, self.unbounded])[0])

    @property
    def volume(self) -> float:
        """Volume of the polytope [N³]; inf if it is unbounded, 0 if it is flat."""
        if len(self.unbounded):
            return math.inf
        corners = self.vertices[self.faces] - self.vertices.mean(axis=0)
        return float(abs(np.linalg.det(corners)).sum()) / 6.0

    def __str__(self) -> str:
        corners = plural(len(self.vertices), "corner")
        direction = coordinates(self.worst_direction, ".3g")
        where = f" on {self.point.link}" if self.point else ""
        if len(self.unbounded) == 3:  # a radius would be that of no facet
            return f"holds any force{where}: no joint moves the place where it acts"
        holds = f"holds {self.radius:.4g} N{where} in any direction"
        return f"{corners}; {holds}, least along {direction}"


def force_polytope(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    worst_friction: bool = False,
    link: str | None = None,
    point: ArrayLike | None = None,
) -> ForcePolytope:
    """Compute all forces f at the tip that tensions within the bounds balance, besides W (Eq. 13).

    The posture is fixed: the motors re-distribute the tensions for each force.

    Args:
        pose: The posture.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); finite.
        wrench: W (6,) at ``tool0`` in base axes that always acts: force [N], then moment [N m]. Or
            loads on links, as for :func:`~cdsm.distribute_tension`.
        worst_friction: Narrow the bounds for friction, as :func:`~cdsm.distribute_tension` does.
        link: Link on which the forces act; None: at the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: An argument has the wrong shape, or a cable has no upper bound, so that the
            polytope is unbounded.
        InfeasibleTension: No tensions within the bounds balance any force at the tip, not even
            zero; the error gives the smallest violation.
        CdsmError: A linear program fails.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> polytope = cdsm.force_polytope(pose, minimum=5.0, maximum=100.0)
        >>> print(polytope)
        50 corners; holds 45.11 N in any direction, least along (0.138, -0.855, 0.5)
    """
    instance("pose", pose, Posture)
    refuse_shared(pose.arm.motors, "force_polytope")
    bounds = bounds_at(pose, minimum, maximum, worst_friction)
    low = bounds.minimum_held
    high = bounds.maximum_held
    W = loads_of(pose.arm, wrench)
    at = link_point(pose.arm, link, point)
    if not np.isfinite(high).all():
        cable = pose.arm.cables[int(np.isinf(high).argmax())].name
        raise InvalidInput("maximum", f"{cable} has none; give a finite one [N].")
    polytope = polytope_of(pose, W, low, high, at)
    if polytope is None:
        distribute_tension(pose, minimum, maximum, W, worst_friction=worst_friction)
        raise CdsmError(
            "solver 'highs' finds no force, though tensions balance none. Change a bound.",
            Status.SOLVER_FAILED,
        )
    return polytope


def polytope_of(
    pose: Posture, wrench: Applied, low: Array, high: Array, at: LinkPoint | None = None
) -> ForcePolytope | None:
    """Compute the polytope of all forces at a point that a posture balances; None: there are none.

    Convex hull method (Lassez and Lassez, 1992; for robots Skuric, Padois and Daney, RA-L 2022) in
    the directions in which the tip moves: take the hull of the known corners, find the farthest
    point along the normal of each facet, and repeat until no point is outside.
    """
    axes, size, _ = np.linalg.svd(jacobian_at(pose, at)[:3])
    moved = int((size > _NO_MOTION * pose.arm.length).sum())
    basis = axes[:, :moved]
    unbounded = axes[:, moved:].T
    farthest = balanced(pose, basis, wrench, low, high, at)
    some = farthest(np.zeros(moved))
    if not some.ok:
        return None
    varied, fixed = _split_forces(pose, basis, at)
    constant = fixed.T @ some.x
    constant[abs(constant) <= _OUTSIDE * high.max()] = 0.0
    k = varied.shape[1]
    points = np.zeros((0, k))
    normals = np.vstack([np.eye(k), -np.eye(k)])
    tried: set[tuple[float, ...]] = set()
    while True:
        reached = (points @ normals.T).max(axis=0, initial=-math.inf)
        least = _OUTSIDE * float(np.ptp(points, axis=0).max() if len(points) else 0.0)
        new = []
        for normal, known in zip(normals, reached.tolist(), strict=True):
            seen = tuple(np.round(normal, 9).tolist())
            if seen not in tried:
                tried.add(seen)
                solution = farthest(varied @ normal)
                if not solution.ok:
                    raise solver_failed("highs", "finds no end of the balanced forces.")
                point = solution.x @ varied
                new += [point] if point @ normal > known + least else []
        if not new:
            break
        points = np.vstack([points, *new])
        corners, faces, normals = _hull(points)
    if k == 0:
        corners = np.zeros(1, np.intp)
        faces = np.zeros((0, 3), np.intp)
        points = np.zeros((1, 0))
    offsets = (normals @ points.T).max(axis=1, initial=-math.inf)
    return ForcePolytope(
        posture=pose,
        applied=wrench,
        minimum=low,
        maximum=high,
        vertices=frozen((points[corners] @ varied.T + fixed @ constant) @ basis.T),
        faces=frozen(faces),
        normals=frozen(np.vstack([normals @ varied.T, fixed.T, -fixed.T]) @ basis.T),
        offsets=frozen(np.concatenate([offsets, constant, 0.0 - constant])),
        unbounded=frozen(unbounded),
        point=at,
    )


def _split_forces(pose: Posture, U: Array, at: LinkPoint | None) -> tuple[Array, Array]:
    """Split the forces x (k,) along U (3, k) by whether changes of the tensions can balance them.

    Returns orthonormal columns x with J_Lᵀ F = J_vᵀ U x for some F, and the others. An arm with
    fewer cables than joints can vary few forces, or none.
    """
    count = U.shape[1]
    arms, size, _ = np.linalg.svd(pose.length_jacobian.T, full_matrices=False)
    arms = arms[:, size > _NO_MOTION * size.max(initial=0.0)]
    torque = jacobian_at(pose, at)[:3].T @ U
    size, axes = np.linalg.svd(torque - arms @ (arms.T @ torque))[1:]
    fixed = int((size > _NO_MOTION * pose.arm.length).sum())
    if not fixed:
        return np.eye(count), np.zeros((count, 0))
    return axes[fixed:].T, axes[:fixed].T


def _hull(points: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Return which of ``points`` (n, k) are corners, the triangles of these, and the normals."""
    from scipy.spatial import ConvexHull, QhullError

    none = np.zeros((0, 3), np.intp)
    if points.shape[1] == 1:
        return np.array([points.argmin(), points.argmax()]), none, np.array([[-1.0], [1.0]])
    size = max(np.ptp(points, axis=0).max(), _OUTSIDE * abs(points).max()) or 1.0
    scaled = (points - points[0]) / size
    try:
        hull = ConvexHull(scaled)
        flat = points.shape[1] < 3
    except QhullError:  # a flat polytope is made a little thick
        hull = ConvexHull(scaled, qhull_options="QJ")
        flat = True
    normals = np.unique(np.round(hull.equations[:, :-1], 9), axis=0)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corners = np.sort(hull.vertices).astype(np.intp)
    return corners, none if flat else np.searchsorted(corners, hull.simplices), normals


Farthest = Callable[[Array], Solution]
"""Function of a (k,): of all balanced forces x (k,) [N], the one with the largest a · x.

The status is UNBOUNDED if nothing bounds a · x, and INFEASIBLE if no force is balanced.
"""


def balanced(
    pose: Posture,
    U: Array,
    wrench: Applied,
    low: Array,
    high: Array,
    at: LinkPoint | None = None,
) -> Farthest:
    """Return the function that maximises over the forces along U that a posture balances.

    ``low`` and ``high`` (C,) [N] are the bounds of the tensions, ``wrench`` is what always acts.
    The forces act at a point of a link, or at the tip. Those that are rounding are zero if no
    change of the tensions varies them. The function raises CdsmError if its linear program fails.
    """
    A = np.column_stack([pose.length_jacobian.T, -jacobian_at(pose, at)[:3].T @ U])
    lever = abs(A).max(axis=1)
    lever[lever == 0.0] = 1.0
    A /= lever[:, None]
    b = required_torque(pose, wrench) / lever
    count = low.size
    free = np.full(U.shape[1], math.inf)
    # near the straight arm, forces along it are huge: each counts by what it does to the joints
    scale = abs(A[:, count:]).max(axis=0)
    scale[scale == 0.0] = 1.0
    A[:, count:] /= scale
    force = float((high if np.isfinite(high).all() else np.append(low, abs(b))).max()) or 1.0
    bounds = np.append(low / force, -free), np.append(high / force, free)
    rounding = 0.0 if _split_forces(pose, U, at)[0].size else _OUTSIDE * force

    def farthest(along: Array) -> Solution:
        cost = np.append(np.zeros(count), along / scale)
        solution = maximise(cost, A, b / force, *bounds)
        if solution.status is Status.SOLVER_FAILED:
            raise solver_failed("highs", f"finds no largest load: {solution.message}")
        x = solution.x[count:] / scale * force
        return replace(solution, x=np.where(abs(x) <= rounding, 0.0, x))

    return farthest

"""Force polytope: all forces at the tip that an arm holds within the limits of its cables.

The forces f that some tensions balance, J_Lᵀ F = J_Xᵀ W + J_vᵀ f − g with minimum ≤ F ≤ maximum,
are a projection of a polytope. The hull method finds it (Lassez and Lassez, 1992; for robots
Skuric, Padois and Daney, RA-L 2022): hull of known vertices, one linear program along the normal of
each facet, until none finds a farther force.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, SolverError
from cdsm.measures.program import Loads
from cdsm.posture import Posture
from cdsm.support.format import key, plain
from cdsm.support.validation import instance, number_array, wrench_vector
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import bounds_at, distribute_tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_FLAT = 1e-8
"""Widths of a polytope over its size that are zero."""

_NO_MOTION = 1e-9
"""Singular values of J_v over the arm's length that are zero: the tip cannot move that way."""

_NO_WRENCH = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForcePolytope(ReadOnlyState):
    """All forces on the tip that an arm holds; made by :func:`force_polytope`.

    They are the loads f with ``normals`` @ f ≤ ``offsets``, in base axes, besides ``wrench``.

    Attributes:
        posture: The posture.
        wrench: W (6,) that always acts: force [N], then moment [N m], base axes.
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        vertices: Corners (n, 3) [N].
        faces: Corners of the triangles of its surface (m, 3), as indices; (0, 3) if it has none.
        normals: Outward unit normals of its facets (n, 3) [-].
        offsets: Distance of each facet from the force zero (n,) [N]; negative: zero is outside.
        unbounded: Unit directions (n, 3) in which the tip cannot move; links alone hold any force
            along them, and ``vertices`` have no part along them.
    """

    posture: Posture
    wrench: Array
    minimum: Array
    maximum: Array
    vertices: Array
    faces: NDArray[np.intp]
    normals: Array
    offsets: Array
    unbounded: Array

    @property
    def worst_direction(self) -> Array:
        """Unit direction (3,) of the smallest force that the arm does not hold."""
        return np.asarray(self.normals[int(self.offsets.argmin())])

    @property
    def volume(self) -> float:
        """Volume [N³]; inf if it is unbounded, 0 if it is flat."""
        if len(self.unbounded):
            return math.inf
        corners = self.vertices[self.faces] - self.vertices.mean(axis=0)
        return float(abs(np.linalg.det(corners)).sum()) / 6.0

    def margin(self, force: ArrayLike = (0.0, 0.0, 0.0)) -> float:
        """Compute the distance of a load from the nearest facet [N]: min b_i − n_i·f.

        It is the largest force in the worst direction that may be added. It is negative if the arm
        does not hold the load.

        Args:
            force: f (3,) [N].

        Raises:
            InvalidInput: ``force`` is not (3,) or (n, 3) numbers. Of several loads, the smallest
                margin is returned.
        """
        loads = number_array("force", force, "force")
        if loads.ndim not in (1, 2) or loads.shape[-1] != 3 or not loads.size:
            raise InvalidInput("force", f"shape {loads.shape} given, (3,) or (n, 3) needed [N].")
        return float((self.offsets - np.atleast_2d(loads) @ self.normals.T).min())

    def plot(self) -> Figure:
        """Plot the polytope [N]."""
        from cdsm.plots import plot_force_polytope  # matplotlib imports slowly

        return plot_force_polytope(self)

    def to_dict(self) -> dict[str, object]:
        """Return vertices, facets and margin in SI for JSON, with units in the keys."""
        numbers = {
            **self.posture._coordinates,
            key("margin", "N"): self.margin(),
            "worst_direction": self.worst_direction,
            "vertices_N": self.vertices,
            "normals": self.normals,
            "offsets_N": self.offsets,
            "unbounded": self.unbounded,
        }
        return dict(plain(numbers))

    def __repr__(self) -> str:
        return (
            f"<ForcePolytope of {len(self.vertices)} vertices, {self.margin():.4g} N in the worst "
            "direction>"
        )

    def __str__(self) -> str:
        x, y, z = self.worst_direction
        return (
            f"{len(self.vertices)} vertices; holds {self.margin():.4g} N in any direction, least "
            f"along ({x:.3g}, {y:.3g}, {z:.3g})"
        )


def force_polytope(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = _NO_WRENCH,
    *,
    worst_friction: bool = False,
) -> ForcePolytope:
    """Compute all forces f at the tip that tensions within the bounds balance, besides W (Eq. 13).

    Args:
        pose: The posture.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); finite.
        wrench: W (6,) at ``tool0`` in base axes that always acts: force [N], then moment [N m].
        worst_friction: As for :func:`~cdsm.distribute_tension`: the tensions stay within the
            bounds in every segment, whatever loads came before.

    Raises:
        InvalidInput: An argument has the wrong shape, or a cable has no upper bound and so the
            arm holds any force.
        InfeasibleTension: No tensions within the bounds balance any force at the tip, and also not
            none; the error says how far off.
        SolverError: A linear program fails.
    """
    instance("pose", pose, Posture)
    low, high = bounds_at(pose, minimum, maximum, worst_friction)
    W = wrench_vector("wrench", wrench)
    if not np.isfinite(high).all():
        cable = pose.arm.cables[int(np.isinf(high).argmax())].name
        raise InvalidInput("maximum", f"{cable} has none; give a finite one [N].")
    axes, size, _ = np.linalg.svd(pose.jacobian[:3])
    moving = np.zeros(3, dtype=np.bool_)
    moving[: size.size] = size > _NO_MOTION * pose.arm.length
    basis, unbounded = axes[:, moving], axes[:, ~moving].T
    loads = Loads.of(pose, low, high, W, basis)
    hull = _hull(loads, basis.shape[1])
    if hull is None:
        distribute_tension(pose, minimum, maximum, W, worst_friction=worst_friction)
        raise SolverError("highs", "finds no force, though tensions balance none. Change a bound.")
    return ForcePolytope(
        posture=pose,
        wrench=W,
        minimum=low,
        maximum=high,
        vertices=frozen(hull.points @ basis.T),
        faces=frozen(hull.faces),
        normals=frozen(hull.normals @ basis.T),
        offsets=frozen(hull.offsets),
        unbounded=frozen(unbounded),
    )


class _Hull(NamedTuple):
    """Corners (n, k), triangles (m, 3), normals (n, k) and offsets (n,) of a polytope."""

    points: Array
    faces: NDArray[np.intp]
    normals: Array
    offsets: Array


_Farthest = Callable[[Array], tuple[float, Array]]


def _hull(loads: Loads, k: int) -> _Hull | None:
    """Compute the polytope of all loads in k dimensions; None if it is empty."""

    def farthest(normal: Array) -> tuple[float, Array]:
        found = loads.largest(normal)
        if found is None:
            raise SolverError("highs", "calls a problem infeasible that it solved before.")
        return found

    if loads.largest(np.zeros(k)) is None:
        return None
    # the space that the polytope spans; in the others its width is zero
    points, normals, offsets = _span(farthest, k)
    start, *others = points
    spanned = np.linalg.svd(np.array([p - start for p in others]).reshape(-1, k))[2][: len(others)]
    flat = _Hull(
        np.array(points),
        np.zeros((0, 3), np.intp),
        np.array(normals).reshape(-1, k),
        np.array(offsets),
    )
    if len(spanned) < 2:
        along = [(u, *farthest(u)) for v in spanned for u in (v, -v)]
        return flat._replace(
            points=np.array([x for *_, x in along] or points),
            normals=np.vstack([flat.normals, *[u[None] for u, *_ in along]]),
            offsets=np.concatenate([flat.offsets, [b for _, b, _ in along]]),
        )
    corners, faces, facets, ends = _grown(farthest, np.array(points), spanned)
    return _Hull(
        corners, faces, np.vstack([flat.normals, facets]), np.concatenate([flat.offsets, ends])
    )


def _span(farthest: _Farthest, k: int) -> tuple[list[Array], list[Array], list[float]]:
    """Return points that span the polytope, and facets in pairs where its width is zero."""
    found: list[Array] = []
    normals: list[Array] = []
    offsets: list[float] = []
    tried = np.zeros((0, k))
    points: list[Array] = []
    while len(tried) < k:
        u = np.linalg.svd(np.vstack([tried, np.zeros((1, k))]))[2][-1]  # at right angles to all
        (most, above), (least, below) = farthest(u), farthest(-u)
        found += [above, below]
        points = points or [above]
        size = max(float(np.ptp(np.array(found), axis=0).max()), abs(most), abs(least))
        if most + least <= _FLAT * size:
            normals += [u, -u]
            offsets += [most, least]
            tried = np.vstack([tried, u])
            continue
        apart = max((above, below), key=lambda x: abs(float(u @ (x - points[0]))))
        points.append(apart)
        tried = np.vstack([tried, apart - points[0]])
        tried = np.linalg.svd(tried, full_matrices=False)[2]
    return points, normals, offsets


def _grown(
    farthest: _Farthest, points: Array, spanned: Array
) -> tuple[Array, NDArray[np.intp], Array, Array]:
    """Return corners, triangles, normals and offsets of a polytope that spans 2 or 3 dimensions."""
    from scipy.spatial import ConvexHull

    start = points[0]
    size = float(np.ptp(points, axis=0).max())
    done: dict[tuple[float, ...], tuple[Array, float]] = {}
    while True:
        inside = (points - start) @ spanned.T
        hull = ConvexHull(inside / size)
        rest = []
        for *flat, _ in np.unique(np.round(hull.equations, 9), axis=0):
            if tuple(flat) not in done:
                rest.append(tuple(flat))
        farther = []
        for flat in rest:
            normal = np.array(flat) @ spanned
            normal /= np.linalg.norm(normal)
            most, x = farthest(normal)
            reached = float((points @ normal).max())
            if most > reached + _FLAT * size:
                farther.append(x)
            else:
                done[flat] = normal, most
        if not farther:
            break
        points = np.vstack([points, *[x[None] for x in farther]])
        size = float(np.ptp(points, axis=0).max())
    # only facets of the last hull
    last = {tuple(each[:-1]) for each in np.unique(np.round(hull.equations, 9), axis=0)}
    facets = [done[flat] for flat in done if flat in last]
    corners = hull.vertices
    place = {int(v): i for i, v in enumerate(corners)}
    faces = np.zeros((0, 3), np.intp)
    if spanned.shape[0] == 3:
        faces = np.array([[place[int(v)] for v in each] for each in hull.simplices], np.intp)
    return (
        points[corners],
        faces,
        np.array([n for n, _ in facets]),
        np.array([b for _, b in facets]),
    )

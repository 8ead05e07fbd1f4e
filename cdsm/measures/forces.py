"""Force polytope: all forces at the tip that tensions within their bounds can balance.

The pairs of tensions F and forces f with J_Lᵀ F = J_Xᵀ W + J_vᵀ f − g and minimum ≤ F ≤ maximum
form a polytope. Its projection onto f is the force polytope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

import cdsm
from cdsm.errors import InvalidInput, SolverError
from cdsm.measures.hull import hull_of
from cdsm.measures.program import Loads
from cdsm.posture import Posture
from cdsm.support.format import coordinates, key, plain
from cdsm.support.validation import NO_WRENCH, instance, number_array, wrench_vector
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import bounds_at, distribute_tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NO_MOTION = 1e-9
"""Smaller singular values of J_v, divided by the arm length, count as zero: no tip motion there."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ForcePolytope(ReadOnlyState):
    """All forces at the tip that an arm can balance; made by :func:`force_polytope`.

    The forces f (3,) [N] in base axes act at the tip besides ``wrench``. The polytope is the set of
    all f with ``normals`` @ f ≤ ``offsets``.

    Attributes:
        posture: The posture.
        wrench: W (6,) that always acts: force [N], then moment [N m], base axes.
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        vertices: Corners (n, 3) [N].
        faces: Triangles of the surface (m, 3), as indices of ``vertices``; (0, 3) for a flat
            polytope.
        normals: Outward unit normals of the n facets (n, 3) [-].
        offsets: Distance of each facet from the force zero (n,) [N]; negative if zero is outside.
        unbounded: Unit directions (n, 3) in which the tip cannot move, as many as there are; the
            links balance any force along them, and ``vertices`` have no component along them.
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
        """Unit direction (3,) in which the largest force that the arm can balance is smallest."""
        return np.asarray(self.normals[int(self.offsets.argmin())])

    @property
    def volume(self) -> float:
        """Volume of the polytope [N³]; inf if it is unbounded, 0 if it is flat."""
        if len(self.unbounded):
            return math.inf
        corners = self.vertices[self.faces] - self.vertices.mean(axis=0)
        return float(abs(np.linalg.det(corners)).sum()) / 6.0

    def margin(self, force: ArrayLike = (0.0, 0.0, 0.0)) -> float:
        """Compute the distance of a force f from the nearest facet [N]: min_i (b_i − n_i·f).

        n_i and b_i are the rows of ``normals`` and ``offsets``. The distance is the largest force
        that may be added in every direction. It is negative if the arm cannot balance f.

        Args:
            force: f (3,) [N], or several (n, 3): then the smallest of their margins.

        Raises:
            InvalidInput: ``force`` is not (3,) or (n, 3) numbers.
        """
        loads = number_array("force", force, "force")
        if loads.ndim not in (1, 2) or loads.shape[-1] != 3 or not loads.size:
            raise InvalidInput("force", f"shape {loads.shape} given, (3,) or (n, 3) needed [N].")
        return float((self.offsets - np.atleast_2d(loads) @ self.normals.T).min())

    def plot(self) -> Figure:
        """Plot the polytope [N]."""
        return cdsm.plots.plot_force_polytope(self)

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
        return plain(numbers)

    def __repr__(self) -> str:
        return (
            f"<ForcePolytope of {len(self.vertices)} vertices, {self.margin():.4g} N in the worst "
            "direction>"
        )

    def __str__(self) -> str:
        return (
            f"{len(self.vertices)} vertices; holds {self.margin():.4g} N in any direction, least "
            f"along {coordinates(self.worst_direction, '.3g')}"
        )


def force_polytope(
    pose: Posture,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
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
        InvalidInput: An argument has the wrong shape, or a cable has no upper bound, so that the
            polytope is unbounded.
        InfeasibleTension: No tensions within the bounds balance any force at the tip, not even
            zero; the error gives the smallest violation.
        SolverError: A linear program fails.
    """
    instance("pose", pose, Posture)
    low, high = bounds_at(pose, minimum, maximum, worst_friction)
    W = wrench_vector("wrench", wrench)
    if not np.isfinite(high).all():
        cable = pose.arm.cables[int(np.isinf(high).argmax())].name
        raise InvalidInput("maximum", f"{cable} has none; give a finite one [N].")
    basis, unbounded = directions_of(pose.jacobian, pose.arm.length)
    loads = Loads.of(pose, low, high, W, basis)
    hull = hull_of(loads)
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


def directions_of(jacobian: Array, length: float) -> tuple[Array, Array]:
    """Return orthonormal directions in which the joints can move the tip, and the other directions.

    The k directions of motion are columns (3, k), the others rows (3−k, 3). ``jacobian`` is J_X
    (6, nv). A direction counts as immobile if the tip moves along it by less than 1e-9 times the
    ``length`` [m] of the arm per radian.
    """
    axes, size, _ = np.linalg.svd(jacobian[:3])
    moving = np.zeros(3, dtype=np.bool_)
    moving[: size.size] = size > _NO_MOTION * length
    return axes[:, moving], axes[:, ~moving].T

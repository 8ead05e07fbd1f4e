"""Convex hull of all loads that tensions balance, by one linear program for each facet.

Convex hull method (Lassez and Lassez, 1992; for robots Skuric, Padois and Daney, RA-L 2022): take
the hull of the known vertices, maximise along the normal of each facet by a linear program, and
repeat until no program finds a vertex outside the hull.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import SolverError
from cdsm.measures.program import Loads
from cdsm.support.values import Array

_FLAT = 1e-8  # smaller widths of a polytope, relative to its size, count as zero


class Hull(NamedTuple):
    """Polytope in k = 0 to 3 dimensions: all points x (k,) with ``normals`` @ x ≤ ``offsets``."""

    points: Array  # corners (n, k)
    faces: NDArray[np.intp]  # corners of its triangles (m, 3), as indices; none if it is flat
    normals: Array  # outward unit normals of the facets (f, k)
    offsets: Array  # distances of the facets from zero (f,)


_Farthest = Callable[[Array], tuple[float, Array]]


def hull_of(loads: Loads) -> Hull | None:
    """Compute the polytope of all loads x (k,) that tensions balance; None if it is empty."""
    k = loads.lever.size - loads.low.size

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
    none, facets = np.zeros((0, 3), np.intp), np.array(normals).reshape(-1, k)
    flat = Hull(np.array(points), none, facets, np.array(offsets))
    if len(spanned) < 2:
        along = [(u, *farthest(u)) for v in spanned for u in (v, -v)]
        return flat._replace(
            points=np.array([x for *_, x in along] or points),
            normals=np.vstack([flat.normals, *[u[None] for u, *_ in along]]),
            offsets=np.concatenate([flat.offsets, [b for _, b, _ in along]]),
        )
    whole = _polytope(farthest, flat.points, spanned)
    return whole._replace(
        normals=np.vstack([flat.normals, whole.normals]),
        offsets=np.concatenate([flat.offsets, whole.offsets]),
    )


def _span(farthest: _Farthest, k: int) -> tuple[list[Array], list[Array], list[float]]:
    """Find in which directions a polytope in k dimensions is flat, which means of width zero.

    ``farthest(u)`` returns the largest u·x of all points x of the polytope, and such an x. Returns
    points (k,) of the polytope that span its other directions, then normals and offsets of facets:
    two for each flat direction.
    """
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


def _polytope(farthest: _Farthest, points: Array, spanned: Array) -> Hull:
    """Find all vertices and facets of a polytope of 2 or 3 dimensions, from some ``points`` (n, k).

    ``farthest`` is as for :func:`_span`. The rows of ``spanned`` are an orthonormal basis of the
    directions in which the polytope is not flat.
    """
    from scipy.spatial import ConvexHull

    start = points[0]
    size = float(np.ptp(points, axis=0).max())
    done: dict[tuple[float, ...], tuple[Array, float]] = {}
    while True:
        inside = (points - start) @ spanned.T
        hull = ConvexHull(inside / size)
        flats = [tuple(each[:-1]) for each in np.unique(np.round(hull.equations, 9), axis=0)]
        farther = []
        for flat in flats:
            if flat in done:
                continue
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
    normals, offsets = zip(*(done[flat] for flat in done if flat in flats), strict=True)
    faces = np.zeros((0, 3), np.intp)
    if len(spanned) == 3:
        faces = np.searchsorted(hull.vertices, hull.simplices)  # vertices rise in 3 dimensions
    return Hull(points[hull.vertices], faces, np.array(normals), np.array(offsets))

"""Where searches begin, and from where they go on: stable tensions far apart, and across jumps."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from cdsm.planning.admissible import Admissible, solve
from cdsm.planning.objectives import unstable
from cdsm.planning.sqp import Found, Task, promises, search
from cdsm.planning.stiffness_model import Field, Point, drawn_back
from cdsm.support.validation import Array

_FAR = 1e4
"""How much further than the largest tension a corner is looked for."""

_SAME = 1e-6
"""Corners nearer to each other than this part of their size are one."""

_NEAR = 0.05
"""Tensions this part of a jump from it are tried on its other side first."""

_ROUNDS = 60
"""How often a better place may be stepped to."""

_MODES = 24
"""How many bounds on the reserve are kept."""

_NO_GAIN = 1e-9
"""A reserve, over the scale of K_θ, that is not worth a step."""


class Ground:
    """Stable tensions to begin from.

    Args:
        region: The admissible tensions, bounded.
        field: K_θ over them.
        directions: How many random directions to look for corners in, beside those of the cables.
        seed: Of these directions.

    Attributes:
        anchor: A stable point well inside.
        points: It, and stable points towards the corners; those of more directions go on from
            those of fewer.

    Raises:
        SingularStiffness: No admissible tension was found that holds the arm stable.
    """

    def __init__(self, region: Admissible, field: Field, directions: int, seed: int) -> None:
        least = region.least.values
        size = max(region.scale, float(region.high.max()))
        random = np.random.default_rng(seed).normal(size=(directions, least.size))
        corners, known = least[None], 1
        for k, direction in enumerate((*np.eye(least.size), *-np.eye(least.size), *random)):
            step = region.null @ (direction @ region.null)
            length = float(np.linalg.norm(step))
            if length <= _SAME:
                continue
            far = least + _FAR * size / length * step
            corner = region.nearest(far, region.low, region.high)
            if corner is not None and (abs(corners - corner).max(axis=1) > _SAME * size).all():
                corners = np.vstack([corners, corner])
                known += k < 2 * least.size
        # the random ones have no say in the anchor: with more of them the others stay what they are
        points = [field.at(F) for F in (corners[:known].mean(axis=0), *corners)]
        self.anchor = points[0]
        if self.anchor.reserve <= 0.0:
            self.anchor = max(points[: known + 1], key=lambda point: point.reserve)
        if self.anchor.reserve <= 0.0:
            stable = (point for point in points[known + 1 :] if point.reserve > 0.0)
            self.anchor = next(stable, None) or _stabilised(region, field, self.anchor)
        drawn = [
            point if point.reserve >= 0.0 else drawn_back(field, point.F, self.anchor)
            for point in points[1:]
        ]
        self._known = [self.anchor, *(point for point in drawn[:known] if point is not None)]
        self.points = [*self._known, *(point for point in drawn[known:] if point is not None)]

    def between(self, count: int, seed: int) -> Iterator[Point]:
        """Random stable points among the corners of the cables, count of them if found."""
        shares = np.random.default_rng(seed).dirichlet(np.ones(len(self._known)), count)
        for F in shares @ np.array([point.F for point in self._known]):
            point = drawn_back(self.anchor.field, F, self.anchor)
            if point is not None:
                yield point


def settled(task: Task, found: Found, *, near: float = _NEAR) -> Found:
    """The optimum found by a search, or a better one that crossing jumps of rigidities leads to.

    Within the ranges between the jumps a search is smooth. Cables that end at a jump or near one
    are tried on its other side: all those at one together, then each.

    Args:
        task: What is sought.
        found: Where a search has ended.
        near: How near to a jump, as a part of it.
    """
    iterations = found.iterations
    for _ in range(_ROUNDS):
        for F in beyond_jumps(task.region, found.sight.point.F, near):
            point = drawn_back(task.field, F, task.anchor)
            if point is None or not promises(task, point, found.sight):
                continue
            other = search(task, point, confined=True)
            iterations += other.iterations
            if task.better(other.sight, found.sight):
                found = other
                break
        else:
            break
    return Found(found.sight, iterations)


def beyond_jumps(region: Admissible, F: Array, near: float = _NEAR) -> Iterator[Array]:
    """The nearest tensions (C,) [N] beyond the jumps that tensions F (C,) [N] are near."""
    found = sorted(
        (abs(F[c] - jump) / jump, c, jump)
        for c, jumps in enumerate(region.jumps)
        for jump in jumps
        if abs(F[c] - jump) <= near * jump
    )
    at = [(c, jump) for distance, c, jump in found if distance <= _SAME]
    for group in ([at] if len(at) > 1 else []) + [[(c, jump)] for _, c, jump in found]:
        beyond = F.copy()
        for c, jump in group:
            beyond[c] = np.nextafter(jump, np.inf) if F[c] <= jump else jump
        there = region.nearest(F, *region.piece(beyond))
        if there is not None:
            yield there


def stretches(
    region: Admissible, one: Array, other: Array
) -> Iterator[tuple[float, float, tuple[Array, Array]]]:
    """Parts of the way between two tensions (C,) [N] on which no rigidity jumps, with their piece.

    A stretch is cut where a cable is at a jump; clipped to the bounds of the piece, both its ends
    are on its own side.
    """
    way = other - one
    cuts = {
        float((jump - one[c]) / way[c])
        for c, jumps in enumerate(region.jumps)
        for jump in jumps
        if min(one[c], other[c]) <= jump < max(one[c], other[c])
    }
    for a, b in pairwise(sorted({0.0, *cuts, 1.0})):
        yield a, b, region.piece(one + 0.5 * (a + b) * way)


def _stabilised(region: Admissible, field: Field, start: Point) -> Point:
    """The stable point with about the largest reserve, by cutting planes in a trust region.

    Each mode of an iterate bounds the reserve of all others from above, so they are kept.
    """
    here, radius, unit = start, 1.0, field.scale
    modes: list[Array] = []
    count = start.F.size
    A = np.hstack([region.rows, np.zeros((len(region.rows), 1))])
    # variables: the step, and the reserve that it leads to as far as the modes can tell
    P, q = 1e-4 * np.eye(count + 1), np.append(np.zeros(count), -1.0)
    for _ in range(_ROUNDS):
        modes = [*modes, *(here.vectors[:, [i]] for i in range(min(2, len(here.vectors))))][
            -_MODES:
        ]
        size = max(region.scale, float(here.F.max()))
        rates = np.array([here.along_slope(v) for v in modes]) * size / unit
        values = np.array([(v.T @ here.K @ v).item() - field.floor for v in modes]) / unit
        low = np.append(np.maximum((region.low - here.F) / size, -radius), -np.inf)
        high = np.append(np.minimum((region.high - here.F) / size, radius), np.inf)
        cuts = np.hstack([-rates, np.ones((len(modes), 1))]), values
        found = solve(P, q, (A, region.imbalance(here.F) / size), (low, high), cuts)
        if found is None:
            break
        there = field.at(here.F + size * found.x[:count])
        expected = float(found.x[count]) - here.reserve / unit
        gain = (there.reserve - here.reserve) / unit
        if expected <= _NO_GAIN or radius <= _NO_GAIN:
            break
        if gain > 0.0:
            here = there
        if gain > 0.5 * expected:
            radius *= 2.0
        elif gain < 0.1 * expected:
            radius = float(abs(found.x[:count]).max()) / 2.0
    if here.reserve > 0.0:
        return here
    of = field.pose.arm.stiffness_unit()
    raise unstable(
        field.pose.arm,
        "no admissible tensions hold the arm stable: at best the smallest eigenvalue of K_θ is "
        f"{here.values[0]:.4g} {of}, and {field.floor:.4g} {of} is asked for",
        here.vectors[:, 0],
    )

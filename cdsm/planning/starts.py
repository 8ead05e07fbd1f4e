"""Starting points of searches: stable tensions that lie far apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cdsm.planning.admissible import Admissible, solve
from cdsm.planning.objectives import unstable
from cdsm.planning.stiffness_model import Evaluation, StiffnessModel
from cdsm.support.values import Array

_FAR = 1e4  # distance of a point, over the largest tension; the nearest tensions are a corner
_SAME = 1e-6  # corners closer to each other than this part of their size are one
_ITERATIONS = 60
_MODES = 24  # number of cutting planes that are kept
_NO_GAIN = 1e-9  # a gain of reserve below this part of the scale of K_θ is not worth a step


class StartPoints:
    """Tensions in a bounded region under which the arm is stable; searches start from them.

    The search for corners of the region goes in the directions of higher and of lower tension of
    each cable, and in ``directions`` random directions. Raises SingularStiffness if no stable
    tensions are found.

    Attributes:
        anchor: A stable point well inside the region.
        points: The anchor, and stable points at the corners or near them. A larger ``directions``
            adds points and keeps the others.
    """

    def __init__(
        self, model: StiffnessModel, region: Admissible, directions: int, seed: int
    ) -> None:
        self._seed = seed
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
        # random corners do not move the anchor, so more of them do not change the others
        points = [model.at(F) for F in (corners[:known].mean(axis=0), *corners)]
        self.anchor = points[0]
        if self.anchor.reserve <= 0.0:
            self.anchor = max(points[: known + 1], key=lambda point: point.reserve)
        if self.anchor.reserve <= 0.0:
            stable = (point for point in points[known + 1 :] if point.reserve > 0.0)
            self.anchor = next(stable, None) or _stabilize(model, region, self.anchor)
        drawn = [
            point if point.reserve >= 0.0 else self.anchor.backtracked(point.F)
            for point in points[1:]
        ]
        self._known = [self.anchor, *(point for point in drawn[:known] if point is not None)]
        self.points = [*self._known, *(point for point in drawn[known:] if point is not None)]

    def between(self, count: int) -> Iterator[Evaluation]:
        """Yield up to ``count`` stable points: means of :attr:`points` with random weights.

        Points found in random directions are not used for these means.
        """
        shares = np.random.default_rng(self._seed).dirichlet(np.ones(len(self._known)), count)
        for F in shares @ np.array([point.F for point in self._known]):
            point = self.anchor.backtracked(F)
            if point is not None:
                yield point


def _stabilize(model: StiffnessModel, region: Admissible, start: Evaluation) -> Evaluation:
    """Find tensions in ``region`` with about the largest reserve λ_min − floor, by cutting planes.

    For every unit vector v, vᵀ K_θ(F) v is an upper bound of the smallest eigenvalue λ_min. Each
    iterate adds two such bounds, linearised in F: v are the eigenvectors of its two smallest
    eigenvalues. The next iterate has the largest reserve that all bounds allow within a trust
    region. ``start`` need not be stable. Raises SingularStiffness if no stable tensions are found.
    """
    iterate, radius, unit = start, 1.0, model.scale
    modes: list[Array] = []
    count = start.F.size
    A = np.hstack([region.rows, np.zeros((len(region.rows), 1))])
    # variables: the step, and the bound of the reserve after it
    P, q = 1e-4 * np.eye(count + 1), np.append(np.zeros(count), -1.0)
    for _ in range(_ITERATIONS):
        softest = (iterate.eigenvectors[:, [i]] for i in range(min(2, len(iterate.eigenvectors))))
        modes = [*modes, *softest][-_MODES:]
        size = max(region.scale, float(iterate.F.max()))
        rates = np.array([iterate.mode_gradient(v) for v in modes]) * size / unit
        values = np.array([(v.T @ iterate.K @ v).item() - model.floor for v in modes]) / unit
        low = np.append(np.maximum((region.low - iterate.F) / size, -radius), -np.inf)
        high = np.append(np.minimum((region.high - iterate.F) / size, radius), np.inf)
        cuts = np.hstack([-rates, np.ones((len(modes), 1))]), values
        found = solve(P, q, (A, region.imbalance(iterate.F) / size), (low, high), cuts)
        if found is None:
            break
        candidate = model.at(iterate.F + size * found.x[:count])
        expected = float(found.x[count]) - iterate.reserve / unit
        gain = (candidate.reserve - iterate.reserve) / unit
        if expected <= _NO_GAIN or radius <= _NO_GAIN:
            break
        if gain > 0.0:
            iterate = candidate
        if gain > 0.5 * expected:
            radius *= 2.0
        elif gain < 0.1 * expected:
            radius = float(abs(found.x[:count]).max()) / 2.0
    if iterate.reserve > 0.0:
        return iterate
    motion = iterate.eigenvectors[:, 0] * model.unit
    raise unstable(
        model.pose.arm,
        "no admissible tensions make the arm stable: at best the smallest eigenvalue of K_θ is "
        f"{iterate.eigenvalues[0]:.4g} N m/rad, and {model.floor:.4g} N m/rad is required",
        motion / np.linalg.norm(motion),
    )

"""Find reasons not to trust an identification, and write them as warnings."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import chdtrc

from cdsm.identification.intervals import NEGLIGIBLE, RANK_TOLERANCE
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.result import Identification
from cdsm.support.values import Array

_CORRELATED = 0.95  # a warning names two parameters whose correlation exceeds this value

_UNLIKELY = 1e-3
"""Least probability of χ². Below it, the model does not explain the measurements."""


_LEFT = 1e-2
"""Fall of χ² that a search with loops may leave undone: kinks of χ² stop such a search early."""


def warnings_of(result: Identification) -> list[str]:
    """Return one sentence for each reason not to trust a result."""
    sentences = [
        f"not identifiable (rank {result.rank} of {len(result.names)}): no prediction changes with "
        f"{combination}, so their values are one choice of many. Fix one, or measure what "
        "separates them."
        for combination in result._determination.open_combinations
    ]
    correlation, std = result.correlation, result.std
    for i, name in enumerate(result.names):
        for j in range(i):
            if abs(correlation[i, j]) > _CORRELATED and math.isfinite(std[i]):
                sentences.append(
                    f"{result.names[j]} and {name} are correlated at {correlation[i, j]:+.4f}: "
                    "mostly a combination of them is determined. Measure at other postures, "
                    "directions or tensions."
                )
    for i in range(len(result.names)):
        sentences += _at_bound(result, i) + _open_ends(result, i)
    if result.freedom and chdtrc(result.freedom, result.chi_square) < _UNLIKELY:
        worst = int(abs(result.residuals).argmax())
        sentences.append(
            f"the model does not explain the measurements within their σ: χ² = "
            f"{result.chi_square:.4g} with {result.freedom} degrees of freedom, worst at "
            f"{result._labels[worst]} with {result.residuals[worst]:+.3g} σ. The intervals are "
            "valid for a right model only."
        )
    return sentences


def _at_bound(result: Identification, i: int) -> list[str]:
    name, value = result.names[i], result.values[i]
    return [
        f"{name} is at its {side} bound, {limit:g}: the optimum lies there or beyond, and the "
        "intervals are those of a value within the bounds. Widen the bounds, or doubt the model."
        for side, limit in zip(("lower", "upper"), result.bounds[i], strict=True)
        if value == limit
    ]


def _open_ends(result: Identification, i: int) -> list[str]:
    """Return a warning for each side on which the 95 % interval of parameter i has no limit.

    There is only one warning if the measurements allow all values within the bounds, and none for a
    side where the optimum is on the bound, which another warning reports.
    """
    name, profile, limits = result.names[i], result.profiles[i], result.bounds[i]
    interval = result.confidence()[name]
    ends = [k for k in (0, 1) if math.isinf(interval[k])]
    if profile is None:
        return []
    if len(ends) == 2 and profile.ends == ("bound", "bound"):
        return [
            f"{name} may be anything within its bounds at 95 %: they determine it, not the "
            "measurements."
        ]
    sentences = []
    for k in ends:
        if result.values[i] == limits[k]:
            continue  # _at_bound reports this end
        reach = f"its bound, {limits[k]:g}."
        if profile.ends[k] != "bound":
            reach = f"{profile.values[(0, -1)[k]]:.4g}, where the model ends: {profile.ends[k]}"
        sentences.append(
            f"{name} has no {('lower', 'upper')[k]} limit at 95 %: the measurements agree with "
            f"everything up to {reach}"
        )
    return sentences


def unfinished(problem: LeastSquares, point: Array, jacobian: Array) -> list[str]:
    """Return a list with one warning if a search ended before a minimum of χ², else an empty list.

    ``point`` (P,) is the end of the search, in the unit cube of ``problem``; ``jacobian`` (n, P) is
    ∂r/∂point there. The warning says by how much χ² can still fall. A search can end early because
    the model does not exist beyond ``point``.
    """
    r = problem.residuals(point)
    gradient = r @ jacobian
    fixed = ((point == 0.0) & (gradient >= 0.0)) | ((point == 1.0) & (gradient <= 0.0))
    if fixed.all():
        return []
    step = np.zeros_like(point)
    step[~fixed] = np.linalg.lstsq(jacobian[:, ~fixed], -r, rcond=RANK_TOLERANCE)[0]
    fall = float(np.sum((jacobian @ step) ** 2))
    if fall < (_LEFT if problem.rough else NEGLIGIBLE):
        return []
    # look nearby for the end of the model: the search may have stopped there
    size = 1e-3 / max(1e-3, float(abs(step).max()))
    failure = problem.failure(np.clip(point + size * step, 0.0, 1.0))
    reason = (
        f"It lies beyond the edge of the model: {failure}" if failure else "Give another start."
    )
    return [
        f"no optimum within the bounds, so no intervals: χ² would still fall by about {fall:.3g} "
        f"on the way from {problem.describe(point)}. {reason}"
    ]


def lower_elsewhere(problem: LeastSquares, best: Array, lower: Array) -> list[str]:
    """Return the warning that χ² is lower at the point ``lower`` than at the minimum ``best``."""
    fall = problem.cost(best) - problem.cost(lower)
    return [
        f"not the best fit, so no intervals: χ² is {fall:.3g} lower at {problem.describe(lower)}. "
        "Give that as the start."
    ]

"""What of a tensile test can be fitted: its loading, from the first load to the largest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from cdsm._checks import Array
from cdsm._rigidity_curve import Points
from cdsm.errors import TensileTestError
from cdsm.tensile_data import TensileTest

FEWEST = 8
_MOST = 800  # more are averaged: their mean says as much, and is fitted faster
_MAD = 1.4826  # standard deviation of normal noise by its median magnitude


def loading(test: TensileTest) -> tuple[Points, float, tuple[str, ...]]:
    """The points to be fitted, the noise of one of them [N], and what was left out and why.

    Args:
        test: In the order it was recorded.

    Raises:
        TensileTestError: Too few points, units that cannot be, compression, or a force that does
            not rise with the displacement.
    """
    notes: list[str] = []
    strain, force = test.displacement / test.gauge_length, test.force
    _enough(len(strain), "points are given")
    _check_span(strain, force)
    kept = _is_loading(strain)
    if not kept.all():
        notes.append(f"{np.count_nonzero(~kept)} points of unloading and reloading left out")
    order = np.argsort(strain[kept], kind="stable")
    points = _merged(strain[kept][order], force[kept][order], np.ones(len(order)))
    _enough(
        len(points.force),
        "points of loading are left, each farther than all before it; give the points in the order "
        "they were recorded, with the displacement growing under load",
    )
    noise = _noise(points)
    span = float(np.ptp(points.force))
    if (lowest := points.force.min()) < -max(6.0 * noise, 1e-3 * span):
        raise TensileTestError(
            f"a force of {lowest:.4g} N is compression, and a wire cannot be pushed. Tare the load "
            "cell, or change the sign if the machine counts tension as negative."
        )
    peak = int(points.force.argmax())
    fallen = points.force[peak:] < points.force[peak] - max(6.0 * noise, 0.02 * span)
    if fallen.any():
        end = peak + int(fallen.argmax())
        notes.append(f"{len(points.force) - end} points after the largest force left out")
        points = points.part(slice(0, end))
    rising = isotonic_regression(points.force, weights=points.count).x
    scatter = float(np.sqrt(np.mean((points.force - rising) ** 2)))
    if len(rising) < FEWEST or not scatter < 0.1 * np.ptp(rising):
        raise TensileTestError(
            f"the force does not rise with the displacement: {len(rising)} points up to the "
            f"largest force, which scatter {scatter:.3g} N about a rise of {np.ptp(rising):.3g} N. "
            "Check that the columns are not swapped and belong together."
        )
    slack = rising <= rising[0] + max(4.0 * noise, 1e-6 * span)
    if (count := np.count_nonzero(slack)) > 5:  # a slope has no run of points below the noise
        notes.append(f"{count} points before the first load that rises above the noise left out")
        points = points.part(~slack)
    _enough(len(points.force), "points are left after the slack")
    _check_rigidity(points)
    return _averaged(points), noise, tuple(notes)


def _enough(count: int, what: str) -> None:
    if count < FEWEST:
        raise TensileTestError(f"only {count} {what}; a fit needs at least {FEWEST}.")


def _check_span(strain: Array, force: Array) -> None:
    reach = float(np.ptp(strain))
    if reach == 0.0 or np.ptp(force) == 0.0:
        raise TensileTestError("displacement or force never changes; give a test that loads.")
    if reach > 1.0:
        raise TensileTestError(
            f"the displacements span {reach:.4g} times the gauge length, and no wire stretches so "
            "far. Displacement and gauge length are in metres: is one of them in mm?"
        )


def _check_rigidity(points: Points) -> None:
    """Units that cannot be: EA over the upper half of the rise."""
    upper = points.force >= (points.force[0] + points.force[-1]) / 2.0
    rise, reach = np.ptp(points.force[upper]), np.ptp(points.strain[upper])
    rigidity = float(rise / max(reach, 1e-30))
    if not 1.0 <= rigidity <= 1e9:
        hint = (
            "is the force in kN, or the gauge length in mm?"
            if rigidity < 1.0
            else "is the displacement in km or already a strain, or the force in mN?"
        )
        raise TensileTestError(
            f"the rigidity would be about {rigidity:.3g} N, which no wire has (1 N to 1e9 N). "
            f"Displacement and gauge length are in m, force in N: {hint}"
        )


def _is_loading(strain: Array) -> NDArray[np.bool_]:
    """Where the strain is, up to its noise, beyond all before it."""
    jitter = 4.0 * _MAD * float(np.median(abs(np.diff(strain, 2)))) / np.sqrt(6.0)
    jitter = min(jitter, 0.005 * float(np.ptp(strain)))
    kept: NDArray[np.bool_] = strain >= np.maximum.accumulate(strain) - jitter
    return kept


def _merged(strain: Array, force: Array, count: Array) -> Points:
    """Points of equal strain become their mean."""
    unique, place = np.unique(strain, return_inverse=True)
    total = np.asarray(np.bincount(place, count), np.float64)
    return Points(unique, np.bincount(place, count * force) / total, total)


def _averaged(points: Points) -> Points:
    """At most so many points, each the mean of as many neighbours."""
    if len(points.force) <= _MOST:
        return points
    group = np.arange(len(points.force)) * _MOST // len(points.force)
    total = np.asarray(np.bincount(group, points.count), np.float64)
    strain, force = (
        np.bincount(group, points.count * each) / total for each in (points.strain, points.force)
    )
    return Points(strain, force, total)


def _noise(points: Points) -> float:
    """Standard deviation [N] of one point about the line through its neighbours."""
    before, at, after = points.strain[:-2], points.strain[1:-1], points.strain[2:]
    share = (at - before) / (after - before)
    error = points.force[1:-1] - (1.0 - share) * points.force[:-2] - share * points.force[2:]
    error /= np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    return float(_MAD * np.median(abs(error)))

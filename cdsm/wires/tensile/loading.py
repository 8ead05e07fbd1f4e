"""Select the points of a tensile test to fit: loading, from the first to the largest force."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from cdsm.errors import TensileTestError
from cdsm.support.values import Array
from cdsm.wires.tensile.record import TensileTest

FEWEST = 8
"""Least number of points of a fit. Fewer points show no bend."""
_MOST = 800  # fitted points; more are averaged, which makes the fit faster
_OUTLYING = 5e-3  # an outlier is farther from its neighbours than this fraction of the range
_AROUND = 25  # neighbouring points over which the noise is assumed constant
_SURE = 3.0  # standard deviations beyond which a rise of the force is certain
_MAD = 1.4826  # standard deviation of normal noise over its median magnitude
_GAUGES = 5e-3, 50.0  # gauge lengths of tests [m]; any other is taken for a mistake
_MISTAKEN = (  # mistake, then factors that correct force, displacement and gauge length
    ("the displacement is in mm", 1.0, 1e-3, 1.0),
    ("the displacement is in µm", 1.0, 1e-6, 1.0),
    ("the gauge length is {given:g} mm and should be {meant:g} mm", 1.0, 1.0, 1e-3),
    ("the gauge length is {given:g} mm and should be {meant:g} mm", 1.0, 1.0, 1e3),
    ("the force is in mN", 1e-3, 1.0, 1.0),
    ("the force is in kN", 1e3, 1.0, 1.0),
    ("the force is in MN", 1e6, 1.0, 1.0),
)


@dataclass(frozen=True)
class Points:
    """Points of a test; each is the average of one or more recorded points.

    Recorded points are averaged if their strains are equal, or if there are more than 800 of them.
    """

    strain: Array  # rising (n,) [-]
    force: Array  # (n,) [N]
    count: Array  # recorded points in each average (n,)

    def part(self, kept: NDArray[np.bool_] | slice) -> Points:
        """Return the points that the mask or slice ``kept`` selects."""
        return Points(self.strain[kept], self.force[kept], self.count[kept])

    def means(self, group: NDArray[np.intp]) -> Points:
        """Return the mean point of each group; ``group`` (n,) has each point's group."""
        count = np.asarray(np.bincount(group, self.count), np.float64)
        strain, force = (
            np.bincount(group, self.count * each) / count for each in (self.strain, self.force)
        )
        return Points(strain, force, count)


def loading(test: TensileTest) -> tuple[Points, float, tuple[str, ...]]:
    """Select the points of a test to fit: those of loading, without outliers and slack.

    Returns the points, the standard deviation of the noise of their forces [N], and notes on the
    points that are left out. Raises TensileTestError if they cannot be fitted.
    """
    notes: list[str] = []
    _require(test.force.size, "points are given")
    outlier = _outliers(test.force)
    outlier[1:-1] |= _outliers(test.displacement)[1:-1]  # a soft wire moves far at its first load
    if outlier.any():
        places = zip(test.force[outlier], test.displacement[outlier], strict=True)
        listed = [f"{force:.4g} N at {1e3 * place:.4g} mm" for force, place in places]
        more = f" and {len(listed) - 3} more" if len(listed) > 3 else ""
        notes.append(f"far from their neighbours and left out: {', '.join(listed[:3])}{more}")
    force, strain = test.force[~outlier], test.displacement[~outlier] / test.gauge_length
    _require(len(force), "points are left that lie near their neighbours")
    _check_span(strain, force, test.gauge_length)
    kept = _is_loading(strain)
    if not kept.all():
        notes.append(f"points of unloading and reloading left out: {np.count_nonzero(~kept)}")
    unique, place = np.unique(strain[kept], return_inverse=True)
    points = Points(strain[kept], force[kept], np.ones(len(place))).means(place)
    points = replace(points, strain=unique)  # without the rounding of a mean
    _require(
        len(points.force),
        "points of loading are left, each farther than all before it; give the points in the order "
        "they were recorded, with the displacement growing under load",
    )
    noise = _noise(points)
    span = float(np.ptp(points.force))
    if (lowest := points.force.min()) < -max(6.0 * noise, 5e-3 * span):
        raise TensileTestError(
            f"a force of {lowest:.4g} N is compression, and a wire cannot be pushed. Tare the load "
            "cell, or change the sign if the machine counts tension as negative."
        )
    peak = int(points.force.argmax())
    fallen = points.force[peak:] < points.force[peak] - max(6.0 * noise, 0.02 * span)
    if fallen.any():
        end = peak + int(fallen.argmax())
        notes.append(f"points after the largest force left out: {len(points.force) - end}")
        points = points.part(slice(0, end))
    rising = isotonic_regression(points.force, weights=points.count).x
    scatter = float(np.sqrt(np.mean((points.force - rising) ** 2)))
    if len(rising) < FEWEST or not scatter < 0.1 * np.ptp(rising):
        raise TensileTestError(
            f"the force does not rise with the displacement: {len(rising)} points up to the "
            f"largest force, which scatter {scatter:.3g} N about a rise of {np.ptp(rising):.3g} N. "
            "Check that the columns are not swapped and belong together."
        )
    notes += _slips(points, test.gauge_length, max(8.0 * noise, _OUTLYING * span))
    if count := _slack(points, noise, 1e-6 * span):
        until = 1e3 * points.strain[count] * test.gauge_length
        notes.append(
            f"points before the first load left out: {count}, up to {until:.4g} mm, where the "
            "force does not rise beyond its noise"
        )
        points = points.part(slice(count, None))
    _require(len(points.force), "points are left after the slack")
    _check_rigidity(points, test.gauge_length)
    if len(points.force) > _MOST:
        points = points.means(np.arange(len(points.force)) * _MOST // len(points.force))
    return points, noise, tuple(notes)


def _outliers(values: Array) -> NDArray[np.bool_]:
    """Return for each of n values whether it is an outlier: alone and far from its neighbours.

    A real peak is not an outlier: the values on either side of it change fast, too.
    """
    # extrapolate the missing neighbour at each end
    first, last = 2.0 * values[1] - values[2], 2.0 * values[-2] - values[-3]
    before, after = np.append(first, values[:-1]), np.append(values[1:], last)
    size = abs(np.diff(values))
    step = np.maximum(np.pad(size, (2, 0))[:-1], np.pad(size, (0, 2))[1:])  # of the neighbours only
    noise = local_noise((values - (before + after) / 2.0) / np.sqrt(1.5))
    reach = float(np.ptp(np.quantile(values, (0.1, 0.9))))  # without outliers
    beyond = np.maximum(values - np.maximum(before, after), np.minimum(before, after) - values)
    limit = np.maximum(np.maximum(8.0 * noise, 2.0 * step), _OUTLYING * reach)
    return np.asarray(beyond > limit)


def local_noise(errors: Array) -> Array:
    """Estimate the local standard deviation (n,) of n errors, from those nearby.

    It is at least the standard deviation of all errors.
    """
    width = min(_AROUND, len(errors))
    near = np.pad(abs(errors), (width // 2, width - 1 - width // 2), mode="reflect")
    local = np.median(np.lib.stride_tricks.sliding_window_view(near, width), axis=1)
    return np.asarray(_MAD * np.maximum(local, np.median(abs(errors))))


def _slips(points: Points, gauge_length: float, least: float) -> list[str]:
    """Return a note for each slip of a grip: a fall of the force by more than ``least`` [N]."""
    highest = np.maximum.accumulate(points.force)
    fall = highest - points.force
    notes = []
    for peak in np.unique(highest[fall > least]):
        below = np.flatnonzero((highest == peak) & (fall > least))
        if len(below) > 1:
            place = 1e3 * points.strain[below[0]] * gauge_length
            notes.append(
                f"the force falls by {fall[below].max():.4g} N at {place:.4g} mm while the "
                f"displacement grows, as when a grip slips: EA near {peak:.4g} N comes out too low"
            )
    return notes


def _slack(points: Points, noise: float, least: float) -> int:
    """Count the points at the beginning of the test at which the wire is slack.

    At these points the force does not rise significantly. ``noise`` is the standard deviation of a
    force [N]; it is assumed to be at least ``least`` [N].
    """
    slope, error = _trends(points, noise, least)
    flat = np.flatnonzero(slope <= _SURE * error)
    count = int(flat[-1]) + 1 if len(flat) else 0
    after = points.part(slice(count, 2 * count))
    if count < 2 or len(after.force) < 2:
        return 0
    slope_after, error_after = (each[-1] for each in _trends(after, noise, least))
    # a force that rises evenly from the first point has no slack, even with large noise
    rises = slope_after - slope[count - 1] > _SURE * np.hypot(error_after, error[count - 1])
    return count if rises else 0


def _trends(points: Points, noise: float, least: float) -> tuple[Array, Array]:
    """Fit a line to the first n points, for each n; return the slopes and their standard errors.

    Both are in N per point. The error follows from the ``noise`` of a force [N], or from the
    scatter of the n points if that is smaller, but at least from ``least`` [N].
    """
    w, x, y = points.count, np.arange(len(points.force)), points.force - points.force[0]
    total = np.cumsum(w)
    xx, xy, yy = (
        np.cumsum(w * a * b) - np.cumsum(w * a) * np.cumsum(w * b) / total
        for a, b in ((x, x), (x, y), (y, y))
    )
    xx = np.maximum(xx, 1e-12)
    scatter = np.sqrt(np.maximum(yy - xy**2 / xx, 0.0) / np.maximum(np.arange(len(x)) - 1, 1))
    scatter[:2] = noise
    # the smaller one: with few points, the noise may be the bend of a soft wire
    return xy / xx, np.maximum(np.minimum(noise, scatter), least) / np.sqrt(xx)


def _require(count: int, what: str) -> None:
    if count < FEWEST:
        raise TensileTestError(f"only {count} {what}; a fit needs at least {FEWEST}.")


def _check_span(strain: Array, force: Array, gauge_length: float) -> None:
    reach = float(np.ptp(strain))
    if reach == 0.0 or np.ptp(force) == 0.0:
        raise TensileTestError("displacement or force never changes; give a test that loads.")
    if reach > 1.0:
        raise TensileTestError(
            f"the displacements span {1e3 * reach * gauge_length:.4g} mm, {reach:.4g} times the "
            f"gauge length of {1e3 * gauge_length:.4g} mm, and no wire stretches so far. "
            f"{_likely(float(np.ptp(force)) / reach, reach, gauge_length)}"
        )


def _check_rigidity(points: Points, gauge_length: float) -> None:
    """Raise TensileTestError if the rigidity in the upper half of the forces is implausible."""
    upper = points.force >= (points.force[0] + points.force[-1]) / 2.0
    rise, reach = np.ptp(points.force[upper]), np.ptp(points.strain[upper])
    rigidity = float(rise / max(reach, 1e-30))
    if not 1.0 <= rigidity <= 1e9:
        raise TensileTestError(
            f"the rigidity would be about {rigidity:.3g} N, which no wire has (1 N to 1e9 N). "
            f"{_likely(rigidity, float(np.ptp(points.strain)), gauge_length)}"
        )


def _likely(rigidity: float, reach: float, gauge_length: float) -> str:
    """Return a sentence that names mistakes of units or gauge length that explain the data.

    The ``rigidity`` [N] or the span of the strain, ``reach`` [-], is implausible.
    """
    found = []
    low, high = _GAUGES
    for mistake, force, displacement, gauge in _MISTAKEN:
        strain = displacement / gauge
        possible = 1e2 <= rigidity * force / strain <= 1e7 and 1e-4 <= reach * strain <= 1.0
        # a gauge length that tests have is taken for right
        if possible and (gauge == 1.0) is (low <= gauge_length <= high):
            meant = 1e3 * gauge_length * gauge
            found.append(mistake.format(given=1e3 * gauge_length, meant=meant))
    if not found:
        return "Check the units of displacement, force and gauge length."
    return f"It looks as if {' or '.join(found)}."


def _is_loading(strain: Array) -> NDArray[np.bool_]:
    """Return for each strain whether it is at least the largest one before, within the noise.

    Other points belong to unloading and reloading.
    """
    jitter = 4.0 * _MAD * float(np.median(abs(np.diff(strain, 2)))) / np.sqrt(6.0)
    jitter = min(jitter, 0.005 * float(np.ptp(strain)))
    kept: NDArray[np.bool_] = strain >= np.maximum.accumulate(strain) - jitter
    return kept


def _noise(points: Points) -> float:
    """Estimate the noise of a force [N] (one σ) from the scatter about neighbouring points.

    The error of a point is its distance from the line between its two neighbours.
    """
    before, at, after = points.strain[:-2], points.strain[1:-1], points.strain[2:]
    share = (at - before) / (after - before)
    error = points.force[1:-1] - (1.0 - share) * points.force[:-2] - share * points.force[2:]
    error /= np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    return float(_MAD * np.median(abs(error)))

"""Choose the loading branch of a tensile test: no slack, no lone points, no holds, no unloading."""

from __future__ import annotations

from typing import Final, NamedTuple, NoReturn

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from cdsm.errors import InvalidInput
from cdsm.support.values import Array

FEWEST: Final = 8  # points of a fit; fewer show no bend
_FALL: Final = 0.1  # a fall of the force by this share of its range ends a loading branch
_REACHED: Final = 0.95  # share of the largest force that a complete branch reaches
_RELAXED: Final = 0.85  # share of the branch before that a complete one reaches
_LOW: Final = 0.3  # share of its largest force below which a complete branch begins
_BANDS: Final = 100  # bands of progress, in which readings are counted
_HOLD: Final = 3.0  # readings in a band of a hold, over those of the median band
_UNIT: Final = 1e-6  # of which steps of a load cell are multiples [N]
_COARSE: Final = 1e-5  # least step of a load cell that counts, over the range of the force
_SURE: Final = 6.0  # standard deviations


def refuse(problem: str) -> NoReturn:
    """Raise InvalidInput: the test cannot be fitted."""
    raise InvalidInput("tensile test", problem)


class Loading(NamedTuple):
    """Points of the branch that is fitted, in the order recorded."""

    strain: Array  # (n,) [-]
    force: Array  # (n,) [N]
    noise: float  # of a force, one σ [N]
    resolution: float  # of the load cell [N]; 0 if its steps do not show
    notes: tuple[str, ...]  # what was left out


class _Branch(NamedTuple):
    """A rise of the force, between readings."""

    first: int  # reading of the least force before it
    last: int  # reading that first reaches its largest force


def loading(strain: Array, force: Array, between: tuple[float, float]) -> Loading:
    """Choose the last complete loading branch; leave out slack, lone points, and holds.

    Nothing is sorted or made to rise within it: noise of the displacement would then bias EA.
    """
    if len(force) < FEWEST or not np.ptp(strain) or not np.ptp(force):
        refuse(
            f"{len(force)} points given; at least {FEWEST} are needed, of which displacement and "
            "force change."
        )
    noise, reach = _noise_and_reach(force)
    resolution = _resolution(force)
    noise = max(noise, resolution / np.sqrt(12.0))
    lone = _lone(force) | _lone(strain)
    strain = strain[~lone]
    force = force[~lone]
    if (lowest := force.min()) < -max(6.0 * noise, 5e-3 * reach):
        refuse(f"{lowest:.4g} N is compression. Tare the load cell, or change the sign.")
    most = float(force.max())
    branches = _branches(force, max(_FALL * reach, 8.0 * noise))
    chosen = _complete(force, branches, between[1])
    notes = _other_branches(force, branches, chosen)
    first, last = branches[chosen]
    first += chosen > 0 and _is_slack(strain[first : last + 1], force[first : last + 1])
    after = len(force) - last - 1
    strain = strain[first : last + 1]
    force = force[first : last + 1]
    low = force <= force[: max(3, len(force) // 100)].min() + 4.0 * noise
    slack = int(np.flatnonzero(low)[-1]) if force[0] <= 8.0 * noise and low.sum() > 2 else 0
    strain = strain[slack:]
    force = force[slack:]
    strain, force, held, crept = _without_holds(strain, force)
    inside = (force >= between[0]) & (force <= between[1])
    strain = strain[inside]
    force = force[inside]
    _require_rise(strain, force, between, most)
    left_out = {
        "points far from their neighbours left out": lone.sum(),
        "points before this branch left out": first,
        "points after the largest force left out": after,
        "points before the first load left out": slack,
        "points of holds left out": held,
        f"points outside {between[0]:g} to {between[1]:g} N left out": (~inside).sum(),
    }
    counts = (f"{what}: {count}" for what, count in left_out.items() if count)
    return Loading(strain, force, noise, resolution, (*notes, *counts, *crept))


def _require_rise(strain: Array, force: Array, between: tuple[float, float], most: float) -> None:
    """Refuse points whose force does not rise with the strain, or whose units are impossible."""
    in_order = force[np.argsort(strain, kind="stable")]
    rising = isotonic_regression(in_order).x if len(force) else in_order
    if len(force) < FEWEST or not np.std(in_order - rising) < 0.1 * np.ptp(rising):
        narrow = "" if np.isinf(between).all() else f" from {between[0]:g} to {between[1]:g} N"
        refuse(
            f"the force does not rise with the displacement in {len(force)} points of loading"
            f"{narrow}; the largest force is {most:.4g} N. "
            f"Give {FEWEST} or more in the order recorded; check that the columns belong together."
        )
    chord = np.ptp(force) / np.ptp(strain)
    if np.ptp(strain) > 1.0 or not 1.0 < chord < 1e9:
        refuse(
            f"strains to {np.ptp(strain):.3g} and a rigidity of about {chord:.3g} N. Check the "
            "units of displacement, force and gauge length."
        )


def _branches(force: Array, fall: float) -> list[_Branch]:
    """Return the rises that end with a fall by ``fall`` [N] or with the test, one or more.

    A fall counts from the largest force since the rise began, so equal peaks with less between
    them are one.
    """
    readings = force.tolist()
    branches = []
    trough = 0
    peak = 0
    rises = True
    for k, value in enumerate(readings):
        if rises:
            if value > readings[peak]:
                peak = k
            elif value < readings[trough] and readings[peak] - readings[trough] < fall:
                trough = k
                peak = k
            elif value < readings[peak] - fall:
                branches.append(_Branch(trough, peak))
                rises = False
                trough = k
        elif value <= readings[trough]:
            trough = k
        elif value > readings[trough] + fall:
            rises = True
            peak = k
    if rises and (not branches or readings[peak] - readings[trough] >= fall):
        branches.append(_Branch(trough, peak))
    return branches


def _complete(force: Array, branches: list[_Branch], most: float) -> int:
    """Return the number of the last complete branch, of forces up to ``most`` [N].

    The first one reaches the largest force. A later one is complete if it begins near zero and
    reaches almost as much as the one before: at equal displacement, peaks relax.
    """
    peaks = np.minimum([force[branch.last] for branch in branches], most)
    top = _REACHED * min(float(force.max()), most)
    chosen = int(np.flatnonzero(peaks >= top)[0])
    for number in range(chosen + 1, len(branches)):
        complete = force[branches[number].first] <= _LOW * peaks[number]
        if peaks[number] >= top or (complete and peaks[number] >= _RELAXED * peaks[chosen]):
            chosen = number
    return chosen


def _other_branches(force: Array, branches: list[_Branch], chosen: int) -> tuple[str, ...]:
    """Return a note that names the branch that is fitted, and all others."""
    if len(branches) == 1:
        return ()
    spans = [f"{force[a]:.4g} to {force[b]:.4g} N" for a, b in branches]
    others = [f"{spans[k]} (number {k + 1})" for k in range(len(branches)) if k != chosen]
    more = f" and {len(others) - 6} more" if len(others) > 6 else ""
    return (
        f"branch {chosen + 1} of {len(branches)} loading branches is fitted, "
        f"{spans[chosen]}, the last complete one; not {', '.join(others[:6])}{more}",
    )


def _is_slack(strain: Array, force: Array) -> bool:
    """Return whether the first reading of a rise still is one of the unloading before it.

    The displacement then goes on from it to the next one, and the force hardly.
    """
    few = slice(1, 7)
    if len(force) < 7 or np.ptp(strain[few]) == 0.0:
        return False
    slope = np.polyfit(strain[few], force[few], 1)[0]
    return bool(force[1] - force[0] < _LOW * slope * (strain[1] - strain[0]))


def _without_holds(strain: Array, force: Array) -> tuple[Array, Array, int, tuple[str, ...]]:
    """Return strain and force (m,) without readings of holds, their number, and notes.

    In a hold neither the force nor the displacement goes on. What the wire creeps in a hold, or
    the force relaxes, is no elasticity: the strains after it are moved by as much, so that the
    curve goes on with the slope that it had.
    """
    progress = strain / np.ptp(strain) + force / np.ptp(force) if np.ptp(strain) else 0.0 * force
    progress = np.maximum.accumulate(progress - progress[0])
    band = np.minimum(_BANDS * progress / max(progress[-1], 1e-300), _BANDS - 1).astype(int)
    _, firsts, counts = np.unique(band, return_index=True, return_counts=True)
    usual = float(np.median(counts))
    held = np.flatnonzero(counts > _HOLD * (usual + 1.0))
    kept = np.ones(len(force), dtype=bool)
    notes = []
    strain = strain.copy()
    slip = _noise_and_reach(strain)[0] if len(strain) > 2 else 0.0
    for k in held.tolist():
        begin = int(firsts[k]) + max(1, round(usual))
        end = int(firsts[k] + counts[k])
        kept[begin:end] = False
        near = np.flatnonzero(kept[:begin])[-max(6, round(8 * usual)) :]
        if end >= len(force) or len(near) < 4 or not np.ptp(force[near]):
            continue
        softness, level = np.polyfit(force[near], strain[near], 1)
        scatter = float(np.std(strain[near] - level - softness * force[near]))
        after = slice(end, end + max(1, round(usual)))
        gap = float(np.mean(strain[after] - level - softness * force[after]))
        if gap > _SURE * max(scatter, slip, 1e-9):
            strain[end:] -= gap
            notes.append(
                f"a hold near {force[begin]:.4g} N lengthens the wire by a strain of {gap:.2g}, "
                "which is taken out"
            )
    return strain[kept], force[kept], int((~kept).sum()), tuple(notes)


def _noise_and_reach(values: Array) -> tuple[float, float]:
    """Return one σ of the noise of values in a row, and their range without extremes."""
    noise = 1.4826 * np.median(abs(np.diff(values, 2))) / np.sqrt(6.0)
    return float(noise), float(np.ptp(np.quantile(values, (0.02, 0.98))))


def _resolution(force: Array) -> float:
    """Return the step of the load cell [N], of which all differences of forces are multiples."""
    steps = np.unique(np.rint(abs(np.diff(force)) / _UNIT).astype(np.int64))
    common = _UNIT * float(np.gcd.reduce(steps))
    even = len(steps) == 1  # a ramp of equal steps, which may be exact
    return 0.0 if even or common < _COARSE * np.ptp(force) else common


def _lone(values: Array) -> NDArray[np.bool_]:
    """Return whether each value is alone and far from its neighbours."""
    noise, reach = _noise_and_reach(values)
    least = max(8.0 * noise, 5e-3 * reach, 2.0 * np.median(abs(np.diff(values))))
    middle = np.median(sliding_window_view(np.pad(values, 1, mode="edge"), 3), axis=1)
    return np.asarray(abs(values - middle) > least)

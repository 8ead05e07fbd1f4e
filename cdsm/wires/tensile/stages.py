"""Find where a tensile test leaves pre-tensioning, where it yields, and reasons to doubt a fit."""

from __future__ import annotations

import numpy as np

from cdsm.errors import TensileTestError
from cdsm.support.values import Array
from cdsm.wires.tensile.loading import Points, local_noise
from cdsm.wires.tensile.spline import Curve, Spread

YIELD = 0.8
"""Plasticity begins where EA falls below this fraction of its largest value and stays there."""
PRETENSIONED = 0.5
"""Pre-tensioning ends where d ln EA/d ln F falls below this: midway from EA ∝ F to constant EA."""
_CERTAIN = 3.0  # standard deviations beyond which a fact is certain
_FAR = 8.0  # standard deviations beyond which a point is doubtful
_JUMP = 10.0  # EA over the steepest measured chord; beyond it, the curve has overshot a jump
_SEEN = 1e-4  # smallest share of the range of force that a load cell shows
_STEP = 1.25  # ratio of tensions to compute the exponent; a smaller one takes noise for slope


def yield_onset(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
    """Find the tension [N] from which EA stays below 0.8 of its largest value: the yield.

    The arguments are F (g,) [N], EA (g,) [N] and the standard deviation of log EA (g,) [-]. The
    result is None if EA does not fall so far beyond its uncertainty.
    """
    level = np.log(rigidity)
    # the plateau is where EA is certain: noise at an uncertain end must not count as plateau
    top = int(np.argmax(level - 2.0 * _CERTAIN * deviation))
    below = level < level[top] + np.log(YIELD)
    sure = level + _CERTAIN * np.hypot(deviation, deviation[top]) < level[top] + np.log(YIELD)
    tail = np.flatnonzero(~below)[-1] + 1  # EA never recovers from here on
    return float(tensions[tail]) if sure[tail:].any() else None


def pretension_end(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
    """Find the tension [N] where pre-tensioning ends: beyond it, EA grows slower than √F.

    √F is midway from EA ∝ F to constant EA. None if EA nowhere grows faster than √F, beyond its
    uncertainty. The arguments are F (g,) [N], EA (g,) [N] and the standard deviation of log EA (g,)
    [-].
    """
    level = np.log(rigidity)
    inner = (tensions > _STEP * tensions[0]) & (tensions < tensions[-1] / _STEP) & (tensions > 0)
    if not inner.any():
        return None
    F = tensions[inner]
    above, under = (np.interp(F * s, tensions, level) for s in (_STEP, 1.0 / _STEP))
    steep = (above - under) / (2.0 * np.log(_STEP)) >= PRETENSIONED
    surely = np.interp(F, tensions, level - _CERTAIN * deviation)
    perhaps = np.interp(F, tensions, level + _CERTAIN * deviation)
    edges = np.flatnonzero(np.diff(np.pad(steep.astype(int), 1)))
    for start, end in zip(edges[-2::-2], edges[::-2], strict=True):
        # skip a rise that noise may have caused
        if surely[start:end].max() > perhaps[start:end].min():
            return float(F[end - 1])
    return None


def refuse_jumps(curve: Curve, points: Points) -> None:
    """Raise TensileTestError if the force seems to jump, so that no smooth curve follows it.

    It does if EA is above ten times the slope of the steepest chord between neighbouring points.
    """
    first, last = curve.force(points.strain[[0, -1]])
    inside = (curve.basis.tensions >= first) & (curve.basis.tensions <= last)
    steepest = int(np.where(inside, curve.rigidity, 0.0).argmax())
    measured = float((np.diff(points.force) / np.diff(points.strain)).max())
    if curve.rigidity[steepest] > _JUMP * measured:
        raise TensileTestError(
            f"the force is discontinuous near {curve.basis.tensions[steepest]:.4g} N while the "
            "displacement hardly grows, and no smooth curve follows it. Look for a wire "
            "gripped anew, a stuck extensometer, or units that change midway."
        )


def doubts(points: Points, spread: Spread, gauge_length: float) -> tuple[str, ...]:
    """Return a sentence for each reason to doubt a fit: a point far off, correlated residuals."""
    errors, reach = spread.errors, float(np.ptp(points.force))
    notes = []
    times = abs(errors) / np.maximum(local_noise(errors), _SEEN * reach)
    worst = int(times.argmax())
    if times[worst] > _FAR:
        place = 1e3 * points.strain[worst] * gauge_length
        notes.append(
            f"{points.force[worst]:.4g} N at {place:.4g} mm lies "
            f"{times[worst]:.0f} times the scatter around it off the curve: check this point"
        )
    # without noise, all errors may be zero
    correlation = float(errors[1:] @ errors[:-1]) / (float(errors @ errors) or 1.0)
    if correlation > 4.0 / np.sqrt(len(errors)) and spread.noise > _SEEN * reach:
        widen = float(np.sqrt((1.0 + correlation) / (1.0 - correlation)))
        notes.append(
            f"neighbouring residuals go together (correlation {correlation:.2f}): the force drifts "
            f"or ripples, or EA bends too sharply for the curve. The band is at least {widen:.1f} "
            "times too narrow"
        )
    return tuple(notes)

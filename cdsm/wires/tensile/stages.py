"""Where pre-tensioning ends, where the wire yields, and what makes a fit doubtful."""

from __future__ import annotations

import numpy as np

from cdsm.errors import TensileTestError
from cdsm.support.validation import Array
from cdsm.wires.tensile.loading import local_noise
from cdsm.wires.tensile.spline import Curve, Points, Spread

YIELD = 0.8
"""Plasticity begins where EA falls below this share of its largest value, for good."""
PRETENSIONED = 0.5
"""Pre-tensioning ends where d ln EA/d ln F falls below this: midway from EA ∝ F to EA constant."""
_CERTAIN = 3.0
"""Standard deviations of a fact that noise has not made."""
_FAR = 8.0
"""Standard deviations of a point that does not belong to the test."""
_JUMP = 10.0
"""EA over the steepest measured chord from which on the curve has overshot a jump."""
_SEEN = 1e-4
"""Share of the range of force that a load cell shows at least."""
_STEP = 1.25
"""Ratio of tensions over which the exponent is taken: over less, noise passes for slope."""


def yield_onset(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
    """Tension [N] from which EA stays below its plateau, or None if it never surely does.

    Args:
        tensions: F (g,) [N].
        rigidity: EA (g,) [N].
        deviation: Standard deviation of log EA (g,).
    """
    level = np.log(rigidity)
    # a plateau is well known: a chance rise of an end that is not must not pass for one
    top = int(np.argmax(level - 2.0 * _CERTAIN * deviation))
    below = level < level[top] + np.log(YIELD)
    sure = level + _CERTAIN * np.hypot(deviation, deviation[top]) < level[top] + np.log(YIELD)
    tail = np.flatnonzero(~below)[-1] + 1  # from here on it never recovers
    return float(tensions[tail]) if sure[tail:].any() else None


def pretension_end(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
    """Tension [N] from which EA grows slower than √F, or None if it surely never grew faster.

    Args:
        tensions: F (g,) [N].
        rigidity: EA (g,) [N].
        deviation: Standard deviation of log EA (g,).
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
        # a rise that the noise may have made is no stage
        if surely[start:end].max() > perhaps[start:end].min():
            return float(F[end - 1])
    return None


def refuse_jumps(curve: Curve, points: Points) -> None:
    """Refuse a force that jumps: there EA of the curve is ten times that of any measured chord."""
    first, last = curve.force(points.strain[[0, -1]])
    inside = (curve.basis.tensions >= first) & (curve.basis.tensions <= last)
    steepest = int(np.where(inside, curve.rigidity, 0.0).argmax())
    measured = float((np.diff(points.force) / np.diff(points.strain)).max())
    if curve.rigidity[steepest] > _JUMP * measured:
        raise TensileTestError(
            f"the force jumps near {curve.basis.tensions[steepest]:.4g} N while the displacement "
            "hardly grows, and no smooth curve follows it. Look for a wire gripped anew, a stuck "
            "extensometer, or units that change midway."
        )


def doubts(points: Points, spread: Spread, gauge_length: float) -> tuple[str, ...]:
    """What in the residuals makes the fit doubtful, one sentence each."""
    errors, reach = spread.errors, float(np.ptp(points.force))
    notes = []
    times = abs(errors) / np.maximum(local_noise(errors), _SEEN * reach)
    worst = int(times.argmax())
    if times[worst] > _FAR:
        notes.append(
            f"{points.force[worst]:.4g} N at {points.strain[worst] * gauge_length:.4g} m lies "
            f"{times[worst]:.0f} times the scatter around it off the curve: check this point"
        )
    # errors of a test without noise may all be zero
    correlation = float(errors[1:] @ errors[:-1]) / (float(errors @ errors) or 1.0)
    if correlation > 4.0 / np.sqrt(len(errors)) and spread.noise > _SEEN * reach:
        widen = float(np.sqrt((1.0 + correlation) / (1.0 - correlation)))
        notes.append(
            f"neighbouring residuals go together (correlation {correlation:.2f}): the force drifts "
            f"or ripples, or EA bends too sharply for the curve. The band is at least {widen:.1f} "
            "times too narrow"
        )
    return tuple(notes)

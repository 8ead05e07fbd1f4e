"""Where the rigidity curve settles, where it gives way, and what makes it doubtful."""

from __future__ import annotations

import numpy as np

from cdsm.errors import TensileTestError
from cdsm.support.validation import Array
from cdsm.wires.tensile.loading import local_noise
from cdsm.wires.tensile.spline import Curve, Points, Spread

YIELD = 0.8
"""Plasticity begins where EA falls below this share of its largest value, for good."""
SETTLED = 0.5
"""Pre-tensioning ends where d ln EA/d ln F falls below this: midway from EA ∝ F to EA constant."""
_CERTAIN = 3.0  # standard deviations
_FAR = 8.0  # likewise, of a point that does not belong
_JUMP = 10.0
_SEEN = 1e-4  # share of the range: no load cell shows less
_STEP = 1.25  # ratio of tensions over which the exponent is taken: noise passes for slope below


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


def settled(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
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
    steep = (above - under) / (2.0 * np.log(_STEP)) >= SETTLED
    surely = np.interp(F, tensions, level - _CERTAIN * deviation)
    perhaps = np.interp(F, tensions, level + _CERTAIN * deviation)
    edges = np.flatnonzero(np.diff(np.pad(steep.astype(int), 1)))
    for start, end in zip(edges[-2::-2], edges[::-2], strict=True):
        # a rise that the noise may have made is no stage
        if surely[start:end].max() > perhaps[start:end].min():
            return float(F[end - 1])
    return None


def refuse_jumps(curve: Curve, points: Points) -> None:
    """Refuse a force that jumps: the curve has overshot there.

    Raises:
        TensileTestError: EA is ten times what it is between any two neighbouring points.
    """
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
    """What the residuals say against the fit, one sentence each."""
    errors, reach = spread.errors, float(np.ptp(points.force))
    notes = []
    times = abs(errors) / np.maximum(local_noise(errors), _SEEN * reach)
    worst = int(times.argmax())
    if times[worst] > _FAR:
        notes.append(
            f"{points.force[worst]:.4g} N at {points.strain[worst] * gauge_length:.4g} m lies "
            f"{times[worst]:.0f} times the scatter around it off the curve: check this point"
        )
    follow = float(errors[1:] @ errors[:-1]) / max(float(errors @ errors), 1e-300)
    if follow > 4.0 / np.sqrt(len(errors)) and spread.noise > _SEEN * reach:
        widen = float(np.sqrt((1.0 + follow) / (1.0 - follow)))
        notes.append(
            f"neighbouring residuals go together (correlation {follow:.2f}): the force drifts or "
            f"ripples, or EA bends too sharply for the curve. The band is at least {widen:.1f} "
            "times too narrow"
        )
    return tuple(notes)

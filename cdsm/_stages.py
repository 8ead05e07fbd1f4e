"""Where the rigidity curve settles and where it gives way."""

from __future__ import annotations

import numpy as np

from cdsm._checks import Array

YIELD = 0.8
"""Plasticity begins where EA falls below this share of its largest value, for good."""
SETTLED = 0.5
"""Pre-tensioning ends where d ln EA/d ln F falls below this: midway from EA ∝ F to EA constant."""
_CERTAIN = 3.0  # standard deviations
_STEP = 1.25  # ratio of tensions over which the exponent is taken: noise passes for slope below


def yield_onset(tensions: Array, rigidity: Array, deviation: Array) -> float | None:
    """Tension [N] from which EA stays below its plateau, or None if it never surely does.

    Args:
        tensions: F (g,) [N].
        rigidity: EA (g,) [N].
        deviation: Standard deviation of log EA (g,).
    """
    level = np.log(rigidity)
    top = int(np.argmax(level - deviation))
    below = level < level[top] + np.log(YIELD)
    sure = level + _CERTAIN * deviation < level[top] - deviation[top] + np.log(YIELD)
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
    # a bend that the noise may have made, or a rise of less than a step, is no stage
    rise = np.interp(F, tensions, level - _CERTAIN * deviation)
    lowest = np.minimum.accumulate(np.interp(F, tensions, level + _CERTAIN * deviation))
    steep &= rise - lowest > 0.0
    return float(F[np.flatnonzero(steep)[-1]]) if steep.any() else None

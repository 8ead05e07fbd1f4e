"""Invert an increasing function of the tension, such as the strain of a law."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cdsm.elasticity.domain import Domain
from cdsm.errors import ElasticityRangeError
from cdsm.support.roots import rising_root
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

_ROUNDING = 1e-15  # relative rounding of a strain: a few units in the last place


# denser at the low end, where most laws are soft; the first and last points are exactly 0 and 1
_GRID = np.linspace(0.0, 1.0, 25) ** 3


def tension_at(
    wanted: Array,
    domain: Domain,
    stretch: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    name: str,
) -> Array:
    """Find the tensions F [N] at which an increasing function, such as a strain, has given values.

    ``wanted`` are the values of any shape, strains [-] or elongations [m]; the error calls them
    ``name``. ``stretch`` is the function of F. It is zero or less at the low end of ``domain``;
    ``slope`` is its derivative. Raises ElasticityRangeError if a wanted value is not reached in the
    domain.
    """
    low, high, most = *domain, RANGES["tension"].high
    if math.isinf(high):  # an unbounded law: search only as far as needed
        high = max(1.0, 2.0 * low)
        while float(stretch(np.array(high))) < wanted.max(initial=0.0) and high < most:
            high = min(2.0 * high, most)
    grid = np.maximum(low + (high - low) * _GRID, domain.first)
    grid[-1] = high  # low + (high - low) may differ from high by rounding
    reached = stretch(grid)
    # a law's last digit may depend on the array size, and ``high`` belongs to the domain
    outside = (wanted < min(reached[0], 0.0)) | (wanted > reached[-1] * (1.0 + _ROUNDING))
    if outside.any():
        first = np.atleast_1d(wanted)[np.atleast_1d(outside)][0]
        raise ElasticityRangeError(
            f"no tension of the domain {domain} gives the {name} {first:.6g}; it reaches "
            f"{reached[-1]:.6g}.",
            indices=np.flatnonzero(outside).tolist(),
        )
    above = np.searchsorted(reached[1:-1], wanted) + 1
    guess = np.interp(wanted, reached, grid)
    return rising_root(wanted, guess, grid[above - 1], grid[above], stretch, slope)[0]

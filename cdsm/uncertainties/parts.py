"""Assign tolerances to the inputs of an arm; compute variances of a reading and random errors.

An input is a number that can have a tolerance, such as the radius of one hole; a reading is a
number computed from all inputs, such as a stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from cdsm._former.tree import Indices
from cdsm.errors import InvalidInput
from cdsm.support.values import Array
from cdsm.tolerances import EVERY, Tolerance, Tolerances

_ALL = slice(None)


class Part(NamedTuple):
    """Inputs of one source of uncertainty that share a tolerance."""

    inputs: slice | Indices  # indices of the inputs; a slice if they are all inputs of the source
    tolerance: Tolerance

    def variance(self, sensitivity: Array) -> float:
        """Compute the variance of a reading that the k inputs cause (JCGM 100, Eq. 13).

        It is u² ((1 − ρ) g·g + ρ (Σ g)²), with g (k,) = ``sensitivity``, the partial derivatives of
        the reading with respect to the inputs.
        """
        rho, g = self.tolerance.correlation, sensitivity
        common = rho * float(g.sum()) ** 2 if rho else 0.0
        return self.tolerance.standard**2 * ((1.0 - rho) * float(g @ g) + common)

    def draw(self, rng: np.random.Generator, errors: Array) -> None:
        """Draw random errors of the inputs into their columns of ``errors`` (draws, n).

        Correlated errors are sums of independent ones, so each input has its exact standard
        uncertainty and correlations. Their distribution is only approximate if it is not normal
        and the correlation is between 0 and 1.
        """
        tolerance, rho = self.tolerance, self.tolerance.correlation
        draws, count = errors[:, self.inputs].shape
        if rho in (0.0, 1.0):
            drawn = _standardised(tolerance, rng, (draws, 1 if rho else count))
        else:
            own = _standardised(tolerance, rng, (draws, count))
            common = _standardised(tolerance, rng, (draws, 1))
            drawn = math.sqrt(1.0 - rho) * own + math.sqrt(rho) * common
        errors[:, self.inputs] = tolerance.standard * drawn


def parts_of(
    tolerances: Tolerances, labels: Mapping[str, Sequence[str]]
) -> dict[str, tuple[Part, ...]]:
    """Find the inputs to which each tolerance belongs, by source, such as ``hole_radius``.

    ``labels`` are the names of the inputs of each source.

    Raises:
        InvalidInput: No input has the name that a tolerance gives, or two tolerances belong to one
            input.
    """
    found: dict[str, tuple[Part, ...]] = {}
    for source, given in tolerances.given.items():
        names, parts = labels[source], []
        taken = np.zeros(len(names), dtype=np.bool_)
        for each in given:
            inputs = _ALL if each.of == EVERY else _matching(source, each.of, names)
            if taken[inputs].any():
                twice = names[int(np.arange(len(names))[inputs][taken[inputs]][0])]
                raise InvalidInput(
                    source, f"{twice} has two tolerances; {each.of!r} is the second."
                )
            taken[inputs] = True
            parts.append(Part(inputs, each))
        found[source] = tuple(parts)
    return found


def variance(parts: Sequence[Part], sensitivity: Array) -> float:
    """Compute the variance of a reading that the n inputs of one source of uncertainty cause.

    ``sensitivity`` (n,) are the partial derivatives of the reading with respect to these inputs.
    """
    return sum(part.variance(sensitivity[part.inputs]) for part in parts)


def standards(parts: Sequence[Part], count: int) -> Array:
    """Return the standard uncertainties (count,) of all ``count`` inputs of one source."""
    found = np.zeros(count)
    for part in parts:
        found[part.inputs] = part.tolerance.standard
    return found


def draw(parts: Sequence[Part], rng: np.random.Generator, draws: int, count: int) -> Array:
    """Draw random errors (draws, count) of all ``count`` inputs of one source of uncertainty."""
    errors = np.zeros((draws, count))
    for part in parts:
        part.draw(rng, errors)
    return errors


def _matching(source: str, pattern: str, names: Sequence[str]) -> Indices:
    """Return the indices of the ``names`` that match ``pattern``, such as ``"cable1_*"``.

    Raises InvalidInput if no name matches; the error names the ``source`` of uncertainty.
    """
    found = np.flatnonzero([fnmatchcase(name, pattern) for name in names])
    if not found.size:
        raise InvalidInput(
            source, f"no input is called {pattern!r}; the first of {len(names)} is {names[0]!r}."
        )
    return found


def _standardised(tolerance: Tolerance, rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    """Draw random numbers (``shape``) with the distribution of ``tolerance`` and unit variance."""
    if tolerance.distribution == "normal":
        return rng.standard_normal(shape)
    return rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), shape)

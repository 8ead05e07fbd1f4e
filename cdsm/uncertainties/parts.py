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

from cdsm.errors import InvalidInput
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array
from cdsm.tolerance import EVERY, LARGEST, WIDTH, Tolerance, Tolerances

_ALL = slice(None)


class Part(NamedTuple):
    """Inputs of one source of uncertainty that share a tolerance, with standard uncertainties."""

    inputs: slice | Indices  # indices of the inputs; a slice if they are all inputs of the source
    standard: float | Array  # standard uncertainty: one number for all, or (k,)
    tolerance: Tolerance

    def variance(self, sensitivity: Array) -> float:
        """Compute the variance gᵀ σ R σ g of a reading that the k inputs cause (JCGM 100, Eq. 13).

        g (k,) is ``sensitivity``, the partial derivatives of the reading with respect to the
        inputs. σ is the diagonal matrix of the standard uncertainties, R (k, k) the correlations.
        """
        return self.tolerance.variance(self.standard * sensitivity)

    def draw(self, rng: np.random.Generator, errors: Array) -> None:
        """Draw random errors of the inputs into their columns of ``errors`` (draws, n).

        Correlated errors are sums of independent ones, so each input has its exact standard
        uncertainty and correlations. Their distribution is only approximate if it is not normal,
        and the correlation is a matrix or between 0 and 1.
        """
        tolerance, rho = self.tolerance, self.tolerance.correlation
        draws, count = errors[:, self.inputs].shape
        if not isinstance(rho, float):
            values, vectors = np.linalg.eigh(tolerance.matrix(count))
            root = vectors * np.sqrt(values.clip(0.0))
            drawn = _standardised(tolerance, rng, (draws, count)) @ root.T
        elif rho in (0.0, 1.0):
            drawn = _standardised(tolerance, rng, (draws, 1 if rho else count))
        else:
            own = _standardised(tolerance, rng, (draws, count))
            common = _standardised(tolerance, rng, (draws, 1))
            drawn = math.sqrt(1.0 - rho) * own + math.sqrt(rho) * common
        errors[:, self.inputs] = self.standard * drawn


def parts_of(
    tolerances: Tolerances, labels: Mapping[str, Sequence[str]], tension: Array
) -> dict[str, tuple[Part, ...]]:
    """Find the inputs to which each tolerance belongs, and their standard uncertainties.

    The keys are the sources of uncertainty, such as ``hole_radius``. ``labels`` are the names of
    the inputs of each source. A standard uncertainty may depend on the ``tension`` (C,) [N].

    Raises:
        InvalidInput: No input has the name that a tolerance gives, or two tolerances belong to one
            input; or a tension is outside the range for which a tolerance is given, or the standard
            uncertainty is too large at a tension, as near to slack.
    """
    found: dict[str, tuple[Part, ...]] = {}
    for source, given in tolerances.given.items():
        names, parts = labels[source], []
        if len(given) == 1 and given[0].of == EVERY and given[0].tensions is None:
            found[source] = (Part(_ALL, given[0].standard, given[0]),)  # the usual case
            continue
        taken = np.zeros(len(names), dtype=np.bool_)
        for each in given:
            inputs = _ALL if each.of == EVERY else _matching(source, each.of, names)
            if taken[inputs].any():
                twice = names[int(np.arange(len(names))[inputs][taken[inputs]][0])]
                raise InvalidInput(
                    source, f"{twice} has two tolerances; {each.of!r} is the second."
                )
            taken[inputs] = True
            standard = each.at(tension[inputs]) if each.tensions is not None else each.standard
            if each.tensions is not None and np.max(standard) > LARGEST[source]:
                raise InvalidInput(
                    source,
                    f"its standard uncertainty reaches {np.max(standard):.3g} at these tensions; "
                    f"the largest allowed is {LARGEST[source]:g}. Raise the tensions.",
                )
            parts.append(Part(inputs, standard, each))
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
        found[part.inputs] = part.standard
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
    width = WIDTH[tolerance.distribution]
    if tolerance.distribution == "uniform":
        return rng.uniform(-width, width, shape)
    return rng.triangular(-width, 0.0, width, shape)

"""Compute rigidities of cables whose law is a function of Python, for many postures."""

from __future__ import annotations

import numpy as np

from cdsm.batch.layout import Flags
from cdsm.cable_laws import CableLaws
from cdsm.elasticity import Elasticity
from cdsm.errors import ElasticityRangeError
from cdsm.support.values import Array, frozen


def rigidities(laws: CableLaws, tension: Array, usable: Flags) -> Array:
    """Return EA (1 + ε) (b, C) [N] at tensions F (b, C) [N] in the rows that are ``usable`` (b,).

    Entries are 0 in other rows, and for cables that ``laws`` treats as force-controlled. They are
    −1 where F is outside the domain of the law.
    """
    if not usable.any():  # a user-defined law may fail on empty arrays
        return frozen(np.zeros_like(tension))
    given = tension if usable.all() else tension[usable]
    rigidity = np.zeros_like(given)
    for law, held in laws.held:
        rigidity[:, held] = _where_defined(laws, law, given[:, held])
    if given is tension:
        return frozen(rigidity)
    result = np.zeros_like(tension)
    result[usable] = rigidity
    return frozen(result)


def _where_defined(laws: CableLaws, law: Elasticity, tension: Array) -> Array:
    """Return EA (1 + ε) [N] at tensions of any shape; −1 outside the domain of the law."""
    try:
        return laws.stretched_rigidity(law, tension)
    except ElasticityRangeError:
        pass
    result, values = np.full(tension.size, -1.0), tension.ravel()
    left = np.arange(tension.size)
    while left.size:
        try:
            result[left] = laws.stretched_rigidity(law, values[left])
            break
        except ElasticityRangeError as error:
            if not error.indices:  # a user-defined law may not say which tensions are outside
                result[left] = [_one(laws, law, value) for value in values[left]]
                break
            left = np.delete(left, error.indices)
    return result.reshape(tension.shape)


def _one(laws: CableLaws, law: Elasticity, tension: float) -> float:
    try:
        return float(laws.stretched_rigidity(law, np.array([tension]))[0])
    except ElasticityRangeError:
        return -1.0

"""EA (1 + ε) of all cables at many tensions, and where there is none."""

from __future__ import annotations

import numpy as np

from cdsm.arm_model import CableLaws
from cdsm.batch.layout import Flags
from cdsm.elasticity import Elasticity
from cdsm.errors import ElasticityRangeError
from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array, frozen

_NONE = -1.0


def rigidities(arm: Manipulator, tension: Array, usable: Flags) -> Array:
    """EA (1 + ε) (b, C) [N] at tensions F (b, C) [N]; 0 under force control, −1 where undefined.

    Args:
        arm: The arm.
        tension: F.
        usable: The rows (b,) to look at.

    Raises:
        InvalidInput: An elasticity of the user's own gives no positive rigidity.
    """
    if not usable.any():  # a law of the user's own need not take empty arrays
        return frozen(np.zeros_like(tension))
    pulled = tension if usable.all() else tension[usable]
    rigidity = np.zeros_like(pulled)
    for law, held in arm._model.laws.held:
        rigidity[:, held] = _where_defined(arm._model.laws, law, pulled[:, held])
    if pulled is tension:
        return frozen(rigidity)
    result = np.zeros_like(tension)
    result[usable] = rigidity
    return frozen(result)


def _where_defined(laws: CableLaws, law: Elasticity, tension: Array) -> Array:
    """EA (1 + ε) [N] at tensions of any shape, −1 outside the domain."""
    try:
        return laws.stretched_rigidity(law, tension)
    except ElasticityRangeError:
        pass
    result, values = np.full(tension.size, _NONE), tension.ravel()
    left = np.arange(tension.size)
    while left.size:
        try:
            result[left] = laws.stretched_rigidity(law, values[left])
            break
        except ElasticityRangeError as error:
            if not error.indices:  # an elasticity of the user's own that does not say where
                result[left] = [_one(laws, law, value) for value in values[left]]
                break
            left = np.delete(left, error.indices)
    return result.reshape(tension.shape)


def _one(laws: CableLaws, law: Elasticity, tension: float) -> float:
    try:
        return float(laws.stretched_rigidity(law, np.array([tension]))[0])
    except ElasticityRangeError:
        return _NONE

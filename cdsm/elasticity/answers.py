"""Evaluate a law, which may be user-defined, and check the values that it returns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdsm.elasticity.law import Elasticity
from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.format import span
from cdsm.support.validation import LARGEST, RANGES
from cdsm.support.values import Array

_STRAIN = float(np.nextafter(-1.0, 0.0)), LARGEST
"""Smallest and largest valid strain."""

_FINITE = -LARGEST, LARGEST


def rigidity_of(law: Elasticity, tension: Array) -> Array:
    """Return EA(F) [N] of a law, same shape as F [N]; raise InvalidInput if it is not valid."""
    _, least, most = RANGES["rigidity"]
    needed = "one positive number for each is needed."
    return _answer(law, law.rigidity, tension, (least, most), "rigidity {} N", needed)


def strain_of(law: Elasticity, tension: Array) -> Array:
    """Return ε(F) [-] of a law, same shape as F [N]; raise InvalidInput if it is not valid."""
    needed = "one number for each, zero at the low end of its domain and rising, is needed."
    return _answer(law, law.strain, tension, _STRAIN, "strain {}", needed)


def energy_of(law: Elasticity, tension: Array) -> Array:
    """Return ∫ F dε [N] of a law, same shape as F [N]; raise InvalidInput if it is not valid."""
    return _answer(
        law, law.energy, tension, _FINITE, "energy {} N", "one number for each is needed."
    )


def slope_of(law: Elasticity, tension: Array) -> Array:
    """Return dEA/dF [-] of a law, same shape as F [N]; raise InvalidInput if it is not valid."""
    needed = "one finite number for each is needed."
    return _answer(law, law.rigidity_slope, tension, _FINITE, "slope {} of its rigidity", needed)


def _answer(
    law: Elasticity,
    function: Callable[[Array], Array],
    tension: Array,
    allowed: tuple[float, float],
    named: str,
    needed: str,
) -> Array:
    """Return ``function(tension)`` of a law; raise InvalidInput if the values are not valid.

    They are not if ``function`` fails, or its result has another shape than ``tension`` [N] or a
    number outside the range ``allowed``. ``named`` and ``needed`` are texts for the error: the name
    of the values, with {} where they are inserted, and a sentence about valid values.
    """
    try:
        answer = np.asarray(function(tension))
    except CdsmError:
        raise
    except Exception as error:
        raise InvalidInput(
            "elasticity", f"{law!r} fails at {span(tension)} N: {error!r}. Correct the law."
        ) from error
    least, most = allowed
    usable = answer.dtype.kind in "iuf" and (answer >= least) & (answer <= most)  # not NaN
    if answer.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the {named.format(answer)} at tensions {tension} N; {needed}",
        )
    return answer

"""Ask a law, which a user may have written, for EA and ε, and check its answers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdsm.elasticity.law import Elasticity
from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.format import span
from cdsm.support.validation import LARGEST, RANGES
from cdsm.support.values import Array


def rigidity_of(law: Elasticity, tension: Array) -> Array:
    """Return EA(F) [N] in the shape of F [N]; InvalidInput if the law gives no valid EA."""
    rigidity = _answer(law, law.rigidity, tension)
    _, least, most = RANGES["rigidity"]
    usable = rigidity.dtype.kind in "iuf" and (rigidity >= least) & (rigidity <= most)  # not NaN
    if rigidity.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the rigidity {rigidity} N at tensions {tension} N; one positive "
            "number for each is needed.",
        )
    return rigidity


def strain_of(law: Elasticity, tension: Array) -> Array:
    """Return ε(F) [-] in the shape of F [N]; InvalidInput if the law gives no valid ε."""
    strain = _answer(law, law.strain, tension)
    usable = strain.dtype.kind in "iuf" and (strain > -1.0) & (strain <= LARGEST)  # not NaN
    if strain.shape != tension.shape or np.count_nonzero(usable) < tension.size:
        raise InvalidInput(
            "elasticity",
            f"{law!r} gives the strain {strain} at tensions {tension} N; one number for each, "
            "zero at the low end of its domain and rising, is needed.",
        )
    return strain


def _answer(law: Elasticity, function: Callable[[Array], Array], tension: Array) -> Array:
    """Return what ``function`` of a law gives at F [N]; InvalidInput if it raises its own error."""
    try:
        return np.asarray(function(tension))
    except CdsmError:
        raise
    except Exception as error:
        raise InvalidInput(
            "elasticity", f"{law!r} fails at {span(tension)} N: {error!r}. Correct the law."
        ) from error

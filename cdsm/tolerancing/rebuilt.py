"""Sources without a formula of their own: arms are built anew with each of their errors.

The first order is all that is known of them, so a measurand is linear in their errors.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdsm.arm_parameters import ArmParameters
from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.parameters import PARAMETERS
from cdsm.support.values import Array, frozen

_STEP = 1e-4  # of differences, over the number, or over its unit if that is larger


def labels_of(arm: Manipulator, source: str) -> tuple[str, ...]:
    """Return the names of the parts of an arm that have the parameter ``source``.

    Raises InvalidInput if there are none.
    """
    places = ArmParameters(arm, (source,)).places(source)
    named = {"motors": [motor.name for motor in arm.definition.motors]}
    named |= {kind: [*arm.cables.names] for kind in ("routes", "cables")}
    return tuple(
        named[kind][i] if kind in named else f"{kind.removesuffix('s')}{i + 1}"
        for kind, i in places
    )


def slopes_of(arm: Manipulator, source: str, value: Callable[[Manipulator], Array]) -> Array:
    """Differentiate ``value`` (k,) of an arm by the errors of each part's ``source`` (n, k).

    A difference is one-sided where only one of both arms exists, as at a slack of 0.
    """
    parameters = ArmParameters(arm, (source,))
    row = PARAMETERS[source]
    nominal = value(arm)
    slopes = []
    for place, number in zip(parameters.places(source), parameters.values(source), strict=True):
        _, unit = row.unit.shown
        size = abs(number) if row.is_relative else max(abs(number), unit)
        step = _STEP * size
        ends = []
        failed = list[CdsmError]()
        for change in (step, -step):
            try:
                ends.append((change, value(parameters.with_number(source, place, number + change))))
            except CdsmError as error:
                failed.append(error)
                ends.append((0.0, nominal))
        if len(failed) == len(ends):
            raise failed[0]
        (up, above), (down, below) = ends
        slope = (above - below) / (up - down)
        slopes.append(slope * number if row.is_relative else slope)
    return frozen(np.array(slopes))

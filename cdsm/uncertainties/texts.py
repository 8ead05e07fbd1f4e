"""Write values with their uncertainties, and tolerances, in the units shown to the user."""

from __future__ import annotations

import math

from cdsm.support.format import span
from cdsm.support.values import Array


def with_uncertainty(value: float, uncertainty: float, size: float) -> str:
    """Write ``value ± uncertainty``, given in SI, in a unit of the given ``size`` in SI.

    The uncertainty has two digits; the unit is not written.
    """
    u, places = uncertainty / size, 4
    if 0.0 < u < math.inf:
        places = min(max(1 - math.floor(math.log10(u)), 0), 12)
    return f"{value / size:.{places}f} ± {u:.{places}f}"


_SHOWN = {
    "rigidity": (1e-2, " %"),
    "spring": (1e-2, " %"),
    "joint_angle": (math.pi / 180.0, " deg"),
    "hole_angle": (math.pi / 180.0, " deg"),
    "tension": (1.0, " N"),
    "link_mass": (1e-3, " g"),
    "friction": (1.0, ""),
}
"""Size and name of the unit shown to the user for the inputs of a source; mm for all others."""


def shown(source: str, standards: Array) -> str:
    """Write the standard uncertainties (n,) of a source of uncertainty as text: "0.1 to 0.2 mm".

    ``standards`` are in SI. The text has the unit shown to the user.
    """
    size, unit = _SHOWN.get(source, (1e-3, " mm"))
    return span(standards / size, "{:.3g}".format) + unit

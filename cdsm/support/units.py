"""Numbers in print: coordinates, units in the keys of JSON, and the model of every stiffness."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from cdsm.support.validation import Array

MODEL: Final = "frictionless, rigid links, tangent"
"""What every stiffness in print is."""


def coordinates(values: Iterable[float], form: str = ".4g") -> str:
    """A direction or a place: ``(0, 0.5, 1)``."""
    return f"({', '.join(format(x, form) for x in values)})"


def key(name: str, unit: str) -> str:
    """A key that names its unit: ``margin`` in ``N m/rad`` is ``margin_Nm_per_rad``."""
    words = unit.replace("N m", "Nm").replace("/", " per ").split()
    return "_".join([name, *words])


def joints_to_dict(names: Sequence[str], slides: NDArray[np.bool_], q: Array) -> dict[str, object]:
    """Coordinates q (..., nv) by joint, angles and ways apart since their units differ."""
    told: dict[str, object] = {}
    for name, chosen in (("angles_rad", ~slides), ("ways_m", slides)):
        if chosen.any() or name == "angles_rad":
            told[name] = {names[i]: q[..., i].tolist() for i in np.flatnonzero(chosen).tolist()}
    return told

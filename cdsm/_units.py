"""Units in the keys of JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm._checks import Array

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator


def key(name: str, unit: str) -> str:
    """A key that names its unit: ``margin`` in ``N m/rad`` is ``margin_Nm_per_rad``."""
    words = unit.replace("N m", "Nm").replace("/", " per ").split()
    return "_".join([name, *words])


def joints_to_dict(arm: Manipulator, q: Array) -> dict[str, object]:
    """Coordinates q (..., nv) by joint, angles and ways apart since their units differ."""
    told: dict[str, object] = {}
    for name, chosen in (("angles_rad", ~arm.slides), ("ways_m", arm.slides)):
        if chosen.any() or name == "angles_rad":
            told[name] = {arm.joint_names[i]: q[..., i].tolist() for i in np.flatnonzero(chosen)}
    return told

"""Describe an arm and its laws of elasticity as texts; in a Dataset they identify the arm."""

from __future__ import annotations

import json
import math
from importlib.metadata import version

from cdsm.cable import Cable
from cdsm.manipulator import Manipulator
from cdsm.support.format import MODEL


def attributes_of(arm: Manipulator) -> dict[str, str]:
    """Return the attributes of a Dataset that describe the arm and the version of cdsm."""
    laws = list(dict.fromkeys(repr(cable.elasticity) for cable in arm.cables))
    return {
        "Conventions": "CF-1.11",
        "title": f"stiffness sweep of {arm.name}",
        "source": f"cdsm {version('cdsm-stiffness')}",
        **({"geometry": arm.geometry.to_toml()} if arm.is_serpentine else {"urdf": arm.urdf}),
        "model": MODEL,
        "original_length": arm.original_length,
        "cables": json.dumps([_cable(cable, laws) for cable in arm.cables]),
        "cable_elasticities": json.dumps(laws),
    }


def _cable(cable: Cable, laws: list[str]) -> dict[str, object]:
    """Return the attributes of a cable for JSON, in SI; its elasticity is an index into ``laws``.

    ``laws`` are their texts.
    """
    series = cable.series_stiffness
    holes = [[site.friction, site.wrap] for site in cable.sites]
    return {
        "name": cable.name,
        "sites": [[site.link, *site.position] for site in cable.sites],
        "lead": cable.lead,
        "elasticity": laws.index(repr(cable.elasticity)),
        "series_stiffness": None if math.isinf(series) else series,
        "control": cable.control,
        "minimum": cable.minimum,
        "maximum": None if math.isinf(cable.maximum) else cable.maximum,
        **({"holes": holes} if any(cable.friction) else {}),
    }

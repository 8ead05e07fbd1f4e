"""An arm in words, so that a Dataset can be traced back to it and a store to its question."""

from __future__ import annotations

import hashlib
import json
import math
import pickle
from importlib.metadata import version

from cdsm._units import MODEL
from cdsm.cable import Cable
from cdsm.elasticity import Elasticity
from cdsm.manipulator import Manipulator


def attributes_of(arm: Manipulator) -> dict[str, str]:
    """The attributes of a Dataset that say which arm, computed by what."""
    laws = list(dict.fromkeys(law_text(cable.elasticity) for cable in arm.cables))
    return {
        "Conventions": "CF-1.11",
        "title": f"stiffness sweep of {arm.name}",
        "source": f"cdsm {version('cdsm-stiffness')}",
        **({"geometry": arm.geometry.to_toml()} if arm.is_serpentine else {"urdf": arm.urdf}),
        "model": MODEL,
        "original_length": arm.original_length,
        "cables": _json([_cable(cable, laws) for cable in arm.cables]),
        "cable_elasticities": _json(laws),
    }


def law_text(law: Elasticity) -> str:
    """An elasticity in one line: equal for equal ones, also in another process."""
    text = repr(law)
    if type(law).__module__.startswith("cdsm.") and "..." not in text:  # numpy shortens arrays
        return text
    # what a class of the user's own prints need not be all that it depends on
    kind = f"{type(law).__module__}.{type(law).__qualname__}"
    try:
        return f"{kind} {hashlib.sha256(pickle.dumps(law)).hexdigest()[:16]}"
    except Exception:  # whatever a foreign class raises; its address is at least never wrong
        return f"{kind} at {id(law):#x}"


def _cable(cable: Cable, laws: list[str]) -> dict[str, object]:
    """A cable as JSON, in SI units; its elasticity by the place in the list of them."""
    series = cable.series_stiffness
    return {
        "name": cable.name,
        "sites": [[site.link, *site.position] for site in cable.sites],
        "lead": cable.lead,
        "elasticity": laws.index(law_text(cable.elasticity)),
        "series_stiffness": None if math.isinf(series) else series,
        "control": cable.control,
        "minimum": cable.minimum,
        "maximum": None if math.isinf(cable.maximum) else cable.maximum,
    }


def _json(value: object) -> str:
    return json.dumps(value, allow_nan=False)

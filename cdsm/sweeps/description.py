"""An arm in words, so that a Dataset can be traced back to it and a store to its question."""

from __future__ import annotations

import hashlib
import json
import math
import pickle
import re
from importlib.metadata import version

import numpy as np

from cdsm.cable import Cable
from cdsm.elasticity import Elasticity
from cdsm.manipulator import Manipulator
from cdsm.support.format import MODEL
from cdsm.support.validation import Array

_SAMPLES = np.ldexp(np.arange(4.0, 8.0), np.arange(-12, 18)[:, None]).ravel()
"""Tensions [N] from 1e-3 to 1e6, four an octave, the same to the last bit on every machine."""

_WITHIN = 65
"""Tensions evenly over the domain, of which a narrow one has few of the others."""

_SAMPLED = re.compile(r"\b([\w.<>]+) (\w+), samples ([0-9a-f]{16})")
"""A law of the user's own in words: its class, its state, and what it answers."""


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
    """An elasticity in one line: equal for equal ones, also in another process.

    What a law of the user's own depends on is its state and its code. The code shows in what it
    answers: domain, EA and strain, at up to 185 tensions.
    """
    text = repr(law)
    if type(law).__module__.startswith("cdsm.") and "..." not in text:  # numpy shortens arrays
        return text
    # what a class of the user's own prints need not be all that it depends on
    kind = f"{type(law).__module__}.{type(law).__qualname__}"
    try:
        state = _digest(pickle.dumps(law))
    except Exception:  # whatever a foreign class raises; its address is at least never wrong
        return f"{kind} at {id(law):#x}"
    return f"{kind} {state}, samples {_digest(_answers(law).encode())}"


def changed_laws(one: str, other: str) -> tuple[str, ...]:
    """Classes of the laws that answer otherwise, where two texts differ in nothing else."""
    if _SAMPLED.sub(r"\1 \2", one) != _SAMPLED.sub(r"\1 \2", other):
        return ()
    pairs = zip(_SAMPLED.findall(one), _SAMPLED.findall(other), strict=True)
    return tuple(dict.fromkeys(mine[0] for mine, theirs in pairs if mine != theirs))


def _answers(law: Elasticity) -> str:
    """What a law says of itself at the sampled tensions, to the last bit."""
    domain = law.domain
    first, high = domain.first, domain.high
    tensions = _SAMPLES[(first <= _SAMPLES) & (high >= _SAMPLES)]
    if math.isfinite(high):
        tensions = np.concatenate([tensions, np.linspace(first, high, _WITHIN)])
    told = [_answer(law, name, F) for name in ("rigidity", "strain") for F in tensions]
    return f"{domain!r} {' '.join(told)}"


def _answer(law: Elasticity, name: str, tension: float) -> str:
    """One number in full, or why there is none: a law need not have an answer everywhere."""
    try:
        value: Array = np.asarray(getattr(law, name)(np.array([tension])), dtype=np.float64)
        return float(value.reshape(())).hex()
    except Exception as error:  # whatever a foreign class raises
        return type(error).__name__


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


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

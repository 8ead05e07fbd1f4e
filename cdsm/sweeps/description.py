"""Describe an arm and its laws of elasticity as texts; in a Dataset they identify the arm."""

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
from cdsm.support.values import Array

_SAMPLES = np.ldexp(np.arange(4.0, 8.0), np.arange(-12, 18)[:, None]).ravel()
"""Tensions [N] from 1e-3 to 1e6, four per octave, with equal bits on every machine."""

_WITHIN = 65
"""Number of further tensions, evenly spaced over a domain, since it may have few ``_SAMPLES``."""

_SAMPLED = re.compile(r"\b([\w.<>]+) (\w+), samples ([0-9a-f]{16})")
"""Pattern of a :func:`law_text` with samples: class, digest of the state, digest of samples."""


def attributes_of(arm: Manipulator) -> dict[str, str]:
    """Return the attributes of a Dataset that describe the arm and the version of cdsm."""
    laws = list(dict.fromkeys(law_text(cable.elasticity) for cable in arm.cables))
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


def law_text(law: Elasticity) -> str:
    """Return an elasticity as text; equal laws have equal texts, even in another process.

    The text of a user-defined law has its class, a digest of its pickled state, and a digest of its
    domain, and of EA and strain at sampled tensions. If the law cannot be pickled, the text has its
    class and its address in memory.
    """
    text = repr(law)
    if type(law).__module__.startswith("cdsm.") and "..." not in text:  # numpy shortens arrays
        return text
    # the repr of a user-defined class may omit something on which the law depends
    kind = f"{type(law).__module__}.{type(law).__qualname__}"
    try:
        state = _digest(pickle.dumps(law))
    except Exception:  # a user-defined class may raise anything; its address is never wrong
        return f"{kind} at {id(law):#x}"
    return f"{kind} {state}, samples {_digest(_answers(law).encode())}"


def changed_laws(one: str, other: str) -> tuple[str, ...]:
    """Return the classes of user-defined laws whose code has changed between two texts of an arm.

    The texts contain those of :func:`law_text`. Such a law has the same class and state in both,
    but other digests of the samples. The result is empty if the texts also differ elsewhere.
    """
    if _SAMPLED.sub(r"\1 \2", one) != _SAMPLED.sub(r"\1 \2", other):
        return ()
    pairs = zip(_SAMPLED.findall(one), _SAMPLED.findall(other), strict=True)
    return tuple(dict.fromkeys(mine[0] for mine, theirs in pairs if mine != theirs))


def _answers(law: Elasticity) -> str:
    """Return a text with the domain of a law, and EA and strain at sampled tensions, all digits."""
    domain = law.domain
    first, high = domain.first, domain.high
    tensions = _SAMPLES[(first <= _SAMPLES) & (high >= _SAMPLES)]
    if math.isfinite(high):
        tensions = np.concatenate([tensions, np.linspace(first, high, _WITHIN)])
    answers = [_answer(law, name, F) for name in ("rigidity", "strain") for F in tensions]
    return f"{domain!r} {' '.join(answers)}"


def _answer(law: Elasticity, name: str, tension: float) -> str:
    """Return what method ``name`` of a law returns at a tension [N], as a text with all digits.

    If the method raises an error, the text is the name of this error.
    """
    try:
        value: Array = np.asarray(getattr(law, name)(np.array([tension])), dtype=np.float64)
        return float(value.reshape(())).hex()
    except Exception as error:  # a user-defined class may raise anything
        return type(error).__name__


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _cable(cable: Cable, laws: list[str]) -> dict[str, object]:
    """Return the attributes of a cable for JSON, in SI; its elasticity is an index into ``laws``.

    ``laws`` are texts of :func:`law_text`.
    """
    series = cable.series_stiffness
    holes = [[site.friction, site.wrap] for site in cable.sites]
    return {
        "name": cable.name,
        "sites": [[site.link, *site.position] for site in cable.sites],
        "lead": cable.lead,
        "elasticity": laws.index(law_text(cable.elasticity)),
        "series_stiffness": None if math.isinf(series) else series,
        "control": cable.control,
        "minimum": cable.minimum,
        "maximum": None if math.isinf(cable.maximum) else cable.maximum,
        **({"holes": holes} if any(cable.friction) else {}),
    }

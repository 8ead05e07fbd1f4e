"""Specification of a sweep: the arm, its poses and the varied arguments, checked and frozen."""

from __future__ import annotations

import hashlib
import json
import math
import pickle
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.elasticity import Elasticity
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.format import MODEL
from cdsm.support.validation import Array, instance, one_of
from cdsm.sweeps.arguments import Label, bounds_of, directions_of, laws_of, wrenches_of
from cdsm.sweeps.evaluation import SweepTask
from cdsm.sweeps.poses import Listed, PoseSet, Product, poses_of
from cdsm.sweeps.quantities import CASES, QUANTITIES

AXES = ("x", "y", "z")

_SAMPLES = np.ldexp(np.arange(4.0, 8.0), np.arange(-12, 18)[:, None]).ravel()
"""Tensions [N] from 1e-3 to 1e6, four per octave, with equal bits on every machine."""

_WITHIN = 65
"""Number of evenly spaced tensions over a domain; narrow domains hold few of ``_SAMPLES``."""

_SAMPLED = re.compile(r"\b([\w.<>]+) (\w+), samples ([0-9a-f]{16})")
"""Text of a user-defined law: its class, its state, and a digest of domain, EA and strain."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Specification:
    """Specification of a sweep: task, postures, and labels of the Dataset.

    Attributes:
        task: Quantities and cases to compute at each posture.
        poses: The postures.
        labels: All coordinates by name.
        attributes: Attributes of the Dataset.
    """

    task: SweepTask
    poses: Listed | Product
    labels: Mapping[str, Label]
    attributes: Mapping[str, str]

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Return the length of each dimension."""
        return {
            name: len(np.atleast_1d(label.values))
            for name, label in self.labels.items()
            if label.dims == (name,)
        }

    @property
    def case_dims(self) -> tuple[str, ...]:
        """Return the dimensions of ``status``: those of the poses, then those of the cases."""
        return (*self.poses.sizes, *(case for case in CASES if case in self.sizes))

    def dims(self, name: str) -> tuple[str, ...]:
        """Return the dimensions of an output or of ``status``."""
        if name == "status":
            return self.case_dims
        quantity = QUANTITIES[name]
        wanted = (*self.poses.sizes, *quantity.cases, *quantity.dims)
        return tuple(dim for dim in wanted if dim in self.sizes)

    def shape(self, name: str, slices: Mapping[str, slice] | None = None) -> tuple[int, ...]:
        """Return the shape of an output or of ``status``, or of the part given by slices."""
        parts = slices or {}
        return tuple(
            parts[dim].stop - parts[dim].start if dim in parts else self.sizes[dim]
            for dim in self.dims(name)
        )


def specify(
    arm: Manipulator,
    q: PoseSet | ArrayLike,
    *,
    minimum: ArrayLike,
    maximum: float,
    elasticity: Elasticity | Mapping[str, Elasticity] | None,
    wrench: ArrayLike | Mapping[str, ArrayLike],
    direction: ArrayLike | Mapping[str, ArrayLike],
    outputs: Iterable[str],
) -> Specification:
    """Check the arguments of a sweep, and label all dimensions and coordinates."""
    poses = poses_of(instance("arm", arm, Manipulator), q)
    lows, maximum = bounds_of(minimum, maximum)
    laws, wrenches, directions = laws_of(elasticity), wrenches_of(wrench), directions_of(direction)
    force, moment = wrenches.values[:, :3], wrenches.values[:, 3:]
    labels = {
        **poses.labels,
        **laws.labels,
        **wrenches.labels,
        "force": wrenches.label(force, ("axis",), "force on the tip, base axes", "N"),
        "moment": wrenches.label(moment, ("axis",), "moment on the tip, base axes", "N m"),
        "minimum": lows.label(lows.values, (), "lower bound of all tensions", "N"),
        "maximum": Label((), maximum, "upper bound of all tensions", "N"),
        **directions.labels,
        "direction_vector": directions.label(
            directions.values, ("axis",), "unit vector of the direction, base axes", "1"
        ),
        "gravity": Label(("axis",), arm.gravity, "gravity, base axes", "m s-2"),
        "axis": _names("axis", AXES, "axis of the base frame"),
        "axis_column": _names("axis_column", AXES, "axis of the base frame, of the columns"),
        "cable": _names("cable", [cable.name for cable in arm.cables], "name of the cable"),
        "joint": _names("joint", arm.joint_names, "name of the joint"),
        "joint_column": _names("joint_column", arm.joint_names, "joint that turns, of the columns"),
    }
    attributes = attributes_of(arm) | {"poses": poses.description}
    if laws.values != (None,):
        names = ["all cables"] if laws.names is None else laws.names.tolist()
        texts = [law_text(law) for law in laws.values if law is not None]
        attributes["elasticity"] = json.dumps(dict(zip(names, texts, strict=True)), indent=1)
    task = SweepTask(
        arm=arm,
        laws=laws.values,
        wrenches=wrenches.values,
        minima=lows.values,
        maximum=maximum,
        directions=directions.values,
        outputs=_outputs(outputs),
    )
    everything = Specification(task=task, poses=poses, labels=labels, attributes=attributes)
    return replace(everything, labels=_needed(everything))


def _needed(specification: Specification) -> dict[str, Label]:
    """Return the coordinates that an output or another coordinate needs."""
    outputs = specification.task.outputs
    labels = {
        name: label
        for name, label in specification.labels.items()
        if "along" in outputs or not name.startswith("direction")
    }
    used = {dim for name in (*outputs, "status") for dim in specification.dims(name)}
    used |= {dim for name, label in labels.items() for dim in label.dims if label.dims != (name,)}
    return {name: label for name, label in labels.items() if label.dims != (name,) or name in used}


def _outputs(outputs: Iterable[str]) -> tuple[str, ...]:
    if not isinstance(outputs, Iterable):
        raise InvalidInput("outputs", f"{outputs!r} given; names are needed.")
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    if not names:
        raise InvalidInput("outputs", f"is empty; name some of {', '.join(QUANTITIES)}.")
    for name in names:
        one_of("output", name, QUANTITIES)
        if names.count(name) > 1:
            raise InvalidInput("outputs", f"holds {name!r} twice; name it once.")
    return names


def _names(dim: str, names: Iterable[str], long_name: str) -> Label:
    return Label((dim,), np.array(list(names)), long_name, "")


# --- the arm as attributes, so that a Dataset tells from which arm it comes -------------------


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
        "cables": _json([_cable(cable, laws) for cable in arm.cables]),
        "cable_elasticities": _json(laws),
    }


def law_text(law: Elasticity) -> str:
    """Return an elasticity as text; equal laws have equal texts, also in another process.

    A user-defined law depends on its state and its code. The text identifies the code by the
    domain, and by EA and strain at up to 185 tensions.
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
    """Return the classes of laws whose digest changed; empty if the texts differ in more."""
    if _SAMPLED.sub(r"\1 \2", one) != _SAMPLED.sub(r"\1 \2", other):
        return ()
    pairs = zip(_SAMPLED.findall(one), _SAMPLED.findall(other), strict=True)
    return tuple(dict.fromkeys(mine[0] for mine, theirs in pairs if mine != theirs))


def _answers(law: Elasticity) -> str:
    """Return domain, EA and strain of a law at the sampled tensions, with all bits."""
    domain = law.domain
    first, high = domain.first, domain.high
    tensions = _SAMPLES[(first <= _SAMPLES) & (high >= _SAMPLES)]
    if math.isfinite(high):
        tensions = np.concatenate([tensions, np.linspace(first, high, _WITHIN)])
    answers = [_answer(law, name, F) for name in ("rigidity", "strain") for F in tensions]
    return f"{domain!r} {' '.join(answers)}"


def _answer(law: Elasticity, name: str, tension: float) -> str:
    """Return one number of a law with all bits, or the name of the error that the law raises."""
    try:
        value: Array = np.asarray(getattr(law, name)(np.array([tension])), dtype=np.float64)
        return float(value.reshape(())).hex()
    except Exception as error:  # a user-defined class may raise anything
        return type(error).__name__


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _cable(cable: Cable, laws: list[str]) -> dict[str, object]:
    """Return a cable for JSON in SI units; its elasticity is an index into ``laws``."""
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

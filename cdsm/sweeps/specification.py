"""The question a sweep answers: an arm, its poses and what is varied; checked, then frozen."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity import Elasticity
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import instance, one_of
from cdsm.sweeps.arguments import bounds_of, directions_of, laws_of, wrenches_of
from cdsm.sweeps.description import attributes_of, law_text
from cdsm.sweeps.evaluation import Problem
from cdsm.sweeps.labels import Label
from cdsm.sweeps.poses import Listed, PoseSet, Product, poses_of
from cdsm.sweeps.quantities import CASES, QUANTITIES

AXES = ("x", "y", "z")


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Question:
    """What is to be computed, and what it is called.

    Attributes:
        problem: What to compute at each posture.
        poses: The postures.
        labels: Every coordinate, by name.
        attributes: What the Dataset says of the whole.
    """

    problem: Problem
    poses: Listed | Product
    labels: Mapping[str, Label]
    attributes: Mapping[str, str]

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Length of every dimension."""
        return {
            name: len(np.atleast_1d(label.values))
            for name, label in self.labels.items()
            if label.dims == (name,)
        }

    @property
    def case_dims(self) -> tuple[str, ...]:
        """Dimensions of ``status``: those of the poses, then of what is varied."""
        return (*self.poses.sizes, *(case for case in CASES if case in self.sizes))

    def dims(self, name: str) -> tuple[str, ...]:
        """Dimensions of an output or of ``status``."""
        if name == "status":
            return self.case_dims
        quantity = QUANTITIES[name]
        wanted = (*self.poses.sizes, *quantity.cases, *quantity.dims)
        return tuple(dim for dim in wanted if dim in self.sizes)

    def shape(self, name: str, slices: Mapping[str, slice] | None = None) -> tuple[int, ...]:
        """Shape of an output or of ``status``, or of the part that some slices cut from it."""
        parts = slices or {}
        return tuple(
            parts[dim].stop - parts[dim].start if dim in parts else self.sizes[dim]
            for dim in self.dims(name)
        )


def ask(
    arm: Manipulator,
    q: PoseSet | ArrayLike,
    *,
    minimum: ArrayLike,
    maximum: float,
    elasticity: Elasticity | Mapping[str, Elasticity] | None,
    wrench: ArrayLike | Mapping[str, ArrayLike],
    direction: ArrayLike | Mapping[str, ArrayLike],
    outputs: Iterable[str],
) -> Question:
    """Check what was given, and give every dimension and coordinate its name.

    Raises:
        InvalidInput: Names the argument, and says what is wrong with it.
        UnknownName: No such joint or output.
    """
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
    attributes = attributes_of(arm) | {"poses": poses.told}
    if laws.values != (None,):
        names = ["all cables"] if laws.names is None else laws.names.tolist()
        texts = [law_text(law) for law in laws.values if law is not None]
        attributes["elasticity"] = json.dumps(dict(zip(names, texts, strict=True)), indent=1)
    problem = Problem(
        arm=arm,
        laws=laws.values,
        wrenches=wrenches.values,
        minima=lows.values,
        maximum=maximum,
        directions=directions.values,
        outputs=_outputs(outputs),
    )
    everything = Question(problem=problem, poses=poses, labels=labels, attributes=attributes)
    return replace(everything, labels=_needed(everything))


def _needed(question: Question) -> dict[str, Label]:
    """The coordinates that some output, or another coordinate, has use for."""
    outputs = question.problem.outputs
    labels = {
        name: label
        for name, label in question.labels.items()
        if "along" in outputs or not name.startswith("direction")
    }
    used = {dim for name in (*outputs, "status") for dim in question.dims(name)}
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

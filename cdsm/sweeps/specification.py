"""Specification of a sweep: the arm, its poses and the varied arguments, checked and frozen."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.support.directions import XYZ
from cdsm.support.format import MODEL, JointUnits
from cdsm.sweeps.arguments import Label, label
from cdsm.sweeps.blocks import Block
from cdsm.sweeps.description import attributes_of
from cdsm.sweeps.evaluation import SweepTask
from cdsm.sweeps.poses import Poses
from cdsm.sweeps.quantities import QUANTITIES, Quantity
from cdsm.sweeps.status import LOST, SweepStatus

if TYPE_CHECKING:
    import xarray

_STATUS = Quantity("what became of the entry", "1", "joint")

_WORST = {
    "worst_friction": "all segments of the cables stay within the bounds, whatever loads came "
    "before"
}
"""Attribute of a Dataset that was computed with ``worst_friction``."""

_OF_SLIDES = {"N m": "N", "N m rad-1": "N m-1"}
"""Unit for prismatic joints, by the unit for revolute joints: torque and joint stiffness."""

_NAME = re.compile(r"[A-Za-z0-9_\x80-\U0010ffff]([^/\\\x00-\x1f\x7f]*[^/\\\x00-\x20\x7f])?")
"""Pattern of names that NetCDF and Zarr both accept; a slash would divide a name into folders."""

EMPTY = {"status": np.int8(SweepStatus.PENDING)}
"""Initial value of ``status``; the initial value of all outputs is NaN."""


@final
@dataclass(frozen=True, eq=False)
class Specification:
    """What a sweep computes, at which postures, and the form of the Dataset that follows."""

    task: SweepTask  # quantities and cases to compute at each posture
    poses: Poses

    @cached_property
    def frame(self) -> xarray.Dataset:
        """Dataset with all coordinates and attributes, but without outputs and ``status``."""
        import xarray

        attributes = attributes_of(self.task.arm) | {"poses": self.poses.description}
        if self.task.worst_friction:
            attributes |= {"model": f"stiffness {MODEL}; tensions with friction", **_WORST}
        laws = self.task.laws
        if laws.values != (None,):
            of = ["all cables"] if laws.names is None else laws.names.tolist()
            texts = [repr(law) for law in laws.values if law is not None]
            attributes["elasticity"] = json.dumps(dict(zip(of, texts, strict=True)), indent=1)
        return xarray.Dataset(coords=_labels(self.task, self.poses), attrs=attributes)

    @property
    def variables(self) -> tuple[str, ...]:
        """Return the names of all outputs, then ``status``."""
        return (*self.task.outputs, "status")

    def dims(self, name: str) -> tuple[str, ...]:
        """Return the dimensions of an output or ``status``: of postures and cases, then its own."""
        quantity = QUANTITIES.get(name, _STATUS)
        wanted = (*self.poses.sizes, *quantity.cases, *quantity.dims)
        return tuple(dim for dim in wanted if dim in self.frame.sizes)

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of an output or of ``status``."""
        return tuple(self.frame.sizes[dim] for dim in self.dims(name))

    def region(self, name: str, block: Block) -> tuple[slice, ...]:
        """Return the slices of the array of an output or of ``status`` that a block fills."""
        return tuple(block.get(dim, slice(0, self.frame.sizes[dim])) for dim in self.dims(name))

    def attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of an output or of ``status`` in the Dataset."""
        quantity = QUANTITIES.get(name, _STATUS)
        units = quantity.units
        if units in _OF_SLIDES:
            units = JointUnits(self.task.arm.slides).joined(units, _OF_SLIDES[units])
        attributes = {"long_name": quantity.long_name, "units": units}
        if name != "status":
            return attributes
        missing = []
        for kind in SweepStatus:
            lost = [name for name in self.task.outputs if QUANTITIES[name].stage in LOST[kind]]
            missing += [f"{kind.name.lower()}: {', '.join(lost)}"] if lost else []
        return attributes | {
            "flag_values": [int(kind) for kind in SweepStatus],
            "flag_meanings": " ".join(kind.name.lower() for kind in SweepStatus),
            "comment": "NaN stands only where the status says so, in: "
            + ("; ".join(missing) or "nothing"),
        }

    def empty(self, name: str) -> NDArray[Any]:
        """Build an array for an output, filled with NaN, or for ``status``, filled with PENDING.

        Raises InvalidInput if the array does not fit into memory.
        """
        try:
            return np.full(self.shape(name), EMPTY.get(name, np.float64(np.nan)))
        except (MemoryError, ValueError):  # numpy raises ValueError for sizes beyond all memory
            entries = " x ".join(map(str, self.shape(name)))
            raise InvalidInput(
                "outputs",
                f"{name} has {entries} entries, more than fits into memory; ask for less, or give "
                "store= a path.",
            ) from None

    def dataset(self, values: Mapping[str, NDArray[Any]]) -> xarray.Dataset:
        """Build the Dataset from the arrays of outputs and ``status``, given by name."""
        return self.frame.assign(
            {
                name: (self.dims(name), array, self.attributes(name))
                for name, array in values.items()
            }
        )


def _labels(task: SweepTask, poses: Poses) -> dict[str, Label]:
    """Return all coordinates of the Dataset, by name."""
    arm, wrenches, lows, directions = task.arm, task.wrenches, task.minima, task.directions
    force, moment = wrenches.values[:, :3], wrenches.values[:, 3:]
    labels = {
        **task.laws.labels,
        **wrenches.labels,
        "force": wrenches.label(force, ("axis",), "force on the tip, base axes", "N"),
        "moment": wrenches.label(moment, ("axis",), "moment on the tip, base axes", "N m"),
        "minimum": lows.label(lows.values, (), "lower bound of all tensions", "N"),
        "maximum": label((), task.maximum, "upper bound of all tensions", "N"),
    }
    if task.diameter:
        labels["diameter"] = label((), task.diameter, "diameter of the cables", "m")
    own = {dim for name in task.outputs for dim in QUANTITIES[name].dims}
    if "direction" in own:
        labels |= directions.labels
        labels["direction_vector"] = directions.label(
            directions.values, ("axis",), "unit vector of the direction, base axes", "1"
        )
    labels["gravity"] = label(("axis",), arm.gravity, "gravity, base axes", "m s-2")
    every = {**poses.labels, **labels}
    used = own | {dim for dims, _, _ in every.values() for dim in dims}
    for dim, along, long_name in (
        ("axis", XYZ, "axis of the base frame"),
        ("axis_column", XYZ, "axis of the base frame, of the columns"),
        ("cable", arm.cables.names, "name of the cable"),
        ("joint", arm.joint_names, "name of the joint"),
        ("joint_column", arm.joint_names, "joint that turns, of the columns"),
    ):
        if dim in used:
            labels[dim] = label((dim,), np.array(along), long_name)
    _require_own_names(poses, {*labels, *task.outputs, "status"})
    return {**poses.labels, **labels}


def _require_own_names(poses: Poses, taken: set[str]) -> None:
    """Raise InvalidInput if a joint has a name that no coordinate of the Dataset can have.

    Such names are those in ``taken``, and those that NetCDF or Zarr do not accept.
    """
    for name in poses.labels:
        if name in taken:
            why = "is a name that the Dataset has already"
        elif not _NAME.fullmatch(name):
            why = "is no name of a variable in NetCDF and Zarr"
        else:
            continue
        raise InvalidInput(
            "angles",
            f"each joint of the arm becomes a coordinate of the grid, but {name!r} {why}. Rename "
            "this joint in the URDF, or sweep over a path or random postures, which have one "
            "coordinate for all joints.",
        )

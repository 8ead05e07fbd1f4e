"""Convert a batch to a labelled Dataset, with dimensions and a unit for each quantity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.batch.layout import AXES, DIMENSIONS, DIRECTIONAL, JOINTS, MOTIONS
from cdsm.manipulator import Manipulator
from cdsm.support.format import JointUnits, coordinates
from cdsm.support.status import Status
from cdsm.support.tidy import dataset
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

    from cdsm.batch.layout import Codes

_SHOWN: Final = DIMENSIONS | {"tip_position": (("axis",), "m"), "tip_rotation": (AXES, "1")}
"""Dimensions and unit of each variable of a Dataset; the dimension of the postures is left out."""


def to_dataset(
    arm: Manipulator,
    q: Array,
    status: Codes,
    values: dict[str, Array],
    directions: Array | None = None,
) -> xarray.Dataset:
    """Build a Dataset of the quantities ``values`` (B, …), joint angles (B, nv) and status (B,).

    ``directions`` (D, 3), or (3,) for one, label the values that depend on a direction. Raises
    MissingExtra if xarray is not installed.
    """
    units = {"torque": arm.torque_unit(), "stiffness": arm.stiffness_unit()}
    units["lever"] = JointUnits(arm.slides).joined("m/rad", "1")
    variables: dict[str, tuple[Sequence[str], Array, str]] = {
        "q": (("pose", "joint"), q, " or ".join(sorted(set(arm.joint_units))[::-1]))
    }
    if "tip" in values:
        tip = values.pop("tip")
        values |= {"tip_position": tip[:, :3, 3], "tip_rotation": tip[:, :3, :3]}
    for name, value in values.items():
        dims, unit = _SHOWN[name]
        # one direction has no axis of its own; a variable must not have the name of a dimension
        shown = (("pose", *dims), value.reshape(len(q), -1) if name in DIRECTIONAL else value)
        variables["joint_stiffness" if name == "joint" else name] = (*shown, units.get(unit, unit))
    motions = ("x", "y", "z", "rx", "ry", "rz")
    labels = {
        **dict.fromkeys(JOINTS, arm.joint_names),
        **dict.fromkeys(MOTIONS, motions),
        **dict.fromkeys(AXES, motions[:3]),
        "cable": arm.cables.names,
    }
    if directions is not None:
        labels["direction"] = tuple(map(coordinates, directions.reshape(-1, 3)))
    found = dataset(variables, labels, title=f"postures of {arm.name}")
    flags = {
        "flag_values": np.array([int(each) for each in Status], dtype=np.uint8),
        "flag_meanings": " ".join(each.name.lower() for each in Status),
    }
    found["status"] = ("pose", status.copy(), flags)
    return found

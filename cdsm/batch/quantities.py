"""Quantities of a batch: dimensions, units, and what each one needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.manipulator import Manipulator
from cdsm.support.format import JointUnits, coordinates
from cdsm.support.status import Status
from cdsm.support.tidy import dataset
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

Codes = NDArray[np.uint8]

_JOINTS: Final = ("joint", "joint_column")
_MOTIONS: Final = ("motion", "motion_column")
_AXES: Final = ("axis", "axis_column")

DIMENSIONS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    # these need the joint angles alone
    "tip": (("row", "column"), "1"),
    "jacobian": (("motion", "joint"), "1"),
    "cable_lengths": (("cable",), "m"),
    "length_jacobian": (("cable", "joint"), "lever"),
    "gravity_torque": (("joint",), "torque"),
    "gravity": (_JOINTS, "stiffness"),
    # these also need tensions
    "tension": (("cable",), "N"),
    "residual": (("joint",), "torque"),
    "active": (_JOINTS, "stiffness"),
    "load": (_JOINTS, "stiffness"),
    # these also need the stiffness of the cables
    "cable_stiffness": (("cable",), "N/m"),
    "passive": (_JOINTS, "stiffness"),
    "joint": (_JOINTS, "stiffness"),
    "margin": ((), "stiffness"),
    "pseudoinverse": (_AXES, "N/m"),
    # these also need a regular K_θ
    "along": (("direction",), "N/m"),
    "compliance": (_MOTIONS, "1"),
    "cartesian": (_AXES, "N/m"),
}
"""Dimensions and unit of each quantity.

The unit is 1 for matrices whose entries have different SI units. Units of "torque", "stiffness" and
"lever" depend on the joints of the arm: N m, N m/rad and m/rad, or N, N/m and 1 for prismatic ones.
"""

_NAMES: Final = tuple(DIMENSIONS)
OF_POSTURE: Final = _NAMES[: _NAMES.index("tension")]
OF_TENSION: Final = _NAMES[_NAMES.index("tension") : _NAMES.index("cable_stiffness")]
READINGS: Final = _NAMES[_NAMES.index("margin") :]
TERMS: Final = ("active", "passive", "gravity", "load")


def shapes_of(nv: int, cables: int, directions: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each quantity at one posture."""
    sizes = {"joint": nv, "cable": cables, "direction": directions}
    sizes |= {"row": 4, "column": 4, "motion": 6, "axis": 3}
    return {
        name: tuple(sizes[each.removesuffix("_column")] for each in dims)
        for name, (dims, _) in DIMENSIONS.items()
    }


def joint_axes(name: str) -> int:
    """Return how many of the last axes of a quantity go over the joints."""
    return sum(each in _JOINTS for each in DIMENSIONS[name][0])


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
    for name, value in values.items():
        dims, unit = DIMENSIONS[name]
        if name == "tip":
            variables["tip_position"] = (("pose", "axis"), value[:, :3, 3], "m")
            variables["tip_rotation"] = (("pose", *_AXES), value[:, :3, :3], "1")
            continue
        # one direction has no axis of its own; a variable must not have the name of a dimension
        shown = value.reshape(len(q), -1) if name == "along" else value
        label = "joint_stiffness" if name == "joint" else name
        variables[label] = (("pose", *dims), shown, units.get(unit, unit))
    motions = ("x", "y", "z", "rx", "ry", "rz")
    labels = {
        **dict.fromkeys(_JOINTS, arm.joint_names),
        **dict.fromkeys(_MOTIONS, motions),
        **dict.fromkeys(_AXES, motions[:3]),
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

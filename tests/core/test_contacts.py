"""Bodies of links that overlap, against closed forms."""

import numpy as np
import pytest

from cdsm.geometry.parts import Disk, overlapping
from cdsm.support.values import Array

R, HALF = 0.02, 0.05
DISKS = [Disk(link, x, 1, 0.01, R) for link in "abc" for x in (-HALF, HALF)]


def placed(x: float, y: float, z: float, axis: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = np.array([np.roll(axis, i) for i in range(3)]).T
    pose[:3, 3] = x, y, z
    return pose


@pytest.mark.parametrize("gap", [-0.01 * R, 0.01 * R])
@pytest.mark.parametrize(
    ("offset", "towards", "axis"),
    [
        ((0.02, 2.0 * R, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),  # side by side
        ((2.0 * HALF, 0.5 * R, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),  # end to end
        ((0.0, 0.0, 2.0 * R), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),  # crossed
        ((HALF + R, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),  # an end on a side
    ],
)
def test_cylinders_overlap_where_their_gap_is_negative(
    gap: float,
    offset: tuple[float, float, float],
    towards: tuple[float, float, float],
    axis: tuple[float, float, float],
) -> None:
    x, y, z = np.add(offset, gap * np.array(towards)).tolist()
    poses = {
        "a": placed(0.0, 0.0, 0.0, np.eye(3)[0]),
        "b": placed(9.0, 0.0, 0.0, np.eye(3)[0]),
        "c": placed(x, y, z, np.array(axis)),
    }
    assert overlapping(DISKS, poses) == ([("a", "c")] if gap < 0.0 else [])


def test_neighbours_are_left_to_their_joint_limits() -> None:
    poses = {link: placed(0.0, 0.0, 0.0, np.eye(3)[0]) for link in "ab"}
    assert overlapping([disk for disk in DISKS if disk.link in poses], poses) == []

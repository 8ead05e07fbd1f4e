"""The measured rod with one tendon: its points, the camera, and what cdsm predicts."""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import cdsm
from cdsm.support.values import Array

_TABLE = np.loadtxt(
    Path(__file__).parents[1] / "data" / "rod_one_tendon.csv", delimiter=",", skiprows=3
)
TENSIONS = _TABLE[::11, 0]
"""Tensions (9,) [N] at the motor, rising; the first one hardly bends the rod."""

POINTS = _TABLE[:, 2:].reshape(9, 11, 3)
"""Measured centres of the disks (9, 11, 3) [mm] in the axes of the camera."""


def disk_centres(pose: cdsm.Posture) -> Array:
    """Centres of the disks (11, 3) [mm] in base axes, from the first one."""
    disks = pose.arm.geometry.disks
    centres = [(pose.link_pose(disk.link) @ [disk.x, 0.0, 0.0, 1.0])[:3] for disk in disks]
    return 1e3 * (np.array(centres) - centres[0])


@cache
def predicted(E: float, mu: float) -> Array:
    """Centres of the disks (9, 11, 3) [mm] at the measured tensions; E in GPa."""
    arm = cdsm.presets.rod_one_tendon(1e9 * E, mu)
    rests = [cdsm.forward_statics(arm, tension=[F]) for F in TENSIONS]
    return np.array([disk_centres(rest.pose) for rest in rests])


def axes_of_camera() -> Array:
    """Axes of the base (3, 3) in those of the camera: along the straight rod, and as it bends."""
    points = POINTS - POINTS[:, :1]
    along = points[0, -1] / np.linalg.norm(points[0, -1])
    across = points[[4, 6, 8], -1].sum(axis=0)
    across -= (across @ along) * along
    across /= np.linalg.norm(across)
    return np.array([along, across, np.cross(along, across)])


def shapes_in_plane() -> Array:
    """Measured shapes (9, 11, 2) [mm]: along the straight rod, and across it.

    The data give the first disk, the direction of the straight rod, and that in which it bends.
    """
    return np.asarray((POINTS - POINTS[:, :1]) @ axes_of_camera()[:2].T)


def in_plane(centres: Array) -> Array:
    """Return computed centres (…, 11, 3) as along the straight rod, and across it."""
    across = np.linalg.norm(centres[..., 1:], axis=-1)
    return np.stack([centres[..., 0], across], axis=-1)


def seen_by_camera(centres: Array) -> Array:
    """Move computed centres (9, 11, 3) by the one rigid motion that fits all points best."""
    flat, points = centres.reshape(-1, 3), POINTS.reshape(-1, 3)
    turn, _ = Rotation.align_vectors(points - points.mean(axis=0), flat - flat.mean(axis=0))
    moved = turn.apply(flat - flat.mean(axis=0)) + points.mean(axis=0)
    return np.asarray(moved.reshape(centres.shape))


def seen_from_straight(centres: Array) -> Array:
    """Move computed centres as the authors do: by the straight shape, and one roll about it."""
    middle = POINTS[0].mean(axis=0)
    along = np.linalg.svd(POINTS[0] - middle)[2][0]
    along *= np.sign(along @ (POINTS[0, -1] - POINTS[0, 0]))
    first = np.cross(along, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)

    def rolled(roll: float) -> Array:
        y = np.cos(roll) * first + np.sin(roll) * np.cross(along, first)
        axes = np.array([along, y, np.cross(along, y)])
        return np.asarray(middle + (centres - [135.0, 0.0, 0.0]) @ axes)

    fits = [
        least_squares(lambda roll: (rolled(roll[0]) - POINTS).ravel(), [start])
        for start in (0.0, 2.1, 4.2)
    ]
    return rolled(min(fits, key=lambda fit: fit.cost).x[0])

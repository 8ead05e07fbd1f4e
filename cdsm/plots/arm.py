"""Plot an arm in three dimensions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from cdsm.errors import InvalidInput
from cdsm.plots.style import (
    COLOR_MAP,
    MM,
    SKY,
    SMALL,
    TEXT,
    VERMILLION,
    equal_axes,
    expect,
    finish_picture,
    picture_axes,
)
from cdsm.support.directions import XYZ
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    from cdsm.posture import Posture
    from cdsm.stiffness_matrix import Stiffness
    from cdsm.tension import Tension

BESIDE_BAR = 0.82
"""Fraction of the width of a figure that is left of the colour bar of tensions."""

_FLATTEST = 0.35  # smallest range of an axis, as a fraction of the largest


def plot_arm(
    pose: Posture, tension: Tension | None = None, stiffness: Stiffness | None = None
) -> Figure:
    """Plot an arm in 3D: backbone, disks and cables, with equal axes in mm.

    A robot from a URDF has no disks. Its joints are drawn instead: circles are revolute, squares
    prismatic. A thin line joins each cable site to its link.

    Args:
        pose: Posture to draw.
        tension: Tensions that colour the cables, if given.
        stiffness: If it is given and the arm is stable, an ellipsoid at the tip shows the
            displacement C_vv f under a force f of 1 N in each direction, at the scale that the
            legend states. If the arm is unstable, the title says so.

    Raises:
        InvalidInput: An argument has the wrong type, or belongs to another arm or posture.
        SingularStiffness: K_θ is singular, so the ellipsoid does not exist.
    """
    expect("pose", pose, "Posture")
    if tension is not None:
        expect("tension", tension, "Tension")
        if tension.posture.arm != pose.arm:
            raise InvalidInput("tension", "belongs to another arm than the posture.")
    if stiffness is not None:
        expect("stiffness", stiffness, "Stiffness")
        if not stiffness.posture._equals(pose):
            raise InvalidInput(
                "stiffness", "belongs to another posture or arm; compute it for this one."
            )
    figure, axes = picture_axes()
    unstable = stiffness is not None and not stiffness.is_stable
    if stiffness is not None and not unstable:
        _draw_ellipsoid(axes, stiffness)
    shades = None
    if tension is not None:
        colors = color_scale(tension.values)
        shades = colors.to_rgba(tension.values)
        tension_bar(figure, colors)
    draw_arm(axes, pose, shades)
    frame_arms(axes, None)
    title = f"{'UNSTABLE: ' if unstable else ''}{pose.arm.name}"
    finish_picture(figure, axes, title, 1.0 if tension is None else BESIDE_BAR)
    return figure


def tension_bar(figure: Figure, colors: ScalarMappable) -> None:
    """Draw the colour bar of the tensions [N] at the right edge of a figure."""
    bar = figure.colorbar(colors, cax=figure.add_axes((BESIDE_BAR + 0.01, 0.15, 0.025, 0.6)))
    bar.set_label("cable tension [N]", fontsize=TEXT)
    bar.ax.tick_params(labelsize=SMALL)


ELLIPSOID_GRID = 13, 25
"""Number of points of a drawn ellipsoid: from pole to pole, and around its axis."""

_LARGEST = 0.3  # largest half axis of a drawn ellipsoid, as a fraction of the arm's length


class Ellipsoid(NamedTuple):
    """Ellipsoid of the tip displacements C_vv f under all forces f of 1 N, to be drawn."""

    surface: Array  # points of the drawn surface (3, 13, 25) [m]
    scale: float  # drawn displacement over true displacement [-], a power of ten
    longest: float  # largest true displacement per force [m/N]

    def __str__(self) -> str:
        large, small = max(self.scale, 1.0), max(1.0 / self.scale, 1.0)
        return f"where 1 N moves the tip, scale {large:g}:{small:g}"


def ellipsoid(compliance: Array, tip: Array, length: float) -> Ellipsoid | None:
    """Compute the ellipsoid of a compliance C_vv (3, 3) [m/N] at the tip (3,) [m] of an arm.

    It is scaled by a power of ten, so that its longest half axis is 3 to 30 % of the ``length`` of
    the arm [m]. None if no force moves the tip.
    """
    longest = float(np.linalg.norm(compliance, 2))
    if longest == 0.0:
        return None
    rows, columns = ELLIPSOID_GRID
    around, down = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, columns), np.linspace(0.0, np.pi, rows)
    )
    force = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)])
    scale = 10.0 ** math.floor(math.log10(_LARGEST * length / longest))
    moved = scale * np.einsum("ij,j...->i...", compliance, force)
    return Ellipsoid(frozen(moved + tip[:, None, None]), scale, longest)


def _draw_ellipsoid(axes: Any, stiffness: Stiffness) -> None:
    pose = stiffness.posture
    drawn = ellipsoid(stiffness.compliance[:3, :3], pose.tip[:3, 3], pose.arm.length)
    if drawn is not None:
        label = f"{drawn}; longest: {MM * drawn.longest:.3g} mm"
        axes.plot_wireframe(*(MM * drawn.surface), color=VERMILLION, linewidth=0.4, label=label)


def draw_arm(axes: Any, pose: Posture, colors: Array | None = None) -> None:
    """Draw an arm on existing 3D axes; ``colors`` (C, 4) are the RGBA colours of its cables."""
    if pose.arm.is_serpentine:
        _draw_disks(axes, pose)
    else:
        _draw_joints(axes, pose)
    for bone in pose.bones:
        axes.plot(*(MM * bone.T), color="0.1", linewidth=2.0)
    shades = [SKY] * len(pose.cable_paths) if colors is None else colors.tolist()
    for path, color in zip(pose.cable_paths, shades, strict=True):
        axes.plot(*(MM * path.T), color=color, linewidth=0.9)


def frame_arms(axes: Any, limits: Array | None, label: str = "{} [mm]") -> None:
    """Give 3D axes equal scales, the limits (3, 2) [mm], and labels.

    If ``limits`` is None, the axes contain everything drawn so far. In ``label``, {} stands for the
    name of the axis.
    """
    axes.tick_params(labelsize=SMALL, pad=-3)
    if limits is None:
        limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    ranges = np.ptp(limits, axis=1)
    ranges = np.maximum(ranges, _FLATTEST * ranges.max())  # keep space around a flat arm
    for name, middle, size in zip(XYZ, limits.mean(axis=1), ranges, strict=True):
        getattr(axes, f"set_{name}label")(label.format(name), fontsize=TEXT, labelpad=-2)
        getattr(axes, f"set_{name}lim")(middle - size / 2.0, middle + size / 2.0)
    equal_axes(axes)


def _draw_joints(axes: Any, pose: Posture) -> None:
    """Draw revolute and prismatic joints, and lines from cable sites to their links."""
    for bracket in pose.brackets:
        axes.plot(*(MM * bracket.T), color="0.5", linewidth=0.8)
    for chosen, marker in ((~pose.arm.slides, "o"), (pose.arm.slides, "s")):
        places = MM * pose.joint_positions[chosen]
        axes.plot(*places.T, marker, color="0.1", markerfacecolor="white", markersize=4, zorder=5)
    if pose.arm.slides.any():
        for marker, label in (("o", "turns"), ("s", "slides")):
            line = {"color": "0.1", "markerfacecolor": "white", "linestyle": ""}
            axes.plot([], [], [], marker, label=label, **line)


def _draw_disks(axes: Any, pose: Posture) -> None:
    circle = np.linspace(0.0, 2.0 * np.pi, 49)
    for disk in pose.arm.geometry.disks:
        placement = pose.link_pose(disk.link)
        ring = [0.0 * circle + disk.x, disk.radius * np.cos(circle), disk.radius * np.sin(circle)]
        edge = placement[:3, 3:] + placement[:3, :3] @ np.array(ring)
        axes.plot(*(MM * edge), color="0.45", linewidth=0.6)


def color_scale(tensions: Array) -> ScalarMappable:
    """Build the colour scale from the smallest to the largest of ``tensions`` [N]."""
    low, high = tensions.min(), tensions.max()
    return ScalarMappable(Normalize(low, max(high, low + 1e-9)), COLOR_MAP)

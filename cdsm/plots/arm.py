"""Plot an arm in three dimensions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.style import MM
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    from cdsm.posture import Posture
    from cdsm.stiffness_matrix import Stiffness
    from cdsm.tension import Tension

ELLIPSOID_GRID: Final = (13, 25)
"""Number of points of a drawn ellipsoid: from pole to pole, and around its axis."""

_CHARACTERS = 60  # of the legend in one line
_LARGEST = 0.3  # largest half axis of a drawn ellipsoid, as a fraction of the arm's length
_FLATTEST = 0.35  # smallest range of an axis, as a fraction of the largest
_PADS: Final = {"x": -3.0, "y": -6.0, "z": -4.0}  # from the numbers of an axis to its label
_UNZOOMED = 0.97  # side of the square of 3D axes, over the diagonal of their box at zoom 1
_ELEVATION, _AZIMUTH = np.deg2rad((24.0, -62.0))  # of the eye


class Ellipsoid(NamedTuple):
    """Ellipsoid of the tip displacements C_vv f under all forces f of 1 N, to be drawn."""

    surface: Array  # points of the drawn surface (3, 13, 25) [m]
    scale: float  # drawn displacement over true displacement [-], a power of ten
    longest: float  # largest true displacement per force [m/N]

    def __str__(self) -> str:
        large, small = max(self.scale, 1.0), max(1.0 / self.scale, 1.0)
        return f"where 1 N moves the tip, scale {large:g}:{small:g}"


@style.styled
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
    style.expect("pose", pose, "Posture")
    figure, axes = picture()
    scale = shades = None
    if tension is not None:
        style.expect("tension", tension, "Tension")
        if tension.posture.arm != pose.arm:
            raise InvalidInput("tension", "belongs to another arm than the posture.")
        scale = color_scale(tension.values)
        shades = scale.to_rgba(tension.values)
    draw_arm(axes, pose, shades)
    title = pose.arm.name
    if stiffness is not None:
        style.expect("stiffness", stiffness, "Stiffness")
        if not stiffness.posture._equals(pose):
            said = "belongs to another posture or arm; compute it for this one."
            raise InvalidInput("stiffness", said)
        if not stiffness.is_stable:
            return finish(figure, f"UNSTABLE: {title}", scale)
        drawn = ellipsoid(stiffness.compliance[:3, :3], pose.tip[:3, 3], pose.arm.length)
        if drawn is not None:
            label = f"{drawn}; longest: {MM * drawn.longest:.3g} mm"
            look = {"color": style.VERMILLION, "linewidth": 0.4, "label": label}
            axes.plot_wireframe(*(MM * drawn.surface), **look)
    return finish(figure, title, scale)


def ellipsoid(compliance: Array, tip: Array, length: float) -> Ellipsoid | None:
    """Compute the ellipsoid of a compliance C_vv (3, 3) [m/N] at the tip (3,) [m] of an arm.

    It is scaled by a power of ten, so that its longest half axis is 3 to 30 % of the ``length`` of
    the arm [m]. None if no force moves the tip.
    """
    longest = float(np.linalg.norm(compliance, 2))
    if longest == 0.0:
        return None
    rows, columns = ELLIPSOID_GRID
    turn, down = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, columns), np.linspace(0.0, np.pi, rows))
    force = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)])
    scale = 10.0 ** math.floor(math.log10(_LARGEST * length / longest))
    moved = scale * np.einsum("ij,j...->i...", compliance, force)
    return Ellipsoid(frozen(moved + tip[:, None, None]), scale, longest)


def color_scale(tensions: Array) -> ScalarMappable:
    """Build the colour scale from the smallest to the largest of ``tensions`` [N]."""
    low, high = tensions.min(), tensions.max()
    return ScalarMappable(Normalize(low, max(high, low + 1e-9)), style.COLOR_MAP)


def draw_arm(axes: Any, pose: Posture, colors: Array | None = None) -> None:
    """Draw an arm on existing 3D axes; ``colors`` (C, 4) are the RGBA colours of its cables."""
    arm, turn = pose.arm, np.linspace(0.0, 2.0 * np.pi, 49)
    for disk in arm.geometry.disks if arm.is_serpentine else ():
        placement = pose.link_pose(disk.link)
        ring = [0.0 * turn + disk.x, disk.radius * np.cos(turn), disk.radius * np.sin(turn)]
        edge = placement[:3, 3:] + placement[:3, :3] @ np.array(ring)
        axes.plot(*(MM * edge), color="0.45", linewidth=0.6)
    for bracket in () if arm.is_serpentine else pose.brackets:  # from cable sites to their links
        axes.plot(*(MM * bracket.T), color="0.5", linewidth=0.8)
    for marker, label, chosen in (("o", "turns", ~arm.slides), ("s", "slides", arm.slides)):
        if not arm.is_serpentine:
            look = {"color": "0.1", "mfc": "white", "zorder": 5, "ls": ""}
            named = {"label": label} if arm.slides.any() else {}
            axes.plot(*(MM * pose.joint_positions[chosen].T), marker, **look, **named)
    draw_bones(axes, pose, color="0.1", linewidth=2.0)
    for i, path in enumerate(pose.cable_paths):
        axes.plot(*(MM * path.T), color=style.SKY if colors is None else colors[i], linewidth=0.9)


def draw_bones(axes: Any, pose: Posture, **line: Any) -> None:
    """Draw the links of an arm as lines between its joints."""
    for bone in pose.bones:
        axes.plot(*(MM * bone.T), **line)


def picture() -> tuple[Figure, Any]:
    """Build a figure of one column with 3D axes, to be completed by :func:`finish`."""
    figure = Figure(figsize=(style.ONE_COLUMN, style.ONE_COLUMN))
    figure.set_layout_engine("none")
    axes: Any = figure.add_subplot(projection="3d")
    axes.view_init(*np.rad2deg([_ELEVATION, _AZIMUTH]))
    return figure, axes


def frame_arms(axes: Any, label: str = "{} [mm]") -> Array:
    """Give 3D axes equal scales, few ticks, and labels in which {} is the axis; return ranges."""
    limits = np.reshape(axes.get_w_lims(), (3, 2))
    ranges = np.ptp(limits, axis=1)
    ranges = np.maximum(ranges, _FLATTEST * ranges.max())  # keep space around a flat arm
    middles = limits.mean(axis=1)
    for (name, pad), middle, size in zip(_PADS.items(), middles, ranges, strict=True):
        ticks = MaxNLocator(max(2, round(5.0 * size / ranges.max())), prune="both")
        getattr(axes, f"{name}axis").set_major_locator(ticks)
        getattr(axes, f"set_{name}label")(label.format(name), labelpad=pad)
        getattr(axes, f"set_{name}lim")(middle - size / 2.0, middle + size / 2.0)
    axes.tick_params(pad=-3.0)
    axes.tick_params("z", pad=0.0)
    axes.set_box_aspect(ranges)
    return np.asarray(ranges)


def finish(
    figure: Figure, title: str, colors: ScalarMappable | None = None, label: str = "{} [mm]"
) -> Figure:
    """Complete a 3D picture: scales, labels, title, legend, and a colour bar of tensions.

    The figure becomes as high as the box of the axes looks from the eye, and the box fills it.
    """
    axes: Any = figure.axes[0]
    ranges = frame_arms(axes, label)
    side = abs(np.array([math.sin(_AZIMUTH), math.cos(_AZIMUTH), 0.0]))
    up = abs(np.array([*(math.sin(_ELEVATION) * side[[1, 0]]), math.cos(_ELEVATION)]))
    width = style.ONE_COLUMN * (1.0 if colors is None else 0.82)
    scale = (width - 0.95) / float(side @ ranges)  # inch per mm
    labels = axes.get_legend_handles_labels()[1]
    columns = 3 if sum(map(len, labels)) < _CHARACTERS else 1
    below = 0.1 + 0.2 * -(-len(labels) // columns) if labels else 0.05
    height = scale * float(up @ ranges) + 0.4
    total = height + below + 0.25
    figure.set_size_inches(style.ONE_COLUMN, total)
    axes.set_position((-0.07, (below + 0.14) / total, width / style.ONE_COLUMN, height / total))
    zoom = _UNZOOMED * scale * float(np.linalg.norm(ranges)) / min(height, width)
    axes.set_box_aspect(ranges, zoom=zoom)
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)  # the box is wider than the square of the axes
    style.heading(figure, title)
    if labels:
        figure.legend(loc="lower center", ncols=columns, frameon=False)
    if colors is not None:
        bar = figure.add_axes((0.83, 0.2, 0.025, 0.6))
        figure.colorbar(colors, cax=bar, label="cable tension [N]")
    return figure

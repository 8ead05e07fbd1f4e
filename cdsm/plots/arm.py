"""Plot an arm in three dimensions: at a posture, along a path, in its natural modes."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.planning.path_plan import PathPlan
from cdsm.plots import style
from cdsm.plots.style import MM
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.files import as_path, write_file
from cdsm.support.validation import instance, number_array
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from cdsm.control.plants import PlantState
    from cdsm.statics.modes import Modes

ELLIPSOID_GRID: Final = (13, 25)
"""Number of points of a drawn ellipsoid: from pole to pole, and around its axis."""

_CHARACTERS = 60  # of the legend in one line
_LARGEST = 0.3  # largest half axis of a drawn ellipsoid, as a fraction of the arm's length
_FLATTEST = 0.35  # smallest range of an axis, as a fraction of the largest
_PADS: Final = {"x": -3.0, "y": -6.0, "z": -4.0}  # from the numbers of an axis to its label
_UNZOOMED = 0.97  # side of the square of 3D axes, over the diagonal of their box at zoom 1
_ELEVATION, _AZIMUTH = np.deg2rad((24.0, -62.0))  # of the eye
_GHOSTS = 5  # number of postures that are drawn over each other
_FRAMES = 150  # largest number of frames of an animation, and frames per second
_RATE = 15
_SHAPES = 3  # number of modes that are drawn
_DEFLECTED = 0.25  # largest displacement of the tip in the picture of a mode, over the arm's length


class Ellipsoid(NamedTuple):
    """Ellipsoid of the tip displacements C_vv f under all forces f of 1 N, to be drawn."""

    surface: Array  # points of the drawn surface (3, 13, 25) [m]
    scale: float  # drawn displacement over true displacement [-], a power of ten
    longest: float  # largest true displacement per force [m/N]

    def __str__(self) -> str:
        large = max(self.scale, 1.0)
        small = max(1.0 / self.scale, 1.0)
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
        stiffness: Of a stable arm, drawn as an ellipsoid at the tip: the displacements C_vv f under
            forces f of 1 N, at the scale of the legend. Of an unstable one the title says so.

    Raises:
        InvalidInput: An argument has the wrong type, or belongs to another arm or posture.
        SingularStiffness: K_θ is singular, so the ellipsoid does not exist.
    """
    instance("pose", pose, Posture)
    figure, axes = picture()
    scale = shades = None
    if tension is not None:
        instance("tension", tension, Tension)
        if tension.posture.arm != pose.arm:
            raise InvalidInput("tension", "belongs to another arm than the posture.")
        scale = color_scale(tension.values)
        shades = scale.to_rgba(tension.values)
    draw_arm(axes, pose, shades)
    title = pose.arm.name
    if stiffness is not None:
        instance("stiffness", stiffness, Stiffness)
        if not stiffness.posture.equals(pose):
            problem = "belongs to another posture or arm; compute it for this one."
            raise InvalidInput("stiffness", problem)
        if not stiffness.is_stable:
            return finish(figure, f"UNSTABLE: {title}", scale)
        drawn = ellipsoid(stiffness.compliance[:3, :3], pose.tip[:3, 3], pose.arm.length)
        if drawn is not None:
            label = f"{drawn}; longest: {MM * drawn.longest:.3g} mm"
            look = {"color": style.VERMILLION, "linewidth": 0.4, "label": label}
            axes.plot_wireframe(*(MM * drawn.surface), **look)
    return finish(figure, title, scale)


@style.styled
def plot_path(
    path: PathPlan | Sequence[Posture | PlantState],
    *,
    animate: str | os.PathLike[str] | None = None,
    tensions: ArrayLike | None = None,
) -> Figure:
    """Plot some postures of a path over each other, from pale to dark, with the path of the tip.

    Args:
        path: Postures of one arm, in order, or states with a ``pose``, as of a tracking run; or a
            plan, of which the feasible samples are drawn.
        animate: A ``.gif`` to write too: the arm follows the path, with cables coloured by tension.
        tensions: Tensions (P, C) [N] for the colours at P postures; default: those of a plan.

    Raises:
        InvalidInput: ``path`` has no postures of one arm, or ``animate`` does not end in ``.gif``.
        FileError: The animation cannot be written.
    """
    poses: Sequence[Any]
    if isinstance(path, Sequence):
        poses = [getattr(state, "pose", state) for state in path]
        for pose in poses:
            instance("path", pose, Posture)
    else:
        instance("path", path, PathPlan)
        poses = [K.posture for K in path.stiffness]
        tensions = path.tensions if tensions is None else tensions
    if not poses or any(pose.arm != poses[0].arm for pose in poses):
        problem = "give postures of one arm, or a plan that reaches its target at some samples."
        raise InvalidInput("path", problem)
    figure, axes = picture()
    *ghosts, last = (poses[k] for k in _some(len(poses), _GHOSTS))
    for pose, shade in zip(ghosts, np.linspace(0.8, 0.5, len(ghosts)), strict=True):
        draw_bones(axes, pose, color=f"{shade:.2f}", linewidth=2.0)
    draw_arm(axes, last)
    tips = MM * np.array([pose.tip[:3, 3] for pose in poses])
    axes.plot(*tips.T, color=style.VERMILLION, label="path of the tip")
    axes.plot(*tips[-1:].T, "o", color=style.VERMILLION, label="its end")
    finish(figure, f"{last.arm.name}: the last of {len(poses)} postures, others pale")
    if animate is not None:
        values = None if tensions is None else number_array("tensions", tensions)
        _animate(animate, poses, values, axes)
    return figure


@style.styled
def plot_modes(modes: Modes) -> Figure:
    """Plot an arm in mm, deflected by up to three modes: growing modes first, then the lowest."""
    pose = modes.stiffness.posture
    figure, axes = picture()
    draw_bones(axes, pose, color="0.6", linewidth=2.0)
    names = [f"grows at {rate:.3g}/s" for rate in modes.growth_rates]
    names += [f"{frequency:.3g} Hz" for frequency in modes.frequencies]
    shapes = np.hstack([modes.growth_shapes, modes.shapes]).T
    for shape, name, color in zip(shapes, names, style.COLORS[:_SHAPES], strict=False):
        moved = np.linalg.norm(pose.jacobian[:3] @ shape) / pose.arm.length
        step = _DEFLECTED / max(moved, np.linalg.norm(shape)) * shape
        draw_bones(axes, pose.arm.at(pose.q + step, check_limits=False), color=color)
        axes.plot([], [], [], color=color, label=name)
    unstable = "" if modes.is_stable else "UNSTABLE: "
    return finish(figure, f"{unstable}{pose.arm.name}, enlarged modes")


def ellipsoid(compliance: Array, tip: Array, length: float) -> Ellipsoid | None:
    """Scale the ellipsoid of C_vv (3, 3) [m/N] at the tip (3,) to 3 to 30 % of ``length`` [m].

    None if no force moves the tip.
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
    low = tensions.min()
    high = tensions.max()
    return ScalarMappable(Normalize(low, max(high, low + 1e-9)), style.COLOR_MAP)


def draw_arm(axes: Any, pose: Posture, colors: Array | None = None) -> None:
    """Draw an arm on existing 3D axes; ``colors`` (C, 4) are the RGBA colours of its cables."""
    arm = pose.arm
    if arm.is_serpentine:
        turn = np.linspace(0.0, 2.0 * np.pi, 49)
        for disk in arm.geometry.disks:
            placement = pose.link_pose(disk.link)
            ring = [0.0 * turn + disk.x, disk.radius * np.cos(turn), disk.radius * np.sin(turn)]
            edge = placement[:3, 3:] + placement[:3, :3] @ np.array(ring)
            axes.plot(*(MM * edge), color="0.45", linewidth=0.6)
    else:
        for bracket in pose.brackets:  # from cable sites to their links
            axes.plot(*(MM * bracket.T), color="0.5", linewidth=0.8)
        for marker, label, chosen in (("o", "turns", ~arm.slides), ("s", "slides", arm.slides)):
            look = {"color": "0.1", "mfc": "white", "zorder": 5, "ls": ""}
            named = {"label": label} if arm.slides.any() else {}
            axes.plot(*(MM * pose.joint_positions[chosen].T), marker, **look, **named)
    draw_bones(axes, pose, color="0.1", linewidth=2.0)
    if pose.wrapping:  # pulleys; dashed where the cable does not touch
        for rim, touches in zip(pose.wrapping.rims, pose.wrapping.touches, strict=True):
            look = {"color": "0.45", "linewidth": 0.6, "linestyle": "-" if touches else "--"}
            axes.plot(*(MM * rim.T), **look)
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
    """Complete a 3D picture, and make it as high as the box of the axes looks from the eye."""
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
    _unclip(axes)
    style.titled(figure, title)
    if labels:
        figure.legend(loc="lower center", ncols=columns, frameon=False)
    if colors is not None:
        bar = figure.add_axes((0.83, 0.2, 0.025, 0.6))
        figure.colorbar(colors, cax=bar, label="cable tension [N]")
    return figure


def _some(count: int, most: int) -> list[int]:
    """Return up to ``most`` of ``count`` indices, evenly spaced, with both ends."""
    return sorted({round(k) for k in np.linspace(0, count - 1, most).tolist()})


def _animate(
    path: str | os.PathLike[str], poses: Sequence[Posture], tensions: Array | None, like: Any
) -> None:
    """Write a GIF of up to 150 postures, coloured by tension, within the limits of ``like``."""
    if as_path(path).suffix.lower() != ".gif":
        raise InvalidInput("animate", f"{str(path)!r} given; it must end in .gif.")
    figure, axes = picture()
    colors = None if tensions is None else color_scale(tensions)
    axes.auto_scale_xyz(*np.reshape(like.get_w_lims(), (3, 2)))
    finish(figure, " ", colors)

    def draw(k: int) -> None:
        for line in list(axes.lines):
            line.remove()
        shades = None if colors is None or tensions is None else colors.to_rgba(tensions[k])
        draw_arm(axes, poses[k], shades)
        _unclip(axes)
        style.titled(figure, f"{poses[0].arm.name}, posture {k} of {len(poses) - 1}")

    film: Any = FuncAnimation(figure, draw, _some(len(poses), _FRAMES), init_func=lambda: None)
    write_file(path, lambda aside: film.save(aside, PillowWriter(_RATE), dpi=figure.dpi))


def _unclip(axes: Any) -> None:
    """Let lines and surfaces be seen outside the square of 3D axes, which is less than the box."""
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)

"""Plot an arm that moves: several postures in one picture, an animation, and natural modes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.arm import color_scale, draw_arm, draw_bones, finish, picture
from cdsm.plots.style import MM
from cdsm.support.files import as_path, write_file
from cdsm.support.validation import number_array
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.planning.path_plan import PathPlan
    from cdsm.posture import Posture
    from cdsm.statics.modes import Modes

_GHOSTS = 5  # number of postures that are drawn over each other
_FRAMES = 150  # largest number of frames of an animation; a longer path is thinned out
_RATE = 15  # frames per second
_SHAPES = 3  # number of modes that are drawn
_DEFLECTED = 0.25  # largest displacement of the tip in the picture of a mode, over the arm's length


@style.styled
def plot_path(
    path: PathPlan | Sequence[Posture],
    *,
    animate: str | os.PathLike[str] | None = None,
    tensions: ArrayLike | None = None,
) -> Figure:
    """Plot some postures of a path over each other, from pale to dark, with the path of the tip.

    Args:
        path: Postures of one arm, in order; or a plan, of which the feasible samples are drawn.
        animate: A ``.gif`` to write too: the arm follows the path, with cables coloured by tension.
        tensions: Tensions (P, C) [N] for the colours, a row for each of P postures. Default: those
            of the plan, if ``path`` is a plan.

    Raises:
        InvalidInput: ``path`` is not postures of one arm or is empty, or ``animate`` does not
            end in ``.gif``.
        FileError: The animation cannot be written.
    """
    poses: Sequence[Posture] = path if isinstance(path, Sequence) else []
    pulls = tensions
    if not isinstance(path, Sequence):
        style.expect("path", path, "PathPlan")
        poses = [K.posture for K in path.stiffness]
        pulls = path.tensions if tensions is None else tensions
    for pose in poses:
        style.expect("path", pose, "Posture")
    if not poses or any(pose.arm != poses[0].arm for pose in poses):
        said = "give postures of one arm, or a plan that reaches its target at some samples."
        raise InvalidInput("path", said)
    figure, axes = picture()
    *ghosts, last = _some(poses, _GHOSTS)
    for k, shade in zip(ghosts, np.linspace(0.8, 0.5, len(ghosts)), strict=True):
        draw_bones(axes, poses[k], color=f"{shade:.2f}", linewidth=2.0)
    draw_arm(axes, poses[last])
    tips = MM * np.array([pose.tip[:3, 3] for pose in poses])
    axes.plot(*tips.T, color=style.VERMILLION, label="path of the tip")
    axes.plot(*tips[-1:].T, "o", color=style.VERMILLION, label="its end")
    title = f"{poses[0].arm.name}: the last of {len(poses)} postures, others pale"
    finish(figure, title)
    if animate is not None:
        _animate(animate, poses, None if pulls is None else number_array("tensions", pulls), axes)
    return figure


@style.styled
def plot_modes(modes: Modes) -> Figure:
    """Plot an arm and its deflections by up to three modes: growing modes, then the lowest.

    Deflections are enlarged: the tip moves by at most 25 % of the length of the arm.
    """
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


def _some(poses: Sequence[Posture], most: int) -> Sequence[int]:
    """Return the numbers of up to ``most`` postures, evenly, with both ends."""
    return tuple(np.unique(np.linspace(0, len(poses) - 1, most).round().astype(int)).tolist())


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
        for line in axes.lines:
            line.set_clip_on(False)
        style.heading(figure, f"{poses[0].arm.name}, posture {k} of {len(poses) - 1}")

    film: Any = FuncAnimation(figure, draw, _some(poses, _FRAMES), init_func=lambda: None)
    writer = PillowWriter(_RATE)
    write_file(path, lambda aside: film.save(aside, writer, dpi=figure.dpi))

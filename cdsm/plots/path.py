"""Plot an arm that moves: several postures in one picture, an animation, and natural modes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.plots.arm import BESIDE_BAR, color_scale, draw_arm, frame_arms, tension_bar
from cdsm.plots.style import (
    COLORS,
    MM,
    SCREEN,
    VERMILLION,
    expect,
    fill_canvas,
    finish_picture,
    heading,
    picture_axes,
)
from cdsm.support.files import as_path, write_file
from cdsm.support.validation import number_array
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.planning.path_plan import PathPlan
    from cdsm.posture import Posture
    from cdsm.statics.modes import Modes

_GHOSTS: Final = 5  # number of postures that are drawn over each other
_FRAMES: Final = 150  # largest number of frames of an animation; a longer path is thinned out
_RATE: Final = 15  # frames per second
_SHAPES: Final = 3  # number of modes that are drawn

_DEFLECTED: Final = 0.25
"""Largest displacement of the tip in the picture of a mode, divided by the arm length."""


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
    poses, planned = _postures(path)
    colored = planned if tensions is None else number_array("tensions", tensions)
    figure, axes = picture_axes()
    shown = np.unique(np.linspace(0, len(poses) - 1, _GHOSTS).round().astype(int)).tolist()
    limits = _limits(poses)
    for k, shade in zip(shown[:-1], np.linspace(0.8, 0.5, len(shown) - 1), strict=True):
        _draw_skeleton(axes, poses[k], f"{shade:.2f}")
    draw_arm(axes, poses[-1])
    tips = MM * np.array([pose.tip[:3, 3] for pose in poses])
    axes.plot(*tips.T, color=VERMILLION, linewidth=1.2, label="path of the tip")
    axes.plot(*tips[-1:].T, "o", color=VERMILLION, markersize=3, label="its end")
    frame_arms(axes, limits)
    title = f"{poses[0].arm.name}: the last of {len(poses)} postures, others pale"
    finish_picture(figure, axes, title)
    if animate is not None:
        _animate(animate, poses, colored, limits)
    return figure


def plot_modes(modes: Modes) -> Figure:
    """Plot an arm and its deflections by up to three modes: growing modes, then the lowest.

    A stable arm has no growing modes. Deflections are enlarged: the tip moves by at most 25 % of
    the length of the arm. Raises InvalidInput if ``modes`` is not a result of :func:`~cdsm.modes`.
    """
    expect("modes", modes, "Modes")
    pose = modes.stiffness.posture
    figure, axes = picture_axes()
    _draw_skeleton(axes, pose, "0.6")
    named = [(rate, f"grows at {rate:.3g}/s") for rate in modes.growth_rates]
    named += [(frequency, f"{frequency:.3g} Hz") for frequency in modes.frequencies]
    shapes = np.hstack([modes.growth_shapes, modes.shapes]).T
    poses = [pose]
    for shape, (_, label), color in zip(shapes, named, COLORS[:_SHAPES], strict=False):
        moved = np.linalg.norm(pose.jacobian[:3] @ shape)
        step = _DEFLECTED * pose.arm.length / max(moved, np.linalg.norm(shape) * pose.arm.length)
        bent = pose.arm.at(pose.q + step * shape, check_limits=False)
        poses.append(bent)
        bones = np.concatenate([*bent.bones])
        axes.plot(*(MM * bones.T), color=color, linewidth=1.5, label=label)
    frame_arms(axes, _limits(poses))
    unstable = "" if modes.is_stable else "UNSTABLE: "
    finish_picture(figure, axes, f"{unstable}{pose.arm.name}, enlarged modes")
    return figure


def _postures(path: PathPlan | Sequence[Posture]) -> tuple[list[Posture], Array | None]:
    """Return the P postures of a path, and their tensions (P, C) [N] if it is a plan."""
    tensions = None
    if isinstance(path, Sequence):
        poses = list(path)
    else:
        expect("path", path, "PathPlan")
        poses, tensions = [K.posture for K in path.stiffness], path.tensions
    for pose in poses:
        expect("path", pose, "Posture")
        if pose.arm != poses[0].arm:
            raise InvalidInput("path", "has postures of two arms; give those of one.")
    if not poses:
        raise InvalidInput(
            "path", "has no posture to draw; give one, or a plan that reaches its target."
        )
    return poses, tensions


def _limits(poses: Sequence[Posture]) -> Array:
    """Return the limits (3, 2) [mm] of axes that contain all postures."""
    points = MM * np.concatenate(
        [each for pose in poses for each in (*pose.cable_paths, *pose.bones)]
    )
    return np.array([points.min(axis=0), points.max(axis=0)]).T


def _draw_skeleton(axes: Any, pose: Posture, shade: str) -> None:
    for bone in pose.bones:
        axes.plot(*(MM * bone.T), color=shade, linewidth=2.0)


def _animate(
    path: str | os.PathLike[str], poses: Sequence[Posture], tensions: Array | None, limits: Array
) -> None:
    """Write a GIF of up to 150 postures; ``limits`` (3, 2) [mm] are the limits of the axes."""
    if as_path(path).suffix.lower() != ".gif":
        raise InvalidInput("animate", f"{str(path)!r} given; it must end in .gif.")
    figure, axes = picture_axes()
    colors = None if tensions is None else color_scale(tensions)
    if colors is not None:
        tension_bar(figure, colors)
    chosen = np.unique(np.linspace(0, len(poses) - 1, _FRAMES).round().astype(int)).tolist()

    def draw(k: int) -> None:
        axes.clear()
        shades = None if colors is None or tensions is None else colors.to_rgba(tensions[k])
        draw_arm(axes, poses[k], shades)
        frame_arms(axes, limits)
        heading(figure, f"{poses[0].arm.name}, posture {k} of {len(poses) - 1}")

    def fill(aside: Path) -> None:
        writer = PillowWriter(fps=_RATE)
        with writer.saving(figure, aside, SCREEN):
            for k in chosen:
                draw(k)
                writer.grab_frame()

    draw(0)
    fill_canvas(axes, 1.0 if colors is None else BESIDE_BAR)
    write_file(path, fill)

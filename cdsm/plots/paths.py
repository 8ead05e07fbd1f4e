"""Plot an arm along a path, as a film too, in its natural modes; and the forces at its tip."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from cdsm.errors import InvalidInput
from cdsm.planning.path_plan import PathPlan
from cdsm.plots import style
from cdsm.plots.arm import draw_arm, draw_bones
from cdsm.plots.projection import VIEW, Drawing
from cdsm.posture import Posture
from cdsm.support.files import as_path, write_file
from cdsm.support.validation import instance, number_array
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.control.plants import PlantState
    from cdsm.measures.polytope import ForcePolytope
    from cdsm.statics.modes import Modes

_GHOSTS = 5  # number of postures that are drawn over each other
_FRAMES = 150  # largest number of frames of a film, and frames per second
_RATE = 15
_SHAPES = 3  # number of modes that are drawn
_DEFLECTED = 0.25  # largest displacement of the tip in the picture of a mode, over the arm's length


@style.styled
def plot_path(
    path: PathPlan | Sequence[Posture | PlantState],
    ax: Axes | None = None,
    *,
    animate: str | os.PathLike[str] | None = None,
    tensions: ArrayLike | None = None,
    view: ArrayLike = VIEW,
    title: str | None = None,
) -> Axes:
    """Plot some postures of a path over each other, from pale to dark, with the way of the tip.

    Args:
        path: Postures of one arm, in order, or states with a ``pose``, as of a tracking run; or a
            plan, of which the feasible samples are drawn.
        ax: Ordinary axes to draw on; None: a new figure of one column.
        animate: A ``.gif`` to write too: the arm follows the path, with cables coloured by tension.
        tensions: Tensions (P, C) [N] for the colours at P postures; default: those of a plan.
        view: Elevation and azimuth of the eye [deg].
        title: Title; None: the arm's name and the question.

    Raises:
        InvalidInput: ``path`` has no postures of one arm, or ``animate`` does not end in ``.gif``.
        FileError: The film cannot be written.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> poses = [arm.at([0.02 * i] * 10) for i in range(5)]
        >>> cdsm.plots.plot_path(poses).get_title(loc="left")
        'virtual_prototype: which way does it go?'
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
    values = None if tensions is None else number_array("tensions", tensions)
    if values is not None and values.shape != (len(poses), len(poses[0].arm.cables)):
        problem = f"shape {values.shape} given; {len(poses)} postures of "
        raise InvalidInput("tensions", f"{problem}{len(poses[0].arm.cables)} cables are drawn.")
    panel = style.panel(ax, 2.2)
    drawing = Drawing(panel, view, poses[0].arm.length)
    *ghosts, last = _some(len(poses), _GHOSTS)
    for k, shade in zip(ghosts, np.linspace(0.86, 0.7, len(ghosts)), strict=True):
        draw_bones(drawing, poses[k], f"{shade:.2f}", f"ghost:{k}")
    pull = None if values is None else values[last]
    colors = None if values is None else style.tension_colors(values)
    draw_arm(drawing, poses[last], pull, colors)
    _draw_way(drawing, poses)
    drawing.finish(fit=ax is None)
    if colors is not None:
        style.color_bar_beside(panel, colors, "N")
    count = f"the last of {len(poses)} postures, others pale"
    style.write_note(panel, f"{count}; red: way of the tip", color=style.SOFT)
    style.set_title(panel, title, f"{poses[0].arm.name}: which way does it go?")
    if animate is not None:
        _write_film(animate, poses, values, view)
    return panel


def _draw_way(drawing: Drawing, poses: Sequence[Posture]) -> None:
    """Draw the way of the tip, and its end."""
    tips = drawing.flat(np.array([pose.tip[:3, 3] for pose in poses]))
    red = style.VERMILLION
    drawing.ax.plot(*tips.T, color=red, lw=1.2, zorder=6, gid="way")
    drawing.ax.plot(*tips[-1], "o", color=red, ms=3.0, zorder=6.1)


def _write_film(
    path: str | os.PathLike[str], poses: Sequence[Posture], tensions: Array | None, view: ArrayLike
) -> None:
    """Write a GIF of up to 150 postures, coloured by tension, in one window."""
    if as_path(path).suffix.lower() != ".gif":
        raise InvalidInput("animate", f"{str(path)!r} given; it must end in .gif.")
    frames = _some(len(poses), _FRAMES)
    panel = style.panel(None, 2.2)
    colors = None if tensions is None else style.tension_colors(tensions)
    drawing = Drawing(panel, view, poses[0].arm.length)
    for k in frames:
        draw_arm(drawing, poses[k])
    drawing.finish(fit=True)
    if colors is not None:
        style.color_bar_beside(panel, colors, "N")
    style.set_title(panel, " ", "")
    figure = style.figure_of(panel)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # all frames have the window of the first

    def draw(k: int) -> None:
        for artist in [*panel.lines, *panel.patches]:
            artist.remove()
        frame = Drawing(panel, view, poses[0].arm.length)
        draw_arm(frame, poses[k], None if tensions is None else tensions[k], colors)
        _draw_way(frame, poses[: k + 1])
        style.set_title(panel, f"{poses[0].arm.name}, posture {k} of {len(poses) - 1}", "")

    film: Any = FuncAnimation(figure, draw, frames, init_func=lambda: None)
    write_file(path, lambda aside: film.save(aside, PillowWriter(_RATE), dpi=figure.dpi))


def _some(count: int, most: int) -> list[int]:
    """Return up to ``most`` of ``count`` indices, evenly spaced, with both ends."""
    return sorted({round(k) for k in np.linspace(0, count - 1, most).tolist()})


@style.styled
def plot_modes(
    modes: Modes, ax: Axes | None = None, *, view: ArrayLike = VIEW, title: str | None = None
) -> Axes:
    """Plot an arm in mm, deflected by up to three modes: growing modes first, then the lowest."""
    pose = modes.stiffness.posture
    panel = style.panel(ax, 2.2)
    drawing = Drawing(panel, view, pose.arm.length)
    draw_arm(drawing, pose)
    for line in panel.lines:
        line.set_alpha(0.35)
    # numbers tell modes apart whose rates print alike
    names = [f"growth {k}, {rate:.3g}/s" for k, rate in enumerate(modes.growth_rates, 1)]
    names += [f"mode {k}, {frequency:.3g} Hz" for k, frequency in enumerate(modes.frequencies, 1)]
    shapes = np.hstack([modes.growth_shapes, modes.shapes]).T
    for shape, name, color in zip(shapes, names, style.COLORS[:_SHAPES], strict=False):
        moved = np.linalg.norm(pose.jacobian[:3] @ shape) / pose.arm.length
        step = _DEFLECTED / max(moved, np.linalg.norm(shape)) * shape
        bent = pose.arm.at(pose.q + step, check_limits=False)
        for k, bone in enumerate(bent.bones):
            ends = drawing.flat(bone).T
            panel.plot(*ends, color=color, lw=1.6, zorder=5, gid=f"mode:{name}:{k}")
        panel.plot([], [], color=color, label=name)
    drawing.finish(fit=ax is None)
    narrow = {"ncols": 3, "columnspacing": 1.0, "handlelength": 1.5}
    panel.legend(loc="upper left", bbox_to_anchor=(0.0, 0.0), **narrow)
    style.set_title(panel, title, f"{pose.arm.name}: how does it swing? Enlarged", modes.is_stable)
    return panel


@style.styled
def plot_force_polytope(
    polytope: ForcePolytope,
    ax: Axes | None = None,
    *,
    view: ArrayLike = VIEW,
    title: str | None = None,
) -> Axes:
    """Plot the tip forces [N] that the cables can balance: all within the outline, seen from afar.

    Edges towards the eye are drawn, and the force in the worst direction.

    Raises:
        InvalidInput: The forces have no volume.
    """
    if not len(polytope.faces):
        raise InvalidInput(
            "polytope", "has no surface in three dimensions to draw; bend the arm, or add cables."
        )
    panel = style.panel(ax, 2.4)
    size = float(np.linalg.norm(np.ptp(polytope.vertices, axis=0)))
    drawing = Drawing(panel, view, size, unit=1.0)
    corners = drawing.flat(polytope.vertices)
    outline = corners[ConvexHull(corners).vertices]
    shape = Polygon(outline, closed=True, fc=to_rgba(style.SKY, 0.25), ec=style.BLUE, lw=0.9)
    shape.set_gid("outline")
    panel.add_patch(shape)
    edges = LineCollection(list(_front_edges(polytope, drawing.rows, corners)), zorder=2)
    edges.set(color=style.BLUE, linewidth=0.35, alpha=0.7, gid="edges")
    panel.add_collection(edges)
    worst = drawing.flat(np.array([np.zeros(3), polytope.radius * polytope.worst_direction]))
    panel.plot(*worst.T, color=style.VERMILLION, lw=1.4, zorder=4, gid="worst")
    panel.plot(*worst[0], "+", color=style.BLACK, ms=7, zorder=5, gid="no load")
    drawing.finish("N", fit=ax is None)
    words = f"red: {polytope.radius:.4g} N in the worst direction; cross: no load"
    style.write_note(panel, words, color=style.VERMILLION)
    style.set_title(panel, title, f"{polytope.posture.arm.name}: which forces can its tip bear?")
    return panel


def _front_edges(polytope: ForcePolytope, rows: Array, corners: Array) -> Any:
    """Yield the edges (2, 2) of the faces towards the eye, but none within a flat face."""
    middle = polytope.vertices.mean(axis=0)
    normals: dict[tuple[int, int], list[Array]] = {}
    for face in polytope.faces:
        a, b, c = polytope.vertices[face]
        normal = np.cross(b - a, c - a)
        normal = normal / np.linalg.norm(normal) * np.sign(normal @ (a - middle) or 1.0)
        for start, end in ((0, 1), (1, 2), (2, 0)):
            edge = min(face[start], face[end]), max(face[start], face[end])
            normals.setdefault(edge, []).append(normal)
    for edge, sides in normals.items():
        flat = len(sides) == 2 and sides[0] @ sides[1] > 1.0 - 1e-9
        if not flat and any(normal @ rows[2] > 0.0 for normal in sides):
            yield corners[list(edge)]

"""Plot an arm at a posture, or several beside each other."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgb
from matplotlib.patches import FancyArrowPatch, Polygon
from numpy.typing import ArrayLike

from cdsm.applied import Applied, PlacedForce, placed_forces
from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike, has_loads, loads_of
from cdsm.manipulator import Manipulator
from cdsm.plots import style
from cdsm.plots.projection import VIEW, Drawing
from cdsm.plots.style import MM, Panels
from cdsm.posture import Posture
from cdsm.statics.equilibrium import Equilibrium
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.validation import instance, vector
from cdsm.support.values import Array
from cdsm.tension import Tension

TURN: Final = np.linspace(0.0, 2.0 * np.pi, 73)
_CIRCLE: Final = np.array([np.cos(TURN), np.sin(TURN)])

_MANY_DISKS = 16  # of more, the plates are fainter
_MANY_BONES = 30  # of more, the tube is thinner
_LARGEST_MOVE = 0.3  # of a tip over the arm's length; beyond, its reference is not drawn
_MOVED = 0.2  # largest half axis of a drawn compliance, over the arm's length
_ARROW = 0.22  # length of a drawn force, over the arm's length
_NOTES = 3  # most lines of a warning below the picture
_CHARACTERS = 68  # of such a line


class Scene(NamedTuple):
    """What is drawn of an arm at one posture."""

    pose: Posture
    tension: Array | None  # F (C,) [N]
    forces: list[PlacedForce]
    compliance: Array | None  # of the tip (6, 6), None if not asked for or not stable
    warnings: tuple[str, ...]  # why numbers mean little
    before: Posture | None  # drawn pale below


@style.styled
def plot_arm(
    pose: Posture | Equilibrium,
    tension: Tension | ArrayLike | None = None,
    stiffness: Stiffness | None = None,
    ax: Axes | None = None,
    *,
    view: ArrayLike = VIEW,
    limits: tuple[float, float] | None = None,
    bar: bool = True,
    force: LoadsLike | None = None,
    scale: float | None = None,
    names: bool = False,
    triad: bool = True,
    warnings: bool = True,
    title: str | None = None,
) -> Axes:
    """Plot an arm in mm: backbone, disks, cables, how a load moves its tip; return the axes.

    Disks are plates; those of links that overlap are red. A robot from a URDF has no disks. Its
    joints are drawn instead, circles are revolute and squares prismatic, and a thin line joins each
    cable site to its link.

    Args:
        pose: Posture to draw, or an equilibrium, which brings its tensions, compliance and load; if
            its tip moved by less than 0.3 of the arm's length, its reference is drawn pale below.
        tension: Tensions, or F (C,) [N], that colour the cables. Slack cables are dashed.
        stiffness: Its compliance is drawn at the tip: the outline of the displacements `C_vv f`
            under forces f of 1 N, or of a power of ten below that. Of an unstable arm the note says
            so.
        ax: Ordinary axes to draw on; None: a new figure of one column.
        view: Elevation and azimuth of the eye [deg].
        limits: Tensions [N] at the ends of the colours; None: the smallest and the largest.
        bar: Whether to draw the colour bar of the tensions.
        force: Force (3,) [N] at the tip, or loads on links as for
            :func:`~cdsm.distribute_tension`, drawn as arrows with their sizes; None: those of the
            stiffness or the equilibrium. The loads that belong to the arm are always drawn.
        scale: By which displacements of the outline are enlarged; None: a round number.
        names: Whether to write the names of the cables at their ends.
        triad: Whether to draw the base axes.
        warnings: Whether to write the warnings of the stiffness or the equilibrium below the arm.
        title: Title; None: the arm's name and the question that the picture answers.

    Raises:
        InvalidInput: An argument has the wrong type, or belongs to another arm or posture.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> ax = cdsm.plots.plot_arm(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> ax.get_title(loc="left")
        'virtual_prototype: how hard do its cables pull?'
    """
    scene = _scene(pose, tension, stiffness, force)
    panel = style.panel(ax, 2.2)
    length = scene.pose.arm.length
    drawing = Drawing(panel, view, length)
    if scene.before is not None:
        draw_ghost(drawing, scene.before)
    colors = None if scene.tension is None else style.tension_colors(scene.tension, limits)
    draw_arm(drawing, scene.pose, scene.tension, colors)
    if names:
        _draw_names(drawing, scene.pose)
    notes: list[tuple[str, str]] = []
    if scene.compliance is not None:
        notes.append((draw_compliance(drawing, scene, scale), style.VERMILLION))
    draw_force(drawing, scene)
    drawing.finish(triad=triad, fit=ax is None)
    style.set_title(panel, title, f"{scene.pose.arm.name}: {_question(scene)}")
    if scene.tension is not None:
        slack = scene.tension <= style.slack_below(scene.tension)
        if slack.any():
            words = f"dashed: {slack.sum()} of {slack.size} cables are slack"
            notes.append((words, style.SOFT))
        if bar and colors is not None and not slack.all():
            style.color_bar_beside(panel, colors, "N")
    if scene.before is not None:
        notes.append(("pale: the reference, at which the motors were locked", style.SOFT))
    for warning in scene.warnings if warnings else ():
        lines = textwrap.wrap(warning, _CHARACTERS, max_lines=_NOTES, placeholder=" …")
        notes += [(line, style.VERMILLION) for line in lines]
    for line, (text, color) in enumerate(notes):
        style.write_note(panel, text, line, color)
    return panel


@style.styled
def plot_arms(
    cases: Sequence[tuple[Any, ...]],
    axs: Panels | Sequence[Axes] | None = None,
    *,
    view: ArrayLike = VIEW,
    **options: Any,
) -> Panels:
    """Plot arms beside each other with one scale of mm, of tensions and of displacements.

    Args:
        cases: Of each arm (pose, tension, stiffness, title), of which all but the first may be
            None or missing; as in :func:`plot_arm`.
        axs: Ordinary axes, one or more for each case; None: a new figure of two columns.
        view: Elevation and azimuth of the eye [deg].
        **options: Other options of :func:`plot_arm`.

    Raises:
        InvalidInput: As :func:`plot_arm`; or there are no cases, or too few axes.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> panels = cdsm.plots.plot_arms([(arm.at([0.0] * 10),), (arm.at([0.1] * 10),)])
        >>> panels.size
        2
    """
    if not isinstance(cases, (list, tuple)) or not cases:
        problem = f"{cases!r} given; give a list of (posture, tension, stiffness, title), one or "
        raise InvalidInput("cases", f"{problem}more, of which all but the posture may be left out.")
    rows = [(*case, None, None, None)[:4] for case in cases]
    scenes = [_scene(pose, tension, stiffness) for pose, tension, stiffness, _ in rows]
    chosen = style.panels(axs, len(rows), height=2.4)
    every = np.concatenate(
        [np.zeros(0), *(scene.tension for scene in scenes if scene.tension is not None)]
    )
    limits = style.tension_colors(every).get_clim()
    moves = [
        np.linalg.norm(scene.compliance[:3, :3], 2)
        for scene in scenes
        if scene.compliance is not None
    ]
    length = max(scene.pose.arm.length for scene in scenes)
    shared: dict[str, Any] = {"view": view, "limits": limits if every.size else None}
    if moves and max(moves) > 0.0:
        shared["scale"] = _scale(float(max(moves)), length)[1]
    for k, (ax, (pose, tension, stiffness, title)) in enumerate(zip(chosen, rows, strict=True)):
        ends: dict[str, Any] = {"bar": k == len(rows) - 1, "triad": k == 0}
        plot_arm(pose, tension, stiffness, ax, title=title, **{**shared, **ends, **options})
    for limit in ("xlim", "ylim"):
        ranges = [getattr(ax, f"get_{limit}")() for ax in chosen]
        half = max(high - low for low, high in ranges) / 2.0
        for ax, (low, high) in zip(chosen, ranges, strict=True):
            ax.set(**{limit: ((low + high) / 2.0 - half, (low + high) / 2.0 + half)})
    return chosen


def _scene(
    pose: object, tension: object, stiffness: object, force: LoadsLike | None = None
) -> Scene:
    """Check the arguments of :func:`plot_arm`, and return what they ask to draw."""
    before = compliance = None
    warnings: tuple[str, ...] = ()
    applied: Applied = np.zeros(6)
    if isinstance(pose, Equilibrium):
        rest = pose
        pose = rest.pose
        near = 0.0 < rest.moved < _LARGEST_MOVE * pose.arm.length
        before = rest.reference if near else None
        tension = rest.tension if tension is None else tension
        applied = rest.applied
        warnings = rest.warnings
        compliance = rest.compliance if rest.stable and stiffness is None else None
    instance("pose", pose, Posture)
    assert isinstance(pose, Posture)
    if stiffness is not None:
        instance("stiffness", stiffness, Stiffness)
        assert isinstance(stiffness, Stiffness)
        K = stiffness
        if not K.posture.equals(pose):
            problem = "belongs to another posture or arm; compute it for this one."
            raise InvalidInput("stiffness", problem)
        applied = K.applied
        warnings = (*warnings, *K.warnings)
        compliance = K.compliance if K.is_stable else None
    if isinstance(tension, Tension) and tension.posture.arm != pose.arm:
        raise InvalidInput("tension", "belongs to another arm than the posture.")
    values = None
    if tension is not None:
        values = vector("tension", np.asarray(tension), len(pose.arm.cables), "one [N] per cable")
    if has_loads(force):
        applied = loads_of(pose.arm, force, "force")
    elif force is not None:
        tip = vector("force", force, 3, "a force [N] in base axes")  # type: ignore[arg-type]
        applied = np.concatenate([tip, np.zeros(3)])
    forces = placed_forces(pose, applied)
    return Scene(pose, values, forces, compliance, warnings, before)


def _question(scene: Scene) -> str:
    if scene.before is not None:
        return "where does it come to rest?"
    if scene.compliance is not None:
        return "how far does a load move its tip?"
    return "how does it stand?" if scene.tension is None else "how hard do its cables pull?"


def draw_ghost(drawing: Drawing, pose: Posture, shade: str = "0.86") -> None:
    """Draw an arm as pale lines, below another one."""
    for path in pose.cable_paths:
        drawing.ax.plot(*drawing.flat(path).T, color=shade, lw=0.5, zorder=1)
    draw_bones(drawing, pose, shade, "ghost")


def draw_bones(drawing: Drawing, pose: Posture, color: str, name: str) -> None:
    """Draw the links of an arm as thick lines of one colour between its joints."""
    width = 3.0 if len(pose.bones) < _MANY_BONES else 1.8
    for k, bone in enumerate(pose.bones):
        line = drawing.flat(bone).T
        drawing.ax.plot(*line, color=color, lw=width, zorder=1.2, gid=f"{name}:{k}")


def draw_arm(
    drawing: Drawing,
    pose: Posture,
    tension: Array | None = None,
    colors: ScalarMappable | None = None,
) -> None:
    """Draw backbone, disks or joints, and cables, coloured by tension (C,) [N]."""
    if pose.arm.is_serpentine:
        _draw_disks(drawing, pose)
    else:
        _draw_joints(drawing, pose)
    width = 3.5 if len(pose.bones) < _MANY_BONES else 2.0
    for k, bone in enumerate(pose.bones):
        line = drawing.flat(bone).T
        drawing.ax.plot(*line, color="0.55", lw=width + 0.9, zorder=1.5)
        drawing.ax.plot(*line, color="0.8", lw=width, zorder=1.6, gid=f"bone:{k}")
    if pose.wrapping:  # pulleys; dashed where the cable does not touch
        for k, (rim, touches) in enumerate(
            zip(pose.wrapping.rims, pose.wrapping.touches, strict=True)
        ):
            look: dict[str, Any] = {"color": "0.45", "lw": 0.7, "ls": "-" if touches else "--"}
            drawing.ax.plot(
                *drawing.flat(rim).T, zorder=drawing.layer(rim), gid=f"pulley:{k}", **look
            )
    pull = np.full(len(pose.arm.cables), np.nan) if tension is None else tension
    slack = pull <= style.slack_below(pull)
    for name, path, F, is_slack in zip(
        pose.arm.cables.names, pose.cable_paths, pull, slack, strict=True
    ):
        color: Any = style.SKY if colors is None else colors.to_rgba(F)
        _draw_cable(drawing, path, f"cable:{name}", None if is_slack else color, colors is not None)


def _draw_cable(drawing: Drawing, path: Array, name: str, color: Any, wide: bool) -> None:
    """Draw a cable segment by segment; one without a colour is slack, and dashed."""
    look: dict[str, Any] = {"color": color, "lw": 1.3 if wide else 0.8}
    if color is None:
        look = {"color": "0.35", "ls": (0, (2.0, 1.8)), "lw": 0.8}
    for k, segment in enumerate(drawing.flat(path[i : i + 2]) for i in range(len(path) - 1)):
        layer = drawing.layer(path[k : k + 2])
        if wide and color is not None:
            # a white rim shows which of two crossing cables is in front
            rim = segment.mean(axis=0) + 0.8 * (segment - segment.mean(axis=0))
            drawing.ax.plot(*rim.T, color="white", lw=2.5, solid_capstyle="butt", zorder=layer)
        drawing.ax.plot(*segment.T, zorder=layer + 1e-3, gid=f"{name}:{k}", **look)


def _draw_disks(drawing: Drawing, pose: Posture) -> None:
    disks = list(pose.arm.geometry.disks)
    touching = {link for pair in pose.self_contacts for link in pair}
    for disk in disks:
        placement = pose.link_pose(disk.link)
        ring = np.c_[0.0 * TURN + disk.x, disk.radius * _CIRCLE.T]
        rim = placement[:3, 3] + ring @ placement[:3, :3].T
        look: dict[str, Any] = {"fc": (*to_rgb("0.72"), 0.32), "ec": "0.5", "lw": 0.5}
        if len(disks) > _MANY_DISKS:
            look["fc"] = (*to_rgb("0.72"), 0.22)
        layer = drawing.layer(rim)
        if disk.link == disks[0].link:
            look |= {"ec": "0.25", "lw": 0.8}
        if disk.link in touching:
            look = {"fc": (*to_rgb(style.VERMILLION), 0.5), "ec": style.VERMILLION, "lw": 1.2}
            layer += 2.0
        plate = Polygon(drawing.flat(rim), closed=True, zorder=layer, **look)
        plate.set_gid(f"disk:{disk.index}")
        drawing.ax.add_patch(plate)


def _draw_joints(drawing: Drawing, pose: Posture) -> None:
    for bracket in pose.brackets:  # from cable sites to their links
        layer = drawing.layer(bracket)
        drawing.ax.plot(*drawing.flat(bracket).T, color="0.65", lw=0.7, zorder=layer)
    slides = np.asarray(pose.arm.slides)
    look: dict[str, Any] = {"ls": "", "mfc": "white", "mec": "0.25", "mew": 0.8, "ms": 4.5}
    for marker, name, chosen in (("o", "turns", ~slides), ("s", "slides", slides)):
        if chosen.any():
            points = drawing.flat(pose.joint_positions[chosen]).T
            drawing.ax.plot(*points, marker, zorder=5, gid=f"joints:{name}", **look)


def _draw_names(drawing: Drawing, pose: Posture) -> None:
    for name, path in zip(pose.arm.cables.names, pose.cable_paths, strict=True):
        x, y = drawing.flat(path[-1])
        look: dict[str, Any] = {"fontsize": style.NOTE_SIZE, "color": "0.3", "zorder": 8}
        drawing.ax.annotate(name, (x, y), xytext=(2, 2), textcoords="offset points", **look)


def draw_compliance(drawing: Drawing, scene: Scene, scale: float | None) -> str:
    """Draw where a force in any direction moves the tip, and return the words below the picture.

    The outline of an ellipsoid C f, |f| = 1, under an orthographic projection P is an ellipse: its
    half axes are the square roots of the eigenvalues of P C Cᵀ Pᵀ.
    """
    assert scene.compliance is not None
    C = scene.compliance[:3, :3]
    axes, moves, _ = np.linalg.svd(C)
    if moves[0] == 0.0:
        return "no load moves its tip"
    force, enlarged = _scale(float(moves[0]), scene.pose.arm.length)
    enlarged = enlarged if scale is None else scale
    tip = drawing.flat(scene.pose.tip[:3, 3])
    half = enlarged * force * drawing.unit * (drawing.rows[:2] @ axes * moves)  # (2, 3)
    values, vectors = np.linalg.eigh(half @ half.T)
    outline = tip + (vectors * np.sqrt(np.maximum(values, 0.0)) @ _CIRCLE).T
    drawing.include(outline)
    look: dict[str, Any] = {"fc": (*to_rgb(style.VERMILLION), 0.18), "ec": style.VERMILLION}
    edge = Polygon(outline, closed=True, lw=0.8, zorder=6, **look)
    edge.set_gid("compliance")
    drawing.ax.add_patch(edge)
    for axis in half.T:
        ends = np.array([tip - axis, tip + axis]).T
        drawing.ax.plot(*ends, color=style.VERMILLION, lw=0.5, alpha=0.8, zorder=6.1)
    times = "" if enlarged == 1.0 else f", drawn × {enlarged:g}"
    size = f"{force:g} N" if force > 1e-3 else f"{1e3 * force:g} mN"
    return f"{size} moves it by up to {_length(MM * force * moves[0])}{times}"


def draw_force(drawing: Drawing, scene: Scene) -> None:
    """Draw the tip, and the forces on it and on links as arrows with their sizes."""
    tip = scene.pose.tip[:3, 3]
    drawing.ax.plot(*drawing.flat(tip), "o", ms=2.5, color=style.INK, zorder=6.5, gid="tip")
    for load in scene.forces:
        at_tip = load.link == scene.pose.arm.tip_link
        _draw_arrow(drawing, load, scene.pose, "force" if at_tip else f"force:{load.link}")


def arrow_of(load: PlacedForce, arm: Manipulator) -> tuple[Array, Array, str]:
    """Return both ends (3,) [m] of the arrow of a force, and its size in words.

    All arrows have one length, so that none hides behind a disk.
    """
    size = float(np.linalg.norm(load.force))
    end = load.place + _ARROW * arm.length * load.force / size
    return load.place, end, f"{size:.3g} N"


def _draw_arrow(drawing: Drawing, load: PlacedForce, pose: Posture, gid: str) -> None:
    *ends, size = arrow_of(load, pose.arm)
    start, end = map(drawing.flat, ends)
    look: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 7, "lw": 1.4, "zorder": 7}
    look |= {"color": style.PURPLE, "shrinkA": 0, "shrinkB": 0}
    arrow = FancyArrowPatch(tuple(start), tuple(end), **look)
    arrow.set_gid(gid)
    drawing.ax.add_patch(arrow)
    right = end[0] >= start[0]
    look = {"fontsize": 7, "color": style.DARK[style.PURPLE], "va": "center", "zorder": 8}
    look |= {"xytext": (3 if right else -3, 0), "textcoords": "offset points"}
    drawing.ax.annotate(size, tuple(end), ha="left" if right else "right", **look)


def _scale(longest: float, length: float) -> tuple[float, float]:
    """Return the force [N] of a drawn compliance, and by how much displacements are enlarged.

    ``longest`` is the largest displacement per force [m/N], ``length`` that of the arm [m].
    """
    most = _MOVED * length
    force = 10.0 ** min(0.0, math.floor(math.log10(most / longest)))
    return force, style.round_number(most / (force * longest))


def _length(millimetres: float) -> str:
    return f"{millimetres:.2g} mm" if millimetres < 99.5 else f"{millimetres:.0f} mm"

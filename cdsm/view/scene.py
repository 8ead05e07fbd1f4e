"""Draw the arm in 3D. Its scene nodes in viser are made once, then moved and recoloured."""

from __future__ import annotations

import logging
import math
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CableError, UrdfError
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import ELLIPSOID_GRID
from cdsm.posture import Posture
from cdsm.support.values import Array
from cdsm.view.cable_names import CableNames
from cdsm.view.camera import Ball, Cameras
from cdsm.view.state import ELLIPSOID, FORCE, GREY, SLIDES, STICKS, Condition, Shown
from cdsm.view.surroundings import draw_surroundings

if TYPE_CHECKING:
    import viser

_LOG = logging.getLogger(__name__)

_BODY = "/arm"
_STICK: Final = (40, 40, 45)
_NOTHING: Final = np.zeros((1, 2, 3))
_ABOVE = 0.1  # height of the label above the tip, as a fraction of the arm's length


class Scene:
    """3D scene with an arm in a viser server.

    Pinocchio's visualiser draws links with shapes in the URDF. Other links, or all links if a mesh
    cannot be read, are drawn as sticks between joints. ``force_scale`` [m/N] is the length of the
    force arrow per newton.
    """

    def __init__(self, server: viser.ViserServer, arm: Manipulator, force_scale: float) -> None:
        length, scene = arm.length, server.scene
        self._server, self._force_scale, self._length = server, force_scale, length
        self._path = np.empty((0, 3))
        self._up = np.array([0.0, 0.0, _ABOVE * length])
        body = scene.add_frame(_BODY, show_axes=False)
        cables = scene.add_frame("/cables", show_axes=False)
        try:
            self._shapes = arm._body.visualizer(arm.urdf, server, _BODY)
        except UrdfError as error:
            _LOG.warning("%s Sticks are drawn instead.", error)
            self._shapes = None
        draw_surroundings(server, length)
        thick = partial(scene.add_line_segments, points=_NOTHING, visible=False)
        thin = partial(scene.add_line_segments, points=_NOTHING, thickness_units="screen")
        self._sticks = thick("/sticks", colors=_STICK, thickness=0.012 * length)
        self._brackets = thin("/brackets", colors=GREY, thickness=1.5, visible=False)
        self._reference = thin("/reference", colors=GREY, thickness=2.5, visible=False)
        # one node per cable: viser treats colours of single points as linear light, so they
        # would differ from the colours of the bar
        numbers = range(len(arm.cables))
        self._cables = [thin(f"/cables/{i}", colors=GREY, thickness=2.5) for i in numbers]
        self._sticking = thick("/holes/stick", colors=STICKS, thickness=0.012 * length)
        self._sliding = thick("/holes/slide", colors=SLIDES, thickness=0.018 * length)
        # hidden if there is no posture
        self._parts = (cables,) if self._shapes is None else (body, cables)
        self._ellipsoid = scene.add_mesh_simple(
            "/ellipsoid",
            np.zeros((math.prod(ELLIPSOID_GRID), 3)),
            _faces(*ELLIPSOID_GRID),
            color=ELLIPSOID,
            opacity=0.65,
            side="front",  # the two sides of a flat ellipsoid would flicker
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._force = scene.add_arrows(
            "/force",
            _NOTHING,
            FORCE,
            shaft_radius=0.006 * length,
            head_radius=0.016 * length,
            head_length=0.04 * length,
            visible=False,
        )
        self._label = scene.add_label("/condition", "", anchor="bottom-center", visible=False)
        self.names = CableNames(server)
        self.cameras = Cameras(server, self._ball(_straight(arm)))

    def update(self, shown: Shown, follow: bool) -> None:
        """Draw the results ``shown``; ``follow`` lets the cameras follow the arm."""
        pose, force, ellipsoid = shown.posture, shown.setting.force, shown.ellipsoid
        for part in self._parts:
            part.visible = pose is not None
        self._ellipsoid.visible = ellipsoid is not None
        # an invalid force has no arrow
        pushed = pose is not None and shown.condition is not Condition.INVALID
        self._force.visible = pushed and bool(force.any())
        self._label.visible = pose is not None and shown.condition is not Condition.STABLE
        self._label.text = shown.condition.value
        self.names.update(shown)
        self._draw_lines(shown)
        if pose is None or shown.cable_colors is None:
            return
        tip = pose.tip[:3, 3]
        if self._shapes is not None:
            self._shapes.place(pose.q)
        for cable, path, color in zip(
            self._cables, pose.cable_paths, shown.cable_colors, strict=True
        ):
            cable.points = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            cable.colors = color
        if ellipsoid is not None:
            self._ellipsoid.vertices = ellipsoid.surface.reshape(3, -1).T.astype(np.float32)
        if self._force.visible:
            end = tip + self._force_scale * force
            self._force.points = np.array([[tip, end]], dtype=np.float32)
        self._label.position = tip + self._up
        if follow:
            self.cameras.follow(self._ball(pose))

    def draw_path(self, tips: Array) -> None:
        """Draw a path of the tip (S, 3) [m]; from now on, cameras are fitted to it and the arm."""
        self._path = tips
        lines = np.stack([tips[:-1], tips[1:]], axis=1).astype(np.float32)
        self._server.scene.add_line_segments(
            "/path", lines, FORCE, thickness=1.5, thickness_units="screen"
        )

    def _draw_lines(self, shown: Shown) -> None:
        """Draw links without shapes as sticks, the reference of an arm that sags, and holes."""
        pose, reference = shown.posture, shown.reference
        shaped = frozenset() if self._shapes is None else self._shapes.rows
        bones, brackets = ([], []) if pose is None else pose._stick_figure(shaped)
        before = list(reference.bones) if shown.rest and reference else []
        sticking, sliding = shown.holes
        for node, lines in (
            (self._sticks, bones),
            (self._brackets, brackets),
            (self._reference, before),
            (self._sticking, sticking),
            (self._sliding, sliding),
        ):
            node.visible = len(lines) > 0
            if node.visible:
                node.points = np.array(lines, dtype=np.float32)

    def _ball(self, pose: Posture | None) -> Ball:
        points = np.array([[0.0, 0.0, 0.0], [self._length, 0.0, 0.0]])
        if pose is not None:
            points = np.concatenate([*pose.bones, *pose.cable_paths, self._path])
        return Ball.around(points, least=0.5 * self._length)


def _straight(arm: Manipulator) -> Posture | None:
    """Return the posture with each joint as near zero as its limits allow.

    None if two sites of a cable coincide there.
    """
    try:
        return arm.at(np.clip(np.zeros(arm.nv), arm.lower, arm.upper))
    except CableError:
        return None


def _faces(rows: int, columns: int) -> NDArray[np.uint32]:
    """Return the triangles (n, 3) of a surface through a grid of points, as indices of points.

    The grid has ``rows`` and ``columns`` of points; each of its cells is two triangles.
    """
    points = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[:-1, 1:], points[1:, 1:]
    return np.stack([a, b, c, c, b, d], axis=-1).reshape(-1, 3)

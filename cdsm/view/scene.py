"""Draw the arm in 3D: scene nodes are made once in viser, then moved and recoloured."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CableError, UrdfError
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import ELLIPSOID_GRID
from cdsm.view.state import GREY, Condition, Shown

if TYPE_CHECKING:
    import viser

_LOG = logging.getLogger(__name__)

_BODY = "/arm"
_STICK: Final = (40, 40, 45)
_ELLIPSOID: Final = (200, 85, 61)
_FORCE: Final = (59, 111, 182)
_NOTHING: Final = np.zeros((1, 2, 3))
_ABOVE = 0.1
"""Height of the label above the tip, as a fraction of the arm's length."""


class Scene:
    """An arm in a viser server.

    Pinocchio's visualiser draws the links from the shapes in the URDF. If the URDF has no shapes,
    or a mesh cannot be read, straight sticks join the joints. The arrow of ``largest_force`` [N]
    is half as long as the arm.
    """

    def __init__(self, server: viser.ViserServer, arm: Manipulator, largest_force: float) -> None:
        length, scene = arm.length, server.scene
        self._server, self._reach = server, 0.5 * length / largest_force
        self._up = np.array([0.0, 0.0, _ABOVE * length])
        body = scene.add_frame(_BODY, show_axes=False)
        cables = scene.add_frame("/cables", show_axes=False)
        try:
            self._place = arm._model.body.visualizer(arm.urdf, server, _BODY)
        except UrdfError as error:
            _LOG.warning("%s Sticks are drawn instead.", error)
            self._place = None
        # an environment map and shadows take seconds without a GPU
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_ambient("/light", intensity=2.0)
        scene.add_frame("/base", axes_length=0.15 * length, axes_radius=0.004 * length)
        for axis, name in zip(0.17 * length * np.eye(3), "xyz", strict=True):
            scene.add_label(f"/base/{name}", name, position=axis)
        self._sticks = scene.add_line_segments(
            "/sticks", _NOTHING, _STICK, thickness=0.012 * length, visible=False
        )
        # one node per cable: viser treats colours of single points as linear light, so they
        # would differ from the colours of the bar
        self._cables = [
            scene.add_line_segments(
                f"/cables/{i}", _NOTHING, GREY, thickness=2.5, thickness_units="screen"
            )
            for i in range(len(arm.cables))
        ]
        # hidden if there is no posture
        self._parts = (body if self._place is not None else self._sticks, cables)
        self._ellipsoid = scene.add_mesh_simple(
            "/ellipsoid",
            np.zeros((math.prod(ELLIPSOID_GRID), 3)),
            _faces(*ELLIPSOID_GRID),
            color=_ELLIPSOID,
            opacity=0.65,
            side="front",  # the two sides of a flat ellipsoid would flicker
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._force = scene.add_arrows(
            "/force",
            _NOTHING,
            _FORCE,
            shaft_radius=0.006 * length,
            head_radius=0.016 * length,
            head_length=0.04 * length,
            visible=False,
        )
        self._label = scene.add_label("/condition", "", anchor="bottom-center", visible=False)
        self._look(arm)

    def update(self, shown: Shown) -> None:
        """Show these results, and hide everything that they do not have."""
        pose, force, ellipsoid = shown.posture, shown.setting.force, shown.ellipsoid
        for part in self._parts:
            part.visible = pose is not None
        self._ellipsoid.visible = ellipsoid is not None
        # an invalid force has no arrow
        pushed = pose is not None and shown.condition is not Condition.INVALID
        self._force.visible = pushed and bool(force.any())
        self._label.visible = pose is not None and shown.condition is not Condition.STABLE
        self._label.text = shown.condition.value
        if pose is None or shown.cable_colors is None:
            return
        tip = pose.tip[:3, 3]
        if self._place is not None:
            self._place(pose.q)
        else:
            self._sticks.points = np.array(pose.bones, dtype=np.float32)
        for cable, path, color in zip(
            self._cables, pose.cable_paths, shown.cable_colors, strict=True
        ):
            cable.points = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            cable.colors = color
        if ellipsoid is not None:
            self._ellipsoid.vertices = ellipsoid.reshape(3, -1).T.astype(np.float32)
        if self._force.visible:
            self._force.points = np.array([[tip, tip + self._reach * force]], dtype=np.float32)
        self._label.position = tip + self._up

    def _look(self, arm: Manipulator) -> None:
        """Set the first camera: at the side of the arm, a little above it."""
        try:
            straight = arm.at(np.clip(np.zeros(arm.nv), arm.lower, arm.upper))
            points = np.concatenate([*straight.bones, *straight.cable_paths])
        except CableError:  # two sites of a cable coincide at this posture
            points = np.array([[0.0, 0.0, 0.0], [arm.length, 0.0, 0.0]])
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        size = max(float(np.ptp(points, axis=0).max()), arm.length)
        camera = self._server.initial_camera
        camera.look_at, camera.position = middle, middle + size * np.array([0.2, -1.6, 0.6])
        camera.fov = math.radians(45.0)
        camera.near, camera.far = size / 100.0, 100.0 * size


def _faces(rows: int, columns: int) -> NDArray[np.uint32]:
    """Build two triangles for each cell of a grid of points, numbered row by row."""
    points = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[:-1, 1:], points[1:, 1:]
    return np.stack([a, b, c, c, b, d], axis=-1).reshape(-1, 3)

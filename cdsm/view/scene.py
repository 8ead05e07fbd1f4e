"""Draw the arm in 3D. Its scene nodes in viser are made once, then moved and recoloured."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import GeometryError
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import arrow_of
from cdsm.plots.style import round_number
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.view.ellipsoid import ELLIPSOID_GRID
from cdsm.view.state import GREY, Color, Shown

if TYPE_CHECKING:
    import viser

_LOG = logging.getLogger(__name__)

HANDLE: Final = "/target"
"""Name of the scene node that users may drag."""

ELLIPSOID: Final[Color] = (200, 85, 61)
FORCE: Final[Color] = (59, 111, 182)
STICKS: Final[Color] = (40, 40, 45)
SLIDES: Final[Color] = (220, 38, 127)
TOUCHING: Final[Color] = (213, 94, 0)

_CELL: Final[Color] = (235, 235, 235)
_SECTION: Final[Color] = (215, 215, 215)
_NOTHING: Final = np.zeros((1, 2, 3))
_SIDE: Final = np.array([0.3, -2.7, 1.1])  # from the arm to the first camera, over its radius
_FIELD = math.pi / 4.0  # vertical angle of the camera
_SQUARE = 1.05  # width over height of a window below which the arm would not fit
_PHONE = 576  # widest window [pixels] over which viser lays its panel, on the lower 60 %
_FREE_CENTRE = 0.55  # height of the middle of the rest, from the middle of the window to its top
_WIDE = 3.5  # of a cable [pixels]


class Scene:
    """3D scene with an arm in a viser server.

    Pinocchio's visualiser draws links with shapes in the URDF. Other links, or all links if a mesh
    cannot be read, are drawn as sticks between joints.
    """

    def __init__(self, server: viser.ViserServer, arm: Manipulator) -> None:
        self._arm = arm
        self._scene = server.scene
        length = arm.length
        self.cell = round_number(length / 5.0)  # size of a cell of the grid [m]
        self._draw_surroundings()
        # without a posture, what is below these frames is hidden
        frames = [self._scene.add_frame(name, show_axes=False) for name in ("/arm", "/cables")]
        try:
            self._shapes = arm.body.visualizer(arm.urdf, server, "/arm")
        except GeometryError as error:
            _LOG.warning("%s Sticks are drawn instead.", error)
            self._shapes = None
        self._frames = frames if self._shapes else frames[1:]
        self._links = {} if self._shapes is None else self._meshes(self._shapes.nodes)
        self._touching: frozenset[str] = frozenset()
        lines = partial(self._scene.add_line_segments, points=_NOTHING)
        thick = partial(lines, thickness=0.012 * length, visible=False)
        self._thin = thin = partial(lines, thickness_units="screen", colors=GREY, visible=False)
        self._sticks = thick("/sticks", colors=STICKS)
        self._brackets = thin("/brackets", thickness=1.5)
        self._reference = thin("/reference", thickness=2.5)
        self._sticking = thick("/holes/stick", colors=STICKS)
        self._sliding = thick("/holes/slide", colors=SLIDES)
        # one node per cable: viser treats colours of single points as linear light, so they
        # would differ from the colours of the table
        names = [str(i) for i in range(len(arm.cables))]
        self._cables = [thin(f"/cables/{i}", thickness=_WIDE, visible=True) for i in names]
        self._ellipsoid = self._scene.add_mesh_simple(
            "/ellipsoid",
            np.zeros((math.prod(ELLIPSOID_GRID), 3)),
            _faces(*ELLIPSOID_GRID),
            color=ELLIPSOID,
            opacity=0.65,
            side="front",  # the two sides of a flat ellipsoid would flicker
        )
        self._forces = self._scene.add_arrows(
            "/forces",
            _NOTHING,
            FORCE,
            shaft_radius=0.006 * length,
            head_radius=0.016 * length,
            head_length=0.04 * length,
        )
        self._label = self._scene.add_label("/status", "", anchor="bottom-center")
        most = len(arm.own_loads) + 1
        sizes = (f"/forces/{i}" for i in range(most))
        self._sizes = [self._scene.add_label(name, "", visible=False) for name in sizes]
        self._names = [self._scene.add_label(f"/names/{i}", "", visible=False) for i in names]

    def begin(self, camera: viser.InitialCameraConfig, shown: Shown, path: Array) -> None:
        """Draw a path of the tip (S, 3) [m]; place the first camera to show arm and path."""
        if len(path) > 1:
            lines = np.stack([path[:-1], path[1:]], axis=1)
            self._thin("/path", points=lines, colors=FORCE, thickness=1.5, visible=True)
        pose = shown.posture
        length = self._arm.length
        drawn = [*pose.bones, *pose.cable_paths] if pose else [np.eye(2, 3)]
        points = np.concatenate([path, *drawn])
        low = points.min(axis=0)
        high = points.max(axis=0)
        radius = max(float(np.linalg.norm(high - low)), length) / 2.0
        self._centre = (low + high) / 2.0
        self._radius = radius
        camera.look_at = self._centre
        camera.position = self._centre + radius * _SIDE
        camera.fov = _FIELD
        camera.near = radius / 50.0
        camera.far = 200.0 * radius

    def fit(self, camera: viser.CameraHandle) -> None:
        """Show the whole arm in a window that is narrow, above the panel that lies over it."""
        width = camera.image_width
        aspect = width / max(camera.image_height, 1)
        if aspect >= _SQUARE:
            return
        away = self._radius * _SIDE * _SQUARE / max(aspect, 0.1)
        sight = away / np.linalg.norm(away)
        up = np.eye(3)[2] - sight[2] * sight
        up *= math.tan(_FIELD / 2.0) * float(np.linalg.norm(away) / np.linalg.norm(up))
        target = self._centre - (_FREE_CENTRE if width <= _PHONE else 0.0) * up
        camera.position = target + away
        camera.look_at = target

    def update(self, shown: Shown, names: bool) -> None:
        """Draw the results ``shown``; ``names`` labels all cables."""
        pose = shown.posture
        ellipsoid = shown.ellipsoid
        for frame in self._frames:
            frame.visible = pose is not None
        self._ellipsoid.visible = ellipsoid is not None
        self._label.visible = pose is not None and shown.status is not Status.OK
        shaped = frozenset() if self._shapes is None else self._shapes.rows
        bones, brackets = ([], []) if pose is None else pose.stick_figure(shaped)
        if pose is not None and pose.wrapping is not None:  # pulleys that cables touch
            rims = pose.wrapping.rims[pose.wrapping.touches]
            brackets = [*brackets, *np.stack([rims[:, :-1], rims[:, 1:]], axis=2).reshape(-1, 2, 3)]
        before = shown.reference.bones if shown.reference and shown.rest else ()
        for node, lines in (
            (self._sticks, bones),
            (self._brackets, brackets),
            (self._reference, before),
            (self._sticking, shown.holes[0]),
            (self._sliding, shown.holes[1]),
        ):
            node.visible = len(lines) > 0
            node.points = np.array(lines if node.visible else _NOTHING, dtype=np.float32)
        for label in self._names:
            label.visible = names and pose is not None
        self._draw_forces(shown)
        if pose is None:
            return
        if self._shapes is not None:
            self._shapes.place(pose.q)
        self._paint(shown.touching)
        for i, (cable, path) in enumerate(zip(self._cables, pose.cable_paths, strict=True)):
            cable.points = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            cable.colors = np.array(shown.cable_colors[i], dtype=np.uint8)
            tension = "" if shown.tensions is None else f": {shown.tensions[i]:.4g} N"
            self._names[i].text = self._arm.cables[i].name + tension
            self._names[i].position = path[-1]
        if ellipsoid is not None:
            self._ellipsoid.vertices = ellipsoid.surface.reshape(3, -1).T.astype(np.float32)
        tip = pose.tip[:3, 3]
        self._label.text = shown.heading
        self._label.position = tip + 0.1 * self._arm.length * np.eye(3)[2]

    def _draw_forces(self, shown: Shown) -> None:
        """Draw all forces on the arm as arrows with their sizes, as its picture has them."""
        arrows = [arrow_of(load, self._arm) for load in shown.forces]
        self._forces.visible = bool(arrows)
        points = [ends for *ends, _ in arrows] or _NOTHING
        self._forces.points = np.array(points, dtype=np.float32)
        for i, label in enumerate(self._sizes):
            label.visible = i < len(arrows)
            if label.visible:
                _, label.position, label.text = arrows[i]

    def _meshes(self, nodes: Mapping[str, list[str]]) -> dict[str, list[tuple[Any, Any]]]:
        """Return the meshes of each link whose colour can change, with their colours."""
        handles = {
            link: [self._scene.get_handle_by_name(name) for name in names]
            for link, names in nodes.items()
        }
        return {
            link: [(mesh, mesh.color) for mesh in meshes if hasattr(mesh, "color")]  # type: ignore[union-attr]
            for link, meshes in handles.items()
        }

    def _paint(self, touching: frozenset[str]) -> None:
        """Give links that overlap a colour of their own, and others theirs."""
        for link in touching ^ self._touching:
            for mesh, color in self._links.get(link, []):
                mesh.color = TOUCHING if link in touching else color
        self._touching = touching

    def _draw_surroundings(self) -> None:
        scene = self._scene
        length = self._arm.length
        # an environment map and shadows take seconds without a GPU
        scene.configure_environment_map(hdri=None)
        scene.configure_default_lights(cast_shadow=False)
        scene.add_light_ambient("/light", intensity=2.0)
        scene.add_frame("/base", axes_length=0.15 * length, axes_radius=0.004 * length)
        for axis, name in zip(0.17 * length * np.eye(3), "xyz", strict=True):
            scene.add_label(f"/base/{name}", name, position=axis)
        scene.add_grid(
            "/grid",
            2.4 * length,
            2.4 * length,
            position=(0.0, 0.0, -0.4 * length),
            cell_size=self.cell,
            section_size=5.0 * self.cell,
            cell_color=_CELL,  # paler than the cables
            section_color=_SECTION,
            fade_distance=100.0 * length,
        )


def _faces(rows: int, columns: int) -> NDArray[np.uint32]:
    """Return the triangles (n, 3) of a surface through a grid of points, as indices of points."""
    points = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a = points[:-1, :-1]
    b = points[1:, :-1]
    c = points[:-1, 1:]
    d = points[1:, 1:]
    return np.stack([a, b, c, c, b, d], axis=-1).reshape(-1, 3)

"""Read the 3D scene of a live view back, as a browser gets it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cdsm.support.values import Array
from cdsm.view.live_view import View


class Disk(NamedTuple):
    """A shape of a link."""

    centre: Array  # (3,) [m]
    rotation: Array  # (3, 3); its third column is the axis of a cylinder
    radius: float  # largest distance of its points from this axis [m]
    half: float  # and along it
    color: tuple[int, ...]


def node(view: View, name: str) -> Any:
    """Handle of a node of the scene."""
    handle = view._server.scene.get_handle_by_name(name)
    assert handle is not None, f"no node is called {name}"
    return handle


def lines(view: View, name: str) -> Array:
    """Lines (n, 2, 3) [m] of a node; none if it is hidden."""
    handle = node(view, name)
    return np.array(handle.points, float) if handle.visible else np.empty((0, 2, 3))


def cable(view: View, name: str) -> tuple[Array, tuple[int, ...]]:
    """Points (n, 3) [m] along a cable, and its colour."""
    handle = node(view, f"/cables/{view.arm.cables.names.index(name)}")
    segments = np.array(handle.points, float)
    np.testing.assert_array_equal(segments[1:, 0], segments[:-1, 1])  # one polyline
    colors = np.reshape(np.broadcast_to(handle.colors, segments.shape), (-1, 3))
    assert (colors == colors[0]).all()
    return np.vstack([segments[:, 0], segments[-1:, 1]]), tuple(colors[0].tolist())


def shapes(view: View, link: str) -> list[Disk]:
    """The shapes of a link."""
    found = []
    while handle := view._server.scene.get_handle_by_name(f"/arm/visual/{link}_{len(found)}"):
        w, x, y, z = handle.wxyz
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        radius = float(np.hypot(*handle.vertices.T[:2]).max())
        half = float(abs(handle.vertices[:, 2]).max())
        found.append(Disk(np.array(handle.position), rotation, radius, half, tuple(handle.color)))
    return found


def arrow(view: View) -> Array | None:
    """Start and end (2, 3) [m] of the first arrow of a force; None if there is none."""
    return next(iter(arrows(view).values()), None)


def arrows(view: View) -> dict[str, Array]:
    """Start and end (2, 3) [m] of the arrows of all forces by their texts, which stand at ends."""
    handle = node(view, "/forces")
    found = {}
    for i in range(len(view.arm.own_loads) + 1):
        size = node(view, f"/forces/{i}")
        if size.visible:
            found[size.text] = np.array(handle.points, float)[i]
            np.testing.assert_allclose(size.position, found[size.text][1], atol=1e-6)
    assert handle.visible == bool(found)
    return found


def ellipsoid(view: View) -> Array | None:
    """Points (n, 3) [m] of the surface of the ellipsoid; None if there is none."""
    handle = node(view, "/ellipsoid")
    return np.array(handle.vertices, float) if handle.visible else None


def label(view: View) -> tuple[str, Array] | None:
    """The text in the scene and its place; None if there is none."""
    handle = node(view, "/status")
    return (handle.text, np.array(handle.position)) if handle.visible else None


def names(view: View) -> dict[str, Array]:
    """Places (3,) [m] of the texts at the cables, by text."""
    handles = [node(view, f"/names/{i}") for i in range(len(view.arm.cables))]
    return {handle.text: np.array(handle.position) for handle in handles if handle.visible}

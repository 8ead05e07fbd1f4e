"""Fit the cameras of all browsers to the arm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self, final

import numpy as np

from cdsm.support.values import Array

if TYPE_CHECKING:
    import viser

_FOV: Final = math.radians(45.0)  # vertical field of view

_FIRST: Final = np.array([0.2, -1.5, 0.75])
"""Direction from the arm to the camera at the start: from its side, a little above it."""

_MARGIN = 1.3  # radius of the visible ball, over the radius of the arm

_OUTSIDE, _SMALL = 1.3, 0.5
"""Limits of the reach of the arm, divided by the radius of the ball to which cameras are fitted.

If the arm reaches farther than the first, or less far than the second, they are fitted again.
"""

_USUAL = 4.0 / 3.0  # width over height of the picture for which the first camera is placed

_PHONE = 576
"""Width in pixels up to which viser shows the panel as a sheet over the lower part of the page."""

_FREE = 0.4  # part of the height of a phone that this sheet leaves free


@final
@dataclass(frozen=True)
class Ball:
    """Ball that cameras must show: middle (3,) [m] and radius [m]."""

    middle: Array
    radius: float

    @classmethod
    def around(cls, points: Array, least: float) -> Self:
        """Build a ball around points (P, 3) [m], with a radius of at least ``least`` [m]."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
        return cls(middle, max(float(np.linalg.norm(points - middle, axis=1).max()), least))

    def fits(self, other: Ball) -> bool:
        """Whether a camera fitted to this ball shows ``other`` completely and large enough."""
        reach = float(np.linalg.norm(other.middle - self.middle)) + other.radius
        return _SMALL * self.radius < reach < _OUTSIDE * self.radius


def placed(ball: Ball, direction: Array, aspect: float, free: float) -> tuple[Array, Array]:
    """Compute position and look-at point [m] of a camera that shows a ball.

    ``direction`` points from the ball to the camera. ``aspect`` is the width of the picture divided
    by its height. The panel leaves only the top fraction ``free`` of the picture's height
    uncovered; the ball is shown there.
    """
    high = math.tan(_FOV / 2.0)
    distance = _MARGIN * ball.radius / min(high * free, high * aspect)
    back = direction / np.linalg.norm(direction)
    up = np.array([0.0, 0.0, 1.0]) - back[2] * back
    size = float(np.linalg.norm(up))
    # the middle of the free part is above the middle of the picture
    shift = (1.0 - free) * distance * high * (up / size if size > 0.0 else up)
    look_at = ball.middle - shift
    return look_at + distance * back, look_at


@dataclass
class _Browser:
    """Picture of a browser: uncovered fraction of its height, size [pixels].

    ``position`` is the camera position [m] to which :class:`Cameras` last moved the camera.
    """

    free: float
    size: tuple[int, int]
    position: Array


class Cameras:
    """Cameras of all browsers, each fitted to show a ball around the arm.

    If a picture is resized, its camera is fitted again, unless the user has moved the camera.
    """

    def __init__(self, server: viser.ViserServer, ball: Ball) -> None:
        self._server, self._ball = server, ball
        self._browsers: dict[int, _Browser] = {}
        self._set_first()
        camera = server.initial_camera
        camera.fov, camera.near, camera.far = _FOV, ball.radius / 50.0, 200.0 * ball.radius
        server.on_client_connect(self._on_connect)
        server.on_client_disconnect(self._on_disconnect)

    def follow(self, ball: Ball) -> None:
        """Fit all cameras to ``ball``, if it is partly outside the present view, or small in it."""
        if not self._ball.fits(ball):
            self._ball = ball
            self._set_first()
            for client in self._server.get_clients().values():
                self.fit(client)

    def fit(self, client: viser.ClientHandle) -> None:
        """Move the camera of ``client`` to show the ball; keep its direction of view."""
        self._place(client, client.camera.position - client.camera.look_at)

    def _place(self, client: viser.ClientHandle, direction: Array) -> None:
        camera = client.camera
        browser = self._browsers.get(client.client_id)
        if browser is None:  # it has just come or gone
            return
        position, look_at = placed(self._ball, direction, camera.aspect, browser.free)
        browser.position = position
        with client.atomic():
            camera.position = position
            camera.look_at = look_at

    def _set_first(self) -> None:
        camera = self._server.initial_camera
        camera.position, camera.look_at = placed(self._ball, _FIRST, _USUAL, 1.0)

    def _on_connect(self, client: viser.ClientHandle) -> None:
        camera = client.camera
        size = camera.image_width, camera.image_height
        phone = camera.image_width <= _PHONE  # viser docks the panel later: this is the whole page
        self._browsers[client.client_id] = _Browser(_FREE if phone else 1.0, size, camera.position)
        camera.on_update(self._on_camera)
        self._place(client, _FIRST)  # the camera may not be where it begins yet

    def _on_disconnect(self, client: viser.ClientHandle) -> None:
        self._browsers.pop(client.client_id, None)

    def _on_camera(self, camera: viser.CameraHandle) -> None:
        browser = self._browsers.get(camera.client.client_id)
        size = camera.image_width, camera.image_height
        if browser is not None and size != browser.size:
            browser.size = size
            if np.allclose(camera.position, browser.position, rtol=1e-4, atol=0.0):
                self.fit(camera.client)

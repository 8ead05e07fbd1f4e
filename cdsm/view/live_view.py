"""Serve a live view: one page for any number of browsers of this machine.

A change of a control computes the results anew, and draws them.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
from collections.abc import Callable
from concurrent import futures
from typing import TYPE_CHECKING, Self, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput, need
from cdsm.kinematics import inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.planning.path import checked_path
from cdsm.plots.style import MM
from cdsm.status import Status
from cdsm.support.validation import checked_quantity, instance, vector, whole_number
from cdsm.support.values import Array
from cdsm.view.panel import Panel
from cdsm.view.scene import HANDLE, Scene
from cdsm.view.state import Setting, Shown, show

if TYPE_CHECKING:
    import viser

_LOG = logging.getLogger(__name__)

_PANEL = 390  # width of the panel in pixels, so that its longest row fits on one line
_SIZE = 0.2  # size of the handle at the tip, over the arm's length
_FASTEST = 30.0  # largest speed of a path, and its first speed [samples/s]
_SPEED = 10.0


def serve(
    arm: Manipulator,
    *,
    port: int = 8080,
    q: ArrayLike | None = None,
    minimum: float = 0.0,
    maximum: float = math.inf,
    force: ArrayLike = (0.0, 0.0, 0.0),
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
) -> View:
    """Serve a live view of an arm: sliders, a 3D picture, and the stiffness.

    The view runs in background threads until it is closed. All browsers share one set of sliders.
    Only this machine can connect, and no web page of another site. To see the view from another
    machine, forward the port: ``ssh -L 8080:localhost:8080 THIS_MACHINE``.

    An arm with springs and fewer cables than joints has sliders of how much wire each motor takes
    in, from straight cables, and :func:`~cdsm.forward_statics` gives its posture; with ``q`` or a
    path it has those of the joints.

    Args:
        arm: The arm; it is not changed.
        port: Port to listen at; 0 for any free port.
        q: Joint angles at the start (nv,) [rad]; by default zero, or the nearest joint limit.
        minimum: Lower bound of all tensions at the start [N].
        maximum: Upper bound of all tensions [N].
        force: Force at the tip at the start, in base axes (3,) [N].
        angles: A path to play, as joint angles (S, nv) [rad]; the arm starts at the first.
        tips: A path to play, as tip positions (S, 3) [m]; give only one kind of path.

    Returns:
        The running view. ``url`` is the address of its page, ``shown`` its present results;
        ``wait()`` waits for Ctrl-C, ``close()`` or the end of a ``with`` block ends it.

    Raises:
        CdsmError: viser is not installed (extra ``[view]``). The installed viser starts its server
            so that other sites cannot be refused.
        InvalidInput: A value has the wrong type or shape, an angle is beyond its limit, or the
            port is not available.
    """
    need("view", "viser")
    from cdsm.view.guard import guarded_server

    straight = np.clip(np.zeros(instance("arm", arm, Manipulator).nv), arm.lower, arm.upper)
    free = q is None and angles is None and tips is None
    pulled = free and arm.has_springs and len(arm.cables) < arm.nv
    path = None if angles is None and tips is None else checked_path(arm, angles, tips)
    route = path if path is None or tips is not None else _tips(arm, path)
    start = Setting(
        q=arm.checked_angles(straight if q is None else q),
        minimum=checked_quantity("minimum", minimum, "tension", zero=True),
        maximum=checked_quantity("maximum", maximum, "tension", infinite=True),
        force=vector("force", force, 3, "force at the tip [N], base axes"),
        pull=np.zeros(len(arm.cables)) if pulled else None,
    )
    with contextlib.redirect_stdout(None):  # viser prints addresses
        server = guarded_server(whole_number("port", port, 0, 65535), arm.name)
    try:
        # viser's share button opens a tunnel to a public server; the guard refuses it
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(_PANEL)
        view = View(arm, start, server)
        if path is not None and route is not None:
            view.add_path(path, route)
    except BaseException:
        server.stop()
        raise
    return view


@final
class View:
    """Running live view of ``arm``, made by :func:`serve`. Close it, or use it in ``with``."""

    def __init__(self, arm: Manipulator, start: Setting, server: viser.ViserServer) -> None:
        self.arm = arm
        self._server = server
        self._closed = threading.Event()
        self._lock = threading.Lock()
        self._thread = futures.ThreadPoolExecutor(1, "cdsm view")
        self._last: futures.Future[None] | None = None
        self._player: Player | None = None
        self._panel = Panel(server.gui, arm, start, self._request)
        self._scene = Scene(server, arm, self._panel.largest_force)
        self._handle = TipHandle(server.scene, arm, self._request)
        self._refresh()
        self._scene.begin(server.initial_camera, self._shown, np.empty((0, 3)))

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{self._server.get_host()}:{self._server.get_port()}"

    @property
    def shown(self) -> Shown:
        """Results on the page, after waiting until all slider moves so far are computed."""
        futures.wait([self._last] if self._last else [])
        return self._shown

    def wait(self) -> None:
        """Wait until the view is closed, or for Ctrl-C."""
        self._closed.wait()

    def close(self) -> None:
        """Stop the server. A second call does nothing."""
        if self._closed.is_set():
            return
        if self._player is not None:
            self._player.paused.set()
        self._thread.shutdown()
        with contextlib.redirect_stdout(None):  # viser prints that it stops
            self._server.stop()
        self._closed.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add_path(self, path: Array, tips: Array) -> None:
        """Draw the tips (S, 3) [m] of a path; add controls that play its joint angles, or tips."""
        go = self._handle.aim if path is tips else self._panel.move

        def show_sample(sample: Array) -> None:
            go(sample)
            _ = self.shown

        show_sample(path[0])
        self._scene.begin(self._server.initial_camera, self._shown, tips)
        self._player = Player(self._server.gui, self._panel, path, show_sample)

    def _request(self) -> None:
        """Request a refresh, from any thread. All requests during one together cause one more."""
        with self._lock, contextlib.suppress(RuntimeError):  # the view is closed
            if self._last is None or self._last.running() or self._last.done():
                self._last = self._thread.submit(self._refresh)

    def _refresh(self) -> None:
        try:
            self._handle.follow(self._panel)
            self._put(show(self.arm, self._panel.setting))
        except Exception as error:  # a bug must not leave outdated numbers on the page
            _LOG.exception("the view cannot show %s", setting := self._panel.setting)
            problem = f"{type(error).__name__}: {error}"
            self._put(Shown(setting=setting, status=Status.FAILED, problem=problem))

    def _put(self, shown: Shown) -> None:
        with self._server.atomic():
            self._scene.update(shown, self._panel.names.value)
            self._panel.update(shown, self._scene, self._handle.update(shown))
        self._shown = shown


@final
class Player:
    """Controls that play ``path``; ``go`` moves the arm to a row, and returns when it is shown."""

    def __init__(
        self, gui: viser.GuiApi, panel: Panel, path: Array, go: Callable[[Array], None]
    ) -> None:
        self._size = float(len(path))
        self.paused = threading.Event()
        self.paused.set()
        with gui.add_folder("Path", order=0.0):
            self.sample = panel.add_slider(f"sample of {len(path)}", 1.0, self._size, 1.0, 1.0)
            self._speed = panel.add_slider("samples per s", 1.0, _FASTEST, _SPEED, 1.0)
            self.button = gui.add_button("Play")
        self.button.on_click(lambda _: self.play())
        self.sample.on_update(lambda _: go(path[round(self.sample.value) - 1]))

    def play(self) -> None:
        """Play to the end, from the start if it is there; or pause, if it plays."""
        if not self.paused.is_set():
            self.paused.set()
            return
        self.paused.clear()
        self.button.label = "Pause"
        if self.sample.value == self._size:
            self.sample.value = 1.0  # type: ignore[misc]
        while self.sample.value < self._size and not self.paused.wait(1.0 / self._speed.value):
            self.sample.value += 1.0  # type: ignore[misc]
        self.paused.set()
        self.button.label = "Play"


@final
class TipHandle:
    """Handle at the tip, which users drag. Each drag calls ``changed``, in any thread."""

    def __init__(
        self, scene: viser.SceneApi, arm: Manipulator, changed: Callable[[], None]
    ) -> None:
        self._arm = arm
        self._changed = changed
        self._target: Array | None = None
        self._dragged = False
        self._remark = ""
        self._q = np.full(arm.nv, np.nan)
        self._node = scene.add_transform_controls(
            HANDLE, _SIZE * arm.length, disable_rotations=True, depth_test=False, opacity=0.7
        )
        self._node.on_update(self._on_drag)

    async def _on_drag(self, event: viser.TransformControlsEvent) -> None:
        # viser keeps the order of these calls only if the function is asynchronous
        self._dragged = event.phase != "end"
        if event.phase == "update":
            self.aim(np.array(event.target.position))
        else:
            self._changed()

    def aim(self, target: Array) -> None:
        """Set a new target of the tip (3,) [m], and call ``changed``."""
        self._target = target
        self._changed()

    def follow(self, panel: Panel) -> None:
        """Move the joints of ``panel`` so that the tip is at, or nearest to, a new target."""
        target = self._target
        self._target = None
        if target is None or panel.pulls:
            return
        solution = inverse_kinematics(self._arm, target, panel.setting.q)
        panel.move(solution.angles)
        self._q = panel.setting.q
        self._remark = ""
        if not solution.reachable:
            stops = f" ({', '.join(solution.at_limit)} at a limit)" if solution.at_limit else ""
            missed = f"{MM * solution.position_error:.3g} mm"
            self._remark = f"The tip stays {missed} away from the handle{stops}."

    def update(self, shown: Shown) -> str:
        """Move the handle to the tip, unless it is dragged; return why the tip did not reach it.

        The reason is empty if the tip did, or if the arm has been moved since.
        """
        self._node.visible = shown.reference is not None and shown.setting.pull is None
        if shown.reference is not None and not self._dragged:
            self._node.position = shown.reference.tip[:3, 3]
        return self._remark if np.array_equal(shown.setting.q, self._q) else ""


def _tips(arm: Manipulator, path: Array) -> Array:
    """Return the tip positions (S, 3) [m] at joint angles (S, nv); name a sample that has none."""
    tips = []
    for i, q in enumerate(path):
        try:
            tips.append(arm.at(q).tip[:3, 3])
        except CdsmError as error:
            raise InvalidInput("angles", f"sample {i + 1}: {error}") from None
    return np.array(tips)

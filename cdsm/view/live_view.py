"""Serve a live view: one page for any number of browsers of this machine.

A change of a control computes the results anew, and draws them.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import threading
from collections.abc import Callable, Mapping
from concurrent import futures
from typing import TYPE_CHECKING, Any, Self, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.arm_file.source import ArmSource
from cdsm.errors import CdsmError, InvalidInput, listed, need
from cdsm.manipulator import Manipulator
from cdsm.planning.path import checked_path
from cdsm.status import Status
from cdsm.support.validation import checked_quantity, instance, one_of, vector, whole_number
from cdsm.support.values import Array
from cdsm.view.curve import compute_curve
from cdsm.view.history import History
from cdsm.view.panel import Panel, loadable_links
from cdsm.view.path_player import Player, tips_of
from cdsm.view.saving import (
    command_text,
    draw_picture,
    file_name,
    posture_text,
    python_text,
    view_of,
)
from cdsm.view.scene import Scene
from cdsm.view.state import Setting, Shown, show
from cdsm.view.texts import said_numbers
from cdsm.view.tip_handle import TipHandle

if TYPE_CHECKING:
    import viser

_LOG = logging.getLogger(__name__)

_PANEL = 390  # width of the panel in pixels, so that its longest row fits on one line
_REST = 0.3  # for which no control moves [s] before what takes longer is computed


def serve(
    arm: Manipulator,
    *,
    port: int = 8080,
    q: ArrayLike | None = None,
    minimum: float = 0.0,
    maximum: float = math.inf,
    force: ArrayLike = (0.0, 0.0, 0.0),
    link: str | None = None,
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
    file: str | os.PathLike[str] | None = None,
    changes: Mapping[str, Any] | None = None,
) -> View:
    """Serve a live view of an arm: sliders, a 3D picture, and the stiffness.

    The view runs in background threads until it is closed. All browsers share one set of sliders.
    Only this machine can connect, and no web page of another site. To see the view from another
    machine, forward the port: ``ssh -L 8080:localhost:8080 THIS_MACHINE``.

    An arm with springs and fewer cables than joints has sliders of how much wire each motor takes
    in, from straight cables, and :func:`~cdsm.forward_statics` gives its posture; with ``q`` or a
    path it has those of the joints.

    The page has the verdict with the stiffness of the softer side along each axis, bars of the
    tensions with their bounds, the stiffness over the least tension, the matrix of the tip, and
    sliders that end at the arm's own bounds: the force at twice what the arm holds. It acts at the
    tip or on a link. Buttons undo a change, and save the picture or lines that compute the same.

    Args:
        arm: The arm; it is not changed.
        port: Port to listen at; 0 for any free port.
        q: Joint angles at the start (nv,) [rad]; by default zero, or the nearest joint limit.
        minimum: Lower bound of all tensions at the start [N].
        maximum: Upper bound of all tensions [N].
        force: Force at the start, in base axes (3,) [N].
        link: Link on which it acts: at the centre of its disk, or its frame. None: at the tip.
        angles: A path to play, as joint angles (S, nv) [rad]; the arm starts at the first.
        tips: A path to play, as tip positions (S, 3) [m]; give only one kind of path.
        file: The file from which the arm was read, and ``changes`` as for
            :meth:`Manipulator.read`: the lines that the page saves have both.
        changes: Values that were laid over the keys of the file.

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
    route = path if path is None or tips is not None else tips_of(arm, path)
    start = Setting(
        q=arm.checked_angles(straight if q is None else q),
        minimum=checked_quantity("minimum", minimum, "tension", zero=True),
        maximum=checked_quantity("maximum", maximum, "tension", infinite=True),
        force=vector("force", force, 3, "force [N], base axes"),
        link="" if link in (None, arm.tip_link) else _checked_link(arm, link),
        pull=np.zeros(len(arm.cables)) if pulled else None,
    )
    with contextlib.redirect_stdout(None):  # viser prints addresses
        server = guarded_server(whole_number("port", port, 0, 65535), arm.name)
    try:
        # viser's share button opens a tunnel to a public server; the guard refuses it
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(_PANEL)
        view = View(arm, start, server, ArmSource(os.fspath(file or ""), changes or {}))
        if path is not None and route is not None:
            view.add_path(path, route)
    except BaseException:
        server.stop()
        raise
    return view


def _checked_link(arm: Manipulator, link: object) -> str:
    """Return the link on which the force acts; InvalidInput if it would move nothing there."""
    name = one_of("link", link, arm.body.link_names)
    known = loadable_links(arm)
    if name not in known:
        where = listed(["the tip", *(each for each in known)], 6)
        problem = f"{name} given, but no joint moves the place where a force on it would act, or it"
        raise InvalidInput("link", f"{problem} has no disk; choose {where}.")
    return name


@final
class View:
    """Running live view of ``arm``, made by :func:`serve`. Close it, or use it in ``with``."""

    def __init__(
        self, arm: Manipulator, start: Setting, server: viser.ViserServer, source: ArmSource
    ) -> None:
        self.arm = arm
        self._source = source
        self._server = server
        self._closed = threading.Event()
        self._moved = threading.Event()
        self._lock = threading.Lock()
        self._thread = futures.ThreadPoolExecutor(1, "cdsm view")
        self._last: futures.Future[None] | None = None
        self._later: futures.Future[None] | None = None
        self._player: Player | None = None
        self._panel = Panel(server.gui, arm, start, self._request)
        self._history = History(self._panel.values)
        self._scene = Scene(server, arm)
        self._handle = TipHandle(server.scene, arm, self._request)
        self._refresh()
        self._scene.begin(server.initial_camera, self._shown, np.empty((0, 3)))
        self._panel.steps.on_click(self._step)
        self._panel.save.on_click(self._save)
        server.on_client_connect(lambda client: self._scene.fit(client.camera))

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
        self._moved.set()
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
        self._moved.set()
        with self._lock:
            if self._last is None or self._last.running() or self._last.done():
                self._last = self._submit(self._refresh) or self._last

    def _refresh(self) -> None:
        self._moved.clear()
        try:
            self._handle.follow(self._panel)
            self._panel.fit_forces()
            self._history.note(self._panel.values)
            self._put(show(self.arm, self._panel.setting))
        except Exception as error:  # a bug must not leave outdated numbers on the page
            _LOG.exception("the view cannot show %s", setting := self._panel.setting)
            problem = f"{type(error).__name__}: {error}"
            self._put(Shown(setting=setting, status=Status.FAILED, problem=problem))
        self._history.rest()
        if not self._moved.is_set():
            self._later = self._submit(self._complete, self._shown)

    def _put(self, shown: Shown) -> None:
        with self._server.atomic():
            self._scene.update(shown, self._panel.names.value)
            self._panel.update(shown, self._scene, self._handle.update(shown))
        self._shown = shown

    def _complete(self, shown: Shown) -> None:
        """Show what takes longer, once no control has moved for a while."""
        if self._moved.wait(_REST) or shown is not self._shown:
            return
        command = command_text(self.arm, shown.setting, self._source)
        code = f"{python_text(self.arm, shown.setting)}\n\n{command}"
        curve = None
        with contextlib.suppress(CdsmError):
            axis = self._panel.curve.axis.value
            curve = compute_curve(shown, axis, self._panel.tension_ends, self._moved.is_set)
        if not self._moved.is_set():
            with self._server.atomic():
                self._panel.complete(shown, code)
                self._panel.curve.draw(curve)

    def _step(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        """Do what a button says: the straight arm, the setting before, or the first one."""
        if event.target.value == "Straight":
            self._panel.move(np.zeros(self.arm.nv))
        elif event.target.value == "Reset":
            self._panel.reset()
        else:
            self._moved.set()
            self._submit(self._undo)  # no refresh can come between two controls

    def _undo(self) -> None:
        values = self._history.back()
        if values is not None:
            self._panel.put(values)
        self._request()

    def _save(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        """Send the browser that asks the picture of what is shown, or lines that compute it."""
        client = event.client
        if client is None:
            return
        self._submit(self._send, client, event.target.value)

    def _send(self, client: viser.ClientHandle, what: str) -> None:
        if what == "Posture":
            numbers = said_numbers(self._shown)
            content = posture_text(self.arm, self._shown, self._source, numbers).encode()
            client.send_file_download(
                file_name(self.arm, "_posture.py"), content, save_immediately=True
            )
            return
        picture = draw_picture(self._shown, view_of(client.camera))
        if picture is None:
            client.add_notification("No picture", "There is no posture to draw.", color="red")
        else:
            client.send_file_download(file_name(self.arm, ".svg"), picture, save_immediately=True)

    def _submit(self, job: Callable[..., None], *arguments: Any) -> futures.Future[None] | None:
        """Let the one thread do a job after those before; None if the view is closed."""
        try:
            future = self._thread.submit(job, *arguments)
        except RuntimeError:
            return None
        future.add_done_callback(_log_error)
        return future


def _log_error(done: futures.Future[None]) -> None:
    """Say what went wrong in a job, which nobody waits for."""
    if error := done.exception():
        _LOG.error("a job of the view has failed", exc_info=error)

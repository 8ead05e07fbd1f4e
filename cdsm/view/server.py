"""Serve the live view: one page for any number of browsers."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent import futures
from typing import TYPE_CHECKING, Self, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.extras import need
from cdsm.support.validation import bound, instance, quantity, vector, whole_number
from cdsm.tension import DEFAULT_SOLVER, installed_solver
from cdsm.view.scene import Scene
from cdsm.view.sliders import Controls
from cdsm.view.state import Condition, Setting, Shown, show

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Guard

_LOG = logging.getLogger(__name__)

_PANEL = 390
"""Width of the panel in pixels, so that its longest row fits on one line."""


def serve(
    arm: Manipulator,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    q: ArrayLike | None = None,
    minimum: float = 10.0,
    maximum: float = math.inf,
    force: ArrayLike = (0.0, 0.0, 0.0),
    solver: str = DEFAULT_SOLVER,
    largest_tension: float = 200.0,
    largest_force: float = 20.0,
) -> View:
    """Serve a live view of an arm: sliders, a 3D picture, and the stiffness.

    The view runs in background threads until it is closed. All browsers share one set of sliders.
    Pages of other sites cannot connect. Other machines can connect only if ``host`` allows it, and
    only with the token in the URL. In this case a warning is logged.

    Args:
        arm: The arm; it is not changed.
        host: Address to listen at; the default allows this machine only.
        port: Port to listen at; 0 for any free port.
        q: First joint angles (nv,) [rad]; by default zero, or the nearest joint limit.
        minimum: First lower bound of all tensions [N].
        maximum: Upper bound of all tensions [N].
        force: First force at the tip, in base axes (3,) [N].
        solver: Solver of :func:`~cdsm.distribute_tension`.
        largest_tension: Right end of the slider of the lower bound [N].
        largest_force: Ends of the sliders of the force [N]; larger if ``force`` is larger.

    Raises:
        MissingExtra: viser is not installed (extra ``[view]``).
        InvalidInput: A value has the wrong type or shape, or the port is not available.
        CdsmError: The installed viser cannot be guarded.
        JointLimitError: An angle is beyond its limit.
        UnknownName: The solver is not installed.
    """
    need("view", "viser")
    straight = np.clip(np.zeros(instance("arm", arm, Manipulator).nv), arm.lower, arm.upper)
    start = Setting(
        q=straight if q is None else arm._angles(q, check_limits=True),
        minimum=quantity("minimum", minimum, "tension", zero=True),
        maximum=float(bound("maximum", maximum, 1)[0]),
        force=vector("force", force, 3, "force at the tip [N], base axes"),
        solver=installed_solver(solver),
    )
    tension = quantity("largest_tension", largest_tension, "tension")
    push = max(quantity("largest_force", largest_force, "force"), float(abs(start.force).max()))
    return View(arm, start, *_server(host, port), (tension, push))


class Worker:
    """A thread that runs a job on request. All requests during a run cause one further run.

    Many threads request runs, faster than the job ends. It reads the newest state when it starts.
    """

    def __init__(self, job: Callable[[], None]) -> None:
        self._job = job
        self._thread = futures.ThreadPoolExecutor(1, "cdsm view")
        self._lock = threading.Lock()
        self._last: futures.Future[None] | None = None

    def request(self) -> None:
        """Request a run of the job. Any thread may call this; after the end nothing happens."""
        with self._lock, contextlib.suppress(RuntimeError):  # the thread has ended
            if self._last is None or self._last.running() or self._last.done():
                self._last = self._thread.submit(self._job)

    def wait(self) -> None:
        """Wait until all requests made before are done."""
        futures.wait([self._last] if self._last else [])

    def close(self) -> None:
        """Wait until all requests made before are done, and refuse further ones."""
        self._thread.shutdown()


@final
class View:
    """Running live view of ``arm``, made by :func:`serve`. Close it, or use it in ``with``.

    ``limits`` are as in :class:`Controls`.
    """

    def __init__(
        self,
        arm: Manipulator,
        start: Setting,
        guard: Guard,
        server: viser.ViserServer,
        limits: tuple[float, float],
    ) -> None:
        self.arm = arm
        self._guard, self._server = guard, server
        self._closed = threading.Event()
        self._worker = Worker(self._refresh)
        try:
            self._scene = Scene(server, arm, limits[1])
            request = self._worker.request
            self._controls = Controls(server, arm, start, limits, request, guard.admit)
            self._refresh()
        except BaseException:
            self.close()
            raise

    @property
    def url(self) -> str:
        """Address of the page; it contains a token if other machines can connect."""
        host, token = self._server.get_host(), self._guard.token
        place = f"{f'[{host}]' if ':' in host else host}:{self._server.get_port()}"
        return f"http://{place}/{token}/" if token else f"http://{place}"

    @property
    def shown(self) -> Shown:
        """Content of the page, after all slider moves so far are computed."""
        self._worker.wait()
        return self._shown

    def wait(self) -> None:
        """Wait until the view is closed, or for Ctrl-C."""
        self._closed.wait()

    def close(self) -> None:
        """Stop the server. A second call does nothing."""
        if self._closed.is_set():
            return
        self._worker.close()
        with _quiet():
            self._server.stop()
        self._closed.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<View of {self.arm.name} at {self.url}>"

    def _refresh(self) -> None:
        setting = self._controls.setting
        try:
            self._put(show(self.arm, setting))
        except Exception as error:  # a bug must not leave outdated numbers on the page
            _LOG.exception("the view cannot show %s", setting)
            problem = f"{type(error).__name__}: {error}"
            self._put(Shown(setting=setting, condition=Condition.FAILED, problem=problem))

    def _put(self, shown: Shown) -> None:
        with self._server.atomic():
            self._scene.update(shown)
            self._controls.update(shown)
        self._shown = shown


def _server(host: object, port: object) -> tuple[Guard, viser.ViserServer]:
    """Start a guarded viser server at exactly this address, and set up its page."""
    from cdsm.view.guard import Guard

    if not isinstance(host, str):
        raise InvalidInput("host", f"{host!r} given; an address is needed, such as '127.0.0.1'.")
    port = whole_number("port", port, 0, 65535)
    _check_free(host, port)
    guard = Guard(host)
    with _quiet():
        server = guard.start(port)
    # viser's share button opens a tunnel to a public server; the guard refuses it
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(_PANEL)  # the width of "large" depends on the browser
    return guard, server


def _check_free(host: str, port: int) -> None:
    """Check that the address is free; viser would use the next port, or wait for ever."""
    try:
        for family, *_, address in socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        ):
            socket.create_server(address, family=family).close()
    except (socket.gaierror, UnicodeError) as error:
        raise InvalidInput("host", f"{host!r} is no address of this machine: {error}.") from None
    except OSError as error:
        raise InvalidInput(
            "port",
            f"{port} on {host} cannot be had: {os.strerror(error.errno or 0)}. "
            "Give another port, or 0 for any free one.",
        ) from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser from printing to standard output; viser has no option for this."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before

"""Run a live view: compute results when a control changes, and draw them."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Self, final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.values import Array
from cdsm.view.controls import Controls
from cdsm.view.path_player import PathPlayer
from cdsm.view.scene import Scene
from cdsm.view.state import Condition, Setting, Shown, show
from cdsm.view.tip_handle import TipHandle
from cdsm.view.worker import Worker

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Guard

_LOG = logging.getLogger(__name__)

_SETTLED = 0.3  # seconds without a new setting before the remedies are computed, which takes longer
_ARROW = 0.5  # length of the arrow of the largest force, as a fraction of the arm's length


@final
class View:
    """Running live view of ``arm``, made by :func:`serve`. Close it, or use it in ``with``."""

    def __init__(
        self,
        arm: Manipulator,
        start: Setting,
        arm_arguments: Sequence[str] | None,
        guard: Guard,
        server: viser.ViserServer,
        limits: tuple[float, float],
    ) -> None:
        self.arm = arm
        self._guard, self._server = guard, server
        self._closed = threading.Event()
        self._worker = Worker(self._refresh)
        self._player: PathPlayer | None = None
        try:
            request, scale = self._worker.request, _ARROW * arm.length / limits[1]
            self._scene = Scene(server, arm, scale)
            self._handle = TipHandle(server, arm, request)
            self._controls = Controls(
                server,
                arm,
                start,
                arm_arguments,
                limits,
                scale,
                request,
                self._scene.cameras.fit,
                guard.admit,
            )
            server.scene.on_click()(self._on_click)
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
        """Results on the page, after waiting until all slider moves so far are computed."""
        self._worker.wait()
        return self._shown

    def wait(self) -> None:
        """Wait until the view is closed, or for Ctrl-C."""
        self._closed.wait()

    def close(self) -> None:
        """Stop the server. A second call does nothing."""
        if self._closed.is_set():
            return
        if self._player is not None:
            self._player.close()
        self._worker.close()
        with quiet():
            self._server.stop()
        self._closed.set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<View of {self.arm.name} at {self.url}>"

    def _add_path(self, path: Array, tips: Array) -> None:
        """Draw the tips (S, 3) [m] of a path, and add controls that play the path.

        ``path`` is the joint angles (S, nv) [rad]; for a path given by its tips it is ``tips``.
        """
        self._scene.draw_path(tips)
        go = self._handle.aim if path is tips else self._controls.move

        def show(sample: Array) -> None:
            go(sample)
            self._worker.wait()

        show(path[0])
        self._player = PathPlayer(self._server, path, show, self._guard.admit)

    def _on_click(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        self._scene.names.choose(self.shown, origin, direction)
        self._worker.request()

    def _refresh(self) -> None:
        setting = self._controls.setting
        angles = self._handle.solve(setting.q)
        if angles is not None:
            self._controls.move(angles)
            setting = self._controls.setting
            self._handle.moved_to(setting.q)
        try:
            shown = show(self.arm, setting)
            self._put(shown)
            unstable = shown.stiffness if shown.condition is Condition.UNSTABLE else None
            if unstable is not None and self._worker.no_request_within(_SETTLED):
                # tenths of a second: what would make the arm stable
                self._put(replace(shown, problem="\n".join(unstable.warnings)))
        except Exception as error:  # a bug must not leave outdated numbers on the page
            _LOG.exception("the view cannot show %s", setting)
            problem = f"{type(error).__name__}: {error}"
            self._put(Shown(setting=setting, condition=Condition.FAILED, problem=problem))

    def _put(self, shown: Shown) -> None:
        self._scene.names.all = self._controls.names.value
        with self._server.atomic():
            self._scene.update(shown, follow=not self._handle.dragged)
            self._handle.update(shown)
            self._controls.update(shown, self._handle.remark(shown.setting.q))
        self._shown = shown


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep viser from printing to standard output; viser has no option for this."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before

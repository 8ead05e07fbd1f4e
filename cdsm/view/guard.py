"""Serve the view to browsers of this machine only, and pass on only what its page sends.

viser serves every client, and lets it change any property of any control. The guard refuses web
pages of other sites, which their ``Origin`` header shows, and other names of this machine, as after
DNS rebinding. Our page may connect to its own server only. Of its messages pass: camera, drags of
the tip's handle, and values of controls. Files are only sent to it.
"""

from __future__ import annotations

import ipaddress
import math
import re
import socket
import threading
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from typing import Any, Final, TypeGuard

import msgspec
import viser
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from cdsm.errors import CdsmError, InvalidInput
from cdsm.view.scene import HANDLE

_HOST = "127.0.0.1"
_FARTHEST = 1e6  # largest coordinate [m] to which it may be dragged
_LONGEST = 2**16  # size of a message in bytes; those of the page have a few hundred
_CHOICES: Final = (viser.GuiDropdownHandle, viser.GuiButtonGroupHandle)
_STARTING: Final = threading.Lock()


def guarded_server(port: int, label: str) -> viser.ViserServer:
    """Start a viser server that refuses what our page does not send.

    viser has no option for this, so while it starts, the function that it calls to start a
    websocket server is replaced. Raises InvalidInput if the port is not available (viser would take
    another one), CdsmError if viser does not call that function.
    """
    try:
        socket.create_server((_HOST, port)).close()
    except OSError as error:
        remedy = f"{port} is not available ({error.strerror}); give another port, or 0."
        raise InvalidInput("port", remedy) from None
    original = websocket_server.serve
    called = threading.Event()

    def serve(*args: Any, **options: Any) -> Any:
        called.set()
        options["process_request"] = partial(_answer, options["process_request"])
        connect = partial(_Connection, lambda message: _allows(server, message))
        return original(*args, **options | {"create_connection": connect, "max_size": _LONGEST})

    with _STARTING:
        websocket_server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(_HOST, port, label, verbose=False)
        finally:
            websocket_server.serve = original  # type: ignore[misc]
    if not called.is_set():
        server.stop()
        version = viser.__version__
        raise CdsmError(f"viser {version} cannot be guarded from other sites; install viser 1.1.")
    return server


class _Connection(ServerConnection):
    """Websocket connection that drops all messages which ``allows`` refuses."""

    def __init__(self, allows: Callable[[Any], bool], *parts: Any, **limits: Any) -> None:
        super().__init__(*parts, **limits)
        self._allows = allows

    async def recv(self, decode: bool | None = None) -> Any:
        while True:
            try:
                message = msgspec.msgpack.decode(await super().recv(decode=False))
                # packed again: of two fields with one name, viser may read the one not checked here
                if self._allows(message):
                    return msgspec.msgpack.encode(message)
            except (msgspec.MsgspecError, ValueError, TypeError, RecursionError):
                pass


def _allows(server: viser.ViserServer, message: Any) -> bool:
    """Whether a message may pass; a number is clipped to its slider, as the page does."""
    match message:
        case {"type": "ViewerCameraMessage"}:
            return True
        case {"type": "GuiUpdateMessage", "uuid": str(uuid), "updates": {"value": value}}:
            control = server.gui._gui_input_handle_from_uuid.get(uuid)
            if isinstance(control, viser.GuiSliderHandle):
                value = _number(value) and float(min(max(value, control.min), control.max))
            elif isinstance(control, _CHOICES) and value not in control.options:
                return False
            message["updates"] = {"value": value}
            return control is not None and type(value) is type(control.value)
        case {"type": "TransformControlsUpdateMessage", "position": [*place]}:
            message["wxyz"] = [1.0, 0.0, 0.0, 0.0]
            near = [_number(x) and abs(x) <= _FARTHEST for x in place]
            return bool(message.get("name") == HANDLE and near == [True, True, True])
        case {"type": "TransformControlsDragStartMessage" | "TransformControlsDragEndMessage"}:
            return bool(message.get("name") == HANDLE)
    return False


def _answer(reply: Any, connection: ServerConnection, request: Request) -> Response | None:
    """Refuse a request for a page or a websocket, or let viser's ``reply`` answer it."""
    hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
    here = len(hosts) == 1 and _is_loopback(re.sub(r":\d+$", "", hosts[0]).strip("[]"))
    if not here or any(origin != f"http://{hosts[0]}" for origin in origins):
        return connection.respond(HTTPStatus.FORBIDDEN, "Not allowed to see this view.\n")
    response: Response | None = reply(connection, request)
    if response is not None:  # a page, no websocket
        sources = f"'self' ws://{hosts[0]} data: blob:"
        response.headers["Content-Security-Policy"] = (
            f"connect-src {sources}; frame-ancestors 'self'"
        )
    return response


def _is_loopback(name: str) -> bool:
    """Return whether a host name always means this machine: a loopback address, or localhost."""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name.lower() == "localhost"


def _number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and type(value) is not bool and math.isfinite(value)

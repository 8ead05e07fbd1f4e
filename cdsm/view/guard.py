"""Check every client and message of the live view before viser receives it.

viser serves every client that connects, and lets it change any property of any control. The guard
refuses:

- **A web page of another site**, open in a browser on this machine. It can reach every port of
  this machine and could read the scene over a websocket. Its ``Origin`` header shows the site.
- **DNS rebinding**: such a page uses a host name that it directs to this machine. The ``Host``
  header shows that name.
- **A connection of our page to another server**, by ``?websocket=`` in a link. That server could
  run scripts in our page. A header of the page allows connections to its own server only.
- **Messages that the page does not send.** A client may report its camera and a click in the
  scene, drag the handle at the tip, move a slider within its range, and use a switch or a button.
  The guard drops all other messages: requests to share the view on a public server, and changes
  of any property that is not a value.
- **Other machines** that do not know the token in the URL, if the address is not loopback.

At a loopback address any program on this machine, of any user, can connect. The network traffic
is not encrypted: whoever can read it has the token.
"""

from __future__ import annotations

import asyncio
import dataclasses
import hmac
import ipaddress
import logging
import math
import re
import secrets
import threading
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from typing import Any, Final, final

import msgspec
import viser
from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from cdsm.errors import CdsmError
from cdsm.view.messages import scene_message

_LOG = logging.getLogger(__name__)

_LONGEST = 2**16
"""Largest size of a message in bytes. Messages of the page have a few hundred."""

_PAUSE = 1.0
"""Seconds before an out-of-range value is corrected; the user may still be typing digits."""

_STARTING: Final = threading.Lock()

_Reply = Callable[[ServerConnection, Request], Response | None]

Control = (
    viser.GuiSliderHandle[float]
    | viser.GuiButtonHandle
    | viser.GuiButtonGroupHandle
    | viser.GuiCheckboxHandle
)
"""Types of controls that a client may use."""


class _Address(str):
    """Address of one guard. The guard knows its server by the identity of this object.

    Therefore two views in one process may have addresses of equal text.
    """

    __slots__ = ()


@final
class Guard:
    """Filter between viser and the clients of one live view that listens at ``host``.

    Attributes:
        token: First part of every path if other machines can connect, else empty.
        refused: Number of refused requests and messages.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if _is_loopback(host) else secrets.token_urlsafe(32)
        self.refused = 0
        self._address = _Address(host)
        self._controls: dict[str, Control] = {}

    def start(self, port: int) -> viser.ViserServer:
        """Start a viser server whose requests and messages pass through this guard.

        viser has no option to filter its websocket server. While viser starts, this method
        therefore replaces the function that starts the websocket server. If the port is taken,
        viser uses the next free port. Raises CdsmError if viser does not call that function.
        """
        original, made = websocket_server.serve, threading.Event()

        def serve(*args: Any, **options: Any) -> Any:
            if len(args) < 2 or args[1] is not self._address:  # another server in this process
                return original(*args, **options)
            made.set()
            options |= {
                "process_request": partial(self._answer, options["process_request"]),
                "create_connection": partial(_Connection, self),
                "max_size": _LONGEST,
            }
            return original(*args, **options)

        with _STARTING:
            websocket_server.serve = serve  # type: ignore[assignment,misc]
            try:
                server = viser.ViserServer(self._address, port, "cdsm view", verbose=False)
            finally:
                websocket_server.serve = original  # type: ignore[misc]
        if not made.is_set():
            server.stop()
            raise CdsmError(
                f"viser {viser.__version__} starts its server in a way that cannot be guarded. "
                "Install viser 1.1."
            )
        if self.token:
            _LOG.warning(
                "The view listens at %s: whoever reaches this machine over the network and has the "
                "URL with its token can see the arm and move its sliders. The traffic is not "
                "encrypted: whoever can read it has the token.",
                self._address,
            )
        return server

    def admit(self, control: Control) -> None:
        """Allow clients to use ``control``; all other controls are refused."""
        self._controls[control._impl.uuid] = control

    def _answer(
        self, reply: _Reply, connection: ServerConnection, request: Request
    ) -> Response | None:
        """Answer a request for a page or a websocket: refuse it, or let viser's ``reply`` answer.

        ``reply`` returns None for a websocket, which is then opened.
        """
        hosts = request.headers.get_all("Host")
        _, first, rest = [*request.path.partition("?")[0].split("/", 2), "", ""][:3]
        fault = self._fault(hosts, request.headers.get_all("Origin"), first)
        if fault:
            self._refuse(fault)
            return connection.respond(HTTPStatus.FORBIDDEN, "Not allowed to see this view.\n")
        if self.token:
            request = dataclasses.replace(request, path=f"/{rest}")
        response = reply(connection, request)
        if response is not None:
            own = f"'self' ws://{hosts[0]} wss://{hosts[0]} data: blob:"
            policy = f"connect-src {own}; frame-ancestors 'self'"
            response.headers["Content-Security-Policy"] = policy
        return response

    def _fault(self, hosts: list[str], origins: list[str], first: str) -> str:
        """Return the reason to refuse a request; empty if the request is allowed.

        ``hosts`` and ``origins`` are the Host and Origin headers of the request, ``first`` is the
        first part of its path.
        """
        if len(hosts) != 1:
            return f"a request for {len(hosts)} hosts"
        host = hosts[0]
        # with a token any host name is allowed: a page that rebinds DNS does not know the token
        if not self.token and not _is_loopback(re.sub(r":\d+$", "", host).strip("[]")):
            return f"a request for another host, {host[:80]!a}"
        if any(origin not in (f"http://{host}", f"https://{host}") for origin in origins):
            return f"a request of another origin, {origins[0][:80]!a}"
        given = first.encode(errors="surrogateescape")
        if self.token and not hmac.compare_digest(given, self.token.encode()):
            return "a request without the token"
        return ""

    def _permitted(self, raw: bytes) -> bytes | None:
        """Check a client's message ``raw``; return its allowed part, packed for viser, or None."""
        try:
            # packed again: of two fields with one name, viser may read the one not checked here
            message = msgspec.msgpack.decode(raw)
            seen = scene_message(message)
            if seen is not None:
                return msgspec.msgpack.encode(seen)
            match message:
                case {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}}:
                    value = self._allowed(uuid, value)
                    if value is not None and (len(message), len(message["updates"])) == (3, 1):
                        message["updates"]["value"] = value
                        return msgspec.msgpack.encode(message)
            self._refuse(f"a message, {message!a:.80}")
        except Exception as error:  # unknown bytes can cause any error
            self._refuse(f"a message, {str(error)[:80]!a}")
        return None

    def _allowed(self, uuid: str, value: object) -> bool | float | str | None:
        """Return ``value``, clipped to the range of a slider, for the control ``uuid``.

        None if clients may not use this control, or not set this value.
        """
        control = self._controls.get(uuid)
        if isinstance(control, viser.GuiButtonHandle):
            return True if value is True else None
        if isinstance(control, viser.GuiCheckboxHandle):
            return value if isinstance(value, bool) else None
        if isinstance(control, viser.GuiButtonGroupHandle):
            return value if value in control.options else None
        if control is None or isinstance(value, bool) or not isinstance(value, (int, float)):
            return None
        if not math.isfinite(value):
            return None
        within = float(min(max(value, control.min), control.max))
        if within != value:  # viser updates the other clients, but not the sender
            asyncio.get_running_loop().call_later(
                _PAUSE, lambda: control._queue_update("value", control.value)
            )
        return within

    def _refuse(self, what: str) -> None:
        """Count a refused request or message, and log the count each time it has doubled."""
        self.refused += 1
        if self.refused & (self.refused - 1) == 0:
            _LOG.warning("Refused from clients so far: %d; the last: %s.", self.refused, what)


class _Connection(ServerConnection):
    """Websocket connection that drops all messages which its guard refuses."""

    def __init__(self, guard: Guard, *parts: Any, **limits: Any) -> None:
        super().__init__(*parts, **limits)
        self._guard = guard

    async def recv(self, decode: bool | None = None) -> Any:
        while (message := self._guard._permitted(await super().recv(decode=False))) is None:
            pass
        return message


def _is_loopback(name: str) -> bool:
    """Return whether a host name always means this machine: a loopback address, or localhost."""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name.lower() == "localhost"

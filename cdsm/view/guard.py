"""Who may connect to the live view, and what they may send: checked before viser sees it.

viser serves every client that connects, and lets it change any property of any control. The guard
keeps out:

- **A web page of another site**, open in a browser on this machine. It can reach every port of
  this machine, and would read the scene over a websocket. Its ``Origin`` gives it away.
- **The same page under a name of its own** that it points at this machine (DNS rebinding). Its
  ``Host`` gives it away.
- **Our own page led to another server**, by ``?websocket=`` in a link. That server could run its
  scripts in our page. The page is served with the instruction to connect to its own server only.
- **Other messages than the page sends.** A client may tell where its camera is, move a slider
  within its range and press a button. All else is dropped: requests to share the view on a public
  server, and changes of any property that is not a value.
- **Other machines**, where the address is not one of this machine alone, unless they know a token
  that is part of the URL.

Not kept out: any program that runs on this machine, of any user, while only this machine can
connect; and whoever can read the network traffic, which is not encrypted and shows the token.
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

_LOG = logging.getLogger(__name__)

_LONGEST = 2**16
"""Bytes in a message; those of the page have some hundred."""

_PAUSE = 1.0
"""Seconds until a page is told that its value is out of range. Somebody may still be typing: the
first digits of a number can be below the range."""

_STARTING: Final = threading.Lock()

_Reply = Callable[[ServerConnection, Request], Response | None]

Control = viser.GuiSliderHandle[float] | viser.GuiButtonHandle
"""What a client may use."""


class _Camera(msgspec.Struct, tag_field="type", tag="ViewerCameraMessage"):
    """Where a client looks from; viser keeps it for each client alone."""


class _Value(msgspec.Struct, forbid_unknown_fields=True):
    value: bool | float


class _Change(msgspec.Struct, tag_field="type", tag="GuiUpdateMessage", forbid_unknown_fields=True):
    """The new value of a control; of a button, that it is pressed."""

    uuid: str
    updates: _Value


class _Address(str):
    """An address that is told from an equal one: the server of this very guard listens at it."""

    __slots__ = ()


@final
class Guard:
    """Stands between the clients of one live view and viser.

    Args:
        host: Address to listen at.

    Attributes:
        token: First part of every path, where other machines can connect; otherwise empty.
        refused: Requests and messages refused so far.
    """

    def __init__(self, host: str) -> None:
        self.token = "" if _is_loopback(host) else secrets.token_urlsafe(32)
        self.refused = 0
        self._address = _Address(host)
        self._controls: dict[str, Control] = {}

    def start(self, port: int, label: str) -> viser.ViserServer:
        """Start a viser server with this guard before it.

        viser leaves no way to say how its websocket server checks requests and receives messages.
        While it starts, that server is therefore made here. If the port is taken, viser takes the
        next one that is free.
        """
        original, made = websocket_server.serve, threading.Event()

        def serve(*args: Any, **options: Any) -> Any:
            if len(args) < 2 or args[1] is not self._address:  # of somebody else in this process
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
                server = viser.ViserServer(self._address, port, label, verbose=False)
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
        """Let clients move this slider, or press this button."""
        self._controls[control._impl.uuid] = control

    def _answer(
        self, reply: _Reply, connection: ServerConnection, request: Request
    ) -> Response | None:
        """Refuse a request for a page or a websocket, or let viser reply to it."""
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
        """What is wrong with a request: its hosts and origins, and the first part of its path."""
        if len(hosts) != 1:
            return f"a request for {len(hosts)} hosts"
        host = hosts[0]
        # with a token no name can be wrong: another page that has a name for us has no token
        if not self.token and not _is_loopback(re.sub(r":\d+$", "", host).strip("[]")):
            return f"a request for another host, {host[:80]!a}"
        if any(origin not in (f"http://{host}", f"https://{host}") for origin in origins):
            return f"a request of another origin, {origins[0][:80]!a}"
        given = first.encode(errors="surrogateescape")
        if self.token and not hmac.compare_digest(given, self.token.encode()):
            return "a request without the token"
        return ""

    def _kept(self, raw: bytes) -> bytes | None:
        """A message of a client as viser may have it, None if it may not.

        It is packed anew: of two fields of one name, viser may read another than is read here.
        """
        try:
            message = msgspec.msgpack.decode(raw)
            known = msgspec.convert(message, _Camera | _Change)
        except Exception as error:  # whatever the bytes of a stranger bring about
            self._refuse(f"a message, {str(error)[:80]!a}")
            return None
        if isinstance(known, _Change):
            value = self._value(known)
            if value is None:
                self._refuse(f"a change, {known!a:.80}")
                return None
            message["updates"]["value"] = value
        return msgspec.msgpack.encode(message)

    def _value(self, change: _Change) -> bool | float | None:
        """The value that a control may take, None if it may take none of the kind."""
        control, value = self._controls.get(change.uuid), change.updates.value
        if isinstance(control, viser.GuiButtonHandle):
            return value if value is True else None
        if control is None or isinstance(value, bool) or not math.isfinite(value):
            return None
        within = min(max(value, control.min), control.max)
        if within != value:  # viser tells the other clients, but not the one that has sent it
            asyncio.get_running_loop().call_later(
                _PAUSE, lambda: control._queue_update("value", control.value)
            )
        return within

    def _refuse(self, what: str) -> None:
        """Count it, and log the count each time that it has doubled."""
        self.refused += 1
        if self.refused & (self.refused - 1) == 0:
            _LOG.warning("Refused from clients so far: %d; the last: %s.", self.refused, what)


class _Connection(ServerConnection):
    """A connection that receives what its guard keeps."""

    def __init__(self, guard: Guard, *parts: Any, **limits: Any) -> None:
        super().__init__(*parts, **limits)
        self._guard = guard

    async def recv(self, decode: bool | None = None) -> Any:
        while (kept := self._guard._kept(await super().recv(decode=False))) is None:
            pass
        return kept


def _is_loopback(name: str) -> bool:
    """Whether only this machine is reached under a name, whoever resolves it."""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name.lower() == "localhost"

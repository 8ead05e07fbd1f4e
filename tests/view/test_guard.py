"""Hostile clients of the live view, on this machine, against the real server."""

import math
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.view import serve
from cdsm.view.live_view import View
from tests.support.patience import HANGS
from tests.view.test_server import node
from tests.view.test_state import DEGREES, STABLE, soft_arm

viser = pytest.importorskip("viser", reason="the extra [view] is not installed")
msgspec = pytest.importorskip("msgspec")
zstandard = pytest.importorskip("zstandard")
client = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")

CAMERA: dict[str, Any] = {"type": "ViewerCameraMessage", "fov": 0.8, "near": 0.01, "far": 100.0}
CAMERA |= {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": [0.0, -1.0, 0.0], "look_at": [0, 0, 0]}
CAMERA |= {"image_height": 600, "image_width": 800, "up_direction": [0.0, 0.0, 1.0]}
"""What a page sends first."""


@pytest.fixture(autouse=True)
def tunnel(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Set when viser is asked for a public tunnel, which no test may open."""
    asked = threading.Event()
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda *_, **__: asked.set())
    return asked


@pytest.fixture
def view() -> Iterator[View]:
    q = np.deg2rad(DEGREES)
    with serve(soft_arm(), port=0, q=q, minimum=STABLE, maximum=200.0) as page:
        yield page


def port_of(view: View) -> int:
    return int(view._server.get_port())


class Client:
    """Speaks viser's protocol, and whatever else it likes."""

    def __init__(self, view: View, *, host: str = "127.0.0.1", origin: str | None = None) -> None:
        port = port_of(view)
        self._socket = client.connect(
            f"ws://{host}:{port}",
            sock=socket.create_connection(("127.0.0.1", port)),
            origin=origin,
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
        )
        self.send(CAMERA)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, message: object) -> None:
        raw = isinstance(message, (bytes, str))
        self._socket.send(message if raw else msgspec.msgpack.encode(message))

    def change(self, control: str, updates: dict[str, Any]) -> None:
        self.send({"type": "GuiUpdateMessage", "uuid": control, "updates": updates})

    def control(self, label: str) -> str:
        """Identity of a control, as it is sent to everybody who may read the scene."""
        while True:
            raw = self._socket.recv(timeout=HANGS)
            size = int.from_bytes(raw[8:16], "little")
            unpacked = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + size])
            for message in msgspec.msgpack.decode(unpacked)["messages"]:
                if message.get("props", {}).get("label") == label:
                    return str(message["uuid"])


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + HANGS
    while not condition():
        assert time.monotonic() < deadline, "it has not come about"
        time.sleep(0.01)


def settle(view: View, sender: Client, value: float = 0.5) -> None:
    """Wait until all that a client has sent so far is done: its messages keep their order."""
    handle = view._panel._load[1]
    sender.change(handle._impl.uuid, {"value": value})
    wait_for(lambda: handle.value == value)


def page_status(view: View, host: str, **headers: str) -> int:
    """Status of the answer to a plain request, under whatever name."""
    lines = ["GET / HTTP/1.1", *(f"{k}: {v}" for k, v in {"Host": host, **headers}.items())]
    with socket.create_connection(("127.0.0.1", port_of(view))) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(connection.recv(12)[9:])


def test_no_other_origin_and_no_name_of_another_machine_is_served(view: View) -> None:
    port = port_of(view)
    origins = [
        "https://evil.example",
        f"http://127.0.0.1:{port + 1}",
        "http://127.0.0.1",
        f"http://localhost:{port}",  # is not 127.0.0.1 to a browser
        f"http://127.0.0.1:{port}.evil.example",
        f"http://127.0.0.1:{port}@evil.example",
        *("null", ""),
    ]
    hosts = ["evil.example", "127.0.0.1.evil.example", "evil.localhost", "192.168.0.1"]
    asked = [{"origin": origin} for origin in origins]
    # after DNS rebinding the page is of the same origin as its name for this server
    asked += [{"host": host, "origin": f"http://{host}:{port}"} for host in hosts]
    for options in asked:
        with pytest.raises(exceptions.InvalidStatus, match="403"):
            Client(view, **options)
    for host in hosts:
        assert page_status(view, f"{host}:{port}") == page_status(view, host) == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "LOCALHOST", "127.0.0.2", "[::1]"])
def test_this_machine_is_served_under_all_its_names(view: View, host: str) -> None:
    name = f"{host}:{port_of(view)}"
    assert page_status(view, name, Origin=f"http://{name}") == 200
    assert page_status(view, f"{host}:9000") == 200  # a tunnel of ssh has a port of its own
    with Client(view, host=host, origin=f"http://{name.lower()}") as friend:
        assert friend.control("force z [N]")


def test_a_page_may_connect_to_its_own_server_only(view: View) -> None:
    with urllib.request.urlopen(view.url) as page:
        policy = str(page.headers["Content-Security-Policy"])
    own = {"'self'", "data:", "blob:", f"ws://127.0.0.1:{port_of(view)}"}
    assert {*policy.partition(";")[0].split()[1:]} <= own, policy


def test_a_client_changes_nothing_of_a_control_but_its_value(view: View) -> None:
    force, switch = view._panel._load[3], view._panel._sag
    before = dict(vars(force._impl))
    updates: dict[str, Any]
    value: Any
    with Client(view) as enemy:
        for updates in ({"update_cb": []}, {"removed": True}, {"uuid": "x"}, {"props": None}, {}):
            enemy.change(force._impl.uuid, updates)
        for value in (math.nan, math.inf, "7", None, True, [1.0], {}):
            enemy.change(force._impl.uuid, {"value": value})
        text = view._panel._head._impl.uuid
        for control, value in ((text, 1.0), ("no such", 1.0), (switch._impl.uuid, "true")):
            enemy.change(control, {"value": value})
        link = view._panel._link
        assert link is not None
        for value in ("no such link", "", 1.0, None, ["link1"]):  # not among its options
            enemy.change(link._impl.uuid, {"value": value})
        buttons = enemy.control("all")
        enemy.change(buttons, {"value": "Self-destruct"})
        settle(view, enemy)
        assert link.value == "the tip"
        assert view._panel.steps.value != "Self-destruct"
        assert vars(force._impl) == before
        assert switch.value is False
        enemy.change(switch._impl.uuid, {"value": True})  # what everybody may do
        wait_for(lambda: view.shown.setting.sag)
        most = view._panel.largest_force
        for value, kept in ((1e300, most), (-(2**63), -most), (3, 3.0)):  # within its range
            enemy.change(force._impl.uuid, {"value": value})
            wait_for(lambda kept=kept: view.shown.setting.force[2] == kept)
        enemy.change(buttons, {"value": "Reset"})
        wait_for(lambda: not view.shown.setting.sag)


def test_a_client_drags_the_tip_and_nothing_else(view: View) -> None:
    here, drag = [0.2, 0.01, -0.03], {"type": "TransformControlsUpdateMessage", "owner": ""}
    straight: dict[str, Any] = {"name": "/target", "wxyz": [1.0, 0.0, 0.0, 0.0]}

    def is_there() -> bool:
        posture: Any = view.shown.posture
        return bool(np.allclose(posture.tip[:3, 3], here, atol=1e-9))  # sliders have 1e-9 degrees

    with Client(view) as someone:
        someone.send(drag | straight | {"position": here})
        wait_for(is_there)
        places: list[Any] = [[math.nan, 0, 0], [1e300, 0, 0], here[:2], "abc", [True] * 3, {}]
        for place in places:
            someone.send(drag | straight | {"position": place})
        someone.send(drag | straight | {"name": "/arm", "position": [0.0, 0.0, 0.0]})
        settle(view, someone)
        assert is_there()
        assert not node(view, "/arm").position.any()


def test_every_other_message_of_viser_is_dropped(view: View, tunnel: threading.Event) -> None:
    from viser import _messages

    others = sorted(
        {*_messages.Message._subclass_from_type_string()}
        - {"ViewerCameraMessage", "GuiUpdateMessage"}
    )
    assert {"ShareUrlRequest", "RemoveSceneNodeMessage", "FileTransferStartUpload"} <= set(others)
    with Client(view) as enemy:
        control = enemy.control("force z [N]")
        for kind in others:
            enemy.send({"type": kind, "uuid": control, "name": "/arm", "owner": ""})
        settle(view, enemy)
    assert not tunnel.wait(0.5)
    assert node(view, "/arm").visible


def test_bytes_that_are_no_message_end_nobodys_view(view: View, tunnel: threading.Event) -> None:
    twice = msgspec.msgpack.encode({"type": "ViewerCameraMessage", "typo": "ShareUrlRequest"})
    rng = np.random.default_rng(0)
    hostile: list[bytes | str] = [
        *(b"", b"\xc1", b"\x93\x01", b"\x91" * 50_000 + b"\x01", b"\xa1\xff", "text"),
        twice.replace(b"typo", b"type"),  # the first says a camera, the last a tunnel
        msgspec.msgpack.encode(["GuiUpdateMessage"]),
        msgspec.msgpack.encode({"type": ["GuiUpdateMessage"]}),
        *(rng.bytes(20) for _ in range(50)),
    ]
    with Client(view) as enemy:
        for message in hostile:
            enemy.send(message)
        settle(view, enemy)
    with Client(view) as enemy:
        enemy.send(bytes(2**17))  # more than a page ever has to say
        with pytest.raises(exceptions.ConnectionClosed):
            enemy.control("no such")
    with Client(view) as friend:
        settle(view, friend, value=1.5)
    assert not tunnel.is_set()


def test_a_viser_that_cannot_be_guarded_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    from cdsm.view import guard

    # where viser is known to ask for a server, had it looked elsewhere
    monkeypatch.setattr(guard, "websocket_server", SimpleNamespace(serve=None))
    threads = threading.active_count()
    with pytest.raises(cdsm.CdsmError, match="cannot be guarded"):
        serve(soft_arm(), port=0)
    wait_for(lambda: threading.active_count() <= threads)

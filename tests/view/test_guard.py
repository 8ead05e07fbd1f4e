"""Hostile clients of the live view, on this machine, against the real server."""

import logging
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.view import View, serve
from tests.view.test_view import DEGREES, STABLE, node, soft_arm

viser = pytest.importorskip("viser", reason="the extra [view] is not installed")
msgspec = pytest.importorskip("msgspec")
zstandard = pytest.importorskip("zstandard")
client = pytest.importorskip("websockets.sync.client")
exceptions = pytest.importorskip("websockets.exceptions")

PATIENCE = 60.0
"""Seconds that an answer may take to come on a busy machine."""

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [0.0, -1.0, 0.0],
    "fov": 0.8,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0, 0, 0],
    "up_direction": [0.0, 0.0, 1.0],
}
"""What a page sends first."""


def started(**options: Any) -> View:
    return serve(
        soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0, **options
    )


@pytest.fixture(autouse=True)
def tunnel(monkeypatch: pytest.MonkeyPatch) -> threading.Event:
    """Set when viser is asked for a public tunnel, which no test may open."""
    asked = threading.Event()
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda *_, **__: asked.set())
    return asked


@pytest.fixture
def view() -> Iterator[View]:
    with started() as page:
        yield page


def port_of(view: View) -> int:
    return int(view._server.get_port())


class Client:
    """Speaks viser's protocol, and whatever else it likes."""

    def __init__(
        self, view: View, *, host: str = "127.0.0.1", path: str = "", origin: str | None = None
    ) -> None:
        port = port_of(view)
        self._socket = client.connect(
            f"ws://{host}:{port}{path}",
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
        self.send_raw(msgspec.msgpack.encode(message))

    def send_raw(self, message: bytes | str) -> None:
        self._socket.send(message)

    def change(self, control: str, updates: dict[str, Any]) -> None:
        self.send({"type": "GuiUpdateMessage", "uuid": control, "updates": updates})

    def messages(self) -> Iterator[dict[str, Any]]:
        """What the server sends, until nothing comes any more."""
        while True:
            raw = self._socket.recv(timeout=PATIENCE)
            size = int.from_bytes(raw[8:16], "little")
            unpacked = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + size])
            yield from msgspec.msgpack.decode(unpacked)["messages"]

    def find(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        return next(message for message in self.messages() if wanted(message))

    def control(self, label: str) -> str:
        """Identity of a control, as it is sent to everybody who may read the scene."""
        found = self.find(lambda one: one.get("props", {}).get("label") == label)
        return str(found["uuid"])


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it has not come about"
        time.sleep(0.01)


def settle(view: View, sender: Client, axis: int = 0, value: float = 0.5) -> None:
    """Wait until all that a client has sent so far is done: its messages keep their order."""
    handle = view._controls._force[axis].handle
    sender.change(handle._impl.uuid, {"value": value})
    wait_for(lambda: handle.value == value)


def page_status(view: View, host: str, path: str = "/", **headers: str) -> int:
    """Status of the answer to a plain request, under whatever name and path."""
    lines = [f"GET {path} HTTP/1.1", *(f"{k}: {v}" for k, v in {"Host": host, **headers}.items())]
    at = view._server.get_host()
    with socket.create_connection((at if ":" in at else "127.0.0.1", port_of(view))) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        return int(connection.recv(12)[9:])


def is_refused(view: View, **options: Any) -> bool:
    try:
        with Client(view, **options):
            return False
    except exceptions.InvalidStatus as error:
        return bool(error.response.status_code == 403)


# --- who may connect ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "origin",
    [
        "https://evil.example",
        "http://evil.example:{port}",
        "http://127.0.0.1:{other}",
        "http://127.0.0.1",
        "http://localhost:{port}",  # is not 127.0.0.1 to a browser
        "http://127.0.0.1:{port}.evil.example",
        "http://127.0.0.1:{port}@evil.example",
        "ftp://127.0.0.1:{port}",
        "null",
        "",
    ],
)
def test_a_page_of_another_origin_reads_nothing(view: View, origin: str) -> None:
    port = port_of(view)
    assert is_refused(view, origin=origin.format(port=port, other=port + 1))
    assert view._guard.refused == 1


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost.evil.example",
        "evil.localhost",
        "0.0.0.0",
        "192.168.0.1",
        "[::ffff:192.168.0.1]",
    ],
)
def test_a_name_that_is_not_this_machine_is_not_served(view: View, host: str) -> None:
    port = port_of(view)
    # after DNS rebinding the page is of the same origin as its name for this server
    assert is_refused(view, host=host, origin=f"http://{host}:{port}")
    assert page_status(view, f"{host}:{port}") == 403
    assert page_status(view, host) == 403


def test_a_request_without_one_host_is_not_served(view: View) -> None:
    for hosts in ("", "Host: 127.0.0.1\r\nHost: evil.example\r\n"):
        with socket.create_connection(("127.0.0.1", port_of(view))) as connection:
            connection.sendall(f"GET / HTTP/1.1\r\n{hosts}\r\n".encode())
            assert connection.recv(100).startswith(b"HTTP/1.1 403")


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "LOCALHOST", "127.0.0.2", "[::1]"])
def test_this_machine_is_served_under_all_its_names(view: View, host: str) -> None:
    port = port_of(view)
    name = f"{host}:{port}"
    assert page_status(view, name) == 200
    assert page_status(view, name, Origin=f"http://{name}") == 200
    assert page_status(view, "localhost:9000") == 200  # a tunnel of ssh has a port of its own
    with Client(view, host=host, origin=f"http://{name.lower()}") as friend:
        assert friend.control("force z [N]")
    assert view._guard.refused == 0


# --- what they may send -------------------------------------------------------------------------


def test_no_client_opens_a_public_tunnel(view: View, tunnel: threading.Event) -> None:
    with Client(view) as enemy:
        enemy.send({"type": "ShareUrlRequest"})
        enemy.send({"type": "ShareUrlDisconnect"})
        settle(view, enemy)
    assert not tunnel.wait(0.5)
    assert view._guard.refused == 2


@pytest.mark.parametrize(
    "updates",
    [
        {"update_cb": []},
        {"removed": True},
        {"uuid": "another"},
        {"is_button": True},
        {"sync_cb": None},
        {"props": None},
        {"value": 1.5, "update_cb": []},
        {"value": 1.5, "no such": 1},
        {},
    ],
)
def test_a_client_changes_nothing_of_a_slider_but_its_value(
    view: View, updates: dict[str, Any]
) -> None:
    handle = view._controls._force[2].handle
    before = dict(vars(handle._impl))
    callbacks = list(handle._impl.update_cb)
    with Client(view) as enemy:
        enemy.change(enemy.control("force z [N]"), updates)
        settle(view, enemy)
        assert vars(handle._impl) == before
        assert handle._impl.update_cb == callbacks
        assert view._guard.refused == 1
    # the slider is alive for all: with an attribute of it changed, it was not
    with Client(view) as friend:
        friend.change(friend.control("force z [N]"), {"value": -2.5})
        wait_for(lambda: view.shown.setting.force[2] == -2.5)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "7", None, True, [1.0], {}])
def test_what_is_no_number_moves_no_slider(view: View, value: object) -> None:
    with Client(view) as enemy:
        enemy.change(enemy.control("force z [N]"), {"value": value})
        settle(view, enemy)
    assert view._controls._force[2].handle.value == 0.0
    assert view._guard.refused == 1


@pytest.mark.parametrize(
    ("value", "expected"), [(1e300, 20.0), (20.1, 20.0), (-(2**63), -20.0), (3, 3.0), (-20, -20.0)]
)
def test_a_slider_stays_within_its_range_and_its_sender_is_told(
    view: View, value: float, expected: float
) -> None:
    with Client(view) as sender, Client(view) as other:
        control = sender.control("force z [N]")
        assert other.control("force z [N]") == control
        sender.change(control, {"value": value})
        told = {"type": "GuiUpdateMessage", "uuid": control, "updates": {"value": expected}}
        receivers = (other, sender) if value != expected else (other,)
        for each in receivers:
            assert each.find(lambda one: one.get("uuid") == control and "updates" in one) == told
        assert view._controls._force[2].handle.value == expected
        wait_for(lambda: view.shown.setting.force[2] == expected)
    assert view._guard.refused == 0


def test_only_controls_take_values_and_only_their_own(view: View) -> None:
    text, switch = view._controls._text, view._controls._sag
    with Client(view) as enemy:
        buttons = enemy.control("all")
        for control, value in (
            (text._impl.uuid, 1.0),
            ("no such", 1.0),
            (buttons, True),
            (buttons, 1.0),
            (buttons, "no such"),
            (buttons, ["Reset"]),
            (switch._impl.uuid, 1),
            (switch._impl.uuid, "true"),
            (switch._impl.uuid, None),
        ):
            enemy.change(control, {"value": value})
        settle(view, enemy)
        assert view._guard.refused == 9
        assert view._controls._force[0].handle.value == 0.5
        assert switch.value is False
        enemy.change(switch._impl.uuid, {"value": True})  # what everybody may do
        wait_for(lambda: view.shown.setting.sag)
        enemy.change(buttons, {"value": "Reset"})
        wait_for(lambda: view._controls._force[0].handle.value == 0.0)
        wait_for(lambda: not view.shown.setting.sag)


HERE = [0.2, 0.01, -0.03]
DRAG = {"type": "TransformControlsUpdateMessage", "name": "/target", "owner": ""}
CLICK = {"type": "ScenePointerMessage", "event_type": "click", "modifier": None}


def test_a_client_drags_the_tip_and_nothing_else(view: View) -> None:
    with Client(view) as friend:
        friend.send({"type": "TransformControlsDragStartMessage", "name": "/target", "owner": ""})
        friend.send(DRAG | {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": HERE})
        friend.send({"type": "TransformControlsDragEndMessage", "name": "/target", "owner": ""})
        wait_for(lambda: tip_at(view, HERE))
        assert view._guard.refused == 0
        before = node(view, "/cables/0").points.copy()
        turned = [math.nan, "x", None, 1e300]
        # of a turned handle the place alone is taken
        friend.send(DRAG | {"wxyz": turned, "position": [0.2, 0.0, 0.0]})
        wait_for(lambda: tip_at(view, [0.2, 0.0, 0.0]))
        assert node(view, "/target").wxyz.tolist() == [1.0, 0.0, 0.0, 0.0]
        assert (node(view, "/cables/0").points != before).any()
    places: list[Any] = [[math.nan, 0.0, 0.0], [1e300, 0.0, 0.0], HERE[:2], "abc", [True] * 3, {}]
    hostile: list[dict[str, Any]] = [
        DRAG | {"name": "/arm", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": HERE},
        {"type": "TransformControlsDragStartMessage", "name": "/arm", "owner": ""},
        *(DRAG | {"wxyz": [1.0, 0.0, 0.0, 0.0], "position": place} for place in places),
    ]
    with Client(view) as enemy:
        for message in hostile:
            enemy.send(message)
        settle(view, enemy)
    assert view._guard.refused == len(hostile)
    assert tip_at(view, [0.2, 0.0, 0.0])


def test_a_click_names_the_cable_that_it_hits(view: View) -> None:
    end = view.shown.posture.cable_paths[4][-1]  # type: ignore[union-attr]
    ray = {"ray_origin": [0.1, -1.0, 0.3], "screen_pos": [[0.5, 0.5]]}
    with Client(view) as friend:
        way = [float(x) for x in end - np.array(ray["ray_origin"])]
        friend.send(CLICK | ray | {"ray_direction": way})
        wait_for(lambda: view._server.scene.get_handle_by_name("/names/4") is not None)
        assert node(view, "/names/4").text.startswith("cable2_2: ")
        friend.send(CLICK | ray | {"ray_direction": [0.0, 0.0, 1.0]})  # past the arm
        wait_for(lambda: not node(view, "/names/4").visible)
        assert view._guard.refused == 0
        nowhere: list[Any] = [[math.inf, 0.0, 0.0], [0.0, 0.0, 0.0], None]
        for place in nowhere:
            friend.send(CLICK | ray | {"ray_direction": place})
        friend.send(CLICK | ray | {"event_type": "rect-select"})
        settle(view, friend)
        assert view._guard.refused == 4


def tip_at(view: View, place: list[float]) -> bool:
    posture = view.shown.posture
    assert posture is not None
    return bool(np.allclose(posture.tip[:3, 3], place, atol=1e-9))  # sliders have 1e-9 degrees


def test_every_other_message_of_viser_is_dropped(view: View) -> None:
    from viser import _messages

    allowed = {"ViewerCameraMessage", "GuiUpdateMessage"}
    others = sorted(set(_messages.Message._subclass_from_type_string()) - allowed)
    assert {"GuiRemoveMessage", "RemoveSceneNodeMessage", "FileTransferStartUpload"} <= set(others)
    with Client(view) as enemy, Client(view) as other:
        control = enemy.control("force z [N]")
        for kind in others:
            enemy.send({"type": kind, "uuid": control, "name": "/arm", "owner": ""})
        settle(view, enemy)
        assert view._guard.refused == len(others)
        other.find(lambda one: one.get("updates") == {"value": 0.5})  # and none was passed on
    assert node(view, "/arm").visible


def test_bytes_that_are_no_message_end_nobodys_view(view: View) -> None:
    twice = msgspec.msgpack.encode({"type": "ViewerCameraMessage", "typo": "ShareUrlRequest"})
    rng = np.random.default_rng(0)
    hostile: list[bytes | str] = [
        b"",
        b"\xc1",
        b"\x93\x01",
        b"\x91" * 50_000 + b"\x01",
        b"\xa1\xff",
        "text",
        twice.replace(b"typo", b"type"),  # the first says a camera, the last a tunnel
        msgspec.msgpack.encode(["GuiUpdateMessage"]),
        msgspec.msgpack.encode({"type": ["GuiUpdateMessage"]}),
        *(rng.bytes(20) for _ in range(50)),
    ]
    with Client(view) as enemy:
        for message in hostile:
            enemy.send_raw(message)
        settle(view, enemy)
    assert view._guard.refused == len(hostile)
    with Client(view) as enemy:
        enemy.send_raw(bytes(2**17))  # more than a page ever has to say
        with pytest.raises(exceptions.ConnectionClosed):
            list(enemy.messages())
    with Client(view) as friend:
        settle(view, friend, value=1.5)


# --- where other machines can connect -----------------------------------------------------------


@pytest.fixture
def open_view(caplog: pytest.LogCaptureFixture) -> Iterator[View]:
    with caplog.at_level(logging.WARNING, "cdsm"), started(host="0.0.0.0") as page:
        yield page


def test_the_network_needs_the_token(open_view: View, caplog: pytest.LogCaptureFixture) -> None:
    token = open_view._guard.token
    assert open_view.url == f"http://0.0.0.0:{port_of(open_view)}/{token}/"
    assert len(token) == 43  # 256 bits
    [warning] = [record.getMessage() for record in caplog.get_records("setup")]
    assert "0.0.0.0" in warning
    assert "whoever reaches this machine over the network and has the URL" in warning
    assert token not in warning
    host = f"arm.example:{port_of(open_view)}"
    for path in ("", token[:-1], token + "x", token.swapcase(), "%2e", "é", "x/../" + token):
        assert page_status(open_view, host, f"/{path}") == 403
        assert page_status(open_view, host, f"/{path}/?token={token}") == 403
    for path in ("/", "/wrong", f"/?token={token}"):
        assert is_refused(open_view, host="arm.example", path=path)
    # another page does not have it, and would be seen if it had
    assert is_refused(open_view, path=f"/{token}", origin="https://evil.example")
    for path in (f"/{token}", f"/{token}/", f"/{token}/index.html", f"/{token}/?websocket=x"):
        assert page_status(open_view, host, path) == 200
    assert page_status(open_view, host, f"/{token}/no/such") == 404
    with Client(open_view, host="arm.example", path=f"/{token}", origin=f"http://{host}") as friend:
        settle(open_view, friend)


def test_every_view_has_a_token_of_its_own() -> None:
    with started(host="0.0.0.0") as first, started(host="0.0.0.0") as second:
        assert first._guard.token != second._guard.token


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_this_machine_alone_needs_no_token(host: str, caplog: pytest.LogCaptureFixture) -> None:
    with started(host=host) as view:
        assert view._guard.token == ""
        assert page_status(view, view.url.removeprefix("http://")) == 200
    assert not caplog.records


# --- how viser is guarded -----------------------------------------------------------------------


def test_servers_of_others_are_not_touched() -> None:
    from websockets.asyncio import server

    before = server.serve
    alone = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    with started() as view:
        assert server.serve is before
        with client.connect(
            f"ws://127.0.0.1:{alone.get_port()}",
            origin="https://evil.example",
            subprotocols=[f"viser-v{viser.__version__}"],
        ) as connection:
            assert connection.recv(timeout=PATIENCE)
        assert page_status(view, "arm.example") == 403
    alone.stop()


def test_a_viser_that_cannot_be_guarded_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    from websockets.asyncio import server

    from cdsm.view import guard

    class Elsewhere:
        """Where viser is known to ask for a server, had it looked elsewhere."""

        serve = server.serve

    monkeypatch.setattr(guard, "websocket_server", Elsewhere)
    threads = threading.active_count()
    with pytest.raises(cdsm.CdsmError, match="cannot be guarded"):
        started()
    wait_for(lambda: threading.active_count() <= threads)

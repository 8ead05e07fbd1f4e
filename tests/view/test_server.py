"""The live view, without a browser: its scene, its controls, its path, and what it refuses."""

import importlib.util
import re
import socket
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.status import Status
from cdsm.view import serve
from cdsm.view.live_view import View
from tests.support import foreign
from tests.view.test_state import DEGREES, STABLE, soft_arm

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("viser") is None, reason="the extra [view] is not installed"
)
PATH = np.deg2rad(np.outer(np.linspace(0.0, 1.0, 5), DEGREES))


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as page:
        yield page


def node(view: View, name: str) -> Any:
    handle = view._server.scene.get_handle_by_name(name)
    assert handle is not None
    return handle


def test_the_scene_holds_the_arm_where_the_api_has_it() -> None:
    """Whatever the order of its joints."""
    plain = soft_arm()
    arm = cdsm.Manipulator.from_urdf(
        plain.urdf, plain.cables, tip=plain.tip_link, joint_names=plain.joint_names[::-1]
    )
    q = np.deg2rad(DEGREES)
    pose = plain.at(q)
    with serve(arm, port=0, q=q[::-1], minimum=STABLE) as view:
        for link in ("link1", "link3"):  # shape 0 of a link is its backbone, half a link along x
            place = pose.link_pose(link)
            middle = place[:3, 3] + 0.03 * place[:3, 0]
            shape = node(view, f"/arm/visual/{link}_0")
            np.testing.assert_allclose(shape.position, middle, atol=1e-12)
        for i, path in enumerate(pose.cable_paths):
            ends = np.stack([path[:-1], path[1:]], axis=1)
            # a browser holds float32
            np.testing.assert_allclose(node(view, f"/cables/{i}").points, ends, atol=1e-7)
        assert node(view, "/ellipsoid").visible
    crab = foreign.crab()  # without shapes, and with joints that slide
    with serve(crab, port=0, q=foreign.POSTURE, minimum=0.0) as view:
        bones = crab.at(foreign.POSTURE).bones
        np.testing.assert_allclose(node(view, "/sticks").points, bones, atol=1e-7)
        shown = np.where(crab.slides, 1e3 * foreign.POSTURE, np.rad2deg(foreign.POSTURE))
        np.testing.assert_allclose([joint.value for joint in view._panel.joints], shown)


def test_numbers_beyond_all_limits_do_not_end_the_view(view: View) -> None:
    joint, force = view._panel.joints[0], view._panel._load[2]
    for slider, status in ((joint, Status.BEYOND_LIMITS), (force, Status.INVALID_INPUT)):
        before = slider.value
        slider.value = 1e16  # type: ignore[misc]
        assert view.shown.status is status
        assert not node(view, "/forces").visible
        assert not node(view, "/ellipsoid").visible
        slider.value = before  # type: ignore[misc]
        assert view.shown.status is Status.OK
        assert node(view, "/arm").visible


def test_a_path_is_played_to_its_end_and_again() -> None:
    with serve(soft_arm(), port=0, minimum=STABLE, angles=PATH) as view:
        player = view._player
        assert player is not None
        tips = [view.arm.at(q).tip[:3, 3] for q in PATH]
        np.testing.assert_allclose(node(view, "/path").points[:, 0], tips[:-1], atol=1e-7)
        np.testing.assert_allclose(view.shown.setting.q, PATH[0], atol=1e-11)
        player.sample.value = 3.0  # type: ignore[misc]
        # sliders keep 1e-9 degrees
        np.testing.assert_allclose(view.shown.setting.q, PATH[2], atol=1e-10)
        player._speed.value = 30.0  # type: ignore[misc]
        for _ in range(2):  # from the third sample, then from the start
            player.play()
            assert player.sample.value == 5.0
            np.testing.assert_allclose(view.shown.setting.q, PATH[4], atol=1e-10)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"port": 70000}, "port: 70000"),
        ({"minimum": -1.0}, "minimum: -1 N given"),
        ({"q": [0.0]}, "q: shape"),
        ({"angles": [*PATH[:3], np.full(6, 3.0)]}, "angles: sample 4: "),
        ({"angles": PATH, "tips": np.zeros((2, 3))}, "both of angles= and tips="),
        ({}, " is not available (Address"),
    ],
)
def test_bad_input_is_named_and_nothing_is_left_running(
    options: dict[str, Any], match: str
) -> None:
    threads = threading.active_count()
    with (
        socket.create_server(("127.0.0.1", 0)) as other,
        pytest.raises(cdsm.CdsmError, match=re.escape(match)),
    ):
        serve(soft_arm(), **({"port": other.getsockname()[1]} | options))
    assert threading.active_count() == threads

"""The live view: what it computes, and what a browser shows of it."""

import importlib.util
import logging
import math
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from cdsm.view import Condition, Setting, View, serve, show
from cdsm.view.panel import page_text
from cdsm.view.worker import Worker
from tests.support import foreign
from tests.support.patience import HANGS

GEOMETRY: dict[str, Any] = {
    "joints": 3,
    "cables_per_joint": 3,
    "link_length": 0.06,
    "base_length": 0.03,
    "disk_offset": 0.012,
    "hole_radius": 0.02,
    "link_mass": 0.1,
    "lead": 0.3,
}
DEGREES = [10.0, 5.0, -8.0, 12.0, 6.0, -4.0]
STABLE, UNSTABLE, INFEASIBLE = 20.0, 60.0, 150.0
"""Least tensions [N] at which the soft arm is each of them, none above 200 N."""


def soft_arm() -> cdsm.Manipulator:
    """Springs in series: it buckles before the tensions are infeasible."""
    geometry = cdsm.Geometry.universal(**GEOMETRY)
    law = cdsm.LinearElasticity(2e5)
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=8000.0)
    return cdsm.Manipulator(geometry, cables=cables)


def setting(
    arm: cdsm.Manipulator,
    minimum: float = STABLE,
    force: tuple[float, float, float] = (0.0, 0.0, 0.0),
    q: Array | None = None,
) -> Setting:
    return Setting(
        q=np.deg2rad(DEGREES[: arm.nv]) if q is None else q,
        minimum=minimum,
        maximum=200.0,
        force=np.array(force),
    )


def numbers(text: str) -> dict[str, str]:
    """What the page says, by name."""
    return dict(re.findall(r'data-cdsm="([\w-]+)">([^<]*)<', text))


# --- what is computed ---------------------------------------------------------------------------


def test_a_stable_arm_is_shown_with_the_numbers_of_the_api() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, force=(0.5, -1.0, -2.0)))
    pose = arm.at(np.deg2rad(DEGREES))
    pull = cdsm.distribute_tension(pose, STABLE, 200.0, (0.5, -1.0, -2.0, 0, 0, 0))
    K = cdsm.stiffness(pose, pull)
    assert shown.condition is Condition.STABLE
    assert shown.along is not None
    np.testing.assert_array_equal(shown.along, [K.along(u) for u in np.eye(3)])
    said = numbers(page_text(shown, 0.01))
    for axis, u in zip("xyz", np.eye(3), strict=True):
        assert said[f"along-{axis}"] == f"{K.along(u) / 1000.0:.4g}"
    assert said["margin"] == f"{K.margin:.4g}"
    assert said["largest-tension"] == f"{pull.values.max():.4g}"
    assert said["smallest-tension"] == f"{pull.values.min():.4g}"
    assert said["tip"] == ", ".join(f"{1000.0 * x:.1f}" for x in pose.tip[:3, 3])
    assert arm.cables[int(pull.values.argmax())].name in page_text(shown, 0.01)
    # the softest direction is one in which K.along is least, of all directions
    assert shown.principal is not None
    assert said["softest"] == f"{shown.principal['softest'] / 1000.0:.4g}"
    # 1e-9: an eigenvalue of C_vv against its inverse along the eigenvector
    soft = K.along(shown.principal["softest_direction"])
    np.testing.assert_allclose(shown.principal["softest"], soft, rtol=1e-9)
    directions = np.random.default_rng(0).normal(size=(200, 3))
    assert all(K.along(u) >= soft * (1.0 - 1e-9) for u in directions)
    assert all(K.along(u) <= shown.principal["stiffest"] * (1.0 + 1e-9) for u in directions)


def test_the_ellipsoid_is_where_forces_of_one_size_move_the_tip() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm))
    assert shown.stiffness is not None
    assert shown.ellipsoid is not None
    C = shown.stiffness.compliance[:3, :3]
    moved = shown.ellipsoid.surface.reshape(3, -1) - shown.stiffness.posture.tip[:3, 3:]
    force = np.linalg.solve(shown.ellipsoid.scale * C, moved)
    np.testing.assert_allclose(np.linalg.norm(force, axis=0), 1.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("minimum", "force", "condition"),
    [
        (UNSTABLE, 0.0, Condition.UNSTABLE),
        (STABLE, -20.0, Condition.UNSTABLE),
        (INFEASIBLE, 0.0, Condition.INFEASIBLE),
        (-1.0, 0.0, Condition.INVALID),
        (201.0, 0.0, Condition.INVALID),
    ],
)
def test_where_it_does_not_hold_no_stiffness_is_said(
    minimum: float, force: float, condition: Condition
) -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, minimum, (0.0, 0.0, force)))
    said = numbers(page_text(shown, 0.01))
    assert shown.condition is condition
    assert said["condition"] == condition.value
    assert said["problem"]
    assert shown.along is None
    assert shown.principal is None
    assert shown.ellipsoid is None
    assert not {"along-x", "softest", "stiffest"} & set(said)
    assert ("margin" in said) == (condition is Condition.UNSTABLE)
    assert ("largest-tension" in said) == (condition is Condition.UNSTABLE)
    if condition is Condition.UNSTABLE:
        assert float(said["margin"]) < 0.0


def test_a_posture_that_is_none_shows_nothing_but_why() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, q=np.full(6, 3.0)))
    assert shown.condition is Condition.NO_POSTURE
    said = numbers(page_text(shown, 0.01))
    assert set(said) == {"condition", "problem"}
    assert "joint1_1" in said["problem"]
    assert shown.cable_colors is None


def test_numbers_that_no_arm_has_are_refused() -> None:
    arm = soft_arm()
    for refused in (
        setting(arm, q=np.full(6, 1e16)),
        setting(arm, 1e16),
        setting(arm, force=(0.0, 1e16, 0.0)),
    ):
        assert show(arm, refused).condition is Condition.INVALID


def test_cables_outside_their_elasticity_keep_their_tensions() -> None:
    arm = cdsm.Manipulator(cdsm.Geometry.universal(**GEOMETRY), cdsm.presets.STRAND_1X19)
    shown = show(arm, setting(arm, 1.0))
    assert shown.condition is Condition.OUTSIDE_ELASTICITY
    said = numbers(page_text(shown, 0.01))
    assert "largest-tension" in said
    assert "margin" not in said
    assert shown.stiffness is None


def test_names_and_messages_are_text_and_not_markup() -> None:
    robot, law = foreign.TREE, cdsm.LinearElasticity(3e4)
    cables = [cdsm.Cable(f"<b>{cable.name}&", cable.sites, law) for cable in foreign.cables(law)]
    arm = cdsm.Manipulator.from_urdf(robot, cables, tip="tip", gravity=(0.0, 0.0, 0.0))
    shown = show(arm, Setting(q=foreign.POSTURE, minimum=-1.0, force=np.zeros(3)))
    text = page_text(shown, 0.01)
    assert "<b>" not in text
    weightless = show(arm, Setting(q=foreign.POSTURE, minimum=0.0, force=np.zeros(3)))
    assert weightless.tension is not None
    assert "&lt;b&gt;c" in page_text(weightless, 0.01)


# --- one thread for many ------------------------------------------------------------------------


def test_what_is_asked_while_it_works_is_done_once_for_the_newest() -> None:
    started, go_on = threading.Event(), threading.Event()
    state, seen = [0], []

    def job() -> None:
        seen.append(state[0])
        started.set()
        assert go_on.wait(HANGS)

    worker = Worker(job)
    worker.request()
    assert started.wait(HANGS)
    threads = [threading.Thread(target=worker.request) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    state[0] = 1
    go_on.set()
    worker.wait()
    assert seen == [0, 1]
    worker.close()
    worker.request()  # after the end: nothing happens
    worker.wait()
    assert seen == [0, 1]


# --- the server ---------------------------------------------------------------------------------

needs_viser = pytest.mark.skipif(
    importlib.util.find_spec("viser") is None, reason="the extra [view] is not installed"
)


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as page:
        yield page


def node(view: View, name: str) -> Any:
    handle = view._server.scene.get_handle_by_name(name)
    assert handle is not None
    return handle


@needs_viser
def test_the_scene_holds_the_arm_where_the_api_has_it(view: View) -> None:
    pose = view.arm.at(np.deg2rad(DEGREES))
    for link in ("link1", "link3"):  # shape 0 of a link is its backbone, half a link along x
        place = pose.link_pose(link)
        middle = place[:3, 3] + 0.03 * place[:3, 0]
        shape = node(view, f"/arm/visual/{link}_0")
        np.testing.assert_allclose(shape.position, middle, atol=1e-12)
    for i, path in enumerate(pose.cable_paths):
        # a browser holds float32
        np.testing.assert_allclose(node(view, f"/cables/{i}").points[:, 0], path[:-1], atol=1e-7)
        np.testing.assert_allclose(node(view, f"/cables/{i}").points[:, 1], path[1:], atol=1e-7)
    assert node(view, "/ellipsoid").visible
    assert not node(view, "/sticks").visible


@needs_viser
def test_the_scene_holds_an_arm_whose_joints_are_told_in_another_order() -> None:
    plain = soft_arm()
    arm = cdsm.Manipulator.from_urdf(
        plain.urdf, plain.cables, tip=plain.tip_link, joint_names=plain.joint_names[::-1]
    )
    q = np.deg2rad(DEGREES)
    with serve(arm, port=0, q=q[::-1]) as view:
        for link in ("link1", "link3"):
            place = plain.at(q).link_pose(link)
            middle = place[:3, 3] + 0.03 * place[:3, 0]
            shape = node(view, f"/arm/visual/{link}_0")
            np.testing.assert_allclose(shape.position, middle, atol=1e-12)


@needs_viser
def test_nothing_is_written_into_the_arm() -> None:
    arm = soft_arm()
    before = arm._body._model.copy()
    with serve(arm, port=0, q=np.deg2rad(DEGREES)):
        pass
    assert arm._body._model == before


@pytest.mark.parametrize("shapes", ["none", "a mesh that is not there"])
@needs_viser
def test_robots_without_shapes_are_sticks(shapes: str, caplog: pytest.LogCaptureFixture) -> None:
    robot = foreign.TREE
    if shapes != "none":
        visual = '<visual><geometry><mesh filename="package://lost/x.stl"/></geometry></visual>'
        robot = robot.replace('<link name="floor">', f'<link name="floor">{visual}')
    arm = cdsm.Manipulator.from_urdf(
        robot, foreign.cables(cdsm.LinearElasticity(3e4)), tip="tip", gravity=(0.0, 0.0, 0.0)
    )
    with serve(arm, port=0, q=foreign.POSTURE, minimum=0.0) as view:
        assert view.shown.posture is not None
        sticks = node(view, "/sticks")
        assert sticks.visible
        np.testing.assert_allclose(sticks.points, view.shown.posture.bones, atol=1e-7)
        assert view._server.scene.get_handle_by_name("/arm/visual/floor_0") is None
    assert ("lost/x.stl" in caplog.text) == (shapes != "none")


@needs_viser
def test_a_fault_of_our_own_leaves_no_number_behind(
    view: View, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: object) -> None:
        raise np.linalg.LinAlgError("did not converge")

    with monkeypatch.context() as patch, caplog.at_level(logging.ERROR):
        patch.setattr("cdsm.view.live_view.show", broken)
        view._worker.request()
        shown = view.shown
    assert shown.condition is Condition.FAILED
    assert numbers(view._controls._text.content) == {
        "condition": "FAILED",
        "problem": "LinAlgError: did not converge",
    }
    assert not node(view, "/cables").visible
    assert not node(view, "/ellipsoid").visible
    assert "did not converge" in caplog.text
    view._worker.request()
    assert view.shown.condition is Condition.STABLE
    assert node(view, "/cables").visible


@needs_viser
def test_no_number_that_is_typed_ends_the_view() -> None:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE) as view:
        fields = [view._controls._joints[0].handle, view._controls._force[1].handle]
        seen = []
        for field in fields:
            before = field.value
            field.value = 1e16  # type: ignore[misc]
            seen.append(view.shown.condition)
            assert not node(view, "/force").visible
            assert not node(view, "/ellipsoid").visible
            field.value = before  # type: ignore[misc]
            seen.append(view.shown.condition)
            assert node(view, "/arm").visible
        stable = Condition.STABLE
        assert seen == [Condition.NO_POSTURE, stable, Condition.INVALID, stable]


@needs_viser
def test_a_port_in_use_is_named_and_nothing_is_left_running() -> None:
    threads = threading.active_count()
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(cdsm.InvalidInput, match=f"port: {port} on 127.0.0.1 is not available"):
            serve(soft_arm(), port=port)
    with pytest.raises(cdsm.InvalidInput, match="host"):
        serve(soft_arm(), host="no.such.host.invalid", port=0)
    assert threading.active_count() == threads


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"port": 70000}, "port: 70000"),
        ({"port": "8080"}, "port: '8080'"),
        ({"host": 7}, "host: 7"),
        ({"minimum": -1.0}, "minimum: -1 N given"),
        ({"force": (1.0, 2.0)}, "force: shape"),
        ({"largest_tension": 0.0}, "largest_tension: 0 N given"),
        ({"largest_force": math.nan}, "largest_force"),
        ({"q": np.full(6, 3.0)}, "joint1_1"),
        ({"q": [0.0]}, "q: shape"),
        ({"solver": "no such"}, "no installed solver is called 'no such'"),
    ],
)
@needs_viser
def test_bad_input_is_named(options: dict[str, Any], match: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=re.escape(match)):
        serve(soft_arm(), **options)


@needs_viser
def test_without_viser_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(cdsm.MissingExtra, match=r"\.\[view\]"):
        serve(soft_arm(), port=0)


@pytest.mark.slow
@needs_viser
def test_the_command_serves_until_ctrl_c(tmp_path: Path) -> None:
    lines = [f"{name} = {value}" for name, value in GEOMETRY.items()]
    file = tmp_path / "probe.toml"
    file.write_text("\n".join(["[universal]", 'name = "probe"', *lines]), encoding="utf-8")
    command = [sys.executable, "-m", "cdsm", "view", str(file), "--port", "0", "--set", "wire=2e5"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        assert process.stdout is not None
        said = ""
        while "shown at" not in said:
            line = process.stdout.readline()
            assert line, "ended before it served"
            said += line
        process.send_signal(signal.SIGINT)
        rest, wrong = process.communicate(timeout=HANGS)
    assert process.returncode == 0
    assert re.search(r"shown at http://127\.0\.0\.1:\d+; Ctrl-C ends it", said)
    assert not rest
    assert not wrong.strip()

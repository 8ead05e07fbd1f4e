"""What surrounds the sliders: lists, commands, names, cameras, the handle and the path."""

import math
import re
import shlex
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.support.format import JointUnits
from cdsm.view import Setting, View, serve, show
from cdsm.view.cable_names import clicked_cable
from cdsm.view.camera import Ball, placed
from cdsm.view.command import command_line, python_lines
from cdsm.view.panel import page_text, tensions_text
from cdsm.view.surroundings import section
from tests.support import foreign
from tests.support.patience import HANGS
from tests.view.test_view import (
    DEGREES,
    GEOMETRY,
    STABLE,
    needs_viser,
    node,
    numbers,
    setting,
    soft_arm,
)

# --- what is written ----------------------------------------------------------------------------


def test_the_list_names_cables_at_their_bounds() -> None:
    arm = soft_arm()
    free = show(arm, setting(arm)).tension
    assert free is not None
    # just what the largest needs, which three cables for two joints leave no choice of
    most = (1.0 + 1e-12) * float(free.values.max())
    shown = show(arm, replace(setting(arm), maximum=most))
    assert shown.tension is not None
    listed = numbers(tensions_text(shown))
    for c, (cable, F) in enumerate(zip(arm.cables, shown.tension.values, strict=True)):
        assert listed[f"tension-{c}"] == f"{F:.4g}"
        near = {"at lower bound": F - STABLE, "at upper bound": most - F}
        tight = [words for words, way in near.items() if way < 1e-6]
        assert listed[f"bound-{c}"] == "".join(tight), cable.name
    assert set(listed.values()) > {"at lower bound", "at upper bound", ""}


def test_the_legend_says_what_is_drawn_to_which_scale() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, force=(0.0, 0.0, -2.0)))
    said = numbers(page_text(shown, 0.0123))
    assert shown.ellipsoid is not None
    assert said["ellipsoid"] == (
        f"ellipsoid: where 1 N moves the tip, scale {shown.ellipsoid.scale:g}:1"
    )
    assert said["arrow"] == "arrow: force at the tip, 12.3 mm per N"
    assert "arrow" not in numbers(page_text(show(arm, setting(arm)), 0.01))


# --- commands -----------------------------------------------------------------------------------


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "soft arm.toml"  # a blank is quoted
    lines = [f"{name} = {value}" for name, value in GEOMETRY.items()]
    path.write_text("\n".join(["[universal]", *lines]), encoding="utf-8")
    return path


SETTINGS: dict[str, dict[str, Any]] = {
    "plain": {},
    "bound from above": {"maximum": 60.0, "force": np.array([0.5, -1.0, -2.0])},
    "other angles": {"q": np.array([0.1, -0.123456789, 0.0, -0.0, 0.3, 1e-9])},
    "sag": {"sag": True, "force": np.array([0.2, -0.3, -0.5])},
    "sag without force": {"sag": True},
    "other solver": {"solver": "clarabel", "minimum": 12.345678},
}


@pytest.mark.parametrize("changes", SETTINGS.values(), ids=SETTINGS)
def test_the_command_prints_what_the_page_shows(file: Path, changes: dict[str, Any]) -> None:
    arm = soft_arm()
    at = replace(Setting(q=setting(arm).q, minimum=STABLE, force=np.zeros(3)), **changes)
    shown = show(arm, at)
    line = command_line(arm, at, [str(file), "--rigidity=2e5", "--spring=8"])
    words = shlex.split(line)
    assert words[0] == "cdsm"
    assert shown.tensions is not None
    result = CliRunner().invoke(app, words[1:])
    assert result.exit_code == 0, result.output
    if words[1] == "weigh":
        # the weight test divides the load; both end where the imbalance is rounding
        tensions = re.findall(r"^cable\d_\d\s+(\S+)", result.output, re.MULTILINE)
    else:
        tensions = re.findall(r"^cable\d_\d\s+(\S+)$", result.output, re.MULTILINE)
        assert shown.along is not None
        along = " ".join(f"{value / 1e3:.4g}" for value in shown.along)
        assert along in re.sub(r"\s+", " ", result.output)
    assert tensions == [f"{F:.3f}" for F in shown.tensions]


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("changes", SETTINGS.values(), ids=SETTINGS)
def test_the_lines_of_python_compute_what_the_page_shows(
    changes: dict[str, Any], friction: float
) -> None:
    arm = soft_arm().with_friction(friction)
    at = replace(Setting(q=setting(arm).q, minimum=STABLE, force=np.zeros(3)), **changes)
    names: dict[str, object] = {"arm": arm, "cdsm": cdsm}
    exec(python_lines(arm, at), names)
    shown = show(arm, at)
    rest, K = names.get("rest"), names.get("K")
    found = K if rest is None else rest
    assert isinstance(found, cdsm.Stiffness | cdsm.Equilibrium)
    assert shown.tensions is not None
    # twelve digits are printed
    np.testing.assert_allclose(found.tension, shown.tensions, rtol=1e-9)


def test_joints_that_slide_are_given_in_millimetres() -> None:
    crab = foreign.crab()
    line = command_line(crab, Setting(q=foreign.POSTURE, minimum=0.0, force=np.zeros(3)), ["x"])
    [angles] = re.findall(r"--angles=(\S+)", line)
    scales = [scale for _, scale in JointUnits(crab.slides).shown]
    given = np.array([float(word) for word in angles.split(",")])
    np.testing.assert_allclose(given * scales, foreign.POSTURE, rtol=1e-11)


# --- names in the picture -----------------------------------------------------------------------


def test_a_click_takes_the_nearest_cable_as_the_camera_sees_it() -> None:
    pose = soft_arm().at(np.deg2rad(DEGREES))
    eye = np.array([0.05, -0.8, 0.2])
    for c, path in enumerate(pose.cable_paths):
        for start, end in pairwise(path):
            hit = clicked_cable(pose.cable_paths, eye, (start + end) / 2.0 - eye)
            assert hit is not None
            # another cable may pass before or behind the middle of this one
            if hit != c:
                ray = (start + end) / 2.0 - eye
                other = pose.cable_paths[hit] - eye
                points = (
                    other[:-1, None]
                    + np.linspace(0, 1, 200)[:, None] * np.diff(other, axis=0)[:, None]
                )
                points = points.reshape(-1, 3)
                cosines = points @ ray / np.linalg.norm(points, axis=1) / np.linalg.norm(ray)
                assert math.acos(min(1.0, cosines.max())) < 0.002
    assert clicked_cable(pose.cable_paths, eye, np.array([0.0, 0.0, 1.0])) is None
    away = eye - pose.cable_paths[0][0]  # behind the camera
    assert clicked_cable(pose.cable_paths, eye, away) is None


# --- cameras and grid ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("aspect", "free"), [(1.5, 1.0), (0.8, 1.0), (390.0 / 844.0, 0.4), (2.5, 1.0), (1.0, 0.4)]
)
def test_a_camera_sees_the_whole_ball(aspect: float, free: float) -> None:
    ball, direction = Ball(np.array([0.1, 0.0, -0.02]), 0.13), np.array([0.3, -1.0, 0.4])
    position, look_at = placed(ball, direction, aspect, free)
    back = direction / np.linalg.norm(direction)
    np.testing.assert_allclose(np.cross(position - look_at, back), 0.0, atol=1e-12)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    seen = ball.middle - position
    depth = -(seen @ back)
    high = math.tan(math.radians(22.5))
    up, aside = seen @ np.cross(back, right) / depth / high, seen @ right / depth / high
    radius = ball.radius / depth / high
    assert abs(aside) < 1e-9
    assert radius < aspect
    # the picture reaches from -1 to 1
    assert 1.0 - 2.0 * free <= up - radius
    assert up + radius <= 1.0


def test_cameras_follow_an_arm_that_folds_and_not_every_motion() -> None:
    ball = Ball(np.zeros(3), 1.0)
    assert ball.fits(Ball(np.array([0.2, 0.0, 0.0]), 0.9))
    assert not ball.fits(Ball(np.array([0.5, 0.0, 0.0]), 0.9))
    assert not ball.fits(Ball(np.zeros(3), 0.3))


@pytest.mark.parametrize(
    ("length", "step"), [(0.21, 0.05), (0.3, 0.1), (0.29, 0.05), (1.0, 0.2), (0.011, 0.002)]
)
def test_lines_with_a_length_are_at_round_numbers(length: float, step: float) -> None:
    assert section(length) == pytest.approx(step, rel=1e-12)


# --- the server ---------------------------------------------------------------------------------

PATH = np.deg2rad(np.outer(np.linspace(0.0, 1.0, 5), DEGREES))


@pytest.fixture
def view() -> Iterator[View]:
    with serve(soft_arm(), port=0, minimum=STABLE, angles=PATH) as page:
        yield page


@needs_viser
def test_a_path_is_played_to_its_end_and_again(view: View) -> None:
    player = view._player
    assert player is not None
    tips = [view.arm.at(q).tip[:3, 3] for q in PATH]
    np.testing.assert_allclose(node(view, "/path").points[:, 0], tips[:-1], atol=1e-7)
    np.testing.assert_allclose(view.shown.setting.q, PATH[0], atol=1e-11)
    player._sample.value = 3.0  # type: ignore[misc]
    # sliders keep 1e-9 degrees
    np.testing.assert_allclose(view.shown.setting.q, PATH[2], atol=1e-10)
    player._speed.value = 30.0  # type: ignore[misc]
    for _ in range(2):  # from the third sample, then from the start
        player._play(True)
        assert player._button.label == "Pause"
        assert _within(lambda: player._button.label == "Play")
        assert player._sample.value == 5.0
        np.testing.assert_allclose(view.shown.setting.q, PATH[4], atol=1e-10)
    player._play(True)
    player._play(False)
    held = player._sample.value
    assert not _within(lambda: player._sample.value > held + 1.0, 0.5)


@needs_viser
def test_a_path_of_tips_is_followed_by_inverse_kinematics() -> None:
    tips = np.array([[0.2, 0.01 * i, -0.01 * i] for i in range(4)])
    tips[3] = [0.5, 0.0, 0.0]  # out of reach
    with serve(soft_arm(), port=0, minimum=STABLE, tips=tips) as view:
        assert view._player is not None
        for i in range(3):
            view._player._sample.value = float(i + 1)  # type: ignore[misc]
            assert view.shown.posture is not None
            np.testing.assert_allclose(view.shown.posture.tip[:3, 3], tips[i], atol=1e-9)
            assert "remark" not in numbers(view._controls._text.content)
        view._player._sample.value = 4.0  # type: ignore[misc]
        assert view.shown.posture is not None
        said = numbers(view._controls._text.content)["remark"]
        off = 1e3 * np.linalg.norm(view.shown.posture.tip[:3, 3] - tips[3])
        assert f"it is {off:.3g} mm away" in said
        # and it is forgotten at once elsewhere
        view._controls._joints[0].handle.value = 5.0  # type: ignore[misc]
        _ = view.shown
        assert "remark" not in numbers(view._controls._text.content)


@needs_viser
def test_a_path_beyond_a_limit_is_refused_with_its_sample() -> None:
    path = PATH.copy()
    path[3, 1] = 3.0
    with pytest.raises(cdsm.InvalidInput, match=r"angles: sample 4: .*joint1_2"):
        serve(soft_arm(), port=0, angles=path)
    with pytest.raises(cdsm.InvalidInput, match="both of angles= and tips="):
        serve(soft_arm(), port=0, angles=path, tips=np.zeros((2, 3)))


@needs_viser
def test_boxes_beside_sliders_have_room_for_their_digits() -> None:
    with serve(soft_arm(), port=0, q=np.deg2rad([30.0, 12.3456789, -8, 0, 6, -4])) as view:
        for joint in view._controls._joints:
            assert joint.handle.precision == 1
        shown = view.shown.setting.q  # the angle itself is not rounded
        np.testing.assert_allclose(np.rad2deg(shown[:2]), [30.0, 12.3456789], rtol=1e-14)


@needs_viser
def test_links_without_shapes_among_others_are_sticks() -> None:
    shape = "<visual><geometry><sphere radius='0.05'/></geometry></visual>"
    robot = foreign.TREE.replace('<link name="floor">', f'<link name="floor">{shape}')
    arm = cdsm.Manipulator.from_urdf(
        robot, foreign.cables(cdsm.LinearElasticity(3e4)), tip="tip", gravity=(0.0, 0.0, 0.0)
    )
    with serve(arm, port=0, q=foreign.POSTURE, minimum=0.0) as view:
        pose = view.shown.posture
        assert pose is not None
        assert node(view, "/arm/visual/floor_0") is not None
        drawn = {bone.tobytes() for bone in node(view, "/sticks").points}
        bones = {bone.astype(np.float32).tobytes() for bone in np.array(pose.bones)}
        base = {bone.astype(np.float32).tobytes() for bone in np.array(pose._bones[0])}
        assert drawn == bones - base
        assert base
        sites = sum(len(cable.sites) for cable in arm.cables)
        assert 0 < len(node(view, "/brackets").points) < sites


def _within(condition: Callable[[], bool], seconds: float = HANGS) -> bool:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True

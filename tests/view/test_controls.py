"""What surrounds the sliders: lists, commands, names, cameras, the handle and the path."""

import re
import shlex
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.support.format import JointUnits
from cdsm.view import Setting, View, serve, show
from cdsm.view.command import command_line, python_lines
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
    line = command_line(arm, at, [str(file), "--set=wire=2e5", "--set=series_stiffness=8e3"])
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
        base = {bone.astype(np.float32).tobytes() for row, bone in pose._bones if row == 0}
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

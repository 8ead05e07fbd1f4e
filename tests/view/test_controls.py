"""Each control of the page, without a browser: what it does, by its handlers."""

import html
import json
import re
import shlex
from collections.abc import Iterator
from concurrent import futures
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.status import Status
from cdsm.view import history, live_view, serve
from cdsm.view.curve import compute_curve
from cdsm.view.live_view import View
from cdsm.view.ranges import force_range, tension_range
from cdsm.view.state import Setting
from cdsm.view.texts import about_text, answer_text, head_text, matrix_text, tensions_text
from tests.view.test_state import (
    DEGREES,
    INFEASIBLE,
    STABLE,
    UNSTABLE,
    along,
    numbers,
    pulled,
    rod,
    setting,
    show,
    soft_arm,
)

pytest.importorskip("viser", reason="the extra [view] is not installed")


@pytest.fixture(scope="module")
def shared() -> Iterator[View]:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as page:
        yield page


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The page completes itself at once."""
    monkeypatch.setattr(live_view, "_REST", 0.01)


@pytest.fixture
def view(shared: View) -> Iterator[View]:
    yield shared
    shared._panel.reset()
    assert shared.shown.status is Status.OK


def settled(view: View) -> Any:
    """What is shown, after what comes when the sliders rest."""
    shown = view.shown
    assert view._later is not None
    futures.wait([view._later])
    return shown


class Browser:
    """What a button gets of the browser in which it was pressed."""

    def __init__(self, eye: tuple[float, float, float] = (0.0, -1.0, 0.0)) -> None:
        self.camera = SimpleNamespace(position=np.array(eye), look_at=np.zeros(3))
        self.files: dict[str, bytes] = {}
        self.notes: list[str] = []

    def send_file_download(self, name: str, content: bytes, save_immediately: bool) -> None:
        assert save_immediately
        self.files[name] = content

    def add_notification(self, title: str, body: str, **_: object) -> None:
        self.notes.append(body)


def answer(words: list[str]) -> Any:
    """What a command prints as JSON."""
    return json.loads(CliRunner().invoke(app, [*words, "--json"]).output)


def press(view: View, group: str, button: str, browser: Browser | None = None) -> None:
    event: Any = SimpleNamespace(target=SimpleNamespace(value=button), client=browser)
    {"all": view._step, "save": view._save}[group](event)
    futures.wait([view._thread.submit(int)])  # all that was asked for is done
    settled(view)


def test_undo_goes_back_change_by_change(view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change ends with a second in which nothing moves."""
    clock = [1e9]
    monkeypatch.setattr(history, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    panel = view._panel
    start = panel.values
    seen = [start]

    def rest() -> None:
        settled(view)
        clock[0] += 1.0
        seen.append(panel.values)

    panel.joints[0].value = 3.0  # type: ignore[misc]
    rest()
    panel._load[0].value = 25.0
    rest()
    panel._sag.value = True
    rest()
    press(view, "all", "Straight")  # many sliders, one change
    assert not view.shown.setting.q.any()
    rest()
    for degrees in (1.0, 2.0, 3.0):  # dragging is one change
        panel.joints[1].value = degrees  # type: ignore[misc]
        settled(view)
    rest()
    assert len(set(seen)) == 6
    for before in seen[4::-1]:
        press(view, "all", "Undo")
        assert panel.values == before
        assert view.shown.setting.sag is before[-2]
    np.testing.assert_allclose(view.shown.setting.q, np.deg2rad(DEGREES))
    press(view, "all", "Undo")  # there is no more
    assert panel.values == start


def test_ten_changes_can_be_undone_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(history, "_PAUSE", 0.0)
    past = history.History((0,))
    for k in range(1, 15):
        past.note((k,))
        past.rest()
    assert [past.back() for _ in range(12)] == [*((k,) for k in range(13, 3, -1)), None, None]


def test_sliders_end_at_the_bounds_of_the_arm(view: View) -> None:
    snake = cdsm.Manipulator.read(Path(__file__).parents[1] / "data" / "snake.toml")
    start = Setting(q=np.zeros(snake.nv), minimum=0.0, force=np.zeros(3))
    assert tension_range(snake, start) == (10.0, 130.0, 10.0)
    held = [cdsm.payload(snake.at(start.q), u).following for u in ("y", "-y", "z", "-z")]
    most = max(case.force for case in held if case is not None)
    assert 2.0 * most <= force_range(snake, start) < 2.0 * most * 1.5  # rounded up
    strand = cdsm.presets.virtual_prototype()
    begin = Setting(q=np.zeros(strand.nv), minimum=15.0, force=np.zeros(3))
    law = strand.cables[0].elasticity
    assert tension_range(strand, begin) == (law.low, law.high, 15.0)
    # a rod: the force that moves its tip by 5 % of its length
    thin = rod()
    straight = Setting(q=np.zeros(thin.nv), minimum=0.0, force=np.zeros(3), pull=np.zeros(3))
    sag = 0.05 * thin.length * cdsm.forward_statics(thin, pull=np.zeros(3)).along("z")
    assert sag <= force_range(thin, straight) <= 2.0 * sag
    # on a link it holds more, and the sliders follow the choice
    panel = view._panel
    assert panel._link is not None
    at_tip = panel.largest_force
    panel._link.value = "link2"
    _ = view.shown
    near = force_range(view.arm, replace(panel._start, link="link2"))
    assert near > 1.5 * at_tip
    pose = view.arm.at(panel._start.q)
    held = [
        cdsm.payload(pose, u, STABLE, 200.0, link="link2").limits["tension"]
        for u in ("y", "-y", "z", "-z")
    ]
    assert 2.0 * max(held) <= near < 4.0 * max(held)
    assert {(slider.min, slider.max) for slider in panel._load[1:]} == {(-near, near)}
    panel._load[1].value = near
    panel._link.value = "the tip"
    _ = view.shown
    assert panel._load[1].max == near  # the force stays
    panel._load[1].value = 0.0
    panel._link.value = "link2"
    _ = view.shown
    panel._link.value = "the tip"
    _ = view.shown
    assert panel._load[3].max == at_tip
    for joint, low, high in zip(view._panel.joints, view.arm.lower, view.arm.upper, strict=True):
        assert np.rad2deg(low) <= joint.min < joint.max <= np.rad2deg(high)


def test_bars_have_the_lengths_and_bounds_of_the_tensions() -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm))
    assert shown.tension is not None
    F = shown.tension
    rows = re.findall(r'<div class="tension".*?</div>', tensions_text(shown))
    assert len(rows) == len(F)
    top = 0.0
    for name, value, row, color in zip(F.keys(), F.values, rows, shown.cable_colors, strict=True):
        (width,) = re.findall(r"width:([\d.]+)%", row)
        (bound,) = re.findall(r"-1px ([\d.]+)%", row)  # the upper one is far beyond the bars
        assert float(width) / value == pytest.approx(float(bound) / STABLE, rel=2e-3)
        top = top or 100.0 * value / float(width)
        assert top == pytest.approx(1.05 * F.values.max(), rel=1e-3)
        assert f"rgb{color}" in row
        assert name in row
        assert f"{value:.4g} N {'min' if name in F.at_minimum else ''}</span>" in row
    assert "bounds" in tensions_text(shown)
    assert "from 20 to 200 N" in re.sub("<[^>]*>", "", tensions_text(shown))
    high = show(arm, setting(arm, 60.0))
    assert high.tension is not None
    marks = re.findall(r"-1px ([\d.]+)%", tensions_text(high))
    assert len(marks) == 2 * len(F)  # now both bounds are in the picture
    assert float(marks[1]) / float(marks[0]) == pytest.approx(200.0 / 60.0, rel=1e-3)
    assert tensions_text(pulled(0.004, -0.006, 0.0)).count("slack</span>") == 1


def test_bars_say_the_share_of_the_breaking_force() -> None:
    arm = cdsm.Manipulator.read(Path(__file__).parents[2] / "examples" / "arm.toml", "7x7-0.8mm")
    shown = show(arm, setting(arm, q=np.full(arm.nv, 0.05)))
    assert shown.tension is not None
    page = tensions_text(shown)
    for value, share in zip(shown.tension.values, shown.tension.breaking_share, strict=True):
        assert f">{value:.4g} N {100.0 * share:.3g} %" in page
    largest = shown.tension.values.argmax()
    said = answer_text(shown, SimpleNamespace(cell=0.01))  # type: ignore[arg-type]
    name = arm.cables.names[largest]
    assert f"largest share of a breaking force: {name}" in said
    assert "%" not in re.sub("<[^>]*>", "", tensions_text(show(soft_arm(), setting(soft_arm()))))


def test_long_names_break_at_their_underscores_alone() -> None:
    path = Path(__file__).parents[2] / "examples" / "finger_with_pulleys.toml"
    arm = cdsm.Manipulator.read(path)
    page = tensions_text(show(arm, setting(arm, q=np.deg2rad([5.0, 20.0, 30.0, 15.0]))))
    assert "flexor_<wbr>of_<wbr>the_<wbr>middle" in page
    assert "wbr" not in tensions_text(show(soft_arm(), setting(soft_arm())))


def test_the_curve_is_the_stiffness_under_each_least_tension(view: View) -> None:
    curve = view._panel.curve
    settled(view)
    pose = view.arm.at(np.deg2rad(DEGREES))
    for axis in "zx":
        curve.axis.value = axis  # type: ignore[assignment]
        settled(view)
        levels, stiff, here = curve.chart.data
        assert (np.diff(levels) > 0.0).all()
        for k in (0, 5, 20):
            F = cdsm.distribute_tension(pose, levels[k], 200.0)
            K = cdsm.stiffness(pose, F).along(axis)
            assert stiff[k] == pytest.approx(1e-3 * K, rel=1e-9)
        (at,) = np.flatnonzero(np.isfinite(here))
        assert levels[at] == STABLE
        K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, STABLE, 200.0))
        assert here[at] == pytest.approx(1e-3 * K.along(axis))
    critical = cdsm.critical_tension(pose).minimum
    said = curve._said.content
    (above,) = re.findall(r"UNSTABLE above ([\d.]+) N", said)
    assert float(above) == pytest.approx(critical, abs=0.25)  # a thousandth of the slider
    assert "along x [N/mm]" in said
    view._panel.joints[0].value = 9.0  # type: ignore[misc]
    _ = view.shown
    assert np.isnan(curve.chart.data[2]).all()  # the mark is not where the arm is any more
    assert "of the setting before" in curve._said.content
    settled(view)
    assert np.isfinite(curve.chart.data[2]).sum() == 1
    # locked motors: the curve is that of the arm as it was tensioned
    view._panel._load[3].value = -0.5
    view._panel._sag.value = True
    settled(view)
    levels, stiff, here = curve.chart.data
    pose = view.arm.at(view.shown.setting.q)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, STABLE, 200.0))
    assert np.nanmax(here) == pytest.approx(1e-3 * K.along("x"))


def test_the_curve_ends_where_the_maximum_leaves_no_tensions() -> None:
    arm = soft_arm()
    at = replace(setting(arm), maximum=50.0)
    curve = compute_curve(show(arm, at), "z", (0.0, 50.0), lambda: False)
    assert curve is not None
    pose = arm.at(at.q)
    low, high = 0.0, 50.0
    while high - low > 1e-3:
        middle = (low + high) / 2.0
        try:
            cdsm.distribute_tension(pose, middle, 50.0)
            low = middle
        except cdsm.InfeasibleTension:
            high = middle
    (above,) = re.findall(r"INFEASIBLE above ([\d.]+) N", "; ".join(curve.gaps))
    assert float(above) == pytest.approx(low, abs=0.06)
    last = curve.tension[np.isfinite(curve.along)][-1]
    assert last == pytest.approx(low, abs=0.06)
    assert compute_curve(show(arm, at), "z", (0.0, 50.0), lambda: True) is None


def test_the_matrix_is_that_of_the_tip(view: View) -> None:
    shown = settled(view)
    K = np.asarray(shown.stiffness.spatial())
    cells = re.findall(r'<td style="text-align:right">(.*?)</td>', view._panel._matrix.content)
    written = np.array([float(cell) for cell in cells]).reshape(6, 6)
    written[:, :3] *= 1e3  # per mm
    np.testing.assert_allclose(written, K, rtol=1e-3, atol=1e-9)
    assert "force [N], moment [N m] per mm and rad" in view._panel._matrix.content
    assert "cdsm.stiffness(pose, tension)" in view._panel._python.content
    view._panel._load[0].value = UNSTABLE
    _ = view.shown
    assert view._panel._matrix.content == view._panel._python.content == ""
    settled(view)
    assert "no stiffness" in view._panel._matrix.content
    arm = soft_arm()
    alike = show(arm, setting(arm, q=np.full(6, 0.1)))  # lacks a motion
    assert alike.stiffness is not None
    text = matrix_text(alike)
    cells = re.findall(r'<td style="text-align:right">(.*?)</td>', text)
    written = 1e3 * np.array([float(cell) for cell in cells]).reshape(3, 3)
    np.testing.assert_allclose(written, alike.stiffness.cartesian, rtol=1e-3, atol=1e-6)
    assert "cannot" in text


@pytest.mark.parametrize("sag", [False, True])
def test_a_force_on_a_link_acts_there(view: View, sag: bool) -> None:
    panel = view._panel
    assert panel._link is not None
    assert panel._link.options == ("the tip", "link2", "link3")  # no joint moves link1
    panel._link.value = "link2"
    panel._load[3].value = -0.8
    panel._sag.value = sag
    shown = settled(view)
    pose = view.arm.at(np.deg2rad(DEGREES))
    W = {"link2": [0.0, 0.0, -0.8, 0.0, 0.0, 0.0]}
    page = re.sub("<[^>]*>", " ", panel._head.content)
    if sag:
        F = cdsm.distribute_tension(pose, STABLE, 200.0)
        rest = cdsm.equilibrium(pose, F, W)
        np.testing.assert_allclose(shown.rest.displacement, rest.displacement, atol=1e-10)
        assert "displacement of link2" in panel._answer.content
        stiffness = rest.along
    else:
        F = cdsm.distribute_tension(pose, STABLE, 200.0, W)
        np.testing.assert_allclose(shown.tensions, F.values, atol=1e-9)
        stiffness = cdsm.stiffness(pose, F).along
    there = ", ".join(f"{1e-3 * stiffness(u, 'link2'):.4g}" for u in np.eye(3))
    assert re.search(rf"the same of link2\s+{re.escape(there)}", page)
    names: dict[str, Any] = {"arm": view.arm, "cdsm": cdsm}
    lines = re.search(r"<pre[^>]*>(.*?)\n\n", panel._python.content, re.DOTALL)
    assert lines is not None
    exec(html.unescape(lines[1]), names)
    again = names["rest"] if sag else names["K"]
    np.testing.assert_allclose(again.tension, shown.tensions, rtol=1e-9)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_locked_motors_buckle_under_a_force_on_a_link_as_under_one_at_the_tip(
    friction: float,
) -> None:
    """The tip's link by name is the tip; and friction takes rows of loads by link."""
    arm = soft_arm().with_friction(friction)
    at = replace(setting(arm, force=(0.0, 0.0, -3.0)), sag=True)
    one, other = show(arm, at), show(arm, replace(at, link=arm.tip_link))
    assert one.heading == other.heading
    assert one.rest is not None
    assert other.rest is not None
    np.testing.assert_allclose(one.rest.pose.tip, other.rest.pose.tip, atol=1e-9)


def test_the_posture_is_saved_as_lines_that_compute_the_same(
    view: View, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The program runs; the command in its first lines gives the same numbers."""
    path = Path(__file__).parents[2] / "examples" / "arm.toml"
    arm = cdsm.Manipulator.read(path)
    q = np.deg2rad([4.0, -3.0, 8.0, 2.0, -5.0, 6.0, 1.0, 7.0])
    with serve(arm, port=0, q=q, minimum=25.0, force=(0.2, 0.0, -0.4)) as page:
        browser = Browser()
        press(page, "save", "Posture", browser)
        (text,) = browser.files.values()
        assert list(browser.files) == ["arm_posture.py"]
        K = page.shown.stiffness
        assert K is not None
        program = text.decode().replace("'ARM.toml'", repr(str(path)))
        names: dict[str, Any] = {}
        exec(program, names)
        assert str(names["K"]) in capsys.readouterr().out
        np.testing.assert_allclose(names["K"].joint, K.joint, rtol=1e-9, atol=1e-9)
        command = shlex.split(program.splitlines()[1].removeprefix("# cdsm "))
        said = answer([*command[:1], str(path), *command[2:]])
        np.testing.assert_allclose(said["along_N_per_m"], [K.along(u) for u in "xyz"], rtol=1e-9)
        assert f"# stiffness along x, y, z: {along(K)} N/mm" in program
        page._panel._link.value = "link2"  # type: ignore[union-attr]
        for sag in (False, True):
            page._panel._sag.value = sag
            press(page, "save", "Posture", browser)
            line = next(iter(browser.files.values())).decode().splitlines()[1]
            command = shlex.split(line.removeprefix("# cdsm "))
            said = answer([command[0], str(path), *command[2:]])
            K, rest = page.shown.stiffness, page.shown.rest
            assert K is not None
            if rest is None:
                along_axes = [K.along(u) for u in "xyz"]
                np.testing.assert_allclose(said["along_N_per_m"], along_axes, rtol=1e-9)
            else:  # where the weight hangs
                moved = page.shown.moved_point
                assert command[0] == "weigh"
                np.testing.assert_allclose(said["displacements_m"][-1], moved, rtol=1e-6)


def test_saved_lines_have_the_file_and_its_changes(tmp_path: Path) -> None:
    """The command of the view is that of a shell, with --set; the program has them too."""
    path = tmp_path / "MY ARM.toml"
    path.write_bytes((Path(__file__).parents[2] / "examples" / "arm.toml").read_bytes())
    changes = {
        "minimum": 25.0,
        "universal": {"link_mass": 0.2, "link_length": [0.05, 0.06, 0.05, 0.04]},
    }
    changes |= {"cables.cable1_1.maximum": 300.0, "wire": "7x7-0.8mm"}
    arm = cdsm.Manipulator.read(path, changes=changes)
    q = np.deg2rad([4.0, -3.0, 8.0, 2.0, -5.0, 6.0, 1.0, 7.0])
    with serve(arm, port=0, q=q, minimum=10.0, file=path, changes=changes) as page:
        browser = Browser()
        press(page, "save", "Posture", browser)
        (text,) = browser.files.values()
        K = page.shown.stiffness
        assert K is not None
        shown = html.unescape(page._panel._python.content)
        assert "put the name" not in text.decode()
    names: dict[str, Any] = {}
    exec(text.decode(), names)
    np.testing.assert_allclose(names["K"].joint, K.joint, rtol=1e-9, atol=1e-9)
    line = text.decode().splitlines()[1].removeprefix("# ")
    assert line in shown
    assert line.count("--set") == 5
    said = answer(shlex.split(line)[1:])
    np.testing.assert_allclose(said["along_N_per_m"], [K.along(u) for u in "xyz"], rtol=1e-9)


def test_the_command_tells_the_view_its_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    pages = list[View]()
    monkeypatch.setattr(View, "wait", lambda page: pages.append(page))
    path = str(Path(__file__).parents[2] / "examples" / "arm.toml")
    words = ["--set", "minimum=25", "--set", "universal.link_mass=.2", "--set", "wire=7x7-0.8mm"]
    result = CliRunner().invoke(app, ["view", path, "--port", "0", *words])
    assert result.exit_code == 0, result.output
    (page,) = pages
    again = [path, "--set", "minimum=25", "--set", "universal.link_mass=0.2"]
    again += ["--set", 'wire="7x7-0.8mm"']
    assert shlex.split(page._source.arguments) == again


def test_the_page_says_which_motors_the_arm_has() -> None:
    pair = cdsm.Motor("m1", {"cable1_1": 0.012}, stiffness=20.0)
    assert "m1 (cable1_1 +12 mm): holds its angle by 20 N m/rad" in about_text(
        soft_arm().with_motors([pair])
    )
    assert "motor" not in about_text(soft_arm())


def test_a_force_may_start_on_a_link() -> None:
    options: dict[str, Any] = {"port": 0, "minimum": STABLE, "force": (0.0, 0.0, -0.5)}
    with serve(soft_arm(), link="link3", **options) as page:
        assert page.shown.setting.link == "link3"
        assert page._panel._link is not None
        assert page._panel._link.value == "link3"
    with serve(soft_arm(), link="tool0", **options) as page:
        assert page.shown.setting.link == ""
    for name in ("base_link", "link1"):
        with pytest.raises(cdsm.CdsmError, match=f"link: {name} .*the tip, link2"):
            serve(soft_arm(), link=name, **options)


def test_the_picture_is_an_svg_of_what_the_browser_shows(view: View) -> None:
    def cables(eye: tuple[float, float, float]) -> tuple[set[str], str]:
        browser = Browser(eye)
        press(view, "save", "Picture", browser)
        (content,) = browser.files.values()
        tree = ElementTree.fromstring(content)
        ids = {str(node.get("id")) for node in tree.iter()}
        (line,) = (node for node in tree.iter() if node.get("id") == "cable:cable1_1:0")
        return ids, str(line[0].get("d"))

    ids, front = cables((0.0, -1.0, 0.0))
    assert {f"cable:{name}:0" for name in view.arm.cables.names} <= ids
    assert "compliance" in ids
    assert "force" not in ids
    panel = view._panel
    for minimum in (STABLE, UNSTABLE, INFEASIBLE):  # without tensions there is an arrow too
        panel._load[0].max = 1e9  # the slider ends where the arm does
        panel._load[0].value = minimum
        panel._link.value = "link2"  # type: ignore[union-attr]
        panel._load[3].value = -0.8
        _ = view.shown
        ids, _ = cables((0.0, -1.0, 0.0))
        assert "force:link2" in ids
    panel._link.value = "the tip"  # type: ignore[union-attr]
    _ = view.shown
    ids, _ = cables((0.0, -1.0, 0.0))
    assert "force" in ids
    panel.reset()
    _, above = cables((0.0, -1.0, 1.0))
    assert front != above
    _, broken = cables((np.nan, 0.0, 0.0))  # whatever a browser says of its camera
    assert broken not in ("", front)
    view._panel.joints[0].value = 1e6  # type: ignore[misc]
    browser = Browser()
    press(view, "save", "Picture", browser)
    assert browser.files == {}
    assert browser.notes == ["There is no posture to draw."]


@pytest.mark.parametrize(
    ("minimum", "color", "ink"),
    [
        (STABLE, "#e6f4ee", "#00734f"),
        (UNSTABLE, "#b34700", "#fff"),
        (INFEASIBLE, "#b34700", "#fff"),
    ],
)
def test_the_banner_has_the_colour_of_the_verdict(minimum: float, color: str, ink: str) -> None:
    arm = soft_arm()
    shown = show(arm, setting(arm, minimum))
    banner = head_text(shown).split("</div>")[0]
    assert banner.endswith(shown.heading)
    assert f"background:{color};color:{ink};" in banner


def test_soft_arms_are_read_in_newton_per_metre_and_slack_ones_on_their_softer_side() -> None:
    shown = pulled(0.004, -0.006, 0.0)
    rest = shown.rest
    assert rest is not None
    said = numbers(shown)
    softest = next(value for name, value in said.items() if name.startswith("softest"))
    assert float(softest) == pytest.approx(
        1.0 / np.linalg.norm(rest.compliance[:3, :3], 2), rel=1e-3
    )
    assert f'{softest}</td><td style="white-space:nowrap">&nbsp;N/m</td>' in head_text(shown)
    arm = soft_arm()
    loose = show(arm, setting(arm, 0.0))
    K = loose.stiffness
    assert K is not None
    assert K.slack
    values = numbers(loose)["stiffness along x, y, z, softer side"].split(",")
    softer = [1e-3 * min(K.along(u), K.along(-u)) for u in np.eye(3)]
    np.testing.assert_allclose([float(x) for x in values], softer, rtol=1e-3)
    assert any(K.along(u) != pytest.approx(K.along(-u)) for u in np.eye(3))


def test_a_narrow_window_shows_the_whole_arm_above_the_panel(view: View) -> None:
    """Projected through the camera, all joints are within the upper 40 % of a phone."""
    pose = view.shown.posture
    assert pose is not None
    points = np.vstack(pose.bones)

    def seen(width: int, height: int) -> Any:
        start = view._server.initial_camera
        camera: Any = SimpleNamespace(image_width=width, image_height=height)
        camera.position, camera.look_at = np.array(start.position), np.array(start.look_at)
        view._scene.fit(camera)
        sight = camera.look_at - camera.position
        sight = sight / np.linalg.norm(sight)
        right = np.cross(sight, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        rows = np.array([right, np.cross(right, sight), sight])
        x, y, z = rows @ (points - camera.position).T
        half = np.tan(np.pi / 8.0)
        return x / z / half * height / width, y / z / half

    x, y = seen(480, 900)
    assert abs(x).max() < 1.0
    assert 0.2 < y.min() < y.max() < 1.0
    for size in ((800, 1000), (1280, 1000)):
        x, y = seen(*size)
        assert max(abs(x).max(), abs(y).max()) < 1.0
        assert np.ptp(x) > 0.8  # it fills the window

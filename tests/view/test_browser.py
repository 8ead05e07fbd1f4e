"""What a browser shows of the live view: its numbers, its picture, and what its user can do."""

import math
import os
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.cli.path_file import read_path
from cdsm.support.values import Array
from cdsm.view import View, serve
from tests.support.patience import HANGS
from tests.support.tracking import small_path
from tests.view.test_view import (
    DEGREES,
    INFEASIBLE,
    STABLE,
    UNSTABLE,
    needs_viser,
    node,
    soft_arm,
)

OUTPUT = Path(__file__).parents[2] / "test-output"

CHROMIUM = next(
    (
        path
        for name in (
            "chromium",
            "chromium-browser",
            "google-chrome",
            "/Applications/Chromium.app/Contents/MacOS/Chromium",
            "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        )
        if (path := shutil.which(name))
    ),
    None,
)
PATIENCE = 1e3 * HANGS
"""Milliseconds that a condition may take to come; a busy machine draws a frame in seconds."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium without a window, its WebGL in software."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    options = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    if os.geteuid() == 0:
        options.append("--no-sandbox")  # which root has none of
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
        yield chromium
        chromium.close()


class Page:
    """A page of the view, as its user sees it."""

    def __init__(self, browser: Any, url: str, width: int = 1200, height: int = 800) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self.page = browser.new_page(viewport={"width": width, "height": height})
        self.page.set_default_timeout(PATIENCE)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(url)
        self.page.wait_for_function(
            "[...document.querySelectorAll('canvas')].some(one => one.width > 100)"
        )

    def says(self, name: str, text: str) -> None:
        """Wait until the number of this name is this, to the digit."""
        from playwright.sync_api import expect

        expect(self.page.locator(f'[data-cdsm="{name}"]')).to_have_text(text, timeout=PATIENCE)

    def says_no(self, name: str) -> None:
        from playwright.sync_api import expect

        expect(self.page.locator(f'[data-cdsm="{name}"]')).to_have_count(0, timeout=PATIENCE)

    def slider(self, label: str) -> Any:
        identity = self.page.locator("label", has_text=label).get_attribute("for")
        return self.page.locator(f'[id="{identity}"]')

    def type(self, label: str, value: float) -> None:
        """Type a number into the field beside a slider."""
        self.field(label).fill(f"{value:g}")

    def field(self, label: str) -> Any:
        return self.slider(label).locator("xpath=..").locator("input[inputmode=decimal]")

    def press(self, label: str, key: str, times: int) -> None:
        """Move the knob of a slider with the keyboard."""
        knob = self.slider(label).get_by_role("slider")
        for _ in range(times):
            knob.press(key)

    def camera(self, view: View) -> Any:
        """The camera of this page, once the server knows the shape of the picture.

        A page that draws slowly draws fewer pixels, so only their ratio is that of the page.
        """
        box = self.page.locator("canvas").first.bounding_box()
        wanted = box["width"] / box["height"]
        for _ in range(100):
            cameras = [client.camera for client in view._server.get_clients().values()]
            for camera in cameras:
                if abs(camera.image_width / camera.image_height / wanted - 1.0) < 0.01:
                    return camera
            self.page.wait_for_timeout(100.0)
        sizes = [(camera.image_width, camera.image_height) for camera in cameras]
        pytest.fail(f"no picture has the shape of {box}: {sizes}")

    def pixel(self, view: View, point: Array) -> tuple[float, float]:
        """Where a point (3,) [m] of the scene is on the page, as the camera has it now."""
        box = self.page.locator("canvas").first.bounding_box()
        camera = self.camera(view)
        back = camera.position - camera.look_at
        back /= np.linalg.norm(back)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        seen = point - camera.position
        scale = box["height"] / 2.0 / math.tan(camera.fov / 2.0) / -(seen @ back)
        across, up = scale * (seen @ right), scale * (seen @ np.cross(back, right))
        return box["x"] + box["width"] / 2.0 + across, box["y"] + box["height"] / 2.0 - up

    def picture(self, name: str) -> Array:
        """A screenshot, kept to be looked at: (rows, columns, 3) from 0 to 1."""
        from matplotlib.image import imread

        OUTPUT.mkdir(exist_ok=True)
        self.page.screenshot(path=OUTPUT / name, timeout=PATIENCE)
        return np.asarray(imread(OUTPUT / name), dtype=np.float64)[..., :3]


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as shared:
        yield shared


@pytest.fixture(scope="module")
def page(browser: Any, view: View) -> Page:
    return Page(browser, view.url)


def answers(
    arm: cdsm.Manipulator, degrees: list[float], minimum: float, force_z: float = 0.0
) -> dict[str, str]:
    """What the API gives, as the page prints it; nothing of the view is used."""
    pose = arm.at(np.deg2rad(degrees))
    pull = cdsm.distribute_tension(pose, minimum, 200.0, (0.0, 0.0, force_z, 0.0, 0.0, 0.0))
    K = cdsm.stiffness(pose, pull)
    said = {
        f"along-{axis}": f"{K.along(u) / 1e3:.4g}" for axis, u in zip("xyz", np.eye(3), strict=True)
    }
    return said | {"margin": f"{K.margin:.4g}", "largest-tension": f"{pull.values.max():.4g}"}


# first of those with a page: the keys that move a slider turn viser's camera, too
@pytest.mark.slow
@needs_viser
def test_the_picture_shows_the_arm_and_the_ellipsoid(page: Page) -> None:
    page.says("condition", "STABLE")
    for _ in range(30):  # the first frames may be empty
        picture = page.picture("view-stable.png")[:, :800]
        red, green, blue = (picture[..., i] for i in range(3))
        pink = (red > 0.6) & (abs(green - blue) < 0.12) & (green < 0.75 * red)
        brown = (red > 0.5) & (blue < 0.4) & (green > 0.4)
        if pink.mean() > 0.005 and brown.mean() > 0.005:
            return
    pytest.fail("no ellipsoid or no disks in view-stable.png")


@needs_viser
def test_a_slider_that_moves_changes_the_numbers_to_those_of_the_api(
    page: Page, view: View
) -> None:
    arm = view.arm
    first = answers(arm, DEGREES, STABLE)
    for name, text in first.items():
        page.says(name, text)
    page.type("joint2_1 [°]", 14.5)
    moved = [*DEGREES[:2], 14.5, *DEGREES[3:]]
    second = answers(arm, moved, STABLE)
    assert all(first[name] != text for name, text in second.items() if name != "margin")
    for name, text in second.items():
        page.says(name, text)
    # one slider at a time: viser's client holds back what follows within 50 ms, and of that keeps
    # the last message alone, whichever slider it is of
    page.press("force z [N]", "ArrowLeft", 3)  # 0.01 N each
    third = answers(arm, moved, STABLE, -0.03)
    assert third["along-z"] != second["along-z"]
    for name, text in third.items():
        page.says(name, text)
    page.press("least tension [N]", "ArrowRight", 5)  # 0.1 N each
    for name, text in answers(arm, moved, STABLE + 0.5, -0.03).items():
        page.says(name, text)
    page.page.get_by_role("button", name="Reset").click()
    for name, text in first.items():
        page.says(name, text)


@needs_viser
def test_unstable_and_infeasible_are_said_and_drawn(page: Page, view: View) -> None:
    page.type("least tension [N]", UNSTABLE)
    page.says("condition", "UNSTABLE")
    page.says("margin", answers(view.arm, DEGREES, UNSTABLE)["margin"])
    page.says_no("along-x")
    page.picture("view-unstable.png")
    page.type("least tension [N]", INFEASIBLE)
    page.says("condition", "INFEASIBLE")
    with pytest.raises(cdsm.InfeasibleTension) as error:
        answers(view.arm, DEGREES, INFEASIBLE)
    page.says("problem", str(error.value))
    for name in ("along-x", "softest", "margin", "largest-tension"):
        page.says_no(name)
    page.picture("view-infeasible.png")
    page.page.get_by_role("button", name="Reset").click()
    page.says("condition", "STABLE")


@needs_viser
def test_beyond_its_end_a_slider_stands_at_its_end(page: Page, view: View) -> None:
    from playwright.sync_api import expect

    for _ in range(2):  # the second time it stands there already
        page.type("joint1_1 [°]", 170.0)
        for name, text in answers(view.arm, [61.9, *DEGREES[1:]], STABLE).items():
            page.says(name, text)
        expect(page.field("joint1_1 [°]")).to_have_value("61.9", timeout=PATIENCE)
    page.page.get_by_role("button", name="Reset").click()
    page.says("along-x", answers(view.arm, DEGREES, STABLE)["along-x"])


@needs_viser
def test_a_second_browser_sees_and_moves_the_same(page: Page, browser: Any, view: View) -> None:
    from playwright.sync_api import expect

    page.type("joint3_2 [°]", 3.5)
    second = Page(browser, view.url)
    expected = answers(view.arm, [*DEGREES[:5], 3.5], STABLE)
    second.says("along-x", expected["along-x"])
    expect(second.field("joint3_2 [°]")).to_have_value("3.5", timeout=PATIENCE)
    second.page.get_by_role("button", name="Straight").click()
    straight = answers(view.arm, [0.0] * 6, STABLE)
    for each in (page, second):
        each.says("along-x", "∞")
        each.says("along-z", straight["along-z"])
        expect(each.field("joint3_2 [°]")).to_have_value("0", timeout=PATIENCE)
    second.page.close()
    page.page.get_by_role("button", name="Reset").click()


@needs_viser
def test_the_page_says_what_it_shows_and_to_which_scale(page: Page, view: View) -> None:
    assert page.page.title() == "arm: cdsm view"
    shown = view.shown
    assert shown.ellipsoid is not None
    page.says("ellipsoid", f"ellipsoid: where 1 N moves the tip, scale {shown.ellipsoid.scale:g}:1")
    assert shown.tension is not None
    for c, F in enumerate(shown.tension.values):
        page.says(f"tension-{c}", f"{F:.4g}")
    bound = "at lower bound" if shown.tension.values[2] < STABLE + 1e-9 else ""
    page.says("bound-2", bound)
    page.says(
        "basis",
        "with wire EA 200000 N on a spring of 8 N/mm; gravity (0, 0, -9.81) m/s²; frictionless",
    )


@needs_viser
def test_let_it_sag_shows_the_equilibrium_and_nothing_older(page: Page, view: View) -> None:
    switch = page.page.get_by_label("let it sag")
    page.type("force z [N]", -0.5)
    page.says("tip", position(view.arm.at(np.deg2rad(DEGREES)).tip[:3, 3]))
    page.says_no("sagged")
    switch.check()
    pose = view.arm.at(np.deg2rad(DEGREES))
    tension = cdsm.distribute_tension(pose, STABLE, 200.0)
    rest = cdsm.equilibrium(pose, tension, (0.0, 0.0, -0.5, 0.0, 0.0, 0.0))
    page.says("sagged", position(rest.displacement))
    page.says("tip", position(rest.pose.tip[:3, 3]))
    page.says("along-z", f"{rest.stiffness.along((0, 0, 1)) / 1e3:.4g}")
    page.says("tension-0", f"{rest.tension[0]:.4g}")
    page.picture("view-sag.png")
    page.type("least tension [N]", UNSTABLE)
    page.says("condition", "LEFT ITS REFERENCE")
    page.type("least tension [N]", INFEASIBLE)
    page.says("condition", "INFEASIBLE")
    for name in ("along-z", "sagged", "tension-0", "ellipsoid", "margin"):
        page.says_no(name)
    page.page.get_by_role("button", name="Reset").click()
    page.says("along-x", answers(view.arm, DEGREES, STABLE)["along-x"])
    assert not switch.is_checked()


@needs_viser
def test_an_unstable_arm_is_told_what_would_hold_it(page: Page, view: View) -> None:
    page.type("least tension [N]", UNSTABLE)
    pose = view.arm.at(np.deg2rad(DEGREES))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, UNSTABLE, 200.0))
    page.says("problem", "\n".join(K.warnings))
    page.picture("view-advice.png")
    page.page.get_by_role("button", name="Reset").click()
    page.says_no("problem")


@needs_viser
def test_the_command_is_copied_and_the_picture_saved(page: Page, view: View) -> None:
    page.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.page.get_by_role("button", name="Copy").click()
    copied = page.page.evaluate("navigator.clipboard.readText()")
    names: dict[str, Any] = {"arm": view.arm, "cdsm": cdsm}
    exec(copied, names)
    page.says("along-z", f"{names['K'].along((0, 0, 1)) / 1e3:.4g}")
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Save picture").click()
    assert download.value.suggested_filename == "arm.png"
    from matplotlib.image import imread

    OUTPUT.mkdir(exist_ok=True)
    download.value.save_as(OUTPUT / "view-saved.png")
    saved = np.asarray(imread(OUTPUT / "view-saved.png"), dtype=np.float64)
    brown = (saved[..., 0] > 0.5) & (saved[..., 2] < 0.4) & (saved[..., 1] > 0.4)
    assert brown.mean() > 0.005  # the disks


@needs_viser
def test_the_tip_goes_where_its_handle_is_dragged(page: Page, view: View) -> None:
    tip = view.arm.at(np.deg2rad(DEGREES)).tip[:3, 3]
    # on the arrow of z, which ends after 0.2 lengths
    arrow = tip + np.array([0.0, 0.0, 0.15 * view.arm.length])
    x, y = page.pixel(view, arrow)
    page.page.mouse.move(x, y)
    page.page.wait_for_timeout(500.0)  # the handle lights up
    page.page.mouse.down()
    for i in range(1, 9):
        page.page.mouse.move(x, y - 5.0 * i)
        page.page.wait_for_timeout(100.0)
    page.page.mouse.up()
    page.says_no("remark")
    page.picture("view-dragged.png")
    moved = view.shown.posture
    assert moved is not None
    way = moved.tip[:3, 3] - tip
    assert way[2] > 0.01
    np.testing.assert_allclose(way[:2], 0.0, atol=1e-6)  # a browser computes in float32
    np.testing.assert_allclose(node(view, "/target").position, moved.tip[:3, 3], atol=1e-6)
    page.page.get_by_role("button", name="Reset").click()
    page.says("tip", position(tip))


@needs_viser
def test_a_click_on_a_cable_names_it(page: Page, view: View) -> None:
    shown = view.shown
    assert shown.posture is not None
    first = shown.posture.cable_paths[1]
    page.page.mouse.click(*page.pixel(view, (first[0] + first[1]) / 2.0))
    for _ in range(100):
        page.page.wait_for_timeout(100.0)
        if view._scene.names.chosen is not None:
            break
    chosen = view._scene.names.chosen
    assert chosen is not None
    _ = view.shown
    assert node(view, f"/names/{chosen}").text.startswith(f"{view.arm.cables[chosen].name}: ")
    page.page.get_by_label("show names").check()
    for _ in range(100):
        page.page.wait_for_timeout(100.0)
        if view._server.scene.get_handle_by_name("/names/8") is not None:
            break
    page.picture("view-names.png")
    page.page.get_by_label("show names").uncheck()


@needs_viser
def test_a_path_is_played_in_the_browser(browser: Any) -> None:
    path = np.deg2rad(np.outer(np.linspace(0.0, 1.0, 5), DEGREES))
    with serve(soft_arm(), port=0, minimum=STABLE, maximum=200.0, angles=path) as view:
        own = Page(browser, view.url)
        own.says("along-x", "∞")  # straight
        own.page.get_by_role("button", name="Play").click()
        for name, text in answers(view.arm, DEGREES, STABLE).items():
            own.says(name, text)
        own.page.get_by_role("button", name="Play").wait_for(timeout=PATIENCE)
        assert view._guard.refused == 0
        own.page.close()


@needs_viser
def test_the_motion_of_a_closed_loop_is_played(browser: Any, tmp_path: Path) -> None:
    """What a run writes as RUN.csv, as `cdsm view --path RUN.csv` reads it."""
    run = cdsm.track(small_path(), steps=2, minimum=10.0, maximum=250.0)
    motion = read_path(run.write(tmp_path / "run.csv"), run.plan.arm).angles
    with serve(run.plan.arm, port=0, minimum=10.0, angles=motion) as view:
        own = Page(browser, view.url)
        own.page.get_by_role("button", name="Play").click()
        last = np.rad2deg(run.angles[-1]).tolist()
        for name, text in answers(view.arm, last, 10.0).items():
            own.says(name, text)
        np.testing.assert_allclose(view.shown.setting.q, run.angles[-1], atol=1e-6)
        assert view._guard.refused == 0
        own.picture("view-closed-loop.png")
        own.page.close()


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1400, 900), (1024, 768), (390, 844)])
@needs_viser
def test_the_arm_is_in_sight_at_every_size(
    browser: Any, view: View, width: int, height: int
) -> None:
    own = Page(browser, view.url, width, height)
    own.says("condition", "STABLE")
    for _ in range(100):  # the first frames may be empty
        picture = own.picture(f"view-{width}.png")
        free = picture[: int(0.4 * height)] if width < 576 else picture[:, : width - 390]
        brown = (free[..., 0] > 0.5) & (free[..., 2] < 0.4) & (free[..., 1] > 0.4)
        if brown.mean() > 0.01:
            break
    else:
        pytest.fail(f"no disks in view-{width}.png")
    camera = own.camera(view)
    back = camera.position - camera.look_at
    # from the side and a little above, whatever the size
    np.testing.assert_allclose(back / np.linalg.norm(back), [0.118, -0.888, 0.444], atol=2e-3)
    columns = np.flatnonzero(brown.any(axis=0))
    assert columns[0] > 5  # none is cut off at an edge
    assert columns[-1] < free.shape[1] - 5
    own.page.close()


def position(point: Array) -> str:
    return ", ".join(f"{1e3 * x:z.1f}" for x in point)


@needs_viser
def test_the_page_asks_nobody_else_for_anything(page: Page, view: View) -> None:
    own = (view.url, f"blob:{view.url}", "data:")
    assert [url for url in page.requests if not url.startswith(own)] == []
    assert page.errors == []


@needs_viser
def test_the_guard_refuses_nothing_that_a_page_does(page: Page, view: View) -> None:
    box = page.page.locator("canvas").first.bounding_box()
    page.page.mouse.move(box["x"] + 300.0, box["y"] + 300.0)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 400.0, box["y"] + 350.0, steps=5)  # turns the camera
    page.page.mouse.up()
    page.page.mouse.wheel(0.0, 100.0)
    page.page.wait_for_timeout(500.0)
    assert view._guard.refused == 0
    assert page.errors == []


@pytest.mark.parametrize("host", ["::1", "0.0.0.0"])
@needs_viser
def test_pages_of_other_addresses_work(browser: Any, host: str) -> None:
    with serve(soft_arm(), host=host, port=0, q=np.deg2rad(DEGREES), minimum=STABLE) as view:
        own = Page(browser, view.url.replace("0.0.0.0", "127.0.0.1"))
        own.type("joint2_1 [°]", 14.5)
        moved = [*DEGREES[:2], 14.5, *DEGREES[3:]]
        own.says("along-x", answers(view.arm, moved, STABLE)["along-x"])
        own.page.reload()
        own.says("along-x", answers(view.arm, moved, STABLE)["along-x"])
        assert view._guard.refused == 0
        own.page.close()


@needs_viser
def test_a_link_does_not_lead_the_page_to_another_server(browser: Any, view: View) -> None:
    sync = pytest.importorskip("websockets.sync.server")
    led = threading.Event()
    with sync.serve(lambda _: led.set(), "127.0.0.1", 0) as other:
        threading.Thread(target=other.serve_forever, daemon=True).start()
        address = f"ws://127.0.0.1:{other.socket.getsockname()[1]}"
        page = browser.new_page()
        page.set_default_timeout(PATIENCE)
        with page.expect_console_message(lambda one: f"Connecting to: {address}" in one.text):
            page.goto(f"{view.url}/?websocket={address}")
        page.wait_for_timeout(3000.0)  # a page that may connect has done so at once
        page.close()
        other.shutdown()
    assert not led.is_set()


@pytest.mark.slow
@needs_viser
def test_holes_in_which_cables_slide_are_seen(browser: Any) -> None:
    arm = soft_arm().with_friction(0.1)
    q, force = np.deg2rad(DEGREES), (0.0, 0.0, -0.3)
    with serve(arm, port=0, q=q, minimum=STABLE, maximum=200.0, force=force, sag=True) as view:
        page = Page(browser, view.url)
        sticking, sliding = map(len, view.shown.holes)
        assert sticking
        assert sliding
        page.says("sliding", f"{sliding} slide")
        page.says("sticking", f"{sticking} holes stick,")
        for _ in range(30):  # the first frames may be empty
            picture = page.picture("view-sliding.png")[:, :800]
            red, green, blue = (picture[..., i] for i in range(3))
            magenta = (red > 0.7) & (green < 0.35) & (blue > 0.35) & (blue < 0.75)
            if magenta.sum() > 20 * sliding:
                break
        else:
            pytest.fail("no hole that slides in view-sliding.png")
        page.type("force z [N]", 0.0)  # a load that is gone from the start leaves nothing
        page.says("sliding", "0 slide")
        assert not page.errors

"""What a browser shows of the live view: its numbers, and what its page asks for."""

import os
import shutil
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.view import View, serve
from tests.support.patience import HANGS
from tests.view.test_view import (
    DEGREES,
    INFEASIBLE,
    STABLE,
    UNSTABLE,
    needs_viser,
    soft_arm,
)

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

    def __init__(self, browser: Any, url: str) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self.page = browser.new_page(viewport={"width": 1200, "height": 800})
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
    page.type("least tension [N]", INFEASIBLE)
    page.says("condition", "INFEASIBLE")
    with pytest.raises(cdsm.InfeasibleTension) as error:
        answers(view.arm, DEGREES, INFEASIBLE)
    page.says("problem", str(error.value))
    for name in ("along-x", "softest", "margin", "largest-tension"):
        page.says_no(name)
    page.page.get_by_role("button", name="Reset").click()
    page.says("condition", "STABLE")


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

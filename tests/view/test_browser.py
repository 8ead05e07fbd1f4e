"""What a browser shows of the live view: its numbers, and what its page asks for."""

import os
import re
import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.view import serve
from cdsm.view.live_view import View
from tests.support.patience import HANGS
from tests.view.test_state import DEGREES, STABLE, UNSTABLE, along, rod, soft_arm

pytest.importorskip("viser", reason="the extra [view] is not installed")
pytestmark = pytest.mark.browser

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
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


@pytest.fixture(scope="module")
def view() -> Iterator[View]:
    with serve(soft_arm(), port=0, q=np.deg2rad(DEGREES), minimum=STABLE, maximum=200.0) as shared:
        yield shared


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

    def says(self, what: str, value: str) -> None:
        """Wait until the row of the table with this text has this number, to the digit."""
        from playwright.sync_api import expect

        row = self.page.locator("tr", has_text=what)
        expect(row.locator("td").nth(1)).to_have_text(value, timeout=PATIENCE)

    def type(self, label: str, value: float) -> None:
        """Type a number into the field beside a slider."""
        identity = self.page.locator("label", has_text=label).get_attribute("for")
        slider = self.page.locator(f'[id="{identity}"]')
        slider.locator("xpath=..").locator("input[inputmode=decimal]").fill(f"{value:g}")


@pytest.fixture(scope="module")
def page(browser: Any, view: View) -> Page:
    return Page(browser, view.url)


def test_a_page_shows_the_numbers_of_the_api_and_asks_nobody_else(page: Page, view: View) -> None:
    def check(degrees: list[float], minimum: float, force_z: float = 0.0) -> None:
        pose = view.arm.at(np.deg2rad(degrees))
        pull = cdsm.distribute_tension(pose, minimum, 200.0, (0.0, 0.0, force_z, 0.0, 0.0, 0.0))
        K = cdsm.stiffness(pose, pull)
        page.says("stiffness along x, y, z", along(K))
        page.says("smallest joint stiffness", f"{K.margin:.4g}")
        page.says("largest tension", f"{pull.values.max():.4g}")

    check(DEGREES, STABLE)
    moved = [*DEGREES[:2], 14.5, *DEGREES[3:]]
    page.type("joint2_1 [°]", 14.5)
    check(moved, STABLE)
    # one slider at a time: viser's client holds back what follows within 50 ms, and of that keeps
    # the last message alone, whichever slider it is of
    page.type("force z [N]", -0.5)
    check(moved, STABLE, -0.5)
    page.type("least tension [N]", UNSTABLE)
    page.page.get_by_text("UNSTABLE", exact=True).first.wait_for()
    page.page.get_by_role("button", name="Reset").click()
    check(DEGREES, STABLE)
    own = re.compile(f"{re.escape(view.url)}|blob:{re.escape(view.url)}|data:")
    assert [url for url in page.requests if not own.match(url)] == []
    assert page.errors == []


def test_sliders_of_motors_pull_an_arm_with_few_cables(browser: Any) -> None:
    arm = rod()
    with serve(arm, port=0) as view:
        page = Page(browser, view.url)
        assert page.page.get_by_text("least tension [N]").count() == 0
        page.type("cable6_1 [mm]", -4.0)
        rest = cdsm.forward_statics(arm, pull=[-0.004, 0.0, 0.0])
        page.says("stiffness along x, y, z", along(rest.stiffness))
        assert not page.errors

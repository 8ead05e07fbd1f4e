"""What a browser shows of the live view: its numbers, and what its page asks for."""

import os
import re
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
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

    def says(self, what: str, value: str) -> None:
        """Wait until the row of the table with this text has this number, to the digit."""
        from playwright.sync_api import expect

        row = self.page.locator("tr", has_text=what)
        expect(row.locator("td").nth(1)).to_have_text(value, timeout=PATIENCE)

    def open(self, tab: str) -> None:
        """Open a tab of the panel."""
        self.page.get_by_role("tab", name=tab).click()

    def press(self, button: str) -> None:
        self.page.get_by_role("button", name=button, exact=True).click()

    def downloads(self, button: str) -> tuple[str, str]:
        """Press a button that saves a file; return its name and its text."""
        with self.page.expect_download() as waiting:
            self.press(button)
        file = waiting.value
        return str(file.suggested_filename), Path(file.path()).read_text()

    def curve(self) -> Any:
        """Numbers in the chart: tensions, stiffness, and where the arm is."""
        data = "Object.values(window.__viserTestpoints.uplots)[0].chart.data"
        rows = self.page.evaluate(f"{data}.map(row => Array.from(row, x => isNaN(x) ? null : x))")
        return np.array(rows, float)

    def control(self, label: str) -> Any:
        """The control with this label."""
        identity = self.page.locator("label", has_text=label).get_attribute("for")
        return self.page.locator(f'[id="{identity}"]')

    def field(self, label: str) -> Any:
        """The field beside a slider."""
        return self.control(label).locator("xpath=..").locator("input[inputmode=decimal]")

    def type(self, label: str, value: float) -> None:
        """Type a number into the field beside a slider."""
        self.field(label).fill(f"{value:g}")


@pytest.fixture(scope="module")
def page(browser: Any, view: View) -> Page:
    return Page(browser, view.url)


def test_a_page_shows_the_numbers_of_the_api_and_asks_nobody_else(page: Page, view: View) -> None:
    def check(degrees: list[float], minimum: float, force_z: float = 0.0) -> None:
        pose = view.arm.at(np.deg2rad(degrees))
        pull = cdsm.distribute_tension(pose, minimum, 200.0, (0.0, 0.0, force_z, 0.0, 0.0, 0.0))
        K = cdsm.stiffness(pose, pull)
        page.says("stiffness along x, y, z", along(K))
        page.open("Answer")
        page.says("smallest joint stiffness", f"{K.margin:.4g}")
        page.says("largest tension", f"{pull.values.max():.4g}")

    check(DEGREES, STABLE)
    page.open("Posture")
    moved = [*DEGREES[:2], 14.5, *DEGREES[3:]]
    page.type("joint2_1 [°]", 14.5)
    check(moved, STABLE)
    # one slider at a time: viser's client holds back what follows within 50 ms, and of that keeps
    # the last message alone, whichever slider it is of
    page.open("Load")
    page.type("force z [N]", -0.5)
    check(moved, STABLE, -0.5)
    page.open("Tensions")
    page.type("least tension [N]", UNSTABLE)
    page.page.get_by_text("UNSTABLE", exact=True).first.wait_for()
    page.press("Reset")
    check(DEGREES, STABLE)
    own = re.compile(f"{re.escape(view.url)}|blob:{re.escape(view.url)}|data:")
    assert [url for url in page.requests if not own.match(url)] == []
    assert page.errors == []


def test_sliders_of_motors_pull_an_arm_with_few_cables(browser: Any) -> None:
    arm = rod()
    with serve(arm, port=0) as view:
        page = Page(browser, view.url)
        assert page.page.get_by_text("least tension [N]").count() == 0
        page.open("Posture")
        page.type("cable6_1 [mm]", -4.0)
        rest = cdsm.forward_statics(arm, pull=[-0.004, 0.0, 0.0])
        page.says("stiffness along x, y, z", along(rest.stiffness))
        assert not page.errors


def test_every_control_does_in_a_browser_what_it_says(page: Page, view: View) -> None:
    """Curve, undo, force on a link, locked motors, names, matrix, picture and posture."""
    from playwright.sync_api import expect

    pose = view.arm.at(np.deg2rad(DEGREES))

    def stiffness(minimum: float, *load: Any) -> cdsm.Stiffness:
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum, 200.0, *load))

    page.open("Tensions")
    assert page.page.locator(".tension").count() == len(view.arm.cables)
    page.type("least tension [N]", 25.0)
    page.says("stiffness along x, y, z", along(stiffness(25.0)))
    deadline = time.monotonic() + HANGS
    while True:
        levels, _, here = page.curve()
        at = np.flatnonzero(np.isfinite(here))
        if at.size and levels[at[0]] == 25.0:
            break
        assert time.monotonic() < deadline, "the mark has not come to 25 N"
        page.page.wait_for_timeout(100)
    np.testing.assert_allclose(here[at], 1e-3 * stiffness(25.0).along("z"))
    page.page.get_by_text("show names").wait_for()
    page.press("Undo")
    page.says("stiffness along x, y, z", along(stiffness(STABLE)))

    page.open("Load")
    page.control("force at").click()
    page.page.get_by_role("option", name="link2").click()
    page.type("force y [N]", 0.7)
    load = {"link2": [0.0, 0.7, 0.0, 0.0, 0.0, 0.0]}
    page.says("stiffness along x, y, z", along(stiffness(STABLE, load)))
    page.control("motors locked").click()
    page.open("Answer")
    rest = cdsm.equilibrium(pose, cdsm.distribute_tension(pose, STABLE, 200.0), load)
    moved = ", ".join(f"{1e3 * x:z.1f}" for x in rest.displacement)
    row = page.page.locator("tr", has=page.page.get_by_text("displacement", exact=True))
    row.get_by_text(moved, exact=True).wait_for()
    page.page.get_by_text("Matrix K").click()
    page.page.locator("table.matrix td").first.wait_for()
    assert page.page.locator("table.matrix td").count() == 36

    name, text = page.downloads("Posture")
    assert name == f"{view.arm.name}_posture.py"
    assert "link2" in text
    name, text = page.downloads("Picture")
    assert name == f"{view.arm.name}.svg"
    assert 'id="cable:cable1_1:0"' in text
    page.press("Reset")
    page.says("stiffness along x, y, z", along(stiffness(STABLE)))
    page.press("Straight")
    page.open("Posture")
    expect(page.field("joint1_1")).to_have_value("0", timeout=PATIENCE)
    page.press("Reset")
    assert page.errors == []


def test_a_phone_shows_the_arm_and_all_tabs(browser: Any, view: View) -> None:
    """Nothing is wider than the window, and the verdict and a slider are seen at once."""
    page = Page(browser, view.url, 480, 900)
    page.says("stiffness along x, y, z", along(view.shown.stiffness))  # type: ignore[arg-type]
    inside = {
        "Answer": page.page.locator("tr", has_text="largest compliance"),
        "Posture": page.page.locator("label", has_text="joint1_1"),
        "Tensions": page.page.locator(".tension").first,
        "Load": page.page.locator("label", has_text="motors locked"),
    }
    for tab, element in inside.items():
        page.open(tab)
        for seen in (page.page.get_by_text("STABLE", exact=True).first, element):
            box = seen.bounding_box()
            assert box is not None
            assert box["x"] >= 0.0
            assert box["x"] + box["width"] <= 480.0
            assert 0.4 * 900.0 < box["y"] < 900.0, tab
    assert page.page.evaluate("document.documentElement.scrollWidth") <= 480

"""The page of a report: it says what the text says, and loads and runs nothing."""

import html
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.plots import page
from cdsm.plots.page import draw_curve
from cdsm.stiffness_matrix import Report
from tests.cli.test_commands import call
from tests.support import arms, locked
from tests.support.pictures import artists
from tests.support.printed import Printed, numbers, require_all

HOSTILE = '<script src="http://evil">$\\frac{$&\' onload=x'
NUMBER = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?")


def distributed() -> Report:
    """Return the report on a loaded arm with tolerances."""
    pose = arms.prototype(cdsm.LinearElasticity(48e3), 15.0)[0]
    sure = cdsm.Tolerances(joint_angle=0.01, tension=2.0)
    return on(pose.arm.with_tolerances(sure).at(pose.q), 15.0)


def on(pose: cdsm.Posture, minimum: float) -> Report:
    wrench = (0.0, 0.3, -2.0, 0.01, 0.0, 0.0)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum, wrench=wrench)).report()


def unstable() -> Report:
    geometry = arms.readme_geometry(
        link_length=0.03, disk_offset=0.005, hole_radius=0.008, link_mass=0.02, lead=0.0
    )
    soft = cdsm.LinearElasticity(300.0)
    cables = cdsm.serpentine_cables(geometry, soft, series_stiffness=16e3)
    arm = cdsm.Manipulator(geometry, cables=cables)
    pose = arm.at(np.deg2rad([12.0, -8.0, 5.0, 15.0, -10.0, 6.0, 9.0, -3.0]), check_limits=False)
    return on(pose, 8.0)


def hostile() -> Report:
    """Return the report on given tensions, slack and too high, of cables with hostile names."""
    arm = locked.hinge()
    cables = [replace(b, name=f"{HOSTILE}{i}", maximum=50.0) for i, b in enumerate(arm.cables)]
    return cdsm.stiffness(arm.with_cables(cables).at([0.0]), [80.0, 0.0]).report()


def not_checked() -> Report:
    pose = arms.prototype(cdsm.presets.STRAND_1X19, 15.0)[0]
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 2.21)).report()


REPORTS = {
    "PASS": distributed(),
    "FAIL": unstable(),
    "NOT CHECKED": not_checked(),
    "hostile": hostile(),
}


class Reader(HTMLParser):
    """What a page shows: its text, its tags, and what its tags refer to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.text = ""
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_data(self, data: str) -> None:
        if self.tags[-1:] != ["style"]:
            self.text += f" {data}"


@pytest.mark.parametrize("name", REPORTS)
def test_the_page_has_all_numbers_and_sentences_of_the_text(name: str) -> None:
    report = REPORTS[name]
    reader = Reader(report.to_html("ARM.toml"))
    numbers = set(NUMBER.findall(str(report)))
    assert len(numbers) > 12
    assert numbers <= set(NUMBER.findall(reader.text))
    for sentence in (*report.faults, *report.unchecked, *report.notes, report.outcome):
        assert sentence in reader.text


@pytest.mark.parametrize("name", REPORTS)
def test_the_page_loads_and_runs_nothing(name: str) -> None:
    reader = Reader(REPORTS[name].to_html(f"about {HOSTILE}"))
    assert not {"script", "link", "iframe", "object", "img", "form"} & set(reader.tags)
    assert f"about {HOSTILE}" in reader.text
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    assert ("content", policy) in reader.attributes
    names = [value for attribute, value in reader.attributes if attribute == "id"]
    assert len(names) == len(set(names))
    for attribute, value in reader.attributes:
        assert not attribute.startswith("on")
        if attribute in ("href", "xlink:href", "src"):
            assert value.startswith(("#", "data:image/png;base64,"))


def test_an_arm_that_holds_has_pictures_and_one_that_does_not_says_so_first() -> None:
    held = REPORTS["PASS"].to_html()
    for part in ("arm-compliance", "curve-along", "curve-here", "tensions-bound:minimum"):
        assert f'id="{part}"' in held
    assert "How sure is it?" in held
    softest = 1e-3 / np.linalg.norm(REPORTS["PASS"].stiffness.compliance[:3, :3], 2)
    assert f"The tip is softest with {softest:.3g} N/mm along (" in held
    assert "load at the tip: force (0, 0.3, -2) N, moment (0.01, 0, 0) N m" in held
    limp = REPORTS["FAIL"].to_html()
    assert 'class="pill fail">FAIL<' in limp
    assert limp.index("UNSTABLE") < limp.index("<section>")
    for part in ("arm-compliance", "curve-here", 'id="shares', "How sure"):
        assert part not in limp


def test_the_mark_in_the_curve_is_the_stiffness_of_the_report() -> None:
    K = REPORTS["PASS"].stiffness
    assert K.distribution is not None
    lines = artists(draw_curve(K, K.distribution, np.array([0.0, 0.0, 1.0])), "")
    (x,), (y,) = lines["here"].get_data()
    assert (x, y) == (15.0, pytest.approx(K.along("z") / 1e3))
    assert np.interp(x, *lines["along"].get_data()) == pytest.approx(y, rel=1e-3)


@pytest.mark.parametrize("times", [1.0, 0.98])
def test_the_mark_is_on_the_curve_also_where_a_maximum_binds(times: float) -> None:
    geometry = arms.readme_geometry(joints=3, cables_per_joint=5)
    pose = cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19).at(np.full(6, 0.1))
    most = times * float(cdsm.distribute_tension(pose, 15.0).values.max())
    tension = cdsm.distribute_tension(pose, 15.0, most)
    assert tension.at_maximum or times == 1.0
    K = cdsm.stiffness(pose, tension)
    lines = artists(draw_curve(K, tension, np.array([0.0, 0.0, 1.0])), "")
    (x,), (y,) = lines["here"].get_data()
    assert np.interp(x, *lines["along"].get_data()) == pytest.approx(y, rel=1e-9)


def test_the_curve_of_an_arm_that_buckles_shows_where_it_would_hold() -> None:
    K = REPORTS["FAIL"].stiffness
    assert K.distribution is not None
    panel = draw_curve(K, K.distribution, np.array([0.0, 0.0, 1.0]))
    hatched = artists(panel, "unstable")["unstable"]
    assert hatched.get_x() < 8.0 < panel.get_xlim()[1]


def test_loads_on_links_are_in_the_page() -> None:
    pose = arms.prototype(cdsm.LinearElasticity(48e3), 15.0)[0]
    hung = [cdsm.Load("link2", force=(0.0, 0.0, -1.5))]
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 15.0, wrench=hung))
    text = Reader(K.report().to_html()).text
    assert "load on link2" in text
    assert "-1.5) N" in text


@pytest.mark.parametrize("maximum", [np.inf, 30.0])
@pytest.mark.parametrize("tip", [None, (0.0, 0.1, -0.5)])
def test_lines_of_python_compute_the_same_stiffness(
    maximum: float, tip: tuple[float, ...] | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also with loads on links, at any point, and bounds that some cables reach."""
    monkeypatch.chdir(tmp_path)
    pose = arms.prototype(cdsm.LinearElasticity(48e3), 15.0)[0]
    pose.arm.write("ARM.toml")
    hung = [
        cdsm.Load("link2", force=(0.0, 0.0, -1.5)),
        cdsm.Load("link4", force=(0.3, 0.0, 0.0), moment=(0.0, 0.01, 0.0), point=(0.01, 0.0, 0.02)),
        *([cdsm.Load("tool0", force=tip)] if tip else []),
    ]
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 15.0, 2.0 * maximum, wrench=hung))
    shown = K.report().to_html()
    lines = html.unescape(re.search("<pre>(.*?)</pre>", shown, re.DOTALL)[1])  # type: ignore[index]
    names: dict[str, Any] = {}
    exec(lines, names)
    np.testing.assert_allclose(names["K"].tension, K.tension, rtol=1e-12)
    np.testing.assert_allclose(names["K"].joint, K.joint, rtol=1e-9)
    assert Path("REPORT.html").exists()
    assert 'id="curve-here"' in shown


def test_numbers_of_the_page_are_those_of_the_stiffness() -> None:
    K = REPORTS["PASS"].stiffness
    text = Reader(REPORTS["PASS"].to_html()).text
    rows = re.findall(r"moves [xyz]\s+(\S+)\s+(\S+)\s+(\S+)", text)
    for shown, moved in zip(rows, K.compliance[:3, :3], strict=True):
        require_all(zip([Printed(x, "mm") for x in shown], moved, strict=True))
    axes, moves, _ = np.linalg.svd(K.compliance[:3, :3])
    softest = numbers(text, "The tip is softest with {} along ({}, {}, {})")
    require_all([(softest[0], 1.0 / moves[0])], digits=3)
    direction = axes[:, 0] * np.sign(axes[abs(axes[:, 0]).argmax(), 0])
    require_all(zip(softest[1:], direction, strict=True), digits=3)
    pull = numbers(text, "cables pull {} to {}", "N")
    require_all(zip(pull, (K.tension.min(), K.tension.max()), strict=True), digits=3)
    place = numbers(text, "tip at ({}, {}, {}) mm", "mm")
    require_all(zip(place, K.posture.tip[:3, 3], strict=True))
    u = min("xyz", key=K.along)
    assert f"Which cables make it stiff along {u}?" in text
    assert K.distribution is not None
    budget = cdsm.uncertainty(K.posture, K.distribution, K.posture.arm.tolerances, direction=u)
    ends = numbers(text, "95 % of such arms: {} to {}", "N/mm")
    require_all(zip(ends, budget.interval(), strict=True))
    agree = [comparison.verdict for comparison in REPORTS["NOT CHECKED"].comparisons]
    assert {*agree} != {"agrees"}
    checks = f"Checks: {agree.count('agrees')} of {len(agree)} comparisons agree"
    assert checks in REPORTS["NOT CHECKED"].to_html()


@pytest.mark.parametrize("name", REPORTS)
def test_the_pill_has_the_colour_of_the_outcome(name: str) -> None:
    outcome = REPORTS[name].outcome
    kind = {"PASS": "pass", "FAIL": "fail", "NOT CHECKED": "not-checked"}[outcome]
    shown = REPORTS[name].to_html()
    assert f'<span class="pill {kind}">{outcome}</span>' in shown
    ink = {"pass": "good", "fail": "bad", "not-checked": "open"}[kind]
    assert f".{kind}{{background:var(--{ink})}}" in shown
    red, green, blue = bytes.fromhex(re.search(rf"--{ink}:#(\w+)", shown)[1])  # type: ignore[index]
    assert (green > red) == (ink == "good")
    assert max(red, green) > blue
    found = re.findall(r'<tr class="(\w*)"><td>(along|  of it passive)', shown)
    assert found == [("main", "along"), ("part", "  of it passive")]


def test_the_pictures_of_the_page_are_those_of_its_stiffness(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn: dict[str, Any] = {}

    def record(name: str, draw: Any) -> Any:
        def recorded(first: Any, *rest: Any, **options: Any) -> Any:
            drawn[name] = (first, *rest)
            return draw(first, *rest, **options)

        return recorded

    for name in ("plot_arm", "plot_shares", "plot_tensions", "plot_uncertainty"):
        monkeypatch.setattr(page, name, record(name, getattr(page, name)))
    report = REPORTS["PASS"]
    K = report.stiffness
    report.to_html()
    u = np.eye(3)["xyz".index(min("xyz", key=K.along))]
    np.testing.assert_array_equal(drawn["plot_shares"][0].direction, u)
    assert drawn["plot_shares"][0].total == pytest.approx(K.along(u))
    pose, tension, stiffness = drawn["plot_arm"]
    assert pose is K.posture
    assert stiffness is K
    np.testing.assert_array_equal(tension, K.tension)
    assert drawn["plot_tensions"][0] is K.distribution
    assert drawn["plot_uncertainty"][0].value == pytest.approx(K.along(u))


def test_the_python_of_a_page_computes_the_same_with_what_was_set(tmp_path: Path) -> None:
    shutil.copy("examples/arm.toml", tmp_path / "my arm.toml")
    page = tmp_path / "R.html"
    words = ["stiffness", str(tmp_path / "my arm.toml"), "--angles", "5", "--out", str(page)]
    words += ["--set", "minimum=60", "--set", "gravity=-y", "--mass", "0.2@link3"]
    assert call(*words).exit_code == 0
    text = html.unescape(page.read_text(encoding="utf-8"))
    assert "my arm.toml --set minimum=60 --set gravity=-y" in text
    program = text.partition("<pre>")[2].partition("</pre>")[0]
    names: dict[str, Any] = {}
    exec(program.partition("K.report()")[0], names)
    arm = cdsm.Manipulator.read("examples/arm.toml", changes={"minimum": 60.0, "gravity": "-y"})
    pose = arm.at(np.full(arm.nv, np.deg2rad(5.0)))
    load = cdsm.Load("link3", force=(0.0, -0.2 * 9.81, 0.0))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, wrench=[load]))
    np.testing.assert_allclose(names["K"].joint, K.joint, rtol=1e-9)

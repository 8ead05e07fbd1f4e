"""The page of a report: it says what the text says, and loads and runs nothing."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.plots.page import draw_curve
from cdsm.stiffness_matrix import Report
from tests.support import arms, locked
from tests.support.pictures import artists

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
    assert "wrench=loads" in text


def test_a_report_is_written_as_page_text_or_numbers(tmp_path: Path) -> None:
    report = REPORTS["NOT CHECKED"]
    text = report.write(tmp_path / "report.txt", "ARM.toml").read_text("utf-8")
    assert text.splitlines() == [
        *str(report).splitlines()[:1],
        "ARM.toml",
        *str(report).splitlines()[1:],
    ]
    written = report.write(tmp_path / "report.html", "ARM.toml", "z").read_text("utf-8")
    assert written == report.to_html("ARM.toml", "z")
    assert "imbalance" in report.write(tmp_path / "report.csv").read_text("utf-8")
    with pytest.raises(cdsm.InvalidInput, match=r"must end in \.html, \.txt, \.csv or \.nc"):
        report.write(tmp_path / "report.pdf")

"""Figures of the paper show the recomputed curves, and the numbers that the paper prints."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from cdsm import paper
from tests.support.pictures import artists, panels, require_look, words

LENGTHS = {"curves": "$l_0 = L$, as in the paper", "original": "original $l_0$"}
DEFINITIONS = ("pseudoinverse", "along")
TENSION = "cable tension, mean [N]"


@cache
def figure(name: str) -> Any:
    return paper.FIGURES[name]()


@cache
def drawn(name: str) -> Any:
    return panels(figure(name).plot())


def lines(ax: Any) -> dict[str, np.ndarray]:
    """The points of the lines of a panel by label."""
    return {str(line.get_label()): line.get_xydata() for line in ax.lines}


@pytest.mark.parametrize("name", paper.FIGURES)
def test_every_figure_is_drawn_with_its_title(name: str) -> None:
    axs = drawn(name)
    assert " ".join(figure(name).title.split()) in words(axs)
    for ax in axs:
        assert ax.lines
    require_look(axs)


def test_stiffness_over_modulus_is_proportional_and_passive() -> None:
    result, axs = figure("fig3"), drawn("fig3")
    for row, name in enumerate(DEFINITIONS):
        assert axs[3 * row].get_ylabel().endswith("[N/mm]")
        for i, axis in enumerate("xyz"):
            assert axs[i].get_title(loc="left") == axis
            shown = lines(axs[3 * row + i])
            for curve in result.curves:
                values = 1e-3 * getattr(curve, name)[:, i]
                np.testing.assert_allclose(
                    shown[curve.label], np.c_[curve.swept / 1e9, values], rtol=1e-12
                )
            part = 1e-3 * getattr(result.curves[-1], f"{name}_part")[::4, i]
            np.testing.assert_allclose(shown["passive part alone"][:, 1], part, rtol=1e-12)
    doubled = lines(axs[1])["paper: proportional, twice at 320 GPa"][0]
    assert doubled[0] == 320.0
    assert doubled[1] == pytest.approx(2e-3 * result.curves[0].pseudoinverse[0, 1])
    for i, ax in enumerate(axs[6:]):
        assert ax.get_xlabel() == "Young's modulus [GPa]"
        curve = result.curves[1]
        less = 100.0 * (curve.pseudoinverse_part / curve.pseudoinverse - 1.0)
        np.testing.assert_allclose(ax.lines[1].get_ydata(), less[:, i], atol=1e-12)


@pytest.mark.parametrize("name", ["fig4", "fig7"])
def test_active_part_and_changes_are_percents_over_tension(name: str) -> None:
    result, axs = figure(name), drawn(name)
    first = result.curves[0]
    assert [axs[k].get_ylabel().split("[")[-1] for k in (0, 3, 6)] == ["N/mm]", "%]", "%]"]
    for i in range(3):
        active = np.c_[first.tension[:, 1], 1e-3 * first.pseudoinverse_part[:, i]]
        np.testing.assert_allclose(axs[i].lines[0].get_xydata(), active)
        assert axs[6 + i].get_xlabel() == TENSION
        for row, definition in enumerate(DEFINITIONS, 1):
            shown = lines(axs[3 * row + i])
            for kind, words_of in LENGTHS.items():
                for curve in getattr(result, kind):
                    values = getattr(curve, definition)[:, i]
                    change = 100.0 * (values / values[0] - 1.0)
                    label = f"{curve.label.split(' (')[0]}, {words_of}"
                    expected = np.c_[curve.tension[:, 1], change]
                    np.testing.assert_allclose(shown[label], expected, atol=1e-12)
        end = lines(axs[3 + i])["paper, at the end"][0]
        np.testing.assert_allclose(end, [first.tension[-1, 1], result.claims[0].paper[i]])


def test_stiffness_over_tension_ends_where_the_paper_says() -> None:
    result, axs = figure("fig6"), drawn("fig6")
    for i in range(3):
        for row, definition in enumerate(DEFINITIONS):
            shown = lines(axs[3 * row + i])
            for kind, words_of in LENGTHS.items():
                (curve,) = getattr(result, kind)
                expected = np.c_[curve.tension[:, 1], 1e-3 * getattr(curve, definition)[:, i]]
                np.testing.assert_allclose(shown[words_of], expected)
        (end,) = (points for label, points in lines(axs[i]).items() if label.startswith("paper"))
        first = result.curves[0].pseudoinverse[0, i]
        assert end[0, 1] == pytest.approx(1e-3 * first * (1.0 + result.claims[0].paper[i]))
        assert axs[3 + i].get_xlabel() == TENSION
        (curve,) = result.curves
        for row, definition in enumerate(DEFINITIONS):
            (bars,) = axs[3 * row + i].containers
            values = 1e-3 * getattr(curve, definition)[:, i]
            for (left, y), (right, _) in bars[2][0].get_segments():
                at = abs(values - y).argmin()
                np.testing.assert_allclose([left, right], curve.tension[at, [0, 2]])


def test_postures_stand_over_their_curves() -> None:
    result, axs = figure("fig8"), drawn("fig8")
    for column, pose in enumerate(result.postures):
        assert axs[column].get_title(loc="left") == result.curves[column].label
        bones = artists(axs[column], "bone:")
        assert len(bones) == len(pose.bones)
        for row, definition in enumerate(DEFINITIONS, 1):
            shown = lines(axs[3 * row + column])
            for kind, words_of in LENGTHS.items():
                curve = getattr(result, kind)[column]
                for i, axis in enumerate("xyz"):
                    expected = np.c_[curve.tension[:, 1], 1e-3 * getattr(curve, definition)[:, i]]
                    np.testing.assert_allclose(shown[f"{axis}, {words_of}"], expected)


def test_strand_is_drawn_with_both_rigidities_and_the_misprint() -> None:
    result, (left, right) = figure("fig5"), drawn("fig5")
    stretch = np.c_[1e3 * result.displacement, result.tension]
    np.testing.assert_allclose(left.lines[0].get_xydata(), stretch)
    shown = lines(right)
    F = result.tension
    np.testing.assert_allclose(shown["tangent, repaired"], np.c_[F, 1e-3 * result.tangent])
    np.testing.assert_allclose(shown["secant (Eq. 18)"], np.c_[F, 1e-3 * result.secant])
    printed = shown["as printed, misprint"]
    np.testing.assert_allclose(printed[:, 1], 1e-3 * result.printed[result.join >= F])
    assert left.get_xlabel() == f"stretch of a {1e3 * result.gauge_length:g} mm wire [mm]"
    assert (right.get_xlabel(), right.get_ylabel()) == ("tension [N]", "rigidity EA [kN]")


def test_lead_changes_the_sign() -> None:
    result, axs = figure("lead"), drawn("lead")
    cases = zip((result.stretched, result.original), LENGTHS.values(), strict=True)
    for changes, words_of in cases:
        for row, ax in enumerate(axs):
            for i, axis in enumerate("xyz"):
                expected = np.c_[1e3 * result.leads, changes[:, row, i]]
                np.testing.assert_allclose(lines(ax)[f"{axis}, {words_of}"], expected)
            assert ax.get_xlabel() == "lead of all cables [mm]"


@pytest.mark.parametrize("name", ["fig10", "fig12", "fig13"])
def test_experiments_have_the_numbers_of_the_paper_as_dots(name: str) -> None:
    result, axs = figure(name), drawn(name)
    size = 1.0 if result.relative else 1e-3
    across = 1e-3 if result.swept == "cable_stiffness" else 1.0
    for ax, trace in zip(axs, result.traces, strict=True):
        shown = lines(ax)
        computed = np.c_[across * trace.swept, size * trace.computed]
        np.testing.assert_allclose(shown["computed"], computed)
        dots = np.c_[across * np.atleast_1d(trace.paper_at), size * np.atleast_1d(trace.paper)]
        np.testing.assert_allclose(shown["paper"], dots)
        assert " ".join(ax.get_title(loc="left").split()) == trace.label

"""Figures draw what they are given, with units; how they look was looked at."""

import re
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]
from PIL import Image

import cdsm
from cdsm import paper, plots
from cdsm.plots.arm import ellipsoid
from cdsm.support.values import Array
from tests.conftest import Results
from tests.support.arms import mixed_arm, random_posture

POSE = random_posture(mixed_arm(), 3)
PULL = cdsm.distribute_tension(POSE, 10.0)


def _shown(line: Line2D) -> Array:
    """x and y of a line (2, N)."""
    return np.asarray(line.get_xydata(), dtype=np.float64).T


def _drawn(figure: Figure) -> Figure:
    """Draw a figure; each panel that is labelled has units on both axes."""
    figure.draw_without_rendering()
    for axes in figure.axes:
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert not label or re.search(r"\[.+\]|number|sample|factor|measurement", label), label
    return figure


def test_arm_is_drawn_in_mm_with_equal_axes_and_cables_by_tension() -> None:
    axes: Any = _drawn(plots.plot_arm(POSE, PULL)).axes[0]
    lines = axes.get_lines()
    assert len(lines) == len(POSE.arm.geometry.disks) + len(POSE.bones) + len(POSE.arm.cables)
    cables = lines[-len(POSE.arm.cables) :]
    for line, path in zip(cables, POSE.cable_paths, strict=True):
        np.testing.assert_allclose(line.get_data_3d(), 1e3 * path.T)
    assert len({tuple(line.get_color()) for line in cables}) > 2
    limits = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    np.testing.assert_allclose(limits / axes._box_aspect, (limits / axes._box_aspect)[0])


def test_ellipsoid_shows_where_forces_move_the_tip() -> None:
    K = cdsm.stiffness(POSE, PULL)
    figure = plots.plot_arm(POSE, stiffness=K)
    wires = figure.axes[0].collections[0]
    assert isinstance(wires, Line3DCollection)
    points = np.concatenate(wires._segments3d) / 1e3 - POSE.tip[:3, 3]
    C = K.compliance[:3, :3]
    [told] = [text.get_text() for text in figure.legends[0].get_texts()]
    found = re.fullmatch(r"where 1 N moves the tip, scale (\d+):(\d+); longest: (\S+) mm", told)
    assert found is not None, told
    scale = float(found[1]) / float(found[2])
    # all are moved there by 1 N, to the scale in the legend
    np.testing.assert_allclose(np.linalg.norm(np.linalg.solve(scale * C, points.T), axis=0), 1.0)
    assert float(found[3]) == pytest.approx(1e3 * np.linalg.norm(C, 2), rel=5e-3)
    soft = cdsm.serpentine_cables(
        POSE.arm.geometry, cdsm.LinearElasticity(1e9), series_stiffness=10.0
    )
    loose = POSE.arm.with_cables(soft).at(POSE.q)
    unstable = plots.plot_arm(loose, stiffness=cdsm.stiffness(loose, np.full(9, 300.0)))
    assert "UNSTABLE" in unstable.get_suptitle()
    assert not list(unstable.axes[0].collections)


@pytest.mark.parametrize("softer", [1e-4, 0.5, 1.0, 2.9, 31.0, 1e5])
def test_a_scale_is_a_power_of_ten_and_keeps_the_ellipsoid_in_sight(softer: float) -> None:
    drawn = ellipsoid(1e-4 * softer * np.diag([1.0, 0.3, 0.1]), np.zeros(3), 0.2)
    assert drawn is not None
    assert drawn.scale == 10.0 ** round(np.log10(drawn.scale))
    size = float(np.linalg.norm(drawn.surface, axis=0).max())
    assert 0.03 * 0.2 * (1.0 - 1e-9) <= size <= 0.3 * 0.2 * (1.0 + 1e-9)
    assert ellipsoid(np.zeros((3, 3)), np.zeros(3), 0.2) is None


def test_every_result_that_people_look_at_has_a_picture(tmp_path: Path) -> None:
    K = cdsm.stiffness(POSE, PULL)
    attainable = cdsm.stiffness_range(POSE, "z", 10.0, 200.0)
    target = attainable.low + 0.2 * (attainable.high - attainable.low)
    plan = cdsm.plan_stiffness(POSE, "z", target, 10.0, 200.0)
    path = cdsm.plan_path(
        POSE.arm, "z", target, 10.0, 200.0, angles=np.linspace(1.0, 0.999, 3)[:, None] * POSE.q
    )
    before = dict(matplotlib.rcParams)
    for result in (
        *(POSE.arm, POSE, PULL, K, K.shares("z"), cdsm.modes(POSE, K)),
        *(attainable, plan, path, cdsm.saturation(POSE, "z", 10.0, 200.0)),
        *(cdsm.equilibrium(POSE, PULL), cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0))),
        *(cdsm.critical_tension(POSE), cdsm.critical_load(POSE, np.eye(6)[0], 10.0)),
        cdsm.distribute_tensions(POSE.arm, [POSE.q, 0.5 * POSE.q], 10.0),
        *(cdsm.presets.STRAND_1X19, cdsm.force_polytope(POSE, 10.0, 200.0)),
    ):
        _drawn(result.plot())
    assert dict(matplotlib.rcParams) == before
    lines = _drawn(plan.plot(attainable)).axes[0].get_lines()
    for line, pull in zip(lines, (attainable.low_tension, plan.tension), strict=False):
        np.testing.assert_array_equal(line.get_ydata(), pull.values)
    with pytest.raises(cdsm.InvalidInput, match="attainable: is not of the posture"):
        plan.plot(cdsm.stiffness_range(POSE, (0.0, 1.0, 1.0), 10.0, 200.0))
    above, below = path.plot(animate=tmp_path / "arm.gif").axes
    # a constant target is inside the panel, not on its frame
    assert above.get_ylim()[1] > 1.1e-3 * target
    assert below.get_ylim()[1] > 1.1 * path.tensions.max()
    with Image.open(tmp_path / "arm.gif") as film:
        assert film.n_frames == len(path.planned) == 3  # type: ignore[attr-defined]
    ranges = [cdsm.stiffness_range(POSE, u, 10.0, 200.0) for u in np.eye(3)[1:]]
    _drawn(plots.plot_stiffness_ranges({"up to 200 N": ranges}))


def test_what_cannot_be_drawn_is_named(tmp_path: Path) -> None:
    K = cdsm.stiffness(POSE, PULL)
    other: Any = cdsm.presets.virtual_prototype().at(np.zeros(10))
    for call, said in (
        (lambda: plots.plot_arm(3), "pose: 3 given; a Posture is needed"),  # type: ignore[arg-type]
        (lambda: plots.plot_arm(other, PULL), "tension: belongs to another arm"),
        (lambda: plots.plot_arm(other, stiffness=K), "stiffness: belongs to another posture"),
        (lambda: plots.plot_path([]), "path: give postures of one arm"),
        (lambda: plots.plot_path([POSE, other]), "path: give postures of one arm"),
        (lambda: plots.plot_path([POSE], animate=tmp_path / "a.mp4"), r"must end in \.gif"),
        (lambda: plots.plot_stiffness_ranges({}), "ranges: is empty"),
        (
            lambda: plots.save_figure(POSE.plot(), tmp_path / "a.jpg"),
            r"path: .*\.pdf, \.svg, \.png",
        ),
    ):
        with pytest.raises(cdsm.InvalidInput, match=said):
            call()


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".png"])
def test_figures_have_the_same_bytes_each_time(tmp_path: Path, suffix: str) -> None:
    once, twice = (
        plots.save_figure(PULL.plot(), tmp_path / f"{k}{suffix}").read_bytes() for k in "ab"
    )
    assert once == twice
    assert b"CreationDate" not in once
    assert b"<dc:date>" not in once


def test_weight_test_shows_its_displacements_in_mm_and_all_tensions() -> None:
    test = cdsm.weight_test(POSE, PULL, [0.0, 0.3, -1.0], steps=4)
    left, right = _drawn(test.plot()).axes
    curves, linears = left.get_lines()[::2], left.get_lines()[1::2]
    for i, (curve, linear) in enumerate(zip(curves, linears, strict=True)):
        np.testing.assert_allclose(_shown(curve)[0, 1:], 1e3 * test.displacements[:, i])
        np.testing.assert_allclose(_shown(curve)[1, 1:], test.loads)
        np.testing.assert_allclose(_shown(linear)[0, 1], 1e3 * test.tangent_displacement[i])
    assert len(right.get_lines()) == len(POSE.arm.cables)


def test_shares_are_bars_that_add_up() -> None:
    shares = cdsm.stiffness(POSE, PULL).shares("y")
    (axes,) = shares.plot().axes
    heights = sum(patch.get_height() for patch in axes.patches)  # type: ignore[attr-defined]
    assert 1e3 * heights == pytest.approx(shares.total)
    names = [label.get_text() for label in axes.get_xticklabels()]
    assert names == [*POSE.arm.cables.names, "gravity", "load"]


@pytest.mark.parametrize("name", paper.FIGURES)
def test_numbers_that_the_paper_prints_are_drawn_in_its_figures(
    results: Results, name: str
) -> None:
    result = results[name]
    panels = _drawn(result.plot()).axes
    if isinstance(result, paper.ExperimentFigure):
        unit = 1.0 if result.relative else 1e-3
        for axes, trace in zip(panels, result.traces, strict=True):
            computed, printed = axes.get_lines()
            np.testing.assert_allclose(_shown(computed)[1], unit * trace.computed)
            np.testing.assert_allclose(_shown(printed)[1], unit * trace.paper)
    elif name in ("fig3", "fig4", "fig6", "fig7"):
        assert isinstance(result, paper.StiffnessFigure)
        stated, first = result.claims[0].paper, 1e-3 * result.curves[0].pseudoinverse[0]
        assert stated is not None
        row = {"fig3": 0, "fig6": 0}.get(name, 1)
        for i, axes in enumerate(panels[3 * row : 3 * row + 3]):
            (mark,) = (line for line in axes.get_lines() if str(line.get_label())[:5] == "paper")
            expected = {"fig3": first[i] * stated[i], "fig6": first[i] * (1.0 + stated[i])}
            assert _shown(mark)[1, 0] == pytest.approx(expected.get(name, stated[i]))

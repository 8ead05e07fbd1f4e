"""Figures draw what they are given; how they look was looked at."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3D, Line3DCollection  # type: ignore[import-untyped]
from PIL import Image

import cdsm
from cdsm import paper, plots
from cdsm.plots.arm import ellipsoid
from cdsm.support.values import Array
from tests.conftest import Results
from tests.support.arms import mixed_arm, random_posture


def test_arm_is_drawn_with_disks_cables_and_equal_axes() -> None:
    pose = random_posture(mixed_arm(), 3)
    pull = cdsm.distribute_tension(pose, 10.0)
    axes = plots.plot_arm(pose, pull).axes[0]
    lines = [line for line in axes.get_lines() if isinstance(line, Line3D)]
    disks = len(pose.arm.geometry.disks)
    before = disks + len(pose.bones)
    assert len(lines) == before + len(pose.arm.cables)
    first = np.array(lines[before].get_data_3d())
    np.testing.assert_allclose(first, 1e3 * pose.cable_paths[0].T)  # in mm
    colors = {tuple(line.get_color()) for line in lines[before:]}
    assert len(colors) > 2  # by tension
    limits = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)  # type: ignore[attr-defined]
    box = axes._box_aspect  # type: ignore[attr-defined]
    np.testing.assert_allclose(limits / box, (limits / box)[0])


def test_ellipsoid_shows_where_forces_move_the_tip() -> None:
    pose = random_posture(mixed_arm(), 3)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0))
    figure = plots.plot_arm(pose, stiffness=K)
    axes = figure.axes[0]
    wires = axes.collections[0]
    assert isinstance(wires, Line3DCollection)
    points = np.concatenate(wires._segments3d) / 1e3 - pose.tip[:3, 3]
    C = K.compliance[:3, :3]
    [told] = [text.get_text() for text in figure.legends[0].get_texts()]
    found = re.fullmatch(r"where 1 N moves the tip, scale (\d+):(\d+); longest: (\S+) mm", told)
    assert found is not None, told
    scale = float(found[1]) / float(found[2])
    # all are moved there by 1 N, to the scale in the legend
    np.testing.assert_allclose(np.linalg.norm(np.linalg.solve(scale * C, points.T), axis=0), 1.0)
    assert float(found[3]) == pytest.approx(1e3 * np.linalg.norm(C, 2), rel=5e-3)
    with pytest.raises(cdsm.InvalidInput, match="another posture or arm"):
        plots.plot_arm(random_posture(mixed_arm(), 4), stiffness=K)
    soft = cdsm.serpentine_cables(
        pose.arm.geometry, cdsm.LinearElasticity(1e9), series_stiffness=10.0
    )
    loose = pose.arm.with_cables(soft).at(pose.q)
    unstable = plots.plot_arm(loose, stiffness=cdsm.stiffness(loose, np.full(9, 300.0)))
    assert "UNSTABLE" in unstable.get_suptitle()
    assert not list(unstable.axes[0].collections)


@pytest.mark.parametrize("softer", [1e-4, 1e-2, 0.5, 1.0, 2.9, 31.0, 1e5])
def test_a_scale_is_a_power_of_ten_and_keeps_the_ellipsoid_in_sight(softer: float) -> None:
    C = 1e-4 * softer * np.diag([1.0, 0.3, 0.1])
    drawn = ellipsoid(C, np.zeros(3), 0.2)
    assert drawn is not None
    assert drawn.scale == 10.0 ** round(np.log10(drawn.scale))
    size = float(np.linalg.norm(drawn.surface, axis=0).max())
    assert 0.03 * 0.2 * (1.0 - 1e-9) <= size <= 0.3 * 0.2 * (1.0 + 1e-9)
    # on a grid of 13 points from pole to pole the longest half axis, x, is met
    assert size == pytest.approx(drawn.scale * 1e-4 * softer, rel=1e-12)
    assert ellipsoid(0.0 * C, np.zeros(3), 0.2) is None


def test_curves_are_drawn_where_they_are(
    results: Results,
) -> None:
    result = results["fig6"]
    assert isinstance(result, paper.StiffnessFigure)
    axes = plots.plot_paper(result).axes[0]
    x, y = _shown(axes.get_lines()[0])
    np.testing.assert_allclose(x, result.curves[0].tension[:, 1])
    np.testing.assert_allclose(y, result.curves[0].pseudoinverse[:, 0] / 1000.0)


def test_experiments_show_the_papers_numbers_beside_the_computed(results: Results) -> None:
    for name in ("fig10", "fig12", "fig13"):
        result = results[name]
        assert isinstance(result, paper.ExperimentFigure)
        figure = plots.plot_paper(result)
        figure.draw_without_rendering()
        assert len(figure.axes) == len(result.traces)
        unit = 1.0 if result.relative else 1e-3
        for axes, trace in zip(figure.axes, result.traces, strict=True):
            computed, printed = axes.get_lines()
            np.testing.assert_allclose(_shown(computed)[1], unit * trace.computed)
            np.testing.assert_allclose(_shown(printed)[1], unit * trace.paper)
        assert "[N" in figure.axes[-1].get_xlabel()
        assert "was fitted" in figure.legends[0].get_title().get_text()


@pytest.mark.parametrize("name", ["fig3", "fig4", "fig6", "fig7"])
def test_numbers_that_the_paper_prints_are_drawn_in_its_figures(
    results: Results, name: str
) -> None:
    result = results[name]
    assert isinstance(result, paper.StiffnessFigure)
    stated = result.claims[0].paper
    assert stated is not None
    first = 1e-3 * result.curves[0].pseudoinverse[0]
    row = {"fig3": 0, "fig6": 0}.get(name, 1)
    for i, axes in enumerate(plots.plot_paper(result).axes[3 * row : 3 * row + 3]):
        (mark,) = (line for line in axes.get_lines() if str(line.get_label()).startswith("paper"))
        expected = {"fig3": first[i] * stated[i], "fig6": first[i] * (1.0 + stated[i])}
        assert _shown(mark)[1, 0] == pytest.approx(expected.get(name, stated[i]))


def test_weight_test_shows_its_displacements_in_mm_and_all_tensions() -> None:
    pose = random_posture(mixed_arm(), 3)
    test = cdsm.weight_test(pose, cdsm.distribute_tension(pose, 30.0), [0.0, 0.3, -1.0], steps=4)
    figure = plots.plot_weight_test(test)
    figure.draw_without_rendering()
    left, right = figure.axes
    for axis, (curve, linear) in enumerate(
        zip(left.get_lines()[::2], left.get_lines()[1::2], strict=True)
    ):
        np.testing.assert_allclose(_shown(curve)[0, 1:], 1e3 * test.displacements[:, axis])
        np.testing.assert_allclose(_shown(curve)[1, 1:], test.loads)
        np.testing.assert_allclose(_shown(linear)[0, 1], 1e3 * test.tangent_displacement[axis])
    assert len(right.get_lines()) == len(pose.arm.cables)


@pytest.mark.parametrize("spring", [2e3, 1e7])
def test_critical_tension_shows_where_the_arm_is_unstable(spring: float) -> None:
    geometry = cdsm.presets.experimental_prototype_geometry()
    cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(1e9), series_stiffness=spring)
    pose = cdsm.Manipulator(geometry, cables=cables).at(np.zeros(3))
    critical = cdsm.critical_tension(pose)
    figure = plots.plot_critical_tension(critical)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    np.testing.assert_allclose(_shown(axes.get_lines()[0]), [critical.bounds, critical.margins])
    assert axes.get_xlim()[1] == pytest.approx(min(2.0 * critical.minimum, critical.examined[1]))
    assert any("buckles at" in text.get_text() for text in axes.texts)


def test_plan_is_drawn_between_the_softest_and_the_stiffest_tensions() -> None:
    pose = random_posture(mixed_arm(), 3)
    found = cdsm.stiffness_range(pose, (0.0, 0.0, 1.0), 10.0, 200.0)
    plan = cdsm.plan_stiffness(pose, (0.0, 0.0, 1.0), 0.5 * (found.low + found.high), 10.0, 200.0)
    figure = plots.plot_stiffness_plan(plan, found)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    pulls = (found.low_tension, plan.tension, found.high_tension)
    for line, pull in zip(axes.get_lines(), pulls, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), pull.values)
    legend = axes.get_legend()
    assert legend is not None
    assert f"planned: {1e-3 * float(plan.achieved):.4g} N/mm" in legend.get_texts()[1].get_text()
    other = cdsm.stiffness_range(pose, (0.0, 1.0, 1.0), 10.0, 200.0)
    with pytest.raises(cdsm.InvalidInput, match="attainable: is not of the posture"):
        plots.plot_stiffness_plan(plan, other)


def _shown(line: Line2D) -> Array:
    """x and y of a line (2, N)."""
    return np.asarray(line.get_xydata(), dtype=np.float64).T


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".png"])
def test_figures_have_the_same_bytes_each_time(tmp_path: Path, suffix: str) -> None:
    pose = random_posture(mixed_arm(), 3)
    pull = cdsm.distribute_tension(pose, 10.0)
    once, twice = (
        plots.save_figure(pull.plot(), tmp_path / f"{k}{suffix}").read_bytes() for k in "ab"
    )
    assert once == twice
    assert b"CreationDate" not in once
    assert b"<dc:date>" not in once


def test_every_result_that_people_look_at_has_a_picture(tmp_path: Path) -> None:
    pose = random_posture(mixed_arm(), 3)
    pull = cdsm.distribute_tension(pose, 10.0)
    K = cdsm.stiffness(pose, pull)
    attainable = cdsm.stiffness_range(pose, "z", 10.0, 200.0, starts=2)
    target = attainable.low + 0.2 * (attainable.high - attainable.low)
    plan = cdsm.plan_stiffness(pose, "z", target, 10.0, 200.0)
    path = cdsm.plan_path(
        pose.arm, "z", target, 10.0, 200.0, angles=np.linspace(1.0, 0.999, 3)[:, None] * pose.q
    )
    for result in (
        *(pose.arm, pose, pull, K, K.shares("z"), cdsm.modes(pose, K)),
        *(attainable, plan, path, cdsm.saturation(pose, "z", 10.0, 200.0)),
        *(cdsm.equilibrium(pose, pull), cdsm.weight_test(pose, pull, (0.0, 0.0, -1.0))),
        *(cdsm.critical_tension(pose), cdsm.critical_load(pose, np.eye(6)[0], 10.0)),
        cdsm.distribute_tensions(pose.arm, [pose.q, 0.5 * pose.q], 10.0),
        cdsm.presets.STRAND_1X19,
    ):
        result.plot().draw_without_rendering()
    plan.plot(attainable).draw_without_rendering()
    above, below = path.plot(animate=tmp_path / "arm.gif").axes
    # a constant target is inside the panel, not on its frame
    assert above.get_ylim()[1] > 1.1e-3 * target
    assert below.get_ylim()[1] > 1.1 * path.tensions.max()
    with Image.open(tmp_path / "arm.gif") as film:
        assert film.n_frames == len(path.planned) == 3  # type: ignore[attr-defined]
    with pytest.raises(cdsm.InvalidInput, match=r"must end in \.gif"):
        plots.plot_path([pose], animate=tmp_path / "arm.mp4")
    with pytest.raises(cdsm.InvalidInput, match="postures of two arms"):
        plots.plot_path([pose, cdsm.presets.virtual_prototype().at(np.zeros(10))])


def test_shares_are_bars_that_add_up() -> None:
    pose = random_posture(mixed_arm(), 3)
    shares = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0)).shares("y")
    (axes,) = shares.plot().axes
    heights = sum(patch.get_height() for patch in axes.patches)  # type: ignore[attr-defined]
    assert 1e3 * heights == pytest.approx(shares.total)
    names = [label.get_text() for label in axes.get_xticklabels()]
    assert names == [*pose.arm.cables.names, "gravity", "load"]

"""Figures draw what they are given; how they look was looked at."""

import re
from collections.abc import Callable
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import proj3d  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Line3D, Line3DCollection  # type: ignore[import-untyped]
from PIL import Image

import cdsm
from cdsm import paper, plots
from cdsm.plots.arm import ellipsoid
from cdsm.support.values import Array
from tests.conftest import Results
from tests.support.arms import mixed_arm, random_posture
from tests.support.foreign import POSTURE, crab


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


@pytest.mark.parametrize(
    ("draw", "kind"),
    [
        (plots.plot_arm, "Posture"),
        (plots.plot_weight_test, "WeightTest"),
        (plots.plot_critical_tension, "CriticalTension"),
        (plots.plot_path_plan, "PathPlan"),
        (plots.plot_paper, "figure of cdsm.paper"),
    ],
)
def test_another_kind_of_result_is_refused(draw: Callable[[object], object], kind: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"given; a {kind} is needed"):
        draw(mixed_arm())


def test_foreign_robot_shows_its_joints_and_what_guides_its_cables() -> None:
    pose = crab().at(POSTURE)
    sites = np.concatenate(pose.cable_paths)
    links = [site.link for cable in pose.arm.cables for site in cable.sites]
    assert len(pose.brackets) == len(sites)
    for bracket, site, link in zip(pose.brackets, sites, links, strict=True):
        np.testing.assert_array_equal(bracket[0], site)
        # of all points of the bones that move with the link none is nearer than the foot
        way = float(np.linalg.norm(bracket[1] - bracket[0]))
        start = pose.link_pose("hand" if link == "tip" else link)[:3, 3]
        own = [bone for bone in pose.bones if np.allclose(bone[0], start, atol=1e-12)]
        along = np.linspace(0.0, 1.0, 401)[:, None]
        points = np.concatenate(
            [bone[0] + along * (bone[1] - bone[0]) for bone in own] or [[start]]
        )
        assert np.linalg.norm(points - site, axis=1).min() == pytest.approx(way, abs=1e-3)
    axes = plots.plot_arm(pose).axes[0]
    marked = [line for line in axes.get_lines() if line.get_marker() in ("o", "s")]
    shown = [np.array(line.get_data_3d()).T for line in marked if line.get_label()[0] == "_"]  # type: ignore[attr-defined,index]
    turning, sliding = (
        1e3 * pose.joint_positions[each] for each in (~pose.arm.slides, pose.arm.slides)
    )
    np.testing.assert_allclose(shown[0], turning)
    np.testing.assert_allclose(shown[1], sliding)
    (below,) = plots.plot_arm(pose).legends
    assert [text.get_text() for text in below.get_texts()] == ["turns", "slides"]


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


def test_paper_figures_show_both_readings_in_newton_per_millimetre(
    results: Results,
) -> None:
    for name in ("fig3", "fig4", "fig6", "fig7", "fig8"):
        result = results[name]
        assert isinstance(result, paper.StiffnessFigure)
        figure = plots.plot_paper(result)
        labels = [axes.get_ylabel() for axes in figure.axes]
        # one label serves a row; of changes it says so
        unit = "[%]" if result.name in ("fig4", "fig7") else "[N/mm]"
        for reading in ("paper's reading", "hung weight"):
            assert sum(reading in label and unit in label for label in labels) == 1
        (below,) = figure.legends
        assert "what a small weight at the tip measures" in below.get_title().get_text()
        figure.draw_without_rendering()


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


def test_nothing_is_hidden_under_another_line(results: Results) -> None:
    result = results["fig3"]
    assert isinstance(result, paper.StiffnessFigure)
    thin, wide = plots.plot_paper(result).axes[0].get_lines()[:2]
    assert wide.get_linewidth() > 3.0 * thin.get_linewidth()
    assert thin.get_zorder() > wide.get_zorder()


def test_stages_of_the_strand_are_shaded_and_named(results: Results) -> None:
    for axes in plots.plot_paper(results["fig5"]).axes:
        words = " ".join(text.get_text().replace("\n", " ") for text in axes.texts)
        for stage in ("pre-tensioning", "elastic, near-constant", "plastic"):
            assert stage in words
        assert len(axes.patches) == 4


def test_changes_are_shown_in_both_readings_beside_the_papers_number(results: Results) -> None:
    result = results["fig4"]
    assert isinstance(result, paper.StiffnessFigure)
    figure = plots.plot_paper(result)
    figure.draw_without_rendering()
    assert len(figure.axes) == 9
    for i, axes in enumerate(figure.axes[3:6]):
        strand, original, wire, wire_original, zero, stated = axes.get_lines()[:6]
        strand_claim, wire_claim = result.claims
        assert _shown(strand)[1, -1] == pytest.approx(strand_claim.computed[i])
        assert _shown(original)[1, -1] == pytest.approx(strand_claim.original[i])
        assert _shown(wire)[1, -1] == pytest.approx(wire_claim.computed[i])
        assert _shown(wire_original)[1, -1] == pytest.approx(wire_claim.original[i])
        assert strand_claim.paper is not None
        assert _shown(stated)[1, 0] == strand_claim.paper[i]
        assert not np.any(_shown(zero)[1])


def test_lead_is_shown_for_both_readings_of_k_and_of_the_length(results: Results) -> None:
    result = results["lead"]
    assert isinstance(result, paper.LeadFigure)
    figure = plots.plot_paper(result)
    figure.draw_without_rendering()
    left, right = figure.axes
    np.testing.assert_allclose(
        _shown(left.get_lines()[0]), (1e3 * result.leads, result.stretched[:, 0, 0])
    )
    np.testing.assert_allclose(
        _shown(right.get_lines()[1]), (1e3 * result.leads, result.original[:, 1, 0])
    )
    assert "[mm]" in left.get_xlabel()


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
        np.testing.assert_allclose(_shown(linear)[0, 1], 1e3 * test.linear.displacement[axis])
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


def test_path_of_which_nothing_is_planned_is_drawn() -> None:
    arm = cdsm.presets.virtual_prototype()
    plan = cdsm.plan_path(arm, (0.0, 0.0, 1.0), [1e7, 2e7], 50.0, angles=np.full((2, 10), 0.15))
    assert plan.planned == ()
    above, below = plots.plot_path_plan(plan).axes
    wanted, held = above.get_lines()
    assert np.nanmax(_shown(wanted)[1]) == 2e4
    assert np.isnan(_shown(held)[1]).all()
    assert all(np.isnan(_shown(line)[1]).all() for line in below.get_lines())
    # the reason is that of the first alone: the ranges and targets of the others differ
    assert "samples 0 to 1: stiffness, the first of them: no admissible" in str(plan)


def test_a_single_bound_of_joints_that_slide_is_a_point_with_both_units() -> None:
    critical = cdsm.critical_tension(crab(gravity=(0.0, 0.0, 0.0)).at(POSTURE))
    assert critical.examined == (0.0, 0.0)  # its cables balance it slack, and no other way
    (axes,) = plots.plot_critical_tension(critical).axes
    assert axes.get_ylabel() == "smallest joint stiffness [N m/rad or N/m]"
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_lines()[0].get_marker() == "o"


def test_path_is_drawn_with_gaps_where_nothing_is_planned() -> None:
    arm = cdsm.presets.virtual_prototype()
    targets = np.array([80e3, 82e3, 1e7, 86e3, 1e7])
    q = np.full((5, 10), 0.15)
    plan = cdsm.plan_path(arm, (0.0, 0.0, 1.0), targets, 50.0, angles=q)
    assert plan.planned == (0, 1, 3)
    figure = plots.plot_path_plan(plan)
    figure.draw_without_rendering()
    above, below = figure.axes
    wanted, held = above.get_lines()
    # upright half-way between samples where it jumps; 80 to 82 may be how it begins to rise
    steps = [[0, 80.0], [1, 82.0], [1.5, 82.0], [1.5, 1e4], [2, 1e4], [2.5, 1e4], [2.5, 86.0]]
    steps += [[3, 86.0], [3.5, 86.0], [3.5, 1e4], [4, 1e4]]
    np.testing.assert_allclose(_shown(wanted).T, steps)
    np.testing.assert_allclose(_shown(held)[1], [80.0, 82.0, np.nan, 86.0, np.nan])
    assert len(below.get_lines()) == 15
    np.testing.assert_array_equal(_shown(below.get_lines()[4])[1, [0, 1, 3]], plan.tensions[:, 4])
    looks = {(line.get_color(), line.get_linestyle()) for line in below.get_lines()}
    assert len(looks) == 15
    legend = below.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [each.name for each in arm.cables]
    assert [len(axes.patches) for axes in (above, below)] == [2, 2]
    matrix = cdsm.stiffness(arm.at(q[0]), cdsm.distribute_tension(arm.at(q[0]), 60.0)).cartesian
    full = cdsm.plan_path(arm, None, (matrix + matrix.T) / 2.0, 50.0, angles=q[:1])
    with pytest.raises(cdsm.InvalidInput, match="plan: is one of cartesian"):
        plots.plot_path_plan(full)


def test_steps_and_ramps_of_a_path_are_drawn_as_what_they_are() -> None:
    arm = cdsm.presets.virtual_prototype()
    targets = 1e3 * np.array([80.0, 80.0, 90.0, 90.0, 91.0, 92.0, 93.0, 80.0])
    plan = cdsm.plan_path(arm, (0.0, 0.0, 1.0), targets, 50.0, angles=np.full((8, 10), 0.15))
    line: Line2D = plots.plot_path_plan(plan).axes[0].get_lines()[0]
    x = [0.0, 1.0, 1.5, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 6.5, 6.5, 7.0]
    y = [80.0, 80.0, 80.0, 90.0, 90.0, 90.0, 91.0, 92.0, 93.0, 93.0, 80.0, 80.0]
    np.testing.assert_allclose(_shown(line), [x, y])


def test_many_cables_have_colours_by_their_number_and_a_colour_bar() -> None:
    arm = cdsm.Manipulator(
        cdsm.Geometry.universal(
            joints=9,
            cables_per_joint=3,
            link_length=0.03,
            base_length=0.02,
            disk_offset=0.01,
            hole_radius=0.03,
            link_mass=0.02,
        ),
        cdsm.LinearElasticity(2e5),
    )
    q = np.full((1, arm.nv), 0.05)
    K = cdsm.stiffness(arm.at(q[0]), cdsm.distribute_tension(arm.at(q[0]), 20.0))
    u = (0.0, 0.0, 1.0)
    plan = cdsm.plan_path(arm, u, K.along(u), 10.0, angles=q)
    _, below, bar = plots.plot_path_plan(plan).axes
    assert below.get_legend() is None
    assert len({tuple(line.get_color()) for line in below.get_lines()}) == 27
    assert bar.get_ylabel() == "number of the cable"
    assert bar.get_ylim() == (1.0, 27.0)


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


def test_figures_are_one_or_two_columns_wide_and_printed_at_300_dpi(tmp_path: Path) -> None:
    pose = random_posture(mixed_arm(), 3)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0))
    for figure in (K.plot(), K.shares("z").plot(), cdsm.saturation(pose, "z", 10.0).plot()):
        width = figure.get_figwidth()
        assert width in (3.5, 7.16)
        with Image.open(plots.save_figure(figure, tmp_path / "a.png")) as image:
            assert image.width == pytest.approx(300.0 * width, abs=1.0)
    with pytest.raises(cdsm.InvalidInput, match=r"must end in \.pdf, \.svg, \.png"):
        plots.save_figure(figure, tmp_path / "a.jpg")


def test_pictures_fill_their_canvas_below_their_title_also_when_cropped() -> None:
    arm = cdsm.presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, 0.1))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0))
    forces = cdsm.force_polytope(pose, 5.0, 200.0)
    pictures = arm.plot(), K.plot(), cdsm.modes(pose, K).plot(), forces.plot()
    for figure in (*pictures, plots.plot_path([pose])):
        figure.draw_without_rendering()
        renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
        axes: Any = figure.axes[0]
        corners = axes.xaxis.get_view_interval(), axes.yaxis.get_view_interval()
        cube = np.array([*product(*corners, axes.zaxis.get_view_interval())])
        x, y, _ = proj3d.proj_transform(*cube.T, axes.get_proj())
        drawn = axes.transData.transform(np.transpose([x, y]))
        boxes = [axis.get_tightbbox(renderer) for axis in axes._axis_map.values()]
        low = np.min([drawn.min(axis=0), *(box.min for box in boxes)], axis=0)
        high = np.max([drawn.max(axis=0), *(box.max for box in boxes)], axis=0)
        size = figure.get_size_inches() * figure.dpi
        right = 1.0 if len(figure.axes) == 1 else 0.8
        assert (high - low > np.array([0.9 * right, 0.65]) * size).all()
        assert (low >= 0.0).all()
        assert high[1] <= figure._suptitle.get_window_extent().ymin  # type: ignore[attr-defined]
        cropped = figure.get_tightbbox(renderer)
        assert min(cropped.min) >= 0.0
        assert (cropped.max <= figure.get_size_inches()).all()


def test_tick_labels_do_not_touch_where_axes_meet() -> None:
    arm = cdsm.presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, 0.1))
    forces = cdsm.force_polytope(pose, 5.0, 200.0)
    for figure in (arm.plot(), cdsm.distribute_tension(pose, 20.0).plot(), forces.plot()):
        figure.draw_without_rendering()
        axes: Any = figure.axes[0]
        boxes = [
            tick.label1.get_window_extent()
            for axis in axes._axis_map.values()
            for tick in axis.get_major_ticks()
        ]
        assert len(boxes) >= 7
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


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
        *(cdsm.solve_joint_angles(pose.arm, pose.cable_lengths), cdsm.presets.STRAND_1X19),
        cdsm.inverse_kinematics(pose.arm, pose.tip),
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


def test_ranges_of_many_directions_are_a_polar_diagram() -> None:
    pose = random_posture(mixed_arm(), 3)
    turns = np.deg2rad([0.0, 60.0, 120.0])
    ranges = [
        cdsm.stiffness_range(pose, [0.0, np.cos(a), np.sin(a)], 10.0, 100.0, starts=2)
        for a in turns
    ]
    (axes,) = plots.plot_stiffness_ranges({"up to 100 N": ranges}).axes
    angle, radius = _shown(axes.get_lines()[0])
    np.testing.assert_allclose(angle[:3], turns)
    np.testing.assert_allclose(radius[[0, 3, 6]], 1e-3 * ranges[0].high)
    tilted = cdsm.stiffness_range(pose, [0.5, 0.5, 0.5], 10.0, 100.0, starts=2)
    with pytest.raises(cdsm.InvalidInput, match="no plane of two base axes"):
        plots.plot_stiffness_ranges({"a": [tilted]})


def test_bifurcation_is_where_buckling_was_found() -> None:
    geometry = cdsm.presets.experimental_prototype_geometry()
    cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(1e9), series_stiffness=1890.0)
    pose = cdsm.Manipulator(geometry, cables=cables, gravity=(0, 0, 0)).at(np.zeros(3))
    critical = cdsm.critical_tension(pose)
    found = cdsm.bifurcation(critical, bounds=critical.minimum * np.array([0.9, 1.0 - 1e-3, 1.2]))
    moved = np.linalg.norm(found.displacements, axis=1)
    # linear below: 1 mN over the stiffness along the push
    pull = cdsm.distribute_tension(pose, 0.9 * critical.minimum)
    along = cdsm.stiffness(pose, pull).along(found.push[:3])
    assert moved[0] == pytest.approx(1e-3 / along, rel=0.05)
    assert moved[2] > 0.01 > 20.0 * moved[0]
    assert len(found.to_pandas()) == 3
    assert found.to_dict()["critical_minimum_tension_N"] == critical.minimum
    (axes,) = found.plot().axes
    np.testing.assert_allclose(_shown(axes.get_lines()[0])[1], 1e3 * moved)
    stiff = cdsm.presets.virtual_prototype().at(np.full(10, 0.1))
    with pytest.raises(cdsm.InvalidInput, match="an arm that buckles is needed"):
        cdsm.bifurcation(cdsm.critical_tension(stiff))

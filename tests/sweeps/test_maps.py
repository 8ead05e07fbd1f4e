"""Workspace maps show every tip where it is, in mm, under its own colour or status."""

import itertools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.figure import Figure

import cdsm
from cdsm import plots
from cdsm.plots import maps
from cdsm.support.values import Array
from tests.support.sweeps import short_arm

PLANAR = cdsm.GridPoses(
    {"joint1_1": np.linspace(-0.4, 0.4, 5), "joint3_1": np.linspace(-0.4, 0.4, 4)}
)


def drawn(figure: Figure, panel: int = 0) -> list[PathCollection]:
    """The scatters of a panel: each status that is missing, then colours."""
    figure.draw_without_rendering()
    return [each for each in figure.axes[panel].collections if isinstance(each, PathCollection)]


def places(scatter: PathCollection) -> Array:
    return np.asarray(scatter.get_offsets(), dtype=np.float64)


@pytest.fixture(scope="module")
def planar() -> xr.Dataset:
    """Springs so soft that the upper bounds buckle the arm, in the plane of x and z."""
    arm = short_arm(spring=1500.0)
    return cdsm.sweep(arm, PLANAR, minimum=[5.0, 40.0, 100.0])


def test_tips_in_a_plane_are_shown_in_it_in_mm_with_equal_axes(planar: xr.Dataset) -> None:
    figure = plots.plot_map(planar, "softest")
    (colors,) = drawn(figure)
    tips = 1e3 * planar.tip_position.values.reshape(-1, 3)
    assert abs(tips[:, 1]).max() < 1e-9
    np.testing.assert_allclose(places(colors), tips[:, [0, 2]], rtol=1e-12)
    shown = np.asarray(colors.get_array())
    np.testing.assert_allclose(shown, 1e-3 * planar.softest[..., 0].values.ravel(), rtol=1e-12)
    axes: Any = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [mm]", "z [mm]")
    assert axes.get_aspect() == 1.0
    assert axes.get_title() == "minimum 5 N"
    assert figure.axes[-1].get_ylabel() == "stiffness in the softest direction [N/mm]"


def test_titles_and_ticks_of_narrow_panels_stay_apart(planar: xr.Dataset) -> None:
    figure = plots.plot_map(planar.isel(minimum=[0, 1]), "along")
    figure.draw_without_rendering()
    low, high = figure.axes[0].get_xlim()
    assert len(figure.axes) == 7
    titles = [axes.title.get_window_extent() for axes in figure.axes[:3]]
    ticks = [
        each.label1.get_window_extent()
        for each in figure.axes[0].xaxis.get_major_ticks()
        if low <= each.get_loc() <= high
    ]
    for boxes in (titles, ticks):
        assert len(boxes) > 1
        assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))


def test_a_path_is_seen_whole_along_each_axis() -> None:
    arm = short_arm()
    ends = np.array([[0.3, -0.2, 0.1, 0.2, -0.1, 0.3], [-0.1, 0.2, 0.2, 0.3, 0.2, -0.2]])
    found = cdsm.sweep(arm, cdsm.PathPoses(ends, 20), minimum=20.0)
    figure = plots.plot_map(found, "softest")
    tips = 1e3 * found.tip_position.values
    for panel, (axis, shown) in enumerate((("y", [0, 2]), ("z", [0, 1]), ("x", [1, 2]))):
        (colors,) = drawn(figure, panel)
        np.testing.assert_allclose(places(colors), tips[:, shown], rtol=1e-12)
        assert figure.axes[panel].get_title() == f"seen along {axis}"


def test_unstable_entries_are_marked_and_counted(planar: xr.Dataset) -> None:
    unstable = (planar.status == cdsm.SweepStatus.UNSTABLE).values
    assert not unstable[..., 0].any()
    assert unstable[..., 2].all()
    tips = 1e3 * planar.tip_position.values.reshape(-1, 3)[:, [0, 2]]
    for quantity in ("softest", "along"):
        data = planar.isel(direction=[2]) if quantity == "along" else planar
        figure = plots.plot_map(data, quantity)
        marked, colors = drawn(figure, 2)
        np.testing.assert_allclose(places(marked), tips)
        assert not len(places(colors))
        told = [text.get_text() for text in figure.legends[0].get_texts()]
        assert told == [f"unstable: {100 * unstable.mean():.3g} %"]  # no base: it is far away


def test_the_margin_is_shown_with_its_sign_also_where_it_is_negative(planar: xr.Dataset) -> None:
    figure = plots.plot_map(planar, "margin")
    (colors,) = drawn(figure, 2)
    np.testing.assert_allclose(
        np.asarray(colors.get_array()), planar.margin[..., 2].values.ravel(), rtol=1e-12
    )
    assert colors.norm.vmin == -colors.norm.vmax  # type: ignore[operator]
    assert figure.axes[-1].get_ylabel() == "stability margin [N m/rad]; below 0: unstable"


def test_infinite_values_are_at_the_end_of_the_bar() -> None:
    q = np.vstack([np.zeros(6), np.linspace(0.1, 0.4, 20)[:, None] * np.ones(6)])
    found = cdsm.sweep(short_arm(), q, minimum=20.0)  # flat, the tip cannot move along the arm
    assert np.isposinf(found.stiffest).values.tolist() == [True] + [False] * 20
    *_, colors = drawn(plots.plot_map(found, "stiffest", section=("y", 0.0, 1.0)))
    values = np.asarray(colors.get_array())
    assert np.isfinite(values).all()
    assert values[0] > float(colors.norm.vmax)  # type: ignore[arg-type]


def test_a_map_of_infinite_values_has_no_colour_bar_and_says_so() -> None:
    found = cdsm.sweep(short_arm(), np.zeros((1, 6)), minimum=20.0)
    figure = plots.plot_map(found, "stiffest")
    assert len(figure.axes) == 1  # no bar
    said = figure._suptitle.get_text()  # type: ignore[attr-defined]
    assert "is infinite at all of these tips" in " ".join(said.split())


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_margins_beyond_the_scale_keep_the_colour_of_their_sign(
    planar: xr.Dataset, sign: float
) -> None:
    data = planar.isel(minimum=0).copy(deep=True)
    sound = np.linspace(-1.0, 2.0, data.margin.size).reshape(data.margin.shape)
    data["margin"] = data.margin.copy(data=sound)
    data.margin[dict.fromkeys(data.margin.dims, 0)] = sign * 100.0
    figure = plots.plot_map(data, "margin")
    (colors,) = drawn(figure)
    red, _, blue, _ = np.transpose(colors.to_rgba(sign * np.array([100.0, 1.0])))
    assert float(colors.norm.vmax) == pytest.approx(2.0)  # type: ignore[arg-type]
    assert (
        (red < blue) == (sign > 0.0)
    ).all()  # purple and blue are stable, orange and black are not


def test_a_few_unstable_margins_have_a_scale_with_zero_in_its_middle(planar: xr.Dataset) -> None:
    data = planar.isel(minimum=0).copy(deep=True)
    sound = np.linspace(1.0, 2.0, data.margin.size).reshape(data.margin.shape)
    data["margin"] = data.margin.copy(data=sound)
    data.margin[dict.fromkeys(data.margin.dims, 0)] = -1.9
    (colors,) = drawn(plots.plot_map(data, "margin"))
    assert colors.get_clim() == (-2.0, 2.0)


def test_slices_without_the_base_do_not_draw_it() -> None:
    found = cdsm.sweep(short_arm(), cdsm.RandomPoses(64), minimum=20.0)
    for place, shown in ((0.05, False), (0.0, True)):
        figure = plots.plot_map(found, "softest", section=("x", place, 0.045))
        squares = [line for line in figure.axes[0].get_lines() if line.get_marker() == "s"]
        assert bool(squares) == shown


def test_three_dimensions_sections_and_statuses() -> None:
    arm = short_arm(cdsm.presets.STRAND_1X19)
    found = cdsm.sweep(arm, cdsm.RandomPoses(256), minimum=20.0, maximum=400.0)
    figure = plots.plot_map(found, "along")
    figure.draw_without_rendering()
    titles = [axes.get_title() for axes in figure.axes[:9]]
    assert [each.split(",")[0] for each in titles[::3]] == [f"direction {u}" for u in "xyz"]
    assert [each.split(", ")[1][0] for each in titles[:3]] == ["y", "z", "x"]  # slices of a cloud
    infeasible = float((found.status == cdsm.SweepStatus.INFEASIBLE).mean())
    assert 0.0 < infeasible < 1.0
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"infeasible: {100 * infeasible:.3g} %" in told

    section = plots.plot_map(found, "softest", section=("y", 0.01, 0.02))
    shown = np.vstack([places(each) for each in drawn(section)])
    tips = 1e3 * found.tip_position.values
    inside = tips[abs(tips[:, 1] - 10.0) <= 20.0]
    assert 0 < len(inside) < len(tips)
    order = [np.lexsort(each.T) for each in (shown, inside[:, [0, 2]])]
    np.testing.assert_allclose(shown[order[0]], inside[:, [0, 2]][order[1]], rtol=1e-12)
    assert section.axes[0].get_title() == "y\xa0=\xa010\xa0±\xa020\xa0mm"
    section = plots.plot_map(found, "softest", section=("y", -4.95e-5, 0.02))
    assert section.axes[0].get_title() == "y\xa0=\xa00\xa0±\xa020\xa0mm"


@pytest.mark.parametrize("statistic", ["median", "min", "max"])
def test_cells_show_the_statistic_of_their_tips(planar: xr.Dataset, statistic: str) -> None:
    one = planar.isel(minimum=0)
    figure = plots.plot_map(one, "softest", statistic=statistic, bins=4)  # type: ignore[arg-type]
    (mesh,) = (each for each in figure.axes[0].collections if isinstance(each, QuadMesh))
    shown: Any = np.ma.asarray(mesh.get_array())
    corners: Any = mesh.get_coordinates()
    tips = 1e3 * one.tip_position.values.reshape(-1, 3)[:, [0, 2]]
    values = 1e-3 * one.softest.values.ravel()
    assert 1 < shown.count() < len(values)
    for row, column in np.argwhere(~np.ma.getmaskarray(shown)):
        low, high = corners[row, column], corners[row + 1, column + 1]
        inside = ((tips >= low) & (tips < high)).all(axis=1)
        expected = getattr(np, statistic)(values[inside])
        assert shown[row, column] == pytest.approx(expected)
    assert figure.axes[-1].get_ylabel().startswith(f"{statistic} of a cell: stiffness in the")


def test_outliers_do_not_set_the_scale_and_have_a_colour_of_their_own(planar: xr.Dataset) -> None:
    data = planar.isel(minimum=0).copy(deep=True)
    first = data.softest.values.ravel()[1:].max()
    data.softest[dict.fromkeys(data.softest.dims, 0)] = 1e-3 * first
    figure = plots.plot_map(data, "softest")
    (colors,) = drawn(figure)
    assert colors.norm.vmin > 1e-5 * first
    below = colors.to_rgba(1e-6 * first)
    assert below not in [colors.to_rgba(x) for x in np.linspace(*colors.get_clim(), 50)]


def test_every_status_has_a_marker_of_its_own() -> None:
    marks = {each.name.lower(): maps._MARKS.get(each.name.lower()) for each in cdsm.SweepStatus}
    del marks["ok"]
    assert None not in marks.values()
    assert len({mark[0] for mark in marks.values() if mark}) == len(marks)


def test_maps_are_as_high_as_what_they_show(planar: xr.Dataset) -> None:
    """A crescent of tips is no white page: the panel is as wide and high as the tips are."""
    figure = plots.plot_map(planar.isel(minimum=0), "softest")
    figure.draw_without_rendering()
    axes = figure.axes[0]
    tips = 1e3 * planar.tip_position.values.reshape(-1, 3)[:, [0, 2]]
    for limits, way in zip((axes.get_xlim(), axes.get_ylim()), np.ptp(tips, axis=0), strict=True):
        assert np.ptp(limits) < max(way, 0.15 * np.ptp(tips, axis=0).max()) + 25.0


def test_a_map_without_a_value_has_no_colour_bar_and_says_so() -> None:
    found = cdsm.sweep(short_arm(), PLANAR, minimum=20.0, maximum=20.0)
    assert bool((found.status == cdsm.SweepStatus.INFEASIBLE).all())
    figure = plots.plot_map(found, "softest")
    assert len(figure.axes) == 1  # no bar
    said = figure._suptitle.get_text()  # type: ignore[attr-defined]
    assert "stiffness in the softest direction exists at none" in " ".join(said.split())
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["infeasible: 100 %"]


def test_a_single_value_has_plain_numbers_and_what_has_no_tip_is_counted() -> None:
    grid = cdsm.GridPoses({"joint1_1": [-3.0, -2.0, 0.0, 2.0, 3.0]})
    found = cdsm.sweep(short_arm(), grid, minimum=20.0)
    figure = plots.plot_map(found, "softest")
    (colors,) = drawn(figure)
    (value,) = np.asarray(colors.get_array())
    assert value == 1e-3 * found.softest[2]
    assert colors.norm.vmin == pytest.approx(0.95 * value, rel=1e-12)
    assert colors.norm.vmax == pytest.approx(1.05 * value, rel=1e-12)
    panel, bar = figure.axes
    for axis in (panel.xaxis, panel.yaxis, bar.yaxis):
        assert axis.get_offset_text().get_text() == ""
    low, high = panel.get_xlim()
    assert high - low == pytest.approx(2.0)  # mm
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["beyond limits: 80 %"]


def test_many_cases_of_a_cloud_are_in_two_columns_of_slices() -> None:
    found = cdsm.sweep(short_arm(), cdsm.RandomPoses(64), minimum=[20.0, 40.0])
    figure = plots.plot_map(found, "along")
    figure.draw_without_rendering()
    places = {}
    for axes in figure.axes[:18]:
        spec: Any = axes.get_subplotspec()
        places[spec.rowspan.start, spec.colspan.start] = " ".join(axes.get_title().split()).split(
            ", "
        )
    for (row, column), (bound, direction, part) in places.items():
        assert bound == f"minimum {20 * (1 + column // 3)} N"
        assert direction == f"direction {'xyz'[row]}"
        assert part[0] == "yzx"[column % 3]
    assert figure.get_figheight() < 1.2 * figure.get_figwidth()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"quantity": "status"}, "quantity: status given; a map of any other quantity marks"),
        ({"quantity": "softness"}, r"no quantity is called 'softness'.*Known: [a-z, ]+\. tip"),
        ({"quantity": "tip_position"}, "tip_position has the dimensions"),
        ({"section": ("w", 0.0, 0.1)}, "no axis is called 'w'"),
        ({"section": 3.0}, "section: 3.0 given"),
        ({"statistic": "mean"}, "no statistic is called 'mean'"),
        ({"bins": 1}, "bins"),
        ({"section": ("y", 5.0, 0.1)}, "section: has no tip to show"),
        ({"quantity": "along"}, "makes 9 panels|"),
    ],
)
def test_what_cannot_be_shown_is_named(
    arguments: dict[str, Any], said: str, planar: xr.Dataset
) -> None:
    if said.endswith("|"):
        planar = cdsm.sweep(short_arm(), PLANAR, minimum=np.arange(10.0, 14.0))
        said = r"makes 12 panels, of minimum \(4\), direction \(3\); choose up to 9"
    with pytest.raises(cdsm.CdsmError, match=said):
        plots.plot_map(planar, **arguments)


def test_a_sweep_without_tips_cannot_be_shown() -> None:
    said = r"tip_position and the quantity must be among outputs= of the sweep"
    with pytest.raises(cdsm.UnknownName, match=said):
        plots.plot_map(cdsm.sweep(short_arm(), PLANAR, minimum=20.0, outputs="margin"), "margin")
    with pytest.raises(cdsm.InvalidInput, match="the Dataset of a sweep is needed"):
        plots.plot_map(3)  # type: ignore[arg-type]
    beyond = cdsm.sweep(short_arm(), np.full((2, 6), 3.0), minimum=20.0)
    with pytest.raises(cdsm.InvalidInput, match="has no tip to show"):
        plots.plot_map(beyond)

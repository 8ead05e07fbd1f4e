"""Maps show every value in its cell, in its unit, and hatch what does not hold."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

import cdsm
from cdsm import plots
from cdsm.plots import map_cells, maps
from cdsm.plots.map_cells import Cells
from tests.support.pictures import artists, line, named, require_look, words
from tests.support.printed import numbers
from tests.support.sweeps import short_arm

BENDS = np.deg2rad([-20.0, -5.0, 5.0, 15.0])
PLANAR = cdsm.GridPoses({"joint1_1": BENDS, "joint3_1": np.deg2rad([-10.0, 0.0, 10.0])})


@pytest.fixture(scope="module")
def planar() -> xr.Dataset:
    """Springs so soft that the upper bounds buckle the arm."""
    return cdsm.sweep(
        short_arm(spring=1500.0, lead=0.5), PLANAR, minimum=[5.0, 40.0, 100.0], progress=False
    )


def cells(ax: Any) -> Any:
    """The drawn values (n, m), NaN where there are none."""
    mesh = artists(ax, "cells")["cells"]
    return np.ma.filled(mesh.get_array().astype(float), np.nan)


def test_cells_of_two_joints_have_their_value_at_their_angles(planar: xr.Dataset) -> None:
    axs = plots.plot_map(planar.sel(minimum=5.0), "along")
    for ax, u in zip(axs, "xyz", strict=True):
        values = 1e-3 * planar.along.sel(minimum=5.0, direction=u).values
        shown = cells(ax)
        finite = np.isfinite(values.T)
        np.testing.assert_allclose(shown[finite], values.T[finite])
        x, y = artists(ax, "cells")["cells"].get_coordinates()[[0, -1], [0, -1]].T
        np.testing.assert_allclose(x, [-27.5, 20.0])  # half a step beyond the angles
        np.testing.assert_allclose(y, [-15.0, 15.0])
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("joint1_1 [°]", "joint3_1 [°]")
        marks = np.quantile(values[~np.isnan(values)], (0.1, 0.5, 0.9), method="inverted_cdf")
        shown = numbers(words([ax]), "10/50/90 %: {} / {} / {}")
        assert [mark.text for mark in shown] == [f"{mark:.3g}" for mark in marks]
    status = planar.sel(minimum=5.0).status.values
    (part,) = numbers(words(axs), "{} hold")
    assert float(part.text) == pytest.approx(100.0 * np.isin(status, [0, 7]).mean(), abs=0.06)
    norms = [artists(ax, "cells")["cells"].norm for ax in axs]
    assert norms[0].vmax > 3.0 * norms[1].vmax  # a scale for each direction
    figure = axs[0].figure
    labels = [ax.get_xlabel() for ax in figure.axes if ax not in list(axs)]
    assert labels == [f"stiffness along {u} [N/mm]" for u in "xyz"]
    require_look(axs)


def test_unstable_cells_are_hatched_and_cases_share_a_scale(planar: xr.Dataset) -> None:
    axs = plots.plot_map(planar, "softest")
    limits = {artists(ax, "cells")["cells"].get_clim() for ax in axs}
    assert len(limits) == 1
    assert not artists(axs[0], "fault:")
    (hatched,) = artists(axs[2], "fault:").items()
    assert hatched[0] == "fault:unstable"
    legend = {key.get_text() for legend in axs[0].figure.legends for key in legend.get_texts()}
    assert legend == {"unstable"}
    for ax, low in zip(axs, (5, 40, 100), strict=True):
        assert f"tensions from {low} N" in words([ax])
    assert len(hatched[1].get_paths()) == 12
    assert np.isnan(cells(axs[2])).all()
    margins = plots.plot_map(planar, "margin")
    np.testing.assert_allclose(cells(margins[2]), planar.margin.sel(minimum=100.0).values.T)
    norm = artists(margins[2], "cells")["cells"].norm
    assert norm.vmin == -norm.vmax
    require_look(axs)


def test_a_missing_cell_is_hatched_and_an_infinite_one_has_the_top_colour() -> None:
    values = np.array([[1.0, 2.0, np.nan], [4.0, 5.0, np.inf]])
    faults = {"no balance": np.isnan(values)}
    panel = Cells(
        "", np.arange(4.0), 10.0 * np.arange(3.0), values, faults, ("x [mm]", "y [mm]"), ""
    )
    ax = Figure().subplots()
    colors, extend = maps._colors([values])
    maps._draw(ax, panel, colors)
    shown = cells(ax)
    np.testing.assert_allclose(shown[0, :2], [1.0, 2.0])
    np.testing.assert_allclose(shown[1, :2], [4.0, 5.0])
    assert np.isnan(shown[0, 2])
    assert shown[1, 2] > 1e100
    assert extend in ("max", "both")
    assert colors.get_clim()[1] <= 5.0
    (hatch,) = artists(ax, "fault:no balance").values()
    np.testing.assert_allclose(hatch.get_paths()[0].get_extents().bounds, [2.0, 0.0, 1.0, 10.0])


def test_bins_are_medians_by_hand() -> None:
    points = np.array([[0.5, 0.5], [0.6, 0.4], [0.7, 0.1], [2.5, 1.5], [1.5, 0.5]])
    values = np.array([1.0, 9.0, 2.0, np.inf, 4.0])
    edges = np.arange(4.0), np.arange(3.0)
    binned = map_cells.bin_values(points, values, edges, "median")
    np.testing.assert_array_equal(binned, [[2.0, 4.0, np.nan], [np.nan, np.nan, np.inf]])
    assert map_cells.bin_values(points, values, edges, "max")[0, 0] == 9.0


def test_a_cell_without_a_value_has_the_hatch_of_most_of_its_postures() -> None:
    unstable, lost = int(cdsm.Status.UNSTABLE), int(cdsm.Status.INFEASIBLE)
    points = np.array([[0.5, 0.5]] * 3 + [[1.5, 0.5]] * 4)
    status = np.array([unstable, lost, unstable, lost, lost, unstable, 0])
    values = np.where(status == 0, 1.0, np.nan)
    edges = np.arange(3.0), np.arange(2.0)
    cells = map_cells.bin_values(points, values, edges, "median")
    faults = map_cells._binned_faults(points, values, status, edges, cells)
    assert {words: mask.tolist() for words, mask in faults.items()} == {
        "unstable": [[True, False]],
        "no balance": [[False, False]],  # the other cell has a value
    }
    faults = map_cells._binned_faults(points[:6], values[:6], status[:6], edges, cells * np.nan)
    assert faults["no balance"].tolist() == [[False, True]]


def test_reasons_for_no_value_are_told_apart_by_their_hatches() -> None:
    looks = [*map_cells.FAULTS.values(), map_cells.OTHER]
    for part in zip(*((face, hatch) for _, face, hatch, _ in looks), strict=True):
        assert len({*part}) == len(looks)


def test_wide_ranges_have_logarithmic_colours() -> None:
    for values, logarithmic in (
        (np.linspace(1.0, 7.0, 50), False),
        (np.geomspace(1, 20, 50), True),
    ):
        colors, _ = maps._colors([values])
        assert isinstance(colors.norm, LogNorm) == logarithmic


def test_a_cloud_is_shown_in_slices_and_a_section_has_its_tips_alone() -> None:
    arm = short_arm(cdsm.presets.STRAND_1X19)
    dataset = cdsm.sweep(arm, cdsm.RandomPoses(256), minimum=20.0, maximum=400.0, progress=False)
    axs = plots.plot_map(dataset)
    assert len(axs) == 3
    tips = 1e3 * dataset.tip_position.values
    for ax, normal in zip(axs, (1, 2, 0), strict=True):
        middle, half = numbers(words([ax]), f"{'xyz'[normal]} = {{}} ± {{}} mm")
        assert float(middle.text) == pytest.approx(np.median(tips[:, normal]), abs=0.06)
        assert float(half.text) == pytest.approx(0.04 * np.ptp(tips[:, normal]), rel=0.06)
        plane = [axis for axis in "xyz" if axis != "xyz"[normal]]
        assert [ax.get_xlabel(), ax.get_ylabel()] == [f"{axis} [mm]" for axis in plane]
        inside = abs(tips[:, normal] - np.median(tips[:, normal])) <= 0.04 * np.ptp(tips[:, normal])
        held = np.isfinite(dataset.softest.values[inside]).sum()
        assert f"{held} of {inside.sum()} postures hold" in words([ax])
    assert any("no balance" in gid for ax in axs for gid in artists(ax, "fault:"))
    (ax,) = plots.plot_map(dataset, section=("y", 0.01, 0.02))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [mm]", "z [mm]")
    inside = abs(tips[:, 1] - 10.0) <= 20.0
    values = 1e-3 * dataset.softest.values[inside]
    binned = cells(ax)
    low, high = np.nanmin(values), np.nanmax(values)
    assert low <= np.nanmin(binned) <= np.nanmax(binned) <= high
    holds = int(np.isfinite(values).sum())
    assert f"{holds} of {inside.sum()} postures hold" in ax.get_title(loc="left")
    edges = artists(ax, "cells")["cells"].get_coordinates()
    assert edges[..., 0].min() <= tips[inside, 0].min()
    assert edges[..., 1].max() >= tips[inside, 2].max()
    require_look(axs)


def test_a_path_is_a_curve_over_the_way() -> None:
    arm = short_arm(cdsm.presets.STRAND_1X19)
    way = cdsm.PathPoses([np.zeros(6), np.full(6, 0.1)], 5)
    dataset = cdsm.sweep(arm, way, minimum=[10.0, 20.0], progress=False)
    (ax,) = plots.plot_map(dataset)
    for low in (10, 20):
        name = f"tensions from {low} N"
        x, y = line(ax, f"line:{name}").T
        np.testing.assert_allclose(x, np.rad2deg(dataset.distance.values))
        np.testing.assert_allclose(y, 1e-3 * dataset.softest.sel(minimum=low).values)
        assert named(ax)[name].xy[1] == pytest.approx(y[-1])
    assert ax.get_xlabel() == "way along the path [°]"
    assert " ".join(ax.get_ylabel().split()) == "stiffness in the softest direction [N/mm]"
    require_look(ax)
    gap = dataset.copy(deep=True)
    gap.softest.loc[{"pose": gap["pose"][2]}] = np.nan
    (ax,) = plots.plot_map(gap)
    (span,) = artists(ax, "no value").values()  # halfway to the postures beside it
    ends = np.rad2deg(dataset.distance.values[1:4])
    assert span.get_x() == pytest.approx((ends[0] + ends[1]) / 2.0)
    assert span.get_x() + span.get_width() == pytest.approx((ends[1] + ends[2]) / 2.0)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ({"quantity": "status"}, "quantity: status has the dimensions"),
        ({"quantity": "softness"}, r"no quantity is called 'softness'.*must be among outputs of"),
        ({"statistic": "mean"}, "no statistic is called 'mean'"),
        ({"section": ("y", 5.0, 0.1)}, "section: has no tip to show"),
    ],
)
def test_what_cannot_be_shown_is_named(
    arguments: dict[str, Any], problem: str, planar: xr.Dataset
) -> None:
    with pytest.raises(cdsm.CdsmError, match=problem):
        plots.plot_map(planar, **arguments)

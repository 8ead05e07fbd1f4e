"""Workspace maps show every tip where it is, in mm, under its own colour or as unstable."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

import cdsm
from cdsm import plots
from cdsm.support.values import Array
from tests.support.sweeps import short_arm

PLANAR = cdsm.GridPoses(
    {"joint1_1": np.linspace(-0.4, 0.4, 5), "joint3_1": np.linspace(-0.4, 0.4, 4)}
)


def drawn(figure: Figure, panel: int = 0) -> list[PathCollection]:
    """The scatters of a panel: tips without a value, unstable ones, then colours."""
    figure.draw_without_rendering()
    return [each for each in figure.axes[panel].collections if isinstance(each, PathCollection)]


def places(scatter: PathCollection) -> Array:
    return np.asarray(scatter.get_offsets(), dtype=np.float64)


@pytest.fixture(scope="module")
def planar() -> xr.Dataset:
    """Springs so soft that the upper bounds buckle the arm, in the plane of x and z."""
    return cdsm.sweep(short_arm(spring=1500.0), PLANAR, minimum=[5.0, 40.0, 100.0])


def test_tips_in_a_plane_are_shown_in_mm_and_the_unstable_are_marked(planar: xr.Dataset) -> None:
    figure = plots.plot_map(planar, "softest")
    (colors,) = drawn(figure)
    tips = 1e3 * planar.tip_position.values.reshape(-1, 3)
    assert abs(tips[:, 1]).max() < 1e-9
    np.testing.assert_allclose(places(colors), tips[:, [0, 2]], rtol=1e-12)
    shown = np.asarray(colors.get_array())
    np.testing.assert_allclose(shown, 1e-3 * planar.softest[..., 0].values.ravel(), rtol=1e-12)
    axes: Any = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x [mm]", "z [mm]", 1.0)
    assert "[N/mm]" in figure.axes[-1].get_ylabel()
    marked, colors = drawn(figure, 2)
    np.testing.assert_allclose(places(marked), tips[:, [0, 2]])
    assert not len(places(colors))
    (colors,) = drawn(plots.plot_map(planar, "margin"), 2)
    shown, margins = np.asarray(colors.get_array()), planar.margin[..., 2].values.ravel()
    assert (shown < 0.0).all()
    np.testing.assert_allclose(shown, margins, rtol=1e-12)
    assert colors.norm.vmin == -colors.norm.vmax  # type: ignore[operator]


def test_a_cloud_is_shown_in_slices_and_a_section_has_its_tips_alone() -> None:
    arm = short_arm(cdsm.presets.STRAND_1X19)
    found = cdsm.sweep(arm, cdsm.RandomPoses(256), minimum=20.0, maximum=400.0)
    figure = plots.plot_map(found, "along")
    figure.draw_without_rendering()
    assert "no value" in [text.get_text() for text in figure.legends[0].get_texts()]

    section = plots.plot_map(found, "softest", section=("y", 0.01, 0.02))
    shown = np.vstack([places(each) for each in drawn(section)])
    tips = 1e3 * found.tip_position.values
    inside = tips[abs(tips[:, 1] - 10.0) <= 20.0]
    assert 0 < len(inside) < len(tips)
    order = [np.lexsort(each.T) for each in (shown, inside[:, [0, 2]])]
    np.testing.assert_allclose(shown[order[0]], inside[:, [0, 2]][order[1]], rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"quantity": "status"}, "quantity: status has the dimensions"),
        ({"quantity": "softness"}, r"no quantity is called 'softness'.*must be among outputs of"),
        ({"statistic": "mean"}, "no statistic is called 'mean'"),
        ({"section": ("y", 5.0, 0.1)}, "section: has no tip to show"),
    ],
)
def test_what_cannot_be_shown_is_named(
    arguments: dict[str, Any], said: str, planar: xr.Dataset
) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        plots.plot_map(planar, **arguments)

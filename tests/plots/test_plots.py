"""Figures draw what they are given, with units; how they look was looked at."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]
from PIL import Image

import cdsm
from cdsm import paper, plots, track
from cdsm.planning.path_plan import PathPlan
from cdsm.support.values import Plotted
from tests.identification import test_search as identified
from tests.support.arms import mixed_arm, random_posture
from tests.support.tracking import small_path

POSE = random_posture(mixed_arm(), 3)
PULL = cdsm.distribute_tension(POSE, 10.0)
K = cdsm.stiffness(POSE, PULL)
REACH = cdsm.stiffness_range(POSE, "z", 10.0, 200.0)
TARGET = REACH.low + 0.2 * (REACH.high - REACH.low)
LOOP = cdsm.load_cycle(POSE, PULL, [[0.0, 0.0, -1.0, 0.0, 0.0, 0.0]])


def _drawn(figure: Figure) -> Figure:
    """Draw a figure; each panel that is labelled has units on both axes."""
    figure.draw_without_rendering()
    for label in (text() for axes in figure.axes for text in (axes.get_xlabel, axes.get_ylabel)):
        units = r"\[.+\]|number|sample|factor|measurement|σ"
        assert not label or re.search(units, label), label
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


def path() -> PathPlan:
    q = np.linspace(1.0, 0.999, 3)[:, None] * POSE.q
    return cdsm.plan_path(POSE.arm, "z", TARGET, 10.0, 200.0, angles=q)


PICTURES: tuple[Callable[[], Any], ...] = (
    lambda: POSE.arm,
    lambda: POSE,
    lambda: PULL,
    lambda: K,
    lambda: K.shares("z"),
    lambda: cdsm.modes(K),
    lambda: REACH,
    lambda: cdsm.plan_stiffness(POSE, "z", TARGET, 10.0, 200.0),
    path,
    lambda: cdsm.saturation(POSE, "z", 10.0, 200.0),
    lambda: cdsm.equilibrium(POSE, PULL),
    lambda: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0)),
    lambda: LOOP,
    lambda: cdsm.critical_tension(POSE),
    lambda: cdsm.critical_load(POSE, np.eye(6)[0], 10.0),
    lambda: cdsm.presets.STRAND_1X19,
    lambda: cdsm.force_polytope(POSE, 10.0, 200.0),
    lambda: cdsm.fit_tensile_test(np.linspace(0.0, 5e-3, 50), np.linspace(0.0, 480.0, 50), 0.5),
    lambda: track(small_path(0.1), steps=2, minimum=10.0, maximum=250.0),
    lambda: identified.NOISY,
    lambda: paper.FIGURES["fig3"](),
    lambda: paper.FIGURES["fig5"](),
)


@pytest.mark.parametrize("result", PICTURES)
def test_every_picture_is_drawn_with_units(result: Callable[[], Any]) -> None:
    before = dict(matplotlib.rcParams)
    _drawn(result().plot())
    assert dict(matplotlib.rcParams) == before


def test_each_class_names_the_function_that_draws_it() -> None:
    for module in pkgutil.walk_packages(cdsm.__path__, "cdsm."):
        importlib.import_module(module.name)
    todo, found = Plotted.__subclasses__(), 0
    for kind in todo:
        todo += kind.__subclasses__()
        if "_figure" in vars(kind):
            found += 1
            first, *_ = inspect.signature(getattr(plots, kind._figure)).parameters.values()
            assert first.annotation.split(".")[-1] == kind.__name__
    assert found > 15
    assert not hasattr(cdsm.stiffness_gradient(K), "plot")


def test_ranges_are_drawn_and_a_path_is_filmed(tmp_path: Path) -> None:
    _drawn(plots.plot_stiffness_ranges({"up to 200 N": [REACH]}))
    plots.plot_path(path(), animate=tmp_path / "arm.gif")
    with Image.open(tmp_path / "arm.gif") as film:
        assert film.n_frames == 3  # type: ignore[attr-defined]


def test_what_cannot_be_drawn_is_named(tmp_path: Path) -> None:
    other: Any = cdsm.presets.virtual_prototype().at(np.zeros(10))
    jpg, film = tmp_path / "a.jpg", tmp_path / "a.mp4"
    for call, said in (
        (lambda: plots.plot_arm(3), "pose: 3 given; a Posture is needed"),  # type: ignore[arg-type]
        (lambda: plots.plot_arm(other, PULL), "tension: belongs to another arm"),
        (lambda: plots.plot_arm(other, stiffness=K), "stiffness: belongs to another posture"),
        (lambda: plots.plot_path([POSE, other]), "path: give postures of one arm"),
        (lambda: plots.plot_path([POSE], animate=film), r"must end in \.gif"),
        (lambda: plots.save_figure(POSE.plot(), jpg), r"path: .*\.pdf, \.svg, \.png"),
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

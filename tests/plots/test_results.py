"""Pictures of fits, plans, budgets and runs show the numbers of their results."""

import importlib
import inspect
import pkgutil
from dataclasses import replace
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

import cdsm
from cdsm import plots, track
from cdsm.identification import Identification, WeightLoop, identify
from cdsm.planning.path_plan import PathPlan
from cdsm.plots.laws import shade_stages
from cdsm.support.values import Plotted
from tests.design import test_problem as designs
from tests.identification import test_experiment as experiment
from tests.identification import test_search as identified
from tests.support.pictures import artists, labels, line, named, require_look, rows, words
from tests.support.printed import numbers, require_all
from tests.support.sweeps import short_arm
from tests.support.tracking import small_path

STRAND = cdsm.presets.STRAND_1X19


def test_wanted_and_reached_stiffness_of_a_plan_are_positive_and_tensions_its_own() -> None:
    plan: PathPlan = small_path(0.0)
    axs = plan.plot()
    above, below = axs
    np.testing.assert_allclose(line(above, "wanted:z"), np.c_[[0, 1, 2], 1e-3 * plan.target])
    np.testing.assert_allclose(line(above, "reached:z"), np.c_[[0, 1, 2], 1e-3 * plan.achieved])
    assert (above.get_ylabel(), below.get_xlabel()) == ("stiffness [N/mm]", "sample")
    assert below.get_ylabel() == "tension of each cable [N]"
    assert "Every sample is" in words(axs)
    for name, values in zip(plan.arm.cables.names, plan.tensions.T, strict=True):
        np.testing.assert_allclose(line(below, f"tension:{name}"), np.c_[[0, 1, 2], values])
    require_look(axs)


def test_infeasible_samples_are_hatched() -> None:
    plan = small_path(target=(15e3, 15e3, 9e7))
    axs = plan.plot()
    bad = {sample.index for sample in plan.infeasible}
    assert bad == {2}
    assert "hatched: 1 of 3 samples infeasible" in words(axs).replace("Hatched", "hatched")
    for ax in axs:
        (span,) = artists(ax, "infeasible").values()
        assert span.get_x() == pytest.approx(1.5)
        assert span.get_width() == pytest.approx(1.0)


def test_tracking_run_is_drawn_over_time() -> None:
    run = track(small_path(0.1), steps=2, minimum=10.0, maximum=250.0)
    axs = run.plot()
    error, stiffness, band, tension = axs
    np.testing.assert_allclose(line(error, "tip error"), np.c_[run.time, 1e3 * run.tip_error])
    np.testing.assert_allclose(line(stiffness, "wanted:z")[:, 1], 1e-3 * run.target[:, 0])
    np.testing.assert_allclose(line(stiffness, "reached:z")[:, 1], 1e-3 * run.stiffness[:, 0])
    dashes = [artists(stiffness, f"{name}:z")[f"{name}:z"].get_linestyle() for name in (
        "wanted", "reached")]  # fmt: skip
    assert dashes == ["--", "-"]
    assert [*labels(stiffness).values()] == ["along z; dashed: wanted"]
    np.testing.assert_allclose(line(band, "displacement")[:, 1], 1e3 * run.displacement)
    edge = artists(band, "band")["band"].get_paths()[0].vertices[:, 1]
    half = 1e3 * run.band[np.isfinite(run.band)].max()
    np.testing.assert_allclose([edge.min(), edge.max()], [-half, half])
    name = run.plan.arm.cables.names[0]
    np.testing.assert_allclose(line(tension, f"tension:{name}")[:, 1], run.tension[:, 0])
    assert [ax.get_ylabel().split("[")[-1] for ax in axs] == ["mm]", "N/mm]", "mm]", "N]"]
    assert tension.get_xlabel() == "time [s]"
    assert f"what does the law {run.law} hold?" in words(axs)
    require_look(axs)


def test_the_time_at_which_the_load_changes_is_dotted() -> None:
    run = track(small_path(0.0), steps=2, minimum=10.0, maximum=250.0, payload=0.05)
    first = run.time[1:][(np.diff(run.wrench, axis=0) != 0.0).any(axis=1)][0]
    for ax in run.plot():
        np.testing.assert_allclose(line(ax, "load changes")[:, 0], first)


def test_ranges_of_directions_are_drawn_around() -> None:
    pose = short_arm(STRAND).at(np.full(6, 0.1))
    ranges = [cdsm.stiffness_range(pose, u, 10.0, 200.0) for u in "yz"]
    ax = plots.plot_stiffness_ranges({"up to 200 N": ranges})
    turn, radius = line(ax, "stiffest:up to 200 N").T
    np.testing.assert_allclose(turn[:2], [0.0, np.pi / 2.0], atol=1e-12)
    np.testing.assert_allclose(radius[:2], [1e-3 * r.high for r in ranges])
    np.testing.assert_allclose(line(ax, "softest")[:2, 1], [1e-3 * r.low for r in ranges])
    ends = [text.get_text() for text in ax.get_xticklabels()]
    assert ends == ["+y", "+z", "−y", "−z"]
    np.testing.assert_allclose(np.rad2deg(ax.get_xticks()), [0.0, 90.0, 180.0, 270.0])
    assert "[N/mm]" in words(ax)
    with pytest.raises(cdsm.InvalidInput, match="ax: is not polar"):
        plots.plot_stiffness_ranges({"a": ranges}, ax=Figure().subplots())


def test_fit_of_a_tensile_test_is_drawn_over_it() -> None:
    fit = cdsm.fit_tensile_test(np.linspace(0.0, 5e-3, 50), np.linspace(0.0, 480.0, 50), 0.5)
    axs = fit.plot()
    left, right = axs
    strain, force = line(left, "test").T
    np.testing.assert_allclose(strain, 100.0 * fit.test.displacement / 0.5)
    np.testing.assert_allclose(force, fit.test.force)
    assert np.interp(240.0, *line(left, "fit").T[::-1]) == pytest.approx(0.5, rel=0.05)
    np.testing.assert_allclose(line(right, "rigidity").T, [fit.tension, 1e-3 * fit.rigidity])
    edge = artists(right, "band")["band"].get_paths()[0].vertices[:, 1]
    ends = 1e-3 * fit.band.low.min(), 1e-3 * fit.band.high.max()
    np.testing.assert_allclose([edge.min(), edge.max()], ends)
    for stage in fit.stages:
        span = artists(right, f"stage:{stage.name}")[f"stage:{stage.name}"]
        assert span.get_x() == pytest.approx(stage.low)
        assert span.get_x() + span.get_width() == pytest.approx(stage.high)
    assert (left.get_xlabel(), left.get_ylabel()) == ("strain [%]", "force [N]")
    assert (right.get_xlabel(), right.get_ylabel()) == ("tension [N]", "tangent rigidity EA [kN]")
    require_all([(numbers(words(axs), "wire of {}")[0], fit.test.gauge_length)])
    assert labels(left) == {"test": "test", "fit": "fit"}
    assert labels(right) == {"band": "95 % band", "rigidity": "EA"}
    require_look(axs)
    zero = np.r_[-1e-3, np.linspace(0.0, 5e-3, 50)] + 2e-3  # mounted with a loose wire
    loose = cdsm.fit_tensile_test(zero, np.r_[0.0, np.linspace(0.0, 480.0, 50)], 0.5)
    fitted = line(loose.plot()[0], "fit").T[::-1]
    assert np.interp(240.0, *fitted) == pytest.approx(0.9, rel=0.05)


@pytest.mark.parametrize("along", ["x", "y"])
def test_stages_of_a_wire_stand_between_their_ends(along: str) -> None:
    ax = Figure().subplots()
    stages = [("pre-tensioning", 10.0, 30.0), ("elastic", 30.0, 90.0)]
    shade_stages(ax, stages, along)
    for name, low, high in stages:
        span = artists(ax, f"stage:{name}")[f"stage:{name}"]
        start = span.get_x() if along == "x" else span.get_y()
        size = span.get_width() if along == "x" else span.get_height()
        assert (start, size) == pytest.approx((low, high - low))
        place = named(ax)[name].get_position()["xy".index(along)]
        assert place == pytest.approx((low + high) / 2.0)


def test_law_of_a_wire_is_drawn_in_kilonewtons() -> None:
    ax = STRAND.plot()
    F, EA = line(ax, "tangent").T
    np.testing.assert_allclose(EA, 1e-3 * np.asarray(STRAND.rigidity(F)))
    np.testing.assert_allclose(line(ax, "secant")[:, 1], 1e-3 * STRAND.secant_rigidity(F))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("tension [N]", "rigidity EA [kN]")
    assert labels(ax) == {"tangent": "tangent, dF/dε", "secant": "secant"}
    require_look(ax)


def test_identified_stiffness_is_predicted_over_measured() -> None:
    fit = identified.NOISY
    axs = fit.plot()
    points = line(axs[0], "predicted:N/mm")
    np.testing.assert_allclose(points, 1e-3 * np.c_[fit.measured, fit.predicted])
    assert (axs[0].get_xlabel(), axs[0].get_ylabel()) == (
        "measured [N/mm], ± σ", "predicted [N/mm]"
    )  # fmt: skip
    bars = artists(axs[0], "sigma:N/mm")["sigma:N/mm"].get_segments()
    half = [np.ptp(segment[:, 0]) / 2.0 for segment in bars]
    np.testing.assert_allclose(half, [1e-3 * measurement.std for measurement in fit.measurements])
    np.testing.assert_allclose(line(axs[-1], "residuals")[:, 1], fit.residuals)
    for width in (1, 2):
        span = artists(axs[-1], f"within:{width}")[f"within:{width}"]
        np.testing.assert_allclose([span.get_y(), span.get_height()], [-width, 2 * width])
    require_look(axs)


def hinge(friction: float = 0.1) -> cdsm.Manipulator:
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, cables_per_joint=2, link_length=0.15, base_length=0.02,
        disk_offset=0.02, hole_radius=0.025, link_mass=0.1, lead=0.3, friction=friction,
    )  # fmt: skip
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(48e3))


@pytest.fixture(scope="module")
def loops() -> Identification:
    loop = WeightLoop(
        direction="-z", angles=[0.45], forces=[0, 16, 0], minimum=200.0, displacement_std=5e-6
    )
    rng = np.random.default_rng(0)
    return identify(hinge, [loop.simulated(hinge(), rng)], {"friction": (0.0, 0.5)}, progress=False)


def test_loops_are_force_over_displacement_along_the_force(loops: Identification) -> None:
    axs = loops.plot()
    for name, values in (("predicted", loops.predicted), ("measured", loops.measured)):
        (gid,) = artists(axs[0], f"{name}:")
        moved, force = line(axs[0], gid).T
        np.testing.assert_allclose(force, [0.0, 16.0, 0.0])
        (axis,) = loops.measurements[0].axes  # type: ignore[union-attr]
        down = -axis[2] * 1e3 * (values - loops.measured[0])
        np.testing.assert_allclose(moved, down, atol=1e-12)
        assert moved[1] > 0.0  # along the weight
    require_look(axs)


@pytest.fixture(scope="module")
def budget() -> Any:
    return cdsm.uncertainty(*_uncertain(), direction="z")


def _uncertain() -> tuple[cdsm.Posture, cdsm.Tension, cdsm.Tolerances]:
    pose = short_arm(STRAND).at(np.full(6, 0.1))
    tolerances = cdsm.Tolerances(rigidity=0.05, tension=1.0)
    return pose, cdsm.distribute_tension(pose, 40.0), tolerances


def test_bars_of_a_budget_are_its_sources(budget: Any) -> None:
    ax = budget.plot()
    unit, size = budget.measurand.unit
    bars = artists(ax, "source:")
    for source, u in budget.contributions.items():
        if u:
            assert bars[f"source:{source.replace('_', ' ')}"].get_width() == pytest.approx(u / size)
    whole = bars["source:all together"].get_width()
    assert [f"source:{name}" for name in rows(ax)] == [*bars]
    assert whole == pytest.approx(budget.standard_uncertainty / size)
    assert ax.get_xlabel() == f"standard uncertainty [{unit}]"
    require_all([(numbers(words(ax), "= {}: what makes it uncertain")[0], budget.value)])
    written = [float(text.get_text()) for text in ax.texts]
    np.testing.assert_allclose(written, [bar.get_width() for bar in bars.values()], rtol=6e-3)
    require_look(ax)


def test_intervals_of_monte_carlo_stand_where_they_are(budget: Any) -> None:
    run = cdsm.monte_carlo(*_uncertain(), direction="z", draws=2000, progress=False)
    ax = run.plot()
    unit, size = budget.measurand.unit
    assert ax.get_xlabel() == f"{budget.name} [{unit}]"
    assert ax.get_ylabel() == f"probability density [1/({unit})]"
    assert labels(ax) == {"histogram": "Monte Carlo", "first order": "first order"}
    for name, interval in (("Monte Carlo", run.interval()), ("first order", budget.interval())):
        ends = [
            float(mark.get_xdata()[0]) for mark in ax.lines if mark.get_gid() == f"interval:{name}"
        ]
        np.testing.assert_allclose(ends, np.array(interval) / size)
    x, y = line(ax, "first order").T
    assert np.trapezoid(y, x) == pytest.approx(1.0, abs=0.01)
    assert x[y.argmax()] == pytest.approx(budget.value / size, rel=1e-2)
    (histogram,) = artists(ax, "histogram").values()
    corners = histogram.get_xy()
    area = np.sum(
        corners[:-1, 0] * np.diff(corners[:, 1]) - corners[:-1, 1] * np.diff(corners[:, 0])
    )
    assert abs(area) / 2.0 == pytest.approx(1.0, abs=0.01)
    middle = (corners[:, 0].min() + corners[:, 0].max()) / 2.0
    assert middle == pytest.approx(budget.value / size, rel=0.1)
    require_look(ax)


def test_planned_tests_have_their_counts_and_intervals() -> None:
    plan = experiment.PLAN
    left, right = axs = plan.plot()
    half = 1.96 * plan.std / abs(plan.values)
    for name, part in zip(plan.names, half, strict=True):
        bar = artists(left, f"interval:{name}")[f"interval:{name}"]
        assert bar.get_width() == pytest.approx(100.0 * part)
    assert rows(left) == [*plan.names]
    bars = artists(right, "tests:").values()
    assert [bar.get_height() for bar in bars] == plan.counts.tolist()
    middles = [bar.get_x() + bar.get_width() / 2.0 for bar in bars]
    np.testing.assert_allclose(middles, np.arange(len(plan.counts)), atol=1e-9)
    assert left.get_xlabel() == "95 % interval, ± [% of the expected value]"
    assert f"{plan.counts.sum()} tests chosen" in words(axs)
    assert (right.get_xlabel(), right.get_ylabel()) == ("candidate", "tests")
    assert not left.texts
    require_look(axs)
    blind = [J * ([0.0] + [1.0] * (J.shape[1] - 1)) for J in plan.jacobians]
    left, _ = replace(plan, jacobians=tuple(blind)).plot()
    (missing,) = left.texts
    assert missing.get_text().strip() == "not determined"
    assert missing.get_position()[1] == left.get_yticks()[0]  # in the row of the first parameter


def test_designs_have_their_objectives_and_the_compromise_a_ring() -> None:
    objectives = tuple(cdsm.Objective(name) for name in ("tension", "wire_length"))
    task = designs.problem(objectives=objectives)
    search = cdsm.search_designs(task, generations=2, population=12, seed=1)
    assert 0 < search.compromise < len(search.front) - 1
    axs = search.plot()
    values = [search.best[each.key] / each.unit[1] for each in objectives]
    labels = [" ".join(label.split()) for label in search.objective_labels]
    for ax, k in zip(axs, range(1, len(objectives)), strict=True):
        np.testing.assert_allclose(line(ax, "front"), np.c_[values[0], values[k]])
        ring = [values[0][search.compromise], values[k][search.compromise]]
        np.testing.assert_allclose(line(ax, "compromise"), [ring])
        shown = [" ".join(text.split()) for text in (ax.get_xlabel(), ax.get_ylabel())]
        assert shown == [labels[0], labels[k]]
    assert f"which of {len(search.evaluated)} designs" in words(axs)
    require_look(axs)


def test_search_for_one_objective_gets_better() -> None:
    task = replace(designs.problem(), objectives=designs.problem().objectives[:1])
    search = cdsm.search_designs(task, generations=3, population=8, seed=1)
    (ax,) = search.plot()
    (objective,) = task.objectives
    count, best = line(ax, "best").T
    values = search.evaluated[objective.key] / objective.unit[1]
    better = np.max if objective.sign < 0 else np.min
    for k, value in zip(count.astype(int), best, strict=True):
        feasible = search.evaluated.feasible[:k]
        assert value == pytest.approx(better(values[:k][feasible]))


def test_settings_of_matplotlib_stay_as_they_are(budget: Any) -> None:
    before = dict(matplotlib.rcParams)
    axs = Figure(layout="constrained").subplots(1, 2)
    assert budget.plot(ax=axs[0]) is axs[0]
    assert list(small_path(0.0).plot(axs, title="two panels")) == list(axs)
    assert axs[0].get_title(loc="left") == "two panels"
    assert dict(matplotlib.rcParams) == before


def test_each_class_names_the_function_that_draws_it() -> None:
    for module in pkgutil.walk_packages(cdsm.__path__, "cdsm."):
        importlib.import_module(module.name)
    todo, count = Plotted.__subclasses__(), 0
    for kind in todo:
        todo += kind.__subclasses__()
        if "_figure" in vars(kind):
            count += 1
            first, second, *_ = inspect.signature(getattr(plots, kind._figure)).parameters.values()
            assert first.annotation.split(".")[-1] == kind.__name__
            assert second.name in ("ax", "axs")
    assert count > 14
    assert not hasattr(cdsm.stiffness_gradient(cdsm.stiffness(*_balanced())), "plot")


def _balanced() -> tuple[cdsm.Posture, cdsm.Tension]:
    pose = short_arm().at(np.zeros(6))
    return pose, cdsm.distribute_tension(pose, 20.0)

"""The numbers that notebooks show: each notebook is run once, and then looked at."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import nbformat
import numpy as np
import pytest
import xarray as xr

import cdsm
from tests.support.notebooks import FOLDER, run

Shown = SimpleNamespace
"""Names of a notebook after its last cell."""


def start(nb: Shown) -> None:
    assert abs(nb.K.along([0, 0, 1]) / 1e3 - 57.47) < 5e-3
    assert abs(nb.ratio - 10.27) < 0.01
    level_off = np.array(nb.along)[nb.levels >= 400.0, 2]
    assert level_off.max() / level_off.min() < 1.01


def first_arm(nb: Shown) -> None:
    assert nb.text == cdsm.to_urdf(nb.geometry)  # the same geometry always gives the same bytes
    np.testing.assert_allclose(nb.pose.tip[:3, 3], [0.3026, 0.0503, -0.0983], atol=1e-4)
    assert abs(nb.tension.residual).max() < 1e-12
    assert len(nb.tension.at_minimum) == 6
    np.testing.assert_allclose(nb.tension.values.max(), 91.06, atol=0.01)
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(nb.pose, minimum=40.0, maximum=150.0, wrench=[0, 0, -25, 0, 0, 0])
    assert caught.value.joint == "joint3_1"
    K = nb.K
    assert K.is_stable
    np.testing.assert_allclose(K.joint, K.active + K.passive + K.gravity + K.load)
    np.testing.assert_allclose(nb.along / 1e3, [9.336, 1.691, 1.643], rtol=1e-3)
    assert np.all(nb.ratio[0] > 1)
    assert np.all(nb.ratio[1] > nb.ratio[0])
    assert np.isclose(nb.shares.total, K.along("z"), rtol=1e-12)
    assert nb.arm.cables[int(nb.shares.cables.argmax())].name == "cable6_1"
    assert nb.report.passed
    assert 170 < nb.minima[nb.best] < 190
    assert 210 < nb.edge < 225
    assert not nb.stable["strand (Eq. 19)"][0]
    assert np.all(np.diff(nb.constant) < 0)
    changes = nb.changes
    for reading in ("K_R", "hung weight"):
        assert max(changes["stretched (paper)", reading]) < 0.0 < min(changes["original", reading])
    weights = changes["original", "hung weight"]
    np.testing.assert_allclose(weights, [9.3e-3, 7.5e-3, 7.4e-3], atol=5e-5)
    np.testing.assert_allclose(nb.falls.original, [1.9, 6.5, 7.4], atol=0.1)
    np.testing.assert_allclose(nb.falls.along, [277.0, 92.0, 93.0], atol=1.0)


def cables_and_experiments(nb: Shown) -> None:
    assert nb.rms < 0.02
    assert nb.naive > 0.3
    fit = cdsm.fit_tensile_test(nb.displacement, nb.force, nb.test.gauge_length)
    stages = {stage.name: stage for stage in fit.stages}
    assert abs(stages["pre-tensioning"].high - 120.0) < 20.0  # the paper says 120 N
    assert nb.ends[1] / nb.ends[0] < 2.0
    assert np.all(np.diff(nb.y) > 0)  # the pre-tensioning stage
    for name, value in nb.actual.items():
        low, high = nb.found.confidence(0.999)[name]
        assert low < value < high
    np.testing.assert_allclose(nb.drops, (16.5, 40.6), atol=0.1)
    np.testing.assert_allclose(nb.rises, (8.65, 10.9), atol=0.05)
    assert abs(nb.accuracy[0] - 0.1103) < 1e-4


def weights_and_buckling(nb: Shown) -> None:
    K = nb.K
    assert abs(nb.small.stiffness / K.along("z") - 1) < 1e-4
    assert nb.paper > 1.5 * nb.small.stiffness  # it overestimates what a weight measures
    assert abs(nb.tangent / 1e3 - 0.1214) < 1e-4
    assert abs(nb.secants["down"] - 0.1949) < 1e-4
    assert abs(nb.secants["up"] - 0.1054) < 1e-4
    # a secant compliance is the mean of the tangents on the way
    tangents = [each.compliance[2, 2] for each in (nb.hung.unloaded, *nb.hung.states)]
    mean = (sum(tangents) - (tangents[0] + tangents[-1]) / 2.0) / len(nb.hung.states)
    assert abs(mean * nb.hung.stiffness - 1.0) < 1e-3
    assert nb.stiffens_from == {0.1: 9.25, 0.25: 22.75, 0.33: 29.75}
    # at the end ω² falls in proportion to what is left: four times as near, half as fast
    lowest = [nb.lowest_frequency((1 - part) * nb.critical.minimum) for part in (4e-3, 1e-3)]
    assert abs(lowest[0] / lowest[1] - 2.0) < 0.02


def stiffness_control(nb: Shown) -> None:
    assert all(nb.gains[1:] < nb.gains[:-1])  # every newton pays less than those before
    assert abs(nb.ends.low / 20.29e3 - 1) < 1e-3
    assert abs(nb.ends.high / 128.6e3 - 1) < 1e-3
    assert len(nb.sampled) > 100
    assert nb.ends.low < min(nb.sampled) < max(nb.sampled) < nb.ends.high
    saturated = nb.saturated
    along = saturated.along
    assert abs(saturated.bound - 200.4) < 0.1
    assert abs(saturated.stiffest - 550.6) < 0.1
    assert 0.99 < along[-1] / along.max() < 1.0
    assert saturated.limit == "elasticity"
    measured = nb.held_measured
    assert abs(nb.plan_measured / 90e3 - 1) < 1e-4
    with pytest.raises(cdsm.UnreachableStiffness) as caught:
        cdsm.plan_stiffness(nb.pose, "z", 150e3, minimum=20.0, maximum=800.0)
    assert abs(caught.value.high / nb.ends.high - 1) < 1e-9
    held, target = nb.held, nb.target
    assert held.complete
    assert held.steps.max() <= 4.0 * (1 + 1e-12)
    assert abs(held.achieved / target - 1).max() < 1e-9
    for k, value in measured.items():
        assert abs(value / target[k] - 1) < 1e-4
    # what is paid out, and its elongation, make the length
    for c, cable in enumerate(nb.arm.cables):
        elongation = cable.elongation(held.tensions[62, c], held.rest_lengths[62, c])
        assert abs(nb.stretch[62, c] - elongation) < 1e-15


def workspace_maps(nb: Shown) -> None:
    pose = nb.arm.at(nb.q[nb.row])
    single = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=50.0)).compliance
    assert abs(nb.batch["compliance"][nb.row] - single).max() < 1e-12 * abs(single).max()
    value = float(nb.straight.along.sel(minimum=50.0, direction="z"))
    assert abs(value / nb.expected - 1) < 1e-9
    assert np.allclose(nb.softest, [11.65, 33.48, 53.03], atol=5e-3)
    assert np.allclose(nb.buckled, [0.0192, 0.1620], atol=1e-3)
    assert np.allclose([nb.q10, nb.q50, nb.q90], [4.23, 9.09, 19.89], rtol=2e-3)
    holds, buckles, never = nb.holds, nb.buckles, nb.never
    assert all(np.diff(buckles / (holds + buckles)) > 0.0)
    # what the cables can balance by themselves they can at any bound: one posture needs the weight
    assert np.isclose(never[-1] - never[0], 2.0**-11)
    assert np.allclose(holds[[0, -1]], [0.513, 0.028], atol=1e-3)
    assert nb.pending == 3 * nb.left.status.size // 4
    xr.testing.assert_identical(nb.resumed, nb.space)
    xr.testing.assert_identical(nb.again, nb.space)
    assert nb.again.attrs["arm"] == nb.space.attrs["arm"]


def your_own_robot(nb: Shown) -> None:
    assert nb.K.is_stable
    assert abs(nb.K.along([1, 0, 0]) / 1e3 - 8.1317) < 1e-3
    assert nb.unbalanced < 1e-9  # MuJoCo's balance
    np.testing.assert_allclose(nb.track[-1], nb.test.displacement, atol=1e-7)


def weights_with_friction(nb: Shown) -> None:
    assert abs(nb.stuck / 1e3 - 257.6) < 0.1
    assert abs(nb.frictionless / 1e3 - 36.2) < 0.1
    for friction, secant in nb.secants.items():
        assert np.all(np.diff(secant) < 1e-4 * nb.stuck)  # it falls with the weight
        assert abs(secant[0] / nb.stuck - 1.0) < 1e-2
        assert 1.0 < secant[-1] / nb.frictionless < 1.0 + friction + 0.1
    assert abs(1e3 * nb.lost - 0.535) < 2e-3
    assert abs(1e6 * nb.left - 29.2) < 0.2
    assert abs(nb.test.breakaway.load - 0.7063) < 1e-3
    assert abs(nb.test.stiffness / 1e3 - 51.75) < 0.05
    assert nb.band.low < min(nb.rests) < 0.7 * nb.band.low
    assert 0.7 * nb.band.high < max(nb.rests) < nb.band.high
    first = np.array(list(nb.first.values()))
    np.testing.assert_allclose(first[:, 0], nb.stuck, rtol=1e-3)
    assert np.all(np.diff(first[:, 1]) < 0.0)
    assert abs(nb.ratio - 1.0) < 1e-9
    small, rough, tense = (
        nb.breakaway(mu, F) for mu, F in ((0.05, 50.0), (0.1, 50.0), (0.05, 100.0))
    )
    np.testing.assert_allclose([rough / small, tense / small], 2.0, rtol=0.01)
    assert 1.05 < nb.plateau.min() < nb.plateau.max() < 1.15
    tangents = np.array([tangent for _, tangent in nb.tangents.values()])
    np.testing.assert_allclose(tangents[0], tangents[1], rtol=0.05)
    np.testing.assert_allclose(tangents[2], tangents[1], rtol=0.05)


def is_it_true(nb: Shown) -> None:
    known = [row for row in nb.table if not np.isnan(row.uncertainty)]
    assert all(abs(row.difference) <= row.uncertainty for row in known)
    at_stated = [row.difference / row.theirs for row in nb.table if "200 GPa" in row.source]
    np.testing.assert_allclose(at_stated, -0.8, atol=0.06)  # five times too small
    assert abs(nb.modes.frequencies[0] - 2.166) < 5e-4
    assert abs(nb.share - 81.0) < 0.5
    assert 0.0 < nb.snake < 1.0
    np.testing.assert_allclose(nb.rates[1:, :2], 2.0, atol=0.02)
    relative = {axis: 100.0 * budget.relative for axis, budget in nb.budgets.items()}
    assert 4.5 < relative["y"] < 5.6
    assert 4.5 < relative["z"] < 5.6
    assert 8.0 < relative["x"] < 10.5
    x, y = nb.budgets["x"], nb.budgets["y"]
    assert next(iter(y.contributions)) == "rigidity"
    assert next(iter(x.contributions)) == "joint_angle"
    assert 0.07 < x.contributions["joint_angle"] / x.value < 0.09
    assert not x.is_linear


def closed_loop(nb: Shown) -> None:
    assert nb.plan.complete
    assert all(run.outcome == "completed" for run in nb.runs.values())
    worst = {law: abs(off).max() / 100.0 for law, off in nb.off.items()}
    assert worst["stiffness"] < 0.05
    assert abs(worst["feedforward"] - 0.79) < 0.02
    assert abs(worst["tension"] - 0.10) < 0.03
    assert worst["mixed"] > 0.3
    for tried in nb.runs.values():
        assert tried.inside.all()
        assert (tried.commanded_tension >= 10.0).all()
        assert (tried.commanded_tension <= 250.0).all()
    assert len(nb.stiff.inside) == len(nb.stiff.time)
    assert abs(nb.stiff.rigidity[-1] - 0.9) < 1e-3
    assert abs(nb.force[2] + 0.2 * 9.81) < 0.2
    assert nb.stiff.tip_error.max() < 1e-3 < nb.runs["tension"].tip_error.max()
    for tip, stiffness in nb.worst.values():
        assert tip < 1.0
        assert stiffness < 4.0


def design_of_an_arm(nb: Shown) -> None:
    assert nb.held.limit == "deflection"
    np.testing.assert_allclose(nb.held.force, 1.403, atol=2e-3)  # 500 g is 4.9 N
    np.testing.assert_allclose(nb.held.limits["tension"], 71.8, atol=0.1)
    np.testing.assert_allclose(nb.polytope.radius, 44.93, atol=0.01)
    best = nb.found.values(0)
    np.testing.assert_allclose(best["motor_force"], 122.6, atol=1.0)
    assert best["deflection"] <= 1e-3
    assert abs(max(nb.sag) / best["deflection"] - 1.0) < 0.05  # what first order leaves out
    assert best["disk_clearance"] >= 0.5e-3
    assert len(nb.found.front) > 20
    assert 0.75e-3 < max(nb.sag) < 1e-3  # the real weight, with all nonlinearity
    assert nb.missed.constraints == ("deflection",)


CHECKS: dict[str, Callable[[Shown], None]] = {
    "00_start_here": start,
    "01_from_geometry_to_stiffness": first_arm,
    "02_cables_tensile_tests_and_experiments": cables_and_experiments,
    "03_hanging_weights_and_buckling": weights_and_buckling,
    "04_stiffness_control": stiffness_control,
    "05_workspace_stiffness_maps": workspace_maps,
    "06_your_own_robot": your_own_robot,
    "07_why_does_my_weight_test_depend_on_the_weight": weights_with_friction,
    "08_hold_4_newtons_per_millimetre": closed_loop,
    "10_is_it_true": is_it_true,
    "09_design_an_arm": design_of_an_arm,
}


def check(name: str, names: dict[str, Any]) -> None:
    """Check the numbers of an executed notebook; its last cell calls this."""
    CHECKS[name](SimpleNamespace(**names))


@pytest.mark.notebooks
@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.ipynb")))
def test_notebook_shows_the_numbers_that_its_text_tells(name: str) -> None:
    shown = nbformat.read(run(name), as_version=4)
    assert not any("assert" in cell.source for cell in shown.cells)  # numbers are pinned here

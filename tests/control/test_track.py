"""The closed loop: what it holds, what it survives, and what it says when it fails."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Status, control, presets
from cdsm.cli.options import read_path
from cdsm.planning.path_plan import PathPlan
from tests.support.arms import readme_geometry
from tests.support.tracking import circle, small_path

BOUNDS: Any = {"minimum": 10.0, "maximum": 250.0}


def test_feedforward_on_the_arm_it_believes_in_follows_to_rounding() -> None:
    plan = small_path()
    run = cdsm.track(plan, "feedforward", sensors=cdsm.Sensors(encoder=0.0), **BOUNDS)
    assert run.outcome is Status.OK
    assert not run.warnings
    assert not run.target_unreachable.any()
    at_samples = run.tip_error[::5]
    assert at_samples.max() < 1e-11
    assert run.tip_error.max() < 1e-5  # in between, wires and angles move evenly
    assert abs(run.stiffness_error[::5]).max() < 1e-6
    np.testing.assert_allclose(run.tension[::5], plan.tensions, rtol=1e-8)


def steep_path() -> PathPlan:
    """Four joints that bend by 5 degrees from sample to sample, 1.7 mm of cable, 34 N at rest."""
    geometry = readme_geometry(disk_offset=0.005, hole_radius=0.02, link_mass=0.05, lead=0.1)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    angles = np.deg2rad([[bend, 0.0, bend] + 5 * [0.0] for bend in (0.0, 5.0, 10.0)])
    return cdsm.plan_path(arm, "z", [3e3, 3e3, 4e3], 10.0, 200.0, angles=angles)


@pytest.mark.parametrize("law", ["feedforward", "tension", "mixed", "stiffness"])
@pytest.mark.parametrize("steps", [1, 5])
def test_every_law_holds_the_plan_of_the_arm_it_believes_in(law: str, steps: int) -> None:
    """However coarse the steps are, none is clamped: all tensions are far from their bounds."""
    given: Any = {"sensors": cdsm.Sensors(encoder=0.0), "minimum": 10.0, "maximum": 200.0}
    if law == "stiffness" and steps == 1:
        run = cdsm.track(steep_path(), law, steps=1, **given)
        assert abs(run.stiffness_error[-1]) > 0.01
        assert (run.steps_needed, run.change_limited.sum()) == (2, 1)
        assert "TOO FEW STEPS at 1 of 3 steps" in str(run)
        assert "steps=2 would do" in str(run)
        steps = run.steps_needed
    run = cdsm.track(steep_path(), law, steps=steps, **given)
    assert run.outcome is Status.OK
    assert not run.warnings
    assert not run.saturated.any()
    assert abs(run.stiffness_error).max() < 0.01
    assert abs(run.stiffness_error[::steps]).max() < 1e-6
    assert run.tip_error.max() < 1e-7


def test_same_seed_same_bits() -> None:
    one, again, other = (
        cdsm.track(
            small_path(), sensors=cdsm.Sensors(tension_noise=0.5, seed=seed), steps=2, **BOUNDS
        ).measured_tension
        for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(one, again)
    assert (one != other).any()


def test_stiffness_loop_calibrates_its_wire_and_holds_the_stiffness() -> None:
    """A wire a tenth softer than believed; feed-forward loses most of the stiffness."""
    plan, noisy = small_path(), cdsm.Sensors(tension_noise=0.5)
    plant = cdsm.QuasiStaticPlant(control.with_rigidity(plan.arm, 0.9))
    held, lost = (
        cdsm.track(plan, law, plant, noisy, steps=8, **BOUNDS)
        for law in ("stiffness", "feedforward")
    )
    assert held.rigidity[-1] == pytest.approx(0.9, abs=5e-3)
    assert abs(held.stiffness_error[5:]).max() < 0.02
    assert abs(lost.stiffness_error).min() > 0.3
    assert held.tip_error[5:].max() < 0.6 * lost.tip_error.min()


def test_payload_that_nobody_told_of_is_felt() -> None:
    run = cdsm.track(small_path(), payload=0.2, steps=10, **BOUNDS)
    loaded = run.wrench[:, 2] != 0.0
    assert loaded.sum() == 11
    assert run.wrench[-1, 2] == pytest.approx(-0.2 * 9.81)
    np.testing.assert_allclose(run.estimated_force[-1, 1:], [0.0, -0.2 * 9.81], atol=0.05)
    # along the arm, x, a force is hardly felt in the cables; counts of 10 µm are some 0.05 N
    assert abs(run.estimated_force[~loaded, 1:]).max() < 0.1
    assert abs(run.stiffness_error[5:]).max() < 0.02


def test_force_under_friction_is_felt_within_its_band() -> None:
    """A followed history errs hole by hole: the force is nearer than its band by far."""
    run = cdsm.track(circle(0.1, 4), "mixed", payload=0.2, steps=4, **BOUNDS)
    before = np.vstack([np.zeros(6), run.wrench[:-1]])
    off = abs(run.estimated_force - before[:, :3])
    assert (off <= run.estimated_force_band).all()
    root = np.sqrt((off**2).mean(axis=0))
    assert (root < 0.1 * run.estimated_force_band.mean(axis=0)).all()
    assert "by friction" in str(run)


def test_wrong_arguments_are_refused() -> None:
    plan = small_path()
    broken = cdsm.plan_path(plan.arm, "z", [15e3, 90e3], 10.0, 250.0, angles=plan.angles[:2])
    calls: tuple[tuple[Any, Any, dict[str, float], str], ...] = (
        (plan, lambda at: at.paid_out, BOUNDS, "law: returned array.* return limited"),
        (plan, lambda at: control.limited(at, at.paid_out[:2]), BOUNDS, "wire of the law"),
        (
            *(plan, lambda at: control.Command(at.paid_out, at.maximum + 1.0, at.paid_out > 0.0)),
            *(BOUNDS, "law: commanded 251 N .* from 10 to 250 N .* Return limited"),
        ),
        (plan, "stiffness", {"payload": -1.0}, "payload"),
        (broken, "stiffness", {}, r"1 of 2 samples are not planned.*sample 1"),
    )
    for given, law, options, said in calls:
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.track(given, law, **options)


def test_time_of_a_plant_and_its_class_are_not_mistaken() -> None:
    plan: Any = small_path()
    for bad, said in (
        ({"plant": cdsm.QuasiStaticPlant}, "a plant is needed"),
        ({"law": 3}, "law"),
        ({"plant": cdsm.MuJoCoPlant(plan.arm, period=0.1)}, "a step of the plant takes 0.1 s"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.track(plan, **{"law": "mixed", **bad}, **BOUNDS)


def test_unstable_loop_is_an_answer_with_its_time() -> None:
    """All motors hold tensions that are read late: nothing holds the posture, and it is lost."""
    plan = circle(0.0)
    arm = cdsm.Manipulator(plan.arm.geometry, presets.STRAND_1X19.slack_below())
    late, plant = cdsm.Sensors(delay=4), cdsm.QuasiStaticPlant(arm)
    run = cdsm.track(plan, "tension", plant, late, steps=12, payload=0.3, **BOUNDS)
    assert run.outcome is Status.DIVERGED
    assert run.tip_error[-1] > 0.1 * plan.arm.length > run.tip_error[-2]
    assert run.time[-1] == pytest.approx(0.05 * (len(run.time) - 1))
    assert "DIVERGED" in str(run).splitlines()[0]
    assert np.isfinite(run.tips).all()


def test_target_that_no_tension_gives_is_named_and_the_last_tensions_are_kept() -> None:
    geometry = readme_geometry(joints=1, hole_radius=0.02, link_mass=0.05, lead=0.1)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    angles = np.deg2rad([[6.0, -4.0], [7.0, -3.0]])
    plan = cdsm.plan_path(arm, "z", 40e3, 10.0, 250.0, angles=angles)
    run = cdsm.track(plan, minimum=10.0, maximum=60.0, steps=1, max_change_per_step=20.0)
    assert (run.commanded_tension <= 60.0).all()
    assert run.saturated.any()
    assert abs(run.stiffness_error).max() > 0.05
    assert run.target_unreachable[-1]  # plan_stiffness finds none either
    with pytest.raises(cdsm.UnreachableStiffness):
        cdsm.plan_stiffness(arm.at(angles[-1]), plan.direction, plan.target[-1], 10.0, 60.0)
    assert "OUT OF REACH" in run.warnings[0]
    heavy = cdsm.track(small_path(), payload=4.0, steps=2, minimum=10.0, maximum=150.0)
    assert heavy.replan_failed
    assert any(text.startswith("NOT PLANNED at ") for text in heavy.warnings)


def test_dataset_has_units_and_is_written_whole(tmp_path: Path) -> None:
    import xarray as xr

    run = cdsm.track(small_path(0.1), steps=2, **BOUNDS)
    data = run.to_xarray()
    assert all(data[name].attrs["units"] for name in data.data_vars)
    assert data["time"].attrs["units"] == "s"
    path = run.write(tmp_path / "run.nc")
    with xr.open_dataset(path) as again:
        np.testing.assert_array_equal(again["tips"], run.tips)
        assert again.attrs["outcome"] == "ok"
    assert run.inside.all()
    path_again = read_path(run.write(tmp_path / "run.csv"), run.plan.arm)
    assert path_again.angles is not None
    np.testing.assert_allclose(path_again.angles, run.angles, rtol=1e-15)


def test_stiffness_loop_holds_four_newtons_per_millimetre_within_five_percent() -> None:
    """10 % wrong EA, μ = 0.1, 0.5 N of noise, and 200 g hung on it half-way.

    Feed-forward alone has a fifth of the wanted stiffness, tension control up to 13 % less.
    """
    plan = circle(0.1, 7)
    plant = cdsm.QuasiStaticPlant(control.with_rigidity(plan.arm, 0.9))
    sensors = cdsm.Sensors(encoder=1e-5, tension_noise=0.5)
    worst = {}
    for law in ("feedforward", "tension", "stiffness"):
        run = cdsm.track(plan, law, plant, sensors, payload=0.2, steps=3, **BOUNDS)
        worst[law] = abs(run.stiffness_error[1:]).max()  # the first step does not know the wire
        assert run.outcome is Status.OK
        assert (run.commanded_tension >= 10.0).all()
        assert (run.commanded_tension <= 250.0).all()
        assert run.inside.all()
        assert len(run.inside) == len(run.time)
    assert run.tip_error.max() < 1e-3
    assert worst["stiffness"] < 0.05
    assert worst["feedforward"] > 0.7
    assert worst["tension"] > 0.1


def test_references_balance_the_arm_where_its_wire_is_near_the_end_of_its_law() -> None:
    """Clipped into the law of Eq. 19, which begins at 2.2 N, they missed 0.066 N m."""
    arm = small_path().arm
    ends = np.array([[0.299, -0.022, 0.33, 0.213], [0.332, -0.298, -0.341, -0.344]])
    softest = [cdsm.stiffness_range(arm.at(q), "z", 2.2, 250.0, starts=2).low for q in ends]
    plan = cdsm.plan_path(arm, "z", 1.001 * np.array(softest), 2.2, 250.0, angles=ends)
    run = cdsm.track(plan, "feedforward", steps=5, minimum=2.2, maximum=250.0)
    assert run.reference_balanced.all()
    assert not any("OUT OF BALANCE" in warning for warning in run.warnings)
    for part, F in zip(np.linspace(0.0, 1.0, 6), run.reference_tension, strict=False):
        pose = arm.at(ends[0] + part * (ends[1] - ends[0]))
        assert abs(F @ pose.length_jacobian + pose.gravity_torque).max() < 1e-12
        assert F.min() >= arm.cables[0].elasticity.low
    astray = replace(run, reference_balanced=np.zeros_like(run.reference_balanced))
    assert any("OUT OF BALANCE" in warning for warning in astray.warnings)

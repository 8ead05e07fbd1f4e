"""The switch "let it sag": the equilibrium under the force, or that there is none."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm.view import Condition, Shown, show
from cdsm.view.panel import page_text, tensions_text
from tests.view.test_view import STABLE, UNSTABLE, numbers, setting, soft_arm

FORCE = (0.2, -0.3, -0.5)


def sagged(
    arm: cdsm.Manipulator, minimum: float = STABLE, force: tuple[float, float, float] = FORCE
) -> Shown:
    return show(arm, replace(setting(arm, minimum, force), sag=True))


def test_what_is_shown_is_the_equilibrium_of_the_arm_tensioned_without_the_force() -> None:
    arm = soft_arm()
    shown = sagged(arm)
    pose = arm.at(setting(arm).q)
    tension = cdsm.distribute_tension(pose, STABLE, 200.0)
    rest = cdsm.equilibrium(pose, tension, (*FORCE, 0.0, 0.0, 0.0))
    assert shown.condition is Condition.STABLE
    assert shown.posture is not None
    np.testing.assert_array_equal(shown.posture.q, rest.pose.q)
    assert shown.reference is not None
    np.testing.assert_array_equal(shown.reference.q, pose.q)
    said = numbers(page_text(shown, 0.01))
    assert said["sagged"] == ", ".join(f"{1e3 * x:z.1f}" for x in rest.displacement)
    assert said["tip"] == ", ".join(f"{1e3 * x:z.1f}" for x in rest.pose.tip[:3, 3])
    for axis, u in zip("xyz", np.eye(3), strict=True):
        assert said[f"along-{axis}"] == f"{rest.stiffness.along(u) / 1e3:.4g}"
    listed = numbers(tensions_text(shown))
    assert [listed[f"tension-{c}"] for c in range(9)] == [f"{F:.4g}" for F in rest.tension]
    # it moves, and by more than a stiff arm would: the direction of a wrong sign fails here
    assert float(rest.displacement @ FORCE) > 0.0
    assert 1e3 * np.linalg.norm(rest.displacement) > 0.5


def test_the_numbers_are_those_of_the_weight_test() -> None:
    arm = soft_arm()
    shown = sagged(arm)
    pose = arm.at(setting(arm).q)
    test = cdsm.weight_test(pose, cdsm.distribute_tension(pose, STABLE, 200.0), FORCE)
    assert shown.rest is not None
    # both stop where the imbalance is rounding; the softest mode makes 1e-12 m of it at most
    np.testing.assert_allclose(shown.rest.displacement, test.displacements[-1], atol=1e-9)


def test_an_unstable_reference_is_left_and_that_is_said() -> None:
    arm = soft_arm()
    held = show(arm, setting(arm, UNSTABLE))
    assert held.condition is Condition.UNSTABLE
    shown = sagged(arm, UNSTABLE, (0.0, 0.0, 0.0))
    assert shown.condition is Condition.LEFT_REFERENCE
    assert shown.rest is not None
    assert np.linalg.norm(shown.rest.displacement) > 1e-3
    said = numbers(page_text(shown, 0.01))
    assert said["condition"] == "LEFT ITS REFERENCE"
    assert "left this posture" in said["problem"]
    assert float(said["along-z"]) > 0.0  # of the place where it rests
    assert shown.rest.stiffness.is_stable


def test_without_an_equilibrium_there_is_no_number() -> None:
    arm = soft_arm()
    stiff = cdsm.presets.STRAND_1X19
    strand = cdsm.Manipulator(arm.geometry, elasticity=stiff)
    shown = sagged(strand, 3.0, (0.0, 0.0, -20.0))  # a cable would get slack: no law says how
    assert shown.condition is Condition.OUTSIDE_ELASTICITY
    assert shown.rest is None
    assert shown.tensions is None
    assert set(numbers(page_text(shown, 0.01))) == {"condition", "problem", "tip", "arrow"}
    assert numbers(tensions_text(shown)) == {}
    assert shown.cable_colors is not None
    assert len(np.unique(shown.cable_colors)) == 1  # grey


def test_a_search_that_fails_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise cdsm.EquilibriumError("no place to rest", np.zeros(6), 0.5, "joint1_1")

    monkeypatch.setattr("cdsm.view.state.equilibrium", fails)
    shown = sagged(soft_arm())
    assert shown.condition is Condition.NO_EQUILIBRIUM
    assert "no place to rest" in shown.problem
    assert shown.stiffness is None
    assert shown.along is None
    assert shown.tensions is None


def test_joints_on_their_stops_are_named_and_do_not_yield() -> None:
    arm = soft_arm()
    shown = sagged(arm, 5.0, (0.0, 0.0, -12.0))
    assert shown.rest is not None
    assert shown.rest.at_limit
    said = numbers(page_text(shown, 0.01))
    assert said["stops"] == f"rests on its stop: {', '.join(shown.rest.at_limit)}"
    C = shown.rest.compliance[:3, :3]
    assert shown.along is not None
    np.testing.assert_allclose(shown.along, 1.0 / np.diag(C), rtol=1e-12)
    assert (shown.along > [shown.rest.stiffness.along(u) for u in np.eye(3)]).any()


def test_an_arm_with_friction_sags_less_and_shows_which_holes_slide() -> None:
    arm = soft_arm().with_friction(0.1)
    free, shown = sagged(soft_arm()), sagged(arm)
    pose = arm.at(setting(arm).q)
    pull = cdsm.distribute_tension(pose, STABLE, 200.0)
    wrench = np.array([[*FORCE, 0.0, 0.0, 0.0]])
    history = cdsm.load_cycle(pose, pull, wrench)
    assert shown.condition is Condition.STABLE
    assert shown.rest is not None
    assert free.rest is not None
    np.testing.assert_allclose(shown.rest.displacement, history.displacement[0], atol=1e-9)
    moved = [float(each.displacement @ FORCE) for each in (shown.rest, free.rest)]
    assert 0.0 < moved[0] < moved[1]
    sticking, sliding = shown.holes
    slides = np.flatnonzero(history.sliding[0])
    assert 0 < slides.size == len(sliding)
    assert len(sticking) + len(sliding) == len(history.holes)
    name, _, site = history.holes[slides[0]].partition(" site ")
    at_rest = history.pose(0)
    path = at_rest.cable_paths[arm.cables.names.index(name)]
    np.testing.assert_allclose(sliding[0].mean(axis=0), path[int(site) - 1], atol=1e-9)
    said = numbers(page_text(shown, 0.01))
    assert said["sticking"] == f"{len(sticking)} holes stick,"
    assert said["model"] == "cables sliding, μ = 0.1, rigid links, tangent"
    K = history.stiffness(0)
    assert said["along-z"] == f"{K.along('z') / 1e3:.4g}"
    # a held arm has no history: nothing slides, and its stiffness is the frictionless one
    held = show(arm, setting(arm, force=FORCE))
    assert [len(each) for each in held.holes] == [len(history.holes), 0]
    assert numbers(page_text(held, 0.01))["model"].startswith("frictionless")
    assert [len(each) for each in free.holes] == [0, 0]
    assert "sliding" not in numbers(page_text(free, 0.01))


def test_below_breakaway_no_hole_slides() -> None:
    arm = soft_arm().with_friction(0.3)
    pose = arm.at(setting(arm).q)
    pull = cdsm.distribute_tension(pose, STABLE, 200.0)
    load = cdsm.breakaway(pose, pull, "z").load
    assert len(sagged(arm, force=(0.0, 0.0, 0.99 * load)).holes[1]) == 0
    assert len(sagged(arm, force=(0.0, 0.0, 1.01 * load)).holes[1]) == 1

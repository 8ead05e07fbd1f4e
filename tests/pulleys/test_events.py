"""A cable that leaves or touches a pulley while a load grows is an event, at its exact load."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Site
from cdsm.statics.load_cycle import LoadHistory
from tests.support.pulleys import Link, arm_of

R = 0.006
LIFT_OFF = np.deg2rad(-11.5367225)  # where the tangents from both sites are one line
WHERE = "cable1 on the pulley on base (entry 2 of its path)"


def hinge(beside: float = 0.0, rest: float = 0.0, groove: bool = True) -> cdsm.Manipulator:
    """A hinge with a spring and one cable over a pulley at its axis."""
    path = [
        Site("base", (-0.03, -0.002, beside)),
        Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), R, groove),
        Site("phalanx", (0.03, -0.004, beside)),
    ]
    arm = arm_of([Link("phalanx", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))], path)
    return arm.with_springs({"to_phalanx": (0.5, rest)})


def loaded(arm: cdsm.Manipulator, force: float, tension: float = 3.0) -> Any:
    load = cdsm.Load("phalanx", force=(0.0, force, 0.0), point=(0.05, 0.0, 0.0))
    return cdsm.forward_statics(arm, tension=[tension], wrench=[load])


def groove_left(arm: cdsm.Manipulator) -> float:
    """The least angle at which the cable is still in its groove, by bisection."""
    low, high = -0.3, 0.0
    for _ in range(60):
        middle = (low + high) / 2.0
        touches = arm.at([middle]).wraps.touches[0]
        low, high = (low, middle) if touches else (middle, high)
    return high


@pytest.mark.parametrize("groove", [True, False])
def test_a_cable_lifts_off_at_the_load_that_turns_the_joint_so_far(groove: bool) -> None:
    rest = loaded(hinge(groove=groove), -5.0)
    (event,) = rest.events
    assert (event.kind, event.place) == ("lift-off", WHERE)
    assert not rest.pose.wraps.touches[0]
    assert str(event).startswith(f"{WHERE} lifts off at 1.914 N")
    # by hand: the moments of force, cable and spring at the angle of the lift-off
    share = event.share
    assert event.load == pytest.approx(5.0 * share)
    lever = 0.05 * np.cos(LIFT_OFF)
    assert event.load * lever == pytest.approx(-0.5 * LIFT_OFF - 3.0 * share * R, rel=1e-6)
    there = loaded(hinge(groove=groove), -event.load, 3.0 * share)
    assert there.pose.q[0] == pytest.approx(LIFT_OFF, abs=1e-8)


def test_a_cable_touches_again() -> None:
    rest = loaded(hinge(rest=-0.5), 5.0)
    (event,) = rest.events
    assert (event.kind, event.place) == ("contact", WHERE)
    assert rest.pose.wraps.touches[0]
    there = loaded(hinge(rest=-0.5), event.load, 3.0 * event.share)
    assert there.pose.q[0] == pytest.approx(LIFT_OFF, abs=1e-8)
    assert "touches at" in str(event)


def test_a_cable_beside_its_groove_snaps_out_of_it() -> None:
    rest = loaded(hinge(beside=0.002), -5.0)
    (event,) = rest.events
    assert (event.kind, event.place) == ("groove", WHERE)
    assert "leaves the groove beside its plane, where its length has a step, at" in str(event)
    q = groove_left(hinge(beside=0.002))
    lever = hinge(beside=0.002).at([q]).length_jacobian[0, 0]
    by_hand = -0.5 * q / (3.0 * lever + 0.25 * np.cos(q))
    assert event.share == pytest.approx(by_hand, rel=1e-8)
    before, after = (
        loaded(hinge(beside=0.002), -event.load * f, 3.0 * event.share * f).pose
        for f in (0.999, 1.001)  # the moment arm has a step, too
    )
    assert before.wraps.touches[0]
    assert not after.wraps.touches[0]
    shorter = float(before.cable_lengths[0] - after.cable_lengths[0])
    assert shorter > 20.0 * R * abs(float(after.q[0] - before.q[0]))  # a step, and no motion
    smooth = loaded(hinge(beside=0.002, groove=False), -5.0)
    assert [event.kind for event in smooth.events] == ["lift-off"]


def test_weights_and_pictures_show_it() -> None:
    arm = hinge(rest=0.1)
    pose = arm.at([0.1])
    test = cdsm.weight_test(
        pose, [3.0], force=[0.0, -8.0, 0.0], wrench=None, link="phalanx", point=(0.05, 0.0, 0.0)
    )
    kinds = [event.kind for event in test.events]
    assert "slack" in kinds or "lift-off" in kinds
    assert test.to_dict()["events"][0]["place"]  # type: ignore[index]
    ax = test.plot()
    assert any("cable1" in text.get_text() for text in ax.texts)


def test_arms_without_pulleys_watch_for_nothing_of_it() -> None:
    from cdsm.statics.contact_events import contact_angles, contact_names

    arm = cdsm.presets.virtual_prototype()
    assert contact_names(arm) == []
    assert contact_angles(arm.at(np.zeros(10))).size == 0


def cycled(mu: float, beside: float = 0.0) -> LoadHistory:
    """A weight of 6 N that is hung on the hinge and taken off; its motor holds 3 N."""
    arm = hinge(beside)
    (cable,) = arm.cables
    path = [replace(e, friction=mu) if isinstance(e, Pulley) else e for e in cable.sites]
    arm = arm.with_cables([replace(cable, sites=tuple(path), control="force")])
    steps = 6.0 * np.linspace(0.0, 1.0, 4)
    forces = [*steps, *steps[-2::-1]]
    loads = [[cdsm.Load("phalanx", force=(0, -f, 0), point=(0.05, 0, 0))] for f in forces]
    return cdsm.load_cycle(arm.at([0.0]), [3.0], loads)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
def test_contacts_in_a_load_cycle_are_where_the_moments_by_hand_are_even(mu: float) -> None:
    """At the lift-off the wrap is 0, so friction does not change its load."""
    history = cycled(mu)
    found = [event for event in history.events if event.kind != "slip"]
    assert [event.kind for event in found] == ["lift-off", "contact"]
    load = (-0.5 * LIFT_OFF - 3.0 * R) / (0.05 * np.cos(LIFT_OFF))
    for event in found:
        assert event.place == WHERE
        assert event.load == pytest.approx(load, rel=1e-8)
        q = history.event_angles[history.events.index(event)]
        assert q[0] == pytest.approx(LIFT_OFF, abs=1e-8)
        assert abs(history.arm.at(q).wraps.angle[0]) <= 1e-8


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_a_groove_is_left_in_a_load_cycle_where_the_wrap_ends(mu: float) -> None:
    history = cycled(mu, beside=0.003)
    arm = history.arm
    q = groove_left(arm)
    lever = arm.at([q]).length_jacobian[0, 0]
    left = next(event for event in history.events if event.kind == "groove")
    load = -(0.5 * q + 3.0 * lever) / (0.05 * np.cos(q))
    assert left.load == pytest.approx(load, rel=1e-8)
    at = history.event_angles[history.events.index(left)]
    assert at[0] == pytest.approx(q, abs=1e-8)
    assert [event.kind for event in history.events].count("contact") == 1


def test_all_that_shows_a_load_cycle_says_where_the_cable_lifts_off(tmp_path: Path) -> None:
    history = cycled(0.1)
    (lifted,) = (event for event in history.events if event.kind == "lift-off")
    assert f"{WHERE} lifts off at 1.688 N in the step to load 1" in str(history)
    told = history.to_dict()["events"]
    assert {"kind": "lift-off", "place": WHERE, "load_N": lifted.load}.items() <= told[1].items()  # type: ignore[index]
    rows = history.write_loop(tmp_path / "loop.csv").read_text().splitlines()
    assert rows[0].endswith(",events")
    assert "cable1 lifts off (pulley on base) at 1.688 N" in rows[2]
    assert "lifts off" not in rows[3]
    panel = history.plot()
    assert any("cable1 lifts off (pulley on base) at 1.69 N" in t.get_text() for t in panel.texts)
    (mark,) = (line for line in panel.lines if "lifts off" in str(line.get_gid()))
    np.testing.assert_allclose(np.ravel(mark.get_ydata()), lifted.load, rtol=1e-9)

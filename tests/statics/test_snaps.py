"""Where an arm snaps in a load cycle, and why, against a column of one joint by hand."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import cdsm
from cdsm import Site
from cdsm.statics.events import Event
from cdsm.statics.load_cycle import LoadHistory
from tests.support.pulleys import Link, arm_of

SPRING = 0.5  # N m/rad
LEVER = 0.05  # m
DOWN = 11.0  # N, more than SPRING/LEVER: the column stands to one side
PULL = 5.0  # N that the motors hold
EA = 5000.0  # N


def column(mu: float, wrap: float = 0.0) -> cdsm.Manipulator:
    """A bar on a hinge with a spring; a cable at each side passes a hole of the base."""
    paths = [
        [
            Site("base", (-0.03, y, 0.0)),
            Site("base", (-0.005, y, 0.0), friction=mu, wrap=wrap),
            Site("bar", (0.02, y, 0.0)),
        ]
        for y in (0.01, -0.01)
    ]
    bar = Link("bar", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    law = cdsm.LinearElasticity(EA)
    arm = arm_of([bar], *paths, control="force", limit=1.4, elasticity=law)
    return arm.with_springs({"to_bar": SPRING})


def pushed(arm: cdsm.Manipulator, *sideways: float) -> LoadHistory:
    """The column under its load, then pushed sideways."""
    loads = [[cdsm.Load("bar", force=(-DOWN, f, 0), point=(LEVER, 0, 0))] for f in sideways]
    return cdsm.load_cycle(arm.at([0.0]), [PULL, PULL], loads, substeps=8)


def snap(history: LoadHistory) -> tuple[Event, float]:
    """The only snap of a history, and the angle at which it happens."""
    (event,) = (event for event in history.events if event.kind == "buckling")
    return event, float(history.event_angles[history.events.index(event)][0])


def push_at(arm: cdsm.Manipulator, q: float, signs: tuple[int, int]) -> float:
    """Sideways force [N] of the balance at an angle, with cables that slide in their holes.

    The tension behind the hole is e^(sign μ φ) times that of the motor.
    """
    pose = arm.at([q])
    grip = pose.segments.grip
    T = PULL * np.exp(np.array(signs) * grip)
    torque = SPRING * q + float(T @ pose.length_jacobian[:, 0]) - LEVER * DOWN * np.sin(q)
    return torque / (LEVER * np.cos(q))


@pytest.mark.parametrize("mu", [0.0, 0.05, 0.3, 0.6])
def test_a_limit_point_is_where_the_balance_by_hand_bears_no_more(mu: float) -> None:
    arm = column(mu)
    history = pushed(arm, 1.0, 0.0, -2.0)
    assert history.snaps.tolist() == [False, False, True]
    event, q = snap(history)
    assert event.cause == "limit point"
    assert "to_bar most at a limit point at 11." in str(event)
    assert event.to_dict()["cause"] == "limit point"
    # on the way back cable 1 gets longer, cable 2 shorter
    hand = minimize_scalar(
        lambda q: push_at(arm, q, (1, -1)), bounds=(0.3, 1.0), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    assert -2.0 * event.share == pytest.approx(hand.fun, rel=1e-8)
    assert q == pytest.approx(hand.x, abs=1e-6)
    # the eigenvalue of K is 0: the slope of the force along the path
    h = 1e-4
    slope = (push_at(arm, q + h, (1, -1)) - push_at(arm, q - h, (1, -1))) / (2.0 * h)
    third = push_at(arm, q + 2 * h, (1, -1)) - push_at(arm, q - 2 * h, (1, -1))
    slope = (4.0 * slope - third / (4.0 * h)) / 3.0
    stuck = float(cdsm.stuck_stiffness(arm.at([q]), [PULL, PULL]).joint[0, 0])
    assert abs(slope * LEVER * np.cos(q)) <= 1e-8 * stuck


@pytest.mark.parametrize("mu", [0.05, 0.2, 0.4])
def test_an_arm_snaps_as_a_cable_begins_to_slide(mu: float) -> None:
    """Both cables stick at first. The second one that slides takes the last stiffness."""
    arm = column(mu, wrap=0.5)
    history = pushed(arm, 0.0, 2.0)
    assert history.snaps.tolist() == [False, True]
    event, q = snap(history)
    cable = arm.cables.names.index(event.cause.removesuffix(" site 2 begins to slide"))
    assert str(event).startswith(f"the arm snaps as {event.cause}, to_bar most, at")
    # stuck since the start, its piece behind the hole stretches up to the capstan limit
    straight, there = arm.at([0.0]), arm.at([q])
    last = there.segments.chains.start[1:] - 1
    stretch = there.segments.lengths[last] / straight.segments.lengths[last]
    T = EA * (stretch * (1.0 + PULL / EA) - 1.0)
    assert abs(np.log(T[cable] / PULL)) == pytest.approx(there.segments.grip[cable], abs=1e-8)
    # sliding in both holes the push falls at once, sticking in one it grows
    assert push_at(arm, q + 1e-5, (-1, 1)) < push_at(arm, q, (-1, 1))


@pytest.mark.parametrize("substeps", [1, 8])
@pytest.mark.parametrize("tilt", [0.02, 0.05])
def test_a_small_snap_is_no_smooth_motion(tilt: float, substeps: int) -> None:
    """The column leans by a few degrees; pushed over, it comes to rest near its other side."""
    arm = column(0.0)

    def torque(q: float, down: float) -> float:
        pose = arm.at([q])
        cables = float(np.full(2, PULL) @ pose.length_jacobian[:, 0])
        return SPRING * q + cables - LEVER * down * np.sin(q)

    down = brentq(lambda down: torque(tilt, down), 5.0, 50.0)
    fold = minimize_scalar(
        lambda q: torque(q, down) / (LEVER * np.cos(q)), bounds=(0.0, tilt), options={"xatol": 1e-9}
    )
    loads = [
        [cdsm.Load("bar", force=(-down, side * fold.fun, 0), point=(LEVER, 0, 0))]
        for side in (-1.5, 1.5)  # the step of 3 passes the fold after 2.5
    ]
    history = cdsm.load_cycle(arm.at([0.0]), [PULL, PULL], loads, substeps=substeps)
    event, angle = snap(history)
    assert (event.step, event.cause) == (1, "limit point")
    assert event.share == pytest.approx(2.5 / 3.0, abs=1e-6)
    assert abs(angle) == pytest.approx(fold.x, rel=1e-3)
    assert abs(history.angles[1, 0] - history.angles[0, 0]) < 2.5 * tilt
    assert history.warnings == ("SNAPS THROUGH at load 1",)

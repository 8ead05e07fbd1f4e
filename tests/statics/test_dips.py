"""Events of a load cycle that begin and end within one sub-step, against one joint by hand."""

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm import Site
from cdsm.statics.load_cycle import LoadHistory
from tests.support.pulleys import Link, arm_of

SPRING = 20.0  # N m/rad
NEAR, FAR = 0.03, 0.05  # distances of the ends of the cable from the hinge [m]
EA = 20000.0  # N
ANGLE = 0.04  # rad, at the reference: the swing is found in one sub-step


def lever(side: float, mu: float = 0.0, maximum: float = np.inf) -> cdsm.Manipulator:
    """A bar on a hinge with a spring; a cable runs along it, or beyond the hinge (``side`` −1).

    At the angle 0 the cable is shortest, or longest.
    """
    path = [Site("base", (NEAR, 0.0, 0.02)), Site("base", (side * NEAR, 0.0, 0.0), friction=mu)]
    bar = Link("bar", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    law = cdsm.LinearElasticity(EA)
    path.append(Site("bar", (FAR, 0.0, 0.0)))
    arm = arm_of([bar], path, limit=1.4, elasticity=law, maximum=maximum)
    return arm.with_springs({"to_bar": SPRING})


def tension_at(arm: cdsm.Manipulator, pull: float, q: float) -> float:
    """Tension [N], or minus what a slack cable has too much, that was ``pull`` at the reference."""
    lengths = [float(arm.at([angle]).cable_lengths[0]) for angle in (q, ANGLE)]
    return EA * (lengths[0] / lengths[1] * (1.0 + pull / EA) - 1.0)


def moment_at(arm: cdsm.Manipulator, pull: float, q: float) -> float:
    """Moment [N m] at the tip that holds the bar at an angle, without friction."""
    T = max(tension_at(arm, pull, q), 0.0)
    return SPRING * q + T * float(arm.at([q]).length_jacobian[0, 0])


def swung(arm: cdsm.Manipulator, pull: float, substeps: int = 1) -> LoadHistory:
    """The bar, held at the reference, then swung to the other side."""
    loads = np.zeros((2, 6))
    loads[:, 5] = [moment_at(arm, pull, q) for q in (ANGLE, -ANGLE)]
    return cdsm.load_cycle(arm.at([ANGLE]), [pull], loads, substeps=substeps)


def check_by_hand(arm: cdsm.Manipulator, pull: float, kind: str, tension: float) -> None:
    """The only event in the swing is where the cable has a tension for the first time."""

    def missed(q: float) -> float:
        return tension_at(arm, pull, q) - tension

    q = brentq(missed, 0.0, ANGLE, xtol=1e-14)
    ends = [moment_at(arm, pull, angle) for angle in (ANGLE, -ANGLE)]
    history = swung(arm, pull)
    assert [event.kind for event in history.events] == [kind]
    (event,) = history.events
    assert event.step == 1
    assert history.event_angles[0, 0] == pytest.approx(q, abs=1e-9)
    share = (moment_at(arm, pull, q) - ends[0]) / (ends[1] - ends[0])
    assert event.share == pytest.approx(share, abs=1e-9)
    assert history.angles[:, 0] == pytest.approx([ANGLE, -ANGLE], abs=1e-9)


@pytest.mark.parametrize("pull", [5.0, 15.0, 20.0])
def test_a_cable_that_is_slack_for_a_moment_goes_slack_where_the_balance_by_hand_says(
    pull: float,
) -> None:
    arm = lever(1.0)
    assert tension_at(arm, pull, 0.0) < -1.0
    check_by_hand(arm, pull, "slack", 0.0)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.95])
def test_a_cable_that_passes_its_maximum_for_a_moment_does_so_where_the_balance_says(
    part: float,
) -> None:
    peak = tension_at(lever(-1.0), 50.0, 0.0)
    maximum = 50.0 + part * (peak - 50.0)
    check_by_hand(lever(-1.0, maximum=maximum), 50.0, "maximum", maximum)


def test_a_cable_that_stays_below_its_maximum_has_no_event() -> None:
    peak = tension_at(lever(-1.0), 50.0, 0.0)
    assert not swung(lever(-1.0, maximum=peak + 0.01), 50.0).events


def test_with_friction_they_are_those_of_a_fine_path() -> None:
    arm = lever(-1.0, mu=0.02, maximum=51.0)
    coarse, fine = (swung(arm, 50.0, substeps) for substeps in (1, 100))
    assert "maximum" in {event.kind for event in fine.events}
    assert [event.label for event in coarse.events] == [event.label for event in fine.events]
    for event, expected in zip(coarse.events, fine.events, strict=True):
        # where the cable stops to slide is known less well
        assert event.share == pytest.approx(expected.share, abs=1e-5)

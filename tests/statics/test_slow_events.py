"""Events of slow loading with friction against scans, breakaway, and arms without friction."""

from itertools import pairwise

import numpy as np
import pytest

import cdsm
from cdsm.statics.load_cycle import LoadHistory
from cdsm.support.values import Array
from tests.statics.test_events import largest_share, loaded
from tests.statics.test_load_cycle import along_z, planar, prototype

TURNS = (0.0, -6.0, 0.0, 6.0, -6.0)  # N


@pytest.fixture(scope="module")
def history() -> LoadHistory:
    pose, pull = planar(0.2)
    return cdsm.load_cycle(pose, pull, along_z(*TURNS[1:]))


def begins(history: LoadHistory, hole: str) -> Array:
    """Numbers of the loads in the step to which a cable begins to slide in a hole."""
    slides = np.append(0, history.sliding[:, history.holes.index(hole)])
    return np.flatnonzero((slides[1:] != 0) & (slides[1:] != slides[:-1]))


def test_each_slip_lies_within_one_step_of_a_scan(history: LoadHistory) -> None:
    pieces = [np.linspace(a, b, 501)[1:] for a, b in pairwise(TURNS)]
    forces = np.concatenate(pieces)
    pull = cdsm.distribute_tension(history.reference, 50.0)
    scan = cdsm.load_cycle(history.reference, pull, along_z(*forces), substeps=1)
    for hole in history.holes:
        events = [event for event in history.events if event.place == hole]
        assert {event.kind for event in events} <= {"slip"}
        places = [500.0 * ((event.step or 0) + event.share) for event in events]
        found = begins(scan, hole)
        assert len(places) == len(found)
        for place, k in zip(places, found.tolist(), strict=True):
            assert k - 1e-6 <= place <= k + 1.0 + 1e-6


def test_a_cable_is_about_to_slide_at_each_slip(history: LoadHistory) -> None:
    first = [event for event in history.events if event.step == 0]
    pull = cdsm.distribute_tension(history.reference, 50.0)
    loads = sorted({event.load for event in first})
    path = cdsm.load_cycle(history.reference, pull, along_z(*(-f for f in loads)), substeps=1)
    for event in first:
        k = loads.index(event.load)
        segments = path.pose(k).segments
        hole = path.holes.index(event.place)
        j = segments.chains.hole[hole]
        T = path.segment_tensions[k]
        assert abs(np.log(T[j + 1] / T[j])) == pytest.approx(segments.grip[hole], abs=1e-8)


def test_the_first_slip_is_the_breakaway() -> None:
    pose, pull = prototype(0.15)
    test = cdsm.weight_test(pose, pull, [0.0, 0.0, -8.0])
    assert test.breakaway is not None
    first = test.events[0]
    assert first.kind == "slip"
    assert first.load == pytest.approx(test.breakaway.load, rel=1e-4)  # its motion is linear
    there = cdsm.weight_test(pose, pull, [0.0, 0.0, -first.load])
    np.testing.assert_allclose(test.event_displacements[0], there.displacement, atol=1e-12)
    words = f"on the way: {first}, the first of {len(test.events)} slips"
    assert words in str(test)
    assert test.to_dict()["events"][0]["load_N"] == first.load  # type: ignore[index]


@pytest.mark.parametrize("seed", [4, 21])
def test_without_friction_they_are_those_of_a_weight(seed: int) -> None:
    pose, tension, force = loaded(seed)
    force = largest_share(pose, tension, force) * force
    test = cdsm.weight_test(pose, tension, force)
    history = cdsm.load_cycle(pose, tension, [np.append(force, np.zeros(3))], substeps=20)
    assert len(history.events) == len(test.events)
    for event, expected in zip(history.events, test.events, strict=True):
        assert (event.kind, event.place, event.step) == (expected.kind, expected.place, 0)
        assert event.share == pytest.approx(expected.share, rel=1e-7)
        assert event.load == pytest.approx(expected.load, rel=1e-7)


def test_a_motor_that_pulls_passes_the_maximum_of_its_cable() -> None:
    pose, pull = planar(0.2)
    cables = [cdsm.Cable(**{**vars(cable), "maximum": 80.0}) for cable in pose.arm.cables]
    pose = pose.arm.with_cables(cables).at(pose.q)
    pull = cdsm.distribute_tension(pose, 50.0)
    motors = np.array([[4e-4, 0.0, 0.0, 0.0]])
    events = cdsm.load_cycle(pose, pull, np.zeros((1, 6)), motors=motors).events
    event = next(event for event in events if event.kind == "maximum")
    assert (event.place, event.load) == ("cable1_1", 0.0)
    assert f"passes its maximum tension at {100.0 * event.share:.4g} % of it" in str(event)
    there = cdsm.load_cycle(pose, pull, np.zeros((1, 6)), motors=event.share * motors, substeps=400)
    assert there.tensions[0].max() == pytest.approx(80.0, rel=1e-4)

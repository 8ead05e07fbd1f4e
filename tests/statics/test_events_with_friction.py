"""Events of forward statics with friction, on the pull and under the load, against scans."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.events import Event
from cdsm.statics.quasi_static import ChainArmState, QuasiStaticState
from cdsm.statics.sliding_pieces import ways_of
from cdsm.statics.slow_walk import Walk
from cdsm.support.values import Array
from tests.support.arms import random_arm, readme_geometry


def pulled(seed: int, friction: float = 0.1, force: float = 1.0) -> Equilibrium:
    """A random arm with springs and limited cables whose motors take in wire; then a load."""
    random = np.random.default_rng(seed + 100)
    arm = random_arm(seed, 2 + seed % 2).with_friction(friction)
    arm = arm.with_springs({name: random.uniform(2.0, 10.0) for name in arm.joint_names})
    pull = random.uniform(0.05, 1.0, len(arm.cables)) * 1e-3
    u = random.normal(size=3)
    u *= force * random.uniform(20.0, 120.0) / np.linalg.norm(u)
    most = random.uniform(60.0, 400.0)
    arm = arm.with_cables([cdsm.Cable(**{**vars(c), "maximum": most}) for c in arm.cables])
    return cdsm.forward_statics(arm, pull=pull, wrench=np.append(u, np.zeros(3)))


def compressed() -> Equilibrium:
    """An arm on soft springs under a force along it, beyond what it bears straight."""
    sizes: dict[str, Any] = {"joints": 2, "link_mass": 0.02}
    arm = cdsm.Manipulator(readme_geometry(**sizes), cdsm.LinearElasticity(1e3))
    arm = arm.with_friction(0.1).with_springs(dict.fromkeys(arm.joint_names, 0.5))
    return cdsm.forward_statics(arm, pull=np.full(6, 1e-5), wrench=[-30.0, 0.5, 0, 0, 0, 0])


def states(rest: Equilibrium, step: int, count: int) -> Iterator[QuasiStaticState]:
    """The states at ``count`` equal steps of the pull (0) or the load (1)."""
    assert rest.path is not None
    way = rest.path.way
    state = way.start
    if step:
        for goal in np.arange(1, way.substeps[0] + 1) / way.substeps[0]:
            part = way.start.load.interpolate(way.loads[0], float(goal))
            state, _ = way.arm.step_to(state, part, 1, "the pull")
    begin = state.load
    yield state
    for k in range(count):
        part = begin.interpolate(way.loads[step], (k + 1) / count)
        state, _ = way.arm.step_to(state, part, 1, "the scan")
        yield state


def scanned(rest: Equilibrium, step: int, count: int) -> dict[tuple[str, str], int]:
    """The steps in which something happens for the first time: slips, slack, maximum, stops."""
    assert rest.path is not None
    path = rest.path
    arm = path.arm
    hole = path.reference.segments.chains.hole
    first = path.reference.segments.chains.start[:-1]
    most = np.array([cable.maximum for cable in arm.cables])
    found: dict[tuple[str, str], int] = {}
    before: dict[tuple[str, str], bool] = {}
    begin: Array | None = None
    for k, state in enumerate(states(rest, step, count)):
        chains: ChainArmState = state.arm_state
        ways = ways_of(chains)[hole]
        begin = ways if begin is None else begin
        T = chains.tension
        now = {
            ("slip", name): slides for name, slides in zip(path.holes, ways != begin, strict=True)
        }
        now = {key: bool(value and ways[path.holes.index(key[1])]) for key, value in now.items()}
        for name, value in zip(arm.cables.names, np.maximum.reduceat(T, first) > most, strict=True):
            now["maximum", name] = bool(value)
        for name, value in zip(arm.cables.names, T[first] == 0.0, strict=True):
            now["slack", name] = bool(value)
        for name, value in zip(arm.joint_names, state.stop_torque != 0.0, strict=True):
            now["stop", name] = bool(value)
        for key, value in now.items():
            if value and not before.get(key, k == 0):
                found.setdefault(key, k - 1)
        before = now
    if step == 0:
        found = {key: k for key, k in found.items() if key[0] != "slip"}
    return found


def check_against_scan(rest: Equilibrium, count: int, around: float) -> list[Event]:
    """Each event of the load is within one step of a scan, and the scan has no others."""
    events = [event for event in rest.events if event.part == "load"]
    found = scanned(rest, 1, count)
    assert {(event.kind, event.place) for event in events} == set(found)
    for event in events:
        k = found[event.kind, event.place]
        assert k - around <= count * event.share <= k + 1.0 + around, (event, k)
    return events


@pytest.mark.parametrize("seed", [4, 6, 8])
def test_each_event_lies_within_one_step_of_a_scan(seed: int) -> None:
    assert {event.kind for event in check_against_scan(pulled(seed), 400, 0.1)} == {"slip"}


def test_slack_and_maximum_under_load_lie_next_to_those_of_a_scan() -> None:
    """Holes stop to slide on this way, so a scan is off: by 1.6 of 400 steps, by 2 of 2,000."""
    kinds = {event.kind for event in check_against_scan(pulled(10), 400, 1.7)}
    assert kinds == {"slip", "maximum", "slack"}


@pytest.mark.long
@pytest.mark.parametrize("seed", [6, 8])
def test_each_event_lies_within_one_step_of_a_fine_scan(seed: int) -> None:
    assert check_against_scan(pulled(seed), 2000, 0.1)


def test_what_decides_an_event_is_zero_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of an arm that buckles: where it does, K_θ is singular, or a cable goes slack."""
    left = list[float]()
    kinds = set[str]()
    note = Walk._note

    def noted(walk: Any, step: int, i: int, stage: Any, kind: Any, action: Any) -> None:
        watch = walk._watch
        value = watch.value(stage)[i]
        if kind != "slip" or value != 1.0:  # the cable of this hole is not just becoming taut
            left.append(abs(value) / watch.scale(stage)[i])
        kinds.add(kind)
        note(walk, step, i, stage, kind, action)

    monkeypatch.setattr(Walk, "_note", noted)
    rests = [pulled(10), pulled(4), compressed()]
    told = {event.kind for rest in rests for event in rest.events}
    assert max(left) <= 1e-8
    assert kinds >= {"slip", "slack", "maximum", "stop"}
    assert told >= {"slip", "slack", "maximum", "stop", "buckling"}


def test_shares_and_words_name_the_part() -> None:
    rest = pulled(6)
    pull = [event for event in rest.events if event.part == "pull"]
    assert pull
    assert {event.kind for event in pull} == {"maximum"}
    first = pull[0]
    assert f"{first.place} passes its maximum tension at {100 * first.share:.4g} % of the pull" in (
        str(rest)
    )
    slip = next(event for event in rest.events if event.kind == "slip")
    assert f"{slip.place} begins to slide at {slip.load:.4g} N of the load, the first of" in str(
        rest
    )
    assert rest.path is not None
    size = np.linalg.norm(rest.path.wrenches[-1, :3])
    assert slip.load == pytest.approx(slip.share * size)
    told = json.loads(json.dumps(rest.to_dict()))["events"]
    assert [event["part"] for event in told] == [event.part for event in rest.events]
    # pulled so far, the cable is at its maximum
    arm = rest.pose.arm
    random = np.random.default_rng(106)
    random.uniform(2.0, 10.0, arm.nv)
    commands = first.share * random.uniform(0.05, 1.0, len(arm.cables)) * 1e-3
    there = cdsm.forward_statics(arm, pull=commands)
    c = arm.cables.names.index(first.place)
    assert there.tension[c] == pytest.approx(arm.cables[c].maximum, rel=1e-3)


def test_they_tend_to_those_without_friction() -> None:
    """On the pull alone, in proportion to the friction."""
    expected = {event.place: event.share for event in pulled(4, 0.0, 0.0).events}
    assert len(expected) > 3
    off = []
    for friction in (0.04, 0.02, 0.01):
        events = {event.place: event.share for event in pulled(4, friction, 0.0).events}
        assert set(events) == set(expected)
        off.append(np.mean([abs(events[place] - expected[place]) for place in expected]))
    assert off[0] / off[1] == pytest.approx(2.0, abs=0.3)
    assert off[1] / off[2] == pytest.approx(2.0, abs=0.3)


def test_an_arm_that_rests_on_a_stop_from_the_start_does_not_reach_it() -> None:
    arm = random_arm(2, 4).with_friction(0.1)
    random = np.random.default_rng(2)
    arm = arm.with_springs({name: random.uniform(1.0, 10.0) for name in arm.joint_names})
    none = cdsm.forward_statics(arm, tension=np.full(len(arm.cables), 1e-3), friction=False)
    assert none.at_limit == ("joint1_1",)
    rest = cdsm.forward_statics(arm, tension=np.full(len(arm.cables), 5.0))
    assert [event for event in rest.events if event.kind == "stop"] == []

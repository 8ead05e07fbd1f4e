"""Events of growing loads against scans of many small steps."""

import numpy as np
import pytest

import cdsm
from cdsm.statics.continuation import follow
from cdsm.statics.events import Event
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.pieces import stage_at
from cdsm.statics.solve import least_eigenvalue
from cdsm.support.values import Array
from tests.support.arms import random_arm


def loaded(seed: int) -> tuple[cdsm.Posture, cdsm.Tension, Array]:
    """A random arm, its least tensions, and a force that moves its tip by 5 % of its length."""
    arm = random_arm(seed, 2 + seed % 4)
    random = np.random.default_rng(seed)
    pose = arm.at(random.uniform(-0.15, 0.15, arm.nv))
    tension = cdsm.distribute_tension(pose, 5.0)
    u = random.normal(size=3)
    u /= np.linalg.norm(u)
    return pose, tension, 0.05 * arm.length * cdsm.stiffness(pose, tension).along(u) * u


def largest_share(pose: cdsm.Posture, tension: cdsm.Tension, force: Array) -> float:
    """The share of a force that the arm bears, a little less than that at which it buckles."""
    try:
        cdsm.weight_test(pose, tension, force)
    except cdsm.EquilibriumError as error:
        return 0.999 * error.load_factor
    return 1.0


def scanned(
    pose: cdsm.Posture, tension: cdsm.Tension, force: Array, free: Array, count: int
) -> dict[tuple[str, str], list[int]]:
    """The steps of a scan in which a cable loses its tension, or a joint reaches its stop."""
    arm = pose.arm
    parts = 1 + (count - 1) // 1000  # a test has 1000 steps at most
    test = cdsm.weight_test(pose, tension, force / parts, steps=count // parts)
    states = [test.unloaded, *test.states]
    for _ in range(parts - 1):
        more = cdsm.weight_test(states[-1].pose, states[-1], force / parts, steps=count // parts)
        states += more.states
    lengths = np.array([state.pose.cable_lengths for state in states])
    strain = lengths / free - 1.0  # a cable longer than its wire is slack
    stopped = np.array([state.stop_torque != 0.0 for state in states])
    found: dict[tuple[str, str], list[int]] = {}
    for kind, names, on in (
        ("slack", arm.cables.names, strain < 0.0),
        ("stop", arm.joint_names, stopped),
    ):
        for k, i in np.argwhere(on[1:] & ~on[:-1]).tolist():
            found.setdefault((kind, names[i]), []).append(k)
    assert len(states) == count + 1
    return found


def check_against_scan(seed: int, count: int) -> int:
    """Compare the events of an arm with a scan of ``count`` steps; return their number."""
    pose, tension, force = loaded(seed)
    force = largest_share(pose, tension, force) * force
    test = cdsm.weight_test(pose, tension, force)
    events = [event for event in test.events if event.kind != "buckling"]
    free = pose.arm.laws.original_lengths(pose.cable_lengths, tension.values)
    steps = scanned(pose, tension, force, free, count)
    expected = sorted((kind, place, k) for (kind, place), ks in steps.items() for k in ks)
    assert len(events) == len(expected)
    for event, (kind, place, k) in zip(
        sorted(events, key=lambda event: (event.kind, event.place, event.share)),
        expected,
        strict=True,
    ):
        assert (event.kind, event.place) == (kind, place)
        assert k / count - 1e-9 <= event.share <= (k + 1) / count + 1e-9
        assert event.load == pytest.approx(event.share * np.linalg.norm(force))
        check_root(event, pose, tension, force, free)
    return len(events)


def check_root(
    event: Event, pose: cdsm.Posture, tension: cdsm.Tension, force: Array, free: Array
) -> None:
    """The quantity that decides an event is zero there."""
    # of two equilibria under this load, the one that slow loading reaches
    rest = cdsm.weight_test(pose, tension, event.share * force).states[-1]
    arm = pose.arm
    if event.kind == "slack":
        c = arm.cables.names.index(event.place)
        EA = arm.cables[c].elasticity.constant_rigidity
        pull = EA * (rest.pose.cable_lengths[c] / free[c] - 1.0)
        assert abs(pull) <= 1e-8 * rest.tension.max()
    else:
        i = arm.joint_names.index(event.place)
        torque = rest.stiffness.residual[i]
        assert abs(torque) <= 1e-8 * abs(rest.tension @ pose.length_jacobian).max()


@pytest.mark.parametrize("seed", [3, 4, 18, 21, 28])
def test_each_event_lies_within_one_step_of_a_scan(seed: int) -> None:
    assert check_against_scan(seed, 40)


@pytest.mark.long
def test_each_event_of_thirty_arms_lies_within_one_step_of_a_fine_scan() -> None:
    assert sum(check_against_scan(seed, 2000) for seed in range(30)) > 60


@pytest.mark.parametrize("seed", [4, 5, 19, 23])
def test_buckling_is_where_the_smallest_eigenvalue_is_zero(seed: int) -> None:
    pose, tension, force = loaded(seed)
    force = 2.0 * force
    with pytest.raises(cdsm.EquilibriumError) as caught:
        cdsm.weight_test(pose, tension, force)
    share = caught.value.load_factor
    cdsm.weight_test(pose, tension, share * (1.0 - 1e-7) * force)
    with pytest.raises(cdsm.EquilibriumError):
        cdsm.weight_test(pose, tension, share * (1.0 + 1e-7) * force)

    def model(part: float) -> LockedArm:
        return LockedArm(pose, tension.values, part * np.append(force, np.zeros(3)))

    branch = follow(model, stage_at(model, pose, np.zeros(pose.q.size), 0.0), 1.0)
    stage = branch[-1]
    assert stage.share == pytest.approx(share, rel=1e-9)
    margin = least_eigenvalue(stage.balance, stage.point)
    tensions = stage.arm.continued_tensions(stage.pose)
    assert stage.taut is not None
    just = ~stage.taut & (abs(tensions) <= 1e-8 * tensions.max())
    if just.any():  # K_θ jumps where a cable goes slack
        K_before, K_after = (
            stage.arm.keeping(taut).at_pose(stage.pose).stiffness
            for taut in (stage.taut | just, stage.taut)
        )
        assert np.linalg.eigvalsh(K_before)[0] > 0.0 > np.linalg.eigvalsh(K_after)[0]
    else:
        assert abs(margin) <= 1e-8 * abs(np.linalg.eigvalsh(stage.point.state.stiffness)).max()


def test_an_arm_that_snaps_where_a_cable_goes_slack_says_so() -> None:
    pose, tension, force = loaded(2)
    force = largest_share(pose, tension, force) * force
    test = cdsm.weight_test(pose, tension, force)
    *_, slack, snap = test.events
    assert (slack.kind, snap.kind, slack.share) == ("slack", "buckling", snap.share)
    assert test.warnings[0].startswith("SNAPS THROUGH")
    arm = pose.arm
    c = arm.cables.names.index(slack.place)
    pulls = [
        cdsm.weight_test(pose, tension, part * snap.share * force, steps=20).states[-1].tension[c]
        for part in (1.0 - 1e-4, 1.0 + 1e-2)
    ]
    assert 0.0 < pulls[0] < 1e-3 * tension.values.max()
    assert pulls[1] == 0.0


def test_a_cable_passes_its_own_maximum() -> None:
    pose, tension, force = loaded(0)
    free = cdsm.weight_test(pose, tension, force)
    c = int(free.states[-1].tension.argmax())
    limit = (tension.values[c] + free.states[-1].tension[c]) / 2.0
    arm = pose.arm
    name = arm.cables.names[c]
    limited = arm.with_cables(
        [
            cdsm.Cable(**{**vars(cable), "maximum": limit}) if cable.name == name else cable
            for cable in arm.cables
        ]
    ).at(pose.q)
    events = cdsm.weight_test(limited, tension.values, force).events
    event = next(event for event in events if event.kind == "maximum")
    assert event.place == name
    there = cdsm.equilibrium(pose, tension, np.append(event.share * force, np.zeros(3)))
    assert there.tension[c] == pytest.approx(limit, rel=1e-8)


def test_forward_statics_name_their_events() -> None:
    arm = cdsm.presets.nitinol_segment()
    wrench = [0.0, 20.0, 0.0, 0.0, 0.0, 0.0]
    rest = cdsm.forward_statics(arm, pull=[1e-3, 0.0, 0.0], wrench=wrench)
    assert [event.place for event in rest.events if event.kind == "slack"] == list(rest.slack)
    stops = [event for event in rest.events if event.kind == "stop"]
    assert [event.place for event in stops] == list(rest.at_limit)
    before = cdsm.forward_statics(
        arm,
        pull=[0.999 * stops[0].share * 1e-3, 0.0, 0.0],
        wrench=0.999 * stops[0].share * np.array(wrench),
    )
    assert before.at_limit == ()
    assert rest.to_dict()["events"][-1]["load_N"] == stops[-1].load  # type: ignore[index]

"""How much an arm holds: bisections on single solutions find the same."""

from collections.abc import Callable

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.arms import prototype, random_arm
from tests.support.locked import hinge


def bisected(holds: Callable[[float], bool], force: float) -> float:
    """The largest force that is held, near ``force``, to 1e-7 of it."""
    low = 0.9 * force
    high = 1.1 * force
    assert holds(low)
    assert not holds(high)
    while high - low > 1e-7 * force:
        middle = (low + high) / 2.0
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def random_case(seed: int) -> tuple[cdsm.Posture, Array]:
    arm = random_arm(seed, 2 + seed % 4)
    random = np.random.default_rng(seed)
    pose = arm.at(random.uniform(-0.15, 0.15, arm.nv))
    u = random.normal(size=3)
    return pose, u / np.linalg.norm(u)


def check_following(seed: int) -> str:
    """Compare with a bisection on the least tensions and their stability."""
    pose, u = random_case(seed)
    held = cdsm.payload(pose, u, 5.0, 60.0).following
    if held is None:
        with pytest.raises(cdsm.InfeasibleTension):
            cdsm.distribute_tension(pose, 5.0, 60.0)
        return "no tensions without the force"

    def holds(force: float) -> bool:
        try:
            tension = cdsm.distribute_tension(pose, 5.0, 60.0, np.append(force * u, np.zeros(3)))
            return cdsm.stiffness(pose, tension).is_stable
        except cdsm.InfeasibleTension:
            return False
        except cdsm.CdsmError:  # the solver fails where only one set of tensions is left
            assert force == pytest.approx(held.force, rel=1e-6)
            return False

    assert bisected(holds, held.force) == pytest.approx(held.force, rel=1e-6)
    assert held.events[-1].load == held.force
    return held.limit


def check_locked(seed: int) -> str:
    """Compare with a bisection on equilibria: within the maximum, off the stops, no jump."""
    pose, u = random_case(seed)
    limited = cdsm.payload(pose, u, 5.0, 60.0)
    held = limited.locked
    if held is None:
        assert limited.following is None
        return "no tensions without the force"
    assert limited.tension is not None
    tension = limited.tension
    near = cdsm.equilibrium(pose, tension, np.append(0.9 * held.force * u, np.zeros(3)))

    def holds(force: float) -> bool:
        rest = cdsm.equilibrium(pose, tension, np.append(force * u, np.zeros(3)))
        stays = abs(rest.pose.q - near.pose.q).max() < 0.1
        return rest.tension.max() <= 60.0 and not rest.at_limit and stays

    assert bisected(holds, held.force) == pytest.approx(held.force, rel=1e-6)
    assert [event.share for event in held.events] == sorted(event.share for event in held.events)
    return held.limit


@pytest.mark.parametrize("seed", [0, 1, 2, 37])
def test_bisections_find_what_an_arm_holds(seed: int) -> None:
    assert "cable" in check_following(seed)
    assert check_locked(seed)


@pytest.mark.long
def test_bisections_find_what_sixty_arms_hold() -> None:
    for seed in range(60):
        check_following(seed)
        check_locked(seed)


def test_the_cable_that_is_named_is_the_one_that_limits() -> None:
    pose, u = random_case(1)
    names = pose.arm.cables.names
    held = cdsm.payload(pose, u, 5.0, 60.0).following
    assert held is not None
    limits = [cdsm.payload(pose, u, 5.0, 60.0 + np.eye(len(names))[c]).limits["tension"]
              for c in range(len(names))]  # fmt: skip
    assert held.limit == f"maximum of {names[int(np.argmax(limits))]} (60 N)"


def test_mass_follows_gravity() -> None:
    pose, _ = prototype()
    down = cdsm.payload(pose, pose.arm.gravity, 50.0, 800.0).following
    assert down is not None
    assert down.mass == pytest.approx(down.force / np.linalg.norm(pose.arm.gravity), rel=1e-12)
    across = cdsm.payload(pose, "z", 50.0, 800.0).following
    assert across is not None
    assert across.mass is None
    assert "kg" in str(down)
    assert "kg" not in str(across)
    assert "inf" not in str(cdsm.payload(pose, "z", 50.0))


def test_a_hinge_buckles_under_its_known_load() -> None:
    """A straight hinge under a push P along it: k_θ = P L, its cables taut until then."""
    pose = hinge(hole_radius=0.02, gravity=(0.0, 0.0, 0.0)).at([0.0])
    held = cdsm.payload(pose, "-x", 10.0)
    K = cdsm.stiffness(pose, held.tension)
    lever = -K.posture.jacobian[2, 0]
    for case in (held.following, held.locked):
        assert case is not None
        assert case.limit.startswith("buckling, joint1")
        if case.motors == "locked":
            assert case.force == pytest.approx(K.joint[0, 0] / abs(lever), rel=1e-8)


def test_an_arm_without_tensions_says_why() -> None:
    pose = cdsm.presets.virtual_prototype().at(np.zeros(10))
    held = cdsm.payload(pose, "-y", 15.0, 16.0)
    assert (held.following, held.locked, held.force) == (None, None, 0.0)
    assert "no tension within the bounds balances the arm" in held.warnings[0]
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.payload(pose, None, 15.0, 16.0)
    own = cdsm.payload(pose, "-y", 15.0, 16.0, tension=np.full(15, 60.0))
    assert own.locked is not None


def test_the_end_of_a_law_is_named() -> None:
    pose, _ = prototype()
    held = cdsm.payload(pose, "-y", 50.0)
    assert held.following is not None
    assert held.locked is not None
    assert "law of cable" in held.following.limit
    assert "law of cable" in held.locked.limit


def test_a_cable_that_slackens_and_would_push_back_within_one_step_is_not_missed() -> None:
    """cable1_2 goes slack before cable3_1; a wire that could push would be taut again behind it."""
    geometry = cdsm.Geometry.universal(
        joints=4,
        cables_per_joint=3,
        link_length=0.0611,
        base_length=0.0482,
        disk_offset=0.00914,
        hole_radius=0.0221,
        link_mass=0.206,
        lead=0.287,
    )
    law = cdsm.TabulatedElasticity([0, 5, 30, 200, 600], [0, 0.0025, 0.008, 0.02, 0.04])
    arm = cdsm.Manipulator(geometry, law, gravity=(-1.47, -7.67, 1.09))
    pose = arm.at([-0.00686, 0.0116, 0.0759, -0.144, 0.093, 0.169, 0.16, 0.152])
    u = np.array([-0.838, 0.415, 0.353])
    u /= np.linalg.norm(u)
    held = cdsm.payload(pose, u, 1.8, 90.0, link="cross4")
    assert held.locked is not None
    slack = {event.place: event.load for event in held.locked.events if event.kind == "slack"}
    loads = np.arange(0.5, 18.8, 0.5)
    rest = [cdsm.equilibrium(pose, held.tension, {"cross4": [*(f * u), 0, 0, 0]}) for f in loads]
    assert min(each.stiffness.margin for each in rest) > 0.3
    for name in ("cable1_2", "cable3_1"):
        c = arm.cables.names.index(name)
        first = int(np.argmax([each.tension[c] < 1e-9 for each in rest]))
        assert loads[first - 1] <= slack[name] <= loads[first]
    assert held.locked.force == pytest.approx(18.842, abs=0.01)

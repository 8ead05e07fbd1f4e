"""Force polytope and payload against exhaustive searches and another library."""

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import cdsm
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, prototype, random_arm, random_posture
from tests.support.locked import hinge


def corners(pose: cdsm.Posture, low: float, high: float) -> Array:
    """All corners of the force polytope, by trying every set of cables at their bounds."""
    J, Jv = pose.length_jacobian, pose.jacobian[:3]
    count, nv = J.shape
    free = nv - 3  # tensions that the equations determine besides the force
    found = []
    for between in combinations(range(count), free):
        rest = [c for c in range(count) if c not in between]
        matrix = np.column_stack([J[list(between)].T, -Jv.T])
        if np.linalg.cond(matrix) > 1e10:
            continue
        for ends in np.ndindex(*[2] * len(rest)):
            F = np.where(np.array(ends) == 0, low, high)
            x = np.linalg.solve(matrix, -pose.gravity_torque - J[rest].T @ F)
            if (x[:free] >= low - 1e-9).all() and (x[:free] <= high + 1e-9).all():
                found.append(x[free:])
    return np.array(found)


@pytest.mark.parametrize("seed", range(4))
def test_vertices_are_those_of_an_exhaustive_search(seed: int) -> None:
    arm = random_arm(seed, 2)
    pose = random_posture(arm, seed)
    tried = corners(pose, 5.0, 200.0)
    if not len(tried):
        with pytest.raises(cdsm.InfeasibleTension):
            cdsm.force_polytope(pose, 5.0, 200.0)
        return
    expected = ConvexHull(tried)
    found = cdsm.force_polytope(pose, 5.0, 200.0)
    size = np.ptp(tried, axis=0).max()
    assert found.volume == pytest.approx(expected.volume, rel=1e-7)
    assert (found.vertices @ found.normals.T).max(axis=0) == pytest.approx(found.offsets, rel=1e-8)
    gaps = np.linalg.norm(found.vertices[:, None] - tried[None], axis=2).min(axis=1)
    assert gaps.max() < 1e-7 * size
    zero = -expected.equations[:, 3].max() if (expected.equations[:, 3] > 0).any() else None
    distance = (-expected.equations[:, 3]).min() if zero is None else zero
    assert found.radius == pytest.approx(distance, rel=1e-6)


@pytest.mark.parametrize("arm", [mixed_arm(), cdsm.presets.virtual_prototype()])
def test_payload_is_where_tensions_end(arm: cdsm.Manipulator) -> None:
    pose = random_posture(arm, 3, 0.3)
    minimum, maximum = (0.0, 60.0) if arm.nv < 10 else (15.0, 800.0)
    rng = np.random.default_rng(1)
    for u in rng.normal(size=(3, 3)):
        held = cdsm.payload(pose, u, minimum, maximum)
        if held.limit != "tension":
            continue
        load = np.concatenate([u / np.linalg.norm(u), np.zeros(3)])
        cdsm.distribute_tension(pose, minimum, maximum, (1.0 - 1e-6) * held.force * load)
        with pytest.raises(cdsm.InfeasibleTension):
            cdsm.distribute_tension(pose, minimum, maximum, (1.0 + 1e-6) * held.force * load)


def test_no_direction_is_worse_than_the_worst() -> None:
    pose = cdsm.presets.virtual_prototype().at(cdsm.presets.TEN_DEGREES * np.arange(1, 11) / 8.0)
    worst = cdsm.payload(pose, None, 15.0, 800.0)
    again = cdsm.payload(pose, worst.direction, 15.0, 800.0)
    assert worst.worst
    assert worst.limit == "tension"
    assert again.force == pytest.approx(worst.force, rel=1e-7)
    # exhaustive: a fine sphere of directions, by the support of the polytope and by programs
    rng = np.random.default_rng(0)
    near = worst.direction + 0.05 * rng.normal(size=(15, 3))
    forces = [cdsm.payload(pose, u, 15.0, 800.0).force for u in [*rng.normal(size=(15, 3)), *near]]
    assert min(forces) >= worst.force * (1.0 - 1e-9)
    assert min(forces) < 1.05 * worst.force


def test_deflection_limits_the_payload() -> None:
    pose, pull = prototype()
    K = cdsm.stiffness(pose, pull)
    C = K.compliance[:3, :3]
    held = cdsm.payload(pose, "z", 50.0, 800.0, deflection=1e-3)
    assert held.limit == "deflection"
    assert held.force == pytest.approx(1e-3 / np.linalg.norm(C[:, 2]), rel=1e-12)
    worst = cdsm.payload(pose, None, 50.0, 800.0, deflection=1e-3)
    assert worst.force == pytest.approx(1e-3 / np.linalg.norm(C, 2), rel=1e-9)
    assert np.linalg.norm(C @ worst.direction) * worst.force == pytest.approx(1e-3, rel=1e-9)


def test_the_worst_friction_takes_from_both_ends() -> None:
    pose, _ = prototype(friction=0.1)
    free = cdsm.payload(pose, "z", 15.0, 200.0)
    rough = cdsm.payload(pose, "z", 15.0, 200.0, worst_friction=True)
    assert 0.0 < rough.force < free.force
    load = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(
            pose, 15.0, 200.0, (1.0 + 1e-6) * rough.force * load, worst_friction=True
        )
    polytope = cdsm.force_polytope(pose, 15.0, 200.0, worst_friction=True)
    along = polytope.normals[:, 2] > 0.0
    ends = polytope.offsets[along] / polytope.normals[along, 2]
    assert ends.min() == pytest.approx(rough.force, rel=1e-7)


def test_pycapacity_finds_the_same_polytope() -> None:
    """pycapacity 2.1.9: human.force_polytope(J_v, J_Lᵀ, 15, 800, 1e-9, −g)."""
    found = cdsm.force_polytope(prototype()[0], 15.0, 800.0)
    assert len(found.vertices) == 48
    assert found.volume == pytest.approx(1062976867.6507927, rel=1e-9)
    assert found.radius == pytest.approx(471.80850355, rel=1e-9)


def test_where_the_tip_cannot_move_the_links_hold_any_force() -> None:
    pose = cdsm.presets.virtual_prototype().at(np.zeros(10))
    polytope = cdsm.force_polytope(pose, 15.0, 800.0)
    assert abs(polytope.unbounded) == pytest.approx(np.array([[1.0, 0.0, 0.0]]))
    assert np.isinf(polytope.volume)
    assert cdsm.payload(pose, "x", 15.0, 800.0).limits["tension"] == np.inf
    side = cdsm.payload(pose, polytope.worst_direction, 15.0, 800.0)
    assert side.force == pytest.approx(polytope.radius, rel=1e-7)


@pytest.mark.filterwarnings("ignore:no joint moves the point")
def test_a_place_that_no_joint_moves_holds_any_force() -> None:
    """Neither the deflection nor why the radius is infinite is dropped in silence."""
    pose = cdsm.presets.virtual_prototype().at(np.full(10, 0.1))
    still = cdsm.force_polytope(pose, 15.0, 800.0, link="link1")
    assert str(still) == "holds any force on link1: no joint moves the place where it acts"
    assert "corners; holds" in str(cdsm.force_polytope(pose, 15.0, 800.0, link="link3"))
    held = cdsm.payload(pose, "z", 15.0, 800.0, link="link1", deflection=1e-3)
    assert held.limits["deflection"] == np.inf
    assert held.deflection == 1e-3
    assert "deflection allows any force, which moves nothing" in str(held)
    some = cdsm.payload(pose, "z", 15.0, 800.0, link="link3", deflection=1e-3)
    assert f"deflection allows {some.limits['deflection']:.4g} N" in str(some)
    assert "deflection" not in str(cdsm.payload(pose, "z", 15.0, 800.0, link="link1"))


def test_a_balanced_arm_with_fewer_cables_than_joints_holds_no_force() -> None:
    arm = cdsm.presets.nitinol_segment(gravity=(0.0, 0.0, -9.81))
    random = np.random.default_rng(0)
    for _ in range(4):
        pose = cdsm.forward_statics(arm, tension=random.uniform(0.0, 4.0, 3)).pose
        polytope = cdsm.force_polytope(pose, maximum=100.0)
        np.testing.assert_array_equal(polytope.vertices, np.zeros((1, 3)))
        assert (polytope.radius, polytope.volume) == (0.0, 0.0)
        assert cdsm.payload(pose, "z", maximum=100.0).limits["tension"] == 0.0


def test_a_hinge_without_cables_holds_only_forces_through_it() -> None:
    whole = hinge(0.9, joints=2, base_length=0.04, hole_radius=0.02, gravity=(0.0, 0.0, 0.0))
    pose = whole.with_cables(whole.cables[:2]).at([0.3, 0.4])
    polytope = cdsm.force_polytope(pose, 5.0, 45.0)
    along = pose.tip[:3, 3] - pose.link_pose("link2")[:3, 3]
    along /= np.linalg.norm(along)
    assert polytope.vertices.shape == (2, 3)
    np.testing.assert_allclose(np.cross(polytope.vertices, along), 0.0, atol=1e-9)
    assert polytope.radius == 0.0
    # balance of the first hinge, with one cable at its upper bound and one at its lower bound
    torques = np.array([[5.0, 45.0], [45.0, 5.0]]) @ pose.length_jacobian[:, 0]
    forces = torques / (pose.jacobian[:3, 0] @ along)
    np.testing.assert_allclose(np.sort(polytope.vertices @ along), np.sort(forces), rtol=1e-9)


def test_a_pair_holds_a_segment_of_forces() -> None:
    pose = hinge(hole_radius=0.02).at([0.0])
    polytope = cdsm.force_polytope(pose, 10.0, 110.0)
    # one cable 110 N, the other 10 N, on 20 mm; the tip is 100 mm away
    assert polytope.radius == pytest.approx(100.0 * 0.02 / 0.1, rel=1e-9)
    assert sorted(polytope.vertices[:, 2]) == pytest.approx([-20.0, 20.0])
    assert len(polytope.unbounded) == 2


PUSHED = (0.0, 0.0, -100.0, 0.0, 0.0, 0.0)
REFUSED: list[tuple[Callable[[cdsm.Posture], object], type[cdsm.CdsmError], str]] = [
    (lambda p: cdsm.force_polytope(p, 15.0), cdsm.InvalidInput, "maximum: cable1_1 has none"),
    (lambda p: cdsm.force_polytope(p, 15.0, 20.0, PUSHED), cdsm.InfeasibleTension, "N m"),
    (lambda p: cdsm.payload(p, "z", 15.0, deflection=-1.0), cdsm.InvalidInput, "deflection"),
    (lambda p: cdsm.clearance(p, 0.0, -1e-3), cdsm.InvalidInput, "thickness"),
]


@pytest.mark.parametrize(("ask", "error", "said"), REFUSED)
def test_bad_input_is_named(
    ask: Callable[[cdsm.Posture], object], error: type[cdsm.CdsmError], said: str
) -> None:
    with pytest.raises(error, match=said):
        ask(cdsm.presets.virtual_prototype().at(np.zeros(10)))

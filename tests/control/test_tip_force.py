"""Bounds of the tip force: exact without friction, and never left with it."""

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.tracking import small_path


def loaded(friction: float, force: list[float]) -> tuple[cdsm.Posture, Array]:
    """A small arm that was pulled about before a force came to rest at its tip."""
    plan = small_path(friction)
    random = np.random.default_rng(len(force))
    wrenches = np.zeros((4, 6))
    wrenches[:3, :3] = random.uniform(-4.0, 4.0, (3, 3))
    wrenches[3, :3] = force
    history = cdsm.load_cycle(plan.arm.at(plan.angles[0]), plan.tensions[0], wrenches)
    return history.pose(3), np.array([T[3, 0] for T in history.tensions])


@pytest.mark.parametrize("u", ["x", "y", "-z"])
def test_without_friction_the_bounds_are_the_force(u: str) -> None:
    force = [0.4, -0.8, -1.5]
    pose, F = loaded(0.0, force)
    found = cdsm.tip_force(pose, F, u)
    along = float(found.direction @ force)
    assert found.low == pytest.approx(along, abs=1e-5)
    assert found.high == pytest.approx(along, abs=1e-5)


def test_an_error_of_the_load_cells_widens_the_bounds_by_as_much_as_it_can() -> None:
    """The dual of a small program: the largest error that some noise of this size makes."""
    pose, F = loaded(0.0, [0.0, 0.0, -1.0])
    found = cdsm.tip_force(pose, F, "z", error=0.1)
    random = np.random.default_rng(0)
    J, g = pose.length_jacobian, pose.gravity_torque
    worst = 0.0
    for _ in range(400):
        noise = random.uniform(-0.1, 0.1, F.size)
        f, left, *_ = np.linalg.lstsq(pose.jacobian[:3].T, (F + noise) @ J + g, rcond=None)
        worst = max(worst, abs(f[2] + 1.0)) if not left.size or left[0] < 1e-20 else worst
    assert found.low < -1.0 - worst
    assert found.high > -1.0 + worst
    assert found.high - found.low < 2.0


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.2])
def test_force_is_within_its_bounds_whatever_came_before(friction: float) -> None:
    force = [0.3, -0.5, -1.0]
    pose, F = loaded(friction, force)
    noise = np.random.default_rng(1).uniform(-0.5, 0.5, F.size)
    for u in "xyz":
        for error, measured in ((0.0, F), (0.5, F + noise)):
            found = cdsm.tip_force(pose, measured, u, error)
            assert found.low - 1e-6 <= force["xyz".index(u)] <= found.high + 1e-6
    narrow = cdsm.tip_force(pose, F, "z")
    assert narrow.high - narrow.low > 1e-3
    assert "whatever friction holds" in str(narrow)


def test_tensions_of_another_posture_are_refused() -> None:
    pose, F = loaded(0.0, [0.0, 0.0, -1.0])
    with pytest.raises(cdsm.InvalidInput, match="posture is wrong"):
        cdsm.tip_force(pose.arm.at(pose.q + 0.1), F, "z")

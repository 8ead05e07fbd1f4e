"""Belts, joint pulleys, full turns and lift-off: cables over pulleys that are known by hand."""

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Site
from tests.support.pulleys import Link, arm_of

ONE = np.ones(1)
HINGE = [Link("phalanx", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))]
R = 0.006


def _joint_pulley(**options: object) -> cdsm.Manipulator:
    path = [
        Site("base", (-0.03, -0.002, 0.0)),
        Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), R, **options),
        Site("phalanx", (0.03, -0.004, 0.0)),
    ]
    return arm_of(HINGE, path)


def _active(pose: cdsm.Posture) -> float:
    """H_L·F of 1 N."""
    H: float = pose.length_hessian[0, 0, 0]
    assert cdsm.stiffness(pose, ONE).active[0, 0] == pytest.approx(H, abs=1e-17)
    return H


@pytest.mark.parametrize("groove", [True, False])
@pytest.mark.parametrize("crossed", [True, False])
@pytest.mark.parametrize(
    ("r", "R", "d"), [(0.01, 0.02, 0.05), (0.02, 0.005, 0.04), (0.01, 0.01, 0.03)]
)
def test_belts(r: float, R: float, d: float, crossed: bool, groove: bool) -> None:
    """L = 2 √(d² − e²) + π (r + R) + 2 e asin(e/d), with e = R − r, or R + r of a crossed belt."""
    slide = [Link("car", "base", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), "prismatic")]
    rim = Site("base", (-r, 0.0, 0.0))
    near = Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), r, groove)
    far = Pulley("car", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0 if crossed else 1.0), R, groove)
    pose = arm_of(slide, [rim, near, far, near, rim]).at([d])
    e = R + r if crossed else R - r
    free = np.sqrt(d * d - e * e)
    exact = 2.0 * free + np.pi * (r + R) + 2.0 * e * np.arcsin(e / d)
    assert pose.cable_lengths[0] == pytest.approx(exact, abs=1e-15)
    assert pose.length_jacobian[0, 0] == pytest.approx(2.0 * free / d, abs=1e-14)
    assert _active(pose) == pytest.approx(2.0 * e * e / (d * d * free), abs=1e-12)


@pytest.mark.parametrize("angle", [-11.0, 0.0, 30.0, 90.0, 150.0, 200.0, 240.0, 255.0])
def test_a_pulley_on_the_axis_of_a_joint_has_its_radius_as_moment_arm(angle: float) -> None:
    pose = _joint_pulley().at(np.deg2rad([angle]))
    assert pose.length_jacobian[0, 0] == pytest.approx(R, abs=1e-15)
    assert abs(_active(pose)) < 1e-16
    straight = _joint_pulley().at([0.0]).cable_lengths[0]
    assert pose.cable_lengths[0] == pytest.approx(straight + R * np.deg2rad(angle), abs=1e-15)


def test_turning_the_axis_over_turns_the_side_over() -> None:
    ahead, behind = (
        arm_of(
            HINGE,
            [
                Site("base", (-0.03, 0.0, 0.0)),
                Pulley("base", (0.0, 0.0, 0.0), (0.0, 0.0, sign), R),
                Site("phalanx", (0.03, 0.0, 0.0)),
            ],
        ).at([sign * 0.3])
        for sign in (1.0, -1.0)
    )
    assert ahead.length_jacobian[0, 0] == pytest.approx(R, abs=1e-15)
    assert behind.length_jacobian[0, 0] == pytest.approx(-R, abs=1e-15)


def test_whole_turns_add_their_circumference() -> None:
    plain, wound = (_joint_pulley(turns=turns).at([0.4]) for turns in (0, 2))
    more = wound.cable_lengths - plain.cable_lengths
    np.testing.assert_allclose(more, 4.0 * np.pi * R, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(wound.length_jacobian, plain.length_jacobian)


def test_at_lift_off_moment_arms_are_continuous_and_the_stiffness_jumps() -> None:
    """H_L falls by (1/ℓ₁ + 1/ℓ₂) w², with the motion w of the straight cable at the pulley."""
    arm = _joint_pulley()
    arrival = np.arctan2(-0.002, -0.03) + np.arccos(R / np.hypot(0.03, 0.002))
    departure = np.arctan2(-0.004, 0.03) - np.arccos(R / np.hypot(0.03, 0.004))
    lift_off = arrival - departure  # there the tangents from both sites are one line
    assert np.rad2deg(lift_off) == pytest.approx(-11.5367, abs=1e-4)
    lifted, touching = (arm.at([lift_off + step]) for step in (-1e-7, 1e-7))
    assert abs(touching.length_jacobian - lifted.length_jacobian)[0, 0] < 1.5e-9
    first, second = (np.sqrt(0.03**2 + y**2 - R * R) for y in (0.002, 0.004))
    w = first * second / (first + second)
    assert _active(touching) == pytest.approx(0.0, abs=1e-9)
    assert _active(lifted) == pytest.approx(-(1.0 / first + 1.0 / second) * w**2, abs=1e-6)
    assert _active(lifted) == pytest.approx(-0.014780, abs=2e-6)

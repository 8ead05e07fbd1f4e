"""Stiffness: singular, unstable, and infinite in some direction."""

import numpy as np
import pytest

import cdsm
from tests.support.arms import STEEL, random_arm, random_posture, random_tension


def brink() -> cdsm.Stiffness:
    """At the very tension at which an arm on soft cables without weight buckles, by bisection."""
    law = cdsm.LinearElasticity(50.0)
    arm = cdsm.Manipulator(random_arm(3, 3).geometry, law, gravity=(0.0, 0.0, 0.0))
    pose = random_posture(arm, 1)
    unit = random_tension(arm, 1)

    def at(scale: float) -> cdsm.Stiffness:
        return cdsm.stiffness(pose, scale * unit)

    low, high = 0.0, 1.0
    while at(high).margin > 0.0:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if at(middle).margin > 0.0 else (low, middle)
    return min((at(low), at(high)), key=lambda K: abs(K.margin))


def test_stiffness_on_the_brink_of_buckling_is_singular_and_still_prints() -> None:
    brittle = brink()
    assert abs(brittle.margin) < 1e-13 * abs(brittle.joint).max()
    for call in (
        lambda: brittle.compliance,
        lambda: brittle.cartesian,
        lambda: brittle.along((0.0, 0.0, 1.0)),
        lambda: brittle.shares((0.0, 0.0, 1.0)),
    ):
        with pytest.raises(cdsm.SingularStiffness, match="buckle") as caught:
            call()
        # the same motion, up to its sign
        assert abs(caught.value.direction @ brittle.critical_direction) == pytest.approx(1.0)
        assert np.linalg.norm(caught.value.direction) == pytest.approx(1.0)
    assert "nan" not in str(brittle)
    assert np.isfinite(brittle.pseudoinverse()).all()


def test_a_joint_held_by_nothing_has_no_compliance() -> None:
    geometry = cdsm.Geometry(
        name="flat",
        base_length=0.02,
        hole_radius=0.03,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), disk_offset=0.01),),
        links=(cdsm.Link(length=0.04, mass=0.0),),
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    pose = cdsm.Manipulator(geometry, STEEL).at([0.0, 0.0])
    with pytest.raises(cdsm.SingularStiffness, match="nothing holds") as caught:
        _ = cdsm.stiffness(pose, [0.0]).compliance
    np.testing.assert_array_equal(caught.value.direction, [1.0, 0.0])


def nearly_flat(size: float) -> cdsm.Stiffness:
    """All but straight beyond a bent first joint: the tip moves along the arm ever less."""
    arm = cdsm.Manipulator(random_arm(1, 3).geometry, cdsm.LinearElasticity(48e3))
    q = size * np.array([0.0, 0.0, 1.0, -0.7, 0.3, 0.5])
    q[:2] = 0.3, 0.25
    return cdsm.stiffness(arm.at(q), np.full(len(arm.cables), 50.0))


def test_cartesian_stiffness_is_accurate_up_to_where_it_is_refused() -> None:
    for size in (1e-2, 1e-4, 2e-5):
        stiff = nearly_flat(size)
        # softest first; the two soft ones must not drown beside the stiff one
        ours = np.sort(np.linalg.eigvalsh(stiff.cartesian))
        soft = 1.0 / np.sort(np.linalg.eigvalsh(stiff.compliance[:3, :3]))[::-1]
        np.testing.assert_allclose(ours[:2], soft[:2], rtol=1e-3)
    for size in (1e-6, 1e-8, 1e-10):
        stiff = nearly_flat(size)
        for read in (lambda s=stiff: s.cartesian, stiff.pseudoinverse):
            with pytest.raises(cdsm.SingularStiffness, match="cannot move along"):
                read()
        assert np.isfinite(stiff.along((0.0, 1.0, 0.0)))

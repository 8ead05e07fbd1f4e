"""A tensegrity that was built and measured: its tensions and its lowest mode, nothing fitted."""

import numpy as np
import pytest
import tensegrity_simplex as simplex

import cdsm
from cdsm.statics import Equilibrium


@pytest.fixture(scope="module")
def rest() -> Equilibrium:
    return simplex.at_rest()


def test_tensions_follow_from_the_lengthened_struts(rest: Equilibrium) -> None:
    """Feron et al. 2023: −1.5 kN in the struts; an independent program: −1501, 593 and 970 N."""
    np.testing.assert_allclose(rest.tension[:6], 593.0, atol=0.5)
    np.testing.assert_allclose(rest.tension[6:9], 970.0, atol=0.5)
    np.testing.assert_allclose(rest.tension[9:], 1501.0, atol=0.5)
    assert rest.stable


def test_self_stress_of_the_unloaded_simplex() -> None:
    """Their ratios to the force in the struts: 0.393 in horizontal, 0.681 in diagonal cables."""
    pose = simplex.simplex().at(np.zeros(12))
    stress = np.linalg.svd(pose.length_jacobian.T)[2][-1]
    np.testing.assert_allclose(stress[:6] / stress[9], 0.393, atol=5e-4)
    np.testing.assert_allclose(stress[6:9] / stress[9], 0.681, atol=5e-4)


def test_lowest_mode_is_carried_by_tension(rest: Equilibrium) -> None:
    """Feron et al. 2023, lumped masses: 2.166 Hz, a twist that sinks; the next mode at 34 Hz."""
    modes = cdsm.modes(rest.pose, rest.stiffness)
    np.testing.assert_allclose(modes.frequencies[0], 2.166, rtol=5e-4)
    np.testing.assert_allclose(modes.frequencies[1], 34.4, rtol=5e-3)
    assert simplex.active_share(rest) == pytest.approx(0.81, abs=5e-3)


def test_shape_of_the_lowest_mode(rest: Equilibrium) -> None:
    """Theirs: the heads move by (3.3, 0, −1), (−1.7, −2.9, −1) and (−1.7, 2.9, −1)."""
    arm, q = rest.pose.arm, rest.pose.q
    shape = cdsm.modes(rest.pose, rest.stiffness).shapes[:, 0]
    heads = [f"head{n}" for n in (3, 4, 5)]
    step = 1e-6
    moved = np.array(
        [
            arm.at(q + step * shape).link_pose(head)[:3, 3]
            - arm.at(q - step * shape).link_pose(head)[:3, 3]
            for head in heads
        ]
    )
    moved /= -moved[:, 2].mean()
    radii = np.linalg.norm(moved[:, :2], axis=1)
    np.testing.assert_allclose(moved[:, 2], -1.0, atol=0.02)
    np.testing.assert_allclose(radii, 3.3, atol=0.1)

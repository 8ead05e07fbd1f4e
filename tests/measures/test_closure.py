"""Tension factor, wrench closure and isotropy against closed forms."""

import numpy as np
import pytest

import cdsm
from tests.support.arms import prototype, random_arm, random_posture, readme_geometry


def one_joint(angles: tuple[float, ...]) -> cdsm.Manipulator:
    geometry = cdsm.Geometry.universal(
        joints=1, hole_angles=angles, link_length=0.1, base_length=0.02, disk_offset=0.01,
        hole_radius=0.02, link_mass=0.1, friction=0.1, lead=0.1,
    )  # fmt: skip
    return cdsm.Manipulator(geometry, cdsm.presets.ELASTIC_STAGE)


@pytest.mark.parametrize("seed", range(5))
def test_one_more_cable_than_joints_has_one_ratio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    uneven = rng.uniform(-0.5, 0.5, 3) * (seed > 0)  # three even cables pull alike
    arm = one_joint(tuple(np.deg2rad([10.0, 130.0, 250.0]) + uneven))
    pose = arm.at(rng.uniform(-0.3, 0.3, 2) * (seed > 0))
    null = np.linalg.svd(pose.length_jacobian.T)[2][-1]
    assert (null > 0.0).all() or (null < 0.0).all()
    # CASPR's TensionFactorMetric, and that of Pham et al., is this ratio
    assert seed or cdsm.tension_factor(pose) == pytest.approx(1.0)
    assert cdsm.tension_factor(pose) == pytest.approx(abs(null).min() / abs(null).max(), rel=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_no_search_finds_more_even_tensions(seed: int) -> None:
    pose = random_posture(random_arm(seed, 2), seed)
    factor = cdsm.tension_factor(pose)
    null = np.linalg.svd(pose.length_jacobian.T)[2][pose.arm.nv :]
    tried = np.random.default_rng(seed).normal(size=(100_000, len(null))) @ null
    ratios = tried.min(axis=1) / tried.max(axis=1)
    best = ratios[(tried > 0.0).all(axis=1)].max(initial=0.0)
    assert best <= factor + 1e-9
    assert best > 0.7 * factor


@pytest.mark.parametrize("degrees", [(-40.0, 0.0, 40.0), (0.0, 180.0)])
def test_cables_on_one_side_or_in_one_plane_close_nothing(degrees: tuple[float, ...]) -> None:
    pose = one_joint(tuple(np.deg2rad(degrees))).at([0.0, 0.0])
    assert cdsm.tension_factor(pose) == 0.0


def test_isotropy_is_the_ratio_of_extremes() -> None:
    K = cdsm.stiffness(*prototype())
    values = 1.0 / np.linalg.eigvalsh(K.compliance[:3, :3])
    assert cdsm.isotropy(K) == pytest.approx(values.min() / values.max(), rel=1e-10)
    arm = cdsm.Manipulator(readme_geometry(), cdsm.LinearElasticity(1e3))
    buckled = cdsm.stiffness(arm.at(np.zeros(arm.nv)), 500.0 * np.ones(len(arm.cables)))
    with pytest.raises(cdsm.InvalidInput, match="has no isotropy: UNSTABLE"):
        cdsm.isotropy(buckled)

"""Where more tension stops paying, against differences of the stiffness itself."""

import numpy as np
import pytest

import cdsm
from tests.arms import random_posture

Z = np.array([0.0, 0.0, 1.0])


def test_beyond_saturation_tension_pays_less_than_the_fraction() -> None:
    arm = cdsm.presets.virtual_prototype()
    pose = random_posture(arm, 5)
    found = cdsm.saturation(pose, Z, fraction=0.1)

    def slope(lower: float, step: float = 1e-3) -> float:
        up, down = (
            cdsm.stiffness(pose, cdsm.distribute_tension(pose, b)).along(Z)
            for b in (lower + step, lower - step)
        )
        return (up - down) / (2.0 * step)

    assert "pays less than 10 %" in str(found)
    assert slope(found.bound) == pytest.approx(0.1 * found.steepest_slope, rel=1e-4)
    assert max(found.curve[:, 2]) <= found.steepest_slope * (1.0 + 1e-9)

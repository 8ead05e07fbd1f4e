"""Weights that pulled disks of the measured rod: what cdsm explains of them, and what not.

docs/theory/friction.md says it. Nothing here is a validation: the trials are not understood.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import cdsm
from cdsm.support.values import Array
from tests.validation import rod
from tests.validation.measured import root_mean_square

TRIALS = np.loadtxt(
    Path(__file__).parents[1] / "data" / "rod_weights.csv", delimiter=",", skiprows=3
)
ARM = cdsm.presets.rod_one_tendon()
AXES = rod.axes_of_camera()


def off(disk: int, share: float = 1.0, roll: float = 0.0, shift: int = 0) -> Array:
    """Predicted minus measured place (n, 2, 3) [mm] of the pulled disk and of the tip.

    ``share`` of the weight pulls, the rod has turned by ``roll`` about its axis since the tensions
    were measured without weights, and the load is on a disk ``shift`` further out.
    """
    c, s = np.cos(roll), np.sin(roll)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]]) @ AXES
    errors = []
    for _, mass, tension, *numbers in TRIALS[TRIALS[:, 0] == disk]:
        direction, base, *points = np.reshape(numbers, (4, 3))
        force = share * mass * 9.81e-3 * (axes @ direction)
        load = {f"disk{disk + shift}": [*force, 0.0, 0.0, 0.0]}
        rest = cdsm.forward_statics(ARM, tension=[tension], wrench=load)
        computed = rod.disk_centres(rest.pose)[[disk, 10]]
        errors.append(computed - (np.array(points) - base) @ axes.T)
    return np.array(errors)


@pytest.mark.parametrize(("disk", "expected"), [(9, 26.3), (7, 40.0)])
def test_weights_are_explained_in_part(disk: int, expected: float) -> None:
    assert root_mean_square(off(disk)) == pytest.approx(expected, abs=0.1)


@pytest.mark.long
@pytest.mark.parametrize(
    ("disk", "share", "roll", "expected"), [(9, 0.732, -15.0, 20.3), (7, 0.731, -19.6, 23.0)]
)
def test_less_pull_and_a_roll_explain_more(
    disk: int, share: float, roll: float, expected: float
) -> None:
    """Their own estimator takes 0.7365 of each weight, without a reason."""
    fit = least_squares(lambda x: off(disk, *x).ravel(), [1.0, 0.0], diff_step=1e-3)
    np.testing.assert_allclose(fit.x, [share, np.deg2rad(roll)], atol=0.02)
    assert root_mean_square(off(disk, *fit.x)) == pytest.approx(expected, abs=0.2)

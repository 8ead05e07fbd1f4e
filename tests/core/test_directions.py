"""A direction is an axis by name, or a vector: everywhere the same."""

import numpy as np
import pytest

import cdsm
from cdsm.support.directions import AXES, unit_directions
from tests.support.sweeps import short_arm

ARM = short_arm()
POSE = ARM.at(np.full(ARM.nv, 0.1))
PULL = cdsm.distribute_tension(POSE, minimum=20.0)
K = cdsm.stiffness(POSE, PULL)


def test_axes_are_unit_vectors_in_pairs() -> None:
    for axis, vector in AXES.items():
        assert np.linalg.norm(vector) == 1.0
        assert vector["xyz".index(axis[-1])] == (-1.0 if axis[0] == "-" else 1.0)
    np.testing.assert_array_equal(
        unit_directions("u", ["z", (0.0, 2.0, 0.0)]), [[0, 0, 1], [0, 1, 0]]
    )


def test_several_axes_name_the_dimension_of_a_sweep() -> None:
    found = cdsm.sweep(
        ARM, [POSE.q], minimum=20.0, direction=["z", "-y"], outputs=["along"], progress=False
    )
    assert found.direction.values.tolist() == ["z", "-y"]
    np.testing.assert_allclose(found.along.values.ravel(), [K.along("z"), K.along("y")], rtol=1e-12)


@pytest.mark.parametrize("wrong", ["up", "Z", "", "xy"])
def test_a_wrong_axis_is_told_what_is_allowed(wrong: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"direction: .* give x, y, z, -x, -y, -z or three"):
        K.along(wrong)

"""A direction is an axis by name, or a vector: everywhere the same."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.directions import AXES, unit_directions
from tests.support.sweeps import short_arm

ARM = short_arm()
POSE = ARM.at(np.full(ARM.nv, 0.1))
PULL = cdsm.distribute_tension(POSE, minimum=20.0)
K = cdsm.stiffness(POSE, PULL)

ASKED: dict[str, Callable[[Any], Any]] = {
    "along": K.along,
    "shares": lambda u: K.shares(u).cables,
    "range": lambda u: cdsm.stiffness_range(POSE, u, 20.0, 100.0, starts=2).low,
    "plan": lambda u: cdsm.plan_stiffness(POSE, u, 1.02 * K.along(u), 20.0).tension.values,
    "path": lambda u: (
        cdsm.plan_path(ARM, u, 1.02 * K.along(u), 20.0, angles=[POSE.q], progress=False).tensions
    ),
    "saturation": lambda u: cdsm.saturation(POSE, u, 20.0, 40.0).steepest_slope,
    "gradient": lambda u: cdsm.stiffness_gradient(K).along(u),
    "batch": lambda u: cdsm.evaluate(ARM, [POSE.q], [PULL.values], outputs=["along"], direction=u)[
        "along"
    ],
    "sweep": lambda u: (
        cdsm.sweep(
            ARM, [POSE.q], minimum=20.0, direction=u, outputs=["along"], progress=False
        ).along.values
    ),
    "measurement": lambda u: np.array(
        cdsm.Measurement(
            value=1.0,
            direction=u,
            angles=(0.1,),
            minimum=1.0,
            std=0.1,
        ).direction
    ),
}


@pytest.mark.parametrize("axis", ["y", "-z"])
@pytest.mark.parametrize("asked", ASKED)
def test_an_axis_is_its_vector(asked: str, axis: str) -> None:
    ask = ASKED[asked]
    np.testing.assert_array_equal(ask(axis), ask(AXES[axis]))


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

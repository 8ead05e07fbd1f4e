"""Cosine and sine of a block of angles, compared with the C library."""

import math

import numpy as np

from cdsm._former.trigonometry import set_cosine_sine
from cdsm.support.values import Array
from tests.support.kernels import from_python

KERNEL = from_python(set_cosine_sine)


def cosine_sine(angle: Array) -> tuple[Array, Array]:
    cosine, sine = np.empty_like(angle), np.empty_like(angle)
    KERNEL(angle, cosine, sine, angle.size)
    return cosine, sine


def test_error_is_below_one_unit_in_the_last_place_of_one() -> None:
    rng = np.random.default_rng(0)
    near, far = rng.uniform(-np.pi, np.pi, 20_000), rng.uniform(-2e5, 2e5, 20_000)
    quarters = np.arange(-400.0, 401.0) * np.pi / 4.0
    angles: tuple[Array, ...] = (near, far, quarters, np.array([0.0, 5e-324, 1e-300, 1e300]))
    for angle in angles:
        cosine, sine = cosine_sine(angle)
        # the C library is within half a unit, which is 1.1e-16 below one
        assert abs(cosine - [math.cos(each) for each in angle]).max() <= 1.2e-16
        assert abs(sine - [math.sin(each) for each in angle]).max() <= 1.2e-16


def test_small_angles_keep_their_digits() -> None:
    angle = np.logspace(-300.0, -1.0, 1000) * np.array([[1.0], [-1.0]])
    sine = cosine_sine(angle.ravel())[1].reshape(angle.shape)
    np.testing.assert_allclose(sine, np.sin(angle), rtol=2.3e-16, atol=0.0)

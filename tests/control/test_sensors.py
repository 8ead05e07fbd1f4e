"""Sensors: counts, noise within its bound, delay, and the same bits for the same seed."""

import numpy as np
import pytest

import cdsm
from cdsm.control import Measurement

TRUTH = [Measurement(np.full(3, 0.1234567 * k), np.full(3, 50.0 + k)) for k in (1, 2, 3)]


def test_encoders_count_and_are_half_a_count_off_at_most() -> None:
    reading = cdsm.Sensors(encoder=1e-4).measure(TRUTH, np.random.default_rng(0))
    np.testing.assert_allclose(
        reading.paid_out / 1e-4, np.round(reading.paid_out / 1e-4), atol=1e-9
    )
    assert 0.0 < abs(reading.paid_out - TRUTH[-1].paid_out).max() <= 0.5e-4


def test_noise_and_bias_stay_within_their_bound() -> None:
    sensors = cdsm.Sensors(tension_noise=0.5, tension_bias=-1.0)
    random = np.random.default_rng(1)
    errors = np.array([sensors.measure(TRUTH, random).tension for _ in range(4000)]) - 53.0
    assert errors.mean() == pytest.approx(-1.0, abs=0.02)
    assert errors.std() == pytest.approx(0.5, rel=0.02)
    assert abs(errors).max() <= 3.0


def test_readings_are_late_by_the_delay() -> None:
    for delay, wanted in ((0, 53.0), (1, 52.0), (2, 51.0), (9, 51.0)):
        reading = cdsm.Sensors(delay=delay).measure(TRUTH, np.random.default_rng(0))
        assert reading.tension[0] == wanted

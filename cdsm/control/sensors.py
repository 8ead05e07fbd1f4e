"""Encoders and load cells with quantisation, noise, bias and delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, final

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.validation import quantity, scalar, whole_number
from cdsm.support.values import Array

LARGEST_NOISE: Final = 4.0
"""Number of standard deviations at which noise is cut off."""


class Measurement(NamedTuple):
    """Values at the motors at one step, as measured or true.

    Attributes:
        paid_out: l_0 paid out by each motor (C,) [m], from its encoder.
        tension: F at each motor (C,) [N].
    """

    paid_out: Array
    tension: Array


@final
@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Sensors of all motors: an encoder for the wire and a load cell for the tension.

    Encoders count from where the cable is just taut (zero strain) at a known posture, so they
    measure the rest length l_0 that is paid out.

    Attributes:
        encoder: Length [m] of one count of an encoder; 0: exact.
        tension_noise: Standard deviation [N] of the Gaussian noise of a load cell, which is cut off
            at ± four standard deviations.
        tension_bias: Constant error of all load cells [N].
        delay: Number of control steps by which all measurements are late.
        seed: Seed of the noise: the same seed gives the same noise in each run.

    Raises:
        InvalidInput: A value is negative or not a number, or delay or seed are not whole numbers.
    """

    encoder: float = 1e-5
    tension_noise: float = 0.0
    tension_bias: float = 0.0
    delay: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if not scalar("encoder", self.encoder) >= 0.0:
            raise InvalidInput("encoder", f"{self.encoder:g} m given; 0 or more is needed.")
        quantity("tension_noise", self.tension_noise, "force", zero=True)
        scalar("tension_bias", self.tension_bias)
        whole_number("delay", self.delay, 0)
        whole_number("seed", self.seed, 0)

    def measure(
        self, true_values: Sequence[Measurement], random: np.random.Generator
    ) -> Measurement:
        """Measure the newest of the ``true_values``, or an earlier one if there is a delay.

        The noise is drawn from ``random``; each call draws the same number of random numbers.
        """
        now = true_values[max(len(true_values) - 1 - int(self.delay), 0)]
        counted = now.paid_out
        if self.encoder:
            counted = self.encoder * np.round(counted / self.encoder)
        draws = np.clip(random.standard_normal(counted.size), -LARGEST_NOISE, LARGEST_NOISE)
        return Measurement(counted, now.tension + self.tension_bias + self.tension_noise * draws)

"""Encoders and load cells with quantisation, noise, bias and delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, final

import numpy as np

from cdsm.control.laws import Reading
from cdsm.errors import InvalidInput
from cdsm.support.validation import quantity, scalar, whole_number

LARGEST_NOISE: Final = 4.0
"""Number of standard deviations at which noise is cut off."""


@final
@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Sensors of all motors: an encoder for the wire and a load cell for the tension.

    Encoders count from where the cable is just taut (zero strain) at a known posture, so they read
    the unstretched length l_0 that is paid out.

    Attributes:
        encoder: Length [m] of one count of an encoder; 0: exact.
        tension_noise: Standard deviation [N] of the Gaussian noise of a load cell, which is cut off
            at ± four standard deviations.
        tension_bias: Constant error of all load cells [N].
        delay: Number of control steps by which all readings are late.

    Raises:
        InvalidInput: A value is negative or not a number, or the delay is not a whole number.
    """

    encoder: float = 1e-5
    tension_noise: float = 0.0
    tension_bias: float = 0.0
    delay: int = 0

    def __post_init__(self) -> None:
        encoder = scalar("encoder", self.encoder)
        if encoder < 0.0:  # any fineness is good
            raise InvalidInput("encoder", f"{encoder:g} m given; 0 or more is needed.")
        noise = quantity("tension_noise", self.tension_noise, "force", zero=True)
        # the class is frozen: plain assignment is refused
        self.__dict__.update(
            encoder=encoder,
            tension_noise=noise,
            tension_bias=scalar("tension_bias", self.tension_bias),
            delay=whole_number("delay", self.delay, 0),
        )

    def read(self, truth: Sequence[Reading], random: np.random.Generator) -> Reading:
        """Measure the newest of the true values ``truth``, or an earlier one if there is a delay.

        The noise is drawn from ``random``; each call draws the same number of random numbers.
        """
        now = truth[max(len(truth) - 1 - self.delay, 0)]
        wire = now.wire
        if self.encoder:
            wire = self.encoder * np.round(wire / self.encoder)
        draws = np.clip(random.standard_normal(wire.size), -LARGEST_NOISE, LARGEST_NOISE)
        return Reading(wire, now.tension + self.tension_bias + self.tension_noise * draws)

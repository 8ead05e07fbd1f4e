"""The measured stiffness of an arm, as input of an identification."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.directions import Axis, axis_vector, unit_direction
from cdsm.support.validation import SMALLEST, number_array, scalar, vector, wrench_vector

if TYPE_CHECKING:
    from cdsm.identification.loop import WeightLoop


@final
@dataclass(frozen=True)
class Measurement:
    """Stiffness measured at the tip of a real arm, and the conditions of the measurement.

    Attributes:
        value: Stiffness along the direction [N/m]: force divided by the displacement of the tip
            along it.
        direction: Common direction of force and displacement: an axis such as ``"z"``, kept as its
            vector, or (3,) in base axes, any length. With a ``force`` the sign matters: ``"-z"``
            hangs a weight, ``"z"`` lifts the tip.
        angles: Joint angles (nv,) [rad].
        tension: Cable tensions (C,) [N]. Give either ``tension`` or ``minimum``.
        minimum: Lower bound of the tensions [N], one number or (C,).
            :func:`~cdsm.distribute_tension` then balances the model at these angles.
        std: Standard deviation of the value [N/m]; it is required.
        wrench: W (6,) at ``tool0`` without the measuring force, base axes: force [N], moment [N m].
        label: Name in reports and figures.
        force: Magnitude of the measuring force [N], added to ``wrench``. The value is then the
            secant of :func:`~cdsm.weight_test`, with motors locked at these angles and tensions.
            0 means a small force: the value is the tangent.

    Raises:
        InvalidInput: A field is invalid. The error names the field and the fault.
    """

    value: float
    direction: tuple[float, float, float] | Axis
    angles: tuple[float, ...]
    tension: tuple[float, ...] | None = None
    minimum: float | tuple[float, ...] | None = None
    std: float = math.nan
    wrench: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    label: str = ""
    force: float = 0.0

    def __post_init__(self) -> None:
        value = scalar("value", self.value)
        if value <= 0.0:
            raise InvalidInput("value", f"{value:g} N/m given; a stiffness measured is positive.")
        if isinstance(self.std, float) and math.isnan(self.std):
            raise InvalidInput(
                "std",
                "is missing; give the standard deviation of the value [N/m], a guess at it "
                "if need be: it is the weight of the measurement.",
            )
        std = scalar("std", self.std)
        if std < SMALLEST:
            raise InvalidInput("std", f"{std:g} N/m given; it must be positive.")
        force = scalar("force", self.force)
        if force < 0.0:
            raise InvalidInput(
                "force",
                f"{force:g} N given; it must be positive, or 0 for the tangent. Turn the direction "
                "round instead.",
            )
        checked = checked_conditions(self) | {"value": value, "std": std, "force": force}
        for name, entry in checked.items():
            object.__setattr__(self, name, entry)


def checked_conditions(given: Measurement | WeightLoop) -> dict[str, object]:
    """Check label, direction, wrench, angles and tensions of a measurement or a loop.

    Returns the last four by field name, as tuples of numbers; ``minimum`` may be one number. Raises
    InvalidInput.
    """
    if (given.tension is None) == (given.minimum is None):
        raise InvalidInput(
            "tension",
            "give one of tension= (measured, of each cable) and minimum= (a bound to "
            f"distribute from); {'neither' if given.tension is None else 'both'} given.",
        )
    if not isinstance(given.label, str):
        raise InvalidInput("label", f"{given.label!r} given; a text is needed.")
    direction: ArrayLike = given.direction
    if isinstance(direction, str):
        direction = axis_vector("direction", direction)
    unit_direction("direction", direction)
    checked: dict[str, object] = {
        "direction": tuple(vector("direction", direction, 3, "a direction in base axes").tolist()),
        "wrench": tuple(wrench_vector("wrench", given.wrench).tolist()),
        "angles": _numbers("angles", given.angles, "one angle [rad] per joint"),
    }
    if given.tension is not None:
        checked["tension"] = _numbers("tension", given.tension, "one tension [N] per cable")
    elif np.ndim(given.minimum) == 0:  # type: ignore[arg-type]
        checked["minimum"] = scalar("minimum", given.minimum)
    else:
        checked["minimum"] = _numbers("minimum", given.minimum, "one bound [N] per cable")
    return checked


def _numbers(name: str, value: object, meaning: str) -> tuple[float, ...]:
    array = number_array(name, value)  # type: ignore[arg-type]
    if array.ndim != 1 or not array.size:
        raise InvalidInput(name, f"shape {array.shape} given; give {meaning}.")
    return tuple(array.tolist())


def label(i: int, measurement: Measurement | WeightLoop) -> str:
    """Return the name of measurement number ``i``: its label, or "[i]" if it has none."""
    return measurement.label or f"[{i}]"

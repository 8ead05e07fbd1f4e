"""A stiffness that was measured on a real arm, and what all measurements have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.dead_loads import Load
from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.loads import kept_loads, kept_point
from cdsm.posture import Posture
from cdsm.statics.weight_test import weight_test
from cdsm.stiffness_matrix import stiffness
from cdsm.support.format import stiffness_text
from cdsm.support.validation import (
    SMALLEST,
    Axis,
    axis_vector,
    number_array,
    positive,
    scalar,
    unit_direction,
    vector,
)
from cdsm.support.values import Array
from cdsm.tension import Tension, distribute_tension

if TYPE_CHECKING:
    from cdsm.identification.tip_position import TipPosition
    from cdsm.identification.weight_loop import WeightLoop


@final
@dataclass(frozen=True)
class Measurement:
    """Stiffness measured on a real arm, and the conditions of the measurement.

    Attributes:
        value: Stiffness along the direction [N/m]: force divided by the displacement of the tip
            along it, or of the point where the force acts.
        direction: Common direction of force and displacement: an axis such as ``"z"``, kept as its
            vector, or (3,) in base axes, any length. With a ``force`` the sign matters: ``"-z"``
            hangs a weight, ``"z"`` lifts the tip.
        angles: Joint angles (nv,) [rad].
        tension: Cable tensions (C,) [N]. Give either ``tension`` or ``minimum``.
        minimum: Lower bound of the tensions [N], one number or (C,).
            :func:`~cdsm.distribute_tension` then balances the model at these angles.
        std: Standard deviation of the value [N/m], or a guess at it: the weight of the measurement.
        wrench: W (6,) at ``tool0`` without the measuring force, base axes: force [N], moment [N m].
            Or loads on links, as for :func:`~cdsm.distribute_tension`.
        label: Name in reports and figures.
        force: Magnitude of the measuring force [N], added to ``wrench``. The value is then the
            secant of :func:`~cdsm.weight_test`, with motors locked at these angles and tensions.
            0 means a small force: the value is the tangent.
        link: Link on which the force acts and of which the displacement is read; None: the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: A field is invalid. The error names the field and the fault.

    Example:
        >>> import cdsm
        >>> test = cdsm.Measurement(2.1e3, "z", angles=(0.1,) * 10, minimum=5.0, std=50.0)
        >>> test.value
        2100.0
    """

    value: float
    direction: tuple[float, float, float] | Axis
    angles: tuple[float, ...]
    tension: tuple[float, ...] | None = None
    minimum: float | tuple[float, ...] | None = None
    std: float = field(kw_only=True)
    wrench: tuple[float, ...] | tuple[Load, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    label: str = ""
    force: float = 0.0
    link: str | None = None
    point: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        value = positive("value", self.value, "N/m")
        std = positive("std", self.std, "N/m")
        force = scalar("force", self.force)
        if force < 0.0:
            remedy = "it must be positive, or 0 for the tangent. Turn the direction round instead."
            raise InvalidInput("force", f"{force:g} N given; {remedy}")
        keep(self, value=value, std=std, force=force)

    @property
    def readings(self) -> Array:
        """Measured numbers (n,), in SI."""
        return np.array([self.value])

    @property
    def reading_suffixes(self) -> list[str]:
        """What follows the label in the name of each reading: nothing, since there is one."""
        return [""]

    def predict(self, pose: Posture, tension: Tension | ArrayLike) -> Array:
        """Compute the stiffness (1,) [N/m] that a model of the arm would show."""
        K = stiffness(pose, tension, None if isinstance(tension, Tension) else self.wrench)
        if not K.is_stable:
            unit = pose.arm.stiffness_unit()
            problem = f"the arm buckles: the smallest stiffness is {K.margin:.3g} {unit}."
            raise SingularStiffness(problem, K.critical_direction)
        value = K.along(self.direction, self.link, self.point)
        u = unit_direction("direction", self.direction)
        if self.force:
            where: Any = {"link": self.link, "point": self.point}
            F = self.force * u
            value = weight_test(pose, K.tension, F, wrench=K.applied, **where).stiffness
        if not value < 1.0 / SMALLEST:
            what = self.link or "the tip"
            problem = f"{what} cannot move in its direction, so the stiffness is infinite."
            raise SingularStiffness(problem, u)
        return np.array([value])

    def errors(self, predicted: Array) -> tuple[Array, float]:
        """Return predicted minus measured numbers, and their standard deviation."""
        return predicted - self.value, self.std

    def described(self, measured: Array, predicted: Array) -> list[str]:
        """Return a measured and a predicted stiffness as texts."""
        return [stiffness_text(K[0]) for K in (measured, predicted)]


def tension_before(test: Measurement | WeightLoop, pose: Posture) -> Tension | ArrayLike:
    """Return the tensions of a test before its force acts: the given ones, or distributed ones."""
    if test.tension is not None:
        return test.tension
    assert test.minimum is not None
    return distribute_tension(pose, test.minimum, wrench=test.wrench)


def measurement_name(i: int, label: str) -> str:
    """Return the name of measurement number ``i``: its label, or "[i]" if it has none."""
    return label or f"[{i}]"


def keep(measurement: Measurement | WeightLoop, **fields: object) -> None:
    """Check label, direction, wrench, angles and tensions; keep them and ``own``, as numbers."""
    tension = measurement.tension
    minimum = measurement.minimum
    if (tension is None) == (minimum is None):
        raise InvalidInput(
            "tension",
            "give one of tension= (measured, of each cable) and minimum= (a bound to distribute "
            f"from); {'neither' if tension is None else 'both'} given.",
        )
    fields |= kept_fields(measurement)
    direction: ArrayLike = measurement.direction
    if isinstance(direction, str):
        direction = axis_vector("direction", direction)
    unit_direction("direction", direction)
    fields["direction"] = tuple(vector("direction", direction, 3, "in base axes").tolist())
    fields["angles"] = row_of_numbers("angles", measurement.angles, "one angle [rad] per joint")
    if tension is not None:
        fields["tension"] = row_of_numbers("tension", tension, "one tension [N] per cable")
    else:
        lowest = number_array("minimum", minimum)  # type: ignore[arg-type]
        one = lowest.ndim == 0
        row = "one bound [N], or one per cable"
        fields["minimum"] = float(lowest) if one else row_of_numbers("minimum", lowest, row)
    for name, entry in fields.items():
        object.__setattr__(measurement, name, entry)


def kept_fields(measurement: Measurement | WeightLoop | TipPosition) -> dict[str, object]:
    """Check what all measurements have; return wrench, link and point as they are kept."""
    if not isinstance(measurement.label, str):
        raise InvalidInput("label", f"{measurement.label!r} given; a text is needed.")
    link, point = kept_point(measurement.link, measurement.point)
    return {"wrench": kept_loads("wrench", measurement.wrench), "link": link, "point": point}


def row_of_numbers(name: str, value: object, meaning: str) -> tuple[float, ...]:
    """Return numbers in a row; InvalidInput says what they are."""
    array = number_array(name, value)  # type: ignore[arg-type]
    if array.ndim != 1 or not array.size:
        raise InvalidInput(name, f"shape {array.shape} given; give {meaning}.")
    return tuple(array.tolist())

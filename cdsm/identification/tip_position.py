"""Measured positions of the tip of an arm, and what its motors did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, final

import numpy as np

from cdsm.applied import position_at
from cdsm.dead_loads import Load
from cdsm.errors import InvalidInput
from cdsm.identification.measurement import kept_fields, row_of_numbers
from cdsm.loads import link_point
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.forward_statics import forward_statics
from cdsm.support.format import coordinates, without_rounding
from cdsm.support.validation import NO_WRENCH, positive, scalar
from cdsm.support.values import Array

NumbersOfCables = tuple[float, ...] | Mapping[str, float]
"""One number for each cable (C,), or numbers by the name of the cable."""

_MOTORS: Final = "pull", "rest_lengths", "tension"
_FARTHEST = 10.0  # largest distance of a tip from the base, in lengths of the arm


@final
@dataclass(frozen=True, kw_only=True)
class TipPosition:
    """Measured position of the tip of a real arm, or of a link, and what its motors did.

    The arm comes to rest as by :func:`~cdsm.forward_statics`, from the pulls, rest lengths or
    tensions of its cables, one of the three. They are (C,), or a dict by the names of cables: a
    cable that it does not name is loose.

    Attributes:
        x: Coordinate in base axes [m]; None if it was not measured. At least one is given.
        y: As x.
        z: As x.
        std: Standard deviation of a coordinate [m].
        pull: Wire that each motor reports to have taken in from the straight arm [m].
        rest_lengths: Unstrained length of the wires that the motors have left [m].
        tension: Tensions that the motors hold [N].
        wrench: W (6,) at ``tool0``, base axes: force [N], then moment [N m]. Or loads on links, as
            for :func:`~cdsm.distribute_tension`.
        label: Name in reports and figures.
        link: Link whose position was measured; None: the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: A field is invalid. The error names the field and the fault.

    Example:
        >>> import cdsm
        >>> position = cdsm.TipPosition(x=0.233, std=1e-3, pull=(0.005, 0.0, 0.0))
        >>> position.x
        0.233
    """

    x: float | None = None
    y: float | None = None
    z: float | None = None
    std: float
    pull: NumbersOfCables | None = None
    rest_lengths: NumbersOfCables | None = None
    tension: NumbersOfCables | None = None
    wrench: tuple[float, ...] | tuple[Load, ...] = NO_WRENCH
    label: str = ""
    link: str | None = None
    point: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not self.axes:
            raise InvalidInput("x", "none of x, y and z given; give the coordinates measured [m].")
        fields: dict[str, object] = {}
        for axis in self.axes:
            remedy = "Leave out a coordinate that was not measured."
            try:
                value = scalar(axis, getattr(self, axis))
            except InvalidInput as error:
                raise InvalidInput(
                    axis, f"{str(error).removeprefix(f'{axis}: ')} {remedy}"
                ) from None
            fields[axis] = value
        std = positive("std", self.std, "m")
        if len(motors := self._given) != 1:
            remedy = f"give one of {', '.join(_MOTORS)}; {' and '.join(motors) or 'none'} given."
            raise InvalidInput("pull", remedy)
        (name,) = motors
        fields |= kept_fields(self)
        fields |= {name: _numbers(name, getattr(self, name)), "std": std}
        for key, kept in fields.items():
            object.__setattr__(self, key, kept)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the coordinates that were measured."""
        return tuple(axis for axis in "xyz" if getattr(self, axis) is not None)

    @property
    def _given(self) -> list[str]:
        """Names of what the motors did that are given: one, once it is checked."""
        return [name for name in _MOTORS if getattr(self, name) is not None]

    @property
    def readings(self) -> Array:
        """Measured numbers (n,), in SI."""
        return np.array([getattr(self, axis) for axis in self.axes], dtype=np.float64)

    @property
    def conditions(self) -> tuple[object, ...]:
        """What the motors did: equal for readings of which one prediction is enough."""
        (name,) = self._given
        numbers = getattr(self, name)
        return name, tuple(numbers.items()) if isinstance(numbers, dict) else numbers, self.wrench

    def rest_posture(self, arm: Manipulator, near: Posture | None = None) -> Posture:
        """Compute where a model of the arm rests, sought from a posture ``near``."""
        (name,) = self._given
        start = None if near is None or arm.has_friction else near.q  # friction: along its path
        motors = {name: getattr(self, name)}
        return forward_statics(arm, **motors, wrench=self.wrench, start=start).pose

    def tip_coordinates(self, pose: Posture) -> Array:
        """Return the coordinates of the tip, or of a link, of a model that were measured."""
        place = position_at(pose, link_point(pose.arm, self.link, self.point))
        return place[["xyz".index(axis) for axis in self.axes]]

    def errors(self, predicted: Array) -> tuple[Array, float]:
        """Return predicted minus measured coordinates, and their standard deviation."""
        return predicted - self.readings, self.std

    @property
    def reading_suffixes(self) -> list[str]:
        """What follows the label in the name of each reading: its axis."""
        return [f" {axis}" for axis in self.axes]

    def described(self, measured: Array, predicted: Array) -> list[str]:
        """Return the measured and the predicted coordinates [mm] as texts."""
        both = [coordinates(1e3 * without_rounding(p)) for p in (measured, predicted)]
        return [f"{', '.join(self.axes)} {numbers} mm" for numbers in both]

    def require_near(self, arm: Manipulator, name: str) -> None:
        """Raise InvalidInput if the tip of an arm of this length cannot be there."""
        far = float(np.linalg.norm(self.readings))
        if far > _FARTHEST * arm.length:
            problem = f"{name} has the tip {far:.4g} m from the base, of an arm {arm.length:.4g} m "
            raise InvalidInput("measurements", f"{problem}long: mm? Give x, y, z in m.")


def _numbers(name: str, value: object) -> NumbersOfCables:
    """Return numbers of cables, (C,) or by name; InvalidInput says what they must be."""
    if isinstance(value, Mapping):
        return {cable: scalar(f"{name}[{cable!r}]", value) for cable, value in value.items()}
    return row_of_numbers(name, value, "one number per cable, or a dict by the names of cables")

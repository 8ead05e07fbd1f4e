"""Law of a spring at a joint: its torque over the joint angle, and how files describe it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, final

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Discriminator, PlainSerializer, PlainValidator, Tag

from cdsm.errors import InvalidInput, warn
from cdsm.springs.shapes import AngleFunction, Given, Power, Shape, TorqueTable
from cdsm.support import records
from cdsm.support.validation import (
    SMALLEST,
    checked_quantity,
    doubts_about_angle,
    number_array,
    positive,
    scalar,
)
from cdsm.support.values import Array

_STEEPEST = 20.0  # largest exponent of a law
_WIDEST = 1.0  # a larger scale [rad] is probably in degrees
_TURN = 2.0 * math.pi


@final
@dataclass(frozen=True, repr=False)
class SpringLaw:
    """Law of a spring at a joint: torque M [N m] over the angle `x = q − q_0` [rad] from rest.

    M(0) = 0, and M rises everywhere: `k = M′ > 0`. :meth:`power`, :meth:`table` and
    :meth:`function` make laws; ``joint_stiffness=`` and ``springs=`` take them where they take a
    number. At a prismatic joint angles are ways [m], torques forces [N] and stiffnesses in N/m.
    Laws made of equal values are equal, those of functions if the functions are the same objects.

    Attributes:
        shape: M(x), which the law is made of.
        angle: Angle `q_0` without torque [rad].

    Example:
        >>> import cdsm
        >>> law = cdsm.SpringLaw.power(stiffness=0.56, exponent=0.74, scale=0.035)
        >>> law.stiffness([0.0, 0.2]).round(3).tolist()  # the tangent at rest and at 0.2 rad
        [0.56, 0.265]
    """

    shape: Shape
    angle: float = 0.0

    @staticmethod
    def power(*, stiffness: float, exponent: float, scale: float, angle: float = 0.0) -> SpringLaw:
        """Return the law `M = k x (1 + u)^((p−1)/2)` with `u = (x/a)²`.

        Near rest it is k x, beyond the scale a it grows as `x^p`: flexures of TPU have p of 0.5 to
        0.8. A plain power with p < 1 would have an infinite tangent at rest. With p = 1 the spring
        is that of the number k, to the last digit.

        Args:
            stiffness: k [N m/rad], the tangent at rest.
            exponent: p > 0 [-].
            scale: a > 0 [rad], the angle beyond which the power rules.
            angle: `q_0` [rad].

        Raises:
            InvalidInput: A number is not positive, or ``stiffness`` is outside 1e-9 to 1e12.

        Warns:
            CdsmWarning: The scale is above 1 rad, as if it were in degrees.

        Example:
            >>> import cdsm
            >>> law = cdsm.SpringLaw.power(stiffness=0.56, exponent=0.74, scale=0.035)
            >>> law.torque([-0.2, 0.0, 0.2]).round(4).tolist()
            [-0.0709, 0.0, 0.0709]
        """
        k = checked_quantity("stiffness", stiffness, "spring")
        p = scalar("exponent", exponent)
        if not 0.0 < p <= _STEEPEST:
            problem = f"{p:g} given; a number above 0, up to {_STEEPEST:g}, is needed: with 0 or "
            raise InvalidInput("exponent", f"{problem}less, the torque does not rise.")
        a = checked_scale(scale)
        for doubt in doubts_about_angle("the scale of a spring is", a, _WIDEST):
            warn(doubt)
        return SpringLaw(Power(k, p, a), scalar("angle", angle))

    @staticmethod
    def table(angles: ArrayLike, torques: ArrayLike, *, angle: float = 0.0) -> SpringLaw:
        """Return the law through measured points: monotone cubics (PCHIP) through rest.

        Points on one side of rest alone stand for the other side too: M(−x) = −M(x). Beyond the
        ends the law is straight, with the last tangent, or a tenth of the last chord if that is
        more.

        Args:
            angles: x (n,) [rad] from rest, ascending; two or more that are not 0.
            torques: M (n,) [N m], rising; 0 at rest.
            angle: `q_0` [rad].

        Raises:
            InvalidInput: There are fewer than two points, angles do not ascend, torques do not rise
                or have another sign than their angles.

        Warns:
            CdsmWarning: Angles are beyond a turn, as if they were in degrees.

        Example:
            >>> import cdsm
            >>> law = cdsm.SpringLaw.table([0.1, 0.2, 0.4], [0.05, 0.08, 0.12])
            >>> law.torque([-0.2, 0.0, 0.3, 0.4]).round(4).tolist()
            [-0.08, 0.0, 0.1028, 0.12]
        """
        x, y = checked_points(angles, torques)
        beside = np.flatnonzero(x)
        if beside.size < 2:
            problem = f"{beside.size} points beside rest given; two or more are needed."
            raise InvalidInput("angles", f"{problem} One point is a linear spring: give k.")
        _require_rising("angles", x, x)
        _require_rising("torques", y, x)
        wrong = np.flatnonzero(np.sign(x) != np.sign(y))
        if wrong.size:
            j = int(wrong[0])
            problem = f"{y[j]:g} given at the angle {x[j]:g}; they need the same sign, and 0 at 0. "
            remedy = "Give angles from where the torque is 0, and that place as angle=."
            raise InvalidInput("torques", problem + remedy)
        for doubt in doubts_about_angle("an angle of a spring is", float(abs(x).max()), _TURN):
            warn(doubt)
        return SpringLaw(TorqueTable(tuple(x.tolist()), tuple(y.tolist())), scalar("angle", angle))

    @staticmethod
    def function(
        torque: AngleFunction,
        stiffness: AngleFunction | None = None,
        energy: AngleFunction | None = None,
        *,
        angle: float = 0.0,
    ) -> SpringLaw:
        """Return the law of a function M(x) of an array of angles [rad] from rest.

        An arm checks it at 200 angles between the limits of the joint: M must rise there, and
        ``stiffness`` and ``energy`` must belong to it. Files cannot hold it.

        Args:
            torque: M(x) [N m], of an array of any shape; M(0) = 0.
            stiffness: M′(x) [N m/rad]; None: differences of the torque, of fourth order.
            energy: `∫ M dx` [J]; None: adaptive quadrature.
            angle: `q_0` [rad].

        Raises:
            InvalidInput: A function fails, does not return one finite number for each angle, or the
                torque at rest is not 0.

        Example:
            >>> import numpy as np
            >>> import cdsm
            >>> law = cdsm.SpringLaw.function(lambda x: 0.1 * np.arctan(5.0 * x))
            >>> law.stiffness([0.0, 0.2]).round(4).tolist()
            [0.5, 0.25]
        """
        for name, value in (("torque", torque), ("stiffness", stiffness), ("energy", energy)):
            if not callable(value) and not (value is None and name != "torque"):
                raise InvalidInput(name, f"{value!r} given; a function of the angle is needed.")
        shape = Given(torque, stiffness, energy)
        rest, near = shape.torque(np.array([0.0, _NEAR]))
        if abs(rest) > _AT_REST * abs(near):
            problem = (
                f"the function returns {rest:.4g} at rest, where it must be 0. Give the angle "
            )
            raise InvalidInput("torque", problem + "without torque as angle=.")
        return SpringLaw(shape, scalar("angle", angle))

    @property
    def is_linear(self) -> bool:
        """Whether the torque is k x: a power law with exponent 1."""
        return isinstance(self.shape, Power) and self.shape.exponent == 1.0

    @property
    def exponent(self) -> float | None:
        """The exponent p [-] of a power law; None for other laws."""
        return self.shape.exponent if isinstance(self.shape, Power) else None

    @property
    def stiffness_at_rest(self) -> float:
        """Tangent k at rest [N m/rad]."""
        return float(self.shape.stiffness(np.zeros(1))[0])

    def torque(self, angle: ArrayLike) -> Array:
        """Compute M [N m] at joint angles q [rad], any shape."""
        return self.shape.torque(self._from_rest(angle))

    def stiffness(self, angle: ArrayLike) -> Array:
        """Compute the tangent `k = dM/dq` [N m/rad] at joint angles q [rad], any shape."""
        return self.shape.stiffness(self._from_rest(angle))

    def energy(self, angle: ArrayLike) -> Array:
        """Compute `∫ M dq` [J] from rest to joint angles q [rad], any shape."""
        return self.shape.energy(self._from_rest(angle))

    def scaled(self, factor: float) -> SpringLaw:
        """Return the law of ``factor`` · M; InvalidInput if the factor [-] is not positive."""
        return replace(self, shape=self.shape.scaled(positive("factor", factor)))

    def with_exponent(self, exponent: float) -> SpringLaw:
        """Return the power law with another exponent; InvalidInput for other laws."""
        if not isinstance(self.shape, Power):
            raise InvalidInput("exponent", f"{self} has none; SpringLaw.power has.")
        values = self.shape.arguments | {"exponent": exponent}
        return SpringLaw.power(**values, angle=self.angle)

    def at_angle(self, angle: float) -> SpringLaw:
        """Return the law with another angle `q_0` [rad] without torque."""
        return replace(self, angle=scalar("angle", angle))

    def fault(self, low: float, high: float) -> str:
        """Return why this is no spring between the limits of a joint [rad], or an empty text."""
        return self.shape.fault(low - self.angle, high - self.angle)

    def _from_rest(self, angle: ArrayLike) -> Array:
        return number_array("angle", angle) - self.angle

    def __repr__(self) -> str:
        kind = _NAMES[type(self.shape)]
        values = self.shape.arguments | ({"angle": self.angle} if self.angle else {})
        factor = self.shape.factor if isinstance(self.shape, Given) else 1.0
        text = ", ".join(f"{name}={value!r}" for name, value in values.items())
        return f"SpringLaw.{kind}({text})" + f".scaled({factor!r})" * (factor != 1.0)


_NAMES: Final[dict[type, str]] = {Power: "power", TorqueTable: "table", Given: "function"}
_NEAR = 1e-3  # an angle [rad] near rest, whose torque the torque at rest is compared with
_AT_REST = 1e-9


def checked_points(angles: ArrayLike, torques: ArrayLike) -> tuple[Array, Array]:
    """Return the angles (n,) [rad] and the torques (n,) [N m] of points of a spring."""
    x = number_array("angles", angles)
    y = number_array("torques", torques)
    if x.ndim != 1 or x.shape != y.shape:
        raise InvalidInput("torques", f"shapes {x.shape} and {y.shape} given; a point has both.")
    return x, y


def checked_scale(scale: object) -> float:
    """Return the scale a [rad] of a power law; InvalidInput if it is no positive angle."""
    a = scalar("scale", scale)
    if a < SMALLEST:
        raise InvalidInput("scale", f"{a:g} given; a positive angle [rad] is needed.")
    return a


def _require_rising(name: str, values: Array, angles: Array) -> None:
    """Raise InvalidInput if ``values`` at ``angles`` do not rise from one to the next."""
    if (falls := np.diff(values) <= 0.0).any():
        j = int(falls.argmax())
        pair = f"{values[j]:g} and then {values[j + 1]:g} given"
        if name == "angles":
            alike = "each once, ascending"
            raise InvalidInput(name, f"{pair}; give {alike}. Average the torques of equal ones.")
        where = f"from the angle {angles[j]:g} to {angles[j + 1]:g}"
        remedy = "A spring that falls snaps through: leave the point out, or fit_spring() a power."
        raise InvalidInput(name, f"{pair} {where}; they must rise. {remedy}")


@records.record
class _PowerKeys:
    """Keys of a power law in a file."""

    stiffness: records.Number
    exponent: records.Number
    scale: records.Number
    angle: records.Number = 0.0


@records.record
class _TableKeys:
    """Keys of a law through points in a file."""

    angles: records.Numbers
    torques: records.Numbers
    angle: records.Number = 0.0


def law_from(table: object) -> SpringLaw:
    """Return a law, given as such or by the keys of a file; GeometryError lists all faults."""
    if isinstance(table, SpringLaw):
        return table
    keys = table if isinstance(table, Mapping) else {}
    has_points = not keys.keys().isdisjoint(("angles", "torques"))
    kind, build = (_TableKeys, SpringLaw.table) if has_points else (_PowerKeys, SpringLaw.power)
    values = vars(records.parse(kind, dict(keys)))
    try:
        return build(**values)
    except InvalidInput as error:
        fault = str(error)
    raise records.CrossFaults([fault])


def law_table(law: SpringLaw, of: str = "springs") -> dict[str, Any]:
    """Return the keys from which :func:`law_from` builds an equal law; else InvalidInput.

    No file holds a function; ``of`` says in the error whose law it is.
    """
    if isinstance(law.shape, Given):
        problem = "its SpringLaw.function is Python code, which no file holds; give a SpringLaw."
        raise InvalidInput(of, f"{problem}power or SpringLaw.table, or keep the arm in Python.")
    return law.shape.arguments | ({"angle": law.angle} if law.angle else {})


_LAW: Final = "(law)"


def _number_or_law(value: object) -> str:
    return _LAW if isinstance(value, (SpringLaw, Mapping)) else records.ONE


JointSpring = Annotated[
    Annotated[records.Number, records.in_range("spring", zero=True), Tag(records.ONE)]
    | Annotated[SpringLaw, PlainValidator(law_from), PlainSerializer(law_table), Tag(_LAW)],
    Discriminator(_number_or_law),
]
"""Stiffness of a spring at a joint [N m/rad], 0 for none; or its law."""

"""Torques of springs over the angle x from rest: M(x) with M(0) = 0, k = M′ > 0, E = ∫ M dx."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.values import Array

AngleFunction = Callable[[Array], Any]
"""Function of angles x from rest, an array of any shape, which returns one of the same shape."""

_LEAST = 0.1  # of the last chord of a table: the least slope at its end, where PCHIP may be flat
_STEP = 1e-5  # of differences of a torque without stiffness [rad]
_POINTS = 200  # angles at which a function is checked
_AGREES = 0.01  # of the torque: difference of a torque from its own stiffness and energy
_EVEN = 1e-12  # a smaller fall of the torque, over its largest, is rounding


class Shape(Protocol):
    """A torque over the angle from rest; arrays may have any shape."""

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the constructor of the same name, in SI."""

    @property
    def known_from(self) -> float:
        """Smallest angle from rest whose tangent the law knows from more than an assumption."""

    def torque(self, x: Array) -> Array:
        """Compute M [N m]."""

    def stiffness(self, x: Array) -> Array:
        """Compute M′ [N m/rad]."""

    def energy(self, x: Array) -> Array:
        """Compute ∫ M dx [J] from rest."""

    def scaled(self, factor: float) -> Shape:
        """Return the shape of ``factor`` times the torque."""

    def fault(self, low: float, high: float) -> str:
        """Return why this is no spring from ``low`` to ``high``, or an empty text."""


@dataclass(frozen=True)
class Power:
    """M = k x (1 + u)^((p−1)/2), u = (x/a)²: k x near rest, and growing as x^p beyond a."""

    stiffness_at_rest: float
    exponent: float
    scale: float

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of :meth:`SpringLaw.power`."""
        k = self.stiffness_at_rest
        return {"stiffness": k, "exponent": self.exponent, "scale": self.scale}

    @property
    def known_from(self) -> float:
        """The scale; a linear spring needs none."""
        return 0.0 if self.exponent == 1.0 else self.scale

    def torque(self, x: Array) -> Array:
        """Compute M [N m]."""
        u = (x / self.scale) ** 2
        return np.asarray(self.stiffness_at_rest * x * (1.0 + u) ** ((self.exponent - 1.0) / 2.0))

    def stiffness(self, x: Array) -> Array:
        """Compute M′ [N m/rad]."""
        p = self.exponent
        u = (x / self.scale) ** 2
        return np.asarray(self.stiffness_at_rest * (1.0 + u) ** ((p - 3.0) / 2.0) * (1.0 + p * u))

    def energy(self, x: Array) -> Array:
        """Compute k a²/(p+1) ((1 + u)^((p+1)/2) − 1) [J], without loss of digits at small u."""
        p = self.exponent
        grown = np.expm1((p + 1.0) / 2.0 * np.log1p((x / self.scale) ** 2))
        return np.asarray(self.stiffness_at_rest * self.scale**2 / (p + 1.0) * grown)

    def scaled(self, factor: float) -> Self:
        """Return the shape of ``factor`` times the torque."""
        return replace(self, stiffness_at_rest=factor * self.stiffness_at_rest)

    def fault(self, low: float, high: float) -> str:
        """Return an empty text: it rises everywhere."""
        return ""


@dataclass(frozen=True)
class TorqueTable:
    """Torques at angles, through rest: monotone cubics (PCHIP), and straight beyond the ends.

    Points on one side of rest alone stand for the other side, too.
    """

    angles: tuple[float, ...]
    torques: tuple[float, ...]

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of :meth:`SpringLaw.table`."""
        return {"angles": list(self.angles), "torques": list(self.torques)}

    @property
    def known_from(self) -> float:
        """The first point beside rest of points on one side alone."""
        is_one_sided = min(self.angles) >= 0.0 or max(self.angles) <= 0.0
        return min(abs(x) for x in self.angles if x) if is_one_sided else 0.0

    @cached_property
    def _parts(self) -> tuple[Any, Any, Any, Array, Array]:
        """Torque, its derivative and its integral as polynomials; the ends and the slopes there."""
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator  # slow to import

        x = np.array(self.angles)
        y = np.array(self.torques)
        if 0.0 not in self.angles:
            at = int(np.searchsorted(x, 0.0))
            x = np.insert(x, at, 0.0)
            y = np.insert(y, at, 0.0)
        if x[0] == 0.0:
            x = np.concatenate([-x[:0:-1], x])
            y = np.concatenate([-y[:0:-1], y])
        elif x[-1] == 0.0:
            x = np.concatenate([x, -x[-2::-1]])
            y = np.concatenate([y, -y[-2::-1]])
        slope = PchipInterpolator(x, y).derivative()(x)
        chord = np.diff(y) / np.diff(x)
        slope[[0, -1]] = np.maximum(slope[[0, -1]], _LEAST * chord[[0, -1]])
        torque = CubicHermiteSpline(x, y, slope)
        return (
            torque,
            torque.derivative(),
            torque.antiderivative(),
            np.array([x[0], x[-1]]),
            np.array([slope[0], slope[-1]]),
        )

    def _split(self, x: Array) -> tuple[Array, Array, Array]:
        """Return the part of x within the table, what is beyond, and the slope there."""
        *_, ends, slopes = self._parts
        inside = np.clip(x, ends[0], ends[1])
        return inside, x - inside, np.where(x < 0.0, slopes[0], slopes[1])

    def torque(self, x: Array) -> Array:
        """Compute M [N m]."""
        inside, more, slope = self._split(x)
        return np.asarray(self._parts[0](inside) + slope * more)

    def stiffness(self, x: Array) -> Array:
        """Compute M′ [N m/rad]."""
        return np.asarray(self._parts[1](self._split(x)[0]))

    def energy(self, x: Array) -> Array:
        """Compute ∫ M dx [J] from rest."""
        inside, more, slope = self._split(x)
        torque, _, energy, *_ = self._parts
        within = energy(inside) - energy(0.0)
        return np.asarray(within + torque(inside) * more + slope * more**2 / 2.0)

    def scaled(self, factor: float) -> Self:
        """Return the shape of ``factor`` times the torque."""
        return replace(self, torques=tuple(factor * y for y in self.torques))

    def fault(self, low: float, high: float) -> str:
        """Return an empty text: it rises everywhere."""
        return ""


@dataclass(frozen=True)
class Given:
    """Functions of the user: torque, stiffness (else by differences), energy (else by quadrature).

    Shapes are equal if their functions are the same objects.
    """

    function: AngleFunction
    derivative: AngleFunction | None = None
    integral: AngleFunction | None = None
    factor: float = 1.0

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of :meth:`SpringLaw.function`."""
        named = {"torque": self.function, "stiffness": self.derivative, "energy": self.integral}
        return {name: f for name, f in named.items() if f is not None}

    @property
    def known_from(self) -> float:
        """Zero: nothing is known of where the function comes from."""
        return 0.0

    def torque(self, x: Array) -> Array:
        """Compute M [N m]; InvalidInput if the function fails."""
        return self.factor * _values("torque", self.function, x)

    def stiffness(self, x: Array) -> Array:
        """Compute M′ [N m/rad]; differences of fourth order if no function is given."""
        if self.derivative is not None:
            return self.factor * _values("stiffness", self.derivative, x)
        near, far = (self.torque(x + n * _STEP) - self.torque(x - n * _STEP) for n in (1.0, 2.0))
        return (8.0 * near - far) / (12.0 * _STEP)

    def energy(self, x: Array) -> Array:
        """Compute ∫ M dx [J] from rest; InvalidInput if a function fails."""
        if self.integral is not None:
            both = _values("energy", self.integral, np.stack([x, np.zeros_like(x)]))
            return np.asarray(self.factor * (both[0] - both[1]))

        from scipy.integrate import quad  # slow to import

        def torque(x: float) -> float:
            return float(self.torque(np.array(x)))

        tolerances: dict[str, Any] = {"epsabs": 0.0, "epsrel": 1e-12, "limit": 200}
        areas = [quad(torque, 0.0, end, full_output=1, **tolerances)[0] for end in x.ravel()]
        return np.reshape(areas, x.shape)

    def scaled(self, factor: float) -> Self:
        """Return the shape of ``factor`` times the torque."""
        return replace(self, factor=factor * self.factor)

    def fault(self, low: float, high: float) -> str:
        """Return where the torque falls, or differs from its own stiffness or energy."""
        x = np.linspace(low, high, _POINTS)
        M = self.torque(x)
        size = float(abs(M).max())
        rise = np.diff(M)
        if (falls := rise <= _EVEN * size).any():
            j = int(falls.argmax())
            return (
                f"the torque does not rise: it is {M[j]:.4g} at {x[j]:.4g} from rest, and "
                f"{M[j + 1]:.4g} at {x[j + 1]:.4g}; such a spring snaps through. Give one that "
                "rises between the limits of the joint"
            )
        k = self.stiffness(x)
        if not (k > 0.0).all():
            j = int(k.argmin())
            return f"the stiffness is {k[j]:.4g} at {x[j]:.4g} from rest; it must be positive"
        summed = float(np.trapezoid(k, x))
        if abs(summed - (M[-1] - M[0])) > _AGREES * (M[-1] - M[0]):
            rises = f"the torque rises by {M[-1] - M[0]:.4g}"
            return f"{rises} between the limits, but its stiffness adds up to {summed:.4g}"
        if self.integral is None:
            return ""
        stored = self.energy(x)
        work = np.concatenate([[0.0], np.cumsum((M[1:] + M[:-1]) / 2.0 * np.diff(x))])
        off = float(abs(stored - stored[0] - work).max())
        if off > _AGREES * float(abs(work).max()):
            return f"the energy differs by up to {off:.4g} J from the work of the torque"
        return ""


def _values(name: str, function: AngleFunction, x: Array) -> Array:
    """Return what a function of the user gives; InvalidInput if these are no numbers like x."""
    try:
        values = np.asarray(function(x), dtype=np.float64)
    except Exception as error:
        problem = f"the function fails with an array of angles [rad] ({error}). It must take one: "
        raise InvalidInput(name, problem + "use np.where in place of if.") from None
    if values.shape != x.shape:
        problem = f"the function returns shape {values.shape} for angles of shape {x.shape}; it "
        raise InvalidInput(name, problem + "must return one number for each angle.")
    if not np.isfinite(values).all():
        at = float(x[~np.isfinite(values)].ravel()[0])
        problem = f"the function returns {float(values[~np.isfinite(values)].ravel()[0])} at "
        raise InvalidInput(name, f"{problem}{at:.4g} from rest; finite numbers are needed.")
    return values

"""Fit the law of a spring to torques that were measured at angles."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, warn
from cdsm.springs.law import SpringLaw, checked_points, checked_scale
from cdsm.support.format import plural, span
from cdsm.support.result import Result, quantity, unit
from cdsm.support.tables import ANGLE, Columns
from cdsm.support.validation import doubts_about_angle, interval
from cdsm.support.values import Array, Plotted, frozen

SCALE: Final = math.radians(2.0)
"""Scale of a fitted law [rad], if none is given."""

_FEWEST = 3  # points that tell two parameters and a scatter
_FLATTEST = 0.02  # exponent at which torques do not rise
_STEEP = 2.0  # a last chord that is so many times the steepest before it is a stop
_ALIKE = 1e10  # condition of the normal equations beyond which k and p are not told apart
_TURN = 2.0 * math.pi
_TORQUES: Final = {"N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "mNm": 1e-3, "N mm": 1e-3, "Nmm": 1e-3}


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SpringFit(Result, Plotted):
    """Power law fitted to torques at angles, with the scatter; made by :func:`fit_spring`.

    Attributes:
        law: The law.
        angle: Measured angles (n,) [rad] from rest, ascending.
        torque: Measured torques (n,) [N m] there.
        stiffness: k [N m/rad], the tangent at rest. It depends on the scale.
        stiffness_std: Standard deviation of k [N m/rad], for this scale.
        exponent: p [-].
        exponent_std: Standard deviation of p [-], for this scale.
        scale: a [rad], which was given: points beyond it do not tell it.
        rms: Root mean square of fitted minus measured torque [N m].
        linear_rms: The same of the best linear spring [N m].
        others: Laws fitted with half the scale and with twice the scale.
        notes: One sentence for each doubt.
    """

    law: SpringLaw
    angle: Array = field(metadata=unit("rad", "point"))
    torque: Array = field(metadata=unit("N m", "point"))
    stiffness: float = field(metadata=unit("N m/rad"))
    stiffness_std: float = field(metadata=unit("N m/rad"))
    exponent: float = field(metadata=unit("1"))
    exponent_std: float = field(metadata=unit("1"))
    scale: float = field(metadata=unit("rad"))
    rms: float = field(metadata=unit("N m"))
    linear_rms: float = field(metadata=unit("N m"))
    others: tuple[SpringLaw, SpringLaw]
    notes: tuple[str, ...] = ()

    _headline = "exponent"
    _rows = "point"
    _figure = "plot_spring_fit"

    @quantity("N m/rad", "end")
    def stiffness_range(self) -> tuple[float, float]:
        """Tangent at rest [N m/rad] with half the scale, and with twice the scale."""
        half, twice = self.others
        return half.stiffness_at_rest, twice.stiffness_at_rest

    @quantity("N m", "point")
    def fitted(self) -> Array:
        """Torque of the law at the measured angles (n,) [N m]."""
        return frozen(self.law.shape.torque(self.angle))

    @quantity("N m/rad", "point")
    def tangent(self) -> Array:
        """Tangent of the law at the measured angles (n,) [N m/rad]."""
        return frozen(self.law.shape.stiffness(self.angle))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What makes the law doubtful."""
        return self.notes

    def __str__(self) -> str:
        mean = float(abs(self.torque).mean())
        ends = span(np.rad2deg(self.angle), "{:.4g}°".format)
        k = f"{self.stiffness:.3g} ± {self.stiffness_std:.2g} N m/rad at rest"
        p = f"exponent {self.exponent:.2f} ± {self.exponent_std:.2f}"
        tangent = span(self.tangent, "{:.3g}".format)
        parts = [100.0 * rms / mean for rms in (self.rms, self.linear_rms)]
        keys = f"stiffness = {self.stiffness:.4g}, exponent = {self.exponent:.3g}"
        lines = [
            f"Spring of {plural(self.angle.size, 'point')}, {ends} from rest (± one σ)",
            f"  law       {k}, {p}, scale {math.degrees(self.scale):.3g}° (given)",
            f"  tangent   {tangent} N m/rad at the points",
            f"  rms       {parts[0]:.2g} % of the mean torque; of a linear spring {parts[1]:.2g} %",
            *(f"  note      {note}" for note in self.notes),
            f"  ARM.toml  [springs] JOINT = {{ {keys}, scale = {self.scale:.4g} }}",
        ]
        return "\n".join(lines)


def fit_spring(
    angles: ArrayLike,
    torques: ArrayLike,
    *,
    scale: float = SCALE,
    between: tuple[float, float] = (-np.inf, np.inf),
) -> SpringFit:
    """Fit the law `M = k x (1 + (x/a)²)^((p−1)/2)` to torques M at angles x from rest.

    Least squares of the torques give k and p; their standard deviations come from the scatter. The
    scale a is given, not found, and k at rest depends on it: ``stiffness_range`` has k with half
    and with twice the scale. What the points tell is the tangent where they are.

    Args:
        angles: x (n,) [rad] from rest, in any order; three or more that are not 0.
        torques: M (n,) [N m], with the signs of their angles; they may scatter.
        scale: a [rad] of the law, best near the smallest measured angle or below.
        between: Smallest and largest angle to fit [rad]: points at a stop of the joint are none of
            the spring.

    Raises:
        InvalidInput: An argument is not finite numbers, the arrays differ in length, fewer than
            three points are left, or the torques do not rise with the angle.

    Warns:
        CdsmWarning: Angles are beyond a turn, as if they were in degrees.

    Example:
        >>> import numpy as np
        >>> import cdsm
        >>> x = np.deg2rad([5, 10, 15, 20, 25, 27, 30])
        >>> M = 1e-3 * np.array([41.5, 65.9, 83.0, 104.7, 129.1, 134.2, 147.5])
        >>> cdsm.fit_spring(x, M)
        <SpringFit exponent 0.7396>
    """
    x, y = checked_points(angles, torques)
    a = checked_scale(scale)
    low, high = interval("between", between, "rad")
    for doubt in doubts_about_angle("an angle of a spring is", float(abs(x).max(initial=0)), _TURN):
        warn(doubt)
    order = np.argsort(x, kind="stable")
    kept = order[(x[order] >= low) & (x[order] <= high)]
    x = x[kept]
    y = y[kept]
    if (count := np.count_nonzero(x)) < _FEWEST:
        problem = f"{plural(int(count), 'point')} beside rest; {_FEWEST} tell an exponent and its "
        raise InvalidInput("angles", f"{problem}scatter. SpringLaw.table() runs through two.")
    linear = float(x @ y / (x @ x))
    if linear <= 0.0:
        problem = "have another sign than their angles; give the torque that holds the joint there."
        raise InvalidInput("torques", problem)
    parameters, covariance = _fitted(x, y, a, linear)
    k, p = np.exp(parameters)
    law = _law(x, y, a, linear)
    std = np.sqrt(np.diag(covariance)) * [k, p]
    others = (_law(x, y, 0.5 * a, linear), _law(x, y, 2.0 * a, linear))
    error = law.shape.torque(x) - y
    return SpringFit(
        law=law,
        angle=frozen(x),
        torque=frozen(y),
        stiffness=float(k),
        stiffness_std=float(std[0]),
        exponent=float(p),
        exponent_std=float(std[1]),
        scale=a,
        rms=float(np.sqrt(np.mean(error**2))),
        linear_rms=float(np.sqrt(np.mean((linear * x - y) ** 2))),
        others=others,
        notes=(_of_scale(a, x, others), *_of_stop(x, y), *_of_exponent(float(p), float(std[1]))),
    )


def _law(x: Array, y: Array, scale: float, linear: float) -> SpringLaw:
    k, p = np.exp(_fitted(x, y, scale, linear)[0]).tolist()
    return SpringLaw.power(stiffness=k, exponent=p, scale=scale)


def _fitted(x: Array, y: Array, scale: float, linear: float) -> tuple[Array, Array]:
    """Fit ln k and ln p; return them and their covariance from the scatter of the points."""
    from scipy.optimize import least_squares  # slow to import

    mean = float(abs(y).mean())
    size = x / scale

    def error(parameters: Array) -> Array:
        k, p = np.exp(parameters)
        return np.asarray((k * x * (1.0 + size**2) ** ((p - 1.0) / 2.0) - y) / mean)

    low, high = (-np.inf, math.log(_FLATTEST)), (np.inf, math.log(10.0))
    start = [math.log(linear), math.log(0.8)]
    options = {"xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12}
    found = least_squares(error, start, bounds=(low, high), **options)
    if found.x[1] < low[1] + 0.1:
        problem = (
            "do not rise with the angle: no spring law fits them. Look at the points in order."
        )
        raise InvalidInput("torques", problem)
    normal = found.jac.T @ found.jac
    if np.linalg.cond(normal) > _ALIKE:
        spread = span(np.rad2deg(abs(x)), "{:.4g}°".format)
        problem = (
            f"of {spread} from rest tell no exponent with the scale {math.degrees(scale):.3g}°"
        )
        remedy = "measure small and large angles, and give a scale near the smallest of them."
        raise InvalidInput("angles", f"{problem}; {remedy}")
    scatter = float(found.fun @ found.fun) / (x.size - 2)
    return np.asarray(found.x), np.asarray(np.linalg.inv(normal) * scatter)


def _of_scale(scale: float, x: Array, others: tuple[SpringLaw, SpringLaw]) -> str:
    """Return the sentence that says what the given scale decides, and what it does not."""
    first = math.degrees(float(np.min(abs(x[x != 0.0]))))
    half, twice = (law.stiffness_at_rest for law in others)
    given = f"the scale {math.degrees(scale):.3g}° was given, not found"
    return (
        f"{given}: with half of it the tangent at rest is {half:.3g} N m/rad, with twice "
        f"{twice:.3g}; points from {first:.3g}° on do not tell it"
    )


def _of_stop(x: Array, y: Array) -> list[str]:
    """Return a sentence if the torque rises so steeply at the end that a stop may be reached."""
    notes = []
    for side in (1.0, -1.0):
        at = np.flatnonzero(side * x > 0.0)[:: int(side)]
        chords = np.diff(np.append(0.0, y[at])) / np.diff(np.append(0.0, x[at]))
        if at.size > 2 and chords[-1] > _STEEP * chords[1:-1].max():
            last = math.degrees(x[at[-1]])
            times = chords[-1] / chords[1:-1].max()
            notes.append(
                f"to the last point, {last:.3g}°, the torque rises {times:.2g} times as steeply as "
                "anywhere before: is the joint at its stop? between= (--between) leaves it out"
            )
    return notes


def _of_exponent(p: float, std: float) -> list[str]:
    """Return a sentence if the spring may be linear."""
    if abs(p - 1.0) > 2.0 * std:
        return []
    return ["the exponent is 1 within its scatter: a linear spring fits as well"]


def read_spring_csv(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Read points of a spring from a CSV file: angles x (n,) [rad] and torques M (n,) [N m].

    The header names the columns ``angle [deg]`` (or ``[rad]``) and ``torque [N m]`` (or ``[mN m]``,
    ``[N mm]``). Lines that begin with # are ignored, and so are columns with other names.

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.

    Example:
        >>> import cdsm
        >>> angles, torques = cdsm.read_spring_csv("examples/data/SPRING.csv")
        >>> round(cdsm.fit_spring(angles, torques).exponent, 2)
        0.74
    """
    table = Columns(path, {"angle": ANGLE, "torque": _TORQUES}, "points of a spring")
    for name in ("angle", "torque"):
        table.factor(name)
    rows = [[table.number(row, name) for name in ("angle", "torque")] for row in table.rows]
    x, y = np.array(rows).T
    return frozen(x.copy()), frozen(y.copy())

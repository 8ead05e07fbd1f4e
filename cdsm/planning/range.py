"""Compute the smallest and largest stiffness that redundant cables can give an arm."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike
from cdsm.planning.tension_space import TensionSpace
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import coordinates, span, stiffness_text
from cdsm.support.progress import progress_bar
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import NO_WRENCH, Direction, unit_direction, whole_number
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import Tension

STARTS: Final = 24
"""Default number of random directions in which corners are sought."""

AT_END: Final = 1e-3
"""Relative distance to the limit of stability, or to a cap, that counts as none."""

_ASCENTS = 16  # largest number of searches for each end
_DESCENTS = 5
_AGREED = 5  # number of ascents whose ends differ by this part at most, and suffice
_SAME = 1e-5
_STEEP = 10.0  # factor of ln(along/start)
_TANGENT = 0.1  # along/start below which the logarithm is straight
_SETTINGS: Any = {"precision": 1e-10, "iterations": 50}
_GAIN = 1e-6  # a smaller relative gain is no reason to search on


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessRange(Result, Plotted):
    """Range of the stiffness of an arm along a direction; made by :func:`stiffness_range`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        low: Smallest attainable ``along(u)`` [N/m] that the searches found.
        high: Largest attainable ``along(u)`` [N/m] that the searches found.
        low_tension: Tensions that give ``low``.
        high_tension: Tensions that give ``high``.
        floor: Smallest eigenvalue of `K_θ` at which an arm still counts as stable [N m/rad].
    """

    _headline = "ends"
    _rows = "cable"
    _figure = "plot_stiffness_range"

    direction: Array = field(metadata=unit("1", "axis"))
    low: float = field(metadata=unit("N/m"))
    high: float = field(metadata=unit("N/m"))
    low_tension: Tension = field(metadata=unit("N", "cable"))
    high_tension: Tension = field(metadata=unit("N", "cable"))
    floor: float = field(metadata=unit("joint stiffness"))

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.low_tension.posture

    @quantity("N/m", "end")
    def ends(self) -> Array:
        """Both ends of the range (2,) [N/m]."""
        return frozen(np.array([self.low, self.high]))

    @quantity("1", "end")
    def limited_by_stability(self) -> tuple[bool, bool]:
        """Whether the arm is about to buckle at the lower and at the upper end.

        Such an end depends on ``floor``, a convention, more than on the arm.
        """
        low, high = (self.margins <= (1.0 + AT_END) * self.floor).tolist()
        return low, high

    @quantity("joint stiffness", "end")
    def margins(self) -> Array:
        """Smallest joint stiffness [N m/rad] of the softest and of the stiffest arm (2,)."""
        both = (self.low_tension, self.high_tension)
        return frozen(np.array([stiffness(self.posture, F).margin for F in both]))

    def __contains__(self, target: float) -> bool:
        return self.low <= target <= self.high

    def __str__(self) -> str:
        limited = self.limited_by_stability
        along = f"along {coordinates(self.direction)} the stiffness can be"
        arm = self.posture.arm
        lines = [f"{along} {stiffness_text(*self.ends)} ({frictionless_model(arm)})"]
        unit = arm.stiffness_unit()
        tensions = {"softest": self.low_tension, "stiffest": self.high_tension}
        rows = zip(tensions.items(), self.margins, limited, strict=True)
        for (name, F), least, stops in rows:
            margin = f"smallest joint stiffness {least:.4g} {unit}"
            stop = ", limited by stability" if stops else ""
            lines.append(f"{name} with {span(F.values)} N, {margin}{stop}")
        return "\n".join(lines)


def stiffness_range(
    pose: Posture,
    direction: Direction,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    starts: int = STARTS,
) -> StiffnessRange:
    """Compute the smallest and largest ``along(u)`` that admissible tensions give (Eqs. 13, 20).

    The constraints on F are those of :func:`~cdsm.plan_stiffness`. With a rigidity that is constant
    or levels off, ``along`` is a concave function of F: it has one maximum, and many minima in the
    corners of the set of admissible tensions. So the search for ``low`` begins at many corners, and
    from the softest one found at all beside it, until none is softer; this does not prove that
    ``low`` is the smallest. If tension can buckle the arm, it is softest just before: ``low`` then
    depends on ``floor``, 1 % of the smallest eigenvalue of `K_θ` under the least tensions (or, if
    they hardly hold the arm, under the most stable ones), and ``print`` says "limited by
    stability".

    Args:
        pose: The posture.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Or loads on links,
            as for :func:`~cdsm.distribute_tension`.
        starts: Number of random directions in which corners are sought, 1 to 1000.

    Raises:
        InvalidInput: An argument is invalid; or ``maximum`` is inf, and an end of the range needs
            1000 times the least tensions or more.
        InfeasibleTension: No tensions within the bounds balance the arm.
        ElasticityRangeError: None of them are within the domains of the elasticities.
        SingularStiffness: The tip cannot move along u, or no admissible tensions make the arm
            stable.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> ends = cdsm.stiffness_range(pose, "z", minimum=5.0, maximum=300.0)
        >>> print(f"{1e-3 * ends.low:.3f} to {1e-3 * ends.high:.2f} N/mm")
        0.043 to 89.67 N/mm
    """
    u = unit_direction("direction", direction)
    number = whole_number("starts", starts, 1, 1000)
    return range_within(TensionSpace(pose, u, minimum, maximum, wrench), number)


def range_within(space: TensionSpace, starts: int = STARTS) -> StiffnessRange:
    """Compute the range along the only direction of ``space``, as :func:`stiffness_range` does."""
    u = space.directions[0]
    with progress_bar("searching the ends of the range"):
        softest, stiffest = ends(space, starts)
    if softest.open or stiffest.open:
        problem = f"none given, and the stiffness along {coordinates(u)} still changes at "
        raise InvalidInput("maximum", f"{problem}{space.capped[1].max():.4g} N; give one.")
    low = space.tension(softest.F)
    high = space.tension(stiffest.F)
    return StiffnessRange(
        direction=u,
        low=stiffness(space.pose, low).along(u),
        high=stiffness(space.pose, high).along(u),
        low_tension=low,
        high_tension=high,
        floor=space.floor,
    )


class End(NamedTuple):
    """One end of the range of a stiffness."""

    F: Array  # tensions (C,) [N]
    value: float  # stiffness [N/m]; 0 or inf if it is open
    open: bool  # whether larger tensions, which no bound excludes, would lead further


def ends(space: TensionSpace, starts: int = STARTS) -> tuple[End, End]:
    """Find the softest and the stiffest tensions along the only direction of ``space``."""
    (low, high) = space.capped
    anchor = space.anchor

    def value(F: Array) -> float:
        return float(_along(space, F)[0])

    def best(sign: float, points: Iterable[Array], most: int, enough: int = -1) -> Array:
        """Search from the best ``most`` points, until ``enough`` searches end beside the best."""

        def rank(F: Array) -> float:
            return sign * value(F)

        starts = sorted({f"{value(F):.6g}": F for F in points}.values(), key=rank)[:most]
        optima: list[Array] = []
        for F in starts:
            optima = sorted([*optima, farther(space, sign, F)], key=rank)
            best = optima[0]
            if sum(rank(F) < rank(best) + _SAME * value(best) for F in optima) == enough:
                break
        while rank(again := farther(space, sign, best)) < rank(best) - _GAIN * value(best):
            best = again
        return best

    corners = [anchor, *space.corners(starts)]
    inside = [(F + anchor) / 2.0 for F in corners]  # where no constraint stops the first step
    stiffest = best(-1.0, [*corners, *inside], _ASCENTS, _AGREED)
    down = [downhill(space, F) for F in corners]
    softest = best(1.0, [*corners, *down], _DESCENTS)
    known = np.inf
    while value(softest) < (1.0 - _GAIN) * known:
        known = value(softest)
        other = np.where(2.0 * softest < low + high, high, low)
        beside = np.where(np.eye(len(other)) > 0.0, other, softest)  # one tension far away in each
        balanced = (space.nearest(F, space.capped) for F in beside)
        points = [space.pulled_back(F, 1e-3) for F in balanced if F is not None]
        down = [downhill(space, F) for F in points]
        softest = best(1.0, [softest, *points, *down], _DESCENTS)
    unlimited = np.isinf(space.bounds[1])

    def end(F: Array, farther: float) -> End:
        beyond = bool((unlimited & ((1.0 - AT_END) * high <= F)).any())
        return End(F, farther if beyond else value(F), beyond)

    return end(softest, 0.0), end(stiffest, np.inf)


def _along(space: TensionSpace, F: Array) -> tuple[Any, Array]:
    values, slopes = space.at(F).along
    return values[0], slopes[0]


def farther(space: TensionSpace, sign: float, F: Array) -> Array:
    """Search from F (C,) [N] for softer (``sign`` 1) or stiffer (−1) tensions; F if there are none.

    A maximum is sought of ln(along), which is concave where ``along`` is, and of even scale.
    """
    unit = float(_along(space, F)[0])

    def goal(F: Array) -> tuple[Any, Array]:
        s, slope = _along(space, F)
        if sign > 0.0:
            return s / unit, slope / unit
        tangent = max(s, _TANGENT * unit)  # the logarithm goes on straight below
        return -_STEEP * (np.log(tangent / unit) + s / tangent), -_STEEP * slope / tangent

    optimum = space.search(F, goal, bounds=space.capped, **_SETTINGS)
    if optimum is None:
        return F
    return min(F, space.pulled_back(optimum), key=lambda F: sign * float(_along(space, F)[0]))


def downhill(space: TensionSpace, F: Array) -> Array:
    """Go from F (C,) [N] from corner to corner while the arm becomes softer; return the last."""
    value, slope = _along(space, F)
    while (corner := space.corner(-slope)) is not None:
        softer = space.pulled_back(corner, 1e-3)
        known = value
        (value, slope) = _along(space, softer)
        if value > (1.0 - _GAIN) * known:
            break
        F = softer
    return F

"""Compute the smallest and largest stiffness that redundant cables can give an arm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.planning.admissible import Admissible
from cdsm.planning.objectives import along_constraints, checked_starts
from cdsm.planning.sqp import HIGHEST, LOWEST, Objective, Program, search
from cdsm.planning.starts import StartPoints
from cdsm.planning.stiffness_model import Constraints, ConstraintValues, Evaluation, StiffnessModel
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import MODEL, coordinates, plain, span
from cdsm.support.progress import progress_allowed, track
from cdsm.support.validation import NO_WRENCH
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARGIN = 1e-4
"""Default of ``margin``: least λ_min/λ_max of K_θ with which an arm counts as stable.

Stable arms of 40 joints come down to 3e-4.
"""

_UPWARD = 4  # starts for the upper end if rigidities rise: there is mostly one maximum
_LAW_SAMPLES = 257  # number of tensions at which a law is sampled to check that its rigidity rises
_LAW_ROUNDING = 1e-12  # a relative fall of the rigidity below this is rounding
_LIMITS = (1e2, 1e4, 1e6)  # caps of unbounded tensions over the least tensions, tried in turn
_GAIN = 1e-6  # a smaller relative gain of ``low`` is no reason to search on
_CAPPED = 0.999  # a tension above this part of its cap would rise further


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessRange(ReadOnlyState):
    """Range of the stiffness of an arm along a direction; made by :func:`stiffness_range`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        low: Smallest attainable ``along(u)`` [N/m] that the searches found.
        high: Largest attainable ``along(u)`` [N/m] that the searches found.
        low_tension: Tensions that give ``low``.
        high_tension: Tensions that give ``high``.
        floor: Smallest eigenvalue of K_θ at which an arm still counts as stable [N m/rad].
    """

    direction: Array
    low: float
    high: float
    low_tension: Tension
    high_tension: Tension
    floor: float

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.low_tension.posture

    def plot(self) -> Figure:
        """Plot the tensions [N] of the softest and the stiffest arm."""
        return cdsm.plots.plot_stiffness_range(self)

    def to_dict(self) -> dict[str, object]:
        """Return both stiffnesses and their tensions in SI for JSON, with units in the keys."""
        numbers = {
            **self.posture._coordinates,
            "direction": self.direction,
            "low_N_per_m": self.low,
            "high_N_per_m": self.high,
            "low_tension_N": dict(self.low_tension),
            "high_tension_N": dict(self.high_tension),
        }
        return plain(numbers)

    def __contains__(self, target: float) -> bool:
        return self.low <= target <= self.high

    def __repr__(self) -> str:
        return f"<StiffnessRange {self.low / 1e3:.4g} to {self.high / 1e3:.4g} N/mm>"

    def __str__(self) -> str:
        return (
            f"along {coordinates(self.direction)} the stiffness can be "
            f"{self.low / 1000.0:.4g} to {self.high / 1000.0:.4g} N/mm\n"
            f"softest with {span(self.low_tension.values)} N, "
            f"stiffest with {span(self.high_tension.values)} N\n"
            f"smallest joint stiffness {self._margin(self.low_tension)} when softest, "
            f"{self._margin(self.high_tension)} when stiffest ({MODEL})"
        )

    def _margin(self, tension: Tension) -> str:
        unit = self.posture.arm.stiffness_unit()
        return f"{stiffness(self.posture, tension).margin:.4g} {unit}"


def stiffness_range(
    pose: Posture,
    direction: Direction,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: ArrayLike = NO_WRENCH,
    *,
    margin: float = MARGIN,
    starts: int = 24,
    seed: int = 0,
    progress: bool = True,
) -> StiffnessRange:
    """Compute the smallest and largest ``along(u)`` that admissible tensions give (Eqs. 13, 20).

    The constraints on F are those of :func:`~cdsm.plan_stiffness`. With a rigidity that is constant
    or levels off, ``along`` is a concave function of F: it has one maximum, and many minima in the
    corners of the set of admissible tensions. So the search for ``low`` needs many starts. With
    other laws the search for ``high`` needs them too. A larger number of ``starts`` adds starting
    tensions and keeps the others. If tension can buckle the arm, the arm is softest just before it
    buckles, and ``low`` depends on ``margin``.

    From the softest corner found, the tension of one cable after the other is moved to its other
    bound, until no softer corner is found. This does not prove that ``low`` is the smallest. With
    the default number of starts, it was at most 0.3 % too high in 47 of 48 random arms (Eq. 19 or
    constant rigidity, up to 20 cables), and 1.9 % in the other, which tension can buckle. It was up
    to 5.5 % too high with a law whose rigidity rises and falls again.

    Args:
        pose: The posture.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        margin: Smallest eigenvalue of K_θ that counts as stable, as a part of the largest [-]. A
            prismatic joint counts in lengths of the arm.
        starts: Number of starting tensions for ``low``, at most 1000. ``high`` has the same number,
            or a few if the rigidity of all cables is known to rise with the tension.
        seed: Seed of the random starting tensions.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero;
            ``minimum`` exceeds ``maximum``; another argument is invalid; or ``maximum`` is inf and
            an end of the range needs unlimited tension.
        InfeasibleTension: No tensions within the bounds and domains balance the arm.
        ElasticityRangeError: The bounds and the domain of an elasticity do not overlap.
        SingularStiffness: The tip cannot move along u, or no admissible tensions make the arm
            stable.
    """
    model = StiffnessModel(pose, minimum, maximum, wrench, margin)
    u = unit_direction("direction", direction)
    stiffness(pose, model.region.least)._require_mobile(u)
    with progress_allowed(progress):
        low, high = range_ends(model, u, *checked_starts(starts, seed))
    if low.open or high.open:
        raise InvalidInput(
            "maximum",
            f"none given, and the stiffness along {coordinates(u)} still changes at "
            f"tensions of {_LIMITS[-1]:g} times the least; give one.",
        )
    return StiffnessRange(
        direction=u,
        low=low.value,
        high=high.value,
        low_tension=low.tension,
        high_tension=high.tension,
        floor=model.floor,
    )


class RangeEnd(NamedTuple):
    """One end of a range: the least or largest stiffness that was found, and the tensions there."""

    evaluation: Evaluation  # at the end of the best search
    tension: Tension  # there, with exact balance
    value: float  # stiffness [N/m]; next to buckling the less accurate value of the search
    open: bool = False  # whether larger tensions, which no bound excludes, would lead further


def range_ends(
    model: StiffnessModel, u: Array, starts: int, seed: int
) -> tuple[RangeEnd, RangeEnd]:
    """Find the tensions that give the lowest and the highest stiffness along ``u`` (3,).

    Let F_0 be the largest of the tensions that hold the arm with least effort. Tensions without
    bound are capped at 1e2 F_0, then at 1e4 and 1e6 F_0, until both ends lie below the cap.
    :func:`stiffness_range` explains ``starts`` and ``seed``.
    """
    region = model.region
    if np.isfinite(region.high).all():
        return _bounded_ends(model, region, u, starts, seed)
    for limit in _LIMITS:
        cap = limit * region.scale
        capped = replace(region, high=np.minimum(region.high, cap))
        ends = _bounded_ends(model, capped, u, starts, seed)
        low, high = (end._replace(open=end.tension.values.max() >= _CAPPED * cap) for end in ends)
        if not (low.open or high.open):
            break
    return low, high


def _bounded_ends(
    model: StiffnessModel, region: Admissible, u: Array, starts: int, seed: int
) -> tuple[RangeEnd, RangeEnd]:
    begin = StartPoints(model, region, starts, seed)

    def along(unit: float) -> Constraints:
        constraints = along_constraints(model, u[None], np.array([unit]))
        return replace(constraints, targets=np.zeros(1))

    unit = float(along(1.0).at(begin.anchor).values[0])
    constraints = along(unit)
    rising = sorted(begin.points, key=lambda point: float(constraints.at(point).values[0]))

    def searched(
        name: str,
        objective: Objective,
        points: list[Evaluation],
        found: Sequence[ConstraintValues] = (),
    ) -> list[ConstraintValues]:
        program = Program(region, begin.anchor, constraints, objective, region.scale)
        bar = track(points, f"searching the {name} tensions")
        ends = [*found, *(search(program, point) for point in bar)]
        return sorted(ends, key=lambda each: objective.linear * float(each.values[0]))

    concave = _rigidities_rise(region)  # mostly: then any start leads to the maximum
    inside = [] if concave else list(begin.between(starts))
    falling = rising[: -(_UPWARD // 2 if concave else starts) - 1 : -1]
    highest = searched("stiffest", HIGHEST, [*falling, rising[0], *inside, begin.anchor])
    lowest = searched("softest", LOWEST, [*rising[:starts], *inside, begin.anchor])
    known = math.inf
    while lowest[0].values[0] < (1.0 - _GAIN) * known:
        known = float(lowest[0].values[0])
        beside = list(_beside(region, begin.anchor, lowest[0].evaluation.F))
        lowest = searched("softest", LOWEST, beside, lowest)

    def end(found: list[ConstraintValues]) -> RangeEnd:
        evaluation = found[0].evaluation
        tension = region.tension(evaluation.F)
        try:
            value = stiffness(model.pose, tension).along(u)
        except SingularStiffness:  # next to buckling K_θ has no accurate inverse
            value = unit * float(found[0].values[0])
        return RangeEnd(evaluation, tension, value)

    return end(lowest), end(highest)


def _beside(region: Admissible, anchor: Evaluation, F: Array) -> Iterator[Evaluation]:
    """Yield stable tensions near F (C,) [N], each with one tension moved to its farther bound.

    They are the nearest that balance the arm; unstable ones are moved back towards ``anchor``.
    """
    for c, (low, high) in enumerate(zip(region.low, region.high, strict=True)):
        wanted = F.copy()
        wanted[c] = high if 2.0 * F[c] < low + high else low
        corner = region.nearest(wanted, region.low, region.high)
        point = None if corner is None else anchor.backtracked(corner)
        if point is not None:
            yield point


def _rigidities_rise(region: Admissible) -> bool:
    """Return whether no rigidity EA(F) falls within the bounds."""
    cables = region.least.posture.arm.cables
    for cable, low, high in zip(cables, region.low, region.high, strict=True):
        law = cable.elasticity
        if cable.control == "force" or law._constant is not None:
            continue
        rigidity = law.rigidity(np.linspace(low, high, _LAW_SAMPLES))
        if (np.diff(rigidity) < -_LAW_ROUNDING * rigidity[1:]).any():
            return False
    return True

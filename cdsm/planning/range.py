"""The smallest and the largest stiffness that the redundant cables can give an arm."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.errors import ElasticityRangeError, InvalidInput, SingularStiffness
from cdsm.planning.admissible import Admissible
from cdsm.planning.objectives import Problem, along, checked_direction, checked_starts, problem
from cdsm.planning.sqp import HIGHEST, LOWEST, Goal, Task, search
from cdsm.planning.starts import Ground, settled
from cdsm.planning.stiffness_model import Point, Reading
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.units import MODEL
from cdsm.support.validation import Array, ReadOnlyState, frozen
from cdsm.tension import Tension
from cdsm.wires.laws import StrandElasticity, TabulatedElasticity

MARGIN = 1e-4
"""Default of the smallest eigenvalue of K_θ over its largest: arms of 40 joints reach 3e-4."""

_UPWARD = 4
"""Starts for the highest where rigidities rise: where they level off, too, there is one alone."""

_SETTLED = 3
"""How many of the best ends of searches are tried beyond the jumps of rigidities that rise."""

_LAW_SAMPLES = 257
"""Tensions at which the rigidity of a law is asked for, to see whether it rises."""

_LAW_ROUNDING = 1e-12
"""A rigidity that falls by no more than this part of it does not fall."""

_LIMITS = (1e2, 1e4, 1e6)
"""How far unbounded tensions are followed, in least tensions."""

_CAPPED = 0.999
"""From this part of that on they would have gone further."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessRange(ReadOnlyState):
    """What stiffness along a direction an arm can have; made by :func:`stiffness_range`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        low: Smallest attainable ``along(u)`` [N/m], as far as the searches found it.
        high: Largest attainable ``along(u)`` [N/m].
        low_tension: Tensions that give ``low``.
        high_tension: Tensions that give ``high``.
        floor: Smallest eigenvalue of K_θ that counted as stable [N m/rad].
        low_found: Where each search for ``low`` ended, rising (S,) [N/m]: how often, out of how
            many starts, it was found.
        high_found: Where each search for ``high`` ended, falling (S,) [N/m].
        iterations: Steps of all searches.
        evaluations: How often K_θ was evaluated.
    """

    direction: Array
    low: float
    high: float
    low_tension: Tension
    high_tension: Tension
    floor: float
    low_found: Array
    high_found: Array
    iterations: int
    evaluations: int

    @property
    def posture(self) -> Posture:
        """Where."""
        return self.low_tension.posture

    def __contains__(self, target: float) -> bool:
        return self.low <= target <= self.high

    def __repr__(self) -> str:
        return f"<StiffnessRange {self.low:.6g} to {self.high:.6g} N/m>"

    def __str__(self) -> str:
        lines = [
            f"along ({', '.join(f'{x:.4g}' for x in self.direction)}) the stiffness can be "
            f"{self.low / 1000.0:.4g} to {self.high / 1000.0:.4g} N/mm"
        ]
        for name, pull, found in (
            ("softest", self.low_tension.values, self.low_found),
            ("stiffest", self.high_tension.values, self.high_found),
        ):
            same = int((abs(found - found[0]) <= 1e-6 * found[0]).sum())
            lines.append(
                f"{name} with {pull.min():.4g} to {pull.max():.4g} N, "
                f"found from {same} of {found.size} starts"
            )
        return "\n".join([*lines, f"({MODEL})"])


def stiffness_range(
    pose: Posture,
    direction: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *,
    margin: float = MARGIN,
    starts: int = 24,
    seed: int = 0,
) -> StiffnessRange:
    """Smallest and largest ``along(u)`` over all tensions that hold the arm (Eqs. 13 and 20).

    Over F with J_Lᵀ F = J_Xᵀ W − g, the bounds, the domains of the elasticities of position-
    controlled cables, and λ_min(K_θ), symmetric part, not below ``margin``. With constant rigidity,
    or one that levels off, ``along`` is a concave function of F: the largest is the only one there
    is, the smallest one of many in the corners, so that it is sought from many starts. Of a law of
    one's own, or one whose rigidity falls somewhere, nothing like that is known: both ends are
    sought from many starts then, in the corners and between, and ``high_found`` tells how often
    ``high`` was found. More starts go on from fewer. An arm that tension can buckle is softest just
    before: then ``low`` depends on ``margin``.

    No number of starts proves that ``low`` is the smallest. With the default it was found too high
    by up to 0.16 % with constant rigidity (15 cables), and by up to 5.5 % with a law of one's own
    whose rigidity has a hump.

    Args:
        pose: The posture.
        direction: u (3,) in base axes, any length.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for none but the end
            of the elasticity's domain, and buckling.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        margin: From which part of the largest eigenvalue of K_θ under the least tensions on the
            smallest one counts as stable [-], 1e-9 or more.
        starts: From how many tensions to search for ``low``, and for ``high`` unless the rigidity
            of all cables is known to rise with the tension, where a few are enough; at most 1000.
        seed: Of the random ones among them.

    Raises:
        InvalidInput: Not a direction, bounds the wrong way or another argument out of place; or no
            maximum, and the stiffness does not stop changing with the tension.
        InfeasibleTension: No tension within the bounds and domains balances the arm.
        ElasticityRangeError: The bounds leave nothing of the domain of a cable's elasticity.
        SingularStiffness: The tip cannot move along u, or no admissible tension holds the arm.
    """
    question = problem(pose, minimum, maximum, wrench, margin)
    u = checked_direction(question, direction)
    low, high, steps = attainable(question, u, *checked_starts(starts, seed))
    if low.open or high.open:
        raise InvalidInput(
            "maximum",
            f"none given, and tensions of {_LIMITS[-1]:g} times the least still change the "
            f"stiffness along ({', '.join(f'{x:.4g}' for x in u)}), which has no end; give one.",
        )
    return StiffnessRange(
        direction=u,
        low=low.value,
        high=high.value,
        low_tension=low.tension,
        high_tension=high.tension,
        floor=question.field.floor,
        low_found=low.values,
        high_found=high.values,
        iterations=steps,
        evaluations=question.field.evaluations,
    )


class End(NamedTuple):
    """One end of the range.

    Attributes:
        point: Where the best search ended.
        tension: The tensions there, their balance exact.
        value: The stiffness along the direction under them [N/m], a rounding off that of the
            search; next to buckling, where all of it is left of a difference, more than that, or
            that of the search.
        values: What all searches for it ended with (S,) [N/m], its own first.
        open: Whether it is only as far as unbounded tensions were followed, and they lead on.
    """

    point: Point
    tension: Tension
    value: float
    values: Array
    open: bool = False


class Ends(NamedTuple):
    """Both ends, and how many steps it took to find them."""

    low: End
    high: End
    iterations: int


def attainable(question: Problem, u: Array, starts: int, seed: int) -> Ends:
    """Search both ends of the range along a unit direction (3,)."""
    region = question.region
    if np.isfinite(region.high).all():
        return _ends(question, u, starts, seed)
    iterations = 0
    for limit in _LIMITS:
        cap = limit * region.scale
        *ends, steps = _ends(replace(question, region=region.capped(cap)), u, starts, seed)
        iterations += steps
        low, high = (end._replace(open=end.tension.values.max() >= _CAPPED * cap) for end in ends)
        if not (low.open or high.open):
            break
    return Ends(low, high, iterations)


def _ends(question: Problem, u: Array, starts: int, seed: int) -> Ends:
    region, field = question.region, question.field
    ground = Ground(region, field, starts, seed)
    plain = Reading((along(question, u, 1.0),), np.zeros(1))
    unit = float(plain.of(ground.anchor).values[0])
    reading = Reading((along(question, u, unit),), np.zeros(1))
    order = sorted(ground.points, key=lambda point: float(reading.of(point).values[0]))
    rise = _rigidities_rise(region)
    inside = [] if rise else list(ground.between(starts, seed))
    most = _SETTLED if rise else len(order) + starts
    iterations = 0

    def end(goal: Goal, points: list[Point]) -> End:
        nonlocal iterations
        task = Task(region, field, ground.anchor, reading, goal, region.scale)
        found = [search(task, point) for point in points]
        found.sort(key=lambda each: goal.linear * float(each.sight.values[0]))
        found[:most] = [settled(task, each) for each in found[:most]]
        found.sort(key=lambda each: goal.linear * float(each.sight.values[0]))
        iterations += sum(each.iterations for each in found)
        values = unit * np.array([each.sight.values[0] for each in found])
        point = found[0].sight.point
        tension = region.tension(point.F)
        try:
            value = stiffness(question.pose, tension).along(u)
        except SingularStiffness:  # so near to buckling that an inverse has hardly a digit
            value = float(values[0])
        return End(point, tension, value, frozen(values))

    low = end(LOWEST, [*order[:starts], *inside, ground.anchor])
    upward = order[: -(_UPWARD // 2 if rise else starts) - 1 : -1]
    high = end(HIGHEST, [*upward, order[0], *inside, ground.anchor])
    return Ends(low, high, iterations)


def _rigidities_rise(region: Admissible) -> bool:
    """Whether the rigidity of every cable is known not to fall where the tension rises."""
    cables = region.least.posture.arm.cables
    return all(
        _rises(cable.elasticity, low, high)
        for cable, low, high in zip(cables, region.low.tolist(), region.high.tolist(), strict=True)
        if cable.control == "position"
    )


def _rises(law: Elasticity, low: float, high: float) -> bool:
    """Whether a law is known not to fall between two tensions [N]."""
    if isinstance(law, LinearElasticity):
        return True
    if not isinstance(law, (StrandElasticity, TabulatedElasticity)):
        return False  # between places where it is looked at, a law of one's own may do anything
    try:
        rigidity = law.rigidity(np.linspace(low, high, _LAW_SAMPLES))
    except ElasticityRangeError:
        return False
    return bool((np.diff(rigidity) >= -_LAW_ROUNDING * rigidity[1:]).all())

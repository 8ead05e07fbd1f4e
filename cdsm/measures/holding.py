"""How much an arm holds along a direction: with motors that follow, and with locked motors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal, final

import numpy as np

from cdsm.applied import Applied, combined, force_at, jacobian_at, scaled
from cdsm.dead_loads import LinkPoint
from cdsm.errors import InfeasibleTension, SingularStiffness
from cdsm.measures.polytope import balanced
from cdsm.posture import Posture
from cdsm.statics.buckling import critical_load
from cdsm.statics.continuation import follow
from cdsm.statics.equilibrium import equilibrium
from cdsm.statics.events import Event, Kind, events_text
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.pieces import stage_at
from cdsm.statics.smooth_events import events_on, mass_of, watched
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.support.progress import progress_bar
from cdsm.support.result import Result, unit
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_ENDS: tuple[Kind, ...] = ("maximum", "law", "stop", "buckling")  # events that end what is held
_SAG = 0.05  # displacement over the arm's length at the first load of the search
_DOUBLINGS = 20  # most doublings of this load
_INSIDE = 1e-9  # relative distance from the ends of a law: rounding may put a tension beyond
_AT_BOUND = 1e-5  # distance from a bound that it is active at, over the largest tension
_BELOW = 1e-7  # the bounds that limit a force are read at this part below it


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Holding(Result):
    """Largest force that an arm holds; of :attr:`Payload.following` and :attr:`Payload.locked`.

    Attributes:
        motors: ``"following"``: they re-distribute the tensions; ``"locked"``: they hold the wire.
        force: Largest force [N]; inf if nothing limits it.
        mass: The mass that weighs so much [kg]; None if the force is not along gravity.
        limit: What ends it: ``"maximum of cable4_2 (130 N)"``, ``"buckling, joint4_1 most"``, …
        events: Events up to there, in the order of their loads; the last one is the limit. Their
            ``share`` is that of ``force``.
    """

    _headline = "force"

    motors: Literal["following", "locked"] = field(metadata=unit("1"))
    force: float = field(metadata=unit("N"))
    mass: float | None = field(metadata=unit("kg"))
    limit: str = field(metadata=unit("1"))
    events: tuple[Event, ...] = field(default=(), metadata=unit("1"))

    def __str__(self) -> str:
        motors = "motors follow" if self.motors == "following" else "motors locked"
        if math.isinf(self.force):
            return f"{motors}: no force was found that ends it"
        mass = "" if self.mass is None else f" ({self.mass:.4g} kg)"
        line = f"{motors}: {self.force:.4g} N{mass}, limit: {self.limit}"
        return "\n".join([line, *(f"  {text}" for text in events_text(self.events[:-1]))])


def holding_following(
    pose: Posture,
    u: Array,
    wrench: Applied,
    minimum: Array,
    maximum: Array,
    at: LinkPoint | None = None,
) -> Holding | None:
    """Return what the arm holds along u while its motors re-distribute the tensions.

    The tensions stay within the bounds that hold (C,) [N] and within the laws, and the arm is
    stable with the least ones. None if no tensions balance it without the force.
    """
    low, high = _within_laws(pose, minimum, maximum)
    try:
        distribute_tension(pose, low, high, wrench)
    except InfeasibleTension:
        return None
    solution = balanced(pose, u[:, None], wrench, low, high, at)(np.ones(1))
    force = max(float(solution.x[0]), 0.0) if solution.ok else 0.0
    force = math.inf if solution.status is Status.UNBOUNDED else force
    load = force or 1.0
    if math.isinf(load):
        load = _first_load(pose, low, high, wrench, u, at)
    force_there = force_at(at, load * u)
    critical = critical_load(pose, force_there, low, high, wrench=wrench)
    if critical.limit == "buckling" and critical.factor * load < force:
        force = critical.factor * load
        joint = pose.arm.joint_names[int(abs(critical.mode).argmax())]
        kind: Kind = "buckling"
        place = joint
        limit = f"buckling, {joint} most"
    elif math.isinf(force):
        return _holding(pose, u, "following", force, "none", ())
    else:
        kind, place, limit = _limiting_bound(
            pose, u, wrench, (low, high), (minimum, maximum), force, at
        )
    return _holding(pose, u, "following", force, limit, (Event(kind, place, 1.0, force),))


def holding_locked(
    pose: Posture,
    u: Array,
    wrench: Applied,
    tension: Array,
    maximum: Array,
    at: LinkPoint | None = None,
) -> Holding:
    """Return what the arm holds along u while its motors hold the wire at tensions F (C,) [N].

    The force grows slowly from zero, without friction. Slack cables are no limit; a tension above
    ``maximum`` (C,) [N] or outside its law, a joint at its stop and buckling are.
    """
    K = stiffness(pose, tension, wrench)
    rest = equilibrium(pose, tension, wrench)
    if not K.is_stable:
        joint = pose.arm.joint_names[int(abs(K.critical_direction).argmax())]
        event = Event("buckling", joint, 0.0, 0.0)
        return _holding(pose, u, "locked", 0.0, f"buckling, {joint} most, without it", (event,))
    try:
        along = K.tip_response(u, J_v=jacobian_at(pose, at)[:3])[0]
    except SingularStiffness:
        along = math.inf
    size = _SAG * pose.arm.length * along
    if not math.isfinite(size):
        size = max(float(tension.max(initial=0.0)), 1.0)
    force = force_at(at, size * u)

    def model(share: float) -> LockedArm:
        return rest.model.under(combined(wrench, scaled(force, share)))

    watch = watched(rest.model, maximum)
    here = stage_at(model, rest.pose, rest.stop_torque, 0.0)
    events = list[Event]()
    goal = 1.0
    with progress_bar("load of locked motors", _DOUBLINGS) as advance:
        for _ in range(_DOUBLINGS):
            branch = follow(model, here, goal)
            events += events_on(model, branch, watch, size, goal)
            last = next((k for k, event in enumerate(events) if event.kind in _ENDS), None)
            if last is not None:
                end = events[last]
                limit = _limit_of(pose, end, maximum)
                return _holding(pose, u, "locked", end.load, limit, tuple(events[: last + 1]))
            here = branch[-1]
            goal = 2.0 * goal
            advance(1)
    return _holding(pose, u, "locked", math.inf, "none", tuple(events))


def _holding(
    pose: Posture,
    u: Array,
    motors: Literal["following", "locked"],
    force: float,
    limit: str,
    events: tuple[Event, ...],
) -> Holding:
    mass = mass_of(pose.arm, u, force)
    if 0.0 < force < math.inf:
        events = tuple(replace(event, share=event.load / force) for event in events)
    return Holding(motors=motors, force=force, mass=mass, limit=limit, events=events)


def _within_laws(pose: Posture, low: Array, high: Array) -> tuple[Array, Array]:
    """Narrow bounds (C,) [N] to the insides of the laws of position-controlled cables."""
    laws = pose.arm.laws
    first = laws.low * (1.0 + _INSIDE)
    last = laws.high * (1.0 - _INSIDE)
    return frozen(np.maximum(low, first)), frozen(np.minimum(high, last))


def _first_load(
    pose: Posture, low: Array, high: Array, wrench: Applied, u: Array, at: LinkPoint | None
) -> float:
    """Return a force [N] along u that moves its point by 5 % of the length, or like tensions."""
    tension = distribute_tension(pose, low, high, wrench)
    try:
        K = stiffness(pose, tension)
        force = _SAG * pose.arm.length * K.tip_response(u, J_v=jacobian_at(pose, at)[:3])[0]
    except SingularStiffness:
        force = math.inf
    return force if math.isfinite(force) else max(float(tension.values.max(initial=0.0)), 1.0)


def _limiting_bound(
    pose: Posture,
    u: Array,
    wrench: Applied,
    narrowed: tuple[Array, Array],
    bounds: tuple[Array, Array],
    force: float,
    at: LinkPoint | None,
) -> tuple[Kind, str, str]:
    """Return the bound that limits the force most: a change of it by 1 % changes the force most.

    At the largest force the tensions F at no bound and the multipliers y of the balance meet
    J_L y = 0 for these cables and u · J_v y = 1; then df/dF_c = (J_L y)_c of the others.
    """
    low, high = narrowed
    added = force_at(at, (1.0 - _BELOW) * force * u)
    load = combined(wrench, added)
    F = distribute_tension(pose, low, high, load).values
    near = _AT_BOUND * max(float(F.max(initial=0.0)), 1e-300)
    below = F - low <= near
    above = high - F <= near
    free = ~(below | above)
    rows = np.vstack([pose.length_jacobian[free], u @ jacobian_at(pose, at)[:3]])
    y = np.linalg.lstsq(rows, np.append(np.zeros(int(free.sum())), 1.0))[0]
    rate = pose.length_jacobian @ y
    rate = np.where(above, np.maximum(rate, 0.0), np.where(below, np.maximum(-rate, 0.0), 0.0))
    weight = rate * np.where(above, high, low)
    c = int((weight if weight.any() else rate).argmax())
    name = pose.arm.cables.names[c]
    at_top = bool(above[c])
    bound = float((high if at_top else low)[c])
    if bound != (bounds[1] if at_top else bounds[0])[c]:
        return "law", name, f"{'upper' if at_top else 'lower'} end of the law of {name}"
    words = "maximum" if at_top else "minimum"
    kind: Kind = "maximum" if at_top else "slack"
    return kind, name, f"{words} of {name} ({bound:.4g} N)"


def _limit_of(pose: Posture, event: Event, maximum: Array) -> str:
    """Return the words for the event that ends what locked motors hold."""
    words: dict[Kind, Callable[[str], str]] = {
        "maximum": lambda name: (
            f"maximum of {name} ({maximum[pose.arm.cables.names.index(name)]:.4g} N)"
        ),
        "law": lambda name: f"end of the law of {name}",
        "stop": lambda name: f"stop of {name}",
        "buckling": lambda name: f"buckling, {name} most",
    }
    return words[event.kind](event.place)

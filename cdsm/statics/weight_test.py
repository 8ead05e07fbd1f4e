"""Weight test of Section V: stiffness from the displacement under a weight (Eq. 20)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import combined, force_at, jacobian_at, position_at, scaled
from cdsm.dead_loads import LinkPoint
from cdsm.errors import EquilibriumError, InvalidInput
from cdsm.friction.stick import Breakaway, breakaway
from cdsm.loads import LoadsLike, link_point
from cdsm.posture import Posture
from cdsm.statics.continuation import follow
from cdsm.statics.crossings import Watched
from cdsm.statics.equilibrium import Equilibrium, as_equilibrium, equilibrium
from cdsm.statics.events import Event, events_text
from cdsm.statics.load_cycle import LoadHistory, follow_loads
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.pieces import Model, Stage, equilibrium_near, stage_at
from cdsm.statics.smooth_events import events_on, mass_of, watched
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import coordinates, plural, stiffness_text, without_rounding
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import unit_direction, vector, whole_number
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import Tension

SLIDING = 1.25  # an arm slides if its tangent is at most so many times the frictionless one

_MEASURED = 1e-12  # least displacement, over the arm's length, with about three correct digits
_DISPLACED = 1e-9  # least displacement, over the arm's length, above the rounding of equilibrium


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WeightTest(Result, Plotted):
    """States of an arm while a weight at its tip is increased in n equal steps.

    If the arm has friction in its holes, tips, displacements, tensions and stiffness are computed
    with it; ``unloaded``, ``states`` and ``tangent`` are frictionless.

    Attributes:
        force: ΔF (3,) [N], the dead force at the full load, base axes.
        unloaded: Equilibrium without the weight, under the wrench that also acts then.
        states: Equilibrium at each step; the last one is under the full load.
        breakaway: Load in the direction of the weight below which no cable slides, and the hole
            that slides first; None for an arm without friction, and if the test goes on from a
            rest with friction: there some cables are about to slide already.
        history: States with friction; load 0 is the arm without the weight. None without friction.
        smooth_events: Events without friction; see :attr:`events`.
        smooth_displacements: Displacement of the tip at each of them (m, 3) [m].
        point: Where the weight hangs and the displacement is read; None: the tip.
    """

    _headline = "stiffness"
    _rows = "loads"
    _figure = "plot_weight_test"

    force: Array = field(metadata=unit("N", "axis"))
    unloaded: Equilibrium
    states: tuple[Equilibrium, ...]
    breakaway: Breakaway | None = None
    history: LoadHistory | None = None
    smooth_events: tuple[Event, ...] = ()
    smooth_displacements: Array = field(default_factory=lambda: frozen(np.empty((0, 3))))
    point: LinkPoint | None = None

    @property
    def _posture(self) -> Posture:
        return self.states[-1].pose

    @quantity("N", "loads")
    def loads(self) -> Array:
        """Magnitude of the force at each step (n,) [N]."""
        count = len(self.states)
        return frozen(np.linalg.norm(self.force) * np.arange(1, count + 1) / count)

    @quantity("m", "loads", "axis")
    def displacements(self) -> Array:
        """Position of the tip, or ``point``, at each step minus that unloaded (n, 3) [m]."""
        if self.history is not None:
            if self.point is None:
                return frozen(self.history.tip[1:] - self.history.tip[0])
            places = [self._position(self.history.pose(k)) for k in self.history.load.tolist()]
            return frozen(np.array(places[1:]) - places[0])
        start = self._position(self.unloaded.pose)
        return frozen(np.array([self._position(state.pose) for state in self.states]) - start)

    @quantity("1")
    def events(self) -> tuple[Event, ...]:
        """What changes how the arm carries the weight, in the order of the loads.

        Cables that go slack, stops, maxima, ends of laws; with friction, cables that begin to slide
        in a hole, which ``breakaway`` gives to first order.
        """
        if self.history is None:
            return self.smooth_events
        size = float(np.linalg.norm(self.force))
        shares = [
            (event, (event.step - 1 + event.share) / len(self.states))
            for event in self.history.events
            if event.step
        ]
        return tuple(
            replace(event, share=share, load=share * size, step=None) for event, share in shares
        )

    @quantity("m", "event", "axis")
    def event_displacements(self) -> Array:
        """Displacement of the tip, or ``point``, at each event (m, 3) [m], as ``displacements``."""
        history = self.history
        if history is None:
            return self.smooth_displacements
        arm = history.arm
        start = self._position(history.pose(0))
        pairs = zip(history.events, history.event_angles, strict=True)
        moves = [
            self._position(arm.at(q, check_limits=False)) - start
            for event, q in pairs
            if event.step
        ]
        return frozen(np.array(moves).reshape(-1, 3))

    def _position(self, pose: Posture) -> Array:
        """Return where the weight hangs (3,) [m]."""
        return position_at(pose, self.point)

    def _along(self, stiffness: Stiffness | Equilibrium) -> float:
        """Return the stiffness [N/m] along the force, where it hangs."""
        if self.point is None:
            return stiffness.along(self.force)
        return stiffness.along(self.force, self.point.link, self.point.local)

    @quantity("N", "loads", "cable")
    def tensions(self) -> Array:
        """Cable tensions at each step (n, C) [N]; with friction, those at the motors."""
        if self.history is not None:
            return frozen(np.array([T[1:, 0] for T in self.history.tensions]).T)
        return frozen(np.array([state.tension for state in self.states]))

    @property
    def displacement(self) -> Array:
        """ΔX (3,) [m]: tip position with the full weight minus tip position without the weight."""
        return frozen(self.displacements[-1].copy())

    @quantity("N/m")
    def stiffness(self) -> float:
        """Secant `|ΔF|/(u·ΔX)` [N/m], `u = ΔF/|ΔF|` (1/C of Eq. 20); inf without motion."""
        return self._secant(self.displacement)

    @quantity("N/m")
    def frictionless(self) -> float:
        """The same secant [N/m] without friction."""
        start = self._position(self.unloaded.pose)
        return self._secant(self._position(self.states[-1].pose) - start)

    @quantity("N/m")
    def tangent(self) -> float:
        """Stiffness `1/(uᵀ C_vv u)` [N/m] along the force, without the weight and without friction.

        C is :attr:`Equilibrium.compliance` of ``unloaded``: joints at stops are fixed. Raises
        SingularStiffness if the arm without the weight is about to buckle.
        """
        return self._along(self.unloaded)

    @quantity("m", "axis")
    def tangent_displacement(self) -> Array:
        """Displacement `C_vv ΔF` (3,) [m] that the compliance without the weight predicts."""
        J = None if self.point is None else jacobian_at(self.unloaded.pose, self.point)
        return frozen(self.unloaded.compliance_of(J)[:3, :3] @ self.force)

    @quantity("N/m")
    def stuck(self) -> float | None:
        """Stiffness [N/m] along the weight while it is so small that all cables stick, or None."""
        first = self.breakaway
        return self._along(first.stiffness) if first else None

    @quantity("N")
    def breakaway_load(self) -> float | None:
        """Weight [N] below which no cable slides, to first order; or None as ``breakaway``."""
        return self.breakaway.load if self.breakaway else None

    @quantity("N")
    def sliding_load(self) -> float | None:
        """The first of ``loads`` from which on the arm slides [N]; None without friction.

        There, and at all larger ones, the tangent with friction is at most 1.25 times the
        frictionless one under the same load. It is inf if the arm does not slide at the last load,
        0 if no cable can stick. More steps give it more precisely.
        """
        if self.history is None or self.breakaway_load == 0.0:
            return self.breakaway_load
        slides = [
            self._along(self.history.stiffness(k)) <= SLIDING * self._along(state)
            for k, state in enumerate(self.states, 1)
        ]
        first = len(slides) - int(np.argmin([*slides[::-1], False]))
        return float(np.append(self.loads, math.inf)[first])

    @property
    def left_reference(self) -> bool:
        """Whether the given tensions did not balance the arm, so that it moved before the test."""
        return self.unloaded.moved > _DISPLACED * self.unloaded.pose.arm.length

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences if the arm leaves its reference or is not stable without the weight, or snaps.

        It snaps where it buckles, and comes to rest nearby.
        """
        sentences = list[str]()
        history = self.history
        if self.left_reference:
            moved = coordinates(1e3 * self.unloaded.displacement)
            without = "without friction " if history else ""
            left = (
                f"before the weight the arm did not stay there; {without}its tip moved by {moved} "
            )
            left += f"mm, from where all that is {without or 'shown '}is measured"
            if history:
                left += f"; with friction by {coordinates(1e3 * history.displacement[0])} mm"
            sentences.append(f"LEFT ITS REFERENCE: {left}")
        if not self.unloaded.stable:
            sentences.append("NEUTRAL: before the weight, not every joint is brought back")
        snaps = [event for event in self.smooth_events if event.kind == "buckling"]
        snaps = [] if history else snaps
        sentences += [
            f"SNAPS THROUGH: at {event.load:.4g} N {event.place} moves" for event in snaps
        ]
        return (*sentences, *(history.warnings if history else ()))

    def __str__(self) -> str:
        rows = [f"{'load [N]':>10}{'x [mm]':>12}{'y [mm]':>12}{'z [mm]':>12}"]
        names = [*(f"{load:.4g}" for load in self.loads), "linear"]
        moves = without_rounding(np.vstack([self.displacements, self.tangent_displacement]))
        for name, moved in zip(names, moves, strict=True):
            rows.append(f"{name:>10}" + "".join(f"{1e3 * x:>12.4g}" for x in moved))
        model = frictionless_model(self.unloaded.pose.arm)
        rows += [
            f"stiffness along the force: measured {stiffness_text(self.stiffness)}, "
            f"linear {stiffness_text(self.tangent)}",
            f"(linear is {model}; measured the secant over this weight)",
            *([f"weight on {self.point.link}, read there"] if self.point else []),
            *events_text(self.events),
            *self._about_friction(),
        ]
        if self.unloaded.at_limit:
            rows.append(f"before the weight at a stop: {', '.join(self.unloaded.at_limit)}")
        return "\n".join([*self.warnings, *rows])

    def _secant(self, displacement: Array) -> float:
        moved = float(displacement @ unit_direction("force", self.force))
        measured = abs(moved) > _MEASURED * self.unloaded.pose.arm.length
        return float(np.linalg.norm(self.force)) / moved if measured else math.inf

    def _about_friction(self) -> list[str]:
        """Say which weights measure which stiffness."""
        if self.history is None:
            return []
        sliding = np.count_nonzero(self.history.sliding[-1])
        slide = f"{sliding} of {plural(len(self.history.holes), 'hole')} slide"
        if self.stuck is None:
            goes_on = "the weight goes on from a rest with friction; under the full one"
            return [
                f"{goes_on} {slide}; without friction it would measure "
                f"{stiffness_text(self.frictionless)}"
            ]
        if self.breakaway_load == 0.0:
            reason = "friction holds no cable here: "
            return [f"{reason}one is slack, or the cables go straight through all holes"]
        slides = f"at {self.sliding_load:.4g} N they slide: from here on the tangent is at most "
        slides += f"{100.0 * (SLIDING - 1.0):.0f} % above that of the same load without friction"
        if self.sliding_load == math.inf:
            slides = "under this weight the cables do not slide throughout yet: hang more"
        return [
            f"below {self.breakaway_load:.4g} N all cables stick: a weight measures "
            f"{stiffness_text(self.stuck)}",
            slides,
            f"this weight, {self.loads[-1]:.4g} N, measures {stiffness_text(self.stiffness)}; "
            f"{slide}",
            "so take the difference of two weights with which they slide, and compare it with "
            "theirs without friction; this weight alone would measure "
            f"{stiffness_text(self.frictionless)} without friction",
        ]


def weight_test(
    pose: Posture,
    tension: Tension | Equilibrium | ArrayLike,
    force: ArrayLike,
    *,
    steps: int = 1,
    wrench: LoadsLike | None = None,
    link: str | None = None,
    point: ArrayLike | None = None,
) -> WeightTest:
    """Compute the stiffness under a weight hung at the tip, with locked motors: 1/C of Eq. 20.

    The test is nonlinear: the tensions follow the elongations, and the posture changes. For a small
    force the result is :meth:`~cdsm.Stiffness.along`. With friction in the holes it depends on the
    weight: under a small one all cables stick; :attr:`WeightTest.sliding_load` is the weight from
    which they slide. The weight is hung once and slowly, as in :func:`~cdsm.load_cycle`.

    Args:
        pose: The reference posture, at which the motors are locked.
        tension: F at the reference, as for :func:`~cdsm.equilibrium`. If these tensions do not
            balance the arm, the test starts from the equilibrium they lead to. Or an
            :class:`Equilibrium` with this posture, as of :func:`~cdsm.forward_statics`: the test
            starts there, and its motors go on holding the tensions, or the lengths. With friction
            its history goes on, and the states without it are those of the same motors.
        force: ΔF (3,) [N] at ``tool0`` in base axes, added to ``wrench``.
        steps: Number of equal load steps, at most 1000.
        wrench: Wrench (6,) without the weight: force [N], then moment [N m]. Default: the wrench of
            the ``Tension``, or zero. Or loads on links, as for :func:`~cdsm.stiffness`.
        link: Link on which the weight hangs, and of which the displacement is read; None: the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: As for :func:`~cdsm.equilibrium`; or the force is zero or moves the tip by
            rounding only; or ``steps`` is not a whole number from 1 to 1000.
        ElasticityRangeError: As for :func:`~cdsm.equilibrium`, at any step.
        EquilibriumError: The arm buckles under a part of the load. The error names this part.
            :func:`~cdsm.equilibrium` finds the posture after buckling.
        SingularStiffness: The arm has friction and is about to buckle without the weight.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> print(cdsm.weight_test(pose, F, [0, -5, 0]))
          load [N]      x [mm]      y [mm]      z [mm]
                 5      0.4314      -1.904     -0.8392
            linear      0.6876       -2.22      -0.739
        stiffness along the force: measured 2.627 N/mm, linear 2.252 N/mm
        (linear is frictionless, rigid links, tangent; measured the secant over this weight)
    """
    force = vector("force", force, 3, "a force in base axes [N]", "force")
    if not force.any():
        raise InvalidInput("force", "is zero; nothing moves, and there is nothing to measure.")
    steps = whole_number("steps", steps, 1, 1000)
    if isinstance(tension, Equilibrium):
        unloaded = tension.resumed(pose, wrench)
        held = unloaded.held_posture(unloaded.force_controlled)
        followed = unloaded.path is not None
        unloaded = unloaded.without_friction() if followed else unloaded
    else:
        unloaded = equilibrium(pose, tension, wrench)
        held = pose
        followed = False
    states = [unloaded]
    at = link_point(pose.arm, link, point)
    added = force_at(at, force)
    W = unloaded.applied

    def model(share: float) -> LockedArm:
        return unloaded.model.under(combined(W, scaled(added, share)))

    size = float(np.linalg.norm(force))
    watch = watched(unloaded.model)
    here = stage_at(model, unloaded.pose, unloaded.stop_torque, 0.0)
    branch = list[Stage]()
    for i in range(steps):
        goal = (i + 1) / steps
        way = follow(model, here, goal)
        branch += way[1:] if branch else way
        here = way[-1]
        if here.share < goal:
            raise _buckled(model, branch, watch, force)
        states.append(as_equilibrium(model(goal), here.point))
    events = events_on(model, branch, watch, size, 1.0)
    test = WeightTest(
        force=force,
        unloaded=unloaded,
        states=tuple(states[1:]),
        smooth_events=events,
        smooth_displacements=_displacements(model, branch, events, at),
        point=at,
    )
    if math.isinf(test.frictionless) and math.isfinite(test.tangent):
        problem = f"{np.abs(force).max():.3g} N moves the tip by rounding only; hang at least "
        raise InvalidInput("force", f"{problem}{_MEASURED * pose.arm.length * test.tangent:.1g} N.")
    if not pose.arm.has_friction:
        return test
    hung = [combined(W, scaled(added, k / steps)) for k in range(steps + 1)]
    first = None if followed else breakaway(held, unloaded.reference_tension, force, W, link, point)
    return WeightTest(
        force=force,
        unloaded=unloaded,
        states=test.states,
        breakaway=first,
        history=follow_loads(pose, tension, hung)[0],
        point=at,
    )


def _displacements(
    model: Model, branch: list[Stage], events: Sequence[Event], point: LinkPoint | None
) -> Array:
    """Return how far the tip or a point has moved at each event of a branch (m, 3) [m]."""
    start = position_at(branch[0].pose, point)
    moves = list[Array]()
    for event in events:
        near = min(branch, key=lambda stage: abs(stage.share - event.share))
        stage = equilibrium_near(model, event.share, near) or near
        moves.append(position_at(stage.pose, point) - start)
    return frozen(np.array(moves).reshape(-1, 3))


def _buckled(
    model: Model, branch: list[Stage], watch: Watched[Stage], force: Array
) -> EquilibriumError:
    """Return the error of an arm that buckles before it bears ``force`` (3,) [N]."""
    size = float(np.linalg.norm(force))
    *events, end = events_on(model, branch, watch, size, 1.0)
    before = f" ({'; '.join(map(str, events))})" if events else ""
    motors = "motors that hold tensions" if branch[-1].arm.tension_held else "locked motors"
    mass = mass_of(branch[-1].pose.arm, force / size, end.load)
    weight = f"{end.load:.4g} N" + ("" if mass is None else f" ({mass:.4g} kg)")
    where = f"at {100.0 * end.share:.4g} % of the load, under {weight}"
    residual = branch[-1].point.state.residual
    return EquilibriumError(
        f"with {motors} the arm buckles {where}: {end.place} buckles{before}",
        residual,
        end.share,
        end.place,
    )

"""States of an arm with friction in its holes under a series of slow loads and motor commands."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.applied import Applied, as_loads, tip_part
from cdsm.errors import InvalidInput, listed
from cdsm.friction.capstan import assemble_segments
from cdsm.loads import LoadsLike, has_loads, loads_of
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.events import Event, PathPart, events_text
from cdsm.statics.hung_loads import HungLoad, hung_loads, total_force
from cdsm.statics.quasi_static import (
    NO_PATH,
    Action,
    EquilibriumPath,
    QuasiStaticArm,
    QuasiStaticState,
)
from cdsm.statics.slow_events import Way, slow_events
from cdsm.stiffness_matrix import FrictionState, Stiffness, checked_tension
from cdsm.stiffness_matrix.verdict import find_skewness
from cdsm.support.files import write_file
from cdsm.support.format import merged, prepare_json, without_rounding
from cdsm.support.progress import show_progress
from cdsm.support.result import AXIS_NAMES, Result, data_frame, quantity, unit
from cdsm.support.validation import WRENCH, instance, number_array, whole_number
from cdsm.support.values import Array, Plotted, frozen
from cdsm.tension import Tension

WrenchesLike = ArrayLike | Mapping[str, ArrayLike] | Sequence[LoadsLike]
"""Wrenches (n, 6) at the tip; or such wrenches by the names of links; or what acts n times."""

_SHOWN = 24  # largest number of loads that are printed; of more, the first and the last ones


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LoadHistory(Result, Plotted):
    """States of an arm with friction, load by load; made by :func:`~cdsm.load_cycle`.

    There are n loads. Their numbers count from 0, as the rows of all arrays do: ``pose(k)`` and
    ``stiffness(k)`` belong to ``tip[k]``. The S segments and P holes are in the order of
    :attr:`Posture.segments`. The rest length of wire is its length at zero strain. All arrays are
    read-only.

    Attributes:
        reference: Posture at which the motors were locked.
        reference_tension: F (C,) [N] at the reference, the same in all segments of a cable; if the
            cycle goes on from a rest with friction, F at the motors.
        reference_wrench: W at the tip at the reference (6,): force [N], then moment [N m].
        reference_applied: What acts at the reference: W (6,) at the tip, or loads on links.
        load: Number of each load (n,), from 0: its row in ``wrenches``.
        wrenches: W of what acts at the tip at each load (n, 6): force [N], then moment [N m].
        applied: What acts at each load (n): W (6,) at the tip, or loads on links.
        motors: Commands at each load (n, C): rest length [m] that a position-controlled motor has
            taken in since the reference, or the tension [N] of a force-controlled one.
        angles: Joint coordinates at each load (n, nv) [rad].
        tip: Position of the tip at each load (n, 3) [m].
        segment_tensions: T of each segment at each load (n, S) [N].
        slip: Rest length of wire that moved through each hole during the step to each load (n, P)
            [m]; positive towards the end of the cable.
        sliding: Where the cable slides as the load is reached (n, P): 1 if wire moves through the
            hole towards the end of the cable, −1 if towards its motor, 0 if the cable sticks or the
            hole has no friction.
        stop_torque: Torque of the stops on the joints at each load (n, nv) [N m].
        dissipated: Work lost to friction during the step to each load (n,) [J].
        snaps: Whether the arm snaps through in the step to each load (n,).
    """

    _headline = "dissipated"
    _rows = "load"
    _figure = "plot_load_history"

    reference: Posture
    reference_tension: Array = field(metadata=unit("N", "cable"))
    reference_wrench: Array = field(metadata=unit("N and N m", "component"))
    reference_applied: Applied
    load: NDArray[np.int_] = field(metadata=unit("1", "load"))
    wrenches: Array = field(metadata=unit("N and N m", "load", "component"))
    applied: tuple[Applied, ...]
    motors: Array = field(metadata=unit("m or N", "load", "cable"))
    angles: Array = field(metadata=unit("joint", "load", "joint"))
    tip: Array = field(metadata=unit("m", "load", "axis"))
    segment_tensions: Array = field(metadata=unit("N", "load", "segment"))
    slip: Array = field(metadata=unit("m", "load", "hole"))
    sliding: NDArray[np.int8] = field(metadata=unit("1", "load", "hole"))
    stop_torque: Array = field(metadata=unit("torque", "load", "joint"))
    dissipated: Array = field(metadata=unit("J", "load"))
    snaps: NDArray[np.bool_] = field(metadata=unit("1", "load"))
    way: Way

    @cached_property
    def _located(self) -> tuple[tuple[Event, ...], Array]:
        return slow_events(self.way, self.holes)

    @quantity("1")
    def events(self) -> tuple[Event, ...]:
        """What happens on the way, in its order; located when first asked for.

        Holes in which a cable begins to slide, cables that go slack, pass their maximum or leave
        their law in any segment, that lift off pulleys, leave their grooves or touch them, joints
        that reach their stops, losses of stability. They are roots within the sub-steps. What
        begins and ends within one sub-step is noticed by the cubic through its ends and slopes.
        """
        return self._located[0]

    @quantity("joint", "event", "joint")
    def event_angles(self) -> Array:
        """Joint coordinates at each event (m, nv) [rad]."""
        return self._located[1]

    @quantity("m", "event", "axis")
    def event_displacements(self) -> Array:
        """Displacement at each event (m, 3) [m]: of the tip, or of the point of the only load."""
        poses = [self.arm.at(q, check_limits=False) for q in self.event_angles]
        point = self.on_links[0].point if self.read[0] != "tip" else None
        places = [pose.tip[:3, 3] if point is None else point.position(pose) for pose in poses]
        start = self.reference
        before = start.tip[:3, 3] if point is None else point.position(start)
        return frozen(np.array(places).reshape(-1, 3) - before)

    @property
    def _events_by_step(self) -> list[list[Event]]:
        steps = [list[Event]() for _ in self.load]
        for event in self.events:
            assert event.step is not None
            steps[event.step].append(event)
        return steps

    @property
    def arm(self) -> Manipulator:
        """The arm."""
        return self.reference.arm

    @quantity("joint", "joint")
    def reference_angles(self) -> Array:
        """Joint coordinates at the reference (nv,) [rad]."""
        return self.reference.q

    @quantity("m", "load", "axis")
    def displacement(self) -> Array:
        """Displacement of the tip from the reference at each load (n, 3) [m]."""
        return frozen(self.tip - self.reference.tip[:3, 3])

    @cached_property
    def on_links(self) -> tuple[HungLoad, ...]:
        """Loads on links: their ``point``, ``wrenches`` (n, 6) and its ``displacement`` (n, 3) [m].

        Empty if all loads act at the tip.
        """
        poses = [self.pose(k) for k in self.load.tolist()] if self._has_links else []
        return hung_loads(self.reference, self.applied, poses)

    @property
    def forces(self) -> Array:
        """Sum of all forces at each load (n, 3) [N]."""
        return np.array([total_force(applied) for applied in self.applied])

    @property
    def read(self) -> tuple[str, Array]:
        """What is shown to move: the link of the only load, or the tip; its displacement (n, 3)."""
        hung = self.on_links
        if len(hung) == 1 and not self.wrenches.any():
            return hung[0].point.link, hung[0].displacement
        return "tip", self.displacement

    @property
    def _has_links(self) -> bool:
        return any(as_loads(applied).on_links for applied in self.applied)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Sentences with the loads at which the arm snaps through, or a shock may move it.

        All states after a snap-through can depend on the sub-steps.
        """
        snaps = [f"SNAPS THROUGH at load {k}" for k in np.flatnonzero(self.snaps).tolist()]
        arm = self.arm
        for k in self.load.tolist():
            free = np.flatnonzero(self.stop_torque[k] == 0.0)
            K = self.stiffness(k).joint[np.ix_(free, free)] if self.sliding[k].any() else None
            found = () if K is None else find_skewness(K, arm)
            snaps += [f"at load {k}, {finding.sentence}" for finding in found]
        return tuple(snaps)

    @cached_property
    def tensions(self) -> tuple[Array, ...]:
        """Tensions of the segments of each cable, from motor to end: one (n, segments) [N] each."""
        ends = self.reference.segments.chains.start[1:-1]
        return tuple(frozen(T.copy()) for T in np.split(self.segment_tensions, ends, axis=1))

    @property
    def holes(self) -> tuple[str, ...]:
        """Name of each hole (P,): its cable, and the number of the site from the actuator."""
        return self.reference.segments.chains.hole_names

    @property
    def segment_names(self) -> tuple[str, ...]:
        """Name of each segment (S,): its cable, and its number from the actuator."""
        return self.reference.segments.chains.segment_names

    def pose(self, load: int) -> Posture:
        """Return the posture at a load, by its number in :attr:`load`; −1 is the last load.

        Raises InvalidInput if there is no such load.
        """
        return self.reference.arm.at(self.angles[self._index(load)], check_limits=False)

    def stiffness(self, load: int) -> Stiffness:
        """Compute the tangent stiffness at a load, by its number in :attr:`load`; −1: the last.

        It is valid while the cables continue to slide in the same holes and directions.
        """
        k = self._index(load)
        sliding = self.sliding[k] != 0
        T = self.segment_tensions[k].copy()
        friction: FrictionState = "sliding" if sliding.any() else "stuck"
        return assemble_segments(self.pose(k), T, sliding, self.applied[k], friction)

    def write_loop(self, path: str | os.PathLike[str]) -> Path:
        """Write force, displacement, sliding holes, lost work and events as CSV; return the path.

        Forces and displacements are those at the tip; more columns have those of loads on links.
        Events stand in the row of the load that ends their step, with their own loads.
        One row per load; :meth:`write` writes all states. Raises CdsmError without pandas, and
        FileError if the file cannot be written.
        """
        columns: dict[str, Any] = {}
        for i, axis in enumerate(AXIS_NAMES):
            columns[f"force {axis} [N]"] = self.wrenches[:, i]
        for i, axis in enumerate(AXIS_NAMES):
            columns[f"displacement {axis} [m]"] = self.displacement[:, i]
        for k, hung in enumerate(self.on_links, start=1):
            where = f"of load {k} on {hung.point.link}"
            for i, axis in enumerate(AXIS_NAMES):
                columns[f"force {axis} {where} [N]"] = hung.wrenches[:, i]
            for i, axis in enumerate(AXIS_NAMES):
                columns[f"displacement {axis} {where} [m]"] = hung.displacement[:, i]
        columns["sliding holes"] = np.count_nonzero(self.sliding, axis=1)
        columns["dissipated [J]"] = self.dissipated
        columns["events"] = [
            "; ".join(f"{event.label} {replace(event, step=None).where}" for event in happening)
            for happening in self._events_by_step
        ]
        return write_file(path, data_frame(columns, "load", self.load).to_csv)

    def __str__(self) -> str:
        what, displacement = self.read
        moved_by = f"{what} moved by [mm]"
        several = len(self.on_links) > 1 or (self._has_links and what == "tip")
        force_of = "sum of forces [N]" if several else "force [N]"
        rows = [f"{'load':>5}{force_of:>35}{moved_by:>30}{'sliding':>9}{'lost [mJ]':>12}"]
        count = len(self.load)
        moves = without_rounding(displacement)
        forces = self.forces
        for k in range(count):
            if count > _SHOWN and _SHOWN // 2 <= k < count - _SHOWN // 2:
                rows += [f"{'…':>5}"] * (k == _SHOWN // 2)
                continue
            force = "".join(f"{f:>z11.4g}" for f in forces[k])
            moved = "".join(f"{1000.0 * x:>z10.4f}" for x in moves[k])
            slide = np.count_nonzero(self.sliding[k])
            lost = 1000.0 * self.dissipated[k]
            rows.append(f"{k:>5}  {force}{moved}{slide:>9}{lost:>12.4g}")
        lost = 1000.0 * self.dissipated.sum()
        links = [hung.point.link for hung in self.on_links]
        rows += [f"loads on {listed(links)}"] * several
        rows.append(f"{self.sliding.shape[1]} holes; in all {lost:.4g} mJ lost in the holes")
        rows += events_text(self.events)
        return "\n".join(rows)

    def to_dict(self) -> dict[str, object]:
        """Return all numbers in SI for JSON, units in the keys; ``loads`` are those on links."""
        loads = [hung.to_dict() for hung in self.on_links]
        numbers = super().to_dict()
        del numbers["motors_m_or_N"]  # each command has its own unit
        more: dict[str, object] = {"loads": loads} if loads else {}
        for cable, column in zip(self.arm.cables, self.motors.T, strict=True):
            commands: Any = more.setdefault(
                f"motors_{'m' if cable.control == 'position' else 'N'}", {}
            )
            commands[cable.name] = column
        return merged(numbers, prepare_json(more))

    def _labels(self) -> dict[str, Sequence[object]]:
        return {**super()._labels(), "hole": self.holes, "segment": self.segment_names}

    def _index(self, load: int) -> int:
        count = len(self.load)
        return whole_number("load", load, -count, count - 1) % count


def load_cycle(
    pose: Posture,
    tension: Tension | Equilibrium | ArrayLike,
    wrenches: WrenchesLike,
    *,
    motors: ArrayLike | None = None,
    substeps: int = 4,
) -> LoadHistory:
    """Compute the states of an arm with friction under a series of slowly applied loads.

    Under a load the arm is in equilibrium, `r(q) = Σ T_j g_j + g − J_Xᵀ W = 0` (Eq. 13 by
    segments), with the gravity torque g, the tension `T_j` of segment j and the gradient `g_j` of
    its length. At hole j, which bends the cable by `φ_j`, `|ln T_{j+1} − ln T_j| ≤ μ φ_j` with the
    friction coefficient μ. Wire moves through a hole only at this bound, towards the larger
    tension. So each state depends on all earlier loads. The first state is the reference, with one
    tension in all segments of a cable, as after shaking the arm; or a rest with friction, whose
    history goes on. Between two loads the wrench and the commands change linearly and slowly,
    without inertia. Joint limits are stops. Without friction each load gives the
    :func:`~cdsm.equilibrium`.

    In rare cases several postures are in equilibrium. Then the result is the one that the search
    from the previous posture finds.

    Args:
        pose: The reference posture, at which the motors are locked.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N]. If they do not balance the arm, it settles on the way to the first
            load. Or an :class:`Equilibrium` with this posture, as of :func:`~cdsm.forward_statics`:
            its motors go on holding the tensions, or the lengths, of slack cables too; if it has a
            ``path``, the segments begin with the tensions that friction left them.
        wrenches: W of each load (n, 6) at ``tool0`` in base axes: force [N], then moment [N m]; or
            a dict of them by links; or a list of n entries, each a dict by links or a list of
            :class:`~cdsm.Load`.
            Before the first load the wrench is that of the ``Tension``, or zero.
        motors: Commands of the motors at each load (n, C): for a position-controlled cable the rest
            length (at zero strain) of wire taken in since the reference [m], positive if the motor
            pulls; for a force-controlled cable its tension [N]. Default: 0 m, and the tension F at
            the reference. A motor cannot take in all wire of its cable. With motors that move
            several cables (n, M), in the order of ``arm.motors.names``: the turn since the
            reference [rad]. A motor that holds a torque keeps that of the reference; its command is
            0. Motors that yield are refused with friction.
        substeps: Number of equal steps between two loads, from 1 to 1000. A step is exact if no
            hole stops sliding within it. With 4, the tips of random arms are off by 1 % of the
            largest displacement at worst, half of them by less than 0.03 %; the dissipated work is
            off by 0.3 % (median). On average the errors fall as 1/``substeps``.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`; or the posture is beyond a joint limit; or
            ``wrenches``, ``motors`` or ``substeps`` are not as above.
        ElasticityRangeError: A tension at the reference or at a load is outside the domain of its
            law.
        EquilibriumError: No equilibrium was found in the step to a load. The error names the load,
            and says so if cables slide, where `K_θ` is not symmetric.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype(friction=0.1).at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> loads = [[0, 0, 0, 0, 0, 0], [0, -4, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]]
        >>> history = cdsm.load_cycle(pose, F, loads)
        >>> print(f"{1e3 * history.dissipated.sum():.3f} mJ lost in the holes")
        0.567 mJ lost in the holes
    """
    return follow_loads(pose, tension, wrenches, motors=motors, substeps=substeps)[0]


def follow_loads(
    pose: Posture,
    tension: Tension | Equilibrium | ArrayLike,
    wrenches: WrenchesLike,
    *,
    motors: ArrayLike | None = None,
    substeps: int = 4,
    near: Sequence[EquilibriumPath] = (),
) -> tuple[LoadHistory, tuple[EquilibriumPath, ...]]:
    """Compute what :func:`load_cycle` does, and the path to each load (n).

    The searches begin at the paths ``near``, such as those of a similar arm: then they take fewer
    steps.
    """
    slack = np.zeros(len(instance("pose", pose, Posture).arm.cables))
    T: Array | None = None
    if isinstance(tension, Equilibrium):
        rest = tension.resumed(pose, None)
        pose = rest.held_posture(rest.force_controlled)
        F = rest.tension
        W = rest.applied
        slack = rest.paid_out
        T = rest.stiffness.segment_tension
    else:
        F, W = checked_tension(pose, tension, None)
    pose.arm.laws.stiffness(pose.cable_lengths, F)  # in the domains of the laws
    loads = _loads(pose.arm, wrenches)
    substeps = whole_number("substeps", substeps, 1, 1000)
    arm = QuasiStaticArm(pose, F)
    state = arm.initial(W, slack, T)
    commands = np.tile(state.load.motors, (len(loads), 1))
    if motors is not None:
        wire = np.add.reduceat(state.arm_state.chain.rest_length, arm.start[:-1])
        taken = _taken_in(motors, pose, len(loads)) if pose.arm.motors.given else motors
        commands = _commands(taken, pose, commands.shape, wire)
    goals = [
        Approach(wrench, command, substeps, f"the step to load {k}")
        for k, (wrench, command) in enumerate(zip(loads, commands, strict=True))
    ]
    return approach(arm, state, goals, near)


def _loads(arm: Manipulator, wrenches: WrenchesLike) -> Sequence[Applied]:
    """Return what acts at each load; InvalidInput if it is not (n, 6), or (n, 6) by links."""
    if isinstance(wrenches, (list, tuple)) and any(map(has_loads, wrenches)):
        return [loads_of(arm, load, f"wrenches[{k}]") for k, load in enumerate(wrenches)]
    if not isinstance(wrenches, Mapping):
        return list(_rows("wrenches", wrenches))  # type: ignore[arg-type]
    rows = {link: _rows(f"wrenches[{link!r}]", W) for link, W in wrenches.items()}
    counts = {len(W) for W in rows.values()}
    if len(counts) != 1:
        raise InvalidInput("wrenches", "give (n, 6) for each link, n loads for all of them.")
    return [
        loads_of(arm, {link: W[k] for link, W in rows.items()}, "wrenches")
        for k in range(counts.pop())
    ]


def _rows(name: str, wrenches: ArrayLike) -> Array:
    """Return wrenches (n, 6), checked."""
    rows = number_array(name, wrenches, "wrench")
    if rows.ndim != 2 or rows.shape[1] != 6 or not len(rows):
        raise InvalidInput(
            name,
            f"shape {rows.shape} given, (n, 6) needed, n > 0: one wrench per load ({WRENCH}).",
        )
    return rows


class Approach(NamedTuple):
    """A load, and how it is approached."""

    wrench: Applied  # W (6,): force [N], then moment [N m]; or loads on links
    motors: Array  # commands (C,), as those of a LoadHistory
    substeps: int  # number of equal steps on the way
    what: str  # name of the way, in errors
    part: PathPart | None = None  # of forward statics


def approach(
    arm: QuasiStaticArm,
    start: QuasiStaticState,
    goals: Sequence[Approach],
    near: Sequence[EquilibriumPath] = (),
    begin: float = 0.0,
) -> tuple[LoadHistory, tuple[EquilibriumPath, ...]]:
    """Load an arm slowly from one goal to the next, from a state at its reference.

    ``near`` is as in :func:`follow_loads`. ``begin`` is the share of the way to the first goal that
    ``start`` has behind it.
    """
    pose = arm.reference
    none = np.zeros(pose.q.size)
    loads = tuple(Action(goal.wrench, none, goal.motors) for goal in goals)
    states = []
    steps = []
    state = start
    for k, goal in enumerate(show_progress(goals, "loads")):
        known = near[k] if near else NO_PATH
        state, step = arm.step_to(state, loads[k], goal.substeps, goal.what, known)
        states.append(state)
        steps.append(step)
    paths = tuple(step.path for step in steps)
    hole = pose.segments.chains.hole
    rough = pose.segments.chains.friction > 0.0
    arms = [state.arm_state for state in states]
    last = np.array([arm_state.chain.slip[hole] for arm_state in arms])
    history = LoadHistory(
        reference=pose,
        reference_tension=arm.tension,
        reference_wrench=tip_part(start.load.wrench),
        reference_applied=start.load.wrench,
        load=frozen(np.arange(len(goals))),
        wrenches=frozen(np.array([tip_part(goal.wrench) for goal in goals])),
        applied=tuple(goal.wrench for goal in goals),
        motors=frozen(np.array([goal.motors for goal in goals])),
        angles=frozen(np.array([arm_state.pose.q for arm_state in arms])),
        tip=frozen(np.array([arm_state.pose.tip[:3, 3] for arm_state in arms])),
        segment_tensions=frozen(np.array([arm_state.chain.tension for arm_state in arms])),
        slip=frozen(np.array([step.slip[hole] for step in steps])),
        sliding=frozen(np.where(rough, np.sign(last), 0.0).astype(np.int8)),
        stop_torque=frozen(np.array([state.stop_torque for state in states])),
        dissipated=frozen(np.array([step.dissipated for step in steps])),
        snaps=frozen(np.array([step.snapped for step in steps])),
        way=Way(
            arm,
            start,
            loads,
            tuple(goal.substeps for goal in goals),
            paths,
            tuple(goal.part for goal in goals),
            begin,
        ),
    )
    return history, paths


def _taken_in(motors: ArrayLike, pose: Posture, count: int) -> Array:
    """Return the wire of each cable that turns of all motors (n, M) take in, (n, C) [m].

    Motors of single cables have their own commands.
    """
    drives = pose.arm.motors
    turns = number_array("motors", motors)
    if turns.shape != (count, len(drives)):
        needed = f"for each load one command per motor, {', '.join(drives.names)}"
        problem = f"shape {turns.shape} given, {(count, len(drives))} needed: {needed}."
        raise InvalidInput("motors", problem)
    for motor, column in zip(drives.given, turns.T, strict=False):
        if motor.control == "torque" and column.any():
            problem = f"{motor.name} holds its torque in a load cycle; give 0 for it."
            raise InvalidInput("motors", problem)
    return np.asarray(turns @ drives.matrix.T)


def _commands(motors: ArrayLike, pose: Posture, shape: tuple[int, ...], wire: Array) -> Array:
    """Return ``motors`` checked, as an array (n, C); ``wire`` (C,) [m] are the rest lengths."""
    commands = number_array("motors", motors)
    cables = pose.arm.cables
    if commands.shape != shape:
        raise InvalidInput(
            "motors",
            f"shape {commands.shape} given, {shape} needed: for each load one command per cable.",
        )
    held = cables.position_controlled
    number_array("motors", commands[:, held], "length")
    tensions = number_array("motors", commands[:, ~held], "tension")
    if tensions.min(initial=0.0) < 0.0:
        raise InvalidInput("motors", f"{tensions.min():g} N given; cables only pull.")
    beyond = held & (commands >= wire)
    if beyond.any():
        k, c = np.argwhere(beyond)[0].tolist()
        raise InvalidInput(
            "motors",
            f"{commands[k, c]:g} m of wire taken in for {cables.names[c]} at load {k}; it has "
            f"only {wire[c]:.4g} m. Take in less.",
        )
    return commands

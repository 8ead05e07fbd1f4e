"""Simulate an arm with friction in its holes under a series of slow loads and motor commands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.friction.chain_problem import ChainProblem
from cdsm.posture import Posture
from cdsm.statics.load_history import LoadHistory
from cdsm.statics.locked_motors import LoadedArm, stops
from cdsm.statics.rest_search import require_between_stops
from cdsm.statics.slow_loading import Load, SlowLoading, State, StepEnergies
from cdsm.stiffness_matrix import checked_tension
from cdsm.support.progress import track
from cdsm.support.validation import WRENCH, number_array, scalar
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

MOST_LOADS = 100_000
"""Largest number of loads of a history."""

_LEAST, _MOST = 1e-12, 0.1
"""Smallest and largest ``accuracy``: below the first, the energy error is rounding."""

_SNAP = 0.05
"""An arm snaps through in a step if the unaccounted energy is above this part of the turnover.

The turnover is the largest sum |work| + |stored| + dissipated of all steps. Without a snap-through
even the coarsest ``accuracy``, 10 % of the work, leaves less: the sum counts the work and also the
energy that it becomes.
"""


def load_cycle(
    pose: Posture,
    tension: Tension | ArrayLike,
    wrenches: ArrayLike,
    *,
    motors: ArrayLike | None = None,
    accuracy: float = 1e-3,
) -> LoadHistory:
    """Compute the states of an arm with friction under a series of slowly applied loads.

    Under a load the arm is in equilibrium, r(q) = Σ T_j g_j + g − J_Xᵀ W = 0 (Eq. 13 by segments),
    with the gravity torque g, the tension T_j of segment j and the gradient g_j of its length. At
    hole j, which bends the cable by φ_j, |ln T_{j+1} − ln T_j| ≤ μ φ_j with the friction
    coefficient μ. Wire moves through a hole only at this bound, towards the larger tension. So each
    state depends on all earlier loads. The first state is the reference, with one tension in all
    segments of a cable, as after shaking the arm. Between two loads the wrench and the commands
    change linearly and slowly, without inertia. Joint limits are stops. Without friction each load
    gives the :func:`~cdsm.equilibrium`.

    In rare cases several postures are in equilibrium. Then the result is the one that the search
    from the previous posture finds.

    Args:
        pose: The reference posture, at which the motors are locked.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N]. If they do not balance the arm, it settles on the way to the first
            load.
        wrenches: W of each load (n, 6) at ``tool0`` in base axes: force [N], then moment [N m].
            Before the first load the wrench is that of the ``Tension``, or zero.
        motors: Commands of the motors at each load (n, C): for a position-controlled cable the
            natural length (at zero strain) of wire taken in since the reference [m], positive if
            the motor pulls; for a force-controlled cable its tension [N]. Default: 0 m, and the
            tension F at the reference. A motor cannot take in all wire of its cable.
        accuracy: Largest error of the energy balance (work − stored energy − dissipation) of each
            step, relative to the work, from 1e-12 to 0.1. Steps are divided into sub-steps until
            the error is smaller. The net work of a thin loop is much less than the work of its
            steps, so its loss is known less well. The division changes tips and tensions only if a
            hole stops sliding within a sub-step: with 1e-3, the tips of 39 random arms were then
            off by up to 0.5 % of the largest displacement, half of them by less than 0.06 %. A
            snap-through cannot keep the balance: see ``warnings`` of the result.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`; or the posture is beyond a joint limit; or
            ``wrenches``, ``motors`` or ``accuracy`` are not as above.
        ElasticityRangeError: A tension at the reference or at a load is outside the domain of its
            law.
        EquilibriumError: No equilibrium was found in the step to a load. The error names the load.
    """
    F, W = checked_tension(pose, tension, None)
    pose.arm._laws.stiffness(pose.cable_lengths, F)  # in the domains of the laws
    loads = number_array("wrenches", wrenches, "wrench")
    if loads.ndim != 2 or loads.shape[1] != 6 or not 0 < len(loads) <= MOST_LOADS:
        raise InvalidInput(
            "wrenches",
            f"shape {loads.shape} given, (n, 6) with n from 1 to {MOST_LOADS} needed: one wrench "
            f"per load ({WRENCH}).",
        )
    loading = slow_loading(pose, F, W, checked_accuracy(accuracy))
    commands = np.tile(np.where(loading.forced, F, 0.0), (len(loads), 1))
    if motors is not None:
        commands = _commands(motors, loading.forced, commands.shape)
    state, none = loading.begin(F, W), frozen(np.zeros(pose.q.size))
    _require_wire(commands, loading, state, pose.arm.cables.names)
    history = []
    for k, (wrench, command) in enumerate(track(tuple(zip(loads, commands, strict=True)), "loads")):
        state, passage = loading.carry(
            state, Load(wrench, none, command), f"the step to load {k + 1}"
        )
        history.append((state, passage))
    return _labelled(pose, F, W, loads, commands, history)


def checked_accuracy(accuracy: float) -> float:
    """Check the argument ``accuracy`` of :func:`load_cycle` and return it.

    Raises InvalidInput if it is not a number from 1e-12 to 0.1.
    """
    share = scalar("accuracy", accuracy)
    if not _LEAST <= share <= _MOST:
        raise InvalidInput("accuracy", f"{share:g} given; {_LEAST:g} to {_MOST:g} is needed.")
    return share


def slow_loading(pose: Posture, tension: Array, wrench: Array, accuracy: float) -> SlowLoading:
    """Prepare the slow loading of an arm whose motors are locked at ``pose``.

    There the cables have ``tension`` F (C,) [N] under ``wrench`` (6,). ``accuracy`` is as for
    :func:`load_cycle`. The caller has checked these arguments. Raises InvalidInput if ``pose`` is
    beyond a joint limit, and ElasticityRangeError if a series spring leaves no wire.
    """
    require_between_stops(pose)
    LoadedArm(pose, tension, wrench)  # refuses a spring that leaves no wire
    arm = pose.arm
    start = np.searchsorted(pose.segments.chains.cable, np.arange(len(arm.cables) + 1))
    forced = ~arm.cables.position_controlled
    problem = ChainProblem(arm.cables, start, tension, arm.original_length == "unstrained")
    return SlowLoading(problem, start, stops(pose), forced, pose, accuracy)


def _commands(motors: ArrayLike, forced: NDArray[np.bool_], shape: tuple[int, ...]) -> Array:
    """Check the commands ``motors`` of :func:`load_cycle`, and return them as an array (n, C).

    ``shape`` is (n, C). ``forced`` (C,) marks the force-controlled cables: their commands are
    tensions, never negative.
    """
    commands = number_array("motors", motors)
    if commands.shape != shape:
        raise InvalidInput(
            "motors",
            f"shape {commands.shape} given, {shape} needed: for each load one command per cable.",
        )
    tensions = commands[:, forced]
    if tensions.min(initial=0.0) < 0.0:
        raise InvalidInput("motors", f"{tensions.min():g} N given; cables only pull.")
    number_array("motors", commands[:, ~forced], "length")
    number_array("motors", tensions, "tension")
    return commands


def _require_wire(
    commands: Array, loading: SlowLoading, state: State, names: Sequence[str]
) -> None:
    """Raise InvalidInput if one of the ``commands`` (n, C) would take in all wire of its cable.

    ``state``, the state at the reference, has the length of this wire. ``names`` (C,) are the names
    of the cables.
    """
    wire = np.add.reduceat(state.settled.chain.natural, loading.start[:-1])
    beyond = ~loading.forced & (commands >= wire)
    if beyond.any():
        k, c = np.argwhere(beyond)[0].tolist()
        raise InvalidInput(
            "motors",
            f"{commands[k, c]:g} m of wire taken in for {names[c]} at load {k + 1}; it has only "
            f"{wire[c]:.4g} m. Take in less.",
        )


def _labelled(
    pose: Posture,
    tension: Array,
    wrench: Array,
    wrenches: Array,
    commands: Array,
    history: Sequence[tuple[State, StepEnergies]],
) -> LoadHistory:
    chains = pose.segments.chains
    states, passages = zip(*history, strict=True)
    hole = chains.hole
    slips = np.array([passage.slip[hole] for passage in passages])
    last = np.array([state.settled.chain.slip[hole] for state in states])
    rough = chains.friction > 0.0
    turned = [abs(p.load_work) + abs(p.motor_work) + abs(p.stored) + p.dissipated for p in passages]
    unaccounted = np.array([passage.unaccounted for passage in passages])
    return LoadHistory(
        reference=pose,
        reference_tension=tension,
        reference_wrench=wrench,
        wrenches=frozen(wrenches),
        motors=frozen(commands),
        angles=frozen(np.array([state.pose.q for state in states])),
        tip=frozen(np.array([state.pose.tip[:3, 3] for state in states])),
        segment_tensions=frozen(np.array([state.settled.chain.tension for state in states])),
        slip=frozen(slips),
        sliding=frozen(np.where(rough, np.sign(last), 0.0).astype(np.int8)),
        reaction=frozen(np.array([state.reaction for state in states])),
        load_work=frozen(np.array([passage.load_work for passage in passages])),
        dissipated=frozen(np.array([passage.dissipated for passage in passages])),
        snaps=frozen(unaccounted > _SNAP * max(turned)),
    )

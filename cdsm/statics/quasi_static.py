"""Arm with friction in its holes that is loaded slowly, from equilibrium to equilibrium.

    r(q) = Σ_j T_j g_j + g − J_Xᵀ W,    ∂r/∂q = Σ_j (T_j H_j + g_jᵀ ∂T_j/∂q) + ∂g/∂q − ∂(J_Xᵀ W)/∂q

T_j is the tension of segment j, g_j and H_j are gradient and Hessian of its length. The rest
lengths of the segments carry the history: from those at one equilibrium, :mod:`cdsm.friction`
computes the tensions at any posture nearby. ∂r/∂q is not symmetric where cables slide.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied, between, without_cables
from cdsm.friction.capstan import ChainProblem, ChainState, chain_tangent
from cdsm.motors import refuse_rough
from cdsm.posture import Posture
from cdsm.statics.locked_arm import LockedArm, require_domain
from cdsm.statics.sliding import continued_sliding, is_held_to, settle_sliding
from cdsm.statics.solve import ArmState, Balance, Point
from cdsm.support.values import Array, frozen
from cdsm.terms import stiffness_of, torque_of, torque_size_of

EquilibriumPath = Mapping[float, Array]
"""Equilibria x (nv,) on the way to a load, as normal maps solve them, by the part of the way."""

NO_PATH: Final[EquilibriumPath] = {}
_SHORTEST = 2.0**-8  # shortest sub-step, as a part of the step between two loads
_STEEP = 2.0**-16  # the same where the arm moves so far that it may have snapped through


class Action(NamedTuple):
    """Load and motor commands that act on an arm."""

    wrench: Applied  # W (6,): force [N], then moment [N m]; or loads on links
    holding: Array  # torque that holds an unbalanced arm at its reference (nv,) [N m]
    motors: Array  # per cable (C,): rest length taken in [m]; or tension [N] of a force motor

    def interpolate(self, other: Action, part: float) -> Action:
        """Return the load at the part ``part`` (0 to 1) of the straight way to ``other``."""
        holding = self.holding + part * (other.holding - self.holding)
        motors = self.motors + part * (other.motors - self.motors)
        return Action(between(self.wrench, other.wrench, part), holding, motors)


@dataclass(frozen=True)
class ChainArmState(ArmState):
    """State of an arm at one posture, in balance or not, after the cables have slipped."""

    chain: ChainState
    slope: Array  # ∂T/∂q (S, nv) [N/rad]
    lengths: Array  # of the segments (S,), the first ones longer as motors yield [m]


class QuasiStaticState(NamedTuple):
    """Equilibrium of an arm under a load."""

    load: Action
    arm_state: ChainArmState
    x: Array  # solution of the normal map (nv,)
    stop_torque: Array  # torque of the stops (nv,) [N m]


class Step(NamedTuple):
    """What happened in a step from one load to another."""

    slip: Array  # rest length that moved from each segment to the next (S,) [m]
    dissipated: float  # work lost to friction in the holes [J]
    snapped: bool  # whether the arm jumped
    path: EquilibriumPath  # the equilibria at the ends of the sub-steps


class Substep(NamedTuple):
    """A part of a step, at whose end an equilibrium is found from that at its start."""

    before: QuasiStaticState
    after: QuasiStaticState
    begin: float  # parts of the step
    end: float
    snapped: bool  # whether the arm jumped


class QuasiStaticArm:
    """Arm with friction whose motors are locked at ``reference``, with tensions F (C,) [N].

    Raises InvalidInput if the posture is beyond a joint limit, and ElasticityRangeError if a
    series spring leaves no wire.
    """

    def __init__(self, reference: Posture, tension: Array) -> None:
        arm = reference.arm
        arm.checked_angles(reference.q)  # within the joint limits
        LockedArm(reference, tension, np.zeros(6))  # refuses a spring that leaves no wire
        self.reference = reference
        self.tension = tension
        self.start = reference.segments.chains.start
        self.forced = ~arm.cables.position_controlled
        self._problem = ChainProblem(arm.cables, self.start)
        self._rough = arm.has_friction
        refuse_rough(arm.motors, arm.has_friction, "friction")
        self._soft = arm.motors.yielding
        self._torque = None if self._soft is None else self._soft.matrix.T @ tension

    def initial(
        self, wrench: Applied, slack: Array | float = 0.0, tension: Array | None = None
    ) -> QuasiStaticState:
        """Return the state at the reference under ``wrench`` (6,).

        ``slack`` (C,) [m] is how much longer than straight the wires are. ``tension`` (S,) [N] are
        the tensions of the segments; None: even ones.
        """
        pose = self.reference
        motors = np.where(self.forced, self.tension, 0.0)
        T = self.tension[pose.segments.chains.cable] if tension is None else tension
        none = np.zeros(pose.q.size)
        rest_length = np.array(self._problem.rest_lengths(pose.segments.lengths, T))
        rest_length[self.start[:-1]] += slack
        state = self._state(pose, rest_length, Action(wrench, none, motors), T)
        x = pose.q / Balance(lambda q: state, pose, state).unit
        return QuasiStaticState(Action(wrench, state.residual, motors), state, x, frozen(none))

    def step_to(
        self,
        before: QuasiStaticState,
        load: Action,
        substeps: int,
        what: str,
        near: EquilibriumPath = NO_PATH,
        seen: Callable[[Substep], None] = lambda substep: None,
    ) -> tuple[QuasiStaticState, Step]:
        """Change the load of an equilibrium to ``load`` in equal sub-steps.

        A sub-step is halved where no stable equilibrium is found near the last one. If it cannot be
        halved further, the arm jumps to the next stable one. Raises EquilibriumError if there is
        none, and ElasticityRangeError if a tension of the new state is outside its law. The error
        texts call the step ``what``. The search for an equilibrium begins at that of the path
        ``near``, such as of a similar arm, where it has one. ``seen`` is told of each sub-step.
        """
        state = before
        motion = np.zeros_like(before.x)
        done = 0.0
        part = 1.0 / substeps
        dissipated = 0.0
        snapped = False
        path = dict[float, Array]()
        slip = last = np.zeros_like(before.arm_state.chain.slip)
        while done < 1.0:
            goal = done + part if done + 1.5 * part < 1.0 else 1.0
            target = before.load.interpolate(load, goal)
            old = state.arm_state
            f = self.balance(state, target)
            known = [near[goal]] if goal in near else []
            guesses = [*known, state.x + motion, state.x]
            point: Point | None = continued_sliding(f, guesses, old.pose.q)
            jumps = point is None or not is_held_to(f, old.pose.q, point)
            if jumps and goal - done > (_SHORTEST if point is None else _STEEP):
                part = (goal - done) / 2.0
                motion = 0.0 * motion
                continue
            if jumps or point is None:
                point = settle_sliding(f, old.pose.q, done, what)
                snapped = True
            new = point.state
            assert isinstance(new, ChainArmState)
            start = self._jumps(old)
            end = self._jumps(new)
            now = new.chain.slip
            again = now * last > 0.0  # these holes slid the same way before
            dissipated += float(np.where(again, (start + end) / 2.0, end) @ now)
            motion = point.x - state.x
            last_state = state
            state = QuasiStaticState(target, new, point.x, point.stop_torque)
            seen(Substep(last_state, state, done, goal, jumps))
            path[goal] = point.x
            slip = slip + now
            last = now
            done = goal
            part = min(2.0 * part, 1.0 / substeps)
        self._require_domains(state.arm_state.tension, what)
        return state, Step(slip, dissipated, snapped, path)

    def balance(
        self, before: QuasiStaticState, load: Action, ways: NDArray[np.int8] | None = None
    ) -> Balance:
        """Return the normal map of the states that follow ``before`` under a load.

        ``ways`` (S,) prescribes in which holes cables slide, as in :meth:`ChainProblem.settle`.
        """
        old = before.arm_state
        rest_length = before.arm_state.chain.rest_length.copy()
        rest_length[self.start[:-1]] -= ~self.forced * (load.motors - before.load.motors)

        def at(q: Array) -> ChainArmState:
            pose = self.reference.arm.at(q, check_limits=False)
            near = np.maximum(old.tension + old.slope @ (q - old.pose.q), 0.0)
            return self._state(pose, rest_length, load, near, ways)

        walls = self._rough and ways is None
        return Balance(at, self.reference, old, load.holding, has_walls=walls)

    def _state(
        self,
        pose: Posture,
        rest_length: Array,
        load: Action,
        near: Array,
        ways: NDArray[np.int8] | None = None,
    ) -> ChainArmState:
        """Compute the state at a posture; the search for tensions starts at ``near`` (S,) [N]."""
        segments = pose.segments
        terms = without_cables(pose, load.wrench)
        chains = segments.chains
        J = segments.length_jacobian
        forced = np.where(self.forced, load.motors, np.nan)
        lengths = segments.lengths
        if self._soft is not None:
            lengths = self._pulled(lengths, rest_length, forced, near)
        chain = self._problem.settle(lengths, rest_length, segments.ratio, forced, near, ways)
        turning = np.zeros_like(J)
        T = chain.tension
        turning[chains.hole] = chains.friction[:, None] * segments.wrap_jacobian
        slope = chain_tangent(self.start, self.forced, chain, J, turning)
        if self._soft is not None:
            by_motors = self._by_motors(chain)
            k = by_motors[self.start[:-1]].diagonal()
            slope = slope - by_motors @ self._soft.yielded(slope[self.start[:-1]], k)
        K = segments.active(T) + J.T @ slope + stiffness_of(terms, pose)
        residual = T @ J + torque_of(terms, pose)
        scale = T @ abs(J) + torque_size_of(terms, pose)
        return ChainArmState(pose, T, residual, K, scale, chain, slope, lengths)

    def _pulled(self, lengths: Array, rest_length: Array, forced: Array, near: Array) -> Array:
        """Return lengths (S,) of segments, the first of each cable longer as motors yield."""
        soft = self._soft
        assert soft is not None
        assert self._torque is not None
        first = self.start[:-1]

        def longer(more: Array) -> Array:
            pulled = lengths.copy()
            pulled[first] += more
            return pulled

        def law(more: Array) -> tuple[Array, Array]:
            smooth = np.ones(lengths.size)
            chain = self._problem.settle(longer(more), rest_length, smooth, forced, near)
            k = self._by_motors(chain)[first].diagonal()
            return chain.tension[first], np.where(chain.tension[first] > 0.0, k, 0.0)

        turn, _, _ = soft.settle(law, self._torque, np.zeros(self._torque.size))
        return longer(soft.matrix @ turn)

    def _by_motors(self, chain: ChainState) -> Array:
        """Compute ∂T/∂L (S, C) [N/m] by how much longer motors make the cables."""
        ends = np.zeros((chain.tension.size, len(self.start) - 1))
        ends[self.start[:-1], np.arange(len(self.start) - 1)] = 1.0
        return chain_tangent(self.start, self.forced, chain, ends, np.zeros_like(ends))

    def continued_tensions(self, state: ChainArmState) -> Array:
        """Compute the tension at the motor of each cable (C,) [N], negative of a slack one.

        There it is minus the surplus of wire over the compliance of the cable.
        """
        chain = state.chain
        needed = self._problem.rest_lengths(state.lengths, 0.0 * chain.tension)
        first = self.start[:-1]
        surplus = np.add.reduceat(chain.rest_length - needed, first)
        F = chain.tension[first]
        slack = (F == 0.0) & ~self.forced
        return np.where(slack, -surplus / np.add.reduceat(chain.compliance, first), F)

    def _jumps(self, state: ChainArmState) -> Array:
        """Return the work per slip (S,) [N] that the hole after each segment dissipates."""
        return np.append(np.diff(self._problem.potential(state.tension)), 0.0)

    def _require_domains(self, tension: Array, what: str) -> None:
        cables = self.reference.arm.cables
        for law, users in self._problem.laws:
            # a motor that holds the tension of a cable without friction needs no law
            known = np.array(
                [c for c in users if not self.forced[c] or any(cables[c].friction)], int
            )
            for extreme in (np.minimum, np.maximum):
                F = extreme.reduceat(tension, self.start[:-1])[known]
                require_domain(self.reference.arm, law, known, F, f"after {what}, ")

"""Move an arm with friction in its holes from load to load: sub-steps, work and dissipation.

A sub-step solves r(q) = 0 for the residual torque r, from the natural lengths of the segments at
its start (lengths of wire at zero strain). It is exact if no hole stops sliding within it: then the
path between start and end does not matter. The energy balance shows whether this holds, and whether
the energies themselves are accurate. Over a sub-step,

    work of load and motors = change of stored energy + dissipation.

The stored energy is a function of the state. The work is ∫ Q·dq with the torque Q = J_Xᵀ W of the
load, and ∫ P du of a motor that takes in the natural length u, with P = T (1 + ε) − ∫ T dε. The
dissipation is Σ_j ∫ (P_{j+1} − P_j) ds_j with the slips s_j of the holes. T is the tension of a
segment and ε its strain. To first order in ε, P is T. Simpson's rule computes the integrals from
the start, the middle and the end of a sub-step. A sub-step is halved until both sides of the energy
balance agree.
"""

from __future__ import annotations

import operator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm._former.tree import Indices
from cdsm.errors import CdsmError
from cdsm.friction.chain_problem import ChainProblem
from cdsm.posture import Posture
from cdsm.statics.frictional_arm import FrictionalArm, FrictionalState
from cdsm.statics.locked_motors import require_domains
from cdsm.statics.rest_search import no_rest
from cdsm.statics.trust_region import RestSearch, find_rest
from cdsm.support.values import Array

_FINEST, _SHORTEST = 2.0**-12, 2.0**-6
"""Smallest sub-steps, as a part of the step between two loads. The first is for an energy balance
that stays inaccurate (the arm snaps through), the second for an equilibrium that is not found."""

_ROUNDING = 16.0 * float(np.finfo(np.float64).eps)  # relative rounding of the stored energy

_OF_LENGTHS = 2.0**-52
"""Relative rounding error of a cable length. The tension turns it into an error of the work."""


class Load(NamedTuple):
    """Load and motor commands that act on an arm."""

    wrench: Array  # W (6,): force [N], then moment [N m]
    holding: Array  # torque that holds an unbalanced arm at its reference (nv,) [N m]
    motors: Array  # per cable (C,): natural length taken in [m]; or tension [N] of a force motor

    def towards(self, other: Load, part: float) -> Load:
        """Return the load at the part ``part`` (0 to 1) of the straight way to ``other``."""
        if part == 1.0:
            return other
        return Load(*(a + part * (b - a) for a, b in zip(self, other, strict=True)))


class State(NamedTuple):
    """Equilibrium of an arm under a load. The natural lengths of its segments store the history."""

    load: Load
    settled: FrictionalState
    reaction: Array  # torque of the stops (nv,) [N m]
    motion: Array  # motion of the joints that led here (nv,) [rad]

    @property
    def pose(self) -> Posture:
        """The posture."""
        return self.settled.pose


class StepEnergies(NamedTuple):
    """Energies [J] and slips [m] of the step from one load to another."""

    load_work: float
    motor_work: float
    stored: float  # change of the energy of cables, springs and weights
    dissipated: float  # work lost to friction in the holes
    slip: Array  # natural length that moved from each segment to the next (S,) [m]

    @property
    def unaccounted(self) -> float:
        """Work that is neither stored nor dissipated [J]."""
        return self.load_work + self.motor_work - self.stored - self.dissipated

    def joined(self, other: StepEnergies) -> StepEnergies:
        """Return the sum of this passage and ``other``, which follows it."""
        return StepEnergies(*map(operator.add, self, other))


class SlowLoading(NamedTuple):
    """Arm with friction that is loaded slowly; :meth:`carry` computes one step from load to load.

    The fields do not depend on the load. ``problem`` models the cables, and ``reference`` is the
    posture at which the motors are locked.
    """

    problem: ChainProblem
    start: Indices  # first segment of each cable, and the number of segments (C+1,)
    stops: tuple[Array, Array]  # lowest and highest angles (nv,) [rad]
    forced: NDArray[np.bool_]  # whether the motor of each cable holds the tension (C,)
    reference: Posture
    accuracy: float  # largest part of the work of a step that may stay unaccounted for

    def begin(self, tension: Array, wrench: Array) -> State:
        """Return the first state: the reference posture under ``wrench`` (6,).

        In each segment the tension is that of its cable in ``tension`` (C,) [N].
        """
        pose = self.reference
        T = tension[pose.segments.chains.cable]
        natural = self.problem.natural(pose.segments.lengths, T)
        motors = np.where(self.forced, tension, 0.0)
        settled = self.arm(natural, wrench, motors).at(pose, T)
        none = np.zeros(pose.q.size)
        return State(Load(wrench, settled.residual, motors), settled, none, none)

    def carry(self, before: State, load: Load, what: str) -> tuple[State, StepEnergies]:
        """Change the load of the equilibrium ``before`` to ``load`` in sub-steps.

        Returns the new equilibrium, and the energies and slips on the way. Raises EquilibriumError
        if no equilibrium was found on the way, and ElasticityRangeError if a tension of the new
        state is outside the domain of its law. The error texts call the step ``what``.
        """
        first, state = before.load, before
        total = StepEnergies(0.0, 0.0, 0.0, 0.0, np.zeros(before.settled.chain.slip.size))
        reached, part, turnover = 0.0, 1.0, 0.0
        while reached < 1.0:
            goal = min(1.0, reached + part)
            middle, search = self.rest(state, first.towards(load, (reached + goal) / 2.0))
            end = None
            if middle is not None:
                end, search = self.rest(middle, first.towards(load, goal))
            if middle is not None and end is not None:
                passage, noise = self._energies(state, middle, end)
                work = abs(passage.load_work) + abs(passage.motor_work)
                turnover = max(turnover, work / (goal - reached))
                allowed = self.accuracy * turnover * (goal - reached) + noise
                if abs(passage.unaccounted) <= allowed or part <= _FINEST:
                    total, state = total.joined(passage), end
                    reached, part = goal, 2.0 * part
                    continue
            elif part <= _SHORTEST:
                raise no_rest(self.reference, search, reached, what)
            part = (goal - reached) / 2.0
        self._require_domains(state, what)
        return state, total

    def _require_domains(self, state: State, what: str) -> None:
        cables, T = self.reference.arm.cables, state.settled.chain.tension
        # a motor that holds the tension of a cable without friction needs no law
        groups = [
            (law, np.array([c for c in of if not self.forced[c] or any(cables[c].friction)]))
            for law, of in self.problem.laws
        ]
        known = [(law, of) for law, of in groups if of.size]
        for extreme in (np.minimum, np.maximum):
            require_domains(cables, known, extreme.reduceat(T, self.start[:-1]), f"after {what}")

    def arm(self, natural: Array, wrench: Array, motors: Array) -> FrictionalArm:
        """Return the :class:`FrictionalArm` under a wrench (6,) and motor commands (C,).

        ``natural`` (S,) [m] are the natural lengths of the segments before wire slips.
        """
        forced = np.where(self.forced, motors, np.nan)
        return FrictionalArm(self.problem, self.stops, natural, wrench, forced)

    def rest(
        self, before: State, load: Load, motion: Array | None = None
    ) -> tuple[State | None, RestSearch[FrictionalState]]:
        """Find the next equilibrium when the load changes from that of ``before`` to ``load``.

        Returns the equilibrium, None if the search fails, and the search. It starts at the angles
        of ``before``, plus ``motion`` (nv,) [rad] if it is given.
        """
        old, natural = before.settled, before.settled.chain.natural.copy()
        taken = np.where(self.forced, 0.0, load.motors - before.load.motors)
        natural[self.start[:-1]] -= taken
        arm = self.arm(natural, load.wrench, load.motors)
        start = None if motion is None else _guess(arm, old, motion, load.holding)
        if start is None:
            start = arm.at(old.pose, old.chain.tension).with_external_torque(load.holding)
            if before.motion @ start.torque < 0.0:  # goes on the same way: sliding holes slide on
                start = _newton_step(arm, old, start, load.holding)
        search = find_rest(arm, start, load.holding)
        if not search.converged:
            return None, search
        reaction = np.where(search.at_stop, search.state.torque, 0.0)
        return State(load, search.state, reaction, search.state.pose.q - old.pose.q), search

    def _energies(self, start: State, middle: State, end: State) -> tuple[StepEnergies, float]:
        """Return energies and slips of a sub-step, and the rounding error of the balance [J].

        ``start``, ``middle`` and ``end`` are the equilibria of the sub-step. The balance is that of
        its energies.
        """
        states = (start, middle, end)
        torque = [s.load.wrench @ s.pose.jacobian + s.load.holding for s in states]
        P = [self.problem.potential(s.settled.chain.tension) for s in states]
        first = self.start[:-1]
        wire = [-np.add.reduceat(s.settled.chain.natural, first) for s in states]
        half, other = middle.settled.chain.slip, end.settled.chain.slip
        before, after = self._stored(start), self._stored(end)
        passage = StepEnergies(
            load_work=_work(torque, [s.pose.q for s in states]),
            motor_work=_work([p[first] for p in P], wire),
            stored=after - before,
            dissipated=_dissipated([np.append(np.diff(p), 0.0) for p in P], half, other),
            slip=half + other,
        )
        settled = end.settled
        uncertain = np.linalg.lstsq(settled.stiffness, settled.rounding, rcond=None)[0]
        noise = abs(torque[2]) @ abs(uncertain) + _ROUNDING * (abs(before) + abs(after))
        noise += _OF_LENGTHS * (settled.chain.tension @ settled.pose.segments.lengths)
        return passage, float(noise)

    def _stored(self, state: State) -> float:
        pose, chain = state.pose, state.settled.chain
        weight = pose.arm._body.potential_energy(pose.q)
        return weight + self.problem.stored(chain.natural, chain.tension)


def _guess(
    arm: FrictionalArm, old: FrictionalState, motion: Array, holding: Array
) -> FrictionalState | None:
    """Return the state after a joint ``motion`` (nv,) [rad] from ``old``; None if sites coincide.

    The motion ends at the stops. ``holding`` (nv,) [N m] is subtracted from the residual torque.
    """
    try:
        return arm.moved(np.clip(old.pose.q + motion, *arm.stops), old).with_external_torque(
            holding
        )
    except CdsmError:
        return None


def _newton_step(
    arm: FrictionalArm, old: FrictionalState, start: FrictionalState, holding: Array
) -> FrictionalState:
    """Return the state after a Newton step from ``start``, with the tangent stiffness of ``old``.

    The step reduces the torque, from which ``holding`` (nv,) [N m] is subtracted; if it does not,
    the result is ``start``.
    """
    try:
        step = np.linalg.solve(old.stiffness, -start.torque)
        near = start._replace(slope=old.slope)
        guess = arm.moved(np.clip(old.pose.q + step, *arm.stops), near).with_external_torque(
            holding
        )
    except (CdsmError, np.linalg.LinAlgError):  # sites meet, or about to buckle
        return start
    return guess if np.linalg.norm(guess.torque) < np.linalg.norm(start.torque) else start


def _work(force: list[Array], place: list[Array]) -> float:
    """Compute the work ∫ ``force``·d``place`` [J] of a sub-step by Simpson's rule.

    Both lists have the values at its start, middle and end.
    """
    half, whole = place[1] - place[0], place[2] - place[0]
    ends = force[0] @ (4.0 * half - whole) + force[2] @ (3.0 * whole - 4.0 * half)
    return float(ends + 4.0 * (force[1] @ whole)) / 6.0


def _dissipated(jump: list[Array], half: Array, other: Array) -> float:
    """Compute the dissipation [J] of a sub-step: the sum of ∫ (P_{j+1} − P_j) ds_j over its holes.

    ``jump`` are the differences P_{j+1} − P_j [N] at start, middle and end. ``half`` and ``other``
    are the slips [m] in the two halves. Every term is ≥ 0.
    """
    start, middle, end = jump
    whole, again = half + other, half * other > 0.0
    simpson = start * (4.0 * half - whole) + 4.0 * middle * whole + end * (3.0 * whole - 4.0 * half)
    even = again & (half * start > 0.0) & (abs(other - half) < abs(half) / 2.0)
    # a hole that begins to slide in a half slides with the jump at the end of this half
    late = half * middle + other * np.where(again, (middle + end) / 2.0, end)
    return float(np.where(even, simpson / 6.0, late).sum())

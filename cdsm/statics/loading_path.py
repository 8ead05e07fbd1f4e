"""Tip positions of an arm with friction under slow loads, and their first-order changes.

The changes follow from small changes of the arm, such as its friction.

The arm moves through a series of equilibria: one at each load, and some between two loads. The code
calls each a "rest". The natural length of a segment is the length of its wire at zero strain. At a
rest, the joint angles q solve r(q, a) = 0, with the residual torque r and the natural lengths a
(S,) that the S segments had at the rest before. Wire slips through holes while the arm moves to the
rest. So the natural lengths become A(q, T), with the segment tensions T. They are the a of the next
rest.

A small change of the arm changes r by δr, q by δq = −K⁻¹ δr with K = ∂r/∂q, and A by δA. The
code computes these changes from rest to rest. It assumes that cables slide in the same holes as
before the change. So the result is the derivative, unless a cable is just about to start or to stop
sliding in a hole.

The changed arm is evaluated at the recorded q, without a search for its own equilibrium: its
residual torques there give δr, and its natural lengths there the part of δA that does not come from
δq. The error for a change of size δ is of order δ².
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from cdsm.posture import Posture
from cdsm.statics.load_cycle import slow_loading
from cdsm.statics.rest_search import no_rest
from cdsm.statics.slow_loading import Load, SlowLoading, State
from cdsm.support.values import Array

_PARTS = 16
"""Number of equilibria computed over the range of the loads.

The error of the tips is up to 0.2 % where holes stop sliding.
"""

_SHORTEST = 2.0**-6
"""Smallest part of a step that is tried if no equilibrium is found at the end of the step."""


class _Rest(NamedTuple):
    """Equilibrium of a :class:`LoadingPath`, at a load or between two loads."""

    state: State
    load: int  # index of the load to which the arm is on the way
    part: float  # part of the way from the load before, 1 at the load itself


@dataclass(frozen=True, eq=False)
class LoadingPath:
    """Equilibria ("rests") of an arm with friction during a series of loads.

    The points between two loads at which an equilibrium is computed depend on the loads only,
    unless a search fails. So a small change of the arm changes the tips smoothly.
    """

    loading: SlowLoading
    start: State
    rests: tuple[_Rest, ...]
    last: tuple[int, ...]  # rest at each load (n,)

    @classmethod
    def of(
        cls,
        pose: Posture,
        tension: Array,
        wrench: Array,
        forces: Array,
        near: LoadingPath | None = None,
    ) -> LoadingPath:
        """Compute the equilibria of an arm under ``forces`` (n, 3) [N] at its tip, one by one.

        Before the first force the arm is balanced at ``pose`` under ``wrench`` (6,), which
        continues to act, and the cables have the tensions ``tension`` F (C,) [N]. ``near`` is the
        path of a similar arm under the same loads: searches that use its joint motions are up to
        twice as fast. Raises CdsmError if ``pose`` is beyond a joint limit, or no equilibrium was
        found on the way.
        """
        loading = slow_loading(pose, tension, wrench, 1.0)
        start = state = loading.begin(tension, wrench)
        rests, last = list[_Rest](), list[int]()
        changes = np.linalg.norm(np.diff(forces, axis=0, prepend=0.0), axis=1)
        swing = np.linalg.norm(np.ptp(np.vstack([forces, np.zeros(3)]), axis=0))
        for k, (force, change) in enumerate(zip(forces, changes, strict=True)):
            whole = wrench + np.append(force, np.zeros(3))
            target = Load(whole, np.zeros(pose.q.size), start.load.motors)
            before, reached = state.load, 0.0
            part = longest = 1.0 / max(1.0, np.ceil(_PARTS * change / swing - 0.01))
            while reached < 1.0:
                goal = reached + part if reached + 1.5 * part < 1.0 else 1.0
                motion = near.motion(len(rests), k, goal) if near else None
                found, search = loading.rest(state, before.towards(target, goal), motion)
                if found is not None:
                    state, reached = found, goal
                    rests.append(_Rest(state, k, reached))
                elif part > _SHORTEST * longest:
                    part /= 2.0
                else:
                    raise no_rest(pose, search, reached, f"the step to load {k + 1}")
            last.append(len(rests) - 1)
        return cls(loading, start, tuple(rests), tuple(last))

    @property
    def tips(self) -> Array:
        """Position of the tip at each load (n, 3) [m]."""
        return np.array([self.rests[i].state.pose.tip[:3, 3] for i in self.last])

    def motion(self, i: int, load: int, part: float) -> Array | None:
        """Return the joint motion (nv,) [rad] that led to the equilibrium ``self.rests[i]``.

        Returns None if this equilibrium does not exist, or is not at the part ``part`` [-] of the
        way to load number ``load``.
        """
        if i < len(self.rests) and self.rests[i][1:] == (load, part):
            return self.rests[i].state.motion
        return None

    @cached_property
    def _responses(self) -> list[tuple[Array, Array]]:
        """Return −K⁻¹ (nv, nv) [rad/(N m)] and ∂A/∂q (S, nv) [m/rad] at each equilibrium.

        The top of the module explains K and A. Rows and columns of −K⁻¹ are 0 for joints at stops,
        rows of ∂A/∂q for slack segments.
        """
        responses = []
        for state, _, _ in self.rests:
            chain, settled = state.settled.chain, state.settled
            free = np.ix_(*2 * [np.flatnonzero(state.reaction == 0.0)])
            give = np.zeros_like(settled.stiffness)
            give[free] = -np.linalg.inv(settled.stiffness[free])
            by_length = settled.pose.segments.length_jacobian / chain.stretch[:, None]
            left = by_length - chain.compliance[:, None] * settled.slope
            responses.append((give, np.where((chain.tension == 0.0)[:, None], 0.0, left)))
        return responses

    def beside(self, pose: Posture, tension: Array, wrench: Array) -> Array:
        """Compute to first order the tips (n, 3) [m] of a slightly different arm, same loads.

        ``pose`` is the reference posture of that arm, where its cables have ``tension`` F (C,) [N]
        under ``wrench`` (6,). Each cable must have as many segments as in this path.
        """
        loading = slow_loading(pose, tension, wrench, 1.0)
        start = loading.begin(tension, wrench)
        natural, motors = start.settled.chain.natural, start.load.motors
        holding, tips = self.start.load.holding, list[Array]()
        for (state, _, _), (give, left) in zip(self.rests, self._responses, strict=True):
            near = state.settled
            share = (holding @ state.load.holding) / (holding @ holding) if holding.any() else 0.0
            arm = loading.arm(natural, state.load.wrench, motors)
            beside = pose.arm.at(near.pose.q, check_limits=False)
            chain = arm.settled(beside, near.chain.tension)
            moved = give @ (arm.residual(beside, chain.tension) - share * start.load.holding)
            natural = chain.natural + left @ moved
            tips.append(beside.tip[:3, 3] + beside.jacobian[:3] @ moved)
        return np.array([tips[i] for i in self.last])


def same_segments(one: Posture, other: Posture) -> bool:
    """Return whether each cable has as many segments in the posture ``one`` as in ``other``."""
    return np.array_equal(one.segments.chains.start, other.segments.chains.start)

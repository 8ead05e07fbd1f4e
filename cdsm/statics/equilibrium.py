"""Where a loaded arm comes to rest once its motors are locked.

    r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0,    ∂r/∂q = K_θ                       (Eqs. 13 and 16)

At a reference the cables are pulled and their motors locked. Under another load the arm moves, and
every position-controlled cable pulls with what its elongation gives, F(q), nonlinear elasticity and
series springs included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import CableError, EquilibriumError, InvalidInput, SingularStiffness
from cdsm.posture import Posture
from cdsm.statics.locked_motors import Iterate, LoadedArm, rounding
from cdsm.statics.trust_region import FLAT, RestSearch, find_rest
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import coordinates
from cdsm.support.validation import Array, ReadOnlyState, frozen, wrench_vector
from cdsm.tension import Tension

_SMALLEST_STEP = 2.0**-6
"""Steps of the load smaller than this do not help either."""

_CLOSE = 1e-3
"""Two sites meet where their distance is this part of that at the reference."""

_FAR = 0.1
"""Largest motion of a joint in which an arm is followed [rad]."""

_DENSE = 0.02
"""Distance between postures whose stability is checked [rad]: a shorter loss is not seen."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Equilibrium(ReadOnlyState):
    """An arm at rest under a load, with the load and the reference. All arrays are read-only.

    Attributes:
        reference: The posture at which the motors were locked.
        reference_tension: F (C,) there [N].
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        stiffness: K_θ at rest with the original lengths of the *reference*: ∂r/∂q, and for a pure
            force the exact Hessian of the potential. Where no cable is slack it equals
            :func:`~cdsm.stiffness` of this posture and tension. The stops are no part of
            it.
        reaction: Torque of the stops on the joints (nv,) [N m]: positive at a lower limit, negative
            at an upper one, zero elsewhere.
        residual: J_Lᵀ F + g − J_Xᵀ W − reaction (nv,) [N m]: what is left of the balance.
        history: Largest residual [N m] at every accepted iterate of the last load step.
        iterations: Number of steps taken, over all load steps.
    """

    reference: Posture
    reference_tension: Array
    wrench: Array
    stiffness: Stiffness
    reaction: Array
    residual: Array
    history: tuple[float, ...]
    iterations: int

    @property
    def pose(self) -> Posture:
        """The posture at rest."""
        return self.stiffness.posture

    @property
    def tension(self) -> Array:
        """F (C,) at rest [N]."""
        return self.stiffness.tension

    @property
    def displacement(self) -> Array:
        """Motion of the tip from the reference (3,) [m]."""
        return frozen(self.pose.tip[:3, 3] - self.reference.tip[:3, 3])

    @property
    def converged(self) -> bool:
        """Whether the residual is mere rounding, computed anew; anything else is an error."""
        K = self.stiffness
        return bool((abs(self.residual) <= rounding(K)).all())

    @property
    def stable(self) -> bool:
        """Whether K_θ, its symmetric part, is positive definite for the joints off the stops.

        False for a neutral state, as of an arm whose cables are all slack, and where stops that do
        not push yet bar the softest motion.
        """
        free = self._off_stops
        K = self.stiffness.joint[np.ix_(free, free)]
        values = np.linalg.eigvalsh((K + K.T) / 2.0)
        return bool((values > FLAT * abs(values).max(initial=0.0)).all())

    @cached_property
    def compliance(self) -> Array:
        """Tip motion per wrench (6, 6), its blocks [m/N] to [rad/(N m)], joints at stops held.

        C = J_X K_θ⁻¹ J_Xᵀ of the joints that no stop pushes.

        Raises:
            SingularStiffness: K_θ of these joints is singular.
        """
        free = self._off_stops
        if free.size == self.reaction.size:
            return self.stiffness.compliance
        K, J = self.stiffness.joint[np.ix_(free, free)], self.pose.jacobian[:, free]
        if free.size == 0:
            return frozen(np.zeros((6, 6)))
        _, values, right = np.linalg.svd(K)
        if not values[-1] > FLAT * values[0]:
            mode = np.zeros(self.reaction.size)
            mode[free] = right[-1]
            raise SingularStiffness(
                f"K_θ of the joints off their stops is singular, most at "
                f"{self.pose.arm.joint_names[int(abs(mode).argmax())]}: the arm is about to give "
                "way there.",
                frozen(mode),
            )
        return frozen(J @ np.linalg.solve(K, J.T))

    @property
    def _off_stops(self) -> NDArray[np.intp]:
        """The joints that no stop pushes."""
        return np.flatnonzero(self.reaction == 0.0)

    @property
    def slack(self) -> tuple[str, ...]:
        """Names of the position-controlled cables that hang slack."""
        pulled = zip(
            self.pose.arm.cables, self.tension, self.stiffness.cable_stiffness, strict=True
        )
        return tuple(
            cable.name for cable, F, k in pulled if cable.control == "position" and F == k == 0.0
        )

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that rest on a stop."""
        return tuple(self.pose.arm.joint_names[i] for i in np.flatnonzero(self.reaction))

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(self.displacement)) * 1000.0
        return f"<Equilibrium of {self.pose.arm.name}, tip moved by {moved:.4g} mm>"

    def __str__(self) -> str:
        arm = self.pose.arm
        rows = [f"{'cable':<12}{'tension [N]':>14}{'reference':>12}"]
        rows += [
            f"{cable.name:<12}{F:>14.3f}{F0:>12.3f}{'  slack' if cable.name in self.slack else ''}"
            for cable, F, F0 in zip(arm.cables, self.tension, self.reference_tension, strict=True)
        ]
        rows.append(f"tip moved by {coordinates(1000.0 * self.displacement)} mm")
        rows += [
            f"{name} rests on its stop, which pushes with {self.reaction[i]:.4g} "
            f"{arm.torque_unit(i)}"
            for i, name in enumerate(arm.joint_names)
            if name in self.at_limit
        ]
        state = "stable" if self.stable else "NEUTRAL: not every joint is brought back"
        residual = f"{abs(self.residual).max():.1e} {arm.torque_unit()}"
        return "\n".join([*rows, f"{state}, residual {residual}"])


def equilibrium(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Equilibrium:
    """Where the arm comes to rest under a dead wrench, its motors locked at a reference.

    r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0 (Eq. 13), with F(q) of the elongation that each cable has at
    the reference plus its change of length. For a pure force it is a minimum of the potential of
    cables, weight and load. The search goes down from the reference and leaves saddles: beyond
    buckling the arm comes to rest beside the posture that has become unstable. Joint limits are
    stops.

    The whole load acts from the start, and is divided only if nothing is found. Where several
    equilibria exist, the one reached by slow loading (:func:`~cdsm.weight_test`) may differ.

    Args:
        pose: The reference posture, within the joint limits.
        tension: F there: the answer of :func:`~cdsm.distribute_tension`, or tensions of
            your own (C,) [N], which need not balance the arm.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. If not given, that
            of the ``Tension``, or zero.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`, or a posture beyond a joint limit.
        ElasticityRangeError: A tension at the reference or at rest is outside the domain of the
            elasticity of its cable: a law says neither how a cable gets slack below its low end nor
            how it yields above its high end.
        EquilibriumError: None was found. Names the part of the load up to which the arm could be
            followed, and the cable of which two sites meet on the way, as where disks overlap.
    """
    reference = stiffness(pose, tension, None if isinstance(tension, Tension) else wrench)
    W = reference.wrench
    if wrench is not None:
        W = wrench_vector("wrench", wrench)
    _require_between_stops(pose)
    loaded = LoadedArm(pose, reference.tension, W)
    start = loaded.at(pose, reference.tension)
    # a part of the load is held off the joints; the whole load is tried first
    imbalance, reached, step, iterations = start.torque, 0.0, 1.0, 0
    while True:
        goal = min(1.0, reached + step)
        search = _find_rest(loaded, start, (1.0 - goal) * imbalance)
        iterations += search.iterations
        if search.converged and goal == 1.0:
            return _equilibrium(loaded, search, iterations)
        if search.converged:
            start, reached, step = search.state, goal, 2.0 * step
        elif step > _SMALLEST_STEP:
            step /= 2.0
        else:
            raise _no_rest(loaded, search, reached)


def follow(before: Equilibrium, wrench: Array, start: Array | None = None) -> Equilibrium | None:
    """The equilibrium that an earlier one turns into under another wrench (6,).

    Args:
        before: The earlier one.
        wrench: The other wrench.
        start: Joint angles (nv,) [rad] to search from, where an arm that differs little came to
            rest under that wrench; if not given, those of the earlier one.

    Returns:
        None if no path of stable postures leads to one: where the arm buckles, or where the step
        from one wrench to the other is too large to tell.

    Raises:
        ElasticityRangeError: As for :func:`equilibrium`.
    """
    loaded = LoadedArm(before.reference, before.reference_tension, wrench)
    iterate = loaded.at(before.pose, before.tension)
    if start is not None:
        try:
            iterate = loaded.moved(start, iterate)
        except CableError:
            return None
    search = _find_rest(loaded, iterate, 0.0)
    if not (search.converged and search.convex and _is_stable_between(loaded, iterate, search)):
        return None
    return _equilibrium(loaded, search, search.iterations)


def _is_stable_between(loaded: LoadedArm, start: Iterate, search: RestSearch[Iterate]) -> bool:
    """Whether K_θ is positive definite all along a short straight path to where the arm rests.

    If the arm snaps through on the path, K_θ is not, though the search may have stepped over that.
    """
    path = search.state.q - start.q
    length = float(abs(path).max())
    if length > _FAR:
        return False
    free = np.flatnonzero(~search.at_stop)
    for part in np.arange(_DENSE, length, _DENSE) / max(length, _DENSE):
        try:
            K = loaded.moved(start.q + part * path, start).stiffness[np.ix_(free, free)]
        except CableError:
            return False
        if np.linalg.eigvalsh((K + K.T) / 2.0)[:1].min(initial=math.inf) <= 0.0:
            return False
    return True


def _find_rest(loaded: LoadedArm, start: Iterate, held_back: Array | float) -> RestSearch[Iterate]:
    """Where the arm goes from an iterate while a torque (nv,) keeps part of the load off it."""

    def evaluate(q: Array, near: Iterate) -> Iterate:
        return loaded.moved(q, near).holding_back(held_back)

    return find_rest(evaluate, start.holding_back(held_back), *loaded.stops())


def _require_between_stops(pose: Posture) -> None:
    arm, q = pose.arm, pose.q
    beyond = arm._model.beyond_limits(q)
    if np.count_nonzero(beyond):
        i = int(beyond.argmax())
        stop = arm.lower[i] if q[i] < arm._model.lowest[i] else arm.upper[i]
        raise InvalidInput(
            "pose",
            f"{arm.joint_names[i]} = {q[i]:.6g} rad is beyond its stop at {stop:.6g} rad, where no "
            "motor can be locked; start within the joint limits, or widen joint_limit.",
        )


def _equilibrium(loaded: LoadedArm, search: RestSearch[Iterate], iterations: int) -> Equilibrium:
    K = search.state.K
    loaded.cables.require_domains(K.tension)
    reaction = np.where(search.at_stop, K.residual, 0.0)
    return Equilibrium(
        reference=loaded.reference,
        reference_tension=loaded.tension,
        wrench=loaded.wrench,
        stiffness=K,
        reaction=frozen(reaction),
        residual=frozen(K.residual - reaction),
        history=search.history,
        iterations=iterations,
    )


def _no_rest(loaded: LoadedArm, search: RestSearch[Iterate], reached: float) -> EquilibriumError:
    last = search.state
    residual = np.where(search.at_stop, 0.0, last.torque)
    arm, worst = last.K.posture.arm, int(abs(residual).argmax())
    joint = arm.joint_names[worst]
    problem = (
        f"the arm finds no stable place to rest beyond {100.0 * reached:.3g} % of the load; at the "
        f"last iterate {abs(residual[worst]):.4g} {arm.torque_unit(worst)} are out of balance at "
        f"{joint}"
    )
    meeting = _meeting_cable(loaded.reference, last.K.posture)
    if meeting is None:
        return EquilibriumError(problem, frozen(residual), reached, joint)
    return EquilibriumError(
        f"{problem}, where two neighbouring sites of {meeting} meet: disks touch there, and the "
        "cable has no direction",
        frozen(residual),
        reached,
        joint,
        "Set joint_limit to where disks touch, or leave it out; then the joint rests on its stop.",
    )


def _meeting_cable(reference: Posture, pose: Posture) -> str | None:
    """The cable of which two sites meet, if there is one."""
    for cable, before, after in zip(
        pose.arm.cables, reference.cable_paths, pose.cable_paths, strict=True
    ):
        apart, left = (np.linalg.norm(np.diff(path, axis=0), axis=1) for path in (before, after))
        if (left < _CLOSE * apart).any():
            return cable.name
    return None

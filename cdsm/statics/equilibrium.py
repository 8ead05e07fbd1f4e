"""Equilibrium of a loaded arm with locked motors: where it rests, and what holds it there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm import readings
from cdsm.applied import Applied, Loaded
from cdsm.errors import InvalidInput, SingularStiffness, listed
from cdsm.load_texts import described, texts
from cdsm.loads import LoadsLike, loads_of
from cdsm.posture import Posture
from cdsm.statics.events import Event, events_text
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import NEUTRAL, Balance, Point, settle
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.verdict import (
    MOST_JOINTS,
    Finding,
    Verdict,
    find_doubts,
    find_excess,
    find_imbalance,
    find_skewness,
    find_slack,
    find_stops,
    imbalance_of,
    judge,
)
from cdsm.support.format import aligned, coordinates, merged, prepare_json, without_rounding
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import Direction, instance, unit_direction
from cdsm.support.values import Array, draw, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.stiffness_matrix import Report

FRICTIONLESS = (
    "without the friction of the holes: with it, where the arm rests depends on what came before"
)
"""What a result says of an arm with friction that it leaves out."""

_LOCKED = 1e6  # a direction is locked if it is so many times stiffer than the softest axis
_NEUTRAL = 1e-2  # smallest eigenvalue over the magnitudes of its terms: they cancel, to 1 %


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Equilibrium(Result, Loaded):
    """Equilibrium of an arm with locked motors under a load; made by :func:`~cdsm.equilibrium`.

    Joint limits act as stops. All arrays are read-only.

    Attributes:
        reference: The posture at which the motors were locked.
        reference_tension: F (C,) [N] at the reference.
        stiffness: `K_θ` at the equilibrium, with the rest lengths of the *reference*: the
            derivative by q of the torque `J_Lᵀ F + g − J_Xᵀ W`, without the stops. For a pure force
            it is the exact Hessian of the potential. If no cable is slack, it equals
            :func:`~cdsm.stiffness` of this posture and tension.
        stop_torque: Torque of the stops on the joints (nv,) [N m]: positive at a lower limit,
            negative at an upper limit, zero elsewhere.
        motors: ``"locked"``: they hold the lengths, so the elasticity of the cables counts in
            `K_θ`; ``"tension"``: they hold the tensions (:func:`~cdsm.forward_statics`).
        branch: Share of load and pull up to which the arm followed without a jump; 1: all of it.
        smooth_events: Events before cables stick and slide in holes; see :attr:`events`.
        path: How an arm with friction in its holes came there: with friction, where it rests
            depends on it. None: without friction, or motors were locked there.
        commands: What the motors were told since their assembly (M,), in the order of
            ``arm.motors``: turns [rad], torques [N m], wire [m] or tensions [N]; or None.
        history: The path in words, or that friction was left out; empty for an arm without it.
    """

    _headline = "moved"
    _rows = "cable"
    _posture_from = "pose"

    reference: Posture
    reference_tension: Array = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    stop_torque: Array = field(metadata=unit("torque", "joint"))
    model: LockedArm
    motors: Literal["locked", "tension"] = field(default="locked", metadata=unit("1"))
    branch: float = field(default=1.0, metadata=unit("1"))
    smooth_events: tuple[Event, ...] = ()
    path: LoadHistory | None = None
    commands: Array | None = None
    history: str = field(default="", metadata=unit("1"))

    @quantity("1")
    def events(self) -> tuple[Event, ...]:
        """What happened on the way there, in its order; with friction, located when asked for.

        Cables that go slack, pass their maximum or leave their law, joints that reach their stops,
        pulleys that a cable leaves or touches, a loss of stability. Empty if load and pull acted at
        once. With friction each lies on the ``part`` ``"pull"`` or ``"load"``; while motors pull,
        cables slide in most holes, which is no event; under the load, the first slip of each hole
        in which the cable did not slide already is one.
        """
        return self.smooth_events + (() if self.path is None else self.path.events)

    @property
    def pose(self) -> Posture:
        """Posture at the equilibrium."""
        return self.stiffness.posture

    @quantity("N", "cable")
    def tension(self) -> Array:
        """Tensions F (C,) [N] at the equilibrium."""
        return self.stiffness.tension

    @property
    def applied(self) -> Applied:
        """What acts: W (6,) at the tip, or loads on links."""
        return self.stiffness.applied

    @quantity("torque", "joint")
    def residual(self) -> Array:
        """Residual torque `J_Lᵀ F + g − J_Xᵀ W` less :attr:`stop_torque` (nv,) [N m]."""
        return frozen(self.stiffness.residual - self.stop_torque)

    @property
    def jumped(self) -> bool:
        """Whether the arm jumped or snapped through on the way here."""
        return self.branch < 1.0 or (self.path is not None and bool(self.path.snaps.any()))

    @property
    def segment_tension(self) -> Array | None:
        """T (S,) [N] of the segments of :attr:`Posture.segments`; None without friction."""
        return self.stiffness.segment_tension

    @property
    def sliding(self) -> NDArray[np.int8] | None:
        """Where cables slide now (P,), as :attr:`LoadHistory.sliding`; None without friction."""
        return None if self.path is None else self.path.sliding[-1]

    @property
    def motor_turns(self) -> Array:
        """By how far motors yield (M,) [rad], in the order of ``arm.motors``; 0: rigid ones.

        They turn from where they were locked; a positive turn takes in wire of positive radii.
        """
        return frozen(self.model.turns(self.pose))

    @quantity("m", "axis")
    def displacement(self) -> Array:
        """Displacement of the tip from the reference (3,) [m]."""
        return frozen(self.pose.tip[:3, 3] - self.reference.tip[:3, 3])

    @quantity("m")
    def moved(self) -> float:
        """Distance of the tip from the reference [m]."""
        return float(np.linalg.norm(self.displacement))

    @quantity("1")
    def stable(self) -> bool:
        """Whether the symmetric part of `K_θ` is positive definite for the joints off their stops.

        It is False for a neutral state, for example if all cables are slack. A joint that touches
        its stop without a torque counts as free, even if this stop blocks the unstable motion.
        Where cables slide, it is enough that the eigenvalues of `K_θ` have positive real parts.
        """
        values = self._motions[0]
        if self._skews:
            return readings.least_real_part(self._stiffness)[0] > 0.0
        return bool((values > 1e-2 * NEUTRAL * abs(values).max(initial=0.0)).all())

    @quantity("1")
    def neutral(self) -> bool:
        """Whether a joint motion meets hardly any resistance: 1 % or less of what its terms have.

        These are the magnitudes of the terms of `K_θ` along the motion of its smallest
        eigenvalue. A straight round rod beyond its buckling load rests in any direction around its
        axis; the small stiffness of a model of it is that of its joints, and holds nothing.
        """
        values, vectors = self._motions
        if not values.size or self._skews:
            return False
        motion = np.zeros(len(self.stiffness.joint))
        motion[self._free] = vectors[:, 0]
        resisted = sum(abs(motion @ matrix @ motion) for matrix in self.stiffness.terms.values())
        return bool(values[0] <= _NEUTRAL * resisted)

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the arm rests here in a stable way, in one word, and what qualifies it."""
        return judge(self._findings())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what qualifies this equilibrium; empty if it is simply stable.

        They say that the arm jumped on the way here, is neutral, rests on a stop, passes through
        itself, is not in balance, or that a cable is above its maximum or slack.
        """
        return self.verdict.warnings

    def _findings(self) -> Iterator[Finding]:
        """Yield why the arm is not simply stable here."""
        arm = self.pose.arm
        if self.branch < 1.0:
            share = f"at {100.0 * self.branch:.4g} % of load and pull its branch of equilibria ends"
            sentence = f"JUMPED: {share}; from there the arm moves to this other one"
            yield Finding(Status.MOVED, sentence, "JUMPED")
        elif self.jumped:
            assert self.path is not None
            steps = zip(self.path.way.parts, self.path.snaps, strict=True)
            parts = [part for part, snapped in steps if part is not None and snapped]
            where = f", on the {listed(parts)}" if parts else ""
            sentence = f"SNAPPED: on the way here the arm snapped through{where}"
            yield Finding(Status.MOVED, sentence, "SNAPPED")
        if not self.stable:
            yield Finding(Status.NEUTRAL, "NEUTRAL: not every joint is brought back")
        elif self.neutral:
            sentence = "NEUTRAL: a motion of the joints meets hardly any resistance"
            yield Finding(Status.NEUTRAL, sentence)
        elif self._skews:
            yield from find_skewness(self._stiffness, arm)
        yield from find_stops(arm, self.at_limit)
        yield from find_doubts(self.pose)
        imbalance = imbalance_of(self.pose, self.tension, self.applied, self.residual)
        yield from find_imbalance(arm, imbalance, self.residual)
        yield from find_excess(arm, self.tension)
        yield from find_slack(self.slack)

    @quantity("1")
    def slack(self) -> tuple[str, ...]:
        """Names of the position-controlled cables that are slack."""
        held = self.pose.arm.cables.position_controlled
        none = self.tension == 0.0
        slack = held & none & (self.stiffness.cable_stiffness == 0.0)
        return tuple(self.pose.arm.cables.names[c] for c in np.flatnonzero(slack))

    @quantity("1")
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that rest on a stop."""
        return tuple(self.pose.arm.joint_names[i] for i in np.flatnonzero(self.stop_torque))

    def resumed(self, pose: Posture, wrench: object) -> Equilibrium:
        """Return it as its own reference, its motors as they are, if ``pose`` is its own."""
        if wrench is not None:
            raise InvalidInput("wrench", "comes with the Equilibrium; leave it out here.")
        if not instance("pose", pose, Posture).equals(self.pose):
            raise InvalidInput("tension", "is the Equilibrium of another posture; give its pose.")
        model = self.model.resumed(self.pose, self.tension)
        changes: Any = {"reference": self.pose, "reference_tension": self.tension, "branch": 1.0}
        return replace(self, **changes, model=model)

    def held_posture(self, forced: NDArray[np.bool_]) -> Posture:
        """Return the posture, of an arm of which the cables ``forced`` (C,) have no stiffness."""
        return with_forced(self.pose, forced)

    def without_friction(self) -> Equilibrium:
        """Return where the arm would rest without friction, its motors as they are."""
        return as_equilibrium(self.model, settled(self.model, self.pose))

    @property
    def force_controlled(self) -> NDArray[np.bool_]:
        """Which cables have a motor that holds the tension (C,)."""
        held: NDArray[np.bool_] = self.pose.arm.cables.position_controlled
        return held & (self.motors == "tension")

    @property
    def paid_out(self) -> Array:
        """How much longer than straight the slack wires are (C,) [m], if motors hold lengths."""
        pose = self.pose
        F = self.tension
        if self.motors == "tension":
            return np.zeros(F.size)
        lengths = pose.cable_lengths
        if pose.arm.motors.yielding is not None:
            lengths = lengths + pose.arm.motors.matrix @ self.motor_turns
        more = self.stiffness.free_lengths - pose.arm.laws.original_lengths(lengths, F)
        return np.where(F == 0.0, np.maximum(more, 0.0), 0.0)

    @property
    def _free(self) -> NDArray[np.intp]:
        """Indices (n,) of the joints that no stop pushes."""
        return np.flatnonzero(self.stop_torque == 0.0)

    @property
    def _stiffness(self) -> Array:
        """K_θ of those joints (n, n)."""
        return self.stiffness.joint[np.ix_(self._free, self._free)]

    @property
    def _skews(self) -> bool:
        """Whether cables slide, and the symmetric part of K_θ is not positive definite."""
        values = self._motions[0]
        return self.stiffness.friction == "sliding" and bool(values.min(initial=1.0) <= 0.0)

    @cached_property
    def _motions(self) -> tuple[Array, Array]:
        """Eigenvalues of the symmetric part of K_θ of those joints, ascending, and vectors."""
        K = self._stiffness
        values, vectors = np.linalg.eigh((K + K.T) / 2.0)
        return values, vectors

    @cached_property
    def compliance(self) -> Array:
        """Compliance at the tip (6, 6): tip motion per wrench, with joints at stops fixed.

        `C = J_X K_θ⁻¹ J_Xᵀ`, with the rows and columns of the joints that no stop pushes. Linear
        rows and columns of C are first: `C_vv` [m/N], `C_vω` [rad/N], `C_ωω` [rad/(N m)].

        Raises:
            SingularStiffness: `K_θ` of these joints is singular.
        """
        return self.compliance_of(None)

    def compliance_of(self, jacobian: Array | None) -> Array:
        """Compute :attr:`compliance` of another point, from its motion (6, nv) by the joints."""
        J = (self.pose.jacobian if jacobian is None else jacobian)[:, self._free]
        return frozen(J @ self.stiffness.joint_compliance(self._free) @ J.T)

    def report(self) -> Report:
        """Check the stiffness here, as :meth:`Stiffness.report` does.

        Raises InvalidInput if a joint rests on its stop, which `K_θ` does not know, or if cables
        stick or slide.
        """
        if self.path is not None:
            raise InvalidInput(
                "report",
                "checks K_θ without friction, and here cables stick or slide; take friction 0.",
            )
        if self.at_limit:
            problem = "does not know of stops, and"
            raise InvalidInput("report", f"{problem} {listed(self.at_limit)} rests on its own.")
        pose = self.held_posture(self.stiffness.cable_stiffness == 0.0)
        return stiffness(pose, self.tension, self.applied).report()

    def along(
        self, direction: Direction, link: str | None = None, point: ArrayLike | None = None
    ) -> float:
        """Compute the tip stiffness `1/(uᵀ C_vv u)` [N/m] along u, with joints at stops fixed.

        `C_vv` (3, 3) is the part of :attr:`compliance` that relates displacements to forces. u is
        an axis such as ``"z"``, or (3,) in base axes, any length. The stiffness is inf if the tip
        cannot move along u. ``link`` and ``point`` are as in :meth:`Stiffness.along`.

        Raises:
            InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero.
            SingularStiffness: `K_θ` of the joints that are not at stops is singular.
        """
        u = unit_direction("direction", direction)
        J_v = None
        if link is not None or point is not None:
            J_v = self.stiffness.jacobian_at(link, point)[:3]
        return self.stiffness.tip_response(u, self._free, J_v)[0]

    def _along_axes(self) -> str:
        """Return the stiffness along x, y, z [N/mm] as text; of a locked direction no number."""
        values = [self.along(u) / 1e3 for u in "xyz"]
        least = min(values)
        texts = [f"{k:.4g}" if k < _LOCKED * least else "locked" for k in values]
        return f"({', '.join(texts)})"

    def _loads(self) -> dict[str, object]:
        """Return the loads on links for JSON, if there are any."""
        loads = described(self.pose.arm, self.applied)
        return {"loads": loads} if loads else {}

    def to_dict(self) -> dict[str, object]:
        """Return the numbers in SI for JSON; with friction, those of segments and holes too."""
        motors = self.pose.arm.motors
        more: dict[str, object] = self._loads()
        if motors.yielding is not None:
            more["motor_yield_rad"] = dict(zip(motors.names, self.motor_turns, strict=True))
        if self.commands is not None:
            more |= motors.described(self.commands)
        if self.path is not None:
            labels = self.path.segment_names
            more |= {
                "segment_tension_N": dict(zip(labels, self.path.segment_tensions[-1], strict=True)),
                "sliding": dict(zip(self.path.holes, self.path.sliding[-1], strict=True)),
                "snapped": bool(self.path.snaps.any()),
            }
        return merged(super().to_dict(), prepare_json(more))

    def _yielded(self) -> list[str]:
        """Return a line that says which motors yield by how far."""
        motors = self.pose.arm.motors
        if motors.yielding is None:
            return []
        turns = zip(motors.names, self.motor_turns, strict=True)
        turned = [f"{name} by {math.degrees(x):.3g}°" for name, x in turns if x]
        return [f"motors yield: {listed(turned, MOST_JOINTS) or 'none turns'}"]

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the arm in mm, with tensions, compliance, load, and its reference if that is near.

        Other options are those of :func:`cdsm.plots.plot_arm`. Returns the axes.
        """
        axes: Axes = draw("plot_arm", self, None, None, ax, **options)
        return axes

    def __str__(self) -> str:
        arm = self.pose.arm
        rows = [("cable", "tension [N]", "reference", "")]
        for cable, F, F0 in zip(arm.cables, self.tension, self.reference_tension, strict=True):
            below = cable.control == "position" and cable.elasticity.rest > F
            state = "on the slack branch of its wire" if below else ""
            state = "slack" if cable.name in self.slack else state
            rows.append((cable.name, f"{F:.3f}", f"{F0:.3f}", state))
        moved = coordinates(without_rounding(1000.0 * self.displacement))
        lines = [*aligned(rows), f"tip moved by {moved} mm", *events_text(self.events)]
        lines += [*texts(self.pose.arm, self.applied), *([self.history] if self.history else [])]
        stopped = np.flatnonzero(self.stop_torque).tolist()
        if len(stopped) <= MOST_JOINTS:
            lines += [
                f"{arm.joint_names[i]} rests on its stop, which pushes with "
                f"{self.stop_torque[i]:.4g} {arm.torque_unit(i)}"
                for i in stopped
            ]
        if stopped:
            with suppress(SingularStiffness):
                fixed = "that joint" if len(stopped) == 1 else "those joints"
                lines.append(f"stiffness along x, y, z, {fixed} fixed: {self._along_axes()} N/mm")
        lines.append(
            "motors hold lengths: the elasticity of the cables counts in the stiffness"
            if self.motors == "locked"
            else "motors hold the tensions: cables add no stiffness of their own"
        )
        if self.commands is not None:
            lines.append(arm.motors.commanded(self.commands))
        lines += self._yielded()
        worst = int(abs(self.residual * arm.levers).argmax())
        residual = f"{abs(self.residual[worst]):.1e} {arm.torque_unit(worst)}"
        state = "; ".join(self.warnings) or self.verdict.word
        return "\n".join([*lines, f"{state}, residual {residual}"])


def equilibrium(
    pose: Posture, tension: Tension | ArrayLike, wrench: LoadsLike | None = None
) -> Equilibrium:
    """Compute the equilibrium of an arm under a dead wrench, its motors locked at a reference.

    Solve `r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0` (Eq. 13). The elongation of a cable is its elongation
    at the reference plus its change of length. For a pure force the solution is a minimum of the
    potential of cables, weight and load: the search leaves saddle points, so an arm that buckles
    comes to rest away from the posture that became unstable. Joint limits act as stops.

    The whole load acts from the start. If several equilibria exist, slow loading
    (:func:`~cdsm.weight_test`) may reach another one. Friction in the holes is left out, and so is
    what came before: :func:`~cdsm.load_cycle` follows it.

    Args:
        pose: The reference posture, within the joint limits.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N], which need not balance the arm.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Default: the wrench
            of the ``Tension``, or zero. Or loads on any links, as for :func:`~cdsm.stiffness`.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`. The posture is beyond a joint limit.
        ElasticityRangeError: A tension at the reference or at the equilibrium is outside the domain
            of its law. A law does not say how a cable becomes slack or yields.
        EquilibriumError: No equilibrium was found. If two sites of a cable meet (disks overlap),
            the error names this cable.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0)
        >>> rest = cdsm.equilibrium(pose, F, wrench=[0, -5, 0, 0, 0, 0])  # motors locked, then 5 N
        >>> f"{1e3 * (rest.pose.tip[1, 3] - pose.tip[1, 3]):.3f} mm"
        '-1.904 mm'
    """
    K = stiffness(pose, tension, None if isinstance(tension, Tension) else wrench)
    W = K.applied if wrench is None else loads_of(pose.arm, wrench)
    pose.arm.checked_angles(pose.q)  # within the joint limits
    arm = LockedArm(pose, K.tension, W)
    return as_equilibrium(arm, settled(arm, pose))


def with_forced(pose: Posture, forced: NDArray[np.bool_]) -> Posture:
    """Return a posture, of an arm of which the motors of cables ``forced`` (C,) hold tensions."""
    if not forced.any():
        return pose
    return pose.arm.with_forced(forced).at(pose.q, check_limits=False)


def settled(arm: LockedArm, start: Posture, reached: float = 0.0) -> Point:
    """Return the equilibrium to which an arm descends from the posture ``start``."""
    return settle(Balance(arm.at, arm.reference, arm.at_pose(start)), start.q, reached)


def as_equilibrium(
    arm: LockedArm, point: Point, branch: float = 1.0, events: tuple[Event, ...] = ()
) -> Equilibrium:
    """Return a solution as an Equilibrium; ElasticityRangeError if a tension is outside its law."""
    position = arm.reference.arm.cables.position_controlled
    return Equilibrium(
        reference=arm.reference,
        reference_tension=arm.tension,
        stiffness=arm.stiffness(point.state.pose),
        stop_torque=point.stop_torque,
        model=arm,
        motors="tension" if arm.tension_held or not position.any() else "locked",
        branch=branch,
        smooth_events=events,
        history=FRICTIONLESS if arm.reference.arm.has_friction else "",
    )

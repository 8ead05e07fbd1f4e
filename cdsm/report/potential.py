"""Compute the potential U of an arm near a posture, term by term, and the residual torque.

    U(q) = Σ F_c (L_c − L_c0) + Σ [E_c(F_c(L_c)) − E_c(F_c) − F_c (L_c − L_c0)] + V(q) − f·x(q)
           active               passive                                           gravity  load

L_c is the length of cable c, F_c its tension and E_c its stored energy. L_c0 and F_c without
argument are the values at the posture. V is the potential of gravity, f the force at the tip x. U
uses only cable lengths, poses of links and energies of cables. It uses no moment arms, no Hessian
and no rigidity. A moment m at the tip has no potential; for a small rotation vector ω of the tip,
it does the work m·ω.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cdsm.cable import Cable
from cdsm.manipulator import Manipulator
from cdsm.support.format import JointUnits
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Stiffness


ONE_SIDED = 1e-4
"""A tension is at a bound or kink of its law if their relative distance is at most this."""

_BESIDE = 1e-6
"""A tension is at a point of a table if their relative distance is at most this."""


class LockedCable(NamedTuple):
    """Cable with a locked motor: its tension and energy as functions of its length.

    The tension follows from the strain of its law, the energy from the energy of the law.
    """

    number: int  # index among the cables of the arm
    cable: Cable
    tension: float  # F at the posture [N]
    free_length: float  # original length l_0, which the motor keeps [m]

    def tensions(self, longer: Array) -> Array:
        """Compute the tension (P,) [N] of this cable if the cables are longer by (P, C) [m]."""
        cable, start = self.cable, self.free_length
        more = longer[:, self.number]
        return cable.tension(float(cable.elongation(self.tension, start)) + more, start)

    def stored(self, longer: Array) -> Array:
        """Compute gain of energy minus F ΔL (P,) [J] if the cables are longer by ΔL (P, C) [m]."""
        cable, F, start = self.cable, self.tension, self.free_length
        tensions = self.tensions(longer)
        more = cable.energy(tensions, start) - cable.energy(F, start)
        return np.asarray(more - F * longer[:, self.number])

    def room(self) -> float:
        """Return the distance [N] from the tension to the nearest bound or kink of the law.

        Points of a tabulated law are kinks, unless the tension is at the point.
        """
        F, law = self.tension, self.cable.elasticity
        edges = [edge for edge, _ in self._edges]
        # the rigidity has kinks at the points of a table. A point too near leaves no room for a
        # step and is ignored: the kink is then in the middle, and differences still converge
        points = law._given.get("tensions", ())
        edges += [point for point in points if abs(F - point) > _BESIDE * F]
        return min(abs(F - edge) for edge in edges)

    def one_sided(self) -> list[str]:
        """Return a message for each bound or kink of the law at the tension; usually none."""
        F, name = self.tension, self.cable.name
        if F == 0.0:
            return [f"{name} is slack (0 N), and K_θ counts it as if it were taut"]
        near = [what for edge, what in self._edges if abs(F - edge) <= ONE_SIDED * F]
        return [f"{name} at {F:.6g} N stands at {what}" for what in near]

    @property
    def _edges(self) -> list[tuple[float, str]]:
        """Return tension [N] and name of each bound and kink of the law."""
        law = self.cable.elasticity
        return [
            (law.low, f"the low end of its law {law._span}"),
            (law.high, f"the high end of its law {law._span}"),
            (law.rest, f"a sharp bend of its tangent rigidity, at {law.rest:g} N"),
        ][: 3 if law._slack else 2]


_FIRST = 2.0**-4  # largest step [rad], or in arm lengths for joints that slide

_ULPS = 2.0 * float(np.finfo(np.float64).eps)
"""Relative rounding error of a position or a length, which is a sum over the links."""

_ROOT = 2e-13  # relative error of a tension that is computed from the elongation


class Neighbourhood:
    """The arm near the posture at which K was computed, with its motors locked there.

    The argument ``places`` (P, nv) of its methods are joint displacements from the posture in units
    of :attr:`unit`, so all derivatives of the potential U by them are in N m.

    Attributes:
        locked: The position-controlled cables, except cables so slack that a small motion does not
            tension them.
        unit: 1 rad for each revolute joint, the arm's length for each prismatic joint (nv,).
    """

    def __init__(self, K: Stiffness) -> None:
        self._pose, self._tension, self._wrench = K.posture, K.tension, K.wrench
        self.unit = joint_unit(K.posture.arm)
        # stiffness and moment arms are used only to choose steps and to estimate rounding errors
        self._k = abs(K.cable_stiffness)
        self._arms = abs(K.posture.length_jacobian * self.unit).max(axis=1)
        states = zip(K.posture.arm.cables, K.tension.tolist(), K.free_lengths.tolist(), strict=True)
        self.locked = [
            LockedCable(c, cable, F, free_length)
            for c, (cable, F, free_length) in enumerate(states)
            if cable.control == "position" and (F > 0.0 or self._k[c] > 0.0)
        ]

    # --- potentials ---------------------------------------------------------------------------

    def kinematic(self, places: Array) -> Array:
        """Compute the active, gravity and load part of U (P, 3) [N m], without any moment."""
        return self.work(places, np.zeros(3))

    def work(self, places: Array, moment: Array | None = None) -> Array:
        """Compute the active, gravity and load part of U (P, 3) [N m], with a moment in the load.

        The load part is minus the work of the force and of a ``moment`` (3,) [N m] at the tip;
        None: the moment of the wrench. The work of the moment is exact to first order in the
        displacement.
        """
        moment = self._wrench[3:] if moment is None else moment
        pose, arm = self._pose, self._pose.arm
        body, force = arm._body, self._wrench[:3]
        start = body.potential_energy(pose.q)
        rows = []
        for q in self._angles(places):
            longer = arm.cable_lengths(q, check_limits=False) - pose.cable_lengths
            tip = body.placement(q, arm.tip_link)
            turn = tip[:3, :3] @ pose.tip[:3, :3].T
            # rotation axis times the sine of the angle
            axis = np.array([turn[i, j] - turn[j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2.0
            load = force @ (tip[:3, 3] - pose.tip[:3, 3]) + moment @ axis
            rows.append([self._tension @ longer, body.potential_energy(q) - start, -load])
        return np.array(rows)

    def elastic(self, places: Array) -> Array:
        """Compute the passive part of U (P, 1) [N m] at ``places``: Σ (gain of energy − F ΔL).

        The sum is over the cables with locked motors. F is the tension at the posture.
        """
        arm = self._pose.arm
        lengths = [arm.cable_lengths(q, check_limits=False) for q in self._angles(places)]
        longer = np.array(lengths) - self._pose.cable_lengths
        total = np.zeros(len(places))
        for each in self.locked:
            total += each.stored(longer)
        return total[:, None]

    # --- torques and lengths ------------------------------------------------------------------

    def kinematic_torques(self, places: Array) -> Array:
        """Compute the torques J_Lᵀ F, g and −J_Xᵀ W (P, 3, nv) [N m], with F as at the posture."""
        torques = []
        for q in self._angles(places):
            pose = self._pose.arm.at(q, check_limits=False)
            active = self._tension @ pose.length_jacobian
            torques.append([active, pose.gravity_torque, -self._wrench @ pose.jacobian])
        return np.array(torques) * self.unit

    def elastic_torques(self, places: Array) -> Array:
        """Compute the torque J_Lᵀ (F(L) − F) (P, 1, nv) [N m] of the changes of the tensions."""
        poses = [self._pose.arm.at(q, check_limits=False) for q in self._angles(places)]
        longer = np.array([pose.cable_lengths for pose in poses]) - self._pose.cable_lengths
        more = np.zeros_like(longer)
        for each in self.locked:
            more[:, each.number] = each.tensions(longer) - each.tension
        torques = [more[p] @ pose.length_jacobian for p, pose in enumerate(poses)]
        return np.array(torques)[:, None] * self.unit

    def measured_lengths(self) -> Array:
        """Compute the cable lengths at the posture (C,) [m] from Pinocchio's poses of the links."""
        pose = self._pose
        links = {site.link for cable in pose.arm.cables for site in cable.sites}
        frames = {link: pose.link_pose(link) for link in links}
        lengths = []
        for cable in pose.arm.cables:
            sites = [frames[site.link][:3] @ (*site.position, 1.0) for site in cable.sites]
            lengths.append(cable.lead + np.linalg.norm(np.diff(sites, axis=0), axis=1).sum())
        return np.array(lengths)

    def _angles(self, places: Array) -> Array:
        return self._pose.q + places * self.unit

    # --- steps --------------------------------------------------------------------------------

    @property
    def first_step(self) -> float:
        """Return the largest step of the differences, a joint displacement in :attr:`unit`.

        With this step, no cable segment loses half of its length.
        """
        return min(_FIRST, self._closing_motion / 4.0)

    @property
    def first_elastic_step(self) -> float:
        """Return a step ≤ :attr:`first_step` with which no tension reaches a bound or kink."""
        step = self.first_step
        for each in self.locked:
            rise = self._k[each.number] * self._arms[each.number]
            step = min(step, each.room() / (4.0 * rise) if rise > 0.0 else np.inf)
        return float(step)

    @cached_property
    def _closing_motion(self) -> float:
        """Return a joint displacement, in :attr:`unit`, below which no two sites coincide.

        Only neighbouring sites of one cable count.
        """
        pose = self._pose
        routing = pose.arm._model.routing
        segment, joint = routing.segment, routing.joint
        site, origin = pose._frames.site, pose._frames.origin
        start, end = segment[:-1, 1:3].T
        apart = np.linalg.norm(site[end] - site[start], axis=1)
        over = np.repeat(np.arange(apart.size), np.diff(segment[:, 3]))
        lever = np.linalg.norm(site[end][over] - origin[joint], axis=1)
        slides = pose.arm.slides[joint - 1]
        return float((apart[over] / np.where(slides, pose.arm.length, lever)).min(initial=1.0))

    # --- rounding -----------------------------------------------------------------------------

    @property
    def length_noise(self) -> Array:
        """Estimate the rounding error (C,) [m] of each cable length."""
        return np.asarray(_ULPS * (self._pose.cable_lengths + self._pose.arm.length))

    def kinematic_noise(self, step: float) -> Array:
        """Return the rounding error of :meth:`kinematic` (3,) [N m]; ``step`` has no effect."""
        pose, arm = self._pose, self._pose.arm
        far = arm.length + float(np.linalg.norm(pose.tip[:3, 3]))
        weight = float(arm._model.masses.mass.sum() * np.linalg.norm(arm.gravity)) * far
        load = float(abs(self._wrench[:3]).sum()) * far + float(abs(self._wrench[3:]).sum())
        return np.array([self._tension @ self.length_noise, _ULPS * weight, _ULPS * load])

    def elastic_noise(self, step: float) -> Array:
        """Return the rounding error (1,) [N m] of :meth:`elastic`, for steps ≤ ``step``."""
        k, F = self._k, self._tension
        stored = np.divide(F * F, k, out=np.zeros_like(k), where=k > 0.0).sum()
        return np.array([_ROOT * stored + 2.0 * step * (k * self._arms) @ self.length_noise])

    def kinematic_torque_noise(self, step: float) -> Array:
        """Return the rounding error of :meth:`kinematic_torques` (3,) [N m], for any ``step``."""
        noise = self.kinematic_noise(step)
        noise[0] *= 1.0 + 1.0 / self._closing_motion
        return noise

    def elastic_torque_noise(self, step: float) -> Array:
        """Return the rounding error (1,) [N m] of :meth:`elastic_torques`, for steps ≤ ``step``."""
        k = self._k
        errors = k * self.length_noise + _ROOT * self._tension * (k > 0.0)
        tilted = 2.0 * step * (k * self._arms) @ self.length_noise
        return np.array([errors @ self._arms + tilted / self._closing_motion])


def joint_unit(arm: Manipulator) -> Array:
    """Return the unit of each joint (nv,): 1 rad, or the arm's length [m] for a prismatic joint."""
    return JointUnits(arm.slides).levers(arm.length)

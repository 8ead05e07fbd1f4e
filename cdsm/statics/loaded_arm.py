"""An arm whose motors are locked, under a load: what is out of balance at any posture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.posture import Posture
from cdsm.statics.locked_motors import LockedCables
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.validation import Array

_ROUNDING = 16.0 * float(np.finfo(np.float64).eps)
"""Relative rounding of a torque: of the angles, lengths and tensions that it is a sum of."""

_APART = 1e-6
"""Where disks are what stops a joint, it stops this far before they touch [rad]: holes that meet
leave a cable without a direction."""


class Iterate(NamedTuple):
    """The arm at some posture, in balance or not; a point of the search for rest.

    Attributes:
        K: Tensions and joint stiffness, free lengths and motors as at the reference.
        torque: What is out of balance, less what is held back (nv,) [N m].
        rounding: How much of it is rounding (nv,) [N m].
    """

    K: Stiffness
    torque: Array
    rounding: Array

    @property
    def q(self) -> Array:
        """Joint angles (nv,) [rad]."""
        return self.K.posture.q

    @property
    def stiffness(self) -> Array:
        """K_θ (nv, nv) [N m/rad]."""
        return self.K.joint

    def holding_back(self, torque: Array | float) -> Iterate:
        """The same posture with a torque (nv,) [N m] on the joints that keeps a load off them."""
        return self._replace(torque=self.K.residual - torque)


class LoadedArm:
    """The arm under a wrench, its motors locked at a reference.

    Args:
        reference: The posture at which they were locked.
        tension: F there (C,) [N].
        wrench: W (6,) that the arm carries: force [N], then moment [N m].
        lengths: L (C,) [m] under which the cables have these tensions, if not those at the posture.

    Raises:
        ElasticityRangeError: As for :class:`LockedCables`.
        InvalidInput: As for :class:`LockedCables`.
    """

    def __init__(
        self, reference: Posture, tension: Array, wrench: Array, lengths: Array | None = None
    ) -> None:
        self.reference = reference
        self.tension = tension
        self.wrench = wrench
        locked = reference.cable_lengths if lengths is None else lengths
        self.cables = LockedCables(reference.arm, locked, tension)

    def at(self, pose: Posture, near: Array) -> Iterate:
        """The arm at a posture where the tensions are near the given ones (C,) [N]."""
        F, k = self.cables.pull(pose.cable_lengths, near)
        active, passive, load, joint = pose._joint_stiffness(F, k, self.wrench)
        K = Stiffness(
            posture=pose,
            tension=F,
            wrench=self.wrench,
            cable_stiffness=k,
            active=active,
            passive=passive,
            gravity=pose.gravity_stiffness,
            load=load,
            joint=joint,
            free_length=self.cables.free_length,
        )
        return Iterate(K, K.residual, rounding(K))

    def moved(self, q: Array, near: Iterate) -> Iterate:
        """The arm at joint angles (nv,) [rad] near another iterate.

        Raises:
            CableError: Two neighbouring sites of a cable coincide there.
        """
        before = near.K
        pose = self.reference.arm.at(q, check_limits=False)
        longer = pose.cable_lengths - before.posture.cable_lengths
        return self.at(pose, before.tension + before.cable_stiffness * longer)

    def stops(self) -> tuple[Array, Array]:
        """Lowest and highest angles (nv,) [rad], at which the joints rest on their stops."""
        arm, q = self.reference.arm, self.reference.q
        touching = np.zeros(arm.nv, dtype=np.bool_)  # joints that are stopped by their disks
        if arm.is_serpentine:
            joints = arm.geometry.joints
            touching[:] = [joint.limit is None for joint in joints for _ in joint.axes]
        apart = np.where(touching, _APART, 0.0)
        # the reference may stand nearer
        return np.minimum(arm.lower + apart, q), np.maximum(arm.upper - apart, q)


def rounding(K: Stiffness) -> Array:
    """How much of :attr:`~cdsm.Stiffness.residual` is rounding (nv,) [N m]."""
    pose = K.posture
    pull = K.tension + K.cable_stiffness * pose.cable_lengths
    terms = pull @ abs(pose.length_jacobian) + abs(K.wrench) @ abs(pose.jacobian)
    turned = abs(K.joint) @ abs(pose.q)
    terms += abs(pose.gravity_torque) + turned + _tilts(pose, K.tension)
    return np.asarray(_ROUNDING * terms)


def _tilts(pose: Posture, tension: Array) -> Array:
    """Torque (nv,) [N m] of cables (C,) [N] whose segments tilt as the places of their sites do.

    The shorter a segment the more: between disks that all but touch it is most of the rounding.
    """
    routing = pose.arm._model.routing
    segment, joint = routing.segment, routing.joint
    site, origin = pose._frames.site, pose._frames.origin
    cable, start, end = segment[:-1, :3].T
    apart = np.linalg.norm(site[end] - site[start], axis=1)
    far = np.linalg.norm(site[end], axis=1)
    over = np.repeat(np.arange(cable.size), np.diff(segment[:, 3]))
    arm = np.linalg.norm(site[end][over] - origin[joint], axis=1)
    pull = (tension[cable] * far / apart)[over] * arm
    torque = np.bincount(joint, pull, minlength=len(origin))[1:]
    return np.asarray(torque, dtype=np.float64)

"""The arm at some joint angles: frozen, and only there once all of it is computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm import _kernels, _stiffness_kernels
from cdsm._checks import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Posture(ReadOnlyState):
    """Everything that depends on the joint angles alone; made by :meth:`Manipulator.at`.

    All arrays are read-only and in base axes.

    Attributes:
        arm: The arm.
        q: Joint angles (nv,) [rad].
        tip: Pose of ``tool0`` (4, 4), translation in m (Eqs. 3–4).
        jacobian: J_X (6, nv): linear rows [m/rad] first, then angular, at ``tool0``.
        cable_lengths: L (C,) [m], lead included (Eq. 8).
        length_jacobian: J_L = ∂L/∂θ (C, nv) [m/rad].
        gravity_torque: g = ∂V/∂θ (nv,) [N m], V the potential energy: J_Hᵀ G_g of Eq. 13.
        gravity_stiffness: ∂g/∂θ (nv, nv) [N m/rad]: H_H G_g of Eq. 16.
    """

    arm: Manipulator
    q: Array
    tip: Array
    jacobian: Array
    cable_lengths: Array
    length_jacobian: Array
    gravity_torque: Array
    gravity_stiffness: Array
    _frames: _kernels.Frames

    def __repr__(self) -> str:
        x, y, z = self.tip[:3, 3]
        return f"<Posture of {self.arm.name}, tip at ({x:.4g}, {y:.4g}, {z:.4g}) m>"

    @cached_property
    def length_hessian(self) -> Array:
        """H_L[c, i, j] = ∂²L_c/∂θ_i∂θ_j, (C, nv, nv) [m/rad²], built on first use."""
        count, nv = self.length_jacobian.shape
        hessian = np.zeros((count, nv, nv))
        _kernels.add_length_hessian(
            *self.arm._segments, *self._frames, frozen(np.ones(count)), np.arange(count), hessian
        )
        return frozen(hessian)

    @cached_property
    def cable_paths(self) -> tuple[Array, ...]:
        """The sites of each cable in base axes, one array (sites, 3) per cable [m]."""
        counts = [len(cable.sites) for cable in self.arm.cables]
        paths = np.split(self._frames.site, np.cumsum(counts)[:-1])
        return tuple(frozen(path.copy()) for path in paths)

    @property
    def bones(self) -> tuple[Array, ...]:
        """Straight lines from joint to joint, and to the tip, (2, 3) each [m]: a stick figure."""
        origin, parent = self._frames.origin, self.arm._tree.parent
        tip = self.arm._masses.tip
        lines = [np.array([origin[parent[i]], origin[i]]) for i in range(1, len(origin))]
        lines.append(np.array([origin[tip], self.tip[:3, 3]]))
        return tuple(frozen(line) for line in lines if (line[0] != line[1]).any())

    def link_pose(self, link: str) -> Array:
        """Pose of a link's frame in the base, (4, 4) [m].

        Raises:
            UnknownName: There is no such link.
        """
        return frozen(self.arm._body.placement(self.q, link))

    def _joint_stiffness(
        self, tension: Array, cable_stiffness: Array, wrench: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Active, passive, load and K_θ (nv, nv); of checked, read-only vectors."""
        active, passive, load, joint = _stiffness_kernels.joint_stiffness(
            *self.arm._segments,
            *self._frames,
            self.jacobian,
            self.length_jacobian,
            self.gravity_stiffness,
            tension,
            cable_stiffness,
            wrench,
        )
        return frozen(active), frozen(passive), frozen(load), frozen(joint)

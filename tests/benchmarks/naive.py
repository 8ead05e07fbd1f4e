"""The baseline: stiffness as a throw-away script computes it, all derivatives by differences.

Plain numpy, uniform universal arms only, vectorised over the holes of a disk. It shares nothing
with cdsm but the conventions, so that its numbers check cdsm's as well.
"""

from collections.abc import Callable

import numpy as np

from cdsm.support.values import Array


class NaiveArm:
    """Forward kinematics, cable lengths and potential energy of a uniform universal arm."""

    def __init__(
        self,
        joints: int,
        cables_per_joint: int,
        link_length: float,
        base_length: float,
        disk_offset: float,
        hole_radius: float,
        link_mass: float,
        gravity: Array,
    ) -> None:
        self.n, self.m = joints, cables_per_joint
        self.link, self.base, self.h = link_length, base_length, disk_offset
        self.mass, self.gravity = link_mass, gravity
        k = np.repeat(np.arange(self.n), self.m)
        j = np.tile(np.arange(self.m), self.n)
        angle = 2 * np.pi * (k + self.n * j) / (self.n * self.m)
        self.end = k
        self.holes = hole_radius * np.array([0 * angle, np.cos(angle), np.sin(angle)])

    def state(self, q: Array) -> tuple[Array, float, Array, Array]:
        """Cable lengths, potential energy, tip position and tip rotation."""
        R, x = np.eye(3), np.array([self.base, 0.0, 0.0])
        lengths = np.zeros(self.n * self.m)
        offset = np.array([[self.h], [0.0], [0.0]])
        energy = 0.0
        for k in range(self.n):
            before = x[:, None] + R @ (self.holes - offset)
            a, b = q[2 * k], q[2 * k + 1]
            ca, sa, cb, sb = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
            R = R @ np.array([[ca, 0, sa], [0, 1, 0], [-sa, 0, ca]])
            R = R @ np.array([[cb, -sb, 0], [sb, cb, 0], [0, 0, 1]])
            after = x[:, None] + R @ (self.holes + offset)
            on = self.end >= k
            lengths[on] += np.linalg.norm(after - before, axis=0)[on]
            lengths[self.end > k] += self.link - 2 * self.h
            energy -= self.mass * self.gravity @ (x + R[:, 0] * self.link / 2)
            x = x + R[:, 0] * self.link
        return lengths, energy, x, R


def difference(f: Callable[[Array], Array], q: Array, step: float) -> Array:
    """Central differences of f, one column per angle."""
    columns = []
    for i in range(q.size):
        shift = np.zeros(q.size)
        shift[i] = step
        columns.append((f(q + shift) - f(q - shift)) / (2 * step))
    return np.stack(columns, axis=-1)


def naive_joint_stiffness(
    arm: NaiveArm, q: Array, tension: Array, wrench: Array, rigidity: float, step: float = 1e-4
) -> Array:
    """K_θ by differences of differences of lengths, energy and tip pose."""
    # angular velocity per angle comes from the rotation: [ω] = ∂R/∂θ Rᵀ
    c = arm.n * arm.m

    def everything(q: Array) -> Array:
        lengths, energy, x, R = arm.state(q)
        return np.concatenate([lengths, [energy], x, R.ravel()])

    def jacobians(q: Array) -> Array:
        d = difference(everything, q, step)
        R = arm.state(q)[3]
        spin = np.einsum("abi,cb->aci", d[c + 4 :].reshape(3, 3, -1), R)
        omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        return np.concatenate([d[: c + 4], omega])

    J = jacobians(q)
    H = difference(jacobians, q, step)
    active = np.einsum("c,cij->ij", tension, H[:c])
    original = arm.state(q)[0] / (1.0 + tension / rigidity)
    passive = J[:c].T @ np.diag(rigidity / original) @ J[:c]
    load = np.einsum("a,aij->ij", wrench, H[c + 1 :])
    return np.asarray(active + passive + H[c] - load)

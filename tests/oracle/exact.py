"""Serpentine arms and least tensions in extended precision, another way than cdsm.

Derivatives are no cross products: every joint's 4×4 matrix depends on its own angle alone, so a
derivative of the chain is the chain with that matrix replaced by its derivative. Tensions are not
searched for but proven: F = clip(Aᵀy, low, high) with A F = b is the least for whatever y, and a y
with bᵀy > max yᵀA F over the bounds proves that there are none.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import qpsolvers
from numpy.typing import NDArray
from scipy.optimize import linprog

import cdsm
from cdsm.support.values import Array
from cdsm.urdf import CROSS_MASS

Wide = NDArray[np.longdouble]

EXTENDED = bool(np.finfo(np.longdouble).eps < 1e-18)
"""Whether this machine's long double is longer than a double: all rests on it."""


def wide(values: object) -> Wide:
    return np.asarray(values, dtype=np.longdouble)


class Motion(NamedTuple):
    """An arm at a posture: L, J_L, H_L, g, ∂g/∂θ, J_X and ∂J_X/∂θ, index of the angle last."""

    lengths: Wide
    slopes: Wide
    bends: Wide
    torque: Wide
    gravity: Wide
    jacobian: Wide
    turning: Wide

    def parts(self, tension: Array, springs: Wide, wrench: Array) -> Wide:
        """Active, passive, gravity and load part of Eq. 16 (4, nv, nv); of F, K_L (C,), W (6,)."""
        active = np.einsum("c,cij->ij", wide(tension), self.bends)
        passive = (self.slopes.T * springs) @ self.slopes
        load = -np.einsum("a,aij->ij", wide(wrench), self.turning)
        return np.stack([active, passive, self.gravity, load])


class ExactArm:
    """Kinematics of an arm from the numbers of its geometry."""

    def __init__(self, geometry: cdsm.Geometry, gravity: Array) -> None:
        self.geometry, self.gravity = geometry, wide(gravity)
        self.nv = sum(len(joint.axes) for joint in geometry.joints)
        angles = wide([cable.angle for cable in geometry.cables])
        self.holes = wide(geometry.hole_radius) * np.stack([np.cos(angles), np.sin(angles)])
        self.end = np.array([cable.joint for cable in geometry.cables])
        offsets = [joint.disk_offset for joint in geometry.joints]
        self.starts = wide([geometry.base_length, *(link.length for link in geometry.links)])
        self.fixed = wide([cable.lead for cable in geometry.cables])
        for k, (before, after) in enumerate(pairwise(offsets), start=1):
            self.fixed[self.end > k] += self.starts[k] - wide(before) - wide(after)

    def at(self, q: Array) -> Motion:
        nv, geometry = self.nv, self.geometry
        pairs = [(i, j) for i in range(nv) for j in range(i, nv)]
        # how often each angle is differentiated by: not at all, once each, twice each
        orders = np.zeros((1 + nv + len(pairs), nv), dtype=np.intp)
        orders[1 + np.arange(nv), np.arange(nv)] = 1
        for row, (i, j) in enumerate(pairs, start=1 + nv):
            orders[row, i] += 1
            orders[row, j] += 1
        second = np.zeros((nv, nv), dtype=np.intp)
        for row, (i, j) in enumerate(pairs, start=1 + nv):
            second[i, j] = second[j, i] = row

        chain = np.broadcast_to(wide(np.eye(4)), (len(orders), 4, 4))
        lengths, energy = np.zeros((len(orders), len(self.end)), dtype=np.longdouble), wide(0.0)
        slopes = np.zeros((len(self.end), nv), dtype=np.longdouble)
        bends = np.zeros((len(self.end), nv, nv), dtype=np.longdouble)
        first, i = slice(1, 1 + nv), 0
        for k, (joint, link) in enumerate(zip(geometry.joints, geometry.links, strict=True)):
            h = wide(joint.disk_offset)
            here = _moved(chain, orders, i)
            before = self._disk(here, wide(self.starts[k] - h))
            if len(joint.axes) == 2:
                centre = here[:, :3, 3] + here[:, :3, 0] * self.starts[k]
                energy = energy - wide(CROSS_MASS) * (centre @ self.gravity)
            chain = chain @ _shift(self.starts[k])
            for axis in joint.axes:
                chain = chain @ _turn(wide(axis), wide(q[i]))[orders[:, i]]
                i += 1
            here = _moved(chain, orders, i)
            on = self.end > k  # those that pass joint k + 1
            d = (self._disk(here, h) - before)[:, on]
            size = np.sqrt((d[0] ** 2).sum(axis=1))
            lengths[0, on] += size
            along = np.einsum("ca,pca->cp", d[0], d[first]) / size[:, None]
            slopes[on] += along
            bend = np.einsum("ica,jca->cij", d[first], d[first])
            bend += np.einsum("ca,ijca->cij", d[0], d[second])
            bends[on] += (bend - along[:, :, None] * along[:, None, :]) / size[:, None, None]
            middle = here[:, :3, 3] + here[:, :3, 0] * (wide(link.length) / 2)
            energy = energy - wide(link.mass or CROSS_MASS) * (middle @ self.gravity)
        place = chain[:, :3, 3] + chain[:, :3, 0] * self.starts[-1]
        R = chain[:, :3, :3]
        spin = _vector(R[first] @ R[0].T).T
        # ∂ω_i/∂θ_j: [ω_i] = ∂_i R Rᵀ
        turning = _vector(R[second] @ R[0].T + R[first][:, None] @ R[first].transpose(0, 2, 1))
        return Motion(
            lengths=lengths[0] + self.fixed,
            slopes=slopes,
            bends=bends,
            torque=energy[first],
            gravity=energy[second],
            jacobian=np.vstack([place[first].T, spin]),
            turning=np.concatenate([place[second].transpose(2, 0, 1), turning.transpose(2, 0, 1)]),
        )

    def _disk(self, chain: Wide, x: Wide) -> Wide:
        """The holes of a disk, and their derivatives, (P, C, 3)."""
        holes = np.einsum("pab,bc->pca", chain[:, :3, 1:3], self.holes)
        return np.asarray(holes + (chain[:, :3, 3] + chain[:, :3, 0] * x)[:, None])


def _moved(chain: Wide, orders: NDArray[np.intp], angles: int) -> Wide:
    """The chain after the first angles; no derivative by a later one is left of it."""
    later = orders[:, angles:].sum(axis=1) > 0
    return wide(np.where(later[:, None, None], np.longdouble(0), chain))


def _shift(x: np.longdouble) -> Wide:
    frame = wide(np.eye(4))
    frame[0, 3] = x
    return frame


def _turn(axis: Wide, angle: Wide) -> Wide:
    """A turn about an axis, its first and its second derivative, (3, 4, 4)."""
    x, y, z = axis / np.sqrt((axis**2).sum())
    cross = wide([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle), np.cos(angle)
    frames = np.zeros((3, 4, 4), dtype=np.longdouble)
    frames[0, :3, :3] = wide(np.eye(3)) + s * cross + (1 - c) * (cross @ cross)
    frames[1, :3, :3] = c * cross + s * (cross @ cross)
    frames[2, :3, :3] = -s * cross + c * (cross @ cross)
    frames[0, 3, 3] = 1
    return frames


def _vector(skew: Wide) -> Wide:
    """The vector of (the skew part of) matrices (..., 3, 3)."""
    parts = [skew[..., 2, 1] - skew[..., 1, 2], skew[..., 0, 2] - skew[..., 2, 0]]
    return wide(np.stack([*parts, skew[..., 1, 0] - skew[..., 0, 1]], axis=-1) / 2)


def solve(A: Wide, B: Wide) -> Wide:
    """A⁻¹ B by elimination with the largest pivot of each column; inf or NaN if A is singular."""
    n = len(A)
    M = np.concatenate([A, B.reshape(n, -1)], axis=1)
    with np.errstate(all="ignore"):
        for i in range(n):
            p = i + int(abs(M[i:, i]).argmax())
            M[[i, p]] = M[[p, i]]
            M[i] = M[i] / M[i, i]
            others = np.arange(n) != i
            M[others] -= np.outer(M[others, i], M[i])
    return np.asarray(M[:, n:].reshape(B.shape))


def smallest_eigenvalue(K: Wide) -> np.longdouble:
    """Of the symmetric part, to the square of float64's rounding but for close neighbours."""
    S = (K + K.T) / 2
    V = wide(np.linalg.eigh(S.astype(np.float64))[1])
    for _ in range(2):  # orthogonal to extended precision
        V = V @ (3 * wide(np.eye(len(V))) - V.T @ V) / 2
    D = V.T @ S @ V
    diagonal, low = np.diag(D), int(np.diag(D).argmin())
    gap = np.delete(diagonal, low) - diagonal[low]
    off = np.delete(D[low], low)
    usable = gap > 1e-12 * abs(diagonal).max()
    # the second order of perturbation theory
    return np.longdouble(diagonal[low] - (off[usable] ** 2 / gap[usable]).sum())


class Least(NamedTuple):
    """What is proven of min ‖F‖² so that A F = b and low ≤ F ≤ high.

    Attributes:
        values: F within 1e-7 of the least, relative to the largest; None if there are none, or
            nothing is proven.
        missing: Σ|A F − b| at least, if there are none; 0 if nothing is proven.
    """

    values: Wide | None
    missing: float


PROOF = 1e-16
"""Largest accepted Σ|A F − b|; dimensionless, F of the order of 1."""

FAR = 1e7
"""In place of an infinite bound, where a multiplier that is zero is rounded."""


def least_tension(A: Wide, b: Wide, low: Wide, high: Wide) -> Least:
    """Prove what is the least tension, or that there is none; of a dimensionless problem.

    A solver in double precision says where, Newton's method makes its multipliers exact.
    """
    doubles = [np.asarray(x, dtype=np.float64) for x in (A, b, low, high)]
    n = len(low)
    problem = qpsolvers.Problem(
        np.eye(n), np.zeros(n), A=doubles[0], b=doubles[1], lb=doubles[2], ub=doubles[3]
    )
    found = qpsolvers.solve_problem(problem, "daqp", primal_tol=1e-11)
    if found.found and found.y is not None:
        y = -wide(found.y)
        for _ in range(5):
            s = A.T @ y
            free = (s > low) & (s < high)
            step = solve(A[:, free] @ A[:, free].T, b - A @ np.clip(s, low, high))
            if not np.isfinite(step).all():
                break
            y = wide(y + step)
        F = np.clip(A.T @ y, low, high)  # of this form, the duality gap is what is out of balance
        if abs(b - A @ F).sum() <= PROOF * max(1.0, float(F.max())):
            return Least(F, 0.0)
    return Least(None, max(0.0, _farkas(A, b, low, high, doubles)))


def _farkas(A: Wide, b: Wide, low: Wide, high: Wide, doubles: list[Array]) -> float:
    """Σ|A F − b| at least, for all F within the bounds, by the dual of the linear program."""
    m, n = A.shape
    found = linprog(
        np.concatenate([np.zeros(n), np.ones(2 * m)]),
        A_eq=np.hstack([doubles[0], np.eye(m), -np.eye(m)]),
        b_eq=doubles[1],
        bounds=[*zip(doubles[2], doubles[3], strict=True), *[(0.0, None)] * (2 * m)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    y = wide(found.eqlin.marginals)
    y = y / max(1, abs(y).max())
    s = A.T @ y
    rounded = np.isinf(high) & (s <= 1e-16)
    with np.errstate(invalid="ignore"):
        most = np.where(s > 0, s * np.where(rounded, FAR, high), s * low)
    return float(b @ y - most.sum())

"""Kernel of cables over grooved pulleys: what contacts shift beside the planes of the grooves.

The formulas are those of :mod:`cdsm.pulleys.contact_shifts`, for W postures side by side as in
:mod:`cdsm.batch.kernels`. K_A and K_B act across the piece, symmetric and without trace, and so
does their sum K: K² = k² there, and N D = (ℓ D − K D)/(ℓ² − k²) without its part along the piece.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.pulleys.contact_shifts import IN_PLANE
from cdsm.support.values import Array

COMPILED = bool(globals().get("COMPILED", True))
"""Whether numba compiles this module, as :mod:`cdsm.batch.kernels`."""

if COMPILED:  # else the loader gives these names
    from cdsm.batch.kernels import add_product, choose, inner_loop, kernel, lanes

if TYPE_CHECKING:
    from cdsm.batch.path_arrays import ContactArrays, PathArrays
    from cdsm.batch.rows import ArmArrays, PoseArrays


@inner_loop
def _fill_flank(
    u: Array, axis: Array, contact: Array, centre: Array, scale: float, out: Array
) -> None:
    """Fill normal n, b = n × u and κ of a contact in a groove: (7, W); K = κ (n bᵀ + b nᵀ)."""
    for w in lanes(out):
        a = axis[0, w]
        b = axis[1, w]
        c = axis[2, w]
        x = contact[0, w] - centre[0, w]
        y = contact[1, w] - centre[1, w]
        z = contact[2, w] - centre[2, w]
        over = 1.0 / np.sqrt(x * x + y * y + z * z)
        x = x * over
        y = y * over
        z = z * over
        sine = a * u[0, w] + b * u[1, w] + c * u[2, w]
        out[0, w] = x
        out[1, w] = y
        out[2, w] = z
        out[3, w] = y * u[2, w] - z * u[1, w]
        out[4, w] = z * u[0, w] - x * u[2, w]
        out[5, w] = x * u[1, w] - y * u[0, w]
        out[6, w] = choose(np.abs(sine) > IN_PLANE, scale * sine / (1.0 - sine * sine), 0.0)


@inner_loop
def _add_flank(flank: Array, x: Array, out: Array) -> None:
    """Add K x for vectors x (3, W)."""
    for w in lanes(out):
        n = x[0, w] * flank[0, w] + x[1, w] * flank[1, w] + x[2, w] * flank[2, w]
        b = x[0, w] * flank[3, w] + x[1, w] * flank[4, w] + x[2, w] * flank[5, w]
        n = n * flank[6, w]
        b = b * flank[6, w]
        out[0, w] += b * flank[0, w] + n * flank[3, w]
        out[1, w] += b * flank[1, w] + n * flank[4, w]
        out[2, w] += b * flank[2, w] + n * flank[5, w]


@inner_loop
def _fill_motions(u: Array, d: Array, z: Array, sign: float, out: Array) -> None:
    """Fill w = z × u and (1 − uuᵀ) d of a joint, with the sign of z: (2, 3, W)."""
    for w in lanes(out):
        out[0, 0, w] = sign * (z[1, w] * u[2, w] - z[2, w] * u[1, w])
        out[0, 1, w] = sign * (z[2, w] * u[0, w] - z[0, w] * u[2, w])
        out[0, 2, w] = sign * (z[0, w] * u[1, w] - z[1, w] * u[0, w])
        along = u[0, w] * d[0, w] + u[1, w] * d[1, w] + u[2, w] * d[2, w]
        out[1, 0, w] = d[0, w] - along * u[0, w]
        out[1, 1, w] = d[1, w] - along * u[1, w]
        out[1, 2, w] = d[2, w] - along * u[2, w]


@inner_loop
def _fill_turned(over: Array, stiff: Array, D: Array, KD: Array, out: Array) -> None:
    """Fill N D = (ℓ D − K D)/(ℓ² − k²), where K² = k² across the piece; stiff = k²."""
    for w in lanes(over):
        length = 1.0 / over[w]
        scale = 1.0 / (length * length - stiff[w])
        for x in range(3):
            out[x, w] = scale * (length * D[x, w] - KD[x, w])


@inner_loop
def _fill_pair(
    over: Array, own: Array, bent: Array, other: Array, turned: Array, out: Array
) -> None:
    """Fill D·N D′ − w·K w′ − d·d′/ℓ of two joints, with d across the piece."""
    for w in lanes(out):
        out[w] = 0.0
    for x in range(3):
        for w in lanes(out):
            out[w] += bent[1, x, w] * turned[2, x, w] - own[0, x, w] * turned[0, x, w]
            out[w] -= own[1, x, w] * other[1, x, w] * over[w]


@kernel
def add_shifts(
    arm: ArmArrays,
    paths: PathArrays,
    at: PoseArrays,
    contacts: ContactArrays,
    F: Array,
    K: Array,
    size: Array,
) -> None:
    """Add to the active term K[:, 0] what contacts shift in grooves beside whose plane cables run.

    ``size`` gets the magnitudes of the diagonal; the arguments are those of ``fill_stiffness``.
    """
    T = len(paths.centre)
    m = arm.path.shape[1]
    W = F.shape[2]
    flanks = np.empty((2, 7, W))
    own = np.empty((m, 2, 3, W))  # w and d of each joint
    bent = np.empty((m, 3, 3, W))  # K_B w, D and N D
    across = np.empty((3, W))
    stiff = np.empty(W)
    pair = np.empty(W)
    for b in range(len(F)):
        for piece in paths.pieces:
            s = piece[0]
            u = at.segment[b, s]
            flanks[:] = 0.0
            across[:] = 0.0
            for side in range(2):  # departure, arrival
                t = piece[1 + side]
                if t >= 0:
                    contact = contacts.contact[b, t if side else T + t]
                    centre = contacts.entry[b, paths.centre[t]]
                    scale = -paths.radius[t] if side else paths.radius[t]
                    _fill_flank(u, contacts.axis[b, t], contact, centre, scale, flanks[side])
            if np.abs(flanks[:, 6]).max() == 0.0:
                continue
            # k², from K n with a normal n
            normal = flanks[0 if piece[1] >= 0 else 1]
            for flank in flanks:
                _add_flank(flank, normal, across)
            stiff[:] = 0.0
            for x in range(3):
                add_product(across[x], across[x], stiff)
            for t in range(m):
                j = arm.path[s, t]
                sign = arm.sign[s, t]
                if sign == 0.0:
                    continue
                _fill_motions(u, at.motion[b, s, t], at.axis[b, j], sign, own[t])
                bent[t, 0] = 0.0
                _add_flank(flanks[1], own[t, 0], bent[t, 0])
                bent[t, 1] = own[t, 1] + bent[t, 0]
                across[:] = 0.0
                for flank in flanks:
                    _add_flank(flank, bent[t, 1], across)
                _fill_turned(u[3], stiff, bent[t, 1], across, bent[t, 2])
                for k in range(t + 1):
                    i = arm.path[s, k]
                    _fill_pair(u[3], own[k], bent[k], own[t], bent[t], pair)
                    pair *= F[b, arm.ends[s, 0]]
                    K[b, 0, i, j] += pair
                    if i == j:
                        size[b, j] += np.abs(pair)
                    else:
                        K[b, 0, j, i] += pair

"""Kernel of cables over pulleys: what shifts of contacts beside the planes of the pulleys add to K.

The formulas are those of :mod:`cdsm.pulleys.contact_shifts`, for W postures side by side as in
:mod:`cdsm.batch.kernels`. K_A and K_B act across the piece, symmetric and without trace, and so
does their sum K: K² = k² there, and N D = (ℓ D − K D)/(ℓ² − k²) without its part along the piece.
On a smooth pulley between two sites, the two equations for η and σ have the solution of
:func:`_fill_slipped`.
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


@inner_loop
def _fill_across(u: Array, axis: Array, contact: Array, centre: Array, out: Array) -> None:
    """Fill b = n × u of a contact with a smooth cylinder."""
    for w in lanes(out):
        a = axis[0, w]
        b = axis[1, w]
        c = axis[2, w]
        x = contact[0, w] - centre[0, w]
        y = contact[1, w] - centre[1, w]
        z = contact[2, w] - centre[2, w]
        height = a * x + b * y + c * z
        x = x - height * a
        y = y - height * b
        z = z - height * c
        over = 1.0 / np.sqrt(x * x + y * y + z * z)
        out[0, w] = over * (y * u[2, w] - z * u[1, w])
        out[1, w] = over * (z * u[0, w] - x * u[2, w])
        out[2, w] = over * (x * u[1, w] - y * u[0, w])


@inner_loop
def _fill_kink(u: Array, across: Array, own: Array, arrives: bool, out: Array) -> None:
    """Fill ℓ C: b·d − ℓ b·w on arrival, −b·d on departure."""
    for w in lanes(out):
        d = across[0, w] * own[1, 0, w] + across[1, w] * own[1, 1, w] + across[2, w] * own[1, 2, w]
        turn = across[0, w] * own[0, 0, w] + across[1, w] * own[0, 1, w]
        turn = turn + across[2, w] * own[0, 2, w]
        out[w] = d - turn / u[3, w] if arrives else -d


@inner_loop
def _fill_slipped(kink: Array, other: Array, over: Array, out: Array) -> None:
    """Fill X X′/(ℓ₁ + s + ℓ₂) − ℓ₁ C₁ C₁′ − ℓ₂ C₂ C₂′ of two joints, with X = ℓ₁ C₁ − ℓ₂ C₂.

    ``over`` (3, W) are 1/ℓ₁, 1/ℓ₂, which are 0 on a rim, and 1/(ℓ₁ + s + ℓ₂).
    """
    for w in lanes(out):
        X = (kink[0, w] - kink[1, w]) * (other[0, w] - other[1, w])
        out[w] = X * over[2, w] - kink[0, w] * other[0, w] * over[0, w]
        out[w] -= kink[1, w] * other[1, w] * over[1, w]


@inner_loop
def _add_to(K: Array, size: Array, i: int, j: int, pair: Array) -> None:
    """Add to K symmetrically, and to the size of its diagonal."""
    K[i, j] += pair
    if i == j:
        size[j] += np.abs(pair)
    else:
        K[j, i] += pair


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
    """Add to the active term K[:, 0] what shifts of contacts beside the planes of pulleys do.

    Smooth pulleys that follow others are not known here: :mod:`cdsm.batch.smooth_rows` has them.
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
    n = len(arm.parent)
    kink = np.empty((n, 2, W))  # ℓ C of each joint, on arrival and departure
    over = np.empty((3, W))
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
                    _add_to(K[b, 0], size[b], i, j, pair)
        for helix in paths.helices:
            p = helix[0]
            kink[:] = 0.0
            over[:] = 0.0
            over[2] = contacts.arc[b, p]
            centre = contacts.entry[b, paths.centre[p]]
            for side in range(2):  # arrival, departure
                s = helix[1 + side]
                if s < 0:
                    continue
                u = at.segment[b, s]
                contact = contacts.contact[b, T + p if side else p]
                _fill_across(u, contacts.axis[b, p], contact, centre, across)
                over[side] = u[3]
                over[2] += 1.0 / u[3]
                for t in range(m):
                    j = arm.path[s, t]
                    sign = arm.sign[s, t]
                    if sign != 0.0:
                        _fill_motions(u, at.motion[b, s, t], at.axis[b, j], sign, own[t])
                        _fill_kink(u, across, own[t], side == 0, kink[j, side])
            over[2] = 1.0 / over[2]
            c = paths.cable[p]
            for j in range(n):
                if arm.pulls[c, j]:
                    for i in range(j + 1):
                        if arm.pulls[c, i]:
                            _fill_slipped(kink[i], kink[j], over, pair)
                            pair *= F[b, c]
                            _add_to(K[b, 0], size[b], i, j, pair)

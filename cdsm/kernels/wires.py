"""Kernels of the rigidity EA(F) of wires: linear laws, polynomials on intervals, and tables.

:mod:`cdsm.wires.quadrature` and :mod:`cdsm.wires.rising_curve` give the same bits, but one law at a
time and half as fast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import Width, compiled, inlined, inner, lanes, upwards
from cdsm.kernels.tree import Indices
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

AT_ONCE = 4
"""Number of powers in a step of Horner's rule; the number of coefficients is a multiple of it."""

POLYNOMIAL, CURVE = range(2)
"""Kinds of pieces of a law: the coefficients are of a polynomial EA(F), or of a curve ε(F)."""

_, _LEAST, _MOST = RANGES["rigidity"]


class Wires(NamedTuple):
    """Laws EA(F) of all C cables as arrays. Laws that are not linear consist of pieces, P in all.

    Attributes:
        constant: EA of linear laws (C,) [N]; 0 for other laws and force-controlled cables.
        linear: Factor (C,) of the tension F in EA (1 + ε) = EA + F of linear laws: 1, or 0 if the
            original length is the stretched one; 0 for all other cables.
        pieces: First and last piece of the law of each cable, and its kind, POLYNOMIAL or CURVE (C,
            3). Without pieces (linear law, function of Python, force control) last is below first.
        ends: Six numbers for each cable (C, 6). 0 and 1: least and largest tension of its law [N].
            2: tension below which the cable is slack and EA is constant, or −inf [N]. 3: least
            tension of the pieces [N]. 4: EA at that tension [N]. 5: 1 if the original length is the
            unstrained one, 0 if it is the stretched one, as in the paper.
        edges: Start and end of each piece [N], and the strain at its start (3, P).
        coefficients: A column for each piece (rows, P). POLYNOMIAL: coefficients, lowest power
            first. CURVE: slope and rise of the chord, then a and b of
            :class:`~cdsm.TabulatedElasticity`.
        nodes: Nodes and weights of the Gauss rule on (0, 1), (2, N).
    """

    constant: Array
    linear: Array
    pieces: Indices
    ends: Array
    edges: Array
    coefficients: Array
    nodes: Array


class WireScratch(NamedTuple):
    """Scratch of one cable in W postures; each array is (W,), except the coefficients."""

    piece: Indices  # piece of the law at each tension
    x: Array  # the tension, or the least tension of the pieces if that is larger [N]
    begin: Array  # start of the piece [N]
    end: Array  # end of the piece [N]
    before: Array  # strain at the start of the piece [-]
    strain: Array  # strain from there on [-]
    node: Array  # a node of the Gauss rule
    value: Array  # EA [N]
    coefficients: Array  # of the piece (rows, W)


@inlined
def wire_scratch(wires: Wires, width: int) -> WireScratch:
    """Allocate the :class:`WireScratch` of a block of ``width`` postures."""
    piece, a = np.empty(width, dtype=np.intp), np.empty((7, width))
    coefficients = np.empty((wires.coefficients.shape[0], width))
    return WireScratch(piece, a[0], a[1], a[2], a[3], a[4], a[5], a[6], coefficients)


@inner
def set_rigidity(
    wires: Wires, tension: Array, rigidity: Array, scratch: WireScratch, width: Width
) -> None:
    """Fill ``rigidity`` (C, W) [N] with EA (1 + ε) at tensions F (C, W) [N].

    It is EA alone if the stretched length counts as the original length, as in the paper. It is −1
    where F is outside the domain of the law, or EA outside the range that cdsm allows. It is 0 for
    laws that are functions of Python, and for cables whose ``constant`` and ``linear`` are 0.
    """
    piece, x, begin, end, before, strain, _, value, coefficients = scratch
    for c in upwards(0, tension.shape[0]):
        for w in lanes(width):
            rigidity[c, w] = wires.constant[c] + wires.linear[c] * tension[c, w]
        first, last, kind = wires.pieces[c, 0], wires.pieces[c, 1], wires.pieces[c, 2]
        if last < first:
            continue
        least, most, rest = wires.ends[c, 0], wires.ends[c, 1], wires.ends[c, 2]
        lowest, soft, strained = wires.ends[c, 3], wires.ends[c, 4], wires.ends[c, 5]
        for w in lanes(width):
            x[w] = max(tension[c, w], lowest)
        for w in lanes(width):
            piece[w] = first
        left = last - first + 1
        while left > 1:  # bisection, the same for all postures
            half = left // 2
            for w in lanes(width):
                behind = x[w] > wires.edges[1, np.uint64(piece[w] + half - 1)]
                piece[w] += half if behind else 0
            left -= half
        for k, edge in enumerate((begin, end, before)):
            for w in lanes(width):
                edge[w] = wires.edges[k, np.uint64(piece[w])]
        for r in upwards(0, coefficients.shape[0]):
            for w in lanes(width):
                coefficients[r, w] = wires.coefficients[r, np.uint64(piece[w])]
        if kind == CURVE:
            _set_curve(scratch, width)
        else:
            _set_integral(wires.nodes, scratch, width)
            _set_polynomial(coefficients, x, value, width)
        for w in lanes(width):
            F = tension[c, w]
            change = (F - rest) / soft if rest > F else before[w] + strain[w]
            usable = least <= F <= most and _LEAST <= value[w] <= _MOST
            rigidity[c, w] = value[w] * (1.0 + strained * change) if usable else -1.0


@inner
def _set_curve(scratch: WireScratch, width: Width) -> None:
    """Fill EA, and the strain since the start of the piece, for pieces of the kind CURVE."""
    _, x, begin, end, _, strain, _, rigidity, coefficients = scratch
    chord, rise, a, b = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
    for w in lanes(width):
        wide = end[w] - begin[w]
        t, u = (x[w] - begin[w]) / wide, (end[w] - x[w]) / wide
        D = t * t + (a[w] + b[w]) * t * u + u * u
        N = b[w] * t * t + 2.0 * t * u + a[w] * u * u
        rigidity[w], strain[w] = 1.0 / (chord[w] * N / (D * D)), rise[w] * (t * (t + a[w] * u) / D)


@inner
def _set_integral(nodes: Array, scratch: WireScratch, width: Width) -> None:
    """Fill the strain since the start of the piece, ∫ dF/EA, for pieces of the kind POLYNOMIAL.

    EA is a polynomial; a Gauss rule integrates its inverse.
    """
    _, x, begin, _, _, integral, node, value, coefficients = scratch
    for w in lanes(width):
        integral[w] = 0.0
    for n in upwards(0, nodes.shape[1]):
        at, weight = nodes[0, n], nodes[1, n]
        for w in lanes(width):
            node[w] = begin[w] + (x[w] - begin[w]) * at
        _set_polynomial(coefficients, node, value, width)
        for w in lanes(width):
            integral[w] += weight / value[w]
    for w in lanes(width):
        integral[w] *= x[w] - begin[w]


@inner
def _set_polynomial(coefficients: Array, x: Array, value: Array, width: Width) -> None:
    """Evaluate a polynomial for each posture at x (W,), by Horner's rule; fill ``value`` (W,).

    ``coefficients`` (rows, W) has the lowest power first. A step takes four powers.
    """
    for w in lanes(width):
        value[w] = 0.0
    for r in range(coefficients.shape[0] - AT_ONCE, -1, -AT_ONCE):
        k = np.uint64(r)
        a, b = coefficients[k], coefficients[k + np.uint64(1)]
        c, d = coefficients[k + np.uint64(2)], coefficients[k + np.uint64(3)]
        for w in lanes(width):
            value[w] = (((value[w] * x[w] + d[w]) * x[w] + c[w]) * x[w] + b[w]) * x[w] + a[w]


@compiled
def single_rigidity(
    constant: Array,
    pieces: Indices,
    ends: Array,
    edges: Array,
    coefficients: Array,
    nodes: Array,
    tension: Array,
) -> Array:
    """Compute EA (1 + ε) (C,) [N] at tensions F (C,) [N] of one posture; EA for linear laws.

    The arguments before ``tension`` are the fields of :class:`Wires`; see :func:`set_rigidity`.
    """
    count = tension.shape[0]
    linear, rigidity = np.zeros(count), np.empty((count, 1))
    wires = Wires(constant, linear, pieces, ends, edges, coefficients, nodes)
    set_rigidity(wires, tension.reshape(count, 1), rigidity, wire_scratch(wires, 1), None)
    return rigidity.reshape(count)

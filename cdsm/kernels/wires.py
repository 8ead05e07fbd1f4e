"""Kernels of linear laws EA(F), and of laws that are polynomials on intervals (panels), as Eq. 19.

The results have the bits of :mod:`cdsm.wires.quadrature`, which takes one tension at a time and
twice as long.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import Width, inlined, inner, lanes, upwards
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array

AT_ONCE = 4
"""The number of powers in a table is a multiple of this."""


class Wires(NamedTuple):
    """Laws of all cables; the panels of one law follow those of another.

    Attributes:
        panels: First and last panel of the law of each cable (C, 2); last below first if the law is
            no polynomial.
        ends: Of each law (C, 6): least and largest tension; tension below which the wire is slack
            and EA constant, −inf if there is none; least tension of the polynomials, and EA there
            [N]; 1 if the original length is the unstrained one, 0 if it is the stretched one.
        edges: Start and end of each panel [N], and the strain at its start (3, P).
        coefficients: Of the polynomial on each panel, lowest power first (powers, P).
        nodes: Nodes and weights of the Gauss rule on (0, 1), (2, N).
    """

    panels: Indices
    ends: Array
    edges: Array
    coefficients: Array
    nodes: Array


class WireScratch(NamedTuple):
    """Scratch of one cable: panel (W,), rows of values (7, W), coefficients (powers, W)."""

    panel: Indices
    values: Array
    coefficients: Array


@inlined
def wire_scratch(wires: Wires, width: int) -> WireScratch:
    """Allocate the scratch for a block."""
    powers = wires.coefficients.shape[0]
    return WireScratch(
        np.empty(width, dtype=np.intp), np.empty((7, width)), np.empty((powers, width))
    )


@inner
def set_linear_rigidity(
    constant: Array, linear: Array, F: Array, rigidity: Array, width: Width
) -> None:
    """Fill EA (1 + ε) (C, W) of linear laws."""
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            rigidity[c, w] = constant[c] + linear[c] * F[c, w]


@inner
def set_wire_rigidity(
    wires: Wires, tension: Array, rigidity: Array, scratch: WireScratch, width: Width
) -> None:
    """Fill ``rigidity`` (C, W) [N] with EA (1 + ε) of cables with polynomials.

    It is −1 outside the domain of the law, and EA alone if the original length of a wire is the
    stretched one.
    """
    panel, values, coefficients = scratch
    x, begin, before, inside = values[0], values[1], values[2], values[3]
    node, value, total = values[4], values[5], values[6]
    for c in upwards(0, tension.shape[0]):
        first, last = wires.panels[c, 0], wires.panels[c, 1]
        if last < first:
            continue
        least, most, rest = wires.ends[c, 0], wires.ends[c, 1], wires.ends[c, 2]
        lowest, soft, strained = wires.ends[c, 3], wires.ends[c, 4], wires.ends[c, 5]
        for w in lanes(width):
            x[w] = max(tension[c, w], lowest)
        for w in lanes(width):
            panel[w] = first
        for p in upwards(first, last):  # the panel of each tension, without a branch
            end = wires.edges[1, p]
            for w in lanes(width):
                panel[w] += 1 if x[w] > end else 0
        for r in upwards(0, coefficients.shape[0]):
            for w in lanes(width):
                coefficients[r, w] = wires.coefficients[r, np.uint64(panel[w])]
        for w in lanes(width):
            begin[w] = wires.edges[0, np.uint64(panel[w])]
        for w in lanes(width):
            before[w] = wires.edges[2, np.uint64(panel[w])]
        for w in lanes(width):
            inside[w] = x[w] - begin[w]
        for w in lanes(width):
            total[w] = 0.0
        for n in upwards(0, wires.nodes.shape[1]):  # Gauss rule for ∫ dF/EA from the panel's start
            at, weight = wires.nodes[0, n], wires.nodes[1, n]
            for w in lanes(width):
                node[w] = begin[w] + inside[w] * at
            _set_polynomial(coefficients, node, value, width)
            for w in lanes(width):
                total[w] += weight / value[w]
        _set_polynomial(coefficients, x, value, width)
        for w in lanes(width):
            F = tension[c, w]
            strain = (F - rest) / soft if rest > F else before[w] + inside[w] * total[w]
            usable = least <= F <= most and value[w] > 0.0
            rigidity[c, w] = value[w] * (1.0 + strained * strain) if usable else -1.0


@inner
def _set_polynomial(coefficients: Array, x: Array, value: Array, width: Width) -> None:
    """Fill ``value`` (W,) with polynomials at x (W,) by Horner's rule, four powers at a time."""
    for w in lanes(width):
        value[w] = 0.0
    for r in range(coefficients.shape[0] - AT_ONCE, -1, -AT_ONCE):
        k = np.uint64(r)
        a, b = coefficients[k], coefficients[k + np.uint64(1)]
        c, d = coefficients[k + np.uint64(2)], coefficients[k + np.uint64(3)]
        for w in lanes(width):
            value[w] = (((value[w] * x[w] + d[w]) * x[w] + c[w]) * x[w] + b[w]) * x[w] + a[w]

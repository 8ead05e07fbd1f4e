"""Kernels that copy values between arrays of rows, blocks and records.

In an array of rows, the posture is the first axis; in a block of W postures it is the last one. A
record (size, W) holds all quantities of a block, one after the other. Quantity number n begins in
row ``start[n]`` of the record.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm._former.compiling import Width, inlined, inner, lanes, upwards
from cdsm._former.tree import Indices
from cdsm.support.values import Array


@inner
def fetch(rows: Array, first: int, block: Array, width: Width) -> None:
    """Copy W of ``rows`` (b, n), from row ``first`` on, to a block (n, W).

    If fewer than W rows are left, the last one is repeated. If there are no rows, the block is not
    changed.
    """
    if rows.shape[0]:
        for i in upwards(0, rows.shape[1]):
            for w in lanes(width):
                block[i, w] = rows[min(first + np.intp(w), rows.shape[0] - 1), i]


@inner
def copy(matrix: Array, block: Array, width: Width) -> None:
    """Fill ``block`` (m, n, W) with the first m rows of ``matrix`` (m or more, n, W)."""
    for i in upwards(0, block.shape[0]):
        for j in upwards(0, block.shape[1]):
            for w in lanes(width):
                block[i, j, w] = matrix[i, j, w]


@inner
def clear(matrix: Array, width: Width) -> None:
    """Set the upper triangle of each ``matrix`` (n, n, W), with its diagonal, to zero."""
    for i in upwards(0, matrix.shape[0]):
        for j in upwards(i, matrix.shape[1]):
            for w in lanes(width):
                matrix[i, j, w] = 0.0


@inner
def mirror(matrix: Array, width: Width) -> None:
    """Copy the upper triangle of each ``matrix`` (nv, nv, W) to the lower triangle."""
    for i in upwards(0, matrix.shape[0]):
        for j in range(i):
            for w in lanes(width):
                matrix[i, j, w] = matrix[j, i, w]


@inlined
def vector(record: Array, start: Indices, quantity: int) -> Array:
    """Return quantity number ``quantity`` of the record as vectors of W postures, (size, W)."""
    return record[start[quantity] : start[quantity + 1]]


@inlined
def matrix(record: Array, start: Indices, quantity: int, rows: int) -> Array:
    """Return quantity number ``quantity`` of the record as matrices (rows, columns, W)."""
    part = record[start[quantity] : start[quantity + 1]]
    return part.reshape((rows, part.shape[0] // rows, part.shape[1]))


@inner
def store(
    record: Array,
    start: Indices,
    stored: NDArray[np.bool_],
    code: Indices,
    known: Indices,
    first: int,
    out: Array,
    status: NDArray[np.uint8],
) -> None:
    """Copy quantities and status of a block to ``out`` and ``status``, from row ``first`` on.

    ``stored`` says for each quantity of the ``record`` whether it is copied. ``code`` (W,) has the
    status codes. For posture w of the block, quantities of number ``known[w]`` and above do not
    exist; they become NaN.
    """
    count = min(record.shape[1], out.shape[0] - first)
    for w in lanes(count):
        status[first + np.intp(w)] = code[w]
    at = 0
    for number in range(stored.shape[0]):
        for i in upwards(start[number], start[number + 1] if stored[number] else start[number]):
            for w in lanes(count):
                out[first + np.intp(w), at] = record[i, w] if number < known[w] else math.nan
            at += 1

"""Write a stiffness as text and JSON: the printed table, the notes below it, the numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import SingularStiffness, listed
from cdsm.stiffness_matrix.cartesian import axis_of
from cdsm.support.format import MODEL, key, plain

if TYPE_CHECKING:
    from cdsm.stiffness_matrix.shares import Shares
    from cdsm.stiffness_matrix.value import Stiffness


def table(K: Stiffness) -> list[tuple[str, ...]]:
    """Return the rows of the printed table: a header, then a name and three numbers [N/mm] each."""
    axes = np.eye(3)
    shares: Callable[[int], Shares] = cache(lambda i: K.shares(axes[i]))
    lines: dict[str, Callable[[int], float]] = {
        "along": lambda i: K.along(axes[i]),
        "  of it passive": lambda i: shares(i).passive.sum(),
        "  of it active": lambda i: shares(i).active.sum(),
        "  of it gravity": lambda i: shares(i).gravity,
        "  of it load": lambda i: shares(i).load,
        "cartesian, diagonal": partial(_cartesian_entry, K),
        "pseudoinverse, diagonal": lambda i: K.pseudoinverse()[i, i],
    }

    def cell(read: Callable[[int], float], i: int) -> str:
        try:
            return f"{read(i) / 1000.0:.4g}"
        except SingularStiffness:
            return "-"

    return [
        ("stiffness [N/mm]", "x", "y", "z"),
        *((name, *(cell(read, i) for i in range(3))) for name, read in lines.items()),
    ]


def _cartesian_entry(K: Stiffness, i: int) -> float:
    """Return the diagonal entry i of :attr:`~cdsm.Stiffness.cartesian` [N/m].

    If this matrix does not exist, return the entry of axis i in
    :meth:`~cdsm.Stiffness.cartesian_in` of those axes along which the tip can move.
    """
    try:
        return float(K.cartesian[i, i])
    except SingularStiffness:
        mobile = [axis for axis in range(3) if math.isfinite(K.along(np.eye(3)[axis]))]
        if i not in mobile:
            raise
        matrix = K.cartesian_in(np.eye(3)[mobile])
        return float(matrix[mobile.index(i), mobile.index(i)])


def notes(K: Stiffness) -> tuple[str, ...]:
    """Return the lines below the table: why entries are missing, and whether the arm is stable."""
    try:
        _ = K.cartesian
        missing = []
    except SingularStiffness as error:
        u = axis_of(error.direction)
        missing = [
            f"inf, -: the tip cannot move along {u}; cartesian: in the plane of other axes"
            if error.direction.size == 3
            else "-: K_θ is singular, the arm is about to buckle"
        ]
    state = "stable" if K.is_stable else "UNSTABLE"
    unit = K.posture.arm.stiffness_unit()
    least = f"smallest joint stiffness {K.margin:.4g} {unit} ({model_of(K)})"
    return (*missing, *K.posture.remarks, *missing_leads(K), f"{state}, {least}")


def missing_leads(K: Stiffness) -> tuple[str, ...]:
    """Return a line that names the cables whose spring stretches by more than the whole cable.

    They need a longer lead. Empty if there are none.
    """
    pairs = zip(K.posture.arm.cables, K.free_lengths, strict=True)
    lost = [cable.name for cable, l_0 in pairs if l_0 <= 0.0]
    if not lost:
        return ()
    return (
        f"the series spring stretches by more than the whole cable is long: {listed(lost)}. "
        "Give a longer lead; without it K is off by up to F/EA.",
    )


def model_of(K: Stiffness) -> str:
    """Return the assumptions behind the stiffness ``K`` in words, such as locked motors."""
    if K.friction == "frictionless":
        return MODEL
    values = K.posture.segments.chains.friction
    low, high = values.min(initial=math.inf), values.max(initial=0.0)
    mu = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return MODEL.replace("frictionless", f"cables {K.friction}, μ = {mu}")


def numbers(K: Stiffness) -> dict[str, object]:
    """Return the dict of :meth:`Stiffness.to_dict` for ``K``: numbers and texts by name."""

    def read(reading: Callable[[], object]) -> object:
        try:
            return reading()
        except SingularStiffness:
            return None

    pose, unit = K.posture, K.posture.arm.stiffness_unit()
    found = {
        **pose._coordinates,
        "tip_position_m": pose.tip[:3, 3],
        "tension_N": dict(zip(pose.arm.cables.names, K.tension, strict=True)),
        "cable_length_m": pose.cable_lengths,
        key("static_residual", pose.arm.torque_unit()): K.residual,
        "model": model_of(K),
        "along_N_per_m": [read(partial(K.along, axis)) for axis in np.eye(3)],
        "cartesian_N_per_m": read(lambda: K.cartesian),
        "pseudoinverse_N_per_m": read(K.pseudoinverse),
        "compliance": read(lambda: K.compliance),
        key("joint_stiffness", unit): K.joint,
        key("margin", unit): K.margin,
        "stable": K.is_stable,
        "remedies": [
            {"change": each.change, "factor": each.factor, "text": str(each)} for each in K.remedies
        ],
    }
    return plain(found)

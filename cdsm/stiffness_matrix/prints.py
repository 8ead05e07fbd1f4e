"""Texts about a stiffness: the printed table, the notes below it, the verdict if it is unstable."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import SingularStiffness
from cdsm.load_texts import texts
from cdsm.quantities import display_for
from cdsm.stiffness_matrix.verdict import least_joint_stiffness
from cdsm.support.format import (
    MODEL,
    JointUnits,
    coordinates,
    largest_finite,
    merged,
    span,
    without_rounding,
)
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator
    from cdsm.stiffness_matrix.value import Stiffness


def readings(K: Stiffness) -> dict[str, object]:
    """Return what the JSON of a stiffness has besides its fields; None for what does not exist."""
    return {
        "tip_position_m": K.posture.tip[:3, 3],
        "cable_length_m": K.posture.cable_lengths,
        **_further_terms(K),
        "model": model_of(K),
        "along_N_per_m": [_existing(partial(K.along, u)) for u in "xyz"],
        "cartesian_N_per_m": _existing(lambda: K.cartesian),
        "pseudoinverse_N_per_m": _existing(K.pseudoinverse),
        "compliance": _existing(lambda: K.compliance),
        "stable": K.verdict.is_held,
        "verdict": K.verdict.status,
        "warnings": K.warnings,
    }


def _further_terms(K: Stiffness) -> dict[str, object]:
    """Return the terms of K_θ that only this arm has."""
    arm = K.posture.arm
    units = JointUnits(arm.slides)
    dims = ("joint", "joint_column")
    unit = arm.stiffness_unit()
    names = [term.name for term in arm.definition.terms]
    return merged(
        *(units.keyed(name, unit, dims, K.terms[name], arm.joint_names) for name in names)
    )


def _existing(read: Callable[[], object]) -> object:
    with suppress(SingularStiffness):
        return read()
    return None


def table(K: Stiffness) -> list[str]:
    """Return the lines of the printed table: readings along x, y and z, of the softer sides."""
    return [
        f"{name:<24}{''.join(f'{cell:>12}' for cell in cells)}" for name, *cells in table_rows(K)
    ]


def table_rows(K: Stiffness) -> list[tuple[str, ...]]:
    """Return the rows of the table of readings, of which the first has the titles of columns."""
    axes = np.eye(3)
    sprung = K.posture.arm.has_springs
    cables = ("passive", "active")
    terms = [name for name in K.terms if name not in cables and (sprung or name != "springs")]
    parts = (*cables, *terms)
    rows = np.full((3 + len(parts), 3), math.nan)
    for i, u in enumerate(axes):
        with suppress(SingularStiffness):
            softer = softer_side(K.along, u)
            rows[0, i] = K.along(softer)
            shares = K.shares(softer)
            sums = shares.passive.sum(), shares.active.sum(), *shares.others.values()
            rows[1:-2, i] = sums
    mobile = np.isfinite(rows[0])
    with suppress(SingularStiffness):
        if mobile.any():
            rows[-2, mobile] = K.cartesian_in(axes[mobile]).diagonal()
        rows[-1] = K.pseudoinverse().diagonal()
    for i in np.flatnonzero(mobile).tolist():
        rows[:-2, i] = without_rounding(rows[:-2, i])
    unit, size = display_for("N/m", largest_finite(rows[0]))
    cells = [["-" if math.isnan(k) else f"{k:.4g}" for k in row] for row in rows / size]
    along = "along, softer side" if K.slack else "along"
    names = [along, *(f"  of it {part}" for part in parts), "cartesian, diagonal"]
    names = [f"stiffness [{unit}]", *names, "pseudoinverse, diagonal"]
    return [(name, *row) for name, row in zip(names, ["xyz", *cells], strict=True)]


def softer_side(along: Callable[[Array], float], u: Array) -> Array:
    """Return u (3,) or −u, whichever side is softer: they differ if cables are at 0 N."""
    return u if along(u) <= along(-u) else -u


def notes(K: Stiffness) -> tuple[str, ...]:
    """Return the lines below the table: why entries are missing, and whether the arm is stable."""
    missing = []
    try:
        _ = K.cartesian
    except SingularStiffness as error:
        missing = ["-: K_θ is singular, the arm is about to buckle"]
        if _existing(lambda: K.compliance) is not None:
            fixed = f"inf, -: the tip cannot move along {axis_of(error.direction)}"
            missing = [f"{fixed}; cartesian: in the plane of other axes"]
    stiffness = f"smallest joint stiffness {least_joint_stiffness(K)}"
    least = f"{K.verdict.word}, {stiffness} ({model_of(K)})"
    line = K.posture.arm.motors.line
    return (*missing, *texts(K.posture.arm, K.applied), *([line] if line else []), least)


def model_of(K: Stiffness) -> str:
    """Return the assumptions behind the stiffness ``K`` in words, such as locked motors."""
    model = frictionless_model(K.posture.arm)
    if K.friction == "frictionless":
        return model
    mu = K.posture.segments.chains.friction
    coefficients = span(mu, "{:g}".format) if mu.size else "0"
    return model.replace("frictionless", f"cables {K.friction}, μ = {coefficients}")


def frictionless_model(arm: Manipulator) -> str:
    """Return the assumptions behind every stiffness of ``arm`` without friction, in words."""
    bends = arm.is_serpentine and (
        any(link.bending_stiffness for link in arm.geometry.links)
        or any(joint.bending_stiffness for joint in arm.geometry.joints)
    )
    model = MODEL.replace("rigid links", "links that bend") if bends else MODEL
    if arm.motors.yielding is not None:
        model = model.replace(", tangent", ", motors that yield, tangent")
    return model


def axis_of(u: Array) -> str:
    """Write a direction (3,) as text; of u and −u, the one whose largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")

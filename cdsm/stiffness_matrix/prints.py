"""Write a stiffness as text: the printed table and the notes below it."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import SingularStiffness, listed
from cdsm.support.format import MODEL, coordinates, span
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.manipulator import Manipulator
    from cdsm.stiffness_matrix.value import Stiffness

_PARTS = ("passive", "active", "gravity", "load", "springs")


def existing(read: Callable[[], object]) -> object:
    """Return a reading of a stiffness, or None if it does not exist."""
    with suppress(SingularStiffness):
        return read()
    return None


def table(K: Stiffness) -> list[str]:
    """Return the lines of the printed table: readings [N/mm] along x, y and z."""
    axes, parts = np.eye(3), _PARTS if K.posture.arm.has_springs else _PARTS[:-1]
    rows = np.full((3 + len(parts), 3), math.nan)
    for i, u in enumerate(axes):
        with suppress(SingularStiffness):
            rows[0, i] = K.along(u)
            of = K.shares(u)
            rows[1:-2, i] = [np.sum(getattr(of, part)) for part in parts]
    mobile = np.isfinite(rows[0])
    with suppress(SingularStiffness):
        if mobile.any():
            rows[-2, mobile] = K.cartesian_in(axes[mobile]).diagonal()
        rows[-1] = K.pseudoinverse().diagonal()
    cells = [["-" if math.isnan(k) else f"{k:.4g}" for k in row] for row in rows / 1e3]
    names = ["along", *(f"  of it {part}" for part in parts), "cartesian, diagonal"]
    names = ["stiffness [N/mm]", *names, "pseudoinverse, diagonal"]
    lines = zip(names, ["xyz", *cells], strict=True)
    return [f"{name:<24}{''.join(f'{cell:>12}' for cell in row)}" for name, row in lines]


def notes(K: Stiffness) -> tuple[str, ...]:
    """Return the lines below the table: why entries are missing, and whether the arm is stable."""
    missing = []
    try:
        _ = K.cartesian
    except SingularStiffness as error:
        missing = ["-: K_θ is singular, the arm is about to buckle"]
        if existing(lambda: K.compliance) is not None:
            fixed = f"inf, -: the tip cannot move along {axis_of(error.direction)}"
            missing = [f"{fixed}; cartesian: in the plane of other axes"]
    state, unit = "stable" if K.is_stable else "UNSTABLE", K.posture.arm.stiffness_unit()
    least = f"{state}, smallest joint stiffness {K.margin:.4g} {unit} ({model_of(K)})"
    return (*missing, *K.posture.remarks, *missing_leads(K), least)


def missing_leads(K: Stiffness) -> tuple[str, ...]:
    """Return a line that names the cables whose spring stretches by more than the whole cable."""
    lost = [K.posture.arm.cables[c].name for c in np.flatnonzero(K.free_lengths <= 0.0)]
    said = f"the series spring stretches by more than the whole cable is long: {listed(lost)}. "
    return (said + "Give a longer lead; without it K is off by up to F/EA.",) if lost else ()


def model_of(K: Stiffness) -> str:
    """Return the assumptions behind the stiffness ``K`` in words, such as locked motors."""
    model = frictionless_model(K.posture.arm)
    if K.friction == "frictionless":
        return model
    mu = K.posture.segments.chains.friction
    said = span(mu, "{:g}".format) if mu.size else "0"
    return model.replace("frictionless", f"cables {K.friction}, μ = {said}")


def frictionless_model(arm: Manipulator) -> str:
    """Return the assumptions behind every stiffness of ``arm`` without friction, in words."""
    bends = arm.is_serpentine and (
        any(link.bending_stiffness for link in arm.geometry.links)
        or any(joint.bending_stiffness for joint in arm.geometry.joints)
    )
    return MODEL.replace("rigid links", "links that bend") if bends else MODEL


def axis_of(u: Array) -> str:
    """Write a direction (3,) as text; of u and −u, the one whose largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")

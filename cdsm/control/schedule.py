"""Reference of each control step, interpolated from a plan; choice of tension-controlled cables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from cdsm.control.laws import Reference
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.planning.path_plan import PathPlan
from cdsm.support.validation import one_of
from cdsm.support.values import Array


class Schedule(NamedTuple):
    """Reference values at n control steps, linearly interpolated between the samples of a plan."""

    references: tuple[Reference, ...]  # reference of each step
    directions: Array  # unit directions u (D, 3), base axes
    targets: Array  # wanted stiffness (n, D) [N/m]
    tips: Array  # tip positions (n, 3) [m]
    wrenches: Array  # load of the plan (n, 6): force [N], then moment [N m]

    @classmethod
    def of(cls, plan: PathPlan, steps: int) -> Self:
        """Interpolate a complete plan, with ``steps`` equal steps from each sample to the next."""
        size = len(plan.planned)
        at = np.linspace(0.0, size - 1.0, (size - 1) * steps + 1)
        before = np.minimum(at.astype(int), max(size - 2, 0))
        after = np.minimum(before + 1, size - 1)

        def along(values: Array) -> Array:
            part = (at - before).reshape(-1, *(1,) * (values.ndim - 1))
            return np.asarray(values[before] + part * (values[after] - values[before]))

        wire = plan.cable_lengths.copy()
        wire[:, plan.arm.cables.position_controlled] = plan.rest_lengths
        k = np.array([K.cable_stiffness for K in plan.stiffness])
        angles = along(plan.angles)
        parts = angles, along(plan.tensions), along(wire), along(k)
        directions = plan.direction.reshape(-1, 3)
        return cls(
            references=tuple(Reference(*each) for each in zip(*parts, strict=True)),
            directions=directions,
            targets=along(plan.target).reshape(-1, len(directions)),
            tips=np.array([plan.arm.at(q).tip[:3, 3] for q in angles]),
            wrenches=along(np.array([K.wrench for K in plan.stiffness])),
        )


def checked_plan(plan: PathPlan) -> Manipulator:
    """Check that all samples are planned, for stiffness along directions; return the arm."""
    if not plan.complete:
        first = plan.infeasible[0]
        raise InvalidInput(
            "plan",
            f"{len(plan.infeasible)} of {len(plan.target)} samples are not planned, the first of "
            f"them sample {first.index}: {first.reason}",
        )
    return plan.arm


def tension_controlled(plan: PathPlan, names: Sequence[str] | None) -> NDArray[np.bool_]:
    """Return which cables (C,) a mixed law controls by tension: ``names``, or a default choice.

    The lengths of the other cables determine the posture. By default there are nv other cables. A
    pivoted QR decomposition of J_Lᵀ at the first sample chooses them.
    """
    cables = plan.arm.cables.names
    if names is not None:
        chosen = [one_of("cable", name, cables) for name in names]
        return np.array([cable in chosen for cable in cables])
    J = plan.stiffness[0].posture.length_jacobian
    *_, order = qr(J.T, mode="economic", pivoting=True)
    forced = np.ones(len(cables), dtype=np.bool_)
    forced[order[: J.shape[1]]] = False
    return forced

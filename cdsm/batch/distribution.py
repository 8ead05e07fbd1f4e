"""Tension distribution at many postures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch import layout
from cdsm.batch.fused_kernel import evaluate_rows
from cdsm.batch.inputs import (
    checked_threads,
    given_wrench,
    kernel_arm,
    of_rows,
    postures,
    run_slices,
)
from cdsm.batch.layout import OK, UNDECIDED, Codes, Flags
from cdsm.batch.serpentine_guess import blocks
from cdsm.batch.tension_kernel import distribute_rows
from cdsm.errors import InfeasibleTension, SolverError
from cdsm.kernels.tension import NO_ARM
from cdsm.manipulator import Manipulator
from cdsm.support.status import Status, summary
from cdsm.support.validation import instance
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import checked_bounds, distribute_tension

_NO_DIRECTIONS = frozen(np.zeros((0, 3)))


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tensions(ReadOnlyState):
    """Cable tensions that balance an arm at many postures, with loads, bounds and status.

    Attributes:
        arm: The arm.
        q: Joint angles (B, nv) [rad].
        values: F (B, C) [N], in the order of ``arm.cables``; NaN where no tensions were found.
        wrench: W (6,) for all postures, or (B, 6): force [N], then moment [N m].
        minimum: Lower bounds (C,) for all postures, or (B, C) [N].
        maximum: Upper bounds (C,) for all postures, or (B, C) [N].
        status: :class:`Status` of each posture (B,).
    """

    arm: Manipulator
    q: Array
    values: Array
    wrench: Array
    minimum: Array
    maximum: Array
    status: Codes

    @property
    def ok(self) -> Flags:
        """Return for each posture whether tensions were found, (B,)."""
        return frozen(self.status == OK)

    def __len__(self) -> int:
        return len(self.q)

    def __repr__(self) -> str:
        return f"<Tensions of {self.arm.name}, {summary(self.status)}>"


def distribute_tensions(
    arm: Manipulator,
    q: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike | None = None,
    *,
    check_limits: bool = True,
    threads: int | None = None,
) -> Tensions:
    """Compute the least tensions that balance an arm at many postures: min ‖F‖² (Eqs. 13, 17).

    Tensions are accepted only if they meet the optimality conditions of
    :func:`~cdsm.distribute_tension`. A posture is called infeasible only with a proof. All other
    postures are solved by :func:`~cdsm.distribute_tension`.

    Args:
        arm: The arm.
        q: Joint angles (B, nv) [rad], a row for each posture.
        minimum: Lower bound [N]: one number for all cables, (C,) or (B, C); not negative.
        maximum: Upper bound [N]: one number, (C,) or (B, C); inf for no bound.
        wrench: W (6,) for all postures or (B, 6) at ``tool0`` in base axes: force [N], then moment
            [N m]; zero if not given.
        check_limits: Pass over postures beyond the joint limits.
        threads: Maximum number of threads; by default one for each core.

    Raises:
        InvalidInput: An argument has the wrong shape or is not a number, or bounds contradict each
            other. A failure at a single posture sets :attr:`Tensions.status` instead.
    """
    instance("arm", arm, Manipulator)
    angles = postures(arm, q)
    low, high = checked_bounds(arm, minimum, maximum, len(angles))
    loads = given_wrench(wrench, len(angles))
    values = np.empty((len(angles), len(arm.cables)))
    status = np.zeros(len(angles), dtype=np.uint8)
    distributor = Distributor(arm, angles, low, high, loads, check_limits)

    def work(part: slice) -> None:
        values[part], status[part] = distributor.at(part)

    run_slices(work, len(angles), distributor.width, checked_threads(threads))
    return Tensions(
        arm=arm,
        q=angles,
        values=frozen(values),
        wrench=loads,
        minimum=low,
        maximum=high,
        status=frozen(status),
    )


class Distributor:
    """Tension distribution for slices of the postures, with checked arguments.

    The arguments are those of :func:`distribute_tensions`; ``low`` and ``high`` are (C,) or (B, C).

    Attributes:
        width: Floats of temporary memory per posture.
    """

    def __init__(
        self,
        arm: Manipulator,
        q: Array,
        low: Array,
        high: Array,
        wrench: Array,
        check_limits: bool,
    ) -> None:
        self._arm, self._q, self._wrench = arm, q, wrench
        self._low, self._high = low, high
        self._arrays = kernel_arm(arm, check_limits)
        self._blocks = blocks(arm._model.routing, arm.nv)
        self._start = layout.starts(arm.nv, len(arm.cables), 0)
        self._wanted = np.array(
            [layout.JACOBIAN, layout.LENGTH_JACOBIAN, layout.GRAVITY_TORQUE], dtype=np.intp
        )
        self.width = (7 + len(arm.cables)) * arm.nv + 3 * len(arm.cables)

    def at(self, part: slice) -> tuple[Array, Codes]:
        """Return tensions (b, C) [N] and status (b,) of a slice of the postures."""
        rows = len(self._q)
        q = self._q[part]
        low, high, wrench = (
            of_rows(each, part, rows) for each in (self._low, self._high, self._wrench)
        )
        values, status = np.empty((len(q), low.shape[1])), np.zeros(len(q), dtype=np.uint8)
        known = np.empty((len(q), (7 + low.shape[1]) * q.shape[1]))
        evaluate_rows(
            self._arrays,
            q,
            low,
            low,
            wrench,
            _NO_DIRECTIONS,
            self._start,
            self._wanted,
            known,
            status,
        )
        smallest_arm = NO_ARM * self._arm.length
        distribute_rows(self._blocks, known, low, high, wrench, smallest_arm, values, status)
        for r in np.flatnonzero(status == UNDECIDED).tolist():
            pose = self._arm.at(q[r], check_limits=False)
            try:
                values[r] = distribute_tension(pose, low[r], high[r], wrench[r]).values
                status[r] = OK
            except (InfeasibleTension, SolverError) as error:
                status[r] = Status.of(error) or Status.SOLVER_FAILED
        return values, status

"""Tension distribution at many postures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.inputs import checked_threads, given_wrench, postures
from cdsm.batch.quantities import Codes, OfPostures
from cdsm.batch.solution import Rows
from cdsm.manipulator import Manipulator
from cdsm.support.validation import flag, instance
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tensions(OfPostures):
    """Cable tensions that balance an arm at B postures, with loads, bounds and status.

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

    def _quantities(self) -> Iterator[tuple[str, Any, str, tuple[str, ...]]]:
        return self._of({"tension": self.values})


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
    """Compute the least tensions that balance an arm at B postures: min ‖F‖² (Eqs. 13, 17).

    Tensions are accepted only if they meet the optimality conditions of
    :func:`~cdsm.distribute_tension`. A posture gets the status ``INFEASIBLE`` only with a proof.

    Args:
        arm: The arm.
        q: Joint angles (B, nv) [rad], a row for each posture.
        minimum: Lower bound [N]: one number for all cables, (C,) or (B, C); not negative.
        maximum: Upper bound [N]: one number, (C,) or (B, C); inf for no bound.
        wrench: W (6,) for all postures or (B, 6) at ``tool0`` in base axes: force [N], then moment
            [N m]; zero if not given.
        check_limits: Skip postures beyond the joint limits; their status is ``BEYOND_LIMITS``.
        threads: Maximum number of threads; by default one for each core.

    Raises:
        InvalidInput: An argument has the wrong shape or is not a number, or bounds contradict each
            other. A failure at a single posture sets :attr:`Tensions.status` instead.
    """
    instance("arm", arm, Manipulator)
    angles = postures(arm, q)
    low, high = checked_bounds(arm, minimum, maximum, len(angles))
    loads = given_wrench(wrench, len(angles))
    status = np.zeros(len(angles), dtype=np.uint8)
    rows = Rows(
        arm=arm,
        q=angles,
        wrench=np.atleast_2d(loads),
        names=("tension",),
        bounds=(np.atleast_2d(low), np.atleast_2d(high)),
        check_limits=flag("check_limits", check_limits),
    )
    values = rows.solve(status, checked_threads(threads))["tension"]
    return Tensions(
        arm=arm,
        q=angles,
        values=frozen(values),
        wrench=loads,
        minimum=low,
        maximum=high,
        status=frozen(status),
    )

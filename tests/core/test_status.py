"""One status for each error that a posture can raise."""

from collections.abc import Callable

import numpy as np
import pytest

import cdsm
from cdsm.support.status import Status, summary

ARM = cdsm.presets.virtual_prototype()
POSE = ARM.at(np.zeros(ARM.nv))


@pytest.mark.parametrize(
    ("status", "fails"),
    [
        (Status.BEYOND_LIMITS, lambda: ARM.at(np.full(ARM.nv, 3.0))),
        (Status.INFEASIBLE, lambda: cdsm.distribute_tension(POSE, 1.0, 2.0, [0, 0, 50, 0, 0, 0])),
        (Status.OUTSIDE_ELASTICITY, lambda: cdsm.stiffness(POSE, np.full(15, 5e3))),
    ],
)
def test_an_error_of_a_posture_has_a_status(status: Status, fails: Callable[[], object]) -> None:
    with pytest.raises(cdsm.CdsmError) as caught:
        fails()
    assert Status[caught.value.status] is status


def test_other_errors_have_none() -> None:
    assert not cdsm.InvalidInput("q", "is wrong.").status


def test_summary_counts_rows() -> None:
    assert summary(np.array([0, 3, 3], dtype=np.uint8)) == "3 postures: 1 OK, 2 INFEASIBLE"
    assert summary(np.array([3], dtype=np.uint8)) == "1 posture: 0 OK, 1 INFEASIBLE"

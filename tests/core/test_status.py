"""One status for each error that a posture can raise."""

import numpy as np
import pytest

import cdsm
from cdsm.support.status import Status, summary

ERRORS: dict[Status, cdsm.CdsmError] = {
    Status.BEYOND_LIMITS: cdsm.JointLimitError(
        ["joint1 is at 2 rad"], ["joint1"], [2.0], [(-1.0, 1.0)]
    ),
    Status.COINCIDENT_SITES: cdsm.CableError("cable1", "its sites coincide."),
    Status.INFEASIBLE: cdsm.InfeasibleTension(np.ones(1), "joint1", 1.0, ["cable1"]),
    Status.SOLVER_FAILED: cdsm.SolverError("daqp", "failed."),
    Status.OUTSIDE_ELASTICITY: cdsm.ElasticityRangeError("too far.", [900.0]),
    Status.SINGULAR: cdsm.SingularStiffness("K_θ is singular.", np.ones(1)),
}


@pytest.mark.parametrize("status", ERRORS, ids=lambda status: status.name)
def test_an_error_of_a_posture_has_a_status(status: Status) -> None:
    assert Status.of(ERRORS[status]) is status


def test_other_errors_have_none() -> None:
    assert Status.of(cdsm.InvalidInput("q", "is wrong.")) is None


def test_summary_counts_rows() -> None:
    assert summary(np.array([0, 3, 3], dtype=np.uint8)) == "3 postures: 1 OK, 2 INFEASIBLE"
    assert summary(np.array([3], dtype=np.uint8)) == "1 posture: 0 OK, 1 INFEASIBLE"

"""One enum says why a result does not exist; every error carries its member."""

import json
import pickle

import numpy as np
import pytest

import cdsm
from cdsm import Status
from cdsm.design import InfeasibleDesign
from cdsm.status import ENTRY_STATUSES
from cdsm.support.format import prepare_json

ZERO = np.zeros(3)


def test_codes_that_stand_in_stores_keep_their_names() -> None:
    names = "OK BEYOND_LIMITS COINCIDENT_SITES INFEASIBLE SOLVER_FAILED OUTSIDE_ELASTICITY"
    names += " SINGULAR IMMOBILE UNSTABLE PENDING OUT_OF_REACH"
    assert [status.name for status in ENTRY_STATUSES] == names.split()
    assert [int(status) for status in Status] == list(range(len(Status)))


def test_every_cause_has_a_message_of_its_own() -> None:
    messages = [status.message for status in Status]
    assert all(messages)
    assert len({*messages}) == len(messages)
    assert pickle.loads(pickle.dumps(Status.DIVERGED)) is Status(int(Status.DIVERGED))


@pytest.mark.parametrize(
    ("error", "status", "is_unmet", "is_fault"),
    [
        (cdsm.CdsmError("text"), Status.FAILED, False, True),
        (cdsm.InvalidInput("q", "text"), Status.INVALID_INPUT, False, True),
        (cdsm.InvalidInput("q", "text", Status.BEYOND_LIMITS), Status.BEYOND_LIMITS, False, False),
        (cdsm.GeometryError("text"), Status.INVALID_INPUT, False, True),
        (cdsm.ElasticityRangeError("text"), Status.OUTSIDE_ELASTICITY, False, False),
        (cdsm.SingularStiffness("text", ZERO), Status.SINGULAR, False, False),
        (cdsm.EquilibriumError("text", ZERO, 0.5, "joint1"), Status.NO_EQUILIBRIUM, True, False),
        (cdsm.InfeasibleTension(ZERO, "joint1", 1.0, ()), Status.INFEASIBLE, True, False),
        (
            cdsm.UnreachableStiffness(ZERO, 9.0, 1.0, 2.0, [2.0]),
            Status.UNREACHABLE_STIFFNESS,
            True,
            False,
        ),
        (InfeasibleDesign("text", (), ()), Status.INFEASIBLE_DESIGN, True, False),
    ],
)
def test_every_error_carries_its_cause(
    error: cdsm.CdsmError, status: Status, is_unmet: bool, is_fault: bool
) -> None:
    assert error.status is status
    assert (status.is_unmet, status.is_fault) == (is_unmet, is_fault)
    assert pickle.loads(pickle.dumps(error)).status is status
    data = json.loads(json.dumps(prepare_json({"status": error.status})))
    assert data == {"status": status.word}

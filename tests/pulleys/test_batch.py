"""Batches of arms with pulleys against single postures, in every pattern of pulleys that touch."""

from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.batch import solution
from cdsm.pulleys.contact_shifts import _solved
from tests.support.pulleys import finger

OUTPUTS = ("joint", "active", "passive", "cable_lengths", "length_jacobian", "along", "tip")
REACH = np.array([0.1, 1.2, 1.2, 1.2])


def mixed(*, chained: bool = True) -> cdsm.Manipulator:
    """The finger with a groove in every second pulley, also of those that follow each other."""
    arm = finger(plane=False, chained=chained)
    number = count()
    cables = []
    for cable in arm.cables:
        path = [
            replace(each, groove=next(number) % 2 == 0) if isinstance(each, cdsm.Pulley) else each
            for each in cable.sites
        ]
        cables.append(replace(cable, sites=tuple(path)))
    return arm.with_cables(cables)


@pytest.mark.parametrize(
    ("compiled", "contacts_compiled"),
    [(False, False), (False, True), (True, False), (True, True)],
    ids=["by numpy", "contacts compiled", "pose compiled", "compiled"],
)
@pytest.mark.parametrize(
    "arm",
    [
        finger(),
        finger(plane=False),
        finger(plane=False, groove=False),
        finger(plane=False, groove=False, chained=False),
        mixed(),
        mixed(chained=False),
    ],
    ids=["in the plane", "beside grooves", "smooth", "smooth, alone", "mixed", "mixed, alone"],
)
def test_rows_are_postures(
    arm: cdsm.Manipulator,
    compiled: bool,
    contacts_compiled: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kernels = solution.compiled_kernels() if compiled else solution.numpy_kernels()
    monkeypatch.setattr(solution, "choose_kernels", lambda *_: kernels)
    if contacts_compiled:
        monkeypatch.setattr(solution, "PLAIN", 0)
    rng = np.random.default_rng(0)
    q = rng.uniform(-REACH, REACH, (60, 4))
    q[:30, 0] = 0.0
    F = rng.uniform(5.0, 30.0, (60, len(arm.cables)))
    batch = cdsm.evaluate(arm, q, F, outputs=OUTPUTS, direction="z")
    patterns = set()
    for i in range(60):
        if batch.status[i] == cdsm.Status.COINCIDENT_SITES:
            with pytest.raises(cdsm.InvalidInput):
                arm.at(q[i])
            continue
        pose = arm.at(q[i])
        patterns.add(tuple(pose.wraps.touches.tolist()))
        K = cdsm.stiffness(pose, F[i])
        expected: dict[str, Any] = {
            "joint": K.joint,
            "active": K.active,
            "passive": K.passive,
            "cable_lengths": pose.cable_lengths,
            "length_jacobian": pose.length_jacobian,
            "tip": pose.tip,
        }
        for name, value in expected.items():
            size = max(abs(value).max(), 1e-3)
            np.testing.assert_allclose(batch[name][i], value, rtol=0.0, atol=1e-12 * size)
        if batch.status[i] == cdsm.Status.OK:
            assert batch["along"][i] == pytest.approx(K.along("z"), rel=1e-9)
    assert len(patterns) > 10
    # with these outputs a kernel has the sum of the terms alone
    alone = cdsm.evaluate(arm, q, F, outputs=("joint", "along"), direction="z")
    np.testing.assert_array_equal(alone.status, batch.status)
    size = abs(batch["joint"]).max(axis=(1, 2), keepdims=True)
    known = np.isfinite(size.ravel())
    error = abs(alone["joint"] - batch["joint"])[known] / size[known]
    assert error.max() < 1e-12
    np.testing.assert_allclose(alone["along"][alone.ok], batch["along"][batch.ok], rtol=1e-9)


def test_distributed_tensions_and_sweeps_know_pulleys() -> None:
    arm = finger().with_springs({"to_l3": 0.5, "to_l2": 0.5, "to_l1": 0.5})
    q = np.random.default_rng(3).uniform(0.0, 0.5, (5, 4)) * [0.0, 1.0, 1.0, 1.0]
    pull = cdsm.distribute_tensions(arm, q, minimum=1.0)
    for i in range(5):
        single = cdsm.distribute_tension(arm.at(q[i]), minimum=1.0)
        np.testing.assert_allclose(pull.values[i], single.values, rtol=0.0, atol=1e-9)


def test_the_report_compares_with_a_batch() -> None:
    arm = finger(plane=False).with_springs({f"to_l{k}": 0.5 for k in range(4)})
    pose = arm.at([0.1, 0.3, 0.2, 0.1])
    report = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0)).report()
    assert "not possible" not in str(report)
    assert "FAIL" not in str(report)


def test_shifts_that_do_not_exist_in_a_row_are_no_obstacle_to_others() -> None:
    """In a row that is refused, contacts may be anything; numpy had raised LinAlgError for all."""
    M = np.stack([2.0 * np.eye(2), np.zeros((2, 2)), np.eye(2)])
    found = _solved(M, np.ones((3, 2, 4)))
    np.testing.assert_array_equal(found[0], 0.5)
    assert np.isnan(found[1]).all()
    np.testing.assert_array_equal(found[2], 1.0)

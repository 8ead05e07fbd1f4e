"""Every number of an independent implementation, at the postures and loads it was run at."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array

REFERENCE: dict[str, dict[str, Any]] = json.loads(
    (Path(__file__).parents[1] / "data" / "reference_cases.json").read_text(encoding="utf-8")
)
CASES = [(name, i) for name, arm in REFERENCE.items() for i in range(len(arm["cases"]))]

ROUNDING = 1e-13
"""Of the largest entry: some units in the last place, and what inverses add to them."""

# the reference has no masses on its crosses, 1e-6 kg each beside links of 0.5 kg: they weigh 2e-6
# of the gravity torque, and next to nothing beside elastic cables
CROSSES = {
    "gravity": 5e-6,
    "gravity_torque": 5e-6,
    "joint": 1e-10,
    "compliance": 1e-10,
    "cartesian": 1e-10,
    "pseudoinverse": 1e-10,
}


def _arm(name: str) -> cdsm.Manipulator:
    arm = REFERENCE[name]
    geometry: cdsm.Geometry = getattr(cdsm.Geometry, arm["constructor"])(**arm["geometry"])
    return cdsm.Manipulator(
        geometry, cdsm.LinearElasticity(arm["rigidity"]), gravity=arm["gravity"]
    )


def _answers(K: cdsm.Stiffness) -> dict[str, Array]:
    pose = K.posture
    return {
        "tip_position": pose.tip[:3, 3],
        "tip_rotation": pose.tip[:3, :3],
        "jacobian": pose.jacobian,
        "cable_lengths": pose.cable_lengths,
        "length_jacobian": pose.length_jacobian,
        "gravity_torque": pose.gravity_torque,
        "cable_stiffness": K.cable_stiffness,
        "active": K.active,
        "passive": K.passive,
        "gravity": K.gravity,
        "load": K.load,
        "joint": K.joint,
        "compliance": K.compliance,
        "cartesian": K.cartesian,
        "pseudoinverse": K.pseudoinverse(),
    }


@pytest.mark.parametrize(("name", "case"), CASES, ids=[f"{n}-{i}" for n, i in CASES])
def test_reference_case(name: str, case: int) -> None:
    expected = REFERENCE[name]["cases"][case]
    K = cdsm.stiffness(_arm(name).at(expected["q"]), expected["tension"], expected["wrench"])
    crosses = REFERENCE[name]["constructor"] == "universal"
    for key, found in _answers(K).items():
        theirs = np.array(expected[key])
        relative = CROSSES.get(key, ROUNDING) if crosses else ROUNDING
        assert found.shape == theirs.shape
        off = relative * abs(theirs).max()
        np.testing.assert_allclose(found, theirs, rtol=0.0, atol=off, err_msg=key)
    C = np.array(expected["compliance"])[:3, :3]
    for u in (*np.eye(3), np.array([0.48, -0.6, 0.64])):
        assert K.along(3.0 * u) == pytest.approx(1.0 / (u @ C @ u), rel=CROSSES["compliance"])

"""Somebody else's robots: trees that branch and slide, by differences and by other programs."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.differences import assert_second_order
from tests.support.foreign import POSTURE, TENSION, TREE, crab, energy

UP = np.array([3.0, -4.0, 5.0])


def test_cable_lengths_have_their_derivatives() -> None:
    arm = crab()
    pose = arm.at(POSTURE)

    def lengths(q: Array) -> Array:
        return arm.at(q, check_limits=False).cable_lengths

    assert arm.nv == 6
    assert_second_order(lengths, pose.length_jacobian, POSTURE, step=2.0**-9, tolerance=1e-9)
    # rounding leaves the second difference fewer digits
    assert_second_order(
        lengths, pose.length_hessian, POSTURE, order=2, step=2.0**-8, tolerance=1e-6
    )


def test_stiffness_is_the_hessian_of_the_potential() -> None:
    """The master law: all four terms and their signs, over slides and across branches."""
    arm = crab(gravity=(1.0, -2.0, -9.0))
    pose = arm.at(POSTURE)
    K = cdsm.stiffness(pose, TENSION, wrench=np.append(UP, np.zeros(3)))
    total = energy(arm, UP, pose, TENSION)
    assert_second_order(total, K.residual, POSTURE, step=2.0**-9, size=50.0, tolerance=1e-7)
    assert_second_order(total, K.joint, POSTURE, order=2, step=2.0**-8, size=50.0, tolerance=1e-6)


def test_loaded_equilibrium_moves_by_the_compliance() -> None:
    arm = crab()
    pose = arm.at(POSTURE)
    moved = []
    for size in (1e-3, -1e-3):
        wrench = size * np.append(UP, np.zeros(3))
        moved.append(cdsm.equilibrium(pose, TENSION, wrench))
    rest = cdsm.equilibrium(pose, TENSION)
    expected = rest.compliance[:3, :3] @ UP
    tips = [each.pose.tip[:3, 3] for each in moved]
    np.testing.assert_allclose((tips[0] - tips[1]) / 2e-3, expected, rtol=1e-5, atol=1e-12)


def test_robot_from_a_file_is_the_robot_from_its_text(tmp_path: Path) -> None:
    path = tmp_path / "crab.urdf"
    path.write_text(TREE, encoding="utf-8")
    file = cdsm.write_cables(crab().cables, tmp_path / "cables.toml")
    arm = cdsm.Manipulator.from_urdf(path, cdsm.read_cables(file), tip="tip")
    assert arm == crab()
    with pytest.raises(cdsm.InvalidInput, match="made from a URDF"):
        _ = arm.geometry
    for tip in ("nose", "a"):  # no link, and a joint
        with pytest.raises(cdsm.InvalidInput, match="link"):
            cdsm.Manipulator.from_urdf(TREE, crab().cables, tip=tip)

"""MuJoCo's tendons around cylinders as the judge of lengths and moment arms; exported arms."""

from typing import Any

import mujoco
import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Sheath, Site
from cdsm.support.values import Array
from tests.support.mujoco_arms import tendon_jacobian
from tests.support.pulleys import Link, arm_of, finger

LINKS = [
    Link("l1", "base", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Link("l2", "l1", (0.03, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Link("l3", "l2", (0.03, 0.0, 0.0), (0.3, 1.0, 0.2)),
]
PATHS = {
    "between": ((0.0, 0.01, 0.004), (0.01, 0.01, 0.002)),
    "far around": ((0.0, 0.005, 0.02), (0.005, 0.01, 0.02)),
}


def _loaded(arm: cdsm.Manipulator, **options: Any) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, **options))
    return model, mujoco.MjData(model)


def _at(model: mujoco.MjModel, data: mujoco.MjData, q: Array) -> None:
    data.qpos[:] = q
    mujoco.mj_forward(model, data)


@pytest.mark.parametrize("path", PATHS)
def test_lengths_and_moment_arms_of_smooth_cylinders_are_mujocos(path: str) -> None:
    start, end = PATHS[path]
    cylinder = Pulley("l1", (0.02, 0.0, 0.0), (0.1, 1.0, 0.2), 0.008, groove=False)
    arm = arm_of(LINKS, [Site("base", start), cylinder, Site("l3", end)], limit=1.2)
    model, data = _loaded(arm)
    rng = np.random.default_rng(0)
    lifted = 0
    checked = 0
    while checked < 200:
        q = rng.uniform(-1.2, 1.2, 3)
        try:
            pose = arm.at(q)
        except cdsm.InvalidInput:
            continue  # a site is inside the cylinder
        _at(model, data, q)
        np.testing.assert_allclose(pose.cable_lengths, data.ten_length, rtol=0.0, atol=1e-14)
        theirs = tendon_jacobian(model, data)
        np.testing.assert_allclose(pose.length_jacobian, theirs, rtol=0.0, atol=1e-14)
        lifted += not pose.wraps.touches[0]
        checked += 1
    assert 20 < lifted < 180


def test_the_exported_finger_rests_at_its_posture_and_has_its_lengths() -> None:
    """Grooves in their plane are smooth cylinders; wraps stay below 190° within the limits."""
    arm = finger(chained=False)
    pose = arm.at(np.deg2rad([0.0, 12.0, 8.0, 10.0]))
    pull = np.array([20.0, 15.0, 21.0, 22.0, 5.0, 12.0, 12.0])
    model, data = _loaded(arm, pose=pose, tension=pull)
    mujoco.mj_forward(model, data)
    torque = data.qfrc_actuator + data.qfrc_passive - data.qfrc_bias
    K = cdsm.stiffness(pose, pull)
    expected = -pose.length_jacobian.T @ pull - pose.gravity_torque
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-8)
    assert K.is_stable
    rng = np.random.default_rng(1)
    for _ in range(50):
        q = np.append(0.0, rng.uniform(0.0, 1.2, 3))
        _at(model, data, q)
        assert pose.arm.at(q).wraps.angle.max() < np.deg2rad(190.0)
        lead = np.array([cable.lead for cable in arm.cables])
        lengths = arm.at(q).cable_lengths - lead
        # a site on a rim is 1e-6 r outside it
        np.testing.assert_allclose(data.ten_length, lengths, rtol=0.0, atol=1e-7)


def test_the_model_says_what_it_lacks() -> None:
    pulley = Pulley("l1", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0), 0.008)
    beside = [Site("base", (0.0, 0.01, 0.004)), pulley, Site("l3", (0.01, 0.01, 0.002))]
    text = cdsm.to_mjcf(arm_of(LINKS, beside))
    assert "smooth cylinders" in text
    assert "beside the plane of the pulley on l1" in text


def test_a_sheath_has_no_length_in_the_tendon() -> None:
    path = [Site("base", (0.0, 0.01, 0.0)), Site("l1", (0.01, 0.01, 0.0))]
    path += [Sheath(0.3), Site("l2", (0.01, 0.01, 0.0)), Site("l3", (0.01, 0.01, 0.0))]
    arm = arm_of(LINKS, path)
    model, data = _loaded(arm)
    for q in ([0.1, 0.2, 0.3], [-0.3, 0.1, 0.4]):
        _at(model, data, np.array(q))
        pose = arm.at(q)
        np.testing.assert_allclose(pose.cable_lengths - 0.3, data.ten_length, atol=1e-14)
        np.testing.assert_allclose(pose.length_jacobian, tendon_jacobian(model, data), atol=1e-14)
        assert pose.moment_arms["cable1", "to_l2"] == 0.0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([Pulley("l2", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0), 0.004)], "MuJoCo wants a site between"),
        ([], "no whole turns"),
    ],
)
def test_what_mujoco_cannot_have_is_refused(more: list[Any], words: str) -> None:
    turns = 0 if more else 1
    first = Pulley("l1", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0), 0.008, turns=turns)
    arm = arm_of(LINKS, [Site("base", (0, 0, 0.004)), first, *more, Site("l3", (0.02, 0.0, 0.012))])
    with pytest.raises(cdsm.InvalidInput, match=words):
        cdsm.to_mjcf(arm)

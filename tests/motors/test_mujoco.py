"""Motors in MuJoCo: each tendon begins at a slider that the motors move by B φ."""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest
from lxml import etree

import cdsm
from cdsm.support.values import Array
from tests.support.motors import BENT, changed, pairs, spooled

SOFT = cdsm.LinearElasticity(2e4)
DOWN = np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0])
TORQUE: dict[str, object] = {"control": "torque", "stiffness": np.inf}
_WAY = 0.1  # from each slider to the first site [m]


class Slid(NamedTuple):
    """Model of an arm whose tendons begin at sliders."""

    model: Any
    joints: list[int]  # places of the arm's joints
    sliders: list[int]  # of the sliders, by cable

    def net(self, q: Array, wire: Array) -> tuple[Array, Array]:
        """MuJoCo's torques (nv,) on the joints, and forces (C,) on the sliders along B φ."""
        data = mujoco.MjData(self.model)
        data.qpos[self.joints] = q
        data.qpos[self.sliders] = wire
        mujoco.mj_forward(self.model, data)
        torque = data.qfrc_passive - data.qfrc_bias
        return torque[self.joints], torque[self.sliders]


def slid(arm: cdsm.Manipulator, pose: cdsm.Posture, tension: Array) -> Slid:
    """The exported model of linear wires without lead, and a slider before each first site."""
    plain = arm.with_motors([])
    text = cdsm.to_mjcf(plain, plain.at(pose.q), tension, actuators="none")
    root = etree.fromstring(text.encode())
    names = arm.cables.names
    base = next(
        body for body in root.iter("body") if body.find(f"site[@name='{names[0]}/1']") is not None
    )
    for c, name in enumerate(names):
        site = base.find(f"site[@name='{name}/1']")
        assert site is not None
        x, y, z = map(float, str(site.get("pos")).split())
        slider = etree.SubElement(base, "body", name=f"s{c}", pos=f"{x - _WAY} {y} {z}")
        etree.SubElement(slider, "inertial", pos="0 0 0", mass="1e-3", diaginertia="1e-6 1e-6 1e-6")
        etree.SubElement(slider, "joint", name=f"s{c}", type="slide", axis="-1 0 0")
        etree.SubElement(slider, "site", name=f"{name}/0")
        tendon = root.find(f"tendon/spatial[@name='{name}']")
        assert tendon is not None
        tendon.insert(0, etree.Element("site", site=f"{name}/0"))
        _, rest = str(tendon.get("springlength")).split()
        tendon.set("springlength", f"0 {float(rest) + _WAY!r}")
    for key in list(root.iter("keyframe")):
        root.remove(key)
    model = mujoco.MjModel.from_xml_string(etree.tostring(root).decode())

    def places(joints: list[str]) -> list[int]:
        return [int(model.joint(name).qposadr[0]) for name in joints]

    return Slid(model, places([*arm.joint_names]), places([f"s{c}" for c in range(len(names))]))


@pytest.mark.parametrize(
    ("changes", "moved", "turned"), [({}, 0.59, 0.25), ({"m1": TORQUE}, 74.18, 66.19)]
)
def test_mujoco_is_at_rest_where_cdsm_is(
    changes: dict[str, dict[str, object]], moved: float, turned: float
) -> None:
    # each axis alone may turn until disks touch
    sizes = {"lead": 0.0, "joint_limit": 2.0 * math.atan(0.012 / 0.025)}
    arm = spooled(np.inf if changes else 20.0, SOFT, **sizes)
    arm = changed(arm, changes)
    pose = arm.at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    rest = cdsm.equilibrium(pose, pull, DOWN)
    assert abs(1e3 * rest.moved - moved) < 0.01
    assert abs(np.rad2deg(abs(rest.motor_turns).max()) - turned) < 0.01
    assert rest.stable
    B = arm.motors.matrix
    torque, force = slid(arm, pose, pull.values).net(rest.pose.q, B @ rest.motor_turns)
    load = DOWN @ rest.pose.jacobian
    assert abs(load).max() > 0.5
    assert abs(torque + load).max() < 2e-12
    k_m = np.array([0.0 if m.control == "torque" else m.stiffness for m in arm.motors.given])
    soft = np.isfinite(k_m)
    reaction = np.where(soft, np.where(soft, k_m, 0.0) * rest.motor_turns, 0.0)
    off = force @ B + B.T @ pull.values - reaction
    assert abs(off[soft]).max() < 1e-12
    assert len(pairs(arm)) == len(k_m)

"""Hang a weight on an arm in MuJoCo, its motors locked, and compare with cdsm.

    pip install mujoco
    python examples/mujoco_weight.py

Its wires have a constant EA, so MuJoCo's springs are the same cables, and both agree at rest.
"""

from __future__ import annotations

import mujoco
import numpy as np

import cdsm

ARM = cdsm.Geometry.universal(
    joints=3,
    cables_per_joint=3,
    link_length=0.06,
    base_length=0.03,
    disk_offset=0.005,
    hole_radius=0.02,
    link_mass=0.05,
)
EA = 48e3
"""Rigidity of the wires [N]."""

WEIGHT = 9.81 * 0.1
"""Of 100 g [N]."""

AT_REST = 1e-8
"""Speed of the fastest joint of an arm at rest [rad/s]."""


def posture() -> tuple[cdsm.Posture, cdsm.Tension]:
    """Return a bent arm and tensions that balance it."""
    pose = cdsm.Manipulator(ARM, elasticity=cdsm.LinearElasticity(EA)).at([0.1] * 6)
    return pose, cdsm.distribute_tension(pose, 20.0)


def simulate(pose: cdsm.Posture, tension: cdsm.Tension) -> np.ndarray:
    """Return how far the weight moves the tip (3,) [m], in MuJoCo."""
    text = cdsm.to_mjcf(pose.arm, pose, tension, damping_ratio=0.7)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)  # at the posture, with locked motors
    tip = model.site("tool0").id
    link = model.site_bodyid[tip]
    force = np.array([0.0, 0.0, -WEIGHT])
    mujoco.mj_forward(model, data)
    while data.time < 20.0:
        # MuJoCo's forces act at the centre of mass: the way from there to the tip adds a moment
        way = data.site_xpos[tip] - data.xipos[link]
        data.xfrc_applied[link] = np.concatenate([force, np.cross(way, force)])
        mujoco.mj_step(model, data)
        if data.time > 0.1 and abs(data.qvel).max() < AT_REST:
            return np.asarray(data.site_xpos[tip] - pose.tip[:3, 3])
    raise RuntimeError("the arm does not come to rest within 20 s")


def compute(pose: cdsm.Posture, tension: cdsm.Tension) -> np.ndarray:
    """Return how far the weight moves the tip (3,) [m], by the equilibrium of cdsm."""
    rest = cdsm.equilibrium(pose, tension, wrench=[0.0, 0.0, -WEIGHT, 0.0, 0.0, 0.0])
    return np.asarray(rest.pose.tip[:3, 3] - pose.tip[:3, 3])


if __name__ == "__main__":
    arm = posture()
    for name, moved in (("MuJoCo", simulate(*arm)), ("cdsm", compute(*arm))):
        print(f"{name:>6}: the tip moves by {', '.join(f'{1e3 * x:.4f}' for x in moved)} mm")

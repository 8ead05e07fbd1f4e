"""Robots that nobody here wrote, from example-robot-data: the extra ``[robots]``."""

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree

import cdsm
from cdsm.support.values import Array

data: Any = pytest.importorskip("example_robot_data", reason="the extra [robots] is not installed")
pin: Any = pytest.importorskip("pinocchio")
pytestmark = pytest.mark.filterwarnings("ignore::cdsm.errors.CdsmWarning")

FOLDER = Path(data.robots_loader.getModelPath("ur_description"))


def tendon(name: str, links: Sequence[str], points: Iterable[Iterable[float]]) -> cdsm.Cable:
    sites = [cdsm.Site(x, tuple(map(float, p))) for x, p in zip(links, points, strict=True)]  # type: ignore[arg-type]
    return cdsm.Cable(name, tuple(sites), cdsm.LinearElasticity(5e4), lead=0.3)


def hand() -> cdsm.Manipulator:
    """The Allegro hand: a flexor along the pads and an extensor along the back of three fingers."""
    cables = []
    for finger in range(3):
        links = ["palm_link", *(f"link_{4 * finger + k}.0" for k in range(4))]
        for side, x in (("flexor", 0.009), ("extensor", -0.009)):
            holes = [(x, 0.0, z) for z in (0.008, 0.025, 0.02, 0.015)]
            way = [(x, 0.0435 * (1 - finger), -0.02), *holes]
            cables.append(tendon(f"{side}{finger}", links, way))
    file = FOLDER / "allegro_hand_description/urdf/allegro_right_hand.urdf"
    return cdsm.Manipulator.from_urdf(file, cables, tip="link_3.0_tip", check_inertia=False)


def gripper_arm() -> cdsm.Manipulator:
    """The Panda: cables in pairs along its links, and one that closes the coupled fingers."""
    links = [f"panda_link{k}" for k in range(8)]
    cables = [
        tendon(f"pair{end}{side}", links[: end + 1], [(0.05, side * 0.05, 0.02 * end)] * (end + 1))
        for end in (2, 4, 6, 7)
        for side in (1, -1)
    ]
    way = (*links[5:], "panda_hand", "panda_leftfinger")
    cables.append(tendon("close", way, [(0.01, 0.02, 0.03)] * 5))
    file = FOLDER / "panda_description/urdf/panda.urdf"
    return cdsm.Manipulator.from_urdf(file, cables, tip="panda_hand")


BY_HAND = {"hand": hand, "arm": gripper_arm}


def inside(arm: cdsm.Manipulator) -> Array:
    return np.clip(np.linspace(0.4, -0.3, arm.nv), arm.lower, arm.upper)


# --- robots with cables from anywhere to anywhere -------------------------------------------------

FILES = {str(path.relative_to(FOLDER)): path for path in sorted(FOLDER.rglob("*.urdf"))}
REFUSED = {
    "alex_psyonic_hands.urdf": "joint Left_index_q2: mimics 'index_q1', which is no joint that",
    "bluevolta.urdf": "has 0 joints that move",
    "falcon.urdf": "has 0 joints that move",
    "quadrotor_base.urdf": "has 0 joints that move",
    "iris.urdf": "joint iris__rotor_0_joint: lower of <limit>: .* a joint without ends is cont",
    "iris_simple.urdf": "joint iris__rotor_0_joint: lower of <limit>: .* a joint without ends is",
    "ur3.urdf": "robot> has no name",
}
DIFFERENCES = (
    *("baxter", "bravo7_gripper", "double_pendulum_continuous", "kinova", "panda", "pr2"),
    *("tiago_pro", "talos_left_arm", "talos_reduced", "icub_reduced"),
)
MUJOCO = ("ur5_robot", "finger_edu", "double_pendulum")
COUNT = 5


@cache
def anyhow(name: str) -> cdsm.Manipulator:
    """It, with five cables over three links each, chosen at random; the last link is the tip."""
    links = [each.get("name") for each in etree.parse(FILES[name]).iterfind("link")]
    rng = np.random.default_rng(len(name))
    ways = [rng.permutation(links)[:3].tolist() for _ in range(COUNT if links[1:] else 0)]
    cables = [tendon(f"c{i}", w, rng.uniform(-0.1, 0.1, (len(w), 3))) for i, w in enumerate(ways)]
    tip = [*links, "none"][max(0, len(links) - 1)]
    return cdsm.Manipulator.from_urdf(FILES[name], cables, tip=tip, check_inertia=False)


def test_public_robots_are_read_or_refused_by_name() -> None:
    coupled = []
    for name, path in FILES.items():
        if said := REFUSED.get(path.name):
            with pytest.raises(cdsm.CdsmError, match=said):
                anyhow(name)
            continue
        arm, text = anyhow(name), path.read_text()
        K = cdsm.stiffness(arm.at(inside(arm)), np.linspace(20.0, 60.0, COUNT))
        assert np.isfinite(K.joint).all(), name
        coupled.append("<mimic" in text or '"continuous"' in text)
    assert len(coupled) >= 40
    assert sum(coupled) >= 20


def posed(name: str) -> cdsm.Manipulator:
    files = {path.stem: each for each, path in FILES.items()}
    return BY_HAND[name]() if name in BY_HAND else anyhow(files[name])


@pytest.mark.parametrize("name", [*BY_HAND, *MUJOCO])
def test_mujoco_agrees(name: str) -> None:
    mujoco: Any = pytest.importorskip("mujoco")
    arm = posed(name)
    pose = arm.at(inside(arm))
    tension = np.linspace(20.0, 60.0, len(arm.cables))
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, tension))
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    mujoco.mj_forward(model, state)
    theirs = state.qfrc_bias - state.qfrc_passive - state.qfrc_actuator
    place = [model.joint(joint).dofadr[0] for joint in arm.body.all_joints]
    theirs, coupling = theirs[place], arm.body.coupling
    assert model.neq == len(place) - arm.nv
    if coupling:  # equations of MuJoCo hold the followers
        assert not state.efc_pos[: state.ne].any()
        theirs = theirs @ coupling.matrix
    np.testing.assert_allclose(theirs, cdsm.stiffness(pose, tension).residual, atol=1e-9)


@pytest.mark.parametrize("name", [*BY_HAND, *DIFFERENCES])
def test_stiffness_is_that_of_pinocchio_s_placements(name: str) -> None:
    """Fourth-order second differences of the potential, over placements of the whole model."""
    arm = posed(name)
    q, F = inside(arm), np.linspace(20.0, 60.0, len(arm.cables))
    K = cdsm.stiffness(arm.at(q), F)
    model = pin.buildModelFromXML(arm.urdf, mimic=True)  # its own reading of followers
    scratch, one = model.createData(), np.eye(arm.nv)
    joints = [model.joints[model.getJointId(name)] for name in arm.joint_names]

    def potential(q: Array) -> float:
        there = np.zeros(model.nq)
        for x, of in zip(q, joints, strict=True):
            there[of.idx_q :][: of.nq] = x if of.nq == 1 else (np.cos(x), np.sin(x))
        pin.framesForwardKinematics(model, scratch, there)
        bodies = zip(scratch.oMi, model.inertias, strict=True)
        energy = float(sum(9.81 * b.mass * at.act(b.lever)[2] for at, b in bodies))
        for cable, F_0, k, L_0 in zip(arm.cables, F, K.cable_stiffness, lengths, strict=True):
            frame = [scratch.oMf[model.getFrameId(s.link, pin.BODY)] for s in cable.sites]
            path = [x.act(np.array(s.position)) for x, s in zip(frame, cable.sites, strict=True)]
            more = cable.lead + np.linalg.norm(np.diff(path, axis=0), axis=1).sum() - L_0
            energy += float(F_0 * more + k * more**2 / 2.0)
        return energy

    def second(way: Array, h: float = 2.0**-11) -> float:
        e = [potential(q + n * h * way) for n in (-2, -1, 0, 1, 2)]
        return (-e[0] + 16.0 * e[1] - 30.0 * e[2] + 16.0 * e[3] - e[4]) / (12.0 * h * h)

    lengths, size = arm.at(q).cable_lengths, abs(K.joint).max()
    for i, j in combinations(range(arm.nv), 2):
        ours = [K.joint[i, i] + K.joint[j, j] + 2.0 * s * K.joint[i, j] for s in (1.0, -1.0)]
        theirs = [second(one[i] + s * one[j]) for s in (1.0, -1.0)]
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-6 * size)

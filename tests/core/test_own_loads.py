"""Loads that belong to an arm act in all it does, as the same loads given each time."""

import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.core.test_loads import ARMS, THREE, Q, some_loads, universal
from tests.support.arms import README_SIZES

GRIPPER = cdsm.Load("link3", (0.0, 0.0, -1.2), point=(0.02, 0.0, -0.01))
SWUNG = [
    cdsm.Load("link2", (0.0, 0.5, -1.0), (0.0, 0.0, 0.02)),
    cdsm.Load("tool0", (0.0, 0.0, -0.5)),
]
DOWN = [0.0, 0.0, -0.8]
F = np.linspace(60.0, 70.0, 12)


def _holding(pose: cdsm.Posture, W: Any) -> list[float]:
    held = cdsm.payload(pose, DOWN, 20.0, 300.0, W, deflection=1e-3, tension=2.0 * F, link="link4")
    assert held.following is not None
    assert held.locked is not None
    return [*held.limits.values(), held.following.force, held.locked.force]


def _pulled(pose: cdsm.Posture, W: Any) -> Any:
    sprung = pose.arm.with_springs(dict.fromkeys(pose.arm.joint_names, 4.0))
    return cdsm.forward_statics(sprung, tension=F / 2.0, wrench=W).pose.q


def _slides(pose: cdsm.Posture, W: Any) -> Any:
    rough = pose.arm.with_friction(0.1).at(Q)
    pull = cdsm.distribute_tension(rough, 20.0, wrench=W)
    return cdsm.load_cycle(rough, pull, [[*W, cdsm.Load("link4", (0.0, 0.0, -2.0))], W]).angles


def _sure(pose: cdsm.Posture, W: Any) -> float:
    tolerances = cdsm.Tolerances(joint_angle=0.01, hole_radius=1e-4)
    pull = cdsm.distribute_tension(pose, 20.0, wrench=W)
    return cdsm.uncertainty(
        pose, pull, tolerances, direction="z", redistribute=True
    ).standard_uncertainty


ASKED: dict[str, Callable[[cdsm.Posture, Any], Any]] = {
    "tension": lambda pose, W: cdsm.distribute_tension(pose, 20.0, wrench=W).values,
    "stiffness": lambda pose, W: cdsm.stiffness(pose, F, W).joint,
    "residual": lambda pose, W: cdsm.stiffness(pose, F, W).residual,
    "rest": lambda pose, W: cdsm.equilibrium(pose, F, W).pose.q,
    "pulled": _pulled,
    "payload": _holding,
    "polytope": lambda pose, W: cdsm.force_polytope(pose, 20.0, 300.0, W, link="link2").radius,
    "buckling": lambda pose, W: (
        cdsm.critical_load(pose, {"link2": THREE[0].wrench}, 20.0, 300.0, wrench=W).factor
    ),
    "tension that buckles": lambda pose, W: cdsm.critical_tension(pose, W).margins,
    "plan": lambda pose, W: cdsm.plan_stiffness(pose, "z", 4e3, 20.0, 600.0, W).tension.values,
    "path": lambda pose, W: (
        cdsm.plan_path(pose.arm, "z", 4e3, 20.0, 600.0, W, angles=[Q, Q / 2.0]).tensions
    ),
    "range": lambda pose, W: cdsm.stiffness_range(pose, "z", 20.0, 300.0, W, starts=2).ends,
    "saturation": lambda pose, W: cdsm.saturation(pose, "z", 10.0, 300.0, W).bound,
    "weights": lambda pose, W: cdsm.weight_test(pose, F, DOWN, wrench=W, link="link3").displacement,
    "friction": _slides,
    "stuck": lambda pose, W: cdsm.stuck_stiffness(pose.arm.with_friction(0.1).at(Q), F, W).joint,
    "batch": lambda pose, W: cdsm.evaluate(
        pose.arm, Q[None], None, W, ("tension", "joint"), minimum=20.0
    )["joint"],
    "sweep": lambda pose, W: cdsm.sweep(
        pose.arm,
        Q[None],
        minimum=20.0,
        maximum=300.0,
        wrench=W,
        outputs=("along", "payload"),
    )[["along", "payload"]].to_array(),
    "uncertainty": _sure,
    "estimate": lambda pose, W: (
        cdsm.estimate_load(pose, F, {"tool0": "force"}, tension_std=0.5, wrench=W).loads
    ),
}


@pytest.mark.parametrize("asked", ASKED)
def test_own_loads_act_as_given_ones(asked: str) -> None:
    arm = universal()
    own = ASKED[asked](arm.with_loads(GRIPPER).at(Q), SWUNG)
    given = ASKED[asked](arm.at(Q), [GRIPPER, *SWUNG])
    size = abs(np.asarray(given)).max()
    np.testing.assert_allclose(own, given, rtol=1e-9, atol=1e-9 * size)
    without = ASKED[asked](arm.at(Q), SWUNG)
    assert abs(np.asarray(without) - np.asarray(given)).max() > 1e-7 * size


def test_they_are_part_of_the_definition(tmp_path: Path) -> None:
    arm = universal()
    own = arm.with_loads(THREE)
    assert own != arm
    assert own.with_loads([]) == arm
    assert own.with_gravity("-y").definition.loads == tuple(THREE)
    assert pickle.loads(pickle.dumps(own)) == own
    text = own.write(tmp_path / "arm.toml").read_text()
    assert cdsm.Manipulator.read(tmp_path / "arm.toml") == own
    assert "moment = [0.0, 0.0, 0.05]" in text
    assert "moment = [0.0, 0.0, 0.0]" not in text
    changed = cdsm.Manipulator.read(
        tmp_path / "arm.toml", changes={"loads": {"1": {"force": [0.0, 0.0, -4.0]}}}
    )
    assert changed.definition.loads[0].force == (0.0, 0.0, -4.0)
    K = cdsm.stiffness(own.at(Q), F)
    assert "load of the arm on link2, (0, 0, -25) mm in its frame: (0, 0, -3) N" in str(K)
    described: Any = K.to_dict()["loads"]
    assert [load["link"] for load in described] == ["link2", "link3", "tool0"]
    assert all(load["of_the_arm"] for load in described)
    np.testing.assert_array_equal(K.wrench, np.zeros(6))
    assert all(check.verdict == "agrees" for check in K.report().comparisons)


def test_pictures_have_an_arrow_for_each_load() -> None:
    arm = universal().with_loads(GRIPPER)
    pose = arm.at(Q)
    K = cdsm.stiffness(pose, F, SWUNG)
    ax = cdsm.plots.plot_arm(pose, None, K, view=(0, -90))
    arrows = {patch.get_gid(): patch for patch in ax.patches if patch.get_gid()}
    assert {"force", "force:link2", "force:link3"} <= arrows.keys()
    place = pose.link_pose("link3") @ [*GRIPPER.point, 1.0]  # type: ignore[misc]
    start, end = arrows["force:link3"]._posA_posB
    np.testing.assert_allclose(start, 1e3 * place[[0, 2]])
    assert end[0] == pytest.approx(start[0])
    assert end[1] < start[1]  # down
    assert "1.2 N" in {text.get_text() for text in ax.texts}
    alone = cdsm.plots.plot_arm(pose)
    assert [p.get_gid() for p in alone.patches if str(p.get_gid()).startswith("force")] == [
        "force:link3"
    ]
    rest = cdsm.equilibrium(pose, F, SWUNG)
    told: Any = rest.to_dict()["loads"]
    assert [load["link"] for load in told] == ["link3", "link2"]


LOADS = 'loads = [{link = "link2", force = [0, 0, -1]}, {link = "%s", %s}]\n'


@pytest.mark.parametrize(
    ("link", "keys", "said"),
    [
        ("lnik3", "force = [0, 0, 1]", r"loads\.link: .*did you mean 'link3'"),
        ("base_link", "force = [0, 0, 1]", r"loads\.link: 'base_link' is the base"),
        ("link2", "moment = [0, 0, 1]", "loads: two loads act on link2 at one point; add them up"),
        ("link3", "force = [0, 1]", r"loads\[2\]\.force"),
        ("link3", "mass = 0.2", r"loads\[2\]\.mass: is not a key"),
        ("link3", "point = [0, 0, 0]", r"loads\[2\]: gives no force and no moment"),
        ("link3", "force = [0, 0, 1e12]", r"loads\[2\]\.force: .*1e\+12"),
    ],
)
def test_wrong_loads_of_a_file_are_named(tmp_path: Path, link: str, keys: str, said: str) -> None:
    path = universal().write(tmp_path / "arm.toml")
    text = path.read_text()
    path.write_text(text.replace("[geometry]", f"{LOADS % (link, keys)}\n[geometry]", 1))
    with pytest.raises(cdsm.CdsmError, match=said) as caught:
        cdsm.Manipulator.read(path)
    assert str(path) in str(caught.value)


def test_other_links_refuse_loads_that_hang_nowhere() -> None:
    own = universal().with_loads(cdsm.Load("link4", (0.0, 0.0, -1.0)))
    shorter = cdsm.Geometry.universal(joints=3, cables_per_joint=3, **README_SIZES)
    cables = cdsm.serpentine_cables(shorter, cdsm.presets.STRAND_1X19)
    with pytest.raises(cdsm.InvalidInput, match=r"loads\.link: .*'link4'"):
        own.with_geometry(shorter, cables)
    with pytest.raises(cdsm.InvalidInput, match=r"loads: .* list or tuple of Load"):
        own.with_loads([[0.0] * 6])  # type: ignore[list-item]


@pytest.mark.parametrize("make", ARMS)
def test_mujoco_holds_the_arm_where_it_rests(make: Callable[[], cdsm.Manipulator]) -> None:
    """Actuators of the model bring the loads: its net torque at three rests is zero."""
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(8)
    soft = make()
    law = cdsm.LinearElasticity(2e4)
    cables = [cdsm.Cable(cable.name, cable.sites, law) for cable in soft.cables]
    arm = soft.with_cables(cables)
    arm = arm.with_loads(some_loads(arm, np.repeat([0.2, 0.002], 3), rng))
    if make.__name__ == "coupled":  # equations of MuJoCo hold joints together, softly
        with pytest.raises(AssertionError):
            _net_torque(mujoco, arm, rng)
        return
    assert max(_net_torque(mujoco, arm, rng) for _ in range(3)) < 5e-12


def _net_torque(mujoco: Any, arm: cdsm.Manipulator, rng: np.random.Generator) -> float:
    """Largest torque [N m] that is out of balance in MuJoCo, at a rest of cdsm."""
    start = arm.at(rng.uniform(-0.1, 0.1, arm.nv), check_limits=False)
    tension = rng.uniform(5.0, 8.0, len(arm.cables))
    rest = cdsm.equilibrium(start, tension)
    assert not rest.at_limit
    text = cdsm.to_mjcf(arm, rest.pose, rest.tension)
    model = mujoco.MjModel.from_xml_string(text)
    assert re.search("load of the arm on .*: an actuator without ctrl", text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    net = data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator
    assert model.neq == 0
    return float(abs(net).max())

"""MuJoCo loads what is exported, computes the same, and holds a stable arm where it is."""

import math
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree
from scipy.linalg import eigh

import cdsm
from cdsm.interchange.mjcf_bodies import add_bodies
from cdsm.interchange.mjcf_motion import mass_matrix
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_arm, random_posture, random_wrench, readme_geometry
from tests.support.foreign import POSTURE, TENSION, crab

mujoco: Any = pytest.importorskip("mujoco")

NOTHING = np.zeros(6)


def loaded(arm: cdsm.Manipulator, *args: Any, **options: Any) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, *args, **options))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def order(model: Any, arm: cdsm.Manipulator) -> Array:
    """Where MuJoCo has each of our joints."""
    return np.array([model.joint(name).qposadr[0] for name in arm.joint_names])


def net_torque(model: Any, data: Any, q: Array, wrench: Array = NOTHING) -> Array:
    """What is out of balance at q, in MuJoCo's order: bias less springs, actuators and wrench."""
    data.qpos[:] = q
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    tip = data.body("tool0") if "tool0" in names(model) else data.body("tip")
    pulled = np.zeros(model.nv)
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], tip.xpos, tip.id, pulled)
    return np.asarray(data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator - pulled)


def names(model: Any) -> list[str]:
    return [model.body(i).name for i in range(model.nbody)]


def serpentine(kind: str) -> tuple[cdsm.Manipulator, cdsm.Posture, cdsm.Tension]:
    arm = mixed_arm() if kind == "mixed" else random_arm(3, 4, kind)
    pose = random_posture(arm, 5)
    return arm, pose, cdsm.distribute_tension(pose, 30.0)


@pytest.mark.parametrize("actuators", ["length", "none"])
@pytest.mark.parametrize("kind", ["universal", "hinged", "mixed"])
def test_cables_are_in_balance_and_as_stiff(kind: str, actuators: str) -> None:
    arm, pose, pull = serpentine(kind)
    model, data = loaded(arm, pose, pull, actuators=actuators)
    place = order(model, arm)
    q = np.empty(arm.nv)
    q[place] = pose.q
    np.testing.assert_array_equal(data.qpos, q)
    for c, cable in enumerate(arm.cables):
        length = float(data.tendon(cable.name).length[0]) + cable.lead
        assert length == pytest.approx(pose.cable_lengths[c], abs=1e-14)
    np.testing.assert_allclose(moment_arms(model, data)[:, place], pose.length_jacobian, atol=1e-14)
    scale = float(abs(pull.values @ abs(pose.length_jacobian)).max())
    assert abs(net_torque(model, data, q)).max() < 1e-9 * max(1.0, scale)
    check_stiffness(model, data, q, place, cdsm.stiffness(pose, pull).joint, NOTHING)


def moment_arms(model: Any, data: Any) -> Array:
    """J_L (C, nv) of MuJoCo, which stores it sparse."""
    J = np.zeros((model.ntendon, model.nv))
    for c, (start, count) in enumerate(zip(model.ten_J_rowadr, model.ten_J_rownnz, strict=True)):
        J[c, model.ten_J_colind[start : start + count]] = data.ten_J[start : start + count]
    return J


def check_stiffness(model: Any, data: Any, q: Array, place: Array, K: Array, wrench: Array) -> None:
    def slope(h: float) -> Array:
        columns = [
            net_torque(model, data, q + e, wrench) - net_torque(model, data, q - e, wrench)
            for e in h * np.eye(q.size)
        ]
        return np.stack(columns, axis=1) / (2.0 * h)

    h = 2.0**-12
    extrapolated = (4.0 * slope(h / 2.0) - slope(h)) / 3.0
    np.testing.assert_allclose(extrapolated[np.ix_(place, place)], K, atol=1e-6 * abs(K).max())


def test_robot_of_somebody_elses_agrees_too() -> None:
    arm = crab(gravity=(1.0, -2.0, -9.0))
    pose = arm.at(POSTURE)
    wrench = random_wrench(2, moment=False)
    model, data = loaded(arm, pose, TENSION)
    place = order(model, arm)
    q = np.empty(arm.nv)
    q[place] = POSTURE
    K = cdsm.stiffness(pose, TENSION, wrench=wrench)
    np.testing.assert_allclose(net_torque(model, data, q, wrench)[place], K.residual, atol=1e-10)
    check_stiffness(model, data, q, place, K.joint, wrench)


@pytest.mark.filterwarnings("ignore:UNSTABLE")
@pytest.mark.parametrize("actuators", ["length", "none"])
def test_soft_springs_and_held_forces_are_actuators(actuators: str) -> None:
    arm, pose, pull = serpentine("universal")
    cables = [
        replace(cable, control="force")
        if c % 3 == 0
        else replace(cable, series_stiffness=200.0 if c % 3 == 1 else np.inf)
        for c, cable in enumerate(arm.cables)
    ]
    soft = arm.with_cables(cables)
    pose = soft.at(pose.q)
    K = cdsm.stiffness(pose, pull.values)
    model, data = loaded(soft, pose, pull.values, actuators=actuators)
    held = sum(cable.control == "force" for cable in cables)
    assert model.nu > held  # and springs whose rest length would be negative
    place = order(model, soft)
    q = np.empty(soft.nv)
    q[place] = pose.q
    scale = float(abs(pull.values @ abs(pose.length_jacobian)).max())
    assert abs(net_torque(model, data, q)[place] - K.residual).max() < 1e-9 * max(1.0, scale)
    check_stiffness(model, data, q, place, K.joint, NOTHING)


def test_simulation_under_a_weight_settles_where_the_weight_test_says() -> None:
    """Stiff linear cables that stay taut: MuJoCo's springs and ours are the same far away, too."""
    arm = cdsm.Manipulator(
        cdsm.Geometry.hinged(
            joints=3,
            twist=0.5,
            link_length=0.05,
            base_length=0.02,
            disk_offset=0.01,
            hole_radius=0.02,
            link_mass=0.3,
        ),
        cdsm.LinearElasticity(2e3),
    )
    pose = arm.at([0.1, -0.1, 0.2])
    pull = cdsm.distribute_tension(pose, 20.0)
    force = np.array([0.0, 1.0, -2.0])
    test = cdsm.weight_test(pose, pull, force)
    model, data = loaded(arm, pose, pull, damping=0.05)
    data.xfrc_applied[model.body("tool0").id, :3] = force
    mujoco.mj_step(model, data, round(8.0 / model.opt.timestep))
    assert abs(data.qvel).max() < 1e-9
    np.testing.assert_allclose(data.body("tool0").xpos, test.states[-1].pose.tip[:3, 3], atol=1e-8)


# --- time step ------------------------------------------------------------------------------


def hinged(joints: int, **changes: Any) -> cdsm.Manipulator:
    sizes: dict[str, Any] = {
        "joints": joints,
        "twist": 0.0,
        "link_length": 0.03,
        "base_length": 0.02,
        "disk_offset": 0.005,
        "hole_radius": 0.008,
        "link_mass": 0.02,
    }
    return cdsm.Manipulator(cdsm.Geometry.hinged(**(sizes | changes)), cdsm.LinearElasticity(2e3))


def universal(joints: int, link_mass: float) -> cdsm.Manipulator:
    geometry = readme_geometry(joints=joints, link_mass=link_mass)
    return cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19)


BODIES = {
    "none": "",
    "of a rod": '<inertia ixx="0" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
    "of a plate": '<inertia ixx="3e-4" iyy="1e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
    "of a needle": '<inertia ixx="1e-15" iyy="7e-2" izz="7.00001e-2" ixy="0" ixz="0" iyz="0"/>',
    "of a long needle": '<inertia ixx="1e-9" iyy="7" izz="7" ixy="0" ixz="0" iyz="0"/>',
    "of nothing real": '<inertia ixx="1e-4" iyy="1e-4" izz="9e-4" ixy="0" ixz="0" iyz="2e-5"/>',
    "negative": '<inertia ixx="-1e-4" iyy="1e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
}


def two_links(
    body: str, mass: float = 0.3, far: float = 0.2, center: float = 0.05
) -> cdsm.Manipulator:
    inertial = (
        f'<inertial><origin xyz="{center} 0 0.01" rpy="0.3 0.2 0.1"/><mass value="{mass}"/>{body}'
        "</inertial>"
    )

    def joint(name: str, parent: str, child: str, x: float, axis: str) -> str:
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{x} 0 0"/><axis xyz="{axis}"/>'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )

    urdf = (
        '<robot name="two"><link name="floor"/><link name="middle"/>'
        f'<link name="hand">{inertial if body else ""}</link>'
        f"{joint('a', 'floor', 'middle', 0.1, '0 1 0')}"
        f"{joint('b', 'middle', 'hand', far, '0 0 1' if far else '0 1 0')}</robot>"
    )
    ways = [(0.02, 0.02), (-0.02, 0.02), (0.02, -0.02)]
    cables = [
        cdsm.Cable(
            f"{to}{i}",
            (cdsm.Site("floor", (0.05, y, z)), cdsm.Site(to, (0.03, 1.5 * y, 1.2 * z))),
            cdsm.LinearElasticity(2e4),
        )
        for to in ("middle", "hand")
        for i, (y, z) in enumerate(ways)
    ]
    return cdsm.Manipulator.from_urdf(urdf, cables, tip="hand", check_inertia=False)


HELD: dict[str, tuple[cdsm.Manipulator, Array, float]] = {
    "README's arm": (universal(4, 0.12), np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]), 50.0),
    "virtual prototype": (cdsm.presets.virtual_prototype(), np.deg2rad(np.full(10, 10.0)), 50.0),
    "finger": (hinged(3), np.deg2rad([20.0, 30.0, 20.0]), 5.0),
    "1 joint": (hinged(1), np.deg2rad([20.0]), 5.0),
    "8 joints": (universal(8, 0.05), np.deg2rad(np.tile([5.0, -3.0], 8)), 20.0),
    "twisted hinges": (hinged(4, twist=np.deg2rad(30.0)), np.deg2rad([10.0, -5, 8, 12]), 8.0),
    "heavy and soft": (
        hinged(2, link_mass=20.0, link_length=0.4, hole_radius=0.1, disk_offset=0.05),
        np.deg2rad([5.0, 5.0]),
        10.0,
    ),
    "robot from a URDF": (two_links(BODIES["of a plate"]), np.array([0.1, -0.2]), 10.0),
    "massless links": (universal(2, 0.0), np.deg2rad([5.0, -3, 5, -3]), 20.0),
}
SECONDS = 2.0


def mass(model: Any, data: Any) -> Array:
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M


@pytest.fixture(params=HELD)
def held(request: pytest.FixtureRequest) -> tuple[cdsm.Stiffness, Any, Any, Array, Array]:
    """A stable arm in balance; in MuJoCo, in its order: its modes ω² (nv,) and φ (nv, nv)."""
    arm, q, least = HELD[request.param]
    pose = arm.at(q)
    pull = cdsm.distribute_tension(pose, least)
    K = cdsm.stiffness(pose, pull)
    assert K.is_stable
    model, data = loaded(arm, pose, pull, damping=0.0)
    theirs = np.argsort(order(model, arm))
    squares, shapes = eigh(K.joint[np.ix_(theirs, theirs)], mass(model, data))
    return K, model, data, squares, shapes


def test_time_step_is_a_tenth_of_what_the_fastest_motion_bears(held: Any) -> None:
    """MuJoCo's own mass matrix; semi-implicit Euler diverges from ω·dt = 2 on."""
    _, model, _, squares, _ = held
    step, phase = model.opt.timestep, math.sqrt(squares[-1]) * model.opt.timestep
    assert step <= 2e-3
    assert phase <= 0.2 * (1.0 + 1e-9)
    assert phase > 0.2 / 2.5 or step == 2e-3  # of 1, 2, 5, 10, … the next is too long
    assert f"{step:e}"[0] in "125"
    assert float(f"{step:.0e}") == step


def test_stable_arm_stays_where_it_is(held: Any) -> None:
    """A second or two are hundreds of periods: what diverges has grown from rounding by then.

    What holds moves by rounding alone; 1e-3 rad is less than any joint of a real arm shows.
    """
    _, model, data, _, _ = held
    steps = min(round(SECONDS / model.opt.timestep), 40_000)
    mujoco.mj_step(model, data, steps)
    assert data.time == pytest.approx(steps * model.opt.timestep)  # it never began again
    assert abs(data.qpos - model.key_qpos[0]).max() < 1e-9 < 1e-3
    assert abs(data.qvel).max() < 1e-6


def test_energy_of_a_vibration_does_not_grow(held: Any) -> None:
    """Knocked so that every mode swings by 0.1 mrad, without damping.

    Semi-implicit Euler keeps p²/2 + ω²q²/2 − ω²·dt·p·q/2, so the energy of a mode, which is that of
    the knock first, stays below it by 1/(1 − ω·dt/2); that of all modes too.
    """
    K, model, data, squares, shapes = held
    amplitudes = 1e-4 / abs(shapes).max(axis=0)
    data.qvel[:] = shapes @ (amplitudes * np.sqrt(squares))
    start, M = data.qpos.copy(), mass(model, data)
    stiff = np.linalg.inv(shapes).T @ np.diag(squares) @ np.linalg.inv(shapes)

    def energy() -> float:
        away = data.qpos - start
        return float(data.qvel @ M @ data.qvel + away @ stiff @ away) / 2.0

    knock = energy()
    steps = min(round(SECONDS / model.opt.timestep), 40_000)
    most = 0.0
    for _ in range(steps // 37):
        mujoco.mj_step(model, data, 37)
        most = max(most, energy())
    bound = knock / (1.0 - math.sqrt(squares[-1]) * model.opt.timestep / 2.0)
    assert 0.5 * knock < most < 1.02 * bound  # 2 % for what is not linear
    assert K.is_stable


def test_longer_steps_do_not_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound is one that matters: at MuJoCo's own 2 ms the virtual prototype falls apart."""
    monkeypatch.chdir(tmp_path)  # where MuJoCo leaves a log of it
    arm, q, least = HELD["virtual prototype"]
    pose = arm.at(q)
    model, data = loaded(arm, pose, cdsm.distribute_tension(pose, least), damping=0.0)
    model.opt.timestep = 2e-3
    mujoco.mj_step(model, data, 300)
    assert data.time < 250 * 2e-3  # MuJoCo gave up, and began again at the posture


def test_a_wrench_is_part_of_what_is_stable() -> None:
    """K_θ has the load of the Tension: pressed along its axis the finger buckles, hung it holds."""
    arm = hinged(3, link_mass=0.001)
    pose = arm.at(np.zeros(3))
    for force, stable in ((200.0, True), (-200.0, False)):
        pull = cdsm.distribute_tension(pose, 1.0, wrench=(force, 0, 0, 0, 0, 0))
        assert cdsm.stiffness(pose, pull).is_stable is stable
        with nullcontext() if stable else pytest.warns(UserWarning, match="UNSTABLE"):
            assert ("UNSTABLE" not in cdsm.to_mjcf(arm, pose, pull)) is stable


def test_unstable_arm_is_named_on_top_and_leaves() -> None:
    arm = hinged(3)
    arm = arm.with_cables([replace(cable, control="force") for cable in arm.cables])
    pose = arm.at(np.deg2rad([20.0, 30.0, 20.0]))
    pull = cdsm.distribute_tension(pose, 5.0)
    K = cdsm.stiffness(pose, pull)
    assert not K.is_stable
    with pytest.warns(UserWarning, match="UNSTABLE: the arm buckles"):
        text = cdsm.to_mjcf(arm, pose, pull, damping=0.0)
    assert f"eigenvalue of K_θ is {K.margin:.4g} N m/rad" in text
    assert text.index("UNSTABLE") < text.index("<option")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    rate = cdsm.modes(pose, K).growth_rates[0]
    assert rate * model.opt.timestep <= 0.2
    shape = cdsm.modes(pose, K).growth_shapes[:, 0]
    data.qpos[:] = pose.q + 1e-6 * shape / abs(shape).max()
    mujoco.mj_step(model, data, round(math.log(1e3) / rate / model.opt.timestep))
    # from rest it is cosh(rate·t), half of 1e3; the step makes it a few per cent slower
    assert abs(data.qpos - pose.q).max() == pytest.approx(5e-4, rel=0.1)
    stable = hinged(3).at(pose.q)
    assert "UNSTABLE" not in cdsm.to_mjcf(stable.arm, stable, cdsm.distribute_tension(stable, 5.0))


@pytest.mark.parametrize("body", [*BODIES, "crab", "mixed", "massless"])
def test_mass_matrix_is_that_of_mujoco(body: str) -> None:
    """Whatever the inertia of the URDF: MuJoCo simulates what the time step was computed with."""
    others = {"crab": crab(), "mixed": mixed_arm(), "massless": universal(2, 0.0)}
    arm = others.get(body) or two_links(BODIES[body])
    pose = arm.at(0.9 * arm.upper * np.random.default_rng(7).uniform(-1.0, 1.0, arm.nv))
    model, data = loaded(arm, pose, np.full(len(arm.cables), 20.0))
    masses = add_bodies(etree.Element("mujoco"), arm, {})
    place = order(model, arm)
    theirs = mass(model, data)[np.ix_(place, place)]
    units = np.sqrt(np.outer(theirs.diagonal(), theirs.diagonal()))
    np.testing.assert_allclose(mass_matrix(pose, masses) / units, theirs / units, atol=1e-12)


@pytest.mark.parametrize("body", ["of a rod", "of a plate", "of a needle", "of a long needle"])
def test_real_bodies_keep_their_moments_of_inertia(body: str) -> None:
    """MuJoCo wants no moment above the sum of the others, which rounding leaves of thin bodies."""
    arm = two_links(BODIES[body])
    inertia = etree.fromstring(arm.urdf).find(".//inertia")
    wanted = sorted(float(inertia.get(key)) for key in ("ixx", "iyy", "izz"))
    found = sorted(loaded(arm)[0].body("hand").inertia)
    np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-5 * wanted[-1])


def test_motion_without_any_mass_is_named() -> None:
    """Two hinges on one axis: only the stand-in of the link between turns against the heavy one."""
    arm = two_links(BODIES["of a plate"], mass=1e6, far=0.0, center=5.0)
    with pytest.raises(cdsm.SingularMass, match="no link of any mass"):
        cdsm.to_mjcf(arm, arm.at([0.0, 0.0]), np.full(6, 20.0))


def test_without_a_posture_the_tendons_only_lie_there() -> None:
    arm = cdsm.presets.virtual_prototype()
    model, data = loaded(arm)
    assert model.nkey == 0
    assert not model.tendon_stiffness.any()
    assert model.ntendon == 15
    assert model.opt.timestep == 2e-3
    lengths = arm.at(np.zeros(10)).cable_lengths
    np.testing.assert_allclose(data.ten_length, lengths, atol=1e-15)
    assert model.site("tool0").id >= 0


def test_file_is_the_text(tmp_path: Path) -> None:
    arm, pose, pull = serpentine("hinged")
    path = cdsm.write_mjcf(arm, tmp_path / "arm.xml", pose, pull)
    assert path.read_text(encoding="utf-8") == cdsm.to_mjcf(arm, pose, pull)
    mujoco.MjModel.from_xml_path(str(path))


def test_bad_input_is_named() -> None:
    arm, pose, pull = serpentine("hinged")
    with pytest.raises(cdsm.InvalidInput, match="pose and tension, or neither"):
        cdsm.to_mjcf(arm, pose)
    with pytest.raises(cdsm.InvalidInput, match="another arm"):
        cdsm.to_mjcf(mixed_arm(), pose, pull)
    with pytest.raises(cdsm.InvalidInput, match="damping"):
        cdsm.to_mjcf(arm, damping=-1.0)


def test_names_are_those_of_the_text_whatever_its_declaration_says() -> None:
    """A declaration speaks of bytes on a disk; the text has been decoded already."""
    urdf = (
        '<?xml version="1.0" encoding="ISO-8859-1"?><robot name="r"><link name="ä"/>'
        '<link name="ö"/><joint name="j" type="revolute"><parent link="ä"/><child link="ö"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    sites = cdsm.Site("ä", (0.0, 0.0, 0.1)), cdsm.Site("ö", (0.1, 0.0, 0.1))
    rope = cdsm.Cable("c", sites, cdsm.LinearElasticity(1e4))
    model, _ = loaded(cdsm.Manipulator.from_urdf(urdf, [rope], tip="ö"))
    assert {"ä", "ö"} <= set(names(model))

"""Loads on any links: torque, stiffness, balance and readings where they hang."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import cdsm
from cdsm.applied import as_loads, between, combined, without_cables
from cdsm.loads import loads_of
from cdsm.support.values import Array
from cdsm.terms import ConstantPull, Stretch
from tests.support.arms import README_SIZES

Q = np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0.0])
THREE = [
    cdsm.Load("link2", force=(0.0, 0.0, -3.0), point=(0.0, 0.0, -0.025)),
    cdsm.Load("link3", force=(0.0, 2.0, 0.0), moment=(0.0, 0.0, 0.05)),
    cdsm.Load("tool0", force=(1.0, 0.0, -2.0), moment=(0.0, 0.02, 0.0)),
]


def universal() -> cdsm.Manipulator:
    geometry = cdsm.Geometry.universal(joints=4, cables_per_joint=3, **README_SIZES)
    return cdsm.Manipulator(geometry, elasticity=cdsm.presets.STRAND_1X19)


def hinged() -> cdsm.Manipulator:
    geometry = cdsm.Geometry.hinged(joints=4, twist=1.5707963, **README_SIZES)
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))


def coupled() -> cdsm.Manipulator:
    geometry = cdsm.Geometry.universal(
        joints=4, cables_per_joint=3, coupled=True, joint_stiffness=0.8, **README_SIZES
    )
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))


def backbone() -> cdsm.Manipulator:
    section = {
        "length": 0.27,
        "disks": 10,
        "hole_radius": 0.008,
        "hole_angles": [0.0, 2.1, 4.2],
        "lead": 0.05,
    }
    geometry = cdsm.Geometry.backbone(
        sections=[section],
        outer_diameter=1e-3,
        youngs_modulus=81e9,
        mass_per_length=0.002 / 0.027,
        joint_limit=1.2,
    )
    cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(1e5), control="force")
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, 0.0, -9.81))


def branching() -> cdsm.Manipulator:
    """A palm with a finger of two joints, which ends in the tip, and a finger of one."""
    inertia = "".join(f' {key}="{float(key[1] == key[2]):g}e-4"' for key in KEYS)
    links = "".join(
        f'<link name="{name}"><inertial><mass value="0.05"/><inertia{inertia}/></inertial></link>'
        for name in ("palm", "link1", "link2", "link3", "link4")
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="{before}"/><child link="{after}"/>'
        f'<origin xyz="{place}"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for name, before, after, place, axis in (
            ("wrist", "palm", "link1", "0.02 0 0", "0 0 1"),
            ("left1", "link1", "link2", "0.05 0.02 0", "0 1 0"),
            ("left2", "link2", "link3", "0.04 0 0", "0 1 0"),
            ("right1", "link1", "link4", "0.05 -0.02 0", "0 1 0.2"),
        )
    )
    ways = {
        "wrist": ("palm", "link1"),
        "left1": ("palm", "link1", "link2"),
        "left2": ("palm", "link1", "link2", "link3"),
        "right1": ("palm", "link1", "link4"),
    }
    cables = []
    for name, way in ways.items():
        for side in (1, -1):
            turn = (0.0, 0.012, 0.0) if name == "wrist" else (0.0, 0.002, 0.012)
            sites = [cdsm.Site(link, (0.012, side * turn[1], side * turn[2])) for link in way]
            cables.append(
                cdsm.Cable(f"{name}{side:+d}", tuple(sites), cdsm.LinearElasticity(2e4), lead=0.1)
            )
    robot = f'<robot name="hand">{links}{joints}</robot>'
    return cdsm.Manipulator.from_urdf(robot, cables, tip="link3")


KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
ARMS = [universal, hinged, coupled, backbone, branching]


def some_loads(arm: cdsm.Manipulator, scale: Array, rng: np.random.Generator) -> list[cdsm.Load]:
    """Loads at points off the axis of three links."""
    names = [name for name in arm.body.link_names if name.startswith(("link", "disk"))]
    links = names[len(names) // 3], names[2 * len(names) // 3], names[-1]
    wrenches = rng.normal(size=(3, 6)) * scale
    points = rng.normal(size=(3, 3)) * 0.01
    return [
        cdsm.Load(link, tuple(W[:3]), tuple(W[3:]), tuple(p))
        for link, W, p in zip(links, wrenches, points, strict=True)
    ]


def slope(function: Callable[[Array], Array], q: Array, step: float) -> Array:
    rows = [
        (function(q + step * e) - function(q - step * e)) / (2.0 * step) for e in np.eye(q.size)
    ]
    return np.array(rows).T


@pytest.mark.parametrize("make", ARMS)
@pytest.mark.parametrize("moments", [0.0, 0.3])
def test_stiffness_is_the_derivative_of_the_torque(
    make: Callable[[], cdsm.Manipulator], moments: float
) -> None:
    arm = make()
    rng = np.random.default_rng(1)
    q = rng.uniform(-0.2, 0.2, arm.nv)
    loads = as_loads(loads_of(arm, some_loads(arm, np.repeat([5.0, moments], 3), rng)))

    def torque(q: Array) -> Array:
        return loads.torque(arm.at(q, check_limits=False))

    K = loads.stiffness(arm.at(q, check_limits=False))
    off = [abs(slope(torque, q, h) - K).max() / abs(K).max() for h in (1e-2, 5e-3, 2.5e-3)]
    assert off[-1] < 2e-5
    assert np.log2(off[0] / off[1]) == pytest.approx(2.0, abs=0.02)
    assert np.log2(off[1] / off[2]) == pytest.approx(2.0, abs=0.02)
    if moments == 0.0:
        pose = arm.at(q, check_limits=False)
        potential = loads.measured_from(pose)
        fall = slope(lambda q: np.array([potential.energy(arm.at(q, check_limits=False))]), q, 1e-6)
        np.testing.assert_allclose(fall[0], loads.torque(pose), atol=2e-9)


@pytest.mark.parametrize("make", ARMS)
def test_a_load_at_the_tip_is_the_wrench_bit_by_bit(make: Callable[[], cdsm.Manipulator]) -> None:
    arm = make()
    rng = np.random.default_rng(2)
    pose = arm.at(rng.uniform(-0.1, 0.1, arm.nv), check_limits=False)
    W = rng.normal(size=6)
    F = rng.uniform(1.0, 20.0, len(arm.cables)) + 30.0
    today = cdsm.stiffness(pose, F, W)
    for given in ({arm.tip_link: W}, [cdsm.Load(arm.tip_link, tuple(W[:3]), tuple(W[3:]))]):
        K = cdsm.stiffness(pose, F, given)
        np.testing.assert_array_equal(K.wrench, W)
        np.testing.assert_array_equal(K.joint, today.joint)
        np.testing.assert_array_equal(K.residual, today.residual)
    assert K.along("z", link=arm.tip_link) == today.along("z")
    tip = as_loads(W)
    spot = loads_of(arm, cdsm.Load(arm.tip_link, tuple(W[:3]), tuple(W[3:]), (1e-300, 0, 0)))
    np.testing.assert_allclose(as_loads(spot).torque(pose), tip.torque(pose), atol=1e-14)
    np.testing.assert_allclose(as_loads(spot).stiffness(pose), tip.stiffness(pose), atol=1e-14)


@pytest.mark.parametrize("none", [{}, [], ()])
def test_no_loads_are_an_empty_dict_or_list(none: Any) -> None:
    """Wherever loads are taken beside other things; where one is needed, both are refused."""
    arm = universal()
    pose = arm.at(Q)
    F = cdsm.distribute_tension(pose, 10.0)
    np.testing.assert_array_equal(cdsm.distribute_tension(pose, 10.0, wrench=none).values, F.values)
    K = cdsm.stiffness(pose, F)
    np.testing.assert_array_equal(cdsm.stiffness(pose, F.values, wrench=none).joint, K.joint)
    assert cdsm.payload(pose, "-z", 10.0, 400.0, none).force > 0.0
    rows = cdsm.distribute_tensions(arm, Q[None], 10.0, wrench=none)
    np.testing.assert_allclose(rows.values[0], F.values, atol=1e-9)
    assert cdsm.evaluate(arm, Q[None], F.values, none).status[0] == cdsm.Status.OK
    found = cdsm.sweep(arm, Q[None], minimum=10.0, wrench=none)
    assert found.along.values.shape == cdsm.sweep(arm, Q[None], minimum=10.0).along.values.shape
    for refused in (
        lambda: cdsm.load_cycle(pose, F, none),
        lambda: cdsm.critical_load(pose, none),
    ):
        with pytest.raises(cdsm.InvalidInput):
            refused()
    with pytest.raises(cdsm.InvalidInput, match=r"shape \(0,\)"):
        cdsm.distribute_tension(pose, 10.0, wrench=np.zeros(0))


def test_tensions_and_stiffness_of_an_arm_with_loads_on_its_links() -> None:
    pose = universal().at(Q)
    hung = [
        cdsm.Load("link2", force=(0.0, 0.0, -9.81), point=(0.0, 0.0, 0.0)),
        cdsm.Load("link4", force=(0.0, 0.0, -4.9), point=(0.0, 0.0, 0.0)),
    ]
    alone = cdsm.distribute_tension(pose, 50.0)
    tension = cdsm.distribute_tension(pose, 50.0, wrench=hung)
    assert abs(tension.residual).max() < 1e-12
    assert alone.values.max() == pytest.approx(95.6, abs=0.05)
    assert tension.values.max() == pytest.approx(112.5, abs=0.05)
    K = cdsm.stiffness(pose, tension)
    assert abs(K.residual).max() < 1e-12
    assert "load on link2" in str(K)
    assert [load["link"] for load in K.to_dict()["loads"]] == ["link2", "link4"]
    assert K.report().passed
    soft = [K.along("z", link=link) for link in ("link2", "link3", "tool0")]
    np.testing.assert_allclose(soft, [17.39e3, 8.87e3, 3.41e3], rtol=2e-3)
    assert soft[2] == K.along("z")
    C = K.compliance_between("tool0", "link2")
    np.testing.assert_allclose(C, K.compliance_between("link2", "tool0").T, atol=1e-15)
    with pytest.raises(cdsm.InvalidInput, match="loads act on link2, link4"):
        _ = K.wrench


@pytest.mark.parametrize("make", ARMS)
def test_the_order_of_loads_changes_nothing(make: Callable[[], cdsm.Manipulator]) -> None:
    arm = make()
    rng = np.random.default_rng(4)
    pose = arm.at(rng.uniform(-0.2, 0.2, arm.nv), check_limits=False)
    loads = some_loads(arm, np.repeat([5.0, 0.3], 3), rng)
    there, back = (as_loads(loads_of(arm, order)) for order in (loads, loads[::-1]))
    for name in ("torque", "torque_size", "stiffness"):
        ordered = getattr(there, name)(pose)
        off = abs(getattr(back, name)(pose) - ordered).max()
        assert off <= 1e-14 * abs(ordered).max()
        alone = sum(getattr(as_loads(loads_of(arm, load)), name)(pose) for load in loads)
        np.testing.assert_allclose(ordered, alone, atol=1e-13 * abs(ordered).max())


@pytest.mark.parametrize("make", ARMS)
def test_three_loads_in_the_hessian_of_the_potential(make: Callable[[], cdsm.Manipulator]) -> None:
    """K_θ under forces on three links is the Hessian of the total potential."""
    arm = make()
    rng = np.random.default_rng(6)
    q = rng.uniform(-0.15, 0.15, arm.nv)
    pose = arm.at(q, check_limits=False)
    F = rng.uniform(60.0, 90.0, len(arm.cables))  # where the law of the strand is smooth
    K = cdsm.stiffness(pose, F, some_loads(arm, np.repeat([5.0, 0.0], 3), rng))
    rows = [check for check in K.report().comparisons if check.name in ("joint", "load", "batch")]
    assert len(rows) == 3
    assert all(check.verdict == "agrees" for check in rows), rows
    u = rng.normal(size=arm.nv) / np.sqrt(arm.nv)
    stretch = Stretch(F, K.cable_stiffness, K.free_lengths, pose.cable_lengths)
    terms = ConstantPull(F), stretch, *without_cables(pose, K.applied, pose)

    def potential(x: float) -> float:
        at = arm.at(q + x * u, check_limits=False)
        return sum(term.energy(at) for term in terms)

    def curvature(h: float) -> float:
        return (potential(h) - 2.0 * potential(0.0) + potential(-h)) / h**2

    exact = float(u @ K.joint @ u)
    off = [abs(curvature(h) - exact) / exact for h in (0.008, 0.004)]
    assert off[1] < 1e-3
    assert np.log2(off[0] / off[1]) == pytest.approx(2.0, abs=0.1)


def test_a_rest_under_loads_is_where_more_load_moves_it_by_the_compliance() -> None:
    pose = universal().at(Q)
    F = cdsm.distribute_tension(pose, minimum=50.0).values
    rest = cdsm.equilibrium(pose, F, THREE)
    assert abs(rest.residual).max() < 1e-10
    W = np.zeros(6)
    W[2] = 1.0
    off = []
    for h in (0.2, 0.1):
        more = [combined(rest.applied, loads_of(pose.arm, {"link2": s * h * W})) for s in (1, -1)]
        q = [cdsm.equilibrium(pose, F, load).pose.q for load in more]
        moved = (q[0] - q[1]) / (2.0 * h)
        J = rest.stiffness.jacobian_at("link2", None)
        expected = rest.stiffness.joint_compliance() @ J.T @ W
        off.append(abs(moved - expected).max() / abs(expected).max())
    assert off[1] < 2e-6
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.3)
    half = between(np.zeros(6), rest.applied, 0.5)
    np.testing.assert_allclose(
        as_loads(half).torque(pose), as_loads(rest.applied).torque(pose) / 2.0, atol=1e-15
    )


def _add_mass(root: ElementTree.Element, link: str, x: float) -> None:
    extra = ElementTree.SubElement(root, "link", name=f"weight_{link}")
    inertial = ElementTree.SubElement(extra, "inertial")
    ElementTree.SubElement(inertial, "mass", value="0.004")
    inertia = dict.fromkeys(("ixx", "iyy", "izz"), "1e-9") | dict.fromkeys(
        ("ixy", "ixz", "iyz"), "0"
    )
    ElementTree.SubElement(inertial, "inertia", inertia)
    joint = ElementTree.SubElement(root, "joint", name=f"hung_{link}", type="fixed")
    ElementTree.SubElement(joint, "origin", xyz=f"{x!r} 0 0", rpy="0 0 0")
    ElementTree.SubElement(joint, "parent", link=link)
    ElementTree.SubElement(joint, "child", link=f"weight_{link}")


def test_torques_are_those_of_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    stiff = universal()
    cables = [
        cdsm.Cable(cable.name, cable.sites, cdsm.LinearElasticity(2e4), lead=0.0)
        for cable in stiff.cables
    ]
    arm = stiff.with_cables(cables)
    pose = arm.at(Q)
    F = cdsm.distribute_tension(pose, minimum=50.0).values
    loads = as_loads(loads_of(arm, THREE))
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, F, actuators="none"))
    data = mujoco.MjData(model)
    joint = mujoco.mjtObj.mjOBJ_JOINT
    order = [mujoco.mj_name2id(model, joint, name) for name in arm.joint_names]
    place = model.jnt_qposadr[order]

    def applied(pose: cdsm.Posture) -> Array:
        data.qpos[place] = pose.q
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        torque = np.zeros(model.nv)
        tip = pose.tip[:3, 3]
        points = [(load.at.link, load.at.position(pose), load.wrench) for load in loads.on_links]
        for link, p, W in [*points, ("link4", tip, loads.tip_wrench)]:
            body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, link)
            mujoco.mj_applyFT(model, data, W[:3], W[3:], p, body, torque)
        return np.asarray(torque[place])

    np.testing.assert_allclose(applied(pose), -loads.torque(pose), atol=1e-15)
    moved = list[float]()
    for pull in (F, F + np.linspace(0.0, 4.0, F.size), 1.3 * F):  # three rests
        rest = cdsm.equilibrium(pose, pull, THREE)
        soft = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, pull, actuators="none"))
        model.tendon_lengthspring[:] = soft.tendon_lengthspring
        model.tendon_stiffness[:] = soft.tendon_stiffness
        pushed = applied(rest.pose)
        net = pushed + (data.qfrc_passive - data.qfrc_bias)[place]
        assert abs(net).max() < 1e-12
        moved.append(1e3 * rest.moved)
    assert moved[0] == pytest.approx(0.18, abs=0.01)
    assert min(moved) > 0.1


def test_weights_on_disks_are_heavier_disks() -> None:
    arm = backbone()
    root = ElementTree.fromstring(arm.urdf)
    hung = [cdsm.Load(f"disk{i}", force=(0.0, 0.0, -9.81 * 0.004)) for i in (3, 6, 9)]
    for load in hung:
        x = next(disk.x for disk in arm.geometry.disks if disk.link == load.link)
        _add_mass(root, load.link, x)
    heavy = cdsm.Manipulator.from_urdf(
        ElementTree.tostring(root, encoding="unicode"),
        cables=arm.cables,
        gravity=(0.0, 0.0, -9.81),
        springs=arm.springs.given,
        tip=arm.tip_link,
    )
    F = np.array([1.0, 0.5, 0.0])
    one = cdsm.forward_statics(arm, tension=F, wrench=hung).pose.tip[:3, 3]
    two = cdsm.forward_statics(heavy, tension=F).pose.tip[:3, 3]
    np.testing.assert_allclose(one, two, atol=1e-11)
    disk = next(disk for disk in arm.geometry.disks if disk.link == "disk3")
    assert disk.x > 0.0
    (load, *_) = as_loads(loads_of(arm, hung)).on_links
    np.testing.assert_array_equal(load.at.local, [disk.x, 0.0, 0.0])
    pose = arm.at(np.full(arm.nv, 0.02))
    centre = (pose.link_pose("disk3") @ [disk.x, 0.0, 0.0, 1.0])[:3]
    np.testing.assert_allclose(load.at.position(pose), centre, atol=1e-15)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_weight_on_a_link_measures_the_stiffness_there(friction: float) -> None:
    arm = universal().with_friction(friction)
    pose = arm.at(Q)
    tension = cdsm.distribute_tension(pose, 50.0)
    K = cdsm.stiffness(pose, tension)
    test = cdsm.weight_test(pose, tension, [0.0, 0.0, -0.01], link="link2")
    assert test.tangent == pytest.approx(K.along("z", link="link2"), rel=1e-9)
    if friction == 0.0:
        assert test.stiffness == pytest.approx(test.tangent, rel=1e-3)
    else:
        assert test.stuck is not None
        assert test.breakaway_load is not None
        assert test.breakaway_load > 0.01
        assert test.stiffness == pytest.approx(test.stuck, rel=1e-3)
    same = cdsm.weight_test(pose, tension, [0.0, 0.0, -0.01], link="tool0")
    tip = cdsm.weight_test(pose, tension, [0.0, 0.0, -0.01])
    assert str(same) == str(tip)
    np.testing.assert_array_equal(same.displacements, tip.displacements)
    np.testing.assert_array_equal(same.tensions, tip.tensions)
    if friction > 0.0:
        return
    rows = {"link2": [[0.0, 0.0, -0.01, 0.0, 0.0, 0.0]]}
    history = cdsm.load_cycle(pose, tension, rows)
    np.testing.assert_allclose(history.pose(0).q, test.states[-1].pose.q, atol=1e-5)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_the_last_disk_of_a_backbone_is_its_tip(friction: float) -> None:
    """Loads at one place, on two links, are two loads of what goes on from there."""
    arm = backbone().with_friction(friction)
    rest = cdsm.forward_statics(arm, tension=[1.0, 0.5, 0.2], wrench=[0.0, 0.01, 0.0, 0, 0, 0])
    on_disk, at_tip = (
        cdsm.weight_test(rest.pose, rest, [0.0, 0.0, -0.02], link=link)
        for link in ("disk10", "tool0")
    )
    np.testing.assert_allclose(on_disk.displacements, at_tip.displacements, atol=1e-9)
    loaded = on_disk.states[-1]
    K = cdsm.stiffness(loaded.pose, loaded.tension, loaded.applied)
    np.testing.assert_allclose(K.joint, loaded.stiffness.joint, atol=1e-12)
    batch = cdsm.evaluate(
        arm, loaded.pose.q[None], loaded.tension, loaded.applied, ("load",), check_limits=False
    )
    np.testing.assert_allclose(batch["load"][0], K.load, atol=1e-12)


def test_forward_statics_under_loads_on_disks() -> None:
    arm = backbone()
    F = np.full(len(arm.cables), 0.5)
    hung = {"disk5": [0.0, 0.0, -0.02, 0.0, 0.0, 0.0]}
    rest = cdsm.forward_statics(arm, tension=F, wrench=hung)
    assert abs(rest.residual).max() < 1e-10
    assert "load on disk5" in str(rest)
    rough = cdsm.forward_statics(arm.with_friction(1e-5), tension=F, wrench=hung)
    np.testing.assert_allclose(rough.pose.tip[:3, 3], rest.pose.tip[:3, 3], atol=1e-5)
    assert rough.stiffness.applied is not None
    assert abs(rough.residual).max() < 1e-9


@pytest.mark.parametrize(
    ("wrench", "message"),
    [
        ({"lnik2": np.zeros(6)}, "link2"),
        ({"base_link": np.ones(6)}, "is the base"),
        ([cdsm.Load("link2", force=(1, 0, 0)), cdsm.Load("link2", force=(0, 1, 0))], "two loads"),
        ({"link2": [1.0, 0.0, 0.0]}, "link2.*shape"),
        ([cdsm.Load("link2"), [0.0] * 6], "is no Load"),
    ],
)
def test_wrong_loads_are_named(wrench: object, message: str) -> None:
    pose = universal().at(Q)
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.distribute_tension(pose, 10.0, wrench=wrench)  # type: ignore[arg-type]


def test_what_takes_only_a_wrench_at_the_tip_says_so() -> None:
    pose = universal().at(Q)
    hung = {"link2": [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]}
    tension = cdsm.distribute_tension(pose, 10.0, wrench=hung)
    assert "load on link2" in cdsm.to_mjcf(pose.arm, pose, tension)
    held = cdsm.payload(pose, "-z", 10.0, 200.0, wrench=hung)
    with pytest.raises(cdsm.InvalidInput, match="loads act on link2"):
        _ = held.wrench
    plan = cdsm.plan_path(pose.arm, "z", 4e3, 20.0, 600.0, hung, angles=[Q, 0.9 * Q])
    with pytest.raises(cdsm.InvalidInput, match="plan: loads act on link2; controllers know"):
        cdsm.track(plan)
    with pytest.raises(cdsm.InvalidInput, match=r"loads: designs take wrenches .* belong to the a"):
        cdsm.DesignProblem(
            arm=pose.arm,
            variables=[cdsm.Variable("disk_offset", 0.01, 0.02)],
            objectives=[cdsm.Objective("mass")],
            postures=[Q],
            loads=hung,  # type: ignore[arg-type]
        )
    with pytest.raises(cdsm.InvalidInput, match="point: is a point of a link"):
        cdsm.stiffness(pose, tension).along("z", point=(0.0, 0.0, 0.0))


def test_a_history_of_loads_on_a_link_shows_force_and_place(tmp_path: Path) -> None:
    arm = universal().with_friction(0.1)
    pose = arm.at(Q)
    tension = cdsm.distribute_tension(pose, 30.0)
    down = np.outer([-2.0, -4.0, -2.0, 0.0], [0, 0, 1, 0, 0, 0])
    history = cdsm.load_cycle(pose, tension, {"link2": down})
    (hung,) = history.on_links
    place = pose.link_pose("link2")[:3, 3]
    for k in range(4):
        moved = history.pose(k).link_pose("link2")[:3, 3] - place
        np.testing.assert_allclose(hung.displacement[k], moved, atol=1e-15)
    np.testing.assert_array_equal(hung.wrenches, down)
    rows = str(history).splitlines()
    assert "link2 moved by [mm]" in rows[0]
    assert rows[2].split()[3] == "-4"
    assert float(rows[2].split()[6]) == pytest.approx(1e3 * hung.displacement[1, 2], abs=1e-4)
    told: Any = history.to_dict()["loads"]
    assert told[0]["link"] == "link2"
    np.testing.assert_allclose(told[0]["displacement_m"], hung.displacement)
    lines = history.write_loop(tmp_path / "loop.csv").read_text().splitlines()
    column = lines[0].split(",").index("force z of load 1 on link2 [N]")
    assert [float(line.split(",")[column]) for line in lines[1:]] == [-2.0, -4.0, -2.0, 0.0]
    panel = history.plot()
    assert panel.get_xlabel() == "displacement of link2 along −z [mm]"
    (loop,) = [line for line in panel.lines if line.get_gid() == "loop"]
    np.testing.assert_allclose(loop.get_ydata(), [0.0, 2.0, 4.0, 2.0, 0.0])
    np.testing.assert_allclose(
        np.asarray(loop.get_xdata())[1:], -1e3 * hung.displacement[:, 2], atol=1e-12
    )
    both = cdsm.load_cycle(pose, tension, {"link2": down, "link3": down})
    text = str(both)
    assert "sum of forces [N]" in text
    assert "tip moved by [mm]" in text
    assert "loads on link2, link3" in text
    assert both.forces[1].tolist() == [0.0, 0.0, -8.0]
    test = cdsm.weight_test(pose, tension, [0, 0, -2.0], link="link2")
    assert "weight on link2, read there" in str(test)
    assert test.plot().get_xlabel() == "displacement of link2 along −z [mm]"

"""Backbones and links that bend, against beam theory, other programs' rods, and MuJoCo."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm.support.values import Array
from tests.support.arms import readme_geometry

mujoco = pytest.importorskip("mujoco")

LAW = cdsm.LinearElasticity(2e4)
EI = 54e9 * math.pi * 1.4e-3**4 / 64.0
THREE = np.deg2rad([90.0, -30.0, 210.0])


def rod(angles: Array = THREE, **changes: object) -> cdsm.Manipulator:
    """The rod of Martin-Bensch's tests of tdcr-pinn: two sections of ten disks, six tendons."""
    section = {"length": 0.2, "disks": 10, "hole_angles": angles.tolist(), "hole_radius": 0.01}
    sizes = {"outer_diameter": 1.4e-3, "youngs_modulus": 54e9} | changes
    geometry = cdsm.Geometry.backbone(sections=[section, section], **sizes)  # type: ignore[arg-type]
    return cdsm.Manipulator(geometry, LAW, gravity=(0.0, 0.0, 0.0))


ROD = cdsm.presets.tdcr_two_sections()

# tensions [N], force [N], tip [m]; the computed rod per disk gap of tdcr-pinn at 3d5e7ba, base
# axes: z along the rod, here x
CASES = (
    ((4, 0, 0, 0, 2, 0), (0.0, 0.0, 0.0), (0.129371, 0.145941, 0.334201)),
    ((2, 0, 0, 0, 2, 0), (0.0, 0.0, 0.0), (0.131868, 0.0371144, 0.366794)),
    ((0, 2, 0, 1, 0, 1), (0.0, 0.0, 0.0), (0.0344679, -0.0199, 0.397342)),
    ((4, 0, 0, 0, 0, 1), (0.0, 0.0, 0.1), (-0.0412987, 0.12123, 0.374456)),
)


@pytest.mark.parametrize(("tension", "force", "tip"), CASES)
def test_tips_are_those_of_a_rod_per_gap(
    tension: tuple[float, ...], force: tuple[float, float, float], tip: tuple[float, float, float]
) -> None:
    x, y, z = force
    rest = cdsm.forward_statics(ROD, tension=tension, wrench=[z, x, y, 0.0, 0.0, 0.0])
    found = np.roll(rest.pose.tip[:3, 3], -1)
    bent = np.linalg.norm(np.subtract(tip, (0.0, 0.0, 0.4)))
    assert np.linalg.norm(found - tip) < 1e-3 * bent
    assert rest.branch == 1.0


def test_files_hold_backbones() -> None:
    geometry = ROD.geometry
    assert cdsm.Geometry.from_toml(geometry.to_toml()) == geometry
    assert (len(geometry.disks), geometry.disks[2].link) == (21, "disk2")


def test_mujoco_is_at_rest_there() -> None:
    arm = rod(mass_per_length=0.02).with_gravity("-z")
    tension = np.array(CASES[0][0], dtype=np.float64)
    rest = cdsm.forward_statics(arm, tension=tension)
    text = cdsm.to_mjcf(arm, rest.pose, tension, actuators="tension")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert model.nv == arm.nv == 100
    assert abs(data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator).max() < 1e-9


def test_a_turned_rod_has_a_turned_tip() -> None:
    turned, (x, y, z) = (
        cdsm.forward_statics(arm, tension=CASES[0][0]).pose.tip[:3, 3]
        for arm in (rod(THREE + math.pi / 4.0), ROD)
    )
    c = math.sqrt(0.5)
    np.testing.assert_allclose(turned, [x, c * (y - z), c * (y + z)], atol=5e-5)


def cantilever(pieces: int, **changes: float) -> cdsm.Manipulator:
    section = {"length": 0.4, "disks": 1, "hole_angles": [0.0, 2.0, 4.0], "hole_radius": 0.01}
    sizes: dict[str, Any] = {"bending_stiffness": EI, "pieces": pieces, "joint_limit": 2.5}
    geometry = cdsm.Geometry.backbone(sections=[section], **sizes, **changes)
    return cdsm.Manipulator(geometry, LAW, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_cantilevers_bend_as_beams(n: int) -> None:
    f, arm = 1e-6, cantilever(n)

    def tip(*wrench: float, of: cdsm.Manipulator = arm) -> Array:
        return cdsm.forward_statics(of, tension=np.zeros(3), wrench=wrench).pose.tip

    sag = tip(0.0, 0.0, f, 0.0, 0.0, 0.0)[2, 3] / (f * 0.4**3 / (3.0 * EI))
    assert sag - 1.0 == pytest.approx(1.0 / (12.0 * n * n), rel=1e-6)
    twisted = tip(0.0, 0.0, 0.0, f, 0.0, 0.0)
    assert math.atan2(twisted[2, 1], twisted[1, 1]) == pytest.approx(f * 0.4 / (EI / 1.3), rel=1e-9)
    moment = math.radians(60.0) * EI / 0.4
    turned = tip(0.0, 0.0, 0.0, 0.0, -moment, 0.0)
    assert math.atan2(turned[2, 0], turned[0, 0]) == pytest.approx(math.radians(60.0), rel=1e-9)
    heavy = cantilever(n, mass_per_length=1e-6).with_gravity("z")
    sag = tip(*[0.0] * 6, of=heavy)[2, 3] / (1e-6 * 9.81 * 0.4**4 / (8.0 * EI))
    assert sag - 1.0 == pytest.approx(1.0 / (6.0 * n * n), rel=0.05)


def test_axial_loads_buckle_a_rod_at_euler_s_load() -> None:
    euler = math.pi**2 * EI / (4.0 * 0.4**2)
    off = []
    for n in (2, 4, 8):
        arm = cantilever(n)
        pose = arm.at(np.zeros(arm.nv))

        def margin(load: float, pose: cdsm.Posture = pose) -> float:
            K = cdsm.stiffness(pose, np.zeros(3), [-load, 0.0, 0.0, 0.0, 0.0, 0.0])
            alone = K.joint - K.passive  # cables that are slack
            return float(np.linalg.eigvalsh((alone + alone.T) / 2.0)[0])

        off.append(float(brentq(margin, 0.5 * euler, 1.5 * euler)) / euler - 1.0)
    assert abs(off[-1]) < 1e-2
    np.testing.assert_allclose(np.log2(np.divide(off[:-1], off[1:])), 2.0, atol=0.1)


@pytest.mark.parametrize(
    ("law", "bent", "twisted"),
    [
        (cdsm.LinearElasticity(48e3), (-1.6, -1.8, -2.9), (-1.6, -19.7, -22.7)),
        (cdsm.LinearElasticity(226195.0), (-7.2, -8.2, -12.5), (-7.2, -53.5, -58.1)),
    ],
)
def test_tubes_of_the_virtual_prototype_cost_stiffness(
    law: cdsm.Elasticity, bent: tuple[float, ...], twisted: tuple[float, ...]
) -> None:
    """20 × 1 mm aluminium; the numbers are those of an independent program, in per cent of K."""
    rigid = cdsm.presets.virtual_prototype().geometry

    def along(GJ: float) -> Array:
        soft = {"bending_stiffness": 189.0, "torsion_stiffness": GJ} if GJ else {}
        links = tuple(replace(each, **soft) for each in rigid.links)
        arm = cdsm.Manipulator(rigid.replace(links=links), law)
        ten = [math.radians(10.0) * name.startswith("joint") for name in arm.joint_names]
        K = cdsm.equilibrium(arm.at(ten), tension).stiffness
        return np.array([K.along(u) for u in "xyz"])

    pose = cdsm.Manipulator(rigid, law).at(np.full(10, math.radians(10.0)))
    tension = cdsm.distribute_tension(pose, 50.0).values
    for GJ, loss in ((math.inf, bent), (141.0, twisted)):
        np.testing.assert_allclose(100.0 * (along(GJ) / along(0.0) - 1.0), loss, atol=0.5)


def own_buckling(pieces: int) -> float:
    """Relative error of the tension at which cables buckle the gaps of a backbone."""
    section = {"length": 0.08, "disks": 2, "hole_angles": THREE.tolist(), "hole_radius": 0.01}
    geometry = cdsm.Geometry.backbone(sections=[section], bending_stiffness=EI, pieces=pieces)
    soft = cdsm.LinearElasticity(1e4)
    arm = cdsm.Manipulator(geometry, soft, gravity=(0.0, 0.0, 0.0))
    arm = arm.with_cables([replace(each, control="force") for each in arm.cables])
    pose, expected = arm.at(np.zeros(arm.nv)), math.pi**2 * EI / 0.04**2
    return 3.0 * cdsm.critical_tension(pose, up_to=1e3).minimum / expected - 1.0


def test_own_cables_buckle_each_gap() -> None:
    with pytest.warns(cdsm.CdsmWarning, match="pieces=4"):
        one = own_buckling(1)
    assert one == pytest.approx(12.0 / math.pi**2 - 1.0, abs=2e-3)  # 21.6 %
    errors = [own_buckling(pieces) for pieces in (4, 8)]
    assert errors[0] == pytest.approx(-0.017, abs=2e-3)
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_a_round_rod_beyond_euler_s_load_rests_in_any_direction() -> None:
    arm, euler = cantilever(10), math.pi**2 * EI / (4.0 * 0.4**2)
    start = np.full(arm.nv, 0.05)
    for load, neutral in ((0.5, False), (1.05, True)):
        wrench = [-load * euler, 0.0, 0.0, 0.0, 0.0, 0.0]
        rest = cdsm.forward_statics(arm, tension=np.zeros(3), wrench=wrench, start=start)
        assert rest.neutral is neutral
        assert ("NEUTRAL" in str(rest)) is neutral


TUBE = {"outer_diameter": 1e-3, "youngs_modulus": 5e10}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "bending_stiffness: give it"),
        ({"bending_stiffness": 0.0}, "bending_stiffness"),
        ({"bending_stiffness": -1.0}, "bending_stiffness"),
        ({"outer_diameter": 1e-3}, "youngs_modulus: give it"),
        ({**TUBE, "inner_diameter": 2e-3}, "inner_diameter"),
        ({**TUBE, "bending_stiffness": 1.0}, "not both"),
        ({"bending_stiffness": 1.0, "pieces": 21}, "pieces"),
        ({"bending_stiffness": 1.0, "pieces": 9}, "450 axes .* 400 are taken .* fewer pieces"),
    ],
)
def test_beams_that_cannot_be_are_named(given: dict[str, float], said: str) -> None:
    section = {"length": 0.2, "disks": 10, "hole_angles": [0.0], "hole_radius": 0.01}
    with pytest.raises(cdsm.GeometryError, match=said):
        cdsm.Geometry.backbone(sections=[section], **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"pieces": 2}, "pieces: belongs to links that bend; give bending_stiffness, or"),
        ({"poisson": 0.4}, "poisson: belongs to links that bend"),
        ({"torsion_stiffness": 1.0}, "torsion_stiffness: belongs to links that bend"),
        ({"inner_diameter": 1e-3}, "inner_diameter: belongs to outer_diameter"),
        ({"inner_diameter": 1e-3, "bending_stiffness": 1.0}, "inner_diameter: belongs to outer"),
    ],
)
def test_what_no_beam_would_use_is_refused(given: Any, said: str) -> None:
    with pytest.raises(cdsm.GeometryError, match=said):
        readme_geometry(**given)

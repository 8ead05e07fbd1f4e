"""Geometry: constructors, sizes of each joint, holes, sections, and their TOML form."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import cdsm
from cdsm import presets

SIZES: dict[str, Any] = {
    "link_length": 0.06,
    "base_length": 0.03,
    "disk_offset": 0.008,
    "hole_radius": 0.02,
    "link_mass": 0.1,
}
HINGED: dict[str, Any] = {"joints": 3, "twist": math.radians(30.0), **SIZES}
TAPER = (0.02, 0.018, 0.015)


def universal(**changes: Any) -> cdsm.Geometry:
    count = {} if "hole_angles" in changes else {"cables_per_joint": 3}
    return cdsm.Geometry.universal(**{"joints": 3, **count, **SIZES, **changes})


def holes(cable: cdsm.Cable) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Radius and angle of every hole of a cable, actuator side first."""
    places = [site.position for site in cable.sites]
    found = [(math.hypot(y, z), math.atan2(z, y) % (2.0 * math.pi)) for _, y, z in places]
    radii, angles = zip(*found, strict=True)
    return radii, angles


def arm_of(geometry: cdsm.Geometry) -> cdsm.Manipulator:
    return cdsm.Manipulator(geometry, presets.STRAND_1X19)


# --- constructors ---------------------------------------------------------------------------


@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 3), (4, 4)])
def test_universal_cable_j_of_joint_k_has_the_hole_angle_of_the_formula(n: int, m: int) -> None:
    geometry = universal(joints=n, cables_per_joint=m)
    expected = [
        (k, 2.0 * math.pi * ((k - 1) + n * j) / (n * m)) for k in range(1, n + 1) for j in range(m)
    ]
    assert [cable.joint for cable in geometry.cables] == [k for k, _ in expected]
    assert [cable.angle for cable in geometry.cables] == pytest.approx([a for _, a in expected])


@pytest.mark.parametrize("count", [2, 3])
def test_hinge_k_is_turned_by_k_minus_1_twists_and_its_cables_with_it(count: int) -> None:
    """They are evenly spread from 90° beside the axis."""
    geometry = cdsm.Geometry.hinged(**HINGED, cables_per_joint=count)
    for k, joint in enumerate(geometry.joints):
        psi = k * math.radians(30.0)
        np.testing.assert_allclose(joint.axes, [(0.0, math.cos(psi), math.sin(psi))], atol=1e-15)
        own = geometry.cables[count * k : count * (k + 1)]
        assert {cable.joint for cable in own} == {k + 1}
        expected = [psi + math.pi / 2.0 + 2.0 * math.pi * j / count for j in range(count)]
        assert [cable.angle for cable in own] == pytest.approx(expected)


def test_a_size_per_joint_is_that_of_its_parts() -> None:
    geometry = universal(
        link_length=[0.06, 0.05, 0.04],
        disk_offset=(0.008, 0.007, 0.006),
        hole_radius=np.array(TAPER),
        link_mass=[0.3, 0.2, 0.1],
        lead=[0.1, 0.2, 0.3],
        friction=[0.05, 0.1, 0.15],
        joint_limit=[0.3, 0.4, 0.5],
        disk_radius=[0.03, 0.025, 0.02],
        cable_radius=[0.02, 0.018, 0.01],
    )
    assert [link.length for link in geometry.links] == [0.06, 0.05, 0.04]
    assert [link.mass for link in geometry.links] == [0.3, 0.2, 0.1]
    assert [joint.disk_offset for joint in geometry.joints] == [0.008, 0.007, 0.006]
    assert geometry.hole_radii == TAPER
    plain = universal(hole_radius=TAPER)
    assert [disk.radius for disk in plain.disks] == [1.1 * R for R in TAPER for _ in range(2)]
    assert geometry.joint_limits == (0.3, 0.4, 0.5)
    places = [0.03 - 0.008, 0.008, 0.06 - 0.007, 0.007, 0.05 - 0.006, 0.006]
    links = ["base_disk", "link1", "link1", "link2", "link2", "link3"]
    for disk, link, x, r in zip(
        geometry.disks, links, places, np.repeat([0.03, 0.025, 0.02], 2), strict=True
    ):
        assert (disk.link, disk.radius) == (link, r)
        assert disk.x == pytest.approx(x)
    by_joint = {each.joint: (each.lead, each.friction, each.radius) for each in geometry.cables}
    assert by_joint == {1: (0.1, 0.05, 0.02), 2: (0.2, 0.1, 0.018), 3: (0.3, 0.15, 0.01)}


def test_limits_are_where_the_disks_touch_and_never_above_80_degrees() -> None:
    steps: dict[str, Any] = {"disk_offset": [0.008, 0.006, 0.004], "hole_radius": TAPER}
    for changes, ratios in (
        (steps, (8 / 20, 6 / 18, 4 / 15)),
        ({"disk_radius": [0.025, 0.03, 0.04]}, (8 / 25, 8 / 30, 8 / 40)),
        ({"hole_radius": 0.001}, [math.tan(math.radians(40.0))] * 3),
    ):
        bends = [2.0 * math.atan(ratio) for ratio in ratios]
        geometry = universal(**changes)
        for limit, bend in zip(geometry.joint_limits, bends, strict=True):
            about_y = pin.rpy.rpyToMatrix(0.0, limit, 0.0)
            about_z = pin.rpy.rpyToMatrix(0.0, 0.0, limit)
            assert (about_y @ about_z)[0, 0] == pytest.approx(math.cos(bend))
        hinges = cdsm.Geometry.hinged(**{**HINGED, **changes})
        assert hinges.joint_limits == pytest.approx(bends)


def test_replace_checks_what_it_changes() -> None:
    geometry = universal()
    wider = geometry.replace(hole_radius=0.025)
    assert wider == universal(hole_radius=0.025)
    assert universal(hole_radius=[0.03, 0.02, 0.01]).replace(hole_radius=0.025) == wider
    joints = universal(hole_radius=[0.02, 0.03, 0.02]).joints
    both = geometry.replace(hole_radius=0.025, joints=joints)
    assert both.hole_radii == (0.025, 0.03, 0.025)
    with pytest.raises(cdsm.GeometryError, match="hole_radius: -1 m"):
        geometry.replace(hole_radius=-1.0)


# --- holes ----------------------------------------------------------------------------------


def test_a_cable_passes_each_disk_at_its_hole_radius_or_at_its_own() -> None:
    for own in (None, 0.01):
        geometry = universal(hole_radius=TAPER, cable_radius=own)
        for cable, route in zip(arm_of(geometry).cables, geometry.cables, strict=True):
            radii, angles = holes(cable)
            expected = np.repeat(TAPER if own is None else [own] * 3, 2)[: len(radii)]
            np.testing.assert_allclose(radii, expected, rtol=1e-14)
            np.testing.assert_allclose(angles, route.angle % (2.0 * math.pi), atol=1e-14)


def test_phase_adds_to_the_angles_of_a_joint_and_all_may_be_given_as_an_array() -> None:
    for before, after in zip(
        universal().cables, universal(phase=[0.0, 0.1, -0.2]).cables, strict=True
    ):
        added = (0.0, 0.1, -0.2)[before.joint - 1]
        assert after.angle == pytest.approx(before.angle + added, abs=1e-15)
    turned = np.add.outer(np.arange(3), [0.0, 2.1, 4.2])
    assert universal(hole_angles=turned) == universal(hole_angles=turned.tolist())


def test_alternating_hinges_share_holes_loudly_and_spread_sets_them_apart() -> None:
    alternating: dict[str, Any] = {**HINGED, "joints": 6, "twist": math.pi / 2}
    with pytest.warns(
        cdsm.CdsmWarning, match="cable1_1 and cable3_2 and cable5_1.*spread="
    ) as told:
        default = cdsm.Geometry.hinged(**alternating)
    assert [each.filename for each in told] == [__file__]  # the line of the user, not of cdsm
    angles = [math.degrees(c.angle) for c in default.cables]
    assert angles == pytest.approx([90 + 90 * k + 180 * j for k in range(6) for j in range(2)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        apart = cdsm.Geometry.hinged(spread=math.radians(12.0), **alternating)
    turned = np.degrees([c.angle for c in apart.cables]) - angles
    # hinges 1, 3, 5 share one plane, hinges 2, 4, 6 the other; both cables of a pair turn alike
    np.testing.assert_allclose(turned.reshape(6, 2), [[d] * 2 for d in (-12, -12, 0, 0, 12, 12)])


@pytest.mark.parametrize("lead", [0.0, 0.3])
def test_friction_is_that_of_every_hole_which_a_cable_passes(lead: float) -> None:
    """The base disk is a hole only if there is a lead before it."""
    geometry = universal(lead=lead, friction=0.1)
    assert "friction" not in universal(lead=lead).to_toml()
    arm = arm_of(geometry)
    assert arm.has_friction
    for cable, route in zip(arm.cables, geometry.cables, strict=True):
        assert cable.friction == (0.1,) * (2 * route.joint - (1 if lead else 2))
        assert cable.sites[-1].friction == 0.0
    assert not arm_of(universal()).has_friction


def test_sections_are_joined_end_to_end() -> None:
    proximal = universal(joints=2, hole_radius=0.025, lead=0.2)
    for own in (None, 0.012):
        distal = universal(
            hole_radius=0.012, base_length=0.01, disk_offset=0.004, phase=0.2, cable_radius=own
        )
        geometry = cdsm.Geometry.sections([proximal, distal], name="two")
        assert geometry.name == "two"
        assert geometry.hole_radii == (0.025, 0.025, 0.012, 0.012, 0.012)
        assert [link.length for link in geometry.links] == [0.06, 0.06 + 0.01, 0.06, 0.06, 0.06]
        assert [joint.disk_offset for joint in geometry.joints] == [0.008] * 2 + [0.004] * 3
        assert [cable.joint for cable in geometry.cables] == sorted([1, 2, 3, 4, 5] * 3)
        arm = arm_of(geometry)
        straight = [0.03 + 0.06 + 0.07 + 0.18, 0.0, 0.0]
        np.testing.assert_allclose(arm.at(np.zeros(10)).tip[:3, 3], straight)
        expected = [own or 0.025] * 4 + [0.012] * 6
        np.testing.assert_allclose(holes(arm.cables[-1])[0], expected, rtol=1e-14)


# --- TOML -----------------------------------------------------------------------------------


TWO = """
name = "two"
spread = 0.1

[[sections]]
[sections.universal]
joints = 2
cables_per_joint = 3
link_length = [0.06, 0.05]
base_length = 0.03
disk_offset = 0.008
hole_radius = [0.025, 0.02]
disk_radius = 0.03
link_mass = 0.1

[[sections]]
[sections.hinged]
joints = 2
twist = 1.5707963267948966
hole_angles = [[0.1, 3.2], [1.6, 4.7]]
link_length = 0.05
base_length = 0.0
disk_offset = 0.006
hole_radius = 0.012
link_mass = 0.05
"""


def test_everything_of_python_is_in_toml(tmp_path: Path) -> None:
    sizes = {"link_length": [0.06, 0.05], "hole_radius": [0.025, 0.02], "disk_radius": 0.03}
    distal = cdsm.Geometry.hinged(
        joints=2, twist=math.pi / 2, hole_angles=[[0.1, 3.2], [1.6, 4.7]], link_length=0.05,
        base_length=0.0, disk_offset=0.006, hole_radius=0.012, link_mass=0.05,
    )  # fmt: skip
    both = [universal(joints=2, **sizes), distal]
    geometry = cdsm.Geometry.sections(both, spread=0.1, name="two")
    assert cdsm.Geometry.from_toml(TWO) == geometry
    assert cdsm.Geometry.from_toml(geometry.to_toml()) == geometry
    path = tmp_path / "arm.toml"
    path.write_text('wire = "solid-1.2mm"\n' + TWO, encoding="utf-8")
    arm = cdsm.Manipulator.read(path)
    assert arm == cdsm.Manipulator(geometry, presets.STEEL_WIRE_200GPA)
    assert cdsm.Manipulator.read(arm.write(path)) == arm

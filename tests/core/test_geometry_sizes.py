"""Sizes that differ from joint to joint, holes where they are wanted, sections, warnings."""

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.core.test_urdf import child, elements

SIZES: dict[str, Any] = {
    "link_length": 0.06,
    "base_length": 0.03,
    "disk_offset": 0.008,
    "hole_radius": 0.02,
    "link_mass": 0.1,
}


def universal(**changes: Any) -> cdsm.Geometry:
    count = {} if "hole_angles" in changes else {"cables_per_joint": 3}
    return cdsm.Geometry.universal(**{"joints": 3, **count, **SIZES, **changes})


def holes(cable: cdsm.Cable) -> list[tuple[float, float]]:
    """Radius and angle of every hole of a cable, actuator side first."""
    places = [site.position for site in cable.sites]
    return [(math.hypot(y, z), math.atan2(z, y) % (2.0 * math.pi)) for _, y, z in places]


def arm_of(geometry: cdsm.Geometry) -> cdsm.Manipulator:
    return cdsm.Manipulator(geometry, presets.STRAND_1X19)


# --- one value per joint --------------------------------------------------------------------


def test_a_size_per_joint_is_that_of_its_parts() -> None:
    geometry = universal(
        link_length=[0.06, 0.05, 0.04],
        disk_offset=(0.008, 0.007, 0.006),
        hole_radius=np.array([0.02, 0.018, 0.015]),
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
    assert geometry.hole_radii == (0.02, 0.018, 0.015)
    assert geometry.joint_limits == (0.3, 0.4, 0.5)
    assert [disk.radius for disk in geometry.disks] == [0.03, 0.03, 0.025, 0.025, 0.02, 0.02]
    by_joint = {
        cable.joint: (cable.lead, cable.friction, cable.radius) for cable in geometry.cables
    }
    assert by_joint == {1: (0.1, 0.05, 0.02), 2: (0.2, 0.1, 0.018), 3: (0.3, 0.15, 0.01)}


def test_a_cable_passes_each_disk_at_its_hole_radius_or_at_its_own() -> None:
    taper = arm_of(universal(hole_radius=[0.02, 0.018, 0.015]))
    for cable in taper.cables:
        radii, angles = zip(*holes(cable), strict=True)
        expected = [0.02, 0.02, 0.018, 0.018, 0.015, 0.015][: len(radii)]
        np.testing.assert_allclose(radii, expected, rtol=1e-14)
        np.testing.assert_allclose(angles, angles[0], atol=1e-14)
    inner = arm_of(universal(hole_radius=[0.02, 0.018, 0.015], cable_radius=0.01))
    for cable in inner.cables:
        np.testing.assert_allclose([R for R, _ in holes(cable)], 0.01, rtol=1e-14)


def test_limits_are_where_the_disks_touch() -> None:
    geometry = universal(hole_radius=[0.02, 0.018, 0.015], disk_offset=[0.008, 0.006, 0.004])
    expected = [2.0 * math.atan(h / R) for h, R in ((8, 20), (6, 18), (4, 15))]
    assert geometry.joint_limits == pytest.approx(expected)
    geometry = universal(disk_radius=[0.025, 0.03, 0.04])
    expected = [2.0 * math.atan(0.008 / R) for R in (0.025, 0.03, 0.04)]
    assert geometry.joint_limits == pytest.approx(expected)


def test_disks_and_inertias_of_the_urdf_have_the_radii_of_their_joints() -> None:
    radii, mass, length = (0.02, 0.018, 0.015), 0.1, 0.06
    geometry = universal(hole_radius=radii, disk_radius=[0.03, 0.025, 0.02])
    links = elements(geometry, "link")
    drawn = [
        (name, float(child(child(visual, "geometry"), "cylinder").attrib["radius"]))
        for name in ("base_disk", "link1", "link2", "link3")
        for visual in links[name].findall("visual")
        if child(visual, "material").attrib["name"] == "disk"
    ]
    assert drawn == [(disk.link, disk.radius) for disk in geometry.disks]
    plain = universal(hole_radius=radii)
    assert [disk.radius for disk in plain.disks] == [1.1 * R for R in radii for _ in range(2)]
    for k, R in enumerate(radii, start=1):
        inertia = child(child(links[f"link{k}"], "inertial"), "inertia").attrib
        assert float(inertia["ixx"]) == pytest.approx(mass * R**2 / 2.0)
        assert float(inertia["iyy"]) == pytest.approx(mass * (3.0 * R**2 + length**2) / 12.0)


def test_replace_checks_what_it_changes() -> None:
    geometry = universal()
    wider = geometry.replace(hole_radius=0.025)
    assert wider == universal(hole_radius=0.025)
    assert universal(hole_radius=[0.03, 0.02, 0.01]).replace(hole_radius=0.025) == wider
    joints = universal(hole_radius=[0.02, 0.03, 0.02]).joints
    both = geometry.replace(hole_radius=0.025, joints=joints)
    assert both.hole_radii == (0.025, 0.03, 0.025)
    with pytest.raises(cdsm.GeometryError, match="did you mean hole_radius"):
        geometry.replace(hole_radus=0.025)
    with pytest.raises(cdsm.GeometryError, match="hole_radius: -1 m given"):
        geometry.replace(hole_radius=-1.0)
    with pytest.raises(cdsm.GeometryError, match="lead: is not a key that is known here"):
        geometry.replace(lead=0.1)


# --- holes ----------------------------------------------------------------------------------


def test_phase_adds_to_the_angles_of_a_joint() -> None:
    plain, turned = universal(), universal(phase=[0.0, 0.1, -0.2])
    for before, after in zip(plain.cables, turned.cables, strict=True):
        added = (0.0, 0.1, -0.2)[before.joint - 1]
        assert after.angle == pytest.approx(before.angle + added, abs=1e-15)


def test_hole_angles_may_be_arrays() -> None:
    turned = np.add.outer(np.arange(3), [0.0, 2.1, 4.2])
    assert universal(hole_angles=turned) == universal(hole_angles=turned.tolist())


def test_alternating_hinges_share_holes_loudly_and_spread_sets_them_apart() -> None:
    alternating: dict[str, Any] = {"joints": 6, "twist": math.pi / 2, **SIZES}
    with pytest.warns(cdsm.CdsmWarning) as told:
        default = cdsm.Geometry.hinged(**alternating)
    (warning,) = told
    assert "cable1_1 and cable3_2 and cable5_1" in str(warning.message)
    assert "spread=" in str(warning.message)
    assert warning.filename == __file__  # the line of the user, not of cdsm
    angles = [math.degrees(c.angle) for c in default.cables]
    assert angles == pytest.approx([90 + 90 * k + 180 * j for k in range(6) for j in range(2)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        apart = cdsm.Geometry.hinged(spread=math.radians(12.0), **alternating)
    turned = np.degrees([c.angle for c in apart.cables]) - angles
    # hinges 1, 3, 5 share one plane, hinges 2, 4, 6 the other; both cables of a pair turn alike
    np.testing.assert_allclose(turned.reshape(6, 2), [[d] * 2 for d in (-12, -12, 0, 0, 12, 12)])


# --- sections -------------------------------------------------------------------------------


def two_sections(**changes: Any) -> cdsm.Geometry:
    proximal = universal(joints=2, hole_radius=0.025, lead=0.2)
    distal = universal(
        joints=3, hole_radius=0.012, base_length=0.01, disk_offset=0.004, phase=0.2, **changes
    )
    return cdsm.Geometry.sections([proximal, distal], name="two")


def test_sections_are_joined_end_to_end() -> None:
    geometry = two_sections()
    assert geometry.name == "two"
    assert geometry.hole_radii == (0.025, 0.025, 0.012, 0.012, 0.012)
    assert [link.length for link in geometry.links] == [0.06, 0.06 + 0.01, 0.06, 0.06, 0.06]
    assert [joint.disk_offset for joint in geometry.joints] == [0.008] * 2 + [0.004] * 3
    assert [cable.joint for cable in geometry.cables] == sorted([1, 2, 3, 4, 5] * 3)
    arm = arm_of(geometry)
    np.testing.assert_allclose(arm.at(np.zeros(10)).tip[:3, 3], [0.03 + 0.06 + 0.07 + 0.18, 0, 0])
    last = arm.cables[-1]
    np.testing.assert_allclose([R for R, _ in holes(last)], [0.025] * 4 + [0.012] * 6, rtol=1e-14)
    inner = arm_of(two_sections(cable_radius=0.012)).cables[-1]
    np.testing.assert_allclose([R for R, _ in holes(inner)], [0.012] * 10, rtol=1e-14)


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
    sizes = {**SIZES, "link_length": [0.06, 0.05], "hole_radius": [0.025, 0.02]}
    proximal = cdsm.Geometry.universal(joints=2, cables_per_joint=3, disk_radius=0.03, **sizes)
    sizes = {"link_length": 0.05, "base_length": 0.0, "disk_offset": 0.006, "hole_radius": 0.012}
    angles = [[0.1, 3.2], [1.6, 4.7]]
    distal = cdsm.Geometry.hinged(
        joints=2, twist=math.pi / 2, hole_angles=angles, link_mass=0.05, **sizes
    )
    geometry = cdsm.Geometry.sections([proximal, distal], spread=0.1, name="two")
    assert cdsm.Geometry.from_toml(TWO) == geometry
    assert cdsm.Geometry.from_toml(geometry.to_toml()) == geometry
    path = tmp_path / "arm.toml"
    path.write_text('wire = "solid-1.2mm"\n' + TWO, encoding="utf-8")
    arm = cdsm.Manipulator.read(path)
    assert arm == cdsm.Manipulator(geometry, presets.STEEL_WIRE_200GPA)
    assert cdsm.Manipulator.read(arm.write(path)) == arm

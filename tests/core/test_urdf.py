"""The URDF: forward kinematics against the paper's own formulas, and what other programs read."""

import math
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

import cdsm
from cdsm.support.values import Array
from cdsm.urdf import CROSS_MASS
from tests.support.arms import mixed_arm, random_arm, readme_geometry
from tests.support.patience import HANGS

ROOT = Path(__file__).parents[2]

PRESETS: dict[str, Callable[[], cdsm.Geometry]] = {
    "virtual_prototype": cdsm.presets.virtual_prototype_geometry,
    "experimental_prototype": cdsm.paper.experimental_prototype_geometry,
}

TAPER = (0.025, 0.022, 0.02)
ARMS: dict[str, cdsm.Geometry] = {
    "universal": random_arm(1, 3).geometry,
    "long": random_arm(2, 12).geometry,
    "hinged": random_arm(3, 4, "hinged").geometry,
    "mixed": mixed_arm().geometry,
    "no base": readme_geometry(joints=2, base_length=0.0, link_mass=0.0),
    "taper": readme_geometry(joints=3, hole_radius=TAPER),
}

CHECK_URDF = shutil.which("check_urdf")


def eq1(alpha: float, a: float, theta: float) -> Array:
    """Eq. 1 as printed: R_i to R_{i-1}; every d_i of Table I is 0."""
    ca, sa, c, s = math.cos(alpha), math.sin(alpha), math.cos(theta), math.sin(theta)
    return np.array(
        [
            [c, -ca * s, sa * s, a * c],
            [s, ca * c, -sa * c, a * s],
            [0.0, sa, ca, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def eq2(L_0: float) -> Array:
    """Eq. 2 as printed: R_0 to R_g."""
    return np.array(
        [[1.0, 0.0, 0.0, L_0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )


def table1(L: list[float], theta: Array) -> list[tuple[float, float, float]]:
    """Table I: (α_i, a_i, θ_i) of the rows 1 to 2n."""
    rows: list[tuple[float, float, float]] = []
    for k in range(len(L)):
        last = k == len(L) - 1
        rows.append((math.radians(90.0), 0.0, theta[2 * k]))
        rows.append((0.0 if last else math.radians(-90.0), L[k], theta[2 * k + 1]))
    return rows


def eq3(geometry: cdsm.Geometry, theta: Array) -> Array:
    """Eq. 3, base to tip: the pose of R_2n in R_g."""
    pose = eq2(geometry.base_length)
    for row in table1([link.length for link in geometry.links], theta):
        pose = pose @ eq1(*row)
    return pose


def elements(geometry: cdsm.Geometry, tag: str) -> dict[str, ET.Element]:
    """The links or joints of the URDF by name, which must be unique."""
    found = ET.fromstring(cdsm.to_urdf(geometry)).findall(tag)
    names = [element.attrib["name"] for element in found]
    assert len(set(names)) == len(names)
    return dict(zip(names, found, strict=True))


def child(element: ET.Element, path: str) -> ET.Element:
    found = element.find(path)
    assert found is not None, f"{path} is missing in {element.attrib}"
    return found


def numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


# --- kinematics -----------------------------------------------------------------------------


@pytest.mark.parametrize("joints", [1, 2, 5])
@pytest.mark.parametrize("seed", range(3))
def test_tip_is_eqs_1_to_4_with_table_1(joints: int, seed: int) -> None:
    arm = random_arm(seed, joints)
    q = np.random.default_rng([seed, joints, 7]).uniform(-1.0, 1.0, arm.nv) * arm.upper
    np.testing.assert_allclose(arm.at(q).tip, eq3(arm.geometry, q), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("name", ARMS)
def test_yourdfpy_and_pinocchio_agree_on_every_link_and_limit(name: str, tmp_path: Path) -> None:
    geometry = ARMS[name]
    path = cdsm.write_urdf(geometry, tmp_path / "arm.urdf")
    model = pin.buildModelFromUrdf(path)
    data = model.createData()
    theirs = yourdfpy.URDF.load(str(path), load_meshes=False)
    assert theirs.validate()
    assert list(model.names)[1:] == theirs.actuated_joint_names
    q = np.random.default_rng(0).uniform(-0.3, 0.3, model.nq)
    pin.framesForwardKinematics(model, data, q)
    theirs.update_cfg(q)
    for link in theirs.link_map:
        np.testing.assert_allclose(
            theirs.get_transform(link, "base_link"),
            data.oMf[model.getFrameId(link)].homogeneous,
            rtol=0.0,
            atol=1e-13,
        )
    both = zip(geometry.joints, geometry.joint_limits, strict=True)
    limits = np.array([limit for joint, limit in both for _ in joint.axes])
    np.testing.assert_array_equal(model.upperPositionLimit, limits)
    np.testing.assert_array_equal(model.lowerPositionLimit, -limits)
    assert (model.upperEffortLimit > 0.0).all()
    assert (model.upperVelocityLimit > 0.0).all()


# --- what is in the file --------------------------------------------------------------------


def test_names_of_a_mixed_arm() -> None:
    links = "base_link base_disk cross1 link1 link2 cross3 link3 tool0"
    assert list(elements(mixed_arm().geometry, "link")) == links.split()
    joints = ["joint1_1", "joint1_2", "joint2", "joint3_1", "joint3_2"]
    assert list(elements(mixed_arm().geometry, "joint"))[1:-1] == joints
    assert mixed_arm().joint_names == tuple(joints)


@pytest.mark.parametrize("name", ["mixed", "taper"])
def test_link_is_a_solid_cylinder_of_the_hole_radius_about_mid_link_or_a_milligram(
    name: str,
) -> None:
    geometry = ARMS[name]
    links = elements(geometry, "link")
    for k, (link, R) in enumerate(zip(geometry.links, geometry.hole_radii, strict=True), start=1):
        inertial = child(links[f"link{k}"], "inertial")
        mass = float(child(inertial, "mass").attrib["value"])
        if link.mass == 0.0:
            assert mass == CROSS_MASS == 1e-6
            continue
        assert mass == link.mass
        origin = child(inertial, "origin").attrib
        assert numbers(origin["xyz"]) == [link.length / 2.0, 0.0, 0.0]
        assert not any(numbers(origin["rpy"]))
        inertia = {key: float(v) for key, v in child(inertial, "inertia").attrib.items()}
        across = link.mass * (3.0 * R**2 + link.length**2) / 12.0
        assert inertia["ixx"] == pytest.approx(link.mass * R**2 / 2.0, rel=1e-15)
        assert inertia["iyy"] == inertia["izz"] == pytest.approx(across, rel=1e-15)
        assert inertia["ixy"] == inertia["ixz"] == inertia["iyz"] == 0.0


def test_disagreement_on_reading_back_is_reported_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    geometry, path, other = mixed_arm().geometry, tmp_path / "arm.urdf", tmp_path / "other.urdf"
    path.write_text("what was there")
    other.write_text(cdsm.to_urdf(geometry.replace(base_length=0.03000001)))
    load = yourdfpy.URDF.load
    monkeypatch.setattr(
        yourdfpy.URDF, "load", staticmethod(lambda _, **options: load(str(other), **options))
    )
    with pytest.raises(cdsm.GeometryError, match="disagree on the pose of the tip by 1e-08"):
        cdsm.write_urdf(geometry, path)
    assert path.read_text() == "what was there"


@pytest.mark.parametrize("name", PRESETS)
def test_shipped_files_are_what_the_generator_writes(name: str, tmp_path: Path) -> None:
    geometry = PRESETS[name]()
    toml = geometry.write(tmp_path / f"{name}.toml")
    urdf = cdsm.write_urdf(geometry, tmp_path / f"{name}.urdf")
    if CHECK_URDF:  # Debian: liburdfdom-tools
        subprocess.run([CHECK_URDF, str(urdf)], capture_output=True, timeout=HANGS, check=True)
    for path in (toml, urdf):
        assert (ROOT / "urdf" / path.name).read_bytes() == path.read_bytes()

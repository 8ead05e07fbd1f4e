"""Geometry: constructors, TOML form, and every fault at once."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import cdsm
from cdsm.support.files import MAXIMUM_BYTES
from tests.support.arms import mixed_arm
from tests.support.strategies import geometries

SIZES: dict[str, Any] = {
    "link_length": 0.04,
    "base_length": 0.02,
    "disk_offset": 0.01,
    "hole_radius": 0.03,
    "link_mass": 0.5,
}
UNIVERSAL: dict[str, Any] = {"joints": 5, "cables_per_joint": 3, **SIZES}
ANGLES: dict[str, Any] = {"cables_per_joint": None}
HINGED: dict[str, Any] = {"joints": 3, "twist": math.radians(30.0), **SIZES}


def general(**changes: Any) -> cdsm.Geometry:
    """A valid two-joint geometry from the general constructor, with some fields replaced."""
    fields: dict[str, Any] = {
        "name": "two",
        "base_length": 0.02,
        "hole_radius": 0.03,
        "joints": (
            cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.01),
            cdsm.Joint(axes=((0.0, 0.0, 1.0),), disk_offset=0.005, limit=0.3),
        ),
        "links": (cdsm.Link(length=0.04, mass=0.5), cdsm.Link(length=0.05, mass=0.0)),
        "cables": (cdsm.CableRoute(joint=2, angle=0.1), cdsm.CableRoute(joint=1, angle=0.2)),
    }
    return cdsm.Geometry(**{**fields, **changes})


# --- constructors ---------------------------------------------------------------------------


@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 3), (4, 4)])
def test_universal_cable_j_of_joint_k_has_the_hole_angle_of_the_formula(n: int, m: int) -> None:
    geometry = cdsm.Geometry.universal(**{**UNIVERSAL, "joints": n, "cables_per_joint": m})
    expected = [
        (k, 2.0 * math.pi * ((k - 1) + n * j) / (n * m)) for k in range(1, n + 1) for j in range(m)
    ]
    assert [cable.joint for cable in geometry.cables] == [k for k, _ in expected]
    assert [cable.angle for cable in geometry.cables] == pytest.approx([a for _, a in expected])


def test_hinge_k_is_turned_by_k_minus_1_twists_and_its_pair_sits_beside_it() -> None:
    twist = math.radians(30.0)
    geometry = cdsm.Geometry.hinged(**HINGED)
    assert len(geometry.cables) == 6
    for k, joint in enumerate(geometry.joints):
        psi = k * twist
        np.testing.assert_allclose(joint.axes, [(0.0, math.cos(psi), math.sin(psi))], atol=1e-15)
        pair = geometry.cables[2 * k : 2 * k + 2]
        assert [cable.joint for cable in pair] == [k + 1, k + 1]
        turns = [(cable.angle - psi) % (2.0 * math.pi) for cable in pair]
        assert turns == pytest.approx([math.pi / 2.0, 3.0 * math.pi / 2.0])


def test_hinged_cables_are_evenly_spread_from_90_degrees_beside_the_axis() -> None:
    geometry = cdsm.Geometry.hinged(**HINGED, cables_per_joint=3)
    angles = [cable.angle for cable in geometry.cables[3:6]]
    psi = math.radians(30.0)
    expected = [psi + math.pi / 2.0 + 2.0 * math.pi * j / 3.0 for j in range(3)]
    assert angles == pytest.approx(expected)


def test_default_limit_is_never_above_80_degrees() -> None:
    geometry = cdsm.Geometry.universal(**{**UNIVERSAL, "hole_radius": 0.001})
    assert geometry.joint_limits == pytest.approx([math.radians(80.0)] * 5)


def test_every_link_has_a_disk_beside_each_of_its_joints() -> None:
    disks = general().disks
    assert [(disk.link, disk.joint) for disk in disks] == [
        *(("base_disk", 1), ("link1", 1)),
        *(("link1", 2), ("link2", 2)),
    ]
    assert [disk.x for disk in disks] == pytest.approx([0.02 - 0.01, 0.01, 0.04 - 0.005, 0.005])


# --- TOML -----------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None, database=None)
@given(geometry=geometries(4))
def test_toml_round_trip_is_exact_and_stable(geometry: cdsm.Geometry) -> None:
    text = geometry.to_toml()
    again = cdsm.Geometry.from_toml(text)
    assert again == geometry
    assert again.to_toml() == text


def test_to_toml_is_plain_toml_that_states_its_units() -> None:
    text = general().to_toml()
    assert tomllib.loads(text)["joints"][1] == {
        "axes": [[0.0, 0.0, 1.0]],
        "disk_offset": 0.005,
        "limit": 0.3,
    }
    assert "Units: m, rad, kg" in text.splitlines()[0]


@pytest.mark.parametrize("kind", ["universal", "hinged"])
def test_short_form_is_the_constructor_of_that_name(kind: str) -> None:
    keywords = {"universal": UNIVERSAL, "hinged": {**HINGED, "cables_per_joint": 4}}[kind]
    lines = [f"[{kind}]", *(f"{key} = {value!r}" for key, value in keywords.items())]
    expected = getattr(cdsm.Geometry, kind)(**keywords)
    assert cdsm.Geometry.from_toml("\n".join(lines)) == expected


@pytest.mark.parametrize("lead", [0.0, 0.3])
def test_friction_is_that_of_every_hole_which_a_cable_passes(lead: float) -> None:
    """The base disk is a hole only if there is a lead before it."""
    geometry = cdsm.Geometry.universal(**UNIVERSAL, lead=lead, friction=0.1)
    assert cdsm.Geometry.from_toml(geometry.to_toml()) == geometry
    assert "friction" not in cdsm.Geometry.universal(**UNIVERSAL, lead=lead).to_toml()
    assert all(route.friction == 0.1 for route in geometry.cables)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(5e4))
    assert arm.has_friction
    for cable, route in zip(arm.cables, geometry.cables, strict=True):
        assert cable.friction == (0.1,) * (2 * route.joint - (1 if lead else 2))
        assert [site.friction for site in cable.sites][-1] == 0.0
    assert not cdsm.Manipulator(general(), cdsm.LinearElasticity(5e4)).has_friction


# --- faults ---------------------------------------------------------------------------------


def raises(said: str, make: Any, *args: Any, **keywords: Any) -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        make(*args, **keywords)
    assert said in str(caught.value)
    # a cluster pickles the context too, which pydantic's error cannot be
    assert isinstance(caught.value.__context__, cdsm.GeometryError | None)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"hole_radius": 0.0}, "hole_radius: 0 m given; 1e-06 to 10000 m is needed"),
        ({"friction": 2.5}, "friction: 2.5 given; 0, or 1e-06 to 2 is needed"),
        ({"link_length": math.nan}, "link_length: input should be a finite number, but is nan"),
        ({"joints": 101}, "joints: input should be less than or equal to 100, but is 101"),
        ({"joint_limit": 4.0}, "joint_limit: input should be less than or equal to 3.14"),
        ({"spread": 15.0}, "spread: 15 rad given; at most one turn; convert degrees to radians"),
        ({"name": "my arm"}, "name: 'my arm' given; up to 64 of"),
        ({"hole_radious": 0.03}, "hole_radious: is not a key that is known here; did you mean"),
        ({"link_length": 0.019}, "disk_offset: too large: link 1 is 0.019 m long, its disks need"),
        ({"hole_radius": [0.02, 0.01]}, "hole_radius: 2 values given for 5 joints; give one"),
        ({"link_mass": [0.1, 0.1, -0.1, 0.1, 0.1]}, "link_mass[3]: -0.1 kg given"),
        ({"phase": [0.1, "b", 0.1, 0.1, 0.1]}, "phase[2]: input should be a valid number"),
        ({"cables_per_joint": None}, "cables_per_joint: give it, or hole_angles, and not both"),
        ({**ANGLES, "hole_angles": [[0.1], [0.2]]}, "hole_angles: 2 values given for 5 joints"),
        ({**ANGLES, "hole_angles": [[0.1], 0.2]}, "hole_angles[2]: input should be"),
        ({"disk_radius": 0.03}, "disk_radius: too small: at joint 1 it is 0.03 m"),
        ({"cable_radius": 0.04, "disk_radius": 0.035}, "the farthest hole is at 0.04 m"),
    ],
)
def test_faults_of_uniform_arms_are_named(changes: dict[str, Any], said: str) -> None:
    raises(said, cdsm.Geometry.universal, **{**UNIVERSAL, **changes})


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (((0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), "axes[2]: has no length; give a direction"),
        (((0.0, 0.0, 1.0), (0.0, 0.0, -2.0)), "are parallel"),
        (((0.0, math.nan, 1.0),), "axes[1][2]"),
    ],
)
def test_joint_axes_must_be_one_or_two_independent_directions(axes: Any, said: str) -> None:
    raises(said, cdsm.Joint, axes=axes, disk_offset=0.01)


def test_all_faults_are_listed_at_once() -> None:
    faulty = {"joints": 101, "link_length": 0, "hole_radius": -1, "link_mass": -1, "lead": math.nan}
    with pytest.raises(cdsm.GeometryError, match="invalid geometry") as caught:
        cdsm.Geometry.universal(**{**UNIVERSAL, **faulty})
    assert [fault.split(":")[0] for fault in caught.value.faults] == list(faulty)
    with pytest.raises(cdsm.GeometryError) as caught:
        general(
            links=(cdsm.Link(length=0.001, mass=0.5), cdsm.Link(length=0.002, mass=0.0)),
            cables=(cdsm.CableRoute(joint=1, angle=0.0), cdsm.CableRoute(joint=9, angle=0.0)),
        )
    starts = [fault.split(":")[0] for fault in caught.value.faults]
    assert starts == ["disk_offset", "cables[2].joint"]


# what is replaced in a TOML text, and what the message must say
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("hole_radius", "zzz", "hole_radius: is missing"),
        ("angle = 0.1", "angel = 0.1", "cables[1].angel: is not a key"),
        ("base_length = 0.02", "base_length = 1e999", "base_length: input should be a finite"),
        ("[[0.0, 0.0, 1.0]]", "[[0.0, 0.0]]", "joints[2].axes[1][3]: is missing"),
        ("joint = 2", "joint = 7", "cables[1].joint: 7 is past the last joint, 2; give 1 to 2"),
        ("name =", "b = = 3\nname =", "is not TOML: "),
    ],
)
def test_faults_of_toml_are_named(old: str, new: str, said: str) -> None:
    text = general().to_toml()
    assert old in text
    raises(said, cdsm.Geometry.from_toml, text.replace(old, new, 1))


NOT_A_GEOMETRY = {
    "": "holds nothing; give [universal], ",
    "name = 'a'\nname = 'b'": "is not TOML",
    "a = " + "[" * 100_000: "is not TOML",
    "\n".join(f"[{'.'.join(['a'] * n)}]" for n in range(1, 400)): "",
    'name = "a"\n[universal]\njoints = 3\n': "name: stands outside [universal]",
    '[[cables]]\nname = "a"\n': "holds cables; give [universal], ",
}


@pytest.mark.parametrize("text", NOT_A_GEOMETRY)
def test_text_that_is_no_geometry_is_a_geometry_error(text: str) -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.from_toml(text, source="arm.toml")
    assert str(caught.value).startswith("arm.toml: ")
    assert NOT_A_GEOMETRY[text] in str(caught.value)
    assert len(str(caught.value)) < 2000


# --- files ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, r"does not exist.*looked in"),
        (b"name = '\xff'", r"not UTF-8 text \(byte 8\)"),
        ("name = 'arm'".encode("utf-16"), r"not UTF-8 text \(byte 0\); save it as UTF-8"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is a binary file; a text file is needed"),
        (b" " * (MAXIMUM_BYTES + 1), f"larger than the {MAXIMUM_BYTES} bytes"),
    ],
)
def test_file_that_cannot_be_read_is_a_file_error(
    content: bytes | None, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "arm.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(cdsm.FileError, match=said) as caught:
        cdsm.Geometry.read(path)
    assert caught.value.path == str(path)


def test_failed_write_leaves_the_earlier_file_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = general().write(tmp_path / "arm.toml")
    before = path.read_bytes()

    def full(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(cdsm.FileError, match="No space left on device"):
        mixed_arm().geometry.write(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["arm.toml"]

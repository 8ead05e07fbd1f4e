"""Geometry: constructors, TOML form, and every fault at once."""

import math
import tomllib
import warnings
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


def test_universal_holes_of_the_base_disk_are_evenly_spread() -> None:
    angles = sorted(cable.angle for cable in cdsm.Geometry.universal(**UNIVERSAL).cables)
    assert np.diff([*angles, angles[0] + 2.0 * math.pi]) == pytest.approx(2.0 * math.pi / 15)


def test_universal_axes_are_y_then_z() -> None:
    geometry = cdsm.Geometry.universal(**UNIVERSAL)
    assert {joint.axes for joint in geometry.joints} == {((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}


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


def test_long_hinged_arm_has_angles_of_many_turns_and_no_doubt_about_them() -> None:
    sizes: dict[str, Any] = {
        "link_length": 0.06,
        "base_length": 0.03,
        "disk_offset": 0.005,
        "hole_radius": 0.02,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm = cdsm.Geometry.hinged(
            joints=30, twist=math.pi / 2, link_mass=0.05, spread=math.radians(6.0), **sizes
        )
    np.testing.assert_allclose(arm.joints[29].axes[0], (0.0, 0.0, 1.0), atol=1e-14)
    assert max(cable.angle for cable in arm.cables) > 8.0 * math.pi


def test_hinged_cables_are_evenly_spread_from_90_degrees_beside_the_axis() -> None:
    geometry = cdsm.Geometry.hinged(**HINGED, cables_per_joint=3)
    angles = [cable.angle for cable in geometry.cables[3:6]]
    psi = math.radians(30.0)
    expected = [psi + math.pi / 2.0 + 2.0 * math.pi * j / 3.0 for j in range(3)]
    assert angles == pytest.approx(expected)


def test_uniform_arms_repeat_their_sizes() -> None:
    geometry = cdsm.Geometry.universal(**UNIVERSAL, lead=0.7, joint_limit=0.4, name="snake")
    assert geometry.name == "snake"
    assert geometry.links == (cdsm.Link(length=0.04, mass=0.5),) * 5
    assert {cable.lead for cable in geometry.cables} == {0.7}
    assert geometry.joint_limits == (0.4,) * 5
    assert geometry.length == pytest.approx(0.02 + 5 * 0.04)


def test_default_limit_is_where_the_disks_touch() -> None:
    geometry = cdsm.Geometry.universal(**UNIVERSAL)
    assert geometry.joint_limits == pytest.approx([2.0 * math.atan(0.01 / 0.03)] * 5)


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


def test_general_constructor_takes_joints_links_and_cables_that_differ() -> None:
    geometry = mixed_arm().geometry
    assert [len(joint.axes) for joint in geometry.joints] == [2, 1, 2]
    assert geometry.joint_limits[1:] == (0.5, 0.4)
    assert [cable.joint for cable in geometry.cables] == [1, 1, 1, 2, 2, 3, 3, 3, 3]
    assert "5 degrees of freedom" in str(geometry)


def test_numpy_numbers_and_arrays_and_lists_are_accepted() -> None:
    plain = cdsm.Geometry.universal(**UNIVERSAL)
    numpy = {key: np.float64(value) for key, value in SIZES.items()}
    assert cdsm.Geometry.universal(joints=np.int64(5), cables_per_joint=3, **numpy) == plain  # type: ignore[arg-type]
    listed = cdsm.Joint(axes=[np.array([0.0, 1.0, 0.0])], disk_offset=0.01)  # type: ignore[arg-type]
    assert listed == cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.01)


def test_equal_geometries_are_equal_and_hash_alike() -> None:
    assert len({cdsm.Geometry.universal(**UNIVERSAL), cdsm.Geometry.universal(**UNIVERSAL)}) == 1


# --- TOML -----------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None, database=None)
@given(geometry=geometries(4))
def test_toml_round_trip_is_exact_and_stable(geometry: cdsm.Geometry) -> None:
    text = geometry.to_toml()
    again = cdsm.Geometry.from_toml(text)
    assert again == geometry
    assert again.to_toml() == text


def test_written_file_reads_back_equal(tmp_path: Path) -> None:
    geometry = mixed_arm().geometry
    path = geometry.write(tmp_path / "arm.toml")
    assert cdsm.Geometry.read(path) == geometry
    assert path.read_bytes() == geometry.to_toml().encode()
    assert [entry.name for entry in tmp_path.iterdir()] == ["arm.toml"]


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


def test_short_form_hinged_defaults_to_pairs_as_the_constructor_does() -> None:
    lines = ["[hinged]", *(f"{key} = {value!r}" for key, value in HINGED.items())]
    assert cdsm.Geometry.from_toml("\n".join(lines)) == cdsm.Geometry.hinged(**HINGED)


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


def test_integers_stand_for_lengths_in_toml() -> None:
    text = general().to_toml().replace("base_length = 0.02", "base_length = 0")
    assert cdsm.Geometry.from_toml(text).base_length == 0.0


# --- faults ---------------------------------------------------------------------------------

# what is replaced in a universal arm, and what the message must say: key, value, what is allowed
FAULTS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "hole radius zero": ({"hole_radius": 0.0}, ["hole_radius", "0 m given", "1e-06 to 10000 m"]),
    "hole radius negative": (
        {"hole_radius": -0.03},
        ["hole_radius", "-0.03 m given", "1e-06 to"],
    ),
    "zero-length link": ({"link_length": 0.0}, ["link_length", "0 m given", "1e-06 to 10000 m"]),
    "negative mass": ({"link_mass": -0.5}, ["link_mass", "-0.5 kg given", "0, or 1e-09 to"]),
    "negative lead": ({"lead": -1.0}, ["lead", "-1 m given", "0, or 1e-06 to 10000 m"]),
    "negative base": ({"base_length": -1.0}, ["base_length", "-1 m given", "0, or 1e-06 to"]),
    "no disk offset": ({"disk_offset": 0.0}, ["disk_offset", "0 m given", "1e-06 to 10000 m"]),
    "101 joints": ({"joints": 101}, ["joints", "less than or equal to 100", "101"]),
    "no joints": ({"joints": 0}, ["joints", "greater than or equal to 1", "0"]),
    "no cables": ({"cables_per_joint": 0}, ["cables_per_joint", "greater than or equal to 1"]),
    "65 cables": ({"cables_per_joint": 65}, ["cables_per_joint", "less than or equal to 64"]),
    "friction negative": ({"friction": -0.1}, ["friction", "-0.1 given", "0, or 1e-06 to 2 is"]),
    "friction above 2": ({"friction": 2.5}, ["friction", "2.5 given", "0, or 1e-06 to 2 is"]),
    "friction NaN": ({"friction": math.nan}, ["friction", "finite", "nan"]),
    "friction per joint": ({"friction": [0.1, 0.2]}, ["friction: 2 values given for 5"]),
    "NaN": ({"link_length": math.nan}, ["link_length", "finite", "nan"]),
    "infinite": ({"link_mass": math.inf}, ["link_mass", "finite", "inf"]),
    "text for a number": ({"link_length": "0.04"}, ["link_length", "valid number", "'0.04'"]),
    "bool for a number": ({"link_mass": True}, ["link_mass", "valid number", "True"]),
    "fraction for a count": ({"joints": 2.5}, ["joints", "valid integer", "2.5"]),
    "list for a number": ({"base_length": [1.0]}, ["base_length", "valid number", "[1.0]"]),
    "no number": ({"base_length": None}, ["base_length", "valid number", "None"]),
    "limit zero": ({"joint_limit": 0.0}, ["joint_limit", "greater than 0", "0.0"]),
    "limit above pi": ({"joint_limit": 4.0}, ["joint_limit", "less than or equal to 3.14", "4.0"]),
    "bad name": ({"name": "my arm"}, ["name", "letter first", "'my arm'"]),
    "number for a name": ({"name": 3}, ["name", "valid string", "3"]),
    "overlapping disks": (
        {"link_length": 0.019},
        ["disk_offset: too large", "0.019 m", "0.02 m; and 3 more; lower disk_offset"],
    ),
    "touching disks": (
        {"link_length": 0.02},
        ["disk_offset: too large: link 1", "more than 0.02 m"],
    ),
    "last disk beyond the tip": (
        {"joints": 1, "link_length": 0.01},
        ["disk_offset: too large: link 1", "its disk needs more than 0.01 m"],
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_fault_names_key_value_and_what_is_allowed(case: str) -> None:
    changes, expected = FAULTS[case]
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.universal(**{**UNIVERSAL, **changes})
    for part in expected:
        assert part in str(caught.value)
    assert caught.value.__context__ is None  # a cluster pickles it too; pydantic's error cannot be


GENERAL_FAULTS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "cable past the last link": (
        {"cables": (cdsm.CableRoute(joint=3, angle=0.0),)},
        ["cables[1].joint", "3 is past the last joint", "give 1 to 2"],
    ),
    "links for joints": (
        {"links": (cdsm.Link(length=0.04, mass=0.5),)},
        ["links: 1 given for 2 joints"],
    ),
    "101 joints": (
        {"joints": (cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.01),) * 101},
        ["joints", "100", "101"],
    ),
    "no joints": ({"joints": (), "links": ()}, ["joints", "at least 1"]),
    "no cables": ({"cables": ()}, ["cables", "at least 1"]),
    "not a joint": ({"joints": (1, 2)}, ["joints[1]", "joints[2]", "Joint"]),
    "not a list": ({"links": 3}, ["links", "3"]),
    "unknown key": ({"hole_radious": 0.1}, ["hole_radious", "did you mean hole_radius?"]),
    "second link too short": (
        {"links": (cdsm.Link(length=0.04, mass=0.5), cdsm.Link(length=0.005, mass=0.0))},
        ["link 2 is 0.005 m long, its disk needs more than 0.005 m"],
    ),
}


@pytest.mark.parametrize("case", GENERAL_FAULTS)
def test_general_constructor_names_the_fault(case: str) -> None:
    changes, expected = GENERAL_FAULTS[case]
    with pytest.raises(cdsm.GeometryError) as caught:
        general(**changes)
    for part in expected:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        (((0.0, 0.0, 0.0),), "axes[1]: (0.0, 0.0, 0.0) has no usable length"),
        (((0.0, 0.0, 1.0), (0.0, 0.0, -2.0)), "parallel"),
        (((0.0, 1.0),), "axes[1][3]"),
        (((0.0, math.nan, 1.0),), "axes[1][2]"),
        (((0.0, 0.0, 1.0),) * 3, "at most 2"),
        ((), "at least 1"),
    ],
)
def test_joint_axes_must_be_one_or_two_independent_directions(axes: Any, expected: str) -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Joint(axes=axes, disk_offset=0.01)
    assert expected in str(caught.value)


def test_every_fault_is_listed_at_once() -> None:
    faulty = {"joints": 101, "link_length": 0, "hole_radius": -1, "link_mass": -1, "lead": math.nan}
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.universal(**{**UNIVERSAL, **faulty})
    assert [fault.split(":")[0] for fault in caught.value.faults] == list(faulty)
    assert len(caught.value.faults) == 5
    assert all(fault in str(caught.value) for fault in caught.value.faults)


def test_faults_between_fields_are_listed_together() -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        general(
            links=(cdsm.Link(length=0.001, mass=0.5), cdsm.Link(length=0.002, mass=0.0)),
            cables=(cdsm.CableRoute(joint=1, angle=0.0), cdsm.CableRoute(joint=9, angle=0.0)),
        )
    starts = [fault.split(":")[0] for fault in caught.value.faults]
    assert starts == ["disk_offset", "cables[2].joint"]


# what is replaced in a TOML text, and what the message must say
TOML_FAULTS: dict[str, tuple[str, str, list[str]]] = {
    "unknown key": ("hole_radius", "hole_radious", ["hole_radious", "did you mean hole_radius?"]),
    "unknown key far off": ("hole_radius", "zzz", ["zzz: is not a key", "hole_radius: is missing"]),
    "NaN": ("base_length = 0.02", "base_length = nan", ["base_length", "finite", "nan"]),
    "overflow": ("base_length = 0.02", "base_length = 1e999", ["base_length", "finite", "inf"]),
    "text": ("base_length = 0.02", 'base_length = "x"', ["base_length", "valid number", "'x'"]),
    "date": ("base_length = 0.02", "base_length = 1979-05-27", ["base_length", "number"]),
    "bool": ("base_length = 0.02", "base_length = true", ["base_length", "number", "True"]),
    "two numbers": ("[[0.0, 0.0, 1.0]]", "[[0.0, 0.0]]", ["joints[2].axes[1][3]", "missing"]),
    "parallel": (
        "[[0.0, 0.0, 1.0]]",
        "[[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]",
        ["joints[2].axes", "parallel"],
    ),
    "past the last joint": ("joint = 2", "joint = 7", ["cables[1].joint", "7", "1 to 2"]),
    "fraction": ("joint = 2", "joint = 2.5", ["cables[1].joint", "integer", "2.5"]),
    "huge integer": ("joint = 2", f"joint = 1{'0' * 40}", ["cables[1].joint", "1 to 2"]),
}


@pytest.mark.parametrize("case", TOML_FAULTS)
def test_toml_fault_names_key_value_and_what_is_allowed(case: str) -> None:
    old, new, expected = TOML_FAULTS[case]
    text = general().to_toml()
    assert old in text
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.from_toml(text.replace(old, new, 1))
    for part in expected:
        assert part in str(caught.value)


def test_unknown_key_inside_a_table_has_a_near_match() -> None:
    text = general().to_toml().replace("angle = 0.1", "angel = 0.1")
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.from_toml(text)
    assert "cables[1].angel" in str(caught.value)
    assert "did you mean angle?" in str(caught.value)


def test_unknown_key_in_the_short_form_has_a_near_match() -> None:
    lines = ["[universal]", *(f"{key} = {value!r}" for key, value in UNIVERSAL.items())]
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.from_toml("\n".join(lines).replace("link_length", "link_lenght"))
    assert "link_lenght" in str(caught.value)
    assert "did you mean link_length?" in str(caught.value)


NOT_A_GEOMETRY = {
    "empty": "",
    "not TOML": "joints = [[",
    "twice the same key": "name = 'a'\nname = 'b'",
    "NUL": 'name = "a\x00"',
    "nested 100 000 deep": "a = " + "[" * 100_000,
    "nested 100 000 deep, closed": "a = " + "[" * 100_000 + "]" * 100_000,
    "nested 300 deep": "joints = " + "[" * 300 + "]" * 300,
    "nested tables": "\n".join(f"[{'.'.join(['a'] * n)}]" for n in range(1, 400)),
    "short form that is no table": "universal = 3",
    "outside the table": 'name = "a"\n[universal]\njoints = 3\n',
    "a file of cables": '[[cables]]\nname = "a"\n',
    "two short forms": "[universal]\n[hinged]\n",
    "short form empty": "[hinged]",
    "joints a number": "joints = 3",
    "joints a table": "[joints]\na = 1",
}


@pytest.mark.parametrize("case", NOT_A_GEOMETRY)
def test_text_that_is_no_geometry_is_a_geometry_error(case: str) -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.from_toml(NOT_A_GEOMETRY[case], source="arm.toml")
    assert str(caught.value).startswith("arm.toml: ")
    assert caught.value.source == "arm.toml"
    assert len(str(caught.value)) < 2000


def test_what_is_no_geometry_says_what_to_do() -> None:
    for case, said in (
        ("outside the table", r"name: stands outside \[universal\].*move it in"),
        ("a file of cables", "holds cables but no joints"),
    ):
        with pytest.raises(cdsm.GeometryError, match=said):
            cdsm.Geometry.from_toml(NOT_A_GEOMETRY[case])


def test_broken_toml_says_where() -> None:
    with pytest.raises(cdsm.GeometryError, match=r"not TOML.*line 2"):
        cdsm.Geometry.from_toml("name = 'a'\nb = = 3\n")


@pytest.mark.parametrize("text", [3, None, b"name = 'a'"])
def test_from_toml_refuses_what_is_not_text(text: Any) -> None:
    with pytest.raises(cdsm.CdsmError):
        cdsm.Geometry.from_toml(text)


# --- files ----------------------------------------------------------------------------------


def test_missing_file_says_where_it_was_looked_for(tmp_path: Path) -> None:
    with pytest.raises(cdsm.FileError, match="does not exist") as caught:
        cdsm.Geometry.read(tmp_path / "arm.toml")
    assert caught.value.path == str(tmp_path / "arm.toml")
    assert str(Path.cwd()) in str(caught.value)


def test_folder_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(cdsm.FileError, match="directory"):
        cdsm.Geometry.read(tmp_path)


def test_file_that_is_not_utf8_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(cdsm.FileError, match=r"not UTF-8 text \(byte 8\)"):
        cdsm.Geometry.read(path)
    path.write_text("name = 'arm'", encoding="utf-16")
    with pytest.raises(cdsm.FileError, match=r"not UTF-8 text \(byte 0\); save it as UTF-8"):
        cdsm.Geometry.read(path)


def test_picture_is_refused_as_binary(tmp_path: Path) -> None:
    path = tmp_path / "arm.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(cdsm.FileError, match="is a binary file; a text file is needed"):
        cdsm.Manipulator.read(path)


def test_file_that_is_too_large_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    with path.open("wb") as file:
        file.truncate(MAXIMUM_BYTES + 1)
    with pytest.raises(cdsm.FileError, match=f"larger than the {MAXIMUM_BYTES} bytes"):
        cdsm.Geometry.read(path)


@pytest.mark.parametrize("path", ["a\0b", "x" * 5000, ""])
def test_path_that_cannot_be_is_a_file_error(path: str) -> None:
    with pytest.raises(cdsm.FileError):
        cdsm.Geometry.read(path)


@pytest.mark.parametrize("path", [3, None, 2.5])
def test_path_of_the_wrong_type_is_a_cdsm_error(path: Any) -> None:
    with pytest.raises(cdsm.CdsmError):
        cdsm.Geometry.read(path)
    with pytest.raises(cdsm.CdsmError):
        general().write(path)


def test_faults_of_a_file_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("[universal]\njoints = 0\n")
    with pytest.raises(cdsm.GeometryError) as caught:
        cdsm.Geometry.read(path)
    assert caught.value.source == str(path)
    assert str(path) in str(caught.value)
    assert len(caught.value.faults) == 6


def test_writing_into_a_missing_folder_says_so(tmp_path: Path) -> None:
    folder = tmp_path / "nowhere"
    with pytest.raises(cdsm.FileError, match="does not exist; create it"):
        general().write(folder / "arm.toml")
    assert not folder.exists()


def test_writing_onto_a_folder_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").mkdir()
    with pytest.raises(cdsm.FileError, match="not a regular file"):
        general().write(tmp_path / "arm.toml")
    assert [entry.name for entry in tmp_path.iterdir()] == ["arm.toml"]


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


def test_written_file_has_the_mode_of_a_plain_open(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    path = general().write(tmp_path / "arm.toml")
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode

"""What is no geometry: every fault is named, all at once, in Python and in files."""

import math
from pathlib import Path
from typing import Any

import pytest

import cdsm
from cdsm.support.files import MAXIMUM_BYTES
from tests.core.test_geometry import universal


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


def raises(said: str, make: Any, *args: Any, **keywords: Any) -> str:
    with pytest.raises(cdsm.GeometryError) as caught:
        make(*args, **keywords)
    assert said in str(caught.value)
    # a cluster pickles the context too, which pydantic's error cannot be
    assert isinstance(caught.value.__context__, cdsm.GeometryError | None)
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"hole_radius": 0.0}, "hole_radius: 0 m given; 1e-06 to 10000 m"),
        ({"friction": 2.5}, "friction: 2.5"),
        ({"link_length": math.nan}, "link_length: input should be a finite"),
        ({"joint_limit": 4.0}, "joint_limit"),
        ({"spread": 15.0}, "spread: 15 rad given; at most one turn; convert degrees"),
        ({"name": "my arm"}, "name: 'my arm'"),
        ({"hole_radious": 0.03}, "did you mean"),
        ({"link_length": 0.015}, "disk_offset: too large: link 1"),
        ({"hole_radius": [0.02, 0.01]}, "hole_radius: 2 values given for 3 joints"),
        ({"link_mass": [0.1, 0.1, -0.1]}, "link_mass[3]: -0.1 kg"),
        ({"phase": [0.1, "b", 0.1]}, "phase[2]"),
        ({"cables_per_joint": None}, "cables_per_joint: give it, or hole_angles"),
        ({"hole_angles": [[0.1], [0.2]]}, "hole_angles: 2 values given for 3 joints"),
        ({"hole_angles": [[0.1], 0.2]}, "hole_angles[2]"),
        ({"disk_radius": 0.02}, "disk_radius: too small: at joint 1"),
        ({"cable_radius": 0.04, "disk_radius": 0.035}, "farthest hole"),
    ],
)
def test_faults_of_uniform_arms_are_named(changes: dict[str, Any], said: str) -> None:
    raises(said, universal, **changes)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (((0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), "axes[2]: has no length"),
        (((0.0, 0.0, 1.0), (0.0, 0.0, -2.0)), "parallel"),
        (((0.0, math.nan, 1.0),), "axes[1][2]"),
    ],
)
def test_joint_axes_must_be_one_or_two_independent_directions(axes: Any, said: str) -> None:
    raises(said, cdsm.Joint, axes=axes, disk_offset=0.01)


def test_all_faults_are_listed_at_once() -> None:
    faulty = {"joints": 101, "link_length": 0, "hole_radius": -1, "link_mass": -1, "lead": math.nan}
    with pytest.raises(cdsm.GeometryError) as caught:
        universal(**faulty)
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
        ("joint = 2", "joint = 7", "cables[1].joint: 7 is past the last joint, 2"),
        ("name =", "b = = 3\nname =", "is not TOML"),
    ],
)
def test_faults_of_toml_are_named(old: str, new: str, said: str) -> None:
    text = general().to_toml()
    assert old in text
    assert "Units: m, rad, kg" in text.splitlines()[0]
    raises(said, cdsm.Geometry.from_toml, text.replace(old, new, 1))


NOT_A_GEOMETRY = {
    "": "holds nothing; give [universal], ",
    "a = " + "[" * 100_000: "is not TOML",
    "\n".join(f"[{'.'.join(['a'] * n)}]" for n in range(1, 400)): "",
    'name = "a"\n[universal]\njoints = 3\n': "name: stands outside [universal]",
    '[[cables]]\nname = "a"\n': "holds cables; give [universal], ",
}


@pytest.mark.parametrize("text", NOT_A_GEOMETRY)
def test_text_that_is_no_geometry_is_a_geometry_error(text: str) -> None:
    said = raises(NOT_A_GEOMETRY[text], cdsm.Geometry.from_toml, text, source="arm.toml")
    assert said.startswith("arm.toml: ")
    assert len(said) < 2000


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "does not exist"),
        (b"name = '\xff'", r"not UTF-8 text \(byte 8\)"),
        ("name = 'arm'".encode("utf-16"), r"not UTF-8 text \(byte 0\); save it as UTF-8"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "binary"),
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
    with pytest.raises(cdsm.FileError, match="directory"):
        cdsm.Geometry.read(tmp_path)

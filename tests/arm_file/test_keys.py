"""The reference of ARM.toml names every key: its table is made of the records of the keys."""

from dataclasses import fields
from inspect import signature
from pathlib import Path

import pytest

import cdsm
from cdsm.arm_file.model import ArmFile, Urdf
from cdsm.cable import SETTINGS
from cdsm.geometry.beams import Section
from cdsm.tolerances import sources
from docs import arm_keys

DOCS = Path(__file__).parents[2] / "docs"
SNAKE = Path(__file__).parents[1] / "data" / "snake.toml"
EXAMPLE = Path(__file__).parents[2] / "examples" / "arm.toml"


def test_the_page_has_every_key() -> None:
    table = arm_keys.table()
    assert table in (DOCS / "guide" / "arm_file.md").read_text(encoding="utf-8")
    keys = {row.split(" | ")[1].strip("`") for row in table.splitlines()[2:]}
    hidden = {"geometry", "original_length"}  # one is no key of people, one is of older files
    expected = {field.name for field in fields(ArmFile)} - hidden
    expected |= {field.name for record in (Urdf, Section) for field in fields(record)}
    expected |= {*SETTINGS, *sources(), "name", "lead", "sites", "link", "xyz", "wrap", "friction"}
    for form in (cdsm.Geometry.universal, cdsm.Geometry.hinged, cdsm.Geometry.backbone):
        expected |= {*signature(form).parameters}
    assert expected - keys == set()
    assert all(row.split(" | ")[2].strip(" |") for row in table.splitlines()[2:])


def test_a_key_beside_its_table_is_told_where_it_belongs() -> None:
    with pytest.raises(cdsm.FileError, match=r"it is one of sections\.1\.universal, sections\.2"):
        cdsm.Manipulator.read(SNAKE, changes={"link_mass": -0.1})
    with pytest.raises(cdsm.FileError, match="did you mean 'minimum'"):
        cdsm.Manipulator.read(SNAKE, changes={"minimun": 5})
    with pytest.raises(cdsm.FileError, match="only 1, 2; tables are counted from 1"):
        cdsm.Manipulator.read(SNAKE, changes={"sections": {"0": {"phase": 0.1}}})


def test_changes_take_tables_or_keys_with_dots() -> None:
    nested = cdsm.Manipulator.read(EXAMPLE, changes={"universal": {"hole_radius": 0.03}})
    dotted = cdsm.Manipulator.read(EXAMPLE, changes={"universal.hole_radius": 0.03, "minimum": 4.0})
    assert dotted.geometry == nested.geometry
    assert dotted.cables[0].minimum == 4.0


def test_a_number_of_joints_at_the_top_is_told_its_table(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text("joints = 4\nwire = 36.8e3\n")
    with pytest.raises(cdsm.CdsmError, match=r"below \[universal\]"):
        cdsm.Manipulator.read(file)

"""Cables as TOML: there and back, and every fault of a file by name."""

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

import cdsm
from cdsm import presets

TABLE = cdsm.TabulatedElasticity((0.0, 10.0, 30.0), (0.0, 1e-3, 2e-3))

ONE = """
[wires.rope]
kind = "linear"
rigidity = 48e3

[[cables]]
name = "left"
wire = "rope"
sites = [{link = "a", xyz = [0, 0.01, 0.0]}, {link = "b", xyz = [0.1, 0.01, 0.0]}]
"""


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    cables = list(presets.virtual_prototype().cables)
    cables[1] = replace(cables[1], elasticity=TABLE, series_stiffness=1.89e3, lead=0.25)
    cables[2] = replace(cables[2], elasticity=cdsm.LinearElasticity(1e4), control="force")
    cables[3] = replace(cables[3], minimum=2.5, maximum=310.0, name=' 😀="n"\\ü')
    path = cdsm.write_cables(cables, tmp_path / "cables.toml")
    assert cdsm.read_cables(path) == tuple(cables)
    # one table per wire that has neither a name nor a constant rigidity
    assert path.read_text(encoding="utf-8").count("\n[wires.") == 1


def test_what_is_left_out_is_nothing_and_friction_of_a_cable_is_that_of_its_holes(
    tmp_path: Path,
) -> None:
    path = tmp_path / "cables.toml"
    path.write_text(ONE, encoding="utf-8")
    (cable,) = cdsm.read_cables(path)
    sites = (cdsm.Site("a", (0.0, 0.01, 0.0)), cdsm.Site("b", (0.1, 0.01, 0.0)))
    assert cable == cdsm.Cable("left", sites, cdsm.LinearElasticity(48e3))
    assert (cable.lead, cable.series_stiffness, cable.minimum) == (0.0, math.inf, 0.0)
    assert math.isinf(cable.maximum)
    third = '{link = "c", xyz = [0.2, 0.01, 0.0]}]'
    text = ONE.replace("sites =", "friction = 0.1\nlead = 0.2\nsites =")
    text = text.replace("0.01, 0.0]}]", "0.01, 0.0], wrap = 0.05, friction = 0.3}, " + third)
    path.write_text(text)
    (cable,) = cdsm.read_cables(path)
    assert [site.friction for site in cable.sites] == [0.1, 0.3, 0.0]
    assert (cable.sites[1].wrap, cable.friction) == (0.05, (0.1, 0.3))
    assert cdsm.read_cables(cdsm.write_cables([cable], path)) == (cable,)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('wire = "rope"', "wire = -3.0", "cables[1].wire: -3 N given"),
        ("48e3", "-1.0", "wires.rope.rigidity"),
        ('kind = "linear"', 'kind = "rubber"', "wires.rope.kind: must be one of linear"),
        ("[0, 0.01, 0.0]", "[0, nan, 0.0]", "sites[1].xyz[2]"),
        ("[0, 0.01, 0.0]", "[0, 0.01]", "sites[1].xyz[3]: is missing"),
        ('name = "left"', 'name = "left"\nminimum = 5.0\nmaximum = 2.0', "maximum: 2 N given"),
        ('name = "left"', 'name = "left"\nfriction = 2.5', "cables[1].friction: 2.5 given"),
        ("{link", "{friction = 0.1, link", "site 1 has friction or wrap"),
    ],
)
def test_faults_are_named(before: str, after: str, said: str, tmp_path: Path) -> None:
    assert before in ONE
    (tmp_path / "cables.toml").write_text(ONE.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(cdsm.FileError, match=f"cables.toml(?s:.*){re.escape(said)}"):
        cdsm.read_cables(tmp_path / "cables.toml")
    with pytest.raises(cdsm.FileError) as error:
        cdsm.read_cables(tmp_path / "cables.toml")
    assert "at least 2 items" not in str(error.value)

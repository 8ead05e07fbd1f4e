"""Ropes by construction and diameter: EA, scatter, breaking force, names, files."""

import json
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.cable import largest_share
from cdsm.tolerancing.budget import known_tolerances
from cdsm.wires.catalogue import as_wire, diameter_of, label
from cdsm.wires.ropes import ROPES, breaking_force, construction_of, describe
from tests.cli.test_commands import call, told


@pytest.mark.parametrize(
    ("name", "rigidity", "breaking"),
    [
        ("7x7-0.8mm", 36.77e3, 389.9),  # 57.46 GPa d^2; 0.388 * 1570 N/mm2 * d^2
        ("7x19-1.5mm", 95.76e3, 1278.8),
        ("1x19-1mm", 88.51e3, 824.7),
        ("1x7-1mm", 93.81e3, 844.0),
        ("uhmwpe-1mm", 70.41e3, 1059.0),
    ],
)
def test_ropes_have_the_numbers_of_their_sources(
    name: str, rigidity: float, breaking: float, tmp_path: Path
) -> None:
    law = as_wire(name)
    assert float(law.rigidity(10.0)) == pytest.approx(rigidity, rel=2e-4)
    assert breaking_force(law) == pytest.approx(breaking, rel=2e-4)
    assert label(law) == name
    assert diameter_of(law) == pytest.approx(float(name.split("-")[1].removesuffix("mm")) / 1e3)
    for same in (law, law.scaled(1.1)):
        assert cdsm.Elasticity.read(same.write(tmp_path / "wire.toml")) == same
    row = construction_of(law)
    assert row is not None
    for text in (f"{rigidity / 1e3:.4g} kN", f"{100 * row.scatter:g} %", row.source):
        assert text in describe(law)


def test_every_rope_has_sources_and_a_modulus_below_that_of_its_wires() -> None:
    for row in ROPES.values():
        assert "EA" in row.source
        assert "strength" in row.source
        assert 0.4 < row.area < np.pi / 4.0 + 1e-9
        assert 50e9 < row.modulus < 193e9
        assert 0.05 <= row.scatter <= 0.3


@pytest.mark.parametrize(
    ("wire", "said"),
    [
        ("7x8-0.8mm", "did you mean '7x7-0.8mm'"),
        ("7x7-800mm", "mm? Give m."),
        ("7x7", "7x7-1mm"),
    ],
)
def test_unknown_names_list_the_nearest(wire: str, said: str, tmp_path: Path) -> None:
    error = told("new", tmp_path / "arm.toml", "--wire", wire, code=1)
    assert said in error["message"]


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('{rope = "6x36", diameter = 1e-3}', "no rope is called '6x36'"),
        ('{rope = "7x7"}', "diameter: is missing"),
        ('{rope = "7x7", diameter = 0.8}', "mm? Give m."),
        ('{rope = "7x7", diameter = 0.8e-3, breaking_load = 0.39}', "breaks at some 390 N"),
        ('{rope = "7x7", diameter = 0.8e-3, braking_load = 390}', "did you mean 'breaking_load'"),
    ],
)
def test_faulty_ropes_are_refused(table: str, said: str, tmp_path: Path) -> None:
    arm = tmp_path / "arm.toml"
    assert call("new", arm, "--wire", "7x7-0.8mm").exit_code == 0
    assert said in told("stiffness", arm, "--set", f"wire={table}", code=1)["message"]


def test_an_arm_of_ropes_says_its_share_of_the_breaking_force_and_its_scatter(
    tmp_path: Path,
) -> None:
    path = tmp_path / "arm.toml"
    printed = call("new", path, "--wire", "7x7-0.8mm").output
    assert "EA 36.77 kN ± 10 %" in printed
    assert "breaking force 389.9 N" in printed
    own = 'wire={rope = "7x7", diameter = 0.8e-3, breaking_load = 200}'
    arm = cdsm.Manipulator.read(path, changes={"minimum": 40.0})
    assert arm.cables[0].elasticity == cdsm.RopeElasticity("7x7", 0.8e-3)
    pose = arm.at(np.full(arm.nv, 0.1))
    tension = cdsm.distribute_tension(pose)
    np.testing.assert_allclose(tension.breaking_share, tension.values / 389.8624, rtol=1e-6)
    assert largest_share(arm.cables, tension.values) in str(tension)
    percent = 100.0 * tension.breaking_share.max()
    assert f"{percent:.3g} %" in str(tension)
    assert "THE ROPE BREAKS" in largest_share(arm.cables, tension.values * 20.0)
    # EA of all ropes errs alike, by a tenth
    budget = cdsm.uncertainty(pose, tension, direction="z")
    (part,) = budget.contributions
    assert part == "rigidity"
    assert budget.relative == pytest.approx(0.1, rel=0.02)
    assert known_tolerances(arm).rigidity[0].standard == 0.10
    K = told("stiffness", path, "--angles", 5, "--set", own)
    assert "of 200 N" in K["largest_share_of_breaking_force"]
    assert "uncertainty" in K
    again = cdsm.Manipulator.read(arm.write(tmp_path / "again.toml"))
    assert again.cables == arm.cables
    assert not again.tolerances.given
    mixed = cdsm.Manipulator.read(path, changes={"cables": {"cable1_1": {"wire": 48e3}}})
    names = [tolerance.of for tolerance in known_tolerances(mixed).rigidity]
    assert names == [name for name in mixed.cables.names if name != "cable1_1"]


def test_a_sweep_names_the_largest_share(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    call("new", path, "--wire", "7x7-0.8mm")
    out = tmp_path / "s.csv"
    ask = ["sweep", path, "--random", 4, "--outputs", "tension", "--out", out]
    assert "largest share of a breaking force: cable" in call(*ask).output
    assert "%" in json.dumps(told(*ask)["largest_share_of_breaking_force"])


def test_motors_are_given_by_the_names_of_their_cables(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    call("new", path, "--joints", 1, "--wire", "7x7-0.8mm")
    soft = ["--set", "springs.joint1_1=5", "--set", "springs.joint1_2=5", "--set", "minimum=0"]
    named = told("stiffness", path, *soft, "--tension", "cable1_2=3,cable1_1=2")
    listed = told("stiffness", path, *soft, "--tension", "2,3,0")
    np.testing.assert_allclose(named["along_N_per_m"], listed["along_N_per_m"], rtol=1e-9)
    message = told("stiffness", path, *soft, "--tension", "cable9=3", code=1)["message"]
    assert "no cable is called 'cable9'" in message

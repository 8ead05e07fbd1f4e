"""Tolerances in TOML: their own file, and the table of an arm's file."""

from pathlib import Path

import pytest

import cdsm

EXAMPLE = Path(__file__).parents[2] / "examples" / "arm.toml"

ALL_KINDS = cdsm.Tolerances(
    rigidity=[
        cdsm.Tolerance(1.0 / 30.0, correlation=1.0, of="cable1_*"),
        cdsm.Tolerance(0.1, correlation=0.5, of="cable[23]_*"),
    ],
    hole_radius=cdsm.Tolerance.within(1e-4, correlation=0.3),
    tension=2.0,
    lead=cdsm.Tolerance(1e-3, correlation=1.0 / 3.0),
    friction=0.02,
    link_mass=cdsm.Tolerance(0.0, distribution="uniform"),
)


def test_every_kind_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    assert cdsm.Tolerances.read(ALL_KINDS.write(tmp_path / "t.toml")) == ALL_KINDS
    arm = cdsm.Manipulator.read(EXAMPLE).with_tolerances(ALL_KINDS)
    again = cdsm.Manipulator.read(arm.write(tmp_path / "arm.toml"))
    assert (again, again.tolerances) == (arm, ALL_KINDS)
    assert again.with_gravity("-y").with_friction(0.1).tolerances == ALL_KINDS
    path = tmp_path / "tolerances.toml"
    path.write_text("rigidity = 0.05\nhole_radius = {within = 1e-4, correlation = 0.5}\n")
    assert cdsm.Tolerances.read(path).given == {
        "rigidity": (cdsm.Tolerance(0.05, correlation=1.0),),
        "hole_radius": (cdsm.Tolerance.within(1e-4, correlation=0.5),),
    }


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rigidty = 0.05", "rigidty: .*did you mean 'rigidity'"),
        ("lead = -1.0", "lead: .*-1 given; a tolerance is not negative"),
        ("lead = {within = 1.0, standard = 2.0}", "one of standard and within"),
        ("lead = {width = 1.0}", "lead.width: is not a key .*; did you mean 'within'"),
        ("lead = {standard = 1e-3, distribution = 'gauss'}", "'gauss'"),
        ("lead = {within = 1e-3, distribution = 'normal'}", "within is uniform"),
    ],
)
@pytest.mark.parametrize("whole", [False, True])
def test_faults_are_named(text: str, said: str, whole: bool, tmp_path: Path) -> None:
    path = tmp_path / "t.toml"
    if whole:
        path.write_text(EXAMPLE.read_text(encoding="utf-8") + f"\n[tolerances]\n{text}\n")
    else:
        path.write_text(text + "\n")
    with pytest.raises(cdsm.FileError, match=said):
        (cdsm.Manipulator if whole else cdsm.Tolerances).read(path)

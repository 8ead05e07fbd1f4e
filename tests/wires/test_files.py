"""Wires of the catalogue and laws survive their files; other files are refused."""

import math
import pickle
from pathlib import Path

import pytest

import cdsm

DATA = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize(
    "law",
    [
        cdsm.LinearElasticity(48e3 / 7.0),
        cdsm.StrandElasticity.eq19_repaired(),
        cdsm.TabulatedElasticity((0.1, 1.0 / 3.0, 7.0), (0.0, 1e-5, 3e-4)),
        cdsm.presets.STRAND_1X19.slack_below(),
    ],
)
def test_elasticity_survives_its_file(law: cdsm.Elasticity, tmp_path: Path) -> None:
    path = law.write(tmp_path / "wire.toml")
    assert cdsm.Elasticity.read(path) == law
    again = pickle.loads(pickle.dumps(law))
    assert (again, hash(again)) == (law, hash(law))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = 'rubber'", "kind"),
        ("kind = 'linear'\nrigidity = -3.0\nstiff = 1", "stiff(?s:.*)rigidity"),
        ("kind = 'tabulated'\ntensions = [1.0, 'a']", "tensions"),
        ("kind='tabulated'\ntensions = [1, 0.5]\nstrains = [0, 1.0]", r"entry \[1\] is 0.5 after"),
    ],
)
def test_faulty_elasticity_files_name_every_fault(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "wire.toml").write_text(text)
    with pytest.raises(cdsm.FileError, match=f"not an elasticity(?s:.*){said}"):
        cdsm.Elasticity.read(tmp_path / "wire.toml")
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        cdsm.Elasticity.read(DATA / "instron_strand.csv")


EXAMPLES = Path(__file__).parents[2] / "examples"

POUND_PER_SQUARE_INCH = 6894.757293168
"""[Pa]"""


@pytest.mark.parametrize(
    ("name", "rigidity"),
    [
        # the stretch in % that makers tabulate, G W/D² in pounds and inches
        ("1x19-1.2mm-datasheet", 100.0 / 7.79e-6 * POUND_PER_SQUARE_INCH * 1.2e-3**2),
        ("7x7-1mm", 100.0 / 1.2e-5 * POUND_PER_SQUARE_INCH * 1e-3**2),
        ("7x19-1.5mm", 100.0 / 1.62e-5 * POUND_PER_SQUARE_INCH * 1.5e-3**2),
        ("nitinol-0.5mm", 83e9 * math.pi / 4.0 * 0.5e-3**2),
        ("uhmwpe-sk75-1760dtex", 124.5 * 176.0),
    ],
)
def test_wires_are_as_rigid_as_their_source_says(name: str, rigidity: float) -> None:
    path = EXAMPLES / "wires" / f"{name}.toml"
    # the files have five digits
    assert float(cdsm.Elasticity.read(path).rigidity(10.0)) == pytest.approx(rigidity, rel=5e-5)
    assert "Band: rigidity = 0." in path.read_text(encoding="utf-8")

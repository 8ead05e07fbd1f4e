"""Laws survive their files; other files are refused."""

from pathlib import Path

import pytest

import cdsm
from cdsm.wires.catalogue import as_wire

DATA = Path(__file__).parents[1] / "data"


@pytest.mark.parametrize(
    "law",
    [
        cdsm.LinearElasticity(48e3 / 7.0),
        cdsm.StrandElasticity.eq19_repaired(),
        cdsm.TabulatedElasticity((0.1, 1.0 / 3.0, 7.0), (0.0, 1e-5, 3e-4)),
    ],
)
def test_elasticity_survives_its_file(law: cdsm.Elasticity, tmp_path: Path) -> None:
    path = law.write(tmp_path / "wire.toml")
    assert cdsm.Elasticity.read(path) == law


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("kind = 'rubber'", ["kind"]),
        ("rigidity = 3.0", ["kind"]),
        ("kind = 'linear'\nrigidity = -3.0\nstiff = 1", ["rigidity", "stiff"]),
        ("kind = 'tabulated'\ntensions = [1.0, 'a']", ["tensions"]),
        (
            "kind = 'tabulated'\ntensions = [1.0, 0.5]\nstrains = [0.0, 1.0]",
            ["entry [1] is 0.5 after 1"],
        ),
        ("kind = ", ["TOML"]),
    ],
)
def test_faulty_elasticity_files_name_every_fault(
    text: str, faults: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "wire.toml"
    path.write_text(text)
    with pytest.raises(cdsm.FileError, match="not an elasticity") as caught:
        cdsm.Elasticity.read(path)
    for fault in faults:
        assert fault in str(caught.value)


@pytest.mark.parametrize("name", ["instron_strand.csv", "zwick_seil.csv"])
def test_measured_points_are_no_law_of_a_wire(name: str) -> None:
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        cdsm.Elasticity.read(DATA / name)
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        as_wire(str(DATA / name))  # as --wire does

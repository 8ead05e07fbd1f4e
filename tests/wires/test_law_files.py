"""Laws survive their files; other files are refused."""

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
    assert (again, hash(again), repr(again)) == (law, hash(law), repr(law))


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("kind = 'rubber'", ["kind"]),
        ("kind = 'linear'\nrigidity = -3.0\nstiff = 1", ["rigidity", "stiff"]),
        ("kind = 'tabulated'\ntensions = [1.0, 'a']", ["tensions"]),
        (
            "kind = 'tabulated'\ntensions = [1.0, 0.5]\nstrains = [0.0, 1.0]",
            ["entry [1] is 0.5 after 1"],
        ),
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


def test_measured_points_are_no_law_of_a_wire() -> None:
    with pytest.raises(cdsm.FileError, match="Fit it first: `cdsm fit`"):
        cdsm.Elasticity.read(DATA / "instron_strand.csv")

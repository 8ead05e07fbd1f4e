"""Results export what their metadata says: units in names, joints and cables by name."""

import json

import numpy as np
import pytest

import cdsm
from cdsm.statics.buckling import CriticalTension
from tests.support.arms import mixed_arm


@pytest.fixture(scope="module")
def found() -> CriticalTension:
    return cdsm.critical_tension(mixed_arm().at(np.full(5, 0.1)))


def test_json_has_units_in_its_keys_and_names_joints_and_cables(
    found: CriticalTension,
) -> None:
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    arm = found.posture.arm
    assert told["angles_rad"] == dict.fromkeys(arm.joint_names, 0.1)
    assert told["minimum_N"] == (found.minimum if np.isfinite(found.minimum) else None)
    assert told["tension_N"] == dict(zip(arm.cables.names, found.tension, strict=True))
    assert told["margins_Nm_per_rad"] == list(found.margins)
    assert told["wrench_N_and_Nm"] == [0.0] * 6


def test_dataset_has_units_and_coordinates(found: CriticalTension) -> None:
    data = found.to_xarray()
    assert data["tension"].sel(cable="cable1_2") == found.tension[1]
    assert data["margins"].units == "N m/rad"
    assert (data["bounds"].values == found.bounds).all()
    assert "bounds" in data["margins"].coords


def test_table_has_a_row_for_each_entry_of_its_dimension(
    found: CriticalTension, tmp_path: pytest.TempPathFactory
) -> None:
    table = found.to_pandas()
    assert list(table.columns) == ["margins [N m/rad]"]
    assert (table.index == found.bounds).all()
    written = found.write(f"{tmp_path}/bounds.csv")
    assert written.read_text().startswith("bounds,margins [N m/rad]\n")


def test_repr_shows_the_headline(found: CriticalTension) -> None:
    assert repr(found).startswith("<CriticalTension minimum ")
    modes = cdsm.modes(found.posture, cdsm.stiffness(found.posture, np.full(9, 50.0)))
    assert repr(modes) == (
        f"<Modes frequencies {modes.frequencies[0]:.4g} to {modes.frequencies[-1]:.4g} Hz>"
    )

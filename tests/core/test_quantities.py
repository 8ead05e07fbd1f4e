"""One table describes each quantity: all that give, show or explain quantities read it."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm import plots
from cdsm.cli import app
from cdsm.quantities import QUANTITIES, Quantity, names_of, si_of, udunits
from cdsm.support.values import Array
from tests.support.arms import readme_geometry
from tests.support.sweeps import short_arm

ROOT = Path(__file__).parents[2]
Q = np.array([[0.1, -0.05, 0.2, 0.0, -0.1, 0.15], [0.0, 0.1, 0.1, -0.2, 0.1, 0.0]])


def total(joint: Array) -> Array:
    return np.asarray(np.trace(joint, axis1=-2, axis2=-1))


TRACE = Quantity(
    "stiffness",
    "trace of the joint stiffness",
    "sum of its eigenvalues",
    "joint stiffness",
    best="most",
    outputs=frozenset(("sweep", "uncertainty", "design")),
    reads=("joint",),
    compute=total,
)


@pytest.fixture
def trace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add a quantity by one row."""
    monkeypatch.setitem(QUANTITIES, "trace", TRACE)


def expected(arm: cdsm.Manipulator) -> list[float]:
    poses = [arm.at(q) for q in Q]
    Ks = [cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0)) for pose in poses]
    return [float(np.trace(K.joint)) for K in Ks]


@pytest.mark.usefixtures("trace")
def test_a_quantity_of_one_row_is_swept_and_drawn() -> None:
    arm = short_arm()
    dataset = cdsm.sweep(arm, Q, minimum=20.0, outputs=("tip_position", "trace"))
    np.testing.assert_allclose(dataset["trace"], expected(arm), rtol=1e-10)
    assert dataset["trace"].attrs["units"] == "N m rad-1"
    (ax,) = plots.plot_map(dataset, "trace", section=("y", 0.0, 1.0))
    bar = ax.figure.axes[-1]
    assert bar.get_xlabel().startswith("trace of the joint stiffness [N m/rad]")


@pytest.mark.usefixtures("trace")
def test_a_quantity_of_one_row_is_an_output_of_the_command(tmp_path: Path) -> None:
    arm = short_arm()
    file = arm.write(tmp_path / "arm.toml")
    table = tmp_path / "sweep.csv"
    path = tmp_path / "path.csv"
    head = ",".join(f"{name} [deg]" for name in arm.joint_names)
    rows = [",".join(map(repr, row)) for row in np.rad2deg(Q).tolist()]
    path.write_text("\n".join([head, *rows]), encoding="utf-8")
    words = ["sweep", file, "--path", path, "--minimum", 20, "--outputs", "trace", "--out", table]
    run = CliRunner().invoke(app, [*map(str, words), "--json"])
    assert json.loads(run.stdout)["entries"]["ok"] == 2
    head, *lines = table.read_text(encoding="utf-8").splitlines()
    column = head.split(",").index("trace [N m rad-1]")
    values = [float(line.split(",")[column]) for line in lines]
    np.testing.assert_allclose(values, expected(arm), rtol=1e-9)


@pytest.mark.usefixtures("trace")
def test_a_quantity_of_one_row_is_a_goal_of_a_design() -> None:
    task = cdsm.DesignProblem(
        arm=cdsm.Manipulator(readme_geometry(joints=3), cdsm.LinearElasticity(48e3)),
        variables=(cdsm.Variable("hole_radius", 0.015, 0.04),),
        objectives=(cdsm.Objective("trace"),),
        postures=Q,
        minimum=20.0,
    )
    assert task.objectives[0].goal == "most"
    assert task.objectives[0].words == "least trace of the joint stiffness"
    designs = cdsm.evaluate_designs(task, [[0.03]])
    least = min(expected(task.arm_of([0.03])))
    assert designs["trace"][0] == pytest.approx(least, rel=1e-9)
    assert "trace [N m/rad]" in designs.to_csv()


@pytest.mark.usefixtures("trace")
def test_a_quantity_of_one_row_has_an_uncertainty() -> None:
    pose = short_arm().at(Q[0])
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0).values)
    budget = cdsm.uncertainty(pose, K.tension, cdsm.Tolerances(rigidity=0.01), of="trace")
    assert budget.value == pytest.approx(np.trace(K.joint), rel=1e-12)
    assert budget.name == "trace of the joint stiffness"
    # the passive term alone depends on EA, and is proportional to it but for the strains
    assert budget.standard_uncertainty == pytest.approx(0.01 * np.trace(K.passive), rel=1e-2)


@pytest.mark.usefixtures("trace")
def test_a_quantity_of_one_row_stands_on_the_page_of_the_reference() -> None:
    spec = importlib.util.spec_from_file_location("page", ROOT / "docs" / "quantities.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    line = "| `trace` | trace of the joint stiffness, sum of its eigenvalues | N m/rad or N/m |"
    assert line in module.page()


def test_quantities_of_a_batch_are_those_of_posture_and_stiffness() -> None:
    """They have the same names, and the dimensions that the table gives."""
    arm = short_arm()
    K = cdsm.stiffness(arm.at(Q[0]), np.full(len(arm.cables), 30.0))
    sizes = {"row": 4, "column": 4, "motion": 6, "axis": 3, "joint": arm.nv}
    sizes |= {"cable": len(arm.cables)}
    methods = {"along", "pseudoinverse", "slack"}  # of a stiffness, slack are the names
    for name in {*names_of("batch")} - methods:
        value = getattr(K if hasattr(K, name) else K.posture, name)
        dims = QUANTITIES[name].dims
        assert np.shape(value) == tuple(sizes[dim.removesuffix("_column")] for dim in dims), name


@pytest.mark.parametrize(
    ("name", "new"),
    [
        ("active_stiffness", "active"),
        ("passive_stiffness", "passive"),
        ("gravity_stiffness", "gravity"),
        ("load_stiffness", "load"),
        ("joint", "joint_stiffness"),
    ],
)
def test_an_earlier_name_is_refused_with_the_one_of_the_table(name: str, new: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"did you mean '{new}'\\?"):
        cdsm.sweep(short_arm(), Q, minimum=20.0, outputs=name)


@pytest.mark.parametrize("unit", ["N m/rad", "N/m", "m/N", "N m/rad or N/m", "1", "N m", "m/rad"])
def test_units_of_datasets_are_those_of_the_table(unit: str) -> None:
    assert si_of(udunits(unit)) == unit
    assert "/" not in udunits(unit)

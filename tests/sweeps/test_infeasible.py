"""Why postures of a sweep have no tensions, and the stiffness over the tension at one posture."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.batch.distribution import Tensions
from cdsm.sweeps.entries import Entries
from cdsm.sweeps.infeasible import InfeasiblePostures, explain_infeasible
from cdsm.sweeps.poses import joint_angles
from tests.cli.test_commands import call, told
from tests.support.arms import readme_geometry
from tests.support.printed import numbers, require_all

SNAKE = Path(__file__).parents[1] / "data" / "snake.toml"
NO_LOAD = np.zeros(6)


def reasons(arm: cdsm.Manipulator, count: int) -> tuple[InfeasiblePostures | None, Tensions]:
    q = joint_angles(arm, cdsm.RandomPoses(count))
    tensions = cdsm.distribute_tensions(arm, q)
    return explain_infeasible(Entries(arm, q, tensions.status, 0.0, np.inf, NO_LOAD)), tensions


def test_every_statement_about_a_bent_snake_is_true() -> None:
    """Within its own limits, where disks touch, most postures have no tensions."""
    arm = cdsm.Manipulator.read(SNAKE)
    found, tensions = reasons(arm, 400)
    assert found is not None
    assert found.count == np.count_nonzero(tensions.status == cdsm.Status.INFEASIBLE) > 300
    assert sum(found.joints.values()) == found.examined
    assert set(found.joints) <= {*arm.joint_names}
    assert 0 < found.widened <= found.examined
    np.testing.assert_allclose(found.largest, abs(tensions.q[tensions.ok]).max(axis=0))
    assert found.limit is not None
    assert f"try joint_limit = {found.limit:g}" in str(found)
    assert all(name in str(found) for name in [*found.joints][:4])
    text = str(found)
    lacking = numbers(text, "{} of {} postures have no tensions within the bounds")
    require_all(zip(lacking, (found.count, 400), strict=True))
    wider = numbers(text, "{} of {} have tensions within wider bounds")
    require_all(zip(wider, (found.widened, found.examined), strict=True))
    within = numbers(text, "within {} of every joint, {} of {} random postures have tensions")
    require_all(zip(within, (found.limit, found.share, 256), strict=True), digits=3)
    for joint, largest in zip(arm.joint_names, found.largest, strict=True):
        if f"{joint} beyond " in text:
            require_all([(numbers(text, f"{joint} beyond {{}}")[0], largest)])
    assert "no posture has tensions with " in text
    limit = {"universal": {"joint_limit": found.limit}}
    bent = cdsm.Manipulator.read(SNAKE, changes={"sections": {"1": limit, "2": limit}})
    assert reasons(bent, 1024)[1].ok.mean() >= 0.94


def test_there_is_nothing_to_explain_where_all_postures_have_tensions() -> None:
    arm = cdsm.Manipulator(readme_geometry(joint_limit=0.3), cdsm.LinearElasticity(4e4))
    assert reasons(arm, 64)[0] is None


@pytest.mark.filterwarnings("ignore::cdsm.CdsmWarning")
def test_a_snake_of_cdsm_new_holds_nearly_all_postures_within_its_limits(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    assert call("new", path, "--joints", "3,3", "--wire", "36.8e3").exit_code == 0
    sizes = {"hole_radius": 0.022, "link_length": 0.055, "link_mass": 0.065}
    tip = sizes | {"hole_radius": 0.014, "link_mass": 0.03}
    sections = {"1": {"universal": sizes}, "2": {"universal": tip}}
    arm = cdsm.Manipulator.read(path, changes={"maximum": 130.0, "sections": sections})
    q = joint_angles(arm, cdsm.RandomPoses(2000))
    assert cdsm.distribute_tensions(arm, q).ok.mean() >= 0.95


def test_sweep_of_one_posture_is_the_curve_over_the_tension_that_held(tmp_path: Path) -> None:
    figure = tmp_path / "curve.svg"
    words = ("sweep", SNAKE, "--angles", 8, "--minimum", "5,10,20,40")
    result = call(*words, "--figure", figure)
    assert result.exit_code == 0, result.output
    assert figure.exists()
    pose = cdsm.Manipulator.read(SNAKE).at(np.full(12, np.deg2rad(8.0)))
    table = [line.split() for line in result.output.splitlines() if line.endswith(" ok")]
    table = table[1:] if table[0][0] == "stiffness" else table
    assert [row[0] for row in table] == ["10", "10", "20", "40"]  # the file has 10 N
    for asked, row in zip((5.0, 10.0, 20.0, 40.0), table, strict=True):
        K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, asked))
        assert [float(x) for x in row[1:4]] == pytest.approx(
            [K.along(u) / 1e3 for u in "xyz"], rel=1e-3
        )
    assert call("sweep", SNAKE, "--angles", 8, "--figure", figure).exit_code == 2


def test_the_curve_shows_the_least_tension_that_held_and_the_stiffness_there() -> None:
    arm = cdsm.Manipulator.read(SNAKE)
    q = np.full((1, 12), np.deg2rad(8.0))
    dataset = cdsm.sweep(arm, q, minimum=[40.0, 5.0, 20.0])
    panels = cdsm.plots.plot_tension_curve(dataset)
    along = dataset["along"].sel(minimum=[5.0, 20.0, 40.0]).values[0]
    for ax, values in zip(panels, along.T, strict=True):
        (line,) = ax.lines
        np.testing.assert_allclose(line.get_xdata(), [10.0, 20.0, 40.0])
        np.testing.assert_allclose(line.get_ydata(), 1e-3 * values)
    several = cdsm.sweep(arm, np.zeros((2, 12)), minimum=[5.0, 20.0])
    with pytest.raises(cdsm.InvalidInput, match="one posture"):
        cdsm.plots.plot_tension_curve(several)


def test_a_sweep_prints_quantiles_and_why_postures_have_no_tensions(tmp_path: Path) -> None:
    out = tmp_path / "table.csv"
    result = call("sweep", SNAKE, "--random", 200, "--out", out)
    dataset = cdsm.sweep(cdsm.Manipulator.read(SNAKE), cdsm.RandomPoses(200))
    median = np.nanquantile(dataset["softest"], 0.5, method="inverted_cdf") / 1e3
    (row,) = (line.split() for line in result.output.splitlines() if line.startswith("softest"))
    assert float(row[4]) == pytest.approx(median, rel=1e-3)
    assert "have no tensions within the bounds" in result.output
    assert "try joint_limit = " in result.output
    found = told("sweep", SNAKE, "--random", 200, "--out", out)["infeasible_postures"]
    assert found["infeasible"] == int((dataset["status"] == cdsm.Status.INFEASIBLE).sum())


def test_plan_without_a_target_is_the_range(tmp_path: Path) -> None:
    figure = tmp_path / "range.svg"
    words = ("plan", SNAKE, "--angles", 8, "--direction", "z")
    assert call(*words, "--figure", figure).exit_code == 0
    assert figure.exists()
    pose = cdsm.Manipulator.read(SNAKE).at(np.full(12, np.deg2rad(8.0)))
    expected = cdsm.stiffness_range(pose, "z").to_dict()
    assert told(*words)["low_N_per_m"] == pytest.approx(expected["low_N_per_m"])
    assert call(*words, "--out", tmp_path / "plan.csv").exit_code == 2

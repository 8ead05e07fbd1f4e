"""Tips that fill a plane: each is where it is asked for, continued from its neighbour."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import cdsm
from cdsm import Status, plots
from cdsm.cli import app
from tests.support.pictures import artists, require_look, words
from tests.support.printed import numbers, require_all
from tests.support.sweeps import short_arm

ARM = short_arm(lead=0.3)
PLANE = cdsm.PlanePoses("x", 0.14, 0.015)


@pytest.fixture(scope="module")
def dataset() -> xr.Dataset:
    return cdsm.sweep(ARM, PLANE, minimum=20.0, progress=False)


def test_tips_are_where_they_are_asked_for_within_the_limits(dataset: xr.Dataset) -> None:
    reached = (dataset.status != Status.OUT_OF_REACH).values
    assert 0 < reached.sum() < reached.size
    tips = dataset.tip_position.values
    y, z = np.meshgrid(dataset.tip_y, dataset.tip_z, indexing="ij")
    np.testing.assert_allclose(tips[reached][:, 0], 0.14, atol=1e-9)
    np.testing.assert_allclose(tips[reached][:, 1], y[reached], atol=1e-9)
    np.testing.assert_allclose(tips[reached][:, 2], z[reached], atol=1e-9)
    q = dataset.q.values[reached]
    assert (q >= ARM.lower).all()
    assert (q <= ARM.upper).all()
    assert np.isnan(dataset.along.values[~reached]).all()
    assert np.isnan(tips[~reached]).all()


def test_the_part_that_holds_is_of_the_tips_that_are_reached(dataset: xr.Dataset) -> None:
    held = dataset.copy(deep=True)
    at = np.argwhere(dataset.status.values == Status.OK)[:3]
    held.status.values[tuple(at.T)] = Status.INFEASIBLE
    held.along.values[tuple(at.T)] = np.nan
    reached = np.count_nonzero(dataset.status != Status.OUT_OF_REACH)
    (part,) = numbers(words(plots.plot_map(held, "along")), "{} hold")
    holds = np.isin(held.status, [Status.OK, Status.IMMOBILE]).sum()
    require_all([(part, holds / reached)], digits=3)


def test_what_inverse_kinematics_reaches_is_reached(dataset: xr.Dataset) -> None:
    for i in range(0, dataset.sizes["tip_y"], 3):
        for j in range(0, dataset.sizes["tip_z"], 3):
            target = [0.14, float(dataset.tip_y[i]), float(dataset.tip_z[j])]
            if cdsm.inverse_kinematics(ARM, target, np.full(6, 0.02)).reachable:
                assert int(dataset.status[i, j]) != Status.OUT_OF_REACH


def test_most_postures_are_locally_the_nearest_to_the_straight_arm(dataset: xr.Dataset) -> None:
    """θ is in the row space of the Jacobian; near the ends of the workspace it is not yet."""
    q = dataset.q.values.reshape(-1, 6)
    inside = np.isfinite(q).all(axis=1) & (abs(q) < 0.99 * ARM.upper).all(axis=1)
    assert inside.sum() > 10
    parts = []
    for angles in q[inside]:
        J = ARM.at(angles).jacobian[:3]
        rest = angles - np.linalg.pinv(J) @ (J @ angles)
        parts.append(np.linalg.norm(rest) / np.linalg.norm(angles))
    assert np.median(parts) < 1e-3


def test_the_map_has_a_cell_for_each_tip(dataset: xr.Dataset) -> None:
    axs = plots.plot_map(dataset, "along")
    for ax, u in zip(axs, "xyz", strict=True):
        values = 1e-3 * dataset.along.sel(direction=u).values.T
        shown = artists(ax, "cells")["cells"].get_array()
        finite = np.isfinite(values)
        np.testing.assert_allclose(shown[finite], values[finite])
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("y [mm]", "z [mm]")
        assert "fault:out of reach" in artists(ax, "fault:")
    require_look(axs)


def test_the_command_draws_a_plane_and_counts_what_is_out_of_reach(
    dataset: xr.Dataset, tmp_path: Path
) -> None:
    file = ARM.write(tmp_path / "arm.toml")
    words = ["sweep", file, "--plane", "x=140:15", "--minimum", 20, "--json"]
    run = CliRunner().invoke(app, [*map(str, words), "--figure", str(tmp_path / "map.svg")])
    assert run.exit_code == 0, run.output
    entries = json.loads(run.stdout)["entries"]
    assert entries["out_of_reach"] == int((dataset.status == Status.OUT_OF_REACH).sum())
    assert (tmp_path / "map.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("call", "problem"),
    [
        (lambda: cdsm.PlanePoses("w", 0.1), "no axis is called 'w'"),
        (lambda: cdsm.PlanePoses("x", 0.1, 0.0), "step: 0 m given"),
        (lambda: cdsm.PlanePoses("x", 5.0).angles(ARM), "position: the tip reaches no place"),
        (lambda: cdsm.PlanePoses("x", 0.1, 1e-5).angles(ARM), "step: 0.01 mm makes"),
    ],
)
def test_planes_that_do_not_exist_are_named(call: object, problem: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=problem):
        call()  # type: ignore[operator]

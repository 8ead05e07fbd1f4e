"""The figure that a command writes draws the numbers of its JSON."""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.cli.test_commands import EXAMPLES, told
from tests.support.pictures import artists, line, panels

Answer = dict[str, Any]
Check = Callable[[list[Any], Answer], None]


def require_points(ax: Any, gid: str, *columns: Any) -> None:
    np.testing.assert_allclose(line(ax, gid), np.transpose(columns), rtol=1e-9, atol=1e-9)


def values(numbers: dict[str, float]) -> Array:
    return np.array([*numbers.values()])


def estimate(axs: list[Any], answer: Answer) -> None:
    """That of the last reading."""
    *_, last = answer["readings"].values()
    for name, load in last["loads_N_or_Nm"].items():
        np.testing.assert_allclose(line(axs[0], f"load:{name}")[0, 0], load)


def weigh(axs: list[Any], answer: Answer) -> None:
    moved = -1e3 * np.array(answer["displacements_m"])[:, 2]
    require_points(axs[0], "test", np.append(0.0, moved), np.append(0.0, answer["loads_N"]))


def weigh_in_cycles(axs: list[Any], answer: Answer) -> None:
    force = -np.array(answer["wrenches_N_and_Nm"])[:, 2]
    moved = -1e3 * np.array(answer["displacement_m"])[:, 2]
    require_points(axs[0], "loop", np.append(0.0, moved), np.append(0.0, force))


def buckle(axs: list[Any], answer: Answer) -> None:
    """That of the tension, also under a load."""
    critical = answer["critical_tension"]
    require_points(axs[0], "margin", critical["bounds_N"], critical["margins_Nm_per_rad"])


def plan(axs: list[Any], answer: Answer) -> None:
    bars = [bar.get_width() for bar in artists(axs[0], "tension:").values()]
    np.testing.assert_allclose(bars, values(answer["tension_N"]))
    plan_range(axs, answer)


def plan_range(axs: list[Any], answer: Answer) -> None:
    for name, end in (("softest", "low"), ("stiffest", "high")):
        F = values(answer[f"{end}_tension_N"])
        np.testing.assert_allclose(line(axs[0], name)[:, 0], F)


def plan_path(axs: list[Any], answer: Answer) -> None:
    (gid,) = artists(axs[0], "reached:")
    along = 1e-3 * np.array(answer["achieved_N_per_m"])
    require_points(axs[0], gid, np.arange(len(along)), along)
    for cable, F in zip(answer["cables"], np.transpose(answer["tensions_N"]), strict=True):
        require_points(axs[1], f"tension:{cable}", np.arange(len(F)), F)


def curve(axs: list[Any], answer: Answer) -> None:
    told = answer["curve"]
    for ax, axis in zip(axs, "xyz", strict=True):
        along = 1e-3 * np.array(told[f"along_{axis}_N_per_m"])
        require_points(ax, f"curve:{axis}", told["least_tension_N"], along)


def fit(axs: list[Any], answer: Answer) -> None:
    rigidity = 1e-3 * np.array(answer["rigidity_N"])
    require_points(axs[1], "rigidity", answer["tension_N"], rigidity)


def fit_spring(axs: list[Any], answer: Answer) -> None:
    require_points(axs[0], "points", np.rad2deg(answer["angle_rad"]), answer["torque_Nm"])


def identify(axs: list[Any], answer: Answer) -> None:
    rows = answer["residuals"]
    require_points(axs[-1], "residuals", np.arange(len(rows)), rows)


def planned_tests(axs: list[Any], answer: Answer) -> None:
    heights = [bar.get_height() for bar in artists(axs[1], "tests:").values()]
    assert heights == list(answer["counts"])


LOOPS = "identify ARM DATA/LOOPS.csv --free rigidity --free friction --displacement-std 0.01"
CASES: dict[str, Check] = {
    "estimate ARM DATA/LOAD_CELLS.csv --tension-std 0.5": estimate,
    "weigh ARM --angles 8 --load 0,0,-2": weigh,
    "weigh ARM --angles 8 --load 0,0,-2 --set friction=0.1 --cycles 1 --steps 1": weigh_in_cycles,
    "buckle ARM --angles 8 --load 0,0,-2": buckle,
    "plan ARM --direction z --target 4 --angles 8": plan,
    "plan ARM --direction z --angles 8 --maximum 100": plan_range,
    "plan ARM --direction z --target 4 --path DATA/PATH.csv": plan_path,
    "sweep ARM --angles 8 --minimum 15,20,40": curve,
    "fit DATA/TEST.csv": fit,
    "fit --spring DATA/SPRING.csv": fit_spring,
    LOOPS: identify,
    f"{LOOPS} --start friction=0.1 --tests 3": planned_tests,
}


@pytest.mark.parametrize("words", CASES)
def test_a_figure_draws_the_numbers_of_the_json(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(cdsm.plots, "save_figure", lambda picture, file: drawn.append(picture))
    there = words.replace("ARM", f"{EXAMPLES}/arm.toml").replace("DATA", f"{EXAMPLES}/data")
    answer = told(*shlex.split(there), "--figure", tmp_path / "figure.svg")
    (picture,) = drawn
    CASES[words](panels(picture), answer)

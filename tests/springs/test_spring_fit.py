"""Laws of springs from measured points: the numbers of a measured arm, and what is not in them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app

ROOT = Path(__file__).parents[2]
SPRING = ROOT / "examples" / "data" / "SPRING.csv"
HINGES = {  # torques [mN m] at angles [°] of hinges of TPU; the last points of 1 and 11 at the stop
    1: ([10, 15, 20, 25, 30], [98.2, 121.6, 151.8, 158.6, 317.3]),
    8: ([5, 10, 20, 25, 27, 30], [34.1, 48.1, 86.7, 110.2, 111.8, 121.9]),
    11: ([5, 10, 15, 20, 25, 27, 30], [41.7, 70.1, 87.3, 110.4, 117.7, 132.4, 186.4]),
    13: ([5, 10, 15, 20, 25, 27, 30], [41.5, 65.9, 83.0, 104.7, 129.1, 134.2, 147.5]),
}


def fitted(joint: int, points: int, **more: Any) -> Any:
    degrees, torques = (np.array(values[:points]) for values in HINGES[joint])
    return cdsm.fit_spring(np.deg2rad(degrees), 1e-3 * torques, **more)


@pytest.mark.parametrize(
    ("joint", "points", "linear", "p", "std", "rms", "tangents"),
    [
        (1, 4, 14.0, 0.53, 0.08, 3.3, (1.22, 0.31, 0.20)),
        (8, 6, 7.6, 0.78, 0.05, 3.6, (0.42, 0.23, 0.19)),
        (11, 6, 13.3, 0.64, 0.04, 3.4, (0.71, 0.25, 0.18)),
        (13, 7, 8.9, 0.74, 0.03, 2.6, (0.56, 0.28, 0.22)),
    ],
)
def test_the_hinges_of_a_measured_arm(
    joint: int, points: int, linear: float, p: float, std: float, rms: float, tangents: Any
) -> None:
    fit = fitted(joint, points)
    mean = fit.torque.mean()
    assert 100.0 * fit.linear_rms / mean == pytest.approx(linear, abs=0.06)
    assert fit.exponent == pytest.approx(p, abs=0.01)
    assert fit.exponent_std == pytest.approx(std, abs=0.006)
    assert 100.0 * fit.rms / mean == pytest.approx(rms, abs=0.06)
    np.testing.assert_allclose(
        fit.law.stiffness(np.deg2rad([0.0, 10.0, 25.0])), tangents, atol=0.006
    )
    assert fit.law.exponent == fit.exponent
    assert fit.law.stiffness_at_rest == pytest.approx(fit.stiffness)


def test_the_tangent_at_rest_is_that_of_the_scale_and_not_of_the_points() -> None:
    fits = {a: fitted(13, 7, scale=np.deg2rad(a)) for a in (0.5, 1.0, 2.0, 4.0)}
    at_rest = [fit.stiffness for fit in fits.values()]
    np.testing.assert_allclose(at_rest, [0.79, 0.67, 0.56, 0.48], atol=0.006)
    at_ten = [float(fit.law.stiffness(np.deg2rad(10.0))) for fit in fits.values()]
    np.testing.assert_allclose(at_ten, [0.274, 0.275, 0.276, 0.282], atol=6e-4)
    fit = fits[2.0]
    np.testing.assert_allclose(fit.stiffness_range, [at_rest[1], at_rest[3]], rtol=1e-9)
    said = "the scale 2° was given, not found: with half of it the tangent at rest is 0.666 N m/rad"
    assert said in str(fit)
    assert fit.warnings == fit.notes
    assert "points from 5° on do not tell it" in fit.notes[0]


def test_exact_points_give_the_law_and_scatter_the_deviation() -> None:
    truth = cdsm.SpringLaw.power(stiffness=0.7, exponent=0.6, scale=0.04)
    x = np.linspace(-0.5, 0.5, 40)
    exact = cdsm.fit_spring(x[::-1], truth.torque(x)[::-1], scale=0.04)
    assert exact.exponent == pytest.approx(0.6, abs=1e-8)
    assert exact.stiffness == pytest.approx(0.7, rel=1e-7)
    assert exact.rms < 1e-10
    rng = np.random.default_rng(0)
    found = [
        cdsm.fit_spring(x, truth.torque(x) + rng.normal(0.0, 5e-3, x.size), scale=0.04)
        for _ in range(100)
    ]
    off = [(fit.exponent - 0.6) / fit.exponent_std for fit in found]
    assert np.std(off) == pytest.approx(1.0, abs=0.2)
    assert abs(np.mean(off)) < 0.3
    off = [(fit.stiffness - 0.7) / fit.stiffness_std for fit in found]
    assert np.std(off) == pytest.approx(1.0, abs=0.2)


def test_points_at_a_stop_and_linear_springs_are_doubted() -> None:
    fit = fitted(1, 5)
    assert "to the last point, 30°, the torque rises 5.3 times as steeply" in str(fit)
    assert "exponent is 1 within its scatter" in str(fit)
    without = fitted(1, 5, between=(0.0, np.deg2rad(28.0)))
    assert without.exponent == fitted(1, 4).exponent
    assert len(without.notes) == 1
    assert "the torque rises 2.4 times" in str(fitted(11, 7))


@pytest.mark.parametrize(
    ("angles", "torques", "more", "said"),
    [
        ([0.1, 0.2], [0.1, 0.2], {}, "angles: 2 points beside rest; 3 tell"),
        ([0.0, 0.1, 0.2], [0.0, 0.1, 0.2], {}, "angles: 2 points beside rest"),
        ([0.1, 0.2, 0.3], [0.1, 0.2], {}, "torques: shapes"),
        ([0.1, 0.2, np.nan], [0.1, 0.2, 0.3], {}, r"angles: entry \[2\] is nan"),
        ([0.1, 0.2, 0.3], [-0.1, -0.2, -0.3], {}, "torques: have another sign"),
        ([0.1, 0.2, 0.3, 0.4], [0.4, 0.3, 0.2, 0.1], {}, "torques: do not rise"),
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3], {"scale": -1.0}, "scale: -1 given"),
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3], {"between": (0.3, 0.1)}, "between: "),
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3], {"between": (0.15, 0.5)}, "angles: 2 points"),
    ],
)
def test_points_of_no_spring_are_named(angles: Any, torques: Any, more: Any, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.fit_spring(angles, torques, **more)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("angle [deg],torque\n5,0.04\n", "the column torque has no unit that is known"),
        ("angle [deg]\n5\n", "has no column torque"),
        ("angle [deg],force [N]\n5,1\n", "has a column force, which is not read"),
        ("angle [deg],torque [N m]\n5,x\n", "line 2, column torque: 'x' is not a finite number"),
        ("angle [deg],torque [N m]\n", "holds no points of a spring"),
    ],
)
def test_files_of_points_name_their_faults(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "POINTS.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(cdsm.FileError, match=said):
        cdsm.read_spring_csv(path)


def run(*args: str) -> Any:
    return CliRunner().invoke(app, ["fit", *args])


def test_the_command_fits_draws_and_refuses(tmp_path: Path) -> None:
    picture = tmp_path / "spring.svg"
    done = run("--spring", str(SPRING), "--figure", str(picture))
    assert done.exit_code == 0, done.output
    assert "exponent 0.74 ± 0.03, scale 2° (given)" in done.output
    assert (
        "[springs] JOINT = { stiffness = 0.5632, exponent = 0.74, scale = 0.03491 }" in done.output
    )
    assert picture.exists()
    answer = json.loads(run("--spring", str(SPRING), "--scale", "1", "--json").stdout)
    assert answer["law"]["scale"] == pytest.approx(np.deg2rad(1.0))
    assert answer["stiffness_Nm_per_rad"] == pytest.approx(0.67, abs=0.005)
    assert "was given, not found" in answer["notes"][0]
    few = json.loads(run("--spring", str(SPRING), "--between", "0,21", "--json").stdout)
    assert len(few["angle_rad"]) == 4
    for option, value, said in (
        ("--out", str(tmp_path / "law.toml"), "a line of ARM.toml"),
        ("--gauge-length", "50", "a spring has none"),
        ("--columns", "a,b", "call the columns angle"),
        ("--units", "deg,N m", "in the header"),
        ("--scale", "0", "--scale: 0 given; a positive angle [deg] is needed"),
        ("--scale", "-2", "--scale: -2 given; a positive angle [deg] is needed"),
        ("--between", "30,10", "--between: 30,10 given; LOW is below HIGH, both in degrees"),
    ):
        refused = run("--spring", str(SPRING), option, value)
        assert refused.exit_code == 2
        assert said in " ".join(refused.output.split())
    assert "belongs to --spring" in run(str(SPRING), "--scale", "1").output
    assert "Give --spring" in " ".join(run(str(SPRING)).output.split())


@pytest.mark.parametrize("scale", [0.0, -0.1])
def test_a_scale_that_is_no_angle_is_refused(scale: float) -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"scale: .* given; a positive angle \[rad\] is"):
        cdsm.fit_spring([0.1, 0.2, 0.3], [0.10, 0.18, 0.25], scale=scale)


@pytest.mark.parametrize(
    ("angles", "scale"), [([0.1, 0.1, 0.1], 0.035), ([0.1, 0.2, 0.3, 0.4], 1e5)]
)
def test_points_that_tell_no_exponent_are_refused(angles: list[float], scale: float) -> None:
    torques = 0.9 * np.asarray(angles)
    with pytest.raises(cdsm.InvalidInput, match=r"angles: of .*° from rest tell no exponent with"):
        cdsm.fit_spring(angles, torques, scale=scale)


def test_the_picture_shows_points_law_and_what_the_scale_decides() -> None:
    fit = cdsm.fit_spring(*cdsm.read_spring_csv(SPRING))
    left, right = fit.plot()
    drawn = {artist.get_gid(): artist for ax in (left, right) for artist in ax.lines}
    np.testing.assert_allclose(drawn["points"].get_xdata(), np.rad2deg(fit.angle))
    np.testing.assert_allclose(drawn["points"].get_ydata(), fit.torque)
    x = np.deg2rad(drawn["law"].get_xdata())
    np.testing.assert_allclose(drawn["law"].get_ydata(), fit.law.torque(x))
    np.testing.assert_allclose(drawn["tangent"].get_ydata(), fit.law.stiffness(x))
    assert drawn["first point"].get_xdata()[0] == pytest.approx(5.0)
    (x0, M0), (x1, M1) = drawn["linear"].get_xydata()
    (best,) = np.linalg.lstsq(fit.angle[:, None], fit.torque)[0]
    assert (M1 - M0) / np.deg2rad(x1 - x0) == pytest.approx(best)
    (band,) = right.collections
    heights = band.get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(fit.stiffness_range[0], rel=1e-6)
    assert "exponent 0.74 ± 0.03" in left.figure.get_suptitle() + left.get_title(loc="left")

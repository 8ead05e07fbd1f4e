"""Loops of weight tests and positions of tips from CSV files."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm import TipPosition
from tests.identification.test_loops import hinge
from tests.identification.test_tip_position import ROD

GOOD = """\
# any comment
test,joint1 [deg],direction,minimum [N],force [N],displacement [mm],remark
up,20,-z,200,0,0.001,first
up,,,,8,0.25,
up,,,,0,0.06,
side,-10,z,150,0,0,
side,-10,z,150,5,0.1,
"""


def read(tmp_path: Path, text: str, **options: object) -> tuple[cdsm.WeightLoop, ...]:
    path = tmp_path / "loops.csv"
    path.write_text(text, encoding="utf-8")
    options = {"displacement_std": 5e-6} | options
    return cdsm.read_loops(path, hinge(), **options)  # type: ignore[arg-type]


def tips(tmp_path: Path, text: str) -> tuple[TipPosition, ...]:
    path = tmp_path / "tips.csv"
    path.write_text(text, encoding="utf-8")
    return cdsm.read_tip_positions(path, ROD, std=1e-3)


def test_loops_come_out_in_si(tmp_path: Path) -> None:
    up, side = read(tmp_path, GOOD)
    assert up == cdsm.WeightLoop(
        direction="-z",
        angles=(np.deg2rad(20.0),),
        forces=(0.0, 8.0, 0.0),
        displacements=(1e-6, 0.25e-3, 0.06e-3),
        displacement_std=5e-6,
        minimum=200.0,
        label="up",
    )
    assert side.angles == pytest.approx((np.deg2rad(-10.0),))
    assert (side.direction, side.minimum) == ((0.0, 0.0, 1.0), 150.0)


def test_three_axes_measured_tensions_and_tests_without_readings(tmp_path: Path) -> None:
    head = "test,direction,cable1_1 [N],cable1_2 [N],force [N],x [um],y [um],z [um]\n"
    (loop,) = read(tmp_path, f"{head}a,-z,60,50,0,1,2,3\na,,,,5,4,5,6\n")
    assert (loop.tension, loop.minimum, loop.angles) == ((60.0, 50.0), None, (0.0,))
    assert loop.displacements is not None
    np.testing.assert_allclose(loop.displacements, 1e-6 * np.array([[1, 2, 3], [4, 5, 6]]))
    (loop,) = read(tmp_path, "test,direction,force [N]\na,z,0\na,,5\n", minimum=100.0)
    assert (loop.displacements, loop.minimum) == (None, 100.0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (",8,", ",eight,", "line 4, column force.*'eight'"),
        ("joint1 [deg]", "joint1", r"joint1 \[deg\].*joint1 \[rad\]"),
        ("force [N]", "force [kg]", r"force \[N\]"),
        (",-z,", ",down,", "line 3, column direction.*'down'.*-z"),
        ("up,,,,0,", "up,21,,,0,", "line 5, column joint1.*'21'.*'20'"),
        ("side,-10,z,150,5", "side,-10,z,150,5,0.1,\nup,,,,5", "line 8.*up.*goes on"),
        ("side,-10,z,150,5", "side,-10,z,150,0", "test side.*two sizes"),
        ("displacement [mm]", "displacement [m]", "test up.*0.249 m, more than the arm is"),
        ("remark", "cable1_1 [N]", "minimum and cable1_1"),
        ("remark", "joint9 [deg]", "column joint9.*did you mean 'joint"),
    ],
)
def test_faults_name_line_and_column(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(cdsm.FileError, match=f"(?s)loops.csv.*{said}"):
        read(tmp_path, GOOD.replace(old, new, 1))


def test_readings_against_the_force_and_angles_in_radians_are_doubted(tmp_path: Path) -> None:
    """No stable arm moves against a force on it; 20 degrees are 0.35, and below 0.2."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, GOOD)
    against = GOOD.replace(",8,0.25", ",8,-0.25")
    with pytest.warns(cdsm.CdsmWarning, match=r"loops.csv: test up: its readings go against the"):
        read(tmp_path, against)
    head = "test,direction,minimum [N],force [N],x [mm],y [mm],z [mm]\n"
    with pytest.warns(cdsm.CdsmWarning, match="test a: its readings go against the force"):
        read(tmp_path, f"{head}a,-z,50,0,0,0,0\na,,,5,-0.1,0,0.2\n")
    small = GOOD.replace("up,20,", "up,0.15,").replace("side,-10,", "side,-0.1,")
    with pytest.warns(cdsm.CdsmWarning, match=r"all angles are below 0.2°.* joint1 \[rad\]"):
        read(tmp_path, small)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, small.replace("joint1 [deg]", "joint1 [rad]"))


def test_empty_columns_and_rows_of_a_spreadsheet_do_not_count(tmp_path: Path) -> None:
    head, *lines = GOOD.split("\n", 2)[1:]
    text = "\n".join([f"{head},,", *(f"{line},," for line in lines[0].splitlines())])
    assert read(tmp_path, f"{text}\n{',' * 8}\n") == read(tmp_path, GOOD)
    with pytest.raises(cdsm.FileError, match="line 2: has 9 cells, but the header 7"):
        read(tmp_path, text.replace("first,,", "first,0,", 1))


HEAD = "label,x [mm],z [mm],cable3_1 [mm],cable3_2 [mm]\n"


def test_positions_come_out_in_si(tmp_path: Path) -> None:
    one, two = tips(tmp_path, f"{HEAD}a,90,5,3,\nb,,6,0,2\n")
    assert one == TipPosition(x=0.09, z=5e-3, pull={"cable3_1": 3e-3}, std=1e-3, label="a")
    assert two == TipPosition(z=6e-3, pull={"cable3_1": 0.0, "cable3_2": 2e-3}, std=1e-3, label="b")
    (pulled,) = tips(tmp_path, "x [m],cable3_3 [N]\n0.09,2\n")
    assert pulled == TipPosition(x=0.09, tension={"cable3_3": 2.0}, std=1e-3)


def test_loads_of_positions_count(tmp_path: Path) -> None:
    """The height of a loaded rod gives its EI; without the column force it would not."""
    parameters = cdsm.ArmParameters(ROD, ("bending_stiffness",))
    soft = parameters(bending_stiffness=9e-3)
    rest = cdsm.forward_statics(soft, pull={"cable3_1": 0.0}, wrench=[0, 0, -0.2, 0, 0, 0])
    z = 1e3 * rest.pose.tip[2, 3]
    text = f"cable3_1 [mm],z [mm],direction,force [N]\n0,{z:.5f},-z,0.2\n0,0,,\n"
    read = tips(tmp_path, text)
    assert [tip.wrench[2] for tip in read] == [-0.2, 0.0]
    fit = cdsm.identify(parameters, read[:1], {"bending_stiffness": (8e-3, 1.2e-2)})
    assert fit.values[0] == pytest.approx(9e-3, rel=1e-3)
    (hung,) = tips(tmp_path, "cable3_1 [mm],x [mm],mass [g]\n0,90,20\n")
    assert hung.wrench[2] == pytest.approx(-0.02 * 9.81)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_columns_are_separated_as_spreadsheets_do(separator: str, tmp_path: Path) -> None:
    text = f"{HEAD}a,90.5,5,3,\nb,,6,0,2\n"
    other = text.replace(",", separator).replace(".", ",").replace("[", "(").replace("]", ")")
    assert tips(tmp_path, other) == tips(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"{HEAD}a,90,5,3 mm,\n", "line 2, column cable3_1: '3 mm'"),
        (f"{HEAD}a,nan,5,3,\n", "line 2, column x: 'nan'"),
        (f"{HEAD}a,,,3,\n", "line 2: no coordinate was measured"),
        ("x [mm],cable3_9 [mm]\n90,3\n", "column cable3_9, which is not known"),
        ("x [mm],jointx [deg]\n90,3\n", "column jointx, which is not known"),
        ("x [mm]\n90\n", "one of a cable, such as cable3_1"),
        ("x,cable3_1 [mm]\n90,3\n", "column x has no unit"),
        ("x [mm],cable3_1 [mm],cable3_2 [N]\n90,3,2\n", r"call it cable3_2 \[mm\]"),
        (HEAD, "holds no positions"),
        ("x [mm],cable3_1 [mm],force [N]\n9,3,2\n", "needs both columns of a load"),
        ("x [mm],cable3_1 [mm],force [N],direction\n9,3,2,down\n", "'down' is no axis"),
        ("x [mm],cable3_1 [mm],moment [N m]\n9,3,2\n", "column moment, which is not read"),
        (
            "x [mm],cable3_1 [mm],displacement [mm]\n9,3,2\n",
            "column displacement, which is not read",
        ),
        ("x [mm],cable3_1 [mm],minimum [N]\n9,3,2\n", "column minimum, which is not read"),
    ],
)
def test_faults_of_positions_name_line_and_column(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(cdsm.FileError, match=said):
        tips(tmp_path, text)

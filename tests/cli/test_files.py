"""Files that commands read: samples in examples/data, columns with a meaning, followers."""

import re
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.estimation.files import read_load_cells
from tests.cli.test_commands import call, told

EXAMPLES = Path(__file__).parents[2] / "examples"
SAMPLES = EXAMPLES / "data"
ARM = EXAMPLES / "arm.toml"
READERS = ("fit", "identify", "sweep", "estimate")


def test_each_sample_is_read_by_the_command_that_names_it(tmp_path: Path) -> None:
    fitted = told("fit", SAMPLES / "TEST.csv")
    np.testing.assert_allclose(fitted["rigidity_N"], 36.8e3, rtol=0.01)
    loops = ("identify", ARM, SAMPLES / "LOOPS.csv", "--free", "rigidity")
    found = told(*loops, "--displacement-std", 0.01)
    assert found["values_own_unit"][0] == pytest.approx(1.1, rel=0.01)
    table = tmp_path / "s.csv"
    for name, count in (("PATH.csv", 5), ("TIP_PATH.csv", 4)):
        swept = told("sweep", ARM, "--path", SAMPLES / name, "--minimum", 10, "--out", table)
        assert swept["entries"]["ok"] == count
    plan = ("plan", ARM, "--direction", "z", "--target", 4, "--path")
    assert len(told(*plan, SAMPLES / "PATH.csv")["tensions_N"]) == 5
    help_texts = "".join(call(name, "--help").output for name in READERS)
    for sample in SAMPLES.glob("*.csv"):
        assert sample.name in help_texts


def test_load_cells_are_read_with_their_angles(tmp_path: Path) -> None:
    """Made with 0.5 N and 0.1° of noise, empty and with 0.3 kg at the tip."""
    file = SAMPLES / "LOAD_CELLS.csv"
    figure = tmp_path / "load.png"
    std = ("--tension-std", 0.5, "--angle-std", 0.1)
    found = told("estimate", ARM, file, *std, "--figure", figure)["readings"]
    assert figure.exists()
    assert [*found] == ["empty", "0.3 kg"]
    for label, force in (("empty", 0.0), ("0.3 kg", -0.3 * 9.81)):
        one = found[label]
        off = one["loads_N_or_Nm"]["fz at tool0"] - force
        assert abs(off) < 2.0 * one["std_N_or_Nm"]["fz at tool0"] < 1.0
        assert one["warnings"] == []
    sought = ("--link", "tool0=fy,fz", "--link", "link2=moment", "--set", "friction=0.1")
    rough = told("estimate", ARM, file, *std, *sought, "--sliding", "in")["readings"]["empty"]
    assert [*rough["band_N_or_Nm"]][1:3] == ["fz at tool0", "mx at link2"]
    assert {*rough["sliding"].values()} == {1.0}
    printed = call("estimate", ARM, file, *std, "--set", "friction=0.1").output
    assert "give sliding=1 (--sliding in)" in printed
    twice = call("estimate", ARM, file, *std, "--link", "tool0", "--link", "tool0=moment")
    assert twice.exit_code == 2
    assert "is given twice" in twice.stderr


HINGE = """
wire = 2e4
[hinged]
joints = 1
twist = 0.0
cables_per_joint = 2
link_length = 0.1
base_length = 0.02
disk_offset = 0.01
hole_radius = 0.02
link_mass = 0.05
lead = 0.3
joint_stiffness = 1.5
"""


def test_pulls_after_re_stringing_give_slack_and_gain(tmp_path: Path) -> None:
    file, pulls = tmp_path / "arm.toml", tmp_path / "PULLS.csv"
    file.write_text(HINGE, encoding="utf-8")
    arm = cdsm.Manipulator.read(file)
    truth = {"slack@cable1_1": 2.1e-3, "gain": 1.05}
    strung = cdsm.ArmParameters(arm, (*truth,))(**truth)
    rows = ["cable1_1 [mm],z [mm]"]
    for pull, noise in ((4.0, 0.01), (6.0, -0.02), (8.0, 0.01)):
        z = cdsm.forward_statics(strung, pull={"cable1_1": 1e-3 * pull}).pose.tip[2, 3]
        rows.append(f"{pull},{1e3 * z + noise}")
    pulls.write_text("\n".join(rows), encoding="utf-8")
    free = ("--free", "slack@cable1_1=0:5", "--free", "gain=0.8:1.2")
    words = ("identify", file, pulls, "--displacement-std", 0.02, *free)
    found = told(*words, code=3)  # it warns: both are correlated
    assert "correlated" in found["warnings"][0]
    slack, gain = found["values_own_unit"]
    assert abs(slack - 2.1) < 2.0 * found["std_own_unit"][0] < 0.1
    assert abs(gain - 1.05) < 2.0 * found["std_own_unit"][1] < 0.02
    refused = call(*words, "--minimum", 5)
    assert refused.exit_code == 2
    assert "is for weight tests" in refused.stderr
    loops = ("identify", ARM, SAMPLES / "LOOPS.csv", "--displacement-std", 0.01)
    weights = call(*loops, "--free", "slack=0:5")
    assert "slack changes no weight test: positions of the tip show it." in weights.stderr


@pytest.mark.long
def test_sample_of_pulls_is_read_by_the_command_of_its_page() -> None:
    free = [f"slack@cable20_{i}=0:5" for i in (1, 2, 3)] + ["gain=0.8:1.2"]
    words = [word for name in free for word in ("--free", name)]
    file = EXAMPLES / "backbone.toml"
    found = told("identify", file, SAMPLES / "PULLS.csv", "--displacement-std", 0.2, *words)
    np.testing.assert_allclose(found["values_own_unit"], [2.1, 0.4, 1.3, 1.05], rtol=0.02)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "cable1_2 [N]",
            "cable1_2 [kg]",
            r"cable1_2 has no unit that is known; call it cable1_2 \[N\]",
        ),
        ("cable1_2 [N]", "spare", "has no column cable1_2"),
        ("joint2_1 [deg]", "joint9_1 [deg]", "has a column joint9_1, which is not known"),
        ("10.01", "", "line 4, column joint1_1: '' is not a finite number"),
        ("joint1_1 [deg]", "mass [kg]", "has a column mass, which is not read"),
    ],
)
def test_wrong_files_of_load_cells_are_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = (SAMPLES / "LOAD_CELLS.csv").read_text(encoding="utf-8")
    file = tmp_path / "cells.csv"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(cdsm.FileError, match=said):
        read_load_cells(file, cdsm.Manipulator.read(ARM))


def test_tip_positions_are_read_with_their_loads() -> None:
    """Made with EI 10 % below that of the file, of a noise of 0.1 mm."""
    arm = cdsm.Manipulator.read(EXAMPLES / "backbone.toml")
    tips = cdsm.read_tip_positions(SAMPLES / "TIPS.csv", arm, std=1e-4)
    assert [tip.wrench[2] for tip in tips] == [0.0, -0.1] * 3
    parameters = cdsm.ArmParameters(arm, ("bending_stiffness",))
    soft = parameters(bending_stiffness=0.9 * parameters.present["bending_stiffness"])
    there = tips[1].rest_posture(soft).tip[:3, 3]
    np.testing.assert_allclose(there, tips[1].readings, atol=5e-4)


def test_a_sweep_of_tip_positions_has_its_tips_there(tmp_path: Path) -> None:
    table = tmp_path / "s.nc"
    told("sweep", ARM, "--path", SAMPLES / "TIP_PATH.csv", "--minimum", 10,
         "--outputs", "tip_position", "--out", table)  # fmt: skip
    xarray = pytest.importorskip("xarray")
    tips = xarray.open_dataset(table)["tip_position"].values
    wanted = np.loadtxt(SAMPLES / "TIP_PATH.csv", delimiter=",", skiprows=2)
    np.testing.assert_allclose(np.squeeze(tips), 1e-3 * wanted, atol=1e-8)
    far = tmp_path / "far.csv"
    far.write_text("x [mm],y [mm],z [mm]\n260,41,-41\n900,0,0\n")
    error = told("sweep", ARM, "--path", far, "--out", table, code=1)
    assert "sample 2: (900, 0, 0) mm is out of reach" in error["message"]
    one = tmp_path / "one.csv"
    one.write_text("joint1_1 [deg]\n3\n")
    assert told("sweep", ARM, "--path", one, "--minimum", 10, "--out", table)["entries"]["ok"] == 1


@pytest.mark.parametrize(
    ("command", "text", "said"),
    [
        ("sweep", "joint1_1 [deg],target [N/mm]\n1,3\n2,3\n", "column target, which is not read"),
        ("sweep", "joint1_1 [deg],mass [kg]\n1,3\n2,3\n", "column mass, which is not read"),
        ("sweep", "joint1_1 [deg],cable1_1 [N]\n1,3\n2,3\n", "column cable1_1, which is not read"),
        ("plan", "joint1_1 [deg],minimum [N]\n1,3\n2,3\n", "column minimum, which is not read"),
    ],
)
def test_no_column_with_a_meaning_is_dropped(
    command: str, text: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "path.csv"
    path.write_text(text)
    more = ("--out", tmp_path / "s.csv") if command == "sweep" else ("--direction", "z")
    assert said in told(command, ARM, "--path", path, *more, code=1)["message"]


FINGER = """<robot name="finger">
<link name="palm"/><link name="p1">{mass}</link><link name="p2">{mass}</link>
<link name="p3">{mass}</link>
<joint name="a3" type="revolute"><parent link="p2"/><child link="p3"/><origin xyz="0.03 0 0"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="b2"
multiplier="0.8"/></joint>
<joint name="z1" type="revolute"><parent link="palm"/><child link="p1"/><origin xyz="0.02 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="b2" type="revolute"><parent link="p1"/><child link="p2"/><origin xyz="0.05 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""
MASS = """<inertial><mass value="0.1"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="4e-5" iyz="0"
izz="4e-5"/></inertial>"""


def finger(folder: Path, limits: str = "revolute") -> Path:
    """Write an arm of three joints, of which a3 follows b2."""
    robot = FINGER.format(mass=MASS).replace("\n", " ")
    robot = re.sub(r'(name="z1" type=)"revolute"', rf'\1"{limits}"', robot)
    (folder / "finger.urdf").write_text(robot)
    sites = [
        f'{{ link = "{link}", xyz = [{x}, 0.0, HEIGHT] }}'
        for link, x in (("palm", 0.0), ("p1", 0.03), ("p2", 0.015), ("p3", 0.01))
    ]
    cables = [
        f'[[cables]]\nname = "{name}"\nlead = 0.2\nwire = 3e4\n'
        f"sites = [{', '.join(sites[:end]).replace('HEIGHT', str(z))}]\n"
        for name, z, end in (("u", 0.01, 4), ("d", -0.01, 4), ("m", -0.012, 3), ("s", 0.012, 2))
    ]
    (folder / "cables.toml").write_text("\n".join(cables))
    arm = folder / "finger.toml"
    made = call("new", arm, "--from", folder / "finger.urdf", "--cables", folder / "cables.toml",
                "--tip", "p3")  # fmt: skip
    assert made.exit_code == 0, made.output
    return arm


def test_logged_followers_are_accepted_and_checked(tmp_path: Path) -> None:
    arm = finger(tmp_path)
    path = tmp_path / "path.csv"
    text = "time [s],z1 [rad],b2 [rad],a3 [rad]\n0,0.1,0.2,0.16\n0.01,0.12,0.21,0.168\n"
    path.write_text(text)
    swept = told("sweep", arm, "--path", path, "--out", tmp_path / "s.csv")
    assert sum(swept["entries"].values()) == 2
    path.write_text(text.replace("0.168", "0.3"))
    message = told("sweep", arm, "--path", path, "--out", tmp_path / "s.csv", code=1)["message"]
    assert "a3: reading 2: 0.3 given, but b2, which it mimics, puts it at 0.168" in message


def test_joints_without_limits_are_searched_and_never_at_a_limit(tmp_path: Path) -> None:
    arm = cdsm.Manipulator.read(finger(tmp_path, "continuous"))
    assert np.isinf(arm.lower[0])
    near = cdsm.inverse_kinematics(arm, arm.at([2.5, 0.3]).tip[:3, 3])
    assert near.reachable
    far = cdsm.inverse_kinematics(arm, [0.3, 0.0, 0.0])
    assert not far.reachable
    assert "z1" not in far.at_limit
    assert far.position_error == pytest.approx(0.2, abs=1e-6)  # the straight finger is 0.1 m long


def test_readings_with_one_label_are_all_estimated(tmp_path: Path) -> None:
    """Equal labels get their line; the first of two readings had been lost."""
    text = (SAMPLES / "LOAD_CELLS.csv").read_text(encoding="utf-8")
    file = tmp_path / "cells.csv"
    lines = text.splitlines()
    file.write_text("\n".join([*lines, lines[-1].replace("-0.13", "-0.14")]), encoding="utf-8")
    found = [each.label for each in read_load_cells(file, cdsm.Manipulator.read(ARM))]
    assert len(found) == len({*found}) == len(lines) - 2
    name = lines[-1].partition(",")[0]
    assert found[-2:] == [f"{name}, line {len(lines)}", f"{name}, line {len(lines) + 1}"]

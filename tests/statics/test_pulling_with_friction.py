"""Forward statics with friction in the holes: the rest depends on the path, which is followed."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.support.values import Array
from cdsm.view.state import Setting, show
from tests.validation import rod as measured

THREE = (0.0, 2.094, 4.189)
FORCES = np.array([4.0, 1.0, 2.5])
LOAD = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])


def rod(
    friction: float,
    E: float = 81.0,  # [GPa]
    hole_angles: tuple[float, ...] = (0.0,),
    gravity: tuple[float, float, float] = (9.81, 0.0, 0.0),
    control: str = "force",
    EA: float = 1e5,
) -> cdsm.Manipulator:
    """The measured rod: 1 mm thick, ten disks at 27 mm, a tendon at 8 mm."""
    section = {
        "length": 0.27,
        "disks": 10,
        "hole_radius": 0.008,
        "hole_angles": list(hole_angles),
        "friction": friction,
        "lead": 0.05,
    }
    geometry = cdsm.Geometry.backbone(
        sections=[section],
        outer_diameter=1e-3,
        youngs_modulus=E * 1e9,
        mass_per_length=0.002 / 0.027,
        joint_limit=1.2,
    )
    cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(EA), control=control)
    return cdsm.Manipulator(geometry, cables=cables, gravity=gravity)


def shape(pose: cdsm.Posture) -> Array:
    """Centres of the disks (11, 2) [mm] from the first one: along x, and across."""
    return measured.in_plane(measured.disk_centres(pose))


def distance(one: Array, other: Array) -> float:
    return 1e3 * float(np.linalg.norm(one - other))


@pytest.mark.parametrize(
    ("E", "mu", "rms"),
    [
        (81.0, 0.1, 1.77),
        (79.5, 0.12, 1.75),
        (82.0, 0.08, 1.75),
        (86.0, 0.0, 2.28),
        (81.0, 0.0, 5.04),
        (71.7, 0.2256, 3.01),
    ],
)
def test_shapes_of_a_measured_rod(E: float, mu: float, rms: float) -> None:
    arm = rod(mu, E)
    computed = [shape(cdsm.forward_statics(arm, tension=[F]).pose) for F in measured.TENSIONS[1:]]
    off = np.array(computed) - measured.shapes_in_plane()[1:]
    off = np.sqrt(np.mean(np.sum(off**2, axis=2)))
    assert off == pytest.approx(rms, abs=0.02)


def test_what_the_frictionless_rest_is_off_by() -> None:
    arm = rod(0.1)
    rest = cdsm.forward_statics(arm, tension=[5.2522])
    free = cdsm.forward_statics(arm, tension=[5.2522], friction=False)
    assert distance(free.pose.tip[:3, 3], rest.pose.tip[:3, 3]) == pytest.approx(24.8, abs=0.1)
    assert rest.segment_tension is not None
    assert rest.segment_tension[-1] == pytest.approx(4.244, abs=1e-3)  # at the end of the tendon
    assert rest.tension == pytest.approx([5.2522])
    assert abs(rest.residual).max() < 1e-10
    assert rest.pose.arm == arm
    assert (free.path, free.segment_tension) == (None, None)
    assert "without the friction" in str(free)


def test_without_friction_the_path_ends_at_the_frictionless_rest() -> None:
    free = cdsm.forward_statics(rod(0.0), tension=[5.2522])
    assert free.history == ""
    off = [
        distance(
            cdsm.forward_statics(rod(mu), tension=[5.2522]).pose.tip[:3, 3], free.pose.tip[:3, 3]
        )
        for mu in (1e-6, 0.002, 0.004, 0.008)
    ]
    assert off[0] < 3e-4
    np.testing.assert_allclose(off[1:], [0.567, 1.131, 2.248], atol=2e-3)


def test_pull_and_load_are_followed_as_by_hand() -> None:
    arm = rod(0.1, hole_angles=THREE, gravity=(0.0, 0.0, -9.81))
    rest = cdsm.forward_statics(arm, tension=FORCES, wrench=LOAD)
    first = cdsm.forward_statics(arm, tension=1e-3 * FORCES, friction=False)
    loads = np.array([0.0 * LOAD, LOAD])
    by_hand = cdsm.load_cycle(first.pose, first, loads, motors=[FORCES, FORCES], substeps=16)
    assert rest.path is not None
    assert distance(rest.path.tip[0], by_hand.tip[0]) < 1e-3
    assert distance(rest.path.tip[1], by_hand.tip[1]) < 1e-3
    free = cdsm.forward_statics(arm, tension=FORCES, wrench=LOAD, friction=False)
    assert distance(free.pose.tip[:3, 3], rest.path.tip[1]) == pytest.approx(18.16, abs=0.05)
    sentence = (
        "with friction: pulled from slack in 8 steps, then loaded; 26 of 30 holes slide; "
        "another history ends elsewhere"
    )
    assert sentence in str(rest)
    numbers = json.loads(json.dumps(rest.to_dict()))
    assert numbers["history"] == sentence
    assert sum(map(bool, numbers["sliding"].values())) == 26
    assert len(numbers["segment_tension_N"]) == 33


def test_stiffness_is_that_of_the_last_state_of_the_path() -> None:
    rest = cdsm.forward_statics(rod(0.1), tension=[3.3122])
    assert rest.stiffness.friction == "sliding"
    assert rest.along("x") == pytest.approx(1.66, abs=5e-3)
    free = cdsm.forward_statics(rod(0.1), tension=[3.3122], friction=False)
    assert free.along("x") == pytest.approx(1.46, abs=5e-3)
    with pytest.raises(cdsm.InvalidInput, match="stick or slide"):
        rest.report()


def test_motors_that_hold_lengths() -> None:
    arm = rod(0.1, hole_angles=THREE, control="position", EA=2e4)
    rest = cdsm.forward_statics(arm, pull=[0.01201, -0.05, -0.05])
    assert rest.segment_tension is not None
    assert rest.tension[0] == pytest.approx(3.447, abs=2e-3)
    assert rest.segment_tension[10] == pytest.approx(3.002, abs=2e-3)
    assert rest.slack == tuple(arm.cables.names[1:])
    free = cdsm.forward_statics(arm, pull=[0.01201, -0.05, -0.05], friction=False)
    assert free.tension[0] == pytest.approx(3.203, abs=2e-3)
    off = distance(free.pose.tip[:3, 3], rest.pose.tip[:3, 3])
    assert off == pytest.approx(5.1, abs=0.2)


@pytest.mark.parametrize("control", ["force", "position"])
def test_a_cycle_goes_on_from_a_rest_with_friction(control: str) -> None:
    arm = rod(0.1, hole_angles=THREE, control=control, EA=2e4)
    motors = {"tension": FORCES} if control == "force" else {"pull": [0.012, -0.05, 0.004]}
    rest = cdsm.forward_statics(arm, **motors, wrench=LOAD)
    assert rest.path is not None
    same = cdsm.load_cycle(rest.pose, rest, [LOAD])
    np.testing.assert_allclose(same.tip[0], rest.pose.tip[:3, 3], atol=1e-12)
    np.testing.assert_allclose(same.segment_tensions[0], rest.path.segment_tensions[-1], atol=1e-9)
    assert abs(same.slip).max() < 1e-12
    test = cdsm.weight_test(rest.pose, rest, [0.0, 0.02, 0.0], steps=2)
    assert test.history is not None
    more = cdsm.load_cycle(rest.pose, rest, [LOAD * 1.2, LOAD * 1.4], substeps=4)
    np.testing.assert_allclose(test.history.tip[1:], more.tip, atol=1e-12)
    assert test.breakaway is None
    assert "goes on from a rest with friction" in str(test)


def test_going_up_and_down_leaves_a_loop() -> None:
    arm = rod(0.1)
    rest = cdsm.forward_statics(arm, tension=[3.3122])
    way = [[5.2522], [3.3122]]
    loop = cdsm.load_cycle(rest.pose, rest, np.zeros((2, 6)), motors=way, substeps=16)
    assert distance(loop.tip[1], rest.pose.tip[:3, 3]) == pytest.approx(18.5, abs=0.1)
    assert loop.dissipated.sum() > 1e-4


def test_what_friction_cannot_answer_is_refused() -> None:
    arm = rod(0.1)
    with pytest.raises(cdsm.InvalidInput, match="no history"):
        cdsm.forward_statics(arm, tension=[3.0], start=np.zeros(arm.nv))
    with pytest.raises(cdsm.InvalidInput, match="True or False"):
        cdsm.forward_statics(arm, tension=[3.0], friction=0.1)  # type: ignore[arg-type]
    pose = cdsm.forward_statics(arm, tension=[1.0], friction=False, start=np.zeros(arm.nv)).pose
    assert "without the friction" in str(cdsm.equilibrium(pose, [1.0]))
    assert "without the friction" in str(cdsm.critical_load(pose, [0.0, 0.0, -1.0, 0, 0, 0]))


def test_commands_and_the_view_name_the_path(tmp_path: Path) -> None:
    """Print and JSON of --tension and --pull, of stiffness and weigh, and the page of the view."""
    sentence = "with friction: pulled from slack in 8 steps; "
    motors = {"--tension": ("force", "2,1,1.5"), "--pull": ("position", "6,-9,2")}
    load = ["--load", "0,0.01,0"]
    for option, printed, told in (
        ("--tension", ["stiffness"], ["weigh", *load]),
        ("--pull", ["weigh", *load], ["stiffness"]),
    ):
        control, value = motors[option]
        arm = rod(0.1, hole_angles=THREE, control=control, EA=2e4)
        at = [str(arm.write(tmp_path / f"{control}.toml")), option, value]
        shown = CliRunner().invoke(app, [printed[0], *at, *printed[1:]]).output
        assert sentence in " ".join(shown.split()), shown
        numbers = json.loads(CliRunner().invoke(app, [*told[:1], *at, *told[1:], "--json"]).stdout)
        history = numbers["rest"]["history"] if "rest" in numbers else numbers["history"]
        assert history.startswith(sentence)
        assert history.endswith("another history ends elsewhere")
    pulled = Setting(
        q=np.zeros(arm.nv), minimum=0.0, force=np.zeros(3), pull=np.array([6e-3, -9e-3, 2e-3])
    )
    assert sentence in show(arm, pulled).problem
    assert "with friction" not in show(arm.with_friction(0.0), pulled).problem

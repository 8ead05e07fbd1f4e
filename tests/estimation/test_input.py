"""Readings and questions that are wrong are refused, with the name of what is wrong."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from cdsm.estimation.files import read_load_cells
from tests.estimation.test_loads import readme
from tests.support.pulleys import finger

POSE = readme(0.1)
F = np.full(12, 60.0)
NEGATIVE = np.r_[F[:-1], -5.0]

SAMPLE = Path(__file__).parents[2] / "examples" / "data" / "LOAD_CELLS.csv"


def test_faults_of_a_file_name_the_reading(tmp_path: Path) -> None:
    """A tension below 0 N, and angles that no encoder reads, as degrees that are called radians."""
    path = tmp_path / "cells.csv"
    arm = str(Path(__file__).parents[2] / "examples" / "arm.toml")
    words = ["estimate", arm, str(path), "--tension-std", "0.5"]
    text = SAMPLE.read_text(encoding="utf-8")
    for wrong, said in (
        (text.replace(",46.0,", ",-46.0,"), "cells.csv: empty: motor_tensions: -46 N given for"),
        (text.replace("[deg]", "[rad]"), "cells.csv: line 4: q: joint1_1 = 573.5° is outside"),
    ):
        path.write_text(wrong, encoding="utf-8")
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 1
        assert said in " ".join(result.output.split())
    noisy = text.replace("\nempty,10.01,", "\nempty,20.9,")  # beyond 20.05° by less than noise
    path.write_text(noisy, encoding="utf-8")
    assert len(read_load_cells(path, cdsm.Manipulator.read(arm))) == 2


WRONG: tuple[tuple[dict[str, Any], str], ...] = (
    ({"motor_tensions": F[1:]}, r"motor_tensions: shape \(11,\) given, \(12,\) needed"),
    ({"motor_tensions": F * np.nan}, "motor_tensions: .*nan"),
    ({"motor_tensions": NEGATIVE}, "motor_tensions: -5 N given for cable4_3; cables only pull"),
    (
        {"motor_tensions": 0 * F, "tension_std": None},
        "tension_std: 1 % of the largest reading, 0 N, tells nothing; give",
    ),
    ({"tension_std": -0.5}, "tension_std: -0.5 given for cable1_1; .* not negative"),
    ({"tension_std": 0.0}, "tension_std: 0 given for cable1_1; a load cell is not exact"),
    ({"tension_std": 1e-300}, "tension_std: 1e-300 given for cable1_1; a load cell is not exact"),
    ({"tension_std": [0.5, 0.5]}, r"tension_std: shape \(2,\) given; give one number, or \(12,\)"),
    ({"tension_std": np.nan}, "tension_std: nan; finite numbers"),
    ({"angle_std": -1e-3}, "angle_std: -0.001 given for joint1_1; .* not negative"),
    ({"angle_std": np.zeros(12)}, r"angle_std: shape \(12,\) given; give one number, or \(8,\)"),
    ({"links": {"link9": "force"}}, "no link is called 'link9'"),
    ({"links": {"base_disk": "force"}}, "'base_disk' is the base"),
    ({"links": {}}, 'links: {} given; give a dict .*"tool0": "force"'),
    ({"links": ["tool0", "tool0"]}, "links: .* given; give a dict of what is sought"),
    ({"links": {"tool0": "forces"}}, r"links\['tool0'\]: 'forces' given; give .force., .moment."),
    ({"links": {"tool0": [0, 6]}}, r"links\['tool0'\]: \[0, 6\] given"),
    ({"links": {"tool0": [0, True]}}, r"links\['tool0'\]: \[0, True\] given"),
    ({"links": {"tool0": np.zeros((2, 2))}}, r"links\['tool0'\]: \[\[0.0, 0.0\], .* given"),
    ({"links": {"tool0": np.array(5.0)}}, r"links\['tool0'\]: 5.0 given"),
    ({"links": {"tool0": []}}, r"links\['tool0'\]: \[\] given"),
    ({"links": {"tool0": ["fx", 0]}}, r"links\['tool0'\]: \['fx', 0\] names a component twice"),
    (
        {"links": {"tool0": "wrench", "link2": "force"}},
        "links: 9 components sought, but the joints give 8 equations; seek fewer",
    ),
    (
        {"links": {"tool0": "force", "link4": "force"}, "points": {"link4": (0.06, 0, 0)}},
        "links: tool0 and link4 are one point of one body",
    ),
    ({"points": {"link2": (0, 0, 0)}}, "points: 'link2' is not among links"),
    ({"points": {"tool0": (0, 0)}}, r"points\['tool0'\]: shape \(2,\) given"),
    ({"points": [0, 0, 0]}, r"points: \[0, 0, 0\] given; give a dict"),
    ({"sliding": 2}, "sliding: 2 given; give 1 where the cable was last taken in"),
    ({"sliding": 0.5}, "sliding: 0.5 given"),
    ({"sliding": np.nan}, "sliding: nan"),
    ({"sliding": True}, "sliding: holds bool entries"),
    ({"sliding": [1, 1]}, r"sliding: shape \(2,\) given; give one number, one for each of the 12"),
    ({"sliding": {"cable9": 1}}, "no cable is called 'cable9'"),
    ({"sliding": {"cable4_3": [1]}}, r"sliding\['cable4_3'\]: shape \(1,\) given; .* its 7 holes"),
    ({"sliding": {"cable1_1": 3}}, r"sliding\['cable1_1'\]: 3 given"),
    ({"wrench": [1, 2, 3]}, r"wrench: shape \(3,\) given"),
    ({"pose": POSE.arm}, "pose: .* a Posture is needed"),
)


@pytest.mark.parametrize(("given", "said"), WRONG, ids=[said[:40] for _, said in WRONG])
def test_wrong_input_is_named(given: dict[str, Any], said: str) -> None:
    call: dict[str, Any] = {"pose": POSE, "motor_tensions": F, "tension_std": 0.5, **given}
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.estimate_load(call.pop("pose"), call.pop("motor_tensions"), **call)


def test_all_joints_at_stops_are_named() -> None:
    arm = readme(joint_limit=0.2).arm
    with pytest.raises(cdsm.InvalidInput, match="all joints are at their stops"):
        cdsm.estimate_tensions(arm.at(arm.upper), F, tension_std=0.5)
    q = np.r_[arm.upper[:6], 0.0, 0.0]
    with pytest.raises(cdsm.InvalidInput, match="2 equations, since a stop holds joint1_1"):
        cdsm.estimate_load(arm.at(q), F, tension_std=0.5)


@pytest.mark.parametrize(
    ("sliding", "known"),
    [
        (None, 0),
        (0, 0),
        (1, 48),
        (-1, 48),
        (np.ones(12), 48),
        ({"cable2_1": [1, 0, -1]}, 2),
        ({}, 0),
    ],
)
def test_every_way_to_say_how_cables_slid(sliding: Any, known: int) -> None:
    found = cdsm.estimate_load(POSE, F, tension_std=0.5, sliding=sliding)
    assert np.count_nonzero(found.sliding) == known
    assert "direction of sliding" in str(found)


def test_arms_without_geometry_and_with_pulleys() -> None:
    pose = finger().at([0.2, 0.4, 0.5, 0.3])
    found = cdsm.estimate_load(pose, np.full(9, 20.0), tension_std=0.1)
    assert found.names == ("fx at l3", "fy at l3", "fz at l3")
    assert "no friction" in str(found)


def test_a_joint_far_beyond_its_limit_is_doubted() -> None:
    arm = POSE.arm
    q = POSE.q.copy()
    q[0] = arm.upper[0] + 0.2
    for found in (
        cdsm.estimate_tensions(arm.at(q, check_limits=False), F, tension_std=0.5),
        cdsm.estimate_load(arm.at(q, check_limits=False), F, {"tool0": "force"}, tension_std=0.5),
    ):
        told = next(text for text in found.warnings if text.startswith("read beyond a limit"))
        assert f"{arm.joint_names[0]} by 11.46°" in told
        assert told in " ".join(str(found).split())
    q[0] = arm.upper[0] + 0.05  # an encoder's noise
    near = cdsm.estimate_tensions(arm.at(q, check_limits=False), F, tension_std=0.5)
    assert not any("beyond" in text for text in near.warnings)

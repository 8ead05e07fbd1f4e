"""What errors say: the words of each message, and how many names it holds."""

import math

import numpy as np
import pytest

import cdsm
from cdsm.errors import LINES, listed


def test_angles_beyond_their_limits_are_named_in_their_units() -> None:
    arm = cdsm.presets.virtual_prototype()
    q = np.full(arm.nv, 0.1)
    q[:6] = 2.0
    with pytest.raises(cdsm.JointLimitError) as caught:
        arm.at(q)
    error = caught.value
    assert error.problem.startswith("joint1_1 = 114.6° is outside -")
    assert error.problem.endswith("; and 2 more")
    assert str(error).startswith(f"{error.problem}. Stay inside the limits")
    assert error.joints == arm.joint_names[:6]
    assert error.angles == (2.0,) * 6
    assert error.limits == ((arm.lower[0], arm.upper[0]),) * 6


def test_only_the_first_tensions_outside_a_law_are_named() -> None:
    error = cdsm.ElasticityRangeError("too far.", range(1, 7), range(6), list("abcdef"))
    assert (
        str(error)
        == "tension 1 N, 2 N, 3 N, 4 N, and 2 more (cable a, b, c, d, and 2 more): too far."
    )
    assert error.cables == tuple("abcdef")
    assert str(cdsm.ElasticityRangeError("too far.", [5.0])) == "tension 5 N: too far."
    assert str(cdsm.ElasticityRangeError("too far.", cables=["a", "b"])) == "cable a, b: too far."


@pytest.mark.parametrize(
    ("relaxation", "fixed", "remedy"),
    [
        (1.00001, (), "Widening every bound by 1.001 N would be enough (cables at a bound: a, b)."),
        (12345.6, (), "Widening every bound by 1.235e+04 N would be enough"),
        (math.inf, (), "No bounds would help: the cables cannot exert this torque at all."),
        (math.inf, ("c",), "Beside the fixed tensions no bounds of the other cables help: change"),
    ],
)
def test_infeasible_tension_says_what_would_help(
    relaxation: float, fixed: tuple[str, ...], remedy: str
) -> None:
    missing = np.array([0.5, -2.0])
    error = cdsm.InfeasibleTension(missing, "j2", relaxation, ["a", "b"], ("N m", "N"), fixed)
    assert "2.5 N m are missing, most of it (2 N) at j2. " in str(error)
    assert remedy in str(error)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (50.0, "but the nearest found is 0.04 and 0.06 N/mm. Raise starts="),
        (500.0, ". Ask for a stiffness within it, or widen it"),
    ],
)
def test_unreachable_stiffness_names_the_range_or_the_nearest(target: float, words: str) -> None:
    u = np.array([0.0, 0.6, -0.8])
    error = cdsm.UnreachableStiffness(u, target, 10.0, 100.0, [40, 60])
    assert f"give {target / 1e3:g} N/mm along (0, 0.6, -0.8): the range is 0.01 to 0.1 N/mm" in str(
        error
    )
    assert words in str(error)
    assert error.nearest == (40.0, 60.0)


def test_unknown_name_shows_some_known_names_and_a_remedy() -> None:
    error = cdsm.UnknownName("link", "lnk3", (f"link{i}" for i in range(20)), "Look again.")
    assert str(error).startswith("no link is called 'lnk3'; did you mean 'link3' or ")
    assert str(error).endswith("link10, link11, and 8 more. Look again.")
    assert len(error.known) == 20
    assert str(cdsm.UnknownName("link", 7, ["a"])) == "no link is called 7. Known: a."


def test_faults_are_listed_line_by_line() -> None:
    assert listed(["a", "b", "c"], 2) == "a, b, and 1 more"
    assert listed(["a", "b", "c"], 2, LINES) == "\n  - a\n  - b\n  - and 1 more"
    error = cdsm.GeometryError(["no joints"], "arm.toml")
    assert str(error) == "arm.toml: invalid geometry:\n  - no joints"
    assert cdsm.StoreError("x", "is full", ["a", "b"]).differences == ("a", "b")

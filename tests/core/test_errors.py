"""What errors say: the words of each message, and how many names it holds."""

import math

import numpy as np
import pytest

import cdsm
from cdsm.errors import counted, first_of, listed


def test_joints_beyond_their_limits_are_named_in_their_units() -> None:
    names = [f"j{i}" for i in range(6)]
    error = cdsm.JointLimitError(
        names, [2.0] * 6, [(-1.0, 1.0)] * 6, ["rad", "m", "rad", "rad", "rad", "rad"]
    )
    turned = "j0 = 114.6° is outside -57.3° to 57.3° (2 rad of -1 to 1 rad)"
    assert error.problem.startswith(
        f"{turned}; j1 = 2000 mm is outside -1000 mm to 1000 mm (2 m of -1 to 1 m); j2 = "
    )
    assert error.problem.endswith("; and 2 joints more")
    assert str(error).startswith(f"{error.problem}. Stay inside the limits")
    assert error.joints == tuple(names)
    assert error.limits == ((-1.0, 1.0),) * 6


def test_only_the_first_tensions_outside_a_law_are_named() -> None:
    error = cdsm.ElasticityRangeError("too far.", range(1, 7), range(6), list("abcdef"))
    assert str(error) == "tension 1, 2, 3, 4, … N (cable a, b, c, d, …): too far."
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
    assert str(error).endswith("link10, link11, …. Look again.")
    assert len(error.known) == 20
    assert str(cdsm.UnknownName("link", 7, ["a"])) == "no link is called 7. Known: a."


def test_long_paths_are_cut_in_the_message_alone() -> None:
    error = cdsm.StoreError("x" * 2000, "is full", ["a", "b"])
    assert str(error) == f"{'x' * 1000}…: is full"
    assert error.path == "x" * 2000
    assert error.differences == ("a", "b")


def test_faults_are_counted_and_listed() -> None:
    assert counted(["a"]) == "1 fault:\n  - a"
    assert counted(["a", "b", "c"], most=2) == "3 faults:\n  - a\n  - b\n  and 1 more"
    assert listed(["a", "b"], most=2) == "\n  - a\n  - b"
    assert first_of(["a", "b", "c"], 2, "cables") == "a; b; and 1 cables more"
    error = cdsm.GeometryError(["no joints"], "arm.toml")
    assert str(error) == "arm.toml: invalid geometry, 1 fault:\n  - no joints"

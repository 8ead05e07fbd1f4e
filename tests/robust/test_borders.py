"""What no caller means: paths, names, flags, counts and magnitudes, each refused by its name."""

import errno
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.files import write_file
from tests.support.arms import random_arm, random_posture

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
PULL = cdsm.distribute_tension(POSE, minimum=10.0)
K = cdsm.stiffness(POSE, PULL)
UP = (0.0, 0.0, 1.0)


# --- names and paths ------------------------------------------------------------------------


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("old", encoding="utf-8")

    def full(aside: Path) -> None:
        aside.write_text("half", encoding="utf-8")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(cdsm.FileError, match="cannot be written: No space left on device"):
        write_file(path, full)
    assert [each.read_text(encoding="utf-8") for each in tmp_path.iterdir()] == ["old"]


# --- flags ----------------------------------------------------------------------------------

Q, F = POSE.q[None], PULL.values[None]

FLAGS: dict[str, Callable[[Any], object]] = {
    "check_limits of at": lambda flag: ARM.at(POSE.q, check_limits=flag),
    "check_limits of evaluate": lambda flag: cdsm.evaluate(ARM, Q, F, check_limits=flag),
    "check_inertia": lambda flag: cdsm.Manipulator.from_urdf(
        ARM.urdf, ARM.cables, tip="tool0", check_inertia=flag
    ),
    "at_least of plan_stiffness": lambda flag: cdsm.plan_stiffness(
        POSE, UP, K.along(UP), 10.0, 100.0, at_least=flag
    ),
}


@pytest.mark.parametrize("given", [np.array([True, False]), 1])
@pytest.mark.parametrize("what", FLAGS)
def test_a_flag_is_true_or_false(what: str, given: object) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"^{what.split()[0]}: .*True or False is needed"):
        FLAGS[what](given)
    FLAGS[what](np.True_)


# --- counts and magnitudes ------------------------------------------------------------------

COUNTS: dict[str, tuple[Callable[[Any], object], str]] = {
    "steps": (lambda n: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=n), "1 to 1000"),
    "count": (lambda n: cdsm.RandomPoses(n), f"1 to {2**30}"),
    "count of a path": (lambda n: cdsm.PathPoses(np.eye(2), n), f"2 to {2**30}"),
}


@pytest.mark.parametrize("given", [10**30, 0, 2.0, True])
@pytest.mark.parametrize("what", COUNTS)
def test_a_count_is_bounded(what: str, given: object) -> None:
    call, bounds = COUNTS[what]
    name = what.split()[0]
    with pytest.raises(
        cdsm.InvalidInput, match=f"^{name}: .* whole number from {bounds} is needed"
    ):
        call(given)


@pytest.mark.parametrize("target", [1e15, 1e-12])
def test_targets_at_the_ends_of_what_is_taken_have_an_answer(target: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(cdsm.UnreachableStiffness):
            cdsm.plan_stiffness(POSE, UP, target, 10.0, 100.0)
        both = ((1.0, 0.0, 0.0), UP)
        assert not cdsm.plan_stiffness(POSE, both, (target, target), 10.0, 100.0).reached


# --- tables ---------------------------------------------------------------------------------


def test_tables_of_pandas_are_the_numbers_they_hold() -> None:
    pandas: Any = pytest.importorskip("pandas")
    q, tension = np.tile(POSE.q, (3, 1)), np.tile(PULL.values, (3, 1))
    angles = pandas.DataFrame(q, columns=ARM.joint_names)
    expected = cdsm.evaluate(ARM, q, tension)
    found = cdsm.evaluate(ARM, angles, pandas.DataFrame(tension))
    for name in expected.outputs:
        np.testing.assert_array_equal(found[name], expected[name])
    np.testing.assert_array_equal(ARM.at(angles.iloc[0]).tip, POSE.tip)
    for other in (angles.astype(object), angles.astype(str)):
        with pytest.raises(cdsm.InvalidInput, match="q: holds object entries, such as"):
            cdsm.evaluate(ARM, other, tension)

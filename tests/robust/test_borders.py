"""Flags, counts, magnitudes and tables at the ends of what is taken; a disk that is full."""

import errno
import os
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


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("old", encoding="utf-8")

    def full(aside: Path) -> None:
        aside.write_text("half", encoding="utf-8")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(cdsm.FileError, match="cannot be written: No space left on device"):
        write_file(path, full)
    assert [each.read_text(encoding="utf-8") for each in tmp_path.iterdir()] == ["old"]


COUNTS: tuple[tuple[Callable[[Any], object], str], ...] = (
    (lambda n: cdsm.weight_test(POSE, PULL, (0.0, 0.0, -1.0), steps=n), "steps: .* from 1 to 1000"),
    (lambda n: cdsm.RandomPoses(n), f"count: .* from 1 to {2**30}"),
    (lambda n: cdsm.PathPoses(np.eye(2), n), f"count: .* from 2 to {2**30}"),
)


@pytest.mark.parametrize(("call", "said"), COUNTS)
def test_a_count_is_bounded_and_a_flag_is_true_or_false(
    call: Callable[[Any], object], said: str
) -> None:
    given: Any
    for given in (10**30, 0, 2.0, True):
        with pytest.raises(cdsm.InvalidInput, match=f"^{said} is needed"):
            call(given)
    for given in (np.array([True, False]), 1):
        with pytest.raises(cdsm.InvalidInput, match=r"^check_limits: .*True or False is needed"):
            ARM.at(POSE.q, check_limits=given)
    ARM.at(POSE.q, check_limits=np.True_)  # type: ignore[arg-type]


def test_tables_of_pandas_are_the_numbers_they_hold() -> None:
    pandas: Any = pytest.importorskip("pandas")
    q, tension = np.tile(POSE.q, (3, 1)), np.tile(PULL.values, (3, 1))
    angles = pandas.DataFrame(q, columns=ARM.joint_names)
    found = cdsm.evaluate(ARM, angles, pandas.DataFrame(tension))
    np.testing.assert_array_equal(found["tip"], cdsm.evaluate(ARM, q, tension)["tip"])
    with pytest.raises(cdsm.InvalidInput, match="q: holds object entries, such as"):
        cdsm.evaluate(ARM, angles.astype(object), tension)

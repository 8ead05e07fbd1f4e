"""Results: what their ``repr`` computes, and that no number of an export overwrites another."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.errors import SingularStiffness
from cdsm.support.result import Result, quantity, unit
from tests.support import foreign
from tests.support.arms import mixed_arm, random_posture


@dataclass(frozen=True, eq=False, repr=False)
class Example(Result):
    """A result with a headline and a number that does not exist."""

    _headline = "sum"

    @quantity("N")
    def sum(self) -> float:
        return 3.0

    @quantity("N/m")
    def missing(self) -> float:
        raise SingularStiffness("K_θ is singular", None)  # type: ignore[arg-type]


class OfMissing(Example):
    """A result whose headline does not exist."""

    _headline = "missing"


@dataclass(frozen=True, eq=False, repr=False)
class Twice(Result):
    """A result with two numbers of one name and unit."""

    force: float = field(default=3.0, metadata=unit("N"))
    other: float = field(default=4.0, metadata=unit("N", name="force"))


def test_repr_computes_the_headline_only():
    assert repr(Example()) == "<Example sum 3 N>"
    assert repr(OfMissing()) == "<OfMissing>"


def test_no_number_of_the_json_overwrites_another():
    with pytest.raises(AssertionError, match="force_N"):
        Twice().to_dict()


def test_json_of_a_report_keeps_the_residual_of_each_joint():
    arm = mixed_arm()
    K = cdsm.stiffness(random_posture(arm, 3), [20.0] * len(arm.cables))
    report = K.report()
    numbers = report.to_dict()
    assert numbers["residual_Nm"] == K.to_dict()["residual_Nm"]
    assert numbers["largest_residual_Nm"] == report.largest_residual


def test_json_has_one_key_for_each_unit() -> None:
    pose = foreign.crab().at(foreign.POSTURE)
    K = cdsm.stiffness(pose, foreign.TENSION)
    numbers: Any = K.to_dict()
    assert not [name for name in numbers if "_or_" in name]
    names = pose.arm.joint_names
    slides = dict(zip(names, pose.arm.slides.tolist(), strict=True))
    assert numbers["margin_Nm_per_rad_1m_as_1rad"] == K.margin
    for own, kind in (("Nm_per_rad", 0), ("N", 1), ("N_per_m", 2)):
        for row, entries in numbers[f"joint_stiffness_{own}"].items():
            for column, value in entries.items():
                assert slides[row] + slides[column] == kind
                assert value == K.joint[names.index(row), names.index(column)]
    assert numbers["residual_N"].keys() == {name for name in names if slides[name]}
    assert numbers["residual_Nm"].keys() == {name for name in names if not slides[name]}
    history: Any = cdsm.load_cycle(pose, foreign.TENSION, np.zeros((1, 6))).to_dict()
    assert not [name for name in history if "_or_" in name]
    assert history["angles_m"].keys() == numbers["residual_N"].keys()

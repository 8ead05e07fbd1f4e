"""Where a search for parameters begins: at values of the arm, typical ones, or many points."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

import cdsm
from cdsm.identification import Identification, identify
from tests.identification.test_loops import hinge, measured
from tests.identification.test_search import EXACT, prototype

DATA = Path(__file__).parents[1] / "data"


def test_a_minimum_that_is_refused_is_left_for_a_better_one() -> None:
    """χ² over s has a shallow minimum near 0.7, beside which the search begins, and 0 at 0.1."""

    def model_of(s: float) -> cdsm.Manipulator:
        shift = 0.01 * (s - 0.1) * ((s - 0.7) ** 2 + 0.02)
        return prototype(hole_radius=0.031 + shift, drive=4e4, lead=0.35)

    precise = [replace(measurement, std=1e-4 * measurement.std) for measurement in EXACT]
    for start in (None, {"s": 0.7}):
        fit = identify(model_of, precise, {"s": (0.0, 1.0)}, start=start)
        assert fit.parameters["s"] == pytest.approx(0.1, abs=1e-6)
        assert fit.warnings == ()


def test_friction_is_sought_from_a_typical_value() -> None:
    arm = hinge(friction=0.0)
    parameters = cdsm.ArmParameters(arm, ("friction", "rigidity", "lead", "slack"))
    assert parameters.start("friction", 0.0, 1.0) == 0.1
    assert parameters.start("friction", 0.2, 1.0) is None
    assert parameters.start("lead", 0.1, 1.0) == 0.3
    assert parameters.start("lead", 0.4, 1.0) is None
    assert parameters.start("slack", 0.0, 1e-3) is None
    fit = identify(
        cdsm.ArmParameters(arm, ("friction", "rigidity")),
        measured(0),
        {"friction": (0.0, 1.0), "rigidity": (0.5, 2.0)},
        start={"rigidity": 1.2},  # of one of them alone
    )
    assert fit.parameters["friction"] == pytest.approx(0.1, rel=0.05)
    assert fit.is_explained


NAMES = ("friction", "rigidity", "hole_radius@6")
TRUTH = 0.12, 1.0, 0.014
BOUNDS = {"friction": (0.0, 1.0), "rigidity": (0.5, 2.0), "hole_radius@6": (0.007, 0.028)}


def weighed_snake(start: dict[str, float]) -> Identification:
    """Identify an arm of twelve joints from 51 readings with errors of 10 µm."""
    arm = cdsm.Manipulator.read(DATA / "snake.toml")
    law = cdsm.Elasticity.read(DATA / "rope.toml")
    arm = arm.with_cables([replace(cable, elasticity=law) for cable in arm.cables])
    assert not arm.has_friction
    loops = cdsm.read_loops(DATA / "snake_weights.csv", arm, displacement_std=1e-5)
    return identify(cdsm.ArmParameters(arm, NAMES), loops, BOUNDS, start=start)


@pytest.mark.long
@pytest.mark.parametrize("start", [{}, {"friction": 0.5}])
def test_the_truth_is_found_though_the_file_has_no_friction(start: dict[str, float]) -> None:
    """From 0.5 the search alone ends at a friction of 0.18, with a χ² of 959."""
    fit = weighed_snake(start)
    assert fit.chi_square == pytest.approx(31.3, abs=0.05)
    for value, std, true in zip(fit.values, fit.std, TRUTH, strict=True):
        assert math.isfinite(std)
        assert abs(value - true) < 2.0 * std
    assert fit.warnings == ()

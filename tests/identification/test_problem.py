"""Measurements with weights that are not small: identification compares a secant with a secant."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.identification import Measurement, identify
from tests.support.arms import readme_geometry

STRAND = cdsm.presets.STRAND_1X19
DOWN = (0.0, 0.0, -1.0)
TRUE = {"hole_radius": 0.027, "lead": 0.35}
FREE = {"hole_radius": (0.02, 0.04), "lead": (0.05, 1.0)}


NONE = (0.0,) * 6


def snake(hole_radius: float = 0.025, lead: float = 0.3) -> cdsm.Manipulator:
    return cdsm.Manipulator(readme_geometry(hole_radius=hole_radius, lead=lead), STRAND)


BENT = tuple(np.deg2rad([10.0, 5.0, 10.0, 5.0, -8.0, 0.0, -8.0, 0.0]).tolist())


def weighed(
    arm: cdsm.Manipulator, force: float, *, minimum: float, wrench: tuple[float, ...] = NONE
) -> list[Measurement]:
    """What weight tests on the arm measure, in three directions at two postures."""
    found = []
    for angles in (BENT, tuple(-0.5 * q for q in BENT)):
        pose = arm.at(angles)
        pull = cdsm.distribute_tension(pose, minimum, wrench=wrench)
        at: Any = {"angles": angles, "tension": tuple(pull.values.tolist()), "wrench": wrench}
        for u in (DOWN, (0.0, 1.0, 0.0), (0.0, 0.6, 0.8)):
            K = cdsm.weight_test(pose, pull, force * np.array(u)).stiffness
            found.append(Measurement(value=K, direction=u, std=0.02 * K, force=force, **at))
    return found


def predicted(measurement: Measurement, arm: cdsm.Manipulator) -> float:
    """What the model says, whatever the measurement: of a parameter without effect."""
    free = {"nothing": (0.0, 1.0)}
    found = identify(lambda nothing: arm, [measurement], free, start={"nothing": 0.5})
    return float(found.predicted[0])


def test_a_weight_on_strands_at_low_tension_does_not_measure_the_tangent() -> None:
    arm = snake()
    pose = arm.at(BENT)
    pull = cdsm.distribute_tension(pose, minimum=5.0)
    tangent = cdsm.stiffness(pose, pull).along(DOWN)
    secant = cdsm.weight_test(pose, pull, 5.0 * np.array(DOWN)).stiffness
    assert secant > 1.3 * tangent
    tensions = tuple(pull.values.tolist())
    each = Measurement(value=tangent, direction=DOWN, angles=BENT, tension=tensions, std=1.0)
    assert predicted(each, arm) == pytest.approx(tangent, rel=1e-12)
    assert predicted(replace(each, force=5.0), arm) == pytest.approx(secant, rel=1e-12)
    off = [predicted(replace(each, force=force), arm) / tangent - 1.0 for force in (1e-2, 1e-3)]
    assert abs(off[0]) < 1e-2
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.05)  # linear in the force
    # from a bound as well, and with a direction of any length
    by_bound = replace(each, tension=None, minimum=5.0, force=5.0, direction=(0.0, 0.0, -7.0))
    assert predicted(by_bound, arm) == pytest.approx(secant, rel=1e-12)
    # lifted the arm is another spring than pulled down
    up = replace(each, direction=(0.0, 0.0, 1.0), force=5.0)
    lifted = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0]).stiffness
    assert predicted(up, arm) == pytest.approx(lifted, rel=1e-12)
    assert abs(lifted / secant - 1.0) > 0.1


def test_bounds_without_an_arm_are_refused() -> None:
    arm = cdsm.Manipulator.read(Path(__file__).parents[2] / "examples" / "arm.toml")
    model = cdsm.ArmParameters(arm, ("friction", "hole_radius"))
    loop = cdsm.WeightLoop(
        direction="-z",
        angles=(0.0,) * 8,
        forces=(0.0, 2.0, 0.0),
        displacements=(0.0, 1e-3, 1e-4),
        displacement_std=1e-5,
        minimum=20.0,
    )
    for free, said in (
        ({"friction": (-1.0, 0.5)}, "friction: the bound low = -1 is given, but no arm has it: fr"),
        ({"hole_radius": (0.01, 1e9)}, r"hole_radius: the bound high = 1e\+12 mm is given, but no"),
    ):
        with pytest.raises(cdsm.InvalidInput, match=said):
            cdsm.identify(model, [loop], free)
    model.require_arms("friction", 0.0, 1.0)


def test_parameters_are_recovered_from_secants_with_a_payload() -> None:
    payload = (0.0, 0.0, -2.0, 0.0, 0.0, 0.0)
    exact = weighed(snake(**TRUE), 3.0, minimum=10.0, wrench=payload)
    found = identify(snake, exact, FREE, start={"hole_radius": 0.03, "lead": 0.5})
    for name, true in TRUE.items():
        assert found.parameters[name] == pytest.approx(true, rel=1e-6)
    assert found.chi_square < 1e-10
    # neither is the payload part of the force, nor can the one or the other be left out
    for wrong, off in (({"force": 0.0}, 0.02), ({"force": 5.0}, 1e-3), ({"wrench": NONE}, 1e-3)):
        biased = identify(snake, [replace(each, **wrong) for each in exact], FREE, start=TRUE)  # type: ignore[arg-type]
        assert max(abs(biased.parameters[name] / TRUE[name] - 1.0) for name in TRUE) > off

"""Arms with errors are arms built with them; sensitivities are limits of differences."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.quantities import names_of
from cdsm.status import Status
from cdsm.tolerancing.budget import Uncertainty
from cdsm.tolerancing.measurand import measurand_of
from tests.support import arms
from tests.support.foreign import POSTURE, TENSION, crab

U = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
Q = np.deg2rad([10, 5, -8, 12, 3, -6])
W = np.array([1.0, -2.0, 3.0, 0.1, 0.05, -0.1])
F = np.linspace(30.0, 60.0, 9)
ERRORS = {
    "rigidity": 0.05,
    "spring": 0.2,
    "lead": 0.01,
    "hole_radius": 1e-3,
    "disk_offset": 1e-3,
    "link_length": 2e-3,
    "link_mass": 0.05,
    "joint_angle": 0.02,
    "tension": 2.0,
}


def posture(**errors: float) -> cdsm.Posture:
    """Return the posture of an arm that is built with errors of all inputs of each source."""
    sizes = {name: size + errors.get(name, 0.0) for name, size in arms.README_SIZES.items()}
    geometry = arms.readme_geometry(joints=3, **sizes)
    law = cdsm.LinearElasticity(3e4 * (1.0 + errors.get("rigidity", 0.0)))
    series = 2e5 * (1.0 + errors.get("spring", 0.0))
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=series)
    return cdsm.Manipulator(geometry, cables=cables).at(Q + errors.get("joint_angle", 0.0))


def number(of: str, **errors: float) -> float:
    """Compute a measurand of such an arm by the functions for one posture."""
    pose = posture(**errors)
    if of in ("tension", "distributed"):
        tension = cdsm.distribute_tension(pose, 20.0, wrench=W)
        F_4 = float(tension.values[4])
        return F_4 if of == "tension" else cdsm.stiffness(pose, tension).along(U)
    K = cdsm.stiffness(pose, F + errors.get("tension", 0.0), W)
    return {"along": K.along(U), "margin": K.margin, "tip_along": float(U @ pose.tip[:3, 3])}[of]


def asked(of: str) -> dict[str, Any]:
    """Return the arguments of `uncertainty` for the same measurand."""
    pose, again = posture(), of in ("tension", "distributed")
    return {
        "pose": pose,
        "tension": cdsm.distribute_tension(pose, 20.0, wrench=W) if again else F,
        "wrench": None if again else W,
        "of": "along" if of == "distributed" else of,
        "direction": None if of in ("tension", "margin") else U,
        "cable": pose.arm.cables.names[4] if of == "tension" else None,
        "redistribute": of == "distributed",
    }


EVERY = (*names_of("uncertainty"), "distributed")


@pytest.mark.parametrize("of", EVERY)
@pytest.mark.parametrize("source", ERRORS)
def test_a_drawn_arm_is_the_arm_built_with_these_dimensions(source: str, of: str) -> None:
    question, error = measurand_of(**asked(of)), ERRORS[source]
    count = len(question.inputs.labels[source])
    (found,), status = question.of_arms({source: np.full((1, count), error)})
    assert status[0] == Status.OK
    assert found[0] == pytest.approx(number(of, **{source: error}), rel=1e-11)


@pytest.mark.parametrize("of", EVERY)
@pytest.mark.parametrize("source", ERRORS)
def test_sensitivities_are_the_limits_of_differences(source: str, of: str) -> None:
    """Their error falls with the square of the tolerance, for each source common to its inputs."""

    def budget(part: float) -> Uncertainty:
        tolerances = cdsm.Tolerances(**{source: cdsm.Tolerance(part * ERRORS[source])})
        return cdsm.uncertainty(**asked(of), tolerances=tolerances)

    h = ERRORS[source] / 100.0
    near = [
        (number(of, **{source: x}) - number(of, **{source: -x})) / (2.0 * x) for x in (h, 2 * h)
    ]
    exact = (4.0 * near[0] - near[1]) / 3.0
    errors = [abs(budget(part).sensitivities[source].sum() - exact) for part in (1.0, 0.5)]
    size = max(abs(exact), 1e-3 * abs(number(of)) / ERRORS[source])
    assert errors[1] < 2e-4 * size
    assert errors[1] < 0.26 * errors[0] or errors[0] < 1e-8 * size


def each_its_own() -> cdsm.Manipulator:
    ways: Any = ({}, {"series_stiffness": 3e5}, {"control": "force"})
    strand, plain = cdsm.presets.STRAND_1X19, arms.random_arm(3, 3)
    return plain.with_cables(
        [replace(each, elasticity=strand, **ways[c % 3]) for c, each in enumerate(plain.cables)]
    )


@pytest.mark.parametrize("make", [arms.mixed_arm, each_its_own])
def test_errors_of_sites_and_rigidities_are_those_of_other_cables(
    make: Callable[[], cdsm.Manipulator],
) -> None:
    """With segments within one body, springs, strands, and motors that hold forces."""
    rng = np.random.default_rng(3)
    arm, wrench = make(), arms.random_wrench(4)
    pose, tension = arms.random_posture(arm, 11), arms.random_tension(arm, 5)
    question = measurand_of(pose, tension, U, "along", None, wrench, redistribute=False)
    labels = question.inputs.labels
    errors = {
        "site": rng.normal(0.0, 1e-3, (2, len(labels["site"]))),
        "rigidity": rng.normal(0.0, 0.1, (2, len(arm.cables))),
    }
    found, _ = question.of_arms(errors)
    same, _ = question.of_arms({source: np.zeros_like(each) for source, each in errors.items()})
    np.testing.assert_allclose(same, question.value()[None].repeat(2, axis=0), rtol=1e-10)
    for n in range(2):
        moved, cables = iter(errors["site"][n].reshape(-1, 3)), []
        for cable, change in zip(arm.cables, errors["rigidity"][n], strict=True):
            sites = [replace(s, position=s.position + next(moved)) for s in cable.sites]
            law = cable.elasticity.scaled(1.0 + change)
            cables.append(replace(cable, sites=tuple(sites), elasticity=law))
        built = arm.with_cables(cables).at(pose.q)
        assert found[n, 0] == pytest.approx(
            cdsm.stiffness(built, tension, wrench).along(U), rel=1e-10
        )


def test_joints_that_slide_have_their_own_tolerance() -> None:
    """√Σ (u ∂K/∂q)² over the joints that turn, and over those that slide."""
    arm = crab()
    assert 0 < arm.slides.sum() < arm.nv
    given = cdsm.Tolerances(joint_angle=1e-3, joint_position=2e-4)
    found = cdsm.uncertainty(arm.at(POSTURE), TENSION, given, direction=U).contributions
    slopes = []
    for step in 1e-5 * np.eye(arm.nv):
        ends = [cdsm.stiffness(arm.at(POSTURE + s * step), TENSION).along(U) for s in (1, -1)]
        slopes.append((ends[0] - ends[1]) / 2e-5)
    of = np.array(slopes)
    assert found["joint_angle"] == pytest.approx(1e-3 * np.linalg.norm(of[~arm.slides]), rel=1e-4)
    assert found["joint_position"] == pytest.approx(2e-4 * np.linalg.norm(of[arm.slides]), rel=1e-4)
    with pytest.raises(cdsm.InvalidInput, match="has no joints that slide"):
        cdsm.uncertainty(posture(), F, cdsm.Tolerances(joint_position=1e-4), direction=U)

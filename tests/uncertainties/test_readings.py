"""Gradients of readings: against differences, and the drawn arms against arms built anew."""

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from cdsm.tolerances import SOURCES
from cdsm.uncertainties.drawn import DrawnArms
from cdsm.uncertainties.question import checked_question
from cdsm.uncertainties.readings import Question, Reading
from tests.support import arms
from tests.support.differences import assert_second_order

U = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])

# displacements that change each input by some hundredths of itself
STEPS = {
    "rigidity": 2e-2,
    "spring": 2e-2,
    "joint_angle": 5e-3,
    "tension": 1.0,
    "lead": 5e-3,
    "link_mass": 2e-2,
    "hole_angle": 5e-3,
}


def _arm(kind: str) -> cdsm.Manipulator:
    if kind == "mixed":
        return arms.mixed_arm()
    plain = arms.random_arm(3, 3, kind.partition("-")[0])
    if not kind.endswith("-each"):
        return plain
    cables = [
        replace(
            cable,
            elasticity=cdsm.presets.STRAND_1X19,
            series_stiffness=3e5 if c % 3 == 1 else np.inf,
            control="force" if c % 3 == 2 else "position",
        )
        for c, cable in enumerate(plain.cables)
    ]
    return plain.with_cables(cables)


def _question(kind: str, of: str, moment: bool) -> Question:
    arm, wrench = _arm(kind).with_friction(0.1), arms.random_wrench(4, moment)
    pose, F = arms.random_posture(arm, 11), arms.random_tension(arm, 5)
    given = of == "tension"
    tension = cdsm.distribute_tension(pose, 20.0, wrench=wrench) if given else F
    return checked_question(
        pose,
        tension,
        U if of in ("along", "tip") else None,
        of,  # type: ignore[arg-type]
        arm.cables[-1].name if of == "tension" else None,
        None if given else wrench,
    )


@pytest.mark.parametrize("of", get_args(Reading))
@pytest.mark.parametrize("moment", [False, True])
@pytest.mark.parametrize("kind", ["universal", "hinged", "mixed", "universal-each"])
def test_gradients_are_the_limits_of_differences(kind: str, moment: bool, of: str) -> None:
    question = _question(kind, of, moment)
    gradient = question.gradient()
    assert set(gradient) == set(SOURCES)
    rng = np.random.default_rng(7)
    rounding = 1e3 * np.finfo(float).eps * abs(question.value())
    for source, partials in gradient.items():
        if not partials.size:  # no springs
            continue
        # a handful of directions in the space of the inputs replaces hundreds of columns
        ways = rng.normal(size=(4, partials.size))
        ways *= STEPS.get(source, 1e-4) / abs(ways).max(axis=1, keepdims=True)
        expected = ways @ partials

        def difference(part: float, source: str = source, ways: Array = ways) -> Array:
            both = question.at({source: part * ways}) - question.at({source: -part * ways})
            return both / (2.0 * part)

        one, half = difference(1.0), difference(0.5)
        fourth = difference(0.25)
        # the error of h² is extrapolated away; h⁴ and rounding are left
        extrapolated = (16.0 * (4.0 * fourth - half) / 3.0 - (4.0 * half - one) / 3.0) / 15.0
        left = 1e-6 * abs(expected).max() + 10.0 * rounding
        assert abs(extrapolated - expected).max() < left, source
        errors = np.array([abs(each - expected).max() for each in (one, half)])
        if errors[1] > 1e2 * rounding:
            assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1), source


@pytest.mark.parametrize("kind", ["universal", "mixed", "universal-each"])
def test_a_draw_without_errors_is_the_arm_itself(kind: str) -> None:
    K = _question(kind, "margin", moment=True).stiffness
    drawn = DrawnArms(K, {"joint_angle": np.zeros((2, K.posture.arm.nv))}).evaluate()
    # EA + F or EA (1 + ε), rounded
    np.testing.assert_allclose(drawn.joint[1], K.joint, rtol=0.0, atol=1e-14 * abs(K.joint).max())
    np.testing.assert_allclose(drawn.length_jacobian[1], K.posture.length_jacobian, atol=1e-15)
    np.testing.assert_allclose(drawn.tip[1], K.posture.tip[:3, 3], rtol=1e-14, atol=1e-15)
    torque = K.posture.jacobian.T @ K.wrench - K.posture.gravity_torque
    np.testing.assert_allclose(drawn.torque[1], torque, rtol=1e-12, atol=1e-14)


def _with(**changes: float) -> Callable[[], cdsm.Manipulator]:
    sizes = {
        "link_length": 0.06,
        "disk_offset": 0.012,
        "hole_radius": 0.025,
        "link_mass": 0.12,
        "lead": 0.3,
    }
    rigidity, spring = (changes.pop(name, 0.0) for name in ("rigidity", "spring"))

    def build() -> cdsm.Manipulator:
        given = {name: size + changes.get(name, 0.0) for name, size in sizes.items()}
        geometry = cdsm.Geometry.universal(joints=3, cables_per_joint=3, base_length=0.03, **given)  # type: ignore[arg-type]
        law, series = cdsm.LinearElasticity(3e3 * (1.0 + rigidity)), 2e4 * (1.0 + spring)
        return cdsm.Manipulator(
            geometry, cables=cdsm.serpentine_cables(geometry, law, series_stiffness=series)
        )

    return build


@pytest.mark.parametrize("of", ["along", "margin", "tip"])
@pytest.mark.parametrize(
    ("source", "error"),
    [
        ("rigidity", 0.05),
        ("spring", 0.2),
        ("lead", 0.01),
        ("hole_radius", 1e-3),
        ("disk_offset", 1e-3),
        ("link_length", 2e-3),
        ("link_mass", 0.05),
    ],
)
def test_a_drawn_arm_is_the_arm_built_with_these_dimensions(
    source: str, error: float, of: str
) -> None:
    q, W = np.deg2rad([10, 5, -8, 12, 3, -6]), np.array([1.0, -2.0, 3.0, 0.1, 0.05, -0.1])
    F = np.linspace(30.0, 60.0, 9)
    direction = None if of == "margin" else U
    nominal, built = (_with(**change)().at(q) for change in ({}, {source: error}))
    question = Question(of, cdsm.stiffness(nominal, F, W), direction)  # type: ignore[arg-type]
    count = question.gradient()[source].size
    drawn = question.at({source: np.full((1, count), error)})[0]
    expected = Question(of, cdsm.stiffness(built, F, W), direction).value()  # type: ignore[arg-type]
    assert drawn == pytest.approx(expected, rel=1e-11)  # rounding of a compliance


@pytest.mark.parametrize("source", ["joint_angle", "link_mass", "hole_radius", "link_length"])
def test_gradients_of_distributed_tensions(source: str) -> None:
    q, W = np.deg2rad([10, 5, -8, 12, 3, -6]), np.array([1.0, -2.0, 3.0, 0.1, 0.05, -0.1])

    def tension(step: float) -> cdsm.Tension:
        if source == "joint_angle":
            return cdsm.distribute_tension(_with()().at(q + step), 20.0, wrench=W)
        return cdsm.distribute_tension(_with(**{source: step})().at(q), 20.0, wrench=W)

    nominal = tension(0.0)
    K = cdsm.stiffness(nominal.posture, nominal)
    partials = np.array(
        [Question("tension", K, cable=c).gradient()[source].sum() for c in range(len(K.tension))]
    )
    assert_second_order(
        lambda t: tension(float(t[0])).values,
        partials[:, None],
        np.zeros(1),
        step=2.0**-12 if source in ("hole_radius", "link_length") else 2.0**-8,
        size=1e4,
        tolerance=1e-8,
    )

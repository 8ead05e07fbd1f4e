"""Identification finds the arm that the measurements came from, and says what they cannot tell."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.identification import Identification, Measurement, identify
from cdsm.support.values import Array

STRAND = cdsm.presets.STRAND_1X19
TRUE = {"hole_radius": 0.031, "drive": 4e4, "lead": 0.35}
FREE = {"hole_radius": (0.02, 0.05), "drive": (1e3, 1e6), "lead": (0.05, 1.0)}


def prototype(
    hole_radius: float = 0.03,
    drive: float = math.inf,
    lead: float = 0.3,
    rigidity: float | None = None,
) -> cdsm.Manipulator:
    """Three hinges of ±30°, turned 30° each, an antagonistic pair each."""
    geometry = cdsm.Geometry.hinged(
        joints=3, twist=np.deg2rad(30.0), joint_limit=np.deg2rad(30.0), link_length=0.1,
        base_length=0.05, disk_offset=0.02, hole_radius=hole_radius, link_mass=0.3, lead=lead,
    )  # fmt: skip
    law = STRAND if rigidity is None else cdsm.LinearElasticity(rigidity)
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=drive)
    return cdsm.Manipulator(geometry, cables=cables)


def measured(arm: cdsm.Manipulator, count: int = 12, *, minimum: bool = False) -> list[Measurement]:
    """Measurements without noise at random postures, directions and tensions; 2 % std."""
    rng = np.random.default_rng([0, count])
    found = []
    for i in range(count):
        q: Any = rng.uniform(-0.5, 0.5, 3)
        pose = arm.at(q)
        level = rng.uniform(20.0, 120.0)
        values: Any = level * rng.uniform(0.8, 1.2, 6)
        pull = cdsm.distribute_tension(pose, level) if minimum else values
        u: Any = rng.normal(size=3)
        K = cdsm.stiffness(pose, pull).along(u)
        given = {"minimum": level} if minimum else {"tension": values}
        found.append(
            Measurement(
                value=K, direction=u, angles=q, std=0.02 * K, label=f"posture {i + 1}", **given
            )
        )
    return found


EXACT = measured(prototype(**TRUE))
NOISE = np.random.default_rng([1, 7]).normal(size=12).tolist()
READ = [replace(m, value=m.value + m.std * z) for m, z in zip(EXACT, NOISE, strict=True)]
NOISY = identify(prototype, READ, FREE)


@pytest.mark.parametrize("minimum", [False, True])
def test_parameters_are_recovered_from_measurements_without_noise(minimum: bool) -> None:
    exact = measured(prototype(**TRUE), minimum=minimum)
    found = identify(prototype, exact, FREE)
    for name, true in TRUE.items():
        assert found.parameters[name] == pytest.approx(true, rel=1e-6)
    assert found.chi_square < 1e-12
    assert found.rank == 3
    assert found.freedom == 9
    np.testing.assert_allclose(found.predicted, found.measured, rtol=1e-9)
    assert found.arm == prototype(**found.parameters)


def test_jacobian_is_the_derivative_of_the_residuals_and_gives_the_covariance() -> None:
    def predicted(parameters: dict[str, float]) -> Array:
        arm = prototype(**parameters)
        K = [cdsm.stiffness(arm.at(m.angles), m.tension or ()).along(m.direction) for m in READ]
        return np.array(K) / [m.std for m in READ]

    J = NOISY.jacobian
    for i, (name, value) in enumerate(NOISY.parameters.items()):
        h = 1e-4 * value
        up, down = (predicted({**NOISY.parameters, name: value + s * h}) for s in (1, -1))
        near = 1e-6 * abs(J[:, i]).max()
        np.testing.assert_allclose(J[:, i], (up - down) / (2.0 * h), rtol=1e-5, atol=near)
    # and the optimum is one: the residuals are normal to the columns, but for rounding
    assert abs(NOISY.residuals @ J / np.linalg.norm(J, axis=0)).max() < 1e-5
    scale = np.outer(NOISY.std, NOISY.std)
    np.testing.assert_allclose(NOISY.covariance / scale, np.linalg.inv(J.T @ J) / scale, rtol=1e-6)
    np.testing.assert_allclose(NOISY.correlation, NOISY.covariance / scale, rtol=1e-12)
    for i, j in zip(*np.triu_indices(3, 1), strict=True):
        r = NOISY.correlation[i, j]
        named = f"{NOISY.names[i]} and {NOISY.names[j]} are correlated at {r:+.4f}"
        assert any(each.startswith(named) for each in NOISY.warnings) == (abs(r) > 0.95)


def shifted(pose: cdsm.Posture, m: Measurement, factor: float = 1.0, **given: float) -> Array:
    return factor * np.array(m.tension) + given.get("offset", 0.0)


def test_an_offset_is_found_and_the_search_steps_back_where_there_is_no_arm() -> None:
    """Of tensions that leave the domain of the law, and of springs so soft that the arm buckles."""

    def model_of(drive: float = math.inf, **_: float) -> cdsm.Manipulator:
        return prototype(drive=drive)

    real = [
        replace(m, tension=tuple(F - 4.0 for F in m.tension or ()))
        for m in measured(prototype(drive=5e4), 8)
    ]
    stiff, soft = (measured(prototype(drive=k), 6) for k in (math.inf, 3e4))
    tests: tuple[tuple[list[Measurement], Any, dict[str, float], Any], ...] = (
        (real, {"drive": (1e4, 1e6), "offset": (-10.0, 10.0)}, {"drive": 5e4, "offset": 4.0}, None),
        (stiff, {"factor": (0.01, 100.0)}, {"factor": 1.0}, None),  # the strand ends at 810 N
        (soft, {"drive": (10.0, 1e6)}, {"drive": 3e4}, {"drive": 1e6}),
    )
    for given, free, true, start in tests:
        found = identify(model_of, given, free, tension_of=shifted, start=start)
        assert found.parameters == pytest.approx(true, rel=1e-6)
        assert len(free) == 2 or found.warnings == ()


def by_product(area: float, modulus: float, hole_radius: float = 0.03) -> cdsm.Manipulator:
    return prototype(hole_radius=hole_radius, rigidity=area * modulus)


def test_parameters_that_only_act_together_are_named() -> None:
    free = {"area": (5e-7, 2e-6), "modulus": (2e10, 2e11), "hole_radius": (0.02, 0.04)}
    exact = measured(by_product(area=1e-6, modulus=5e10, hole_radius=0.03))
    found = identify(by_product, exact, free)
    assert found.rank == 2
    (sentence,) = (each for each in found.warnings if "not identifiable (rank 2 of 3)" in each)
    assert [name in sentence for name in free] == [True, True, False]
    i, j, k = (found.names.index(name) for name in free)
    assert np.isinf(found.std[[i, j]]).all()
    assert found.correlation[i, j] == pytest.approx(-1.0)
    # the third is known all the same
    assert math.isfinite(found.std[k])
    assert found.correlation[i, k] == 0.0
    assert found.parameters["hole_radius"] == pytest.approx(0.03, rel=1e-5)
    assert found.confidence()["area"] == (-math.inf, math.inf)


def test_a_model_that_ends_before_the_optimum_is_said() -> None:
    def model_of(lead: float) -> cdsm.Manipulator:
        if lead > 0.3:
            raise cdsm.InvalidInput("lead", "the tube is not that long.")
        return prototype(lead=lead)

    found = identify(
        model_of, measured(prototype(lead=0.4)), {"lead": (0.05, 1.0)}, start={"lead": 0.1}
    )
    assert 0.29 < found.parameters["lead"] <= 0.3
    assert any("the tube is not that long" in each for each in found.warnings)
    assert found.confidence()["lead"][1] == math.inf


def test_measurements_that_the_model_does_not_explain_are_named() -> None:
    wrong = [*EXACT[:4], replace(EXACT[4], value=2.0 * EXACT[4].value), *EXACT[5:]]
    found = identify(prototype, wrong, FREE)
    assert any("does not explain" in each and "posture 5" in each for each in found.warnings)


def test_the_ridge_of_two_parameters_is_where_chi_square_rises_by_one() -> None:
    fit = NOISY
    problem = fit.problem
    ridged = fit.correlated(0.9)
    assert ridged
    for i, j in ridged:
        assert abs(fit.correlation[i, j]) > 0.9
        sentence = fit.ridge(i, j)
        assert sentence in str(fit)
        ends = re.findall(rf"{fit.names[i]} (\S+), {fit.names[j]} (\S+?),? ", sentence)
        for end, side in zip(ends, (-1.0, 1.0), strict=True):
            fixed, beside = (float(number) for number in end)
            assert fixed == pytest.approx(fit.values[i] + side * fit.std[i], rel=1e-3)
            # of the linear model: the change of residuals is J Δp, and the other parameters follow
            others = [k for k in range(len(fit.names)) if k != i]
            J = fit.jacobian * fit.std
            follow = np.linalg.lstsq(J[:, others], -side * J[:, i], rcond=None)
            best = fit.values[j] + follow[0][others.index(j)] * fit.std[j]
            assert beside == pytest.approx(best, rel=1e-3)
            assert follow[1] == pytest.approx(1.0, rel=1e-3)
    assert problem.cost(problem.point(fit.values)) == pytest.approx(fit.chi_square)


ONE, SOFT = {"hole_radius": (0.02, 0.05)}, {"drive": (2e3, 4e3)}


def searched(free: Any = ONE, model_of: Any = prototype, **changes: Any) -> Identification:
    return identify(model_of, [replace(EXACT[0], **changes)], free)


CASES: dict[str, tuple[Callable[[], object], str]] = {
    "value": (lambda: replace(EXACT[0], value=-1.0), "value: -1 N/m"),
    "std": (lambda: replace(EXACT[0], std=0.0), "std: 0 N/m.*positive"),
    "force": (lambda: replace(EXACT[0], force=-2.0), "force: -2 N.*Turn the direction"),
    "tension": (lambda: replace(EXACT[0], minimum=5.0), "one of tension=.*both given"),
    "angles": (lambda: searched(angles=(10.0, 0.0, 0.0)), "posture 1: .*joint1 = 573"),
    "too few": (lambda: searched(FREE), "1 independent reading given for 3.*free fewer"),
    "free": (lambda: searched(["lead"]), r"free: \['lead'\].*{name: \(low, high\)}"),
    "bounds": (lambda: searched({"lead": (1.0, 0.1)}), r"free\['lead'\]: .*low must be below"),
    "unknown": (lambda: searched({"radios": (0.02, 0.05)}), "unexpected keyword .*'radios'"),
    "model": (lambda: searched(model_of=lambda hole_radius: 3), "model_of: 3.*a Manipulator"),
    "tensions": (lambda: searched(tension=(5.0,) * 4), r"posture 1.*\(4,\) given, \(6,\)"),
    "domain": (lambda: searched(tension=(900.0,) * 6), "posture 1.*tension 900.*810 N"),
    "way": (lambda: searched(direction=(1, 0, 0), angles=(0.0,) * 3), "posture 1: .*cannot move"),
    "buckling": (
        lambda: searched(
            SOFT, lambda drive: prototype(drive=drive, lead=40.0), tension=(700.0,) * 6
        ),
        "posture 1: the arm buckles",
    ),
    "start": (
        lambda: identify(prototype, EXACT, ONE, start={"hole_radius": 0.1}),
        r"start\['hole_radius'\]: 0.1 is outside",
    ),
    "level": (lambda: NOISY.confidence(95.0), "level: 95.*0.95"),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_names_offender_and_remedy(case: str) -> None:
    attempt, said = CASES[case]
    with pytest.raises(cdsm.InvalidInput, match=f"(?s){said}"):
        attempt()

"""Identification finds the arm that the measurements came from, and says what they cannot tell."""

import math
import pickle
from collections.abc import Callable, Sequence
from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.stats import binom, chi2

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
    mass: float = 0.3,
) -> cdsm.Manipulator:
    """Three hinges of ±30°, turned 30° each, an antagonistic pair each."""
    geometry = cdsm.Geometry.hinged(
        joints=3,
        twist=np.deg2rad(30.0),
        joint_limit=np.deg2rad(30.0),
        link_length=0.1,
        base_length=0.05,
        disk_offset=0.02,
        hole_radius=hole_radius,
        link_mass=mass,
        lead=lead,
    )
    law = STRAND if rigidity is None else cdsm.LinearElasticity(rigidity)
    cables = cdsm.serpentine_cables(geometry, law)
    return cdsm.Manipulator(geometry, cables=[replace(c, series_stiffness=drive) for c in cables])


def measured(
    arm: cdsm.Manipulator, count: int = 12, *, seed: int = 0, minimum: bool = False
) -> list[Measurement]:
    """Measurements without noise at random postures, directions and tensions; 2 % std."""
    rng = np.random.default_rng([seed, count])
    found = []
    for i in range(count):
        q = rng.uniform(-0.5, 0.5, 3)
        pose = arm.at(q)
        level = rng.uniform(20.0, 120.0)
        values = level * rng.uniform(0.8, 1.2, 6)
        pull = cdsm.distribute_tension(pose, level) if minimum else values
        direction = rng.normal(size=3)
        value = cdsm.stiffness(pose, pull).along(direction)
        found.append(
            Measurement(
                value=value,
                direction=direction,  # type: ignore[arg-type]
                angles=q,  # type: ignore[arg-type]
                tension=None if minimum else values,  # type: ignore[arg-type]
                minimum=level if minimum else None,
                std=0.02 * value,
                label=f"posture {i + 1}",
            )
        )
    return found


def noisy(measurements: Sequence[Measurement], seed: int) -> list[Measurement]:
    noise = np.random.default_rng([seed, 7]).normal(size=len(measurements))
    return [
        replace(each, value=each.value + each.std * z)
        for each, z in zip(measurements, noise, strict=True)
    ]


EXACT = measured(prototype(**TRUE))
READ = noisy(EXACT, 1)
NOISY = identify(prototype, READ, FREE)

# --- what is found --------------------------------------------------------------------------


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


@pytest.mark.long
def test_intervals_hold_the_true_parameters_as_often_as_they_say() -> None:
    seeds = 64
    held = {level: dict.fromkeys(TRUE, 0) for level in (0.95, 0.68)}
    total = 0.0
    for seed in range(seeds):
        found = identify(prototype, noisy(EXACT, seed), FREE, start=TRUE)
        total += found.chi_square
        for level, counts in held.items():
            for name, (low, high) in found.confidence(level).items():
                counts[name] += low <= TRUE[name] <= high
    for level, counts in held.items():
        fewest, most = binom.interval(0.998, seeds, level)
        for name, count in counts.items():
            assert fewest <= count <= most, (level, name, count)
    low, high = chi2.interval(0.998, seeds * (len(EXACT) - len(TRUE)))
    assert low < total < high


def test_jacobian_is_the_derivative_of_the_residuals() -> None:
    def predicted(parameters: dict[str, float]) -> Array:
        arm = prototype(**parameters)
        return np.array(
            [
                cdsm.stiffness(arm.at(m.angles), m.tension or ()).along(m.direction) / m.std
                for m in READ
            ]
        )

    for i, (name, value) in enumerate(NOISY.parameters.items()):
        h = 1e-4 * value
        up, down = ({**NOISY.parameters, name: value + s * h} for s in (1, -1))
        np.testing.assert_allclose(
            NOISY.jacobian[:, i],
            (predicted(up) - predicted(down)) / (2.0 * h),
            rtol=1e-5,
            atol=1e-6 * abs(NOISY.jacobian[:, i]).max(),
        )
    # and the optimum is one: the residuals are normal to the columns, but for rounding
    lengths = np.linalg.norm(NOISY.jacobian, axis=0)
    assert abs(NOISY.residuals @ NOISY.jacobian / lengths).max() < 1e-5


def test_covariance_is_the_inverse_of_the_normal_matrix_and_grows_with_the_std() -> None:
    J = NOISY.jacobian
    scale = np.outer(NOISY.std, NOISY.std)
    np.testing.assert_allclose(NOISY.covariance / scale, np.linalg.inv(J.T @ J) / scale, rtol=1e-6)
    np.testing.assert_allclose(NOISY.correlation, NOISY.covariance / scale, rtol=1e-12)
    doubled = [replace(each, std=2.0 * each.std) for each in READ]
    again = identify(prototype, doubled, FREE, start=NOISY.parameters)
    np.testing.assert_allclose(again.values, NOISY.values, rtol=1e-6)
    np.testing.assert_allclose(again.std, 2.0 * NOISY.std, rtol=1e-4)


@pytest.mark.slow
def test_every_start_and_order_of_parameters_leads_to_the_same_optimum() -> None:
    for start in (
        {"hole_radius": 0.021, "drive": 9e5, "lead": 0.06},
        {"hole_radius": 0.05, "drive": 1e4, "lead": 1.0},
    ):
        found = identify(prototype, NOISY.measurements, FREE, start=start)
        np.testing.assert_allclose(found.values, NOISY.values, rtol=1e-6)
    turned = identify(prototype, NOISY.measurements, dict(reversed(FREE.items())))
    assert turned.parameters == pytest.approx(NOISY.parameters, rel=1e-6)


@pytest.mark.slow
def test_a_tension_offset_is_found_through_tension_of() -> None:
    def tension_of(
        pose: cdsm.Posture, measurement: Measurement, *, offset: float, **rest: float
    ) -> Array:
        return np.array(measurement.tension) + offset

    def model_of(drive: float, **rest: float) -> cdsm.Manipulator:
        return prototype(drive=drive)

    real = [
        replace(m, tension=tuple(F - 4.0 for F in m.tension or ()))
        for m in measured(prototype(drive=5e4), 8)
    ]
    found = identify(
        model_of, real, {"drive": (1e4, 1e6), "offset": (-10.0, 10.0)}, tension_of=tension_of
    )
    assert found.parameters == pytest.approx({"drive": 5e4, "offset": 4.0}, rel=1e-6)


def test_tension_of_may_distribute() -> None:
    def tension_of(
        pose: cdsm.Posture, measurement: Measurement, *, offset: float, **rest: float
    ) -> cdsm.Tension:
        assert isinstance(measurement.minimum, float)
        return cdsm.distribute_tension(pose, measurement.minimum + offset)

    exact = measured(prototype(), 6, minimum=True)
    shifted = [replace(m, minimum=float(m.minimum or 0.0) - 3.0) for m in exact]  # type: ignore[arg-type]
    free = {"offset": (-10.0, 10.0)}
    found = identify(lambda **_: prototype(), shifted, free, tension_of=tension_of)
    assert found.parameters["offset"] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.slow
def test_a_wrench_beside_measured_tensions_is_part_of_the_prediction() -> None:
    arm, wrench, pull = prototype(mass=0.5), (0.0, 0.0, -10.0, 0.0, 0.0, 0.0), (40.0,) * 6
    exact = []
    for each in measured(arm, 6):
        value = cdsm.stiffness(arm.at(each.angles), pull, wrench).along(each.direction)
        exact.append(replace(each, value=value, std=1e-3 * value, wrench=wrench, tension=pull))
    found = identify(lambda mass: prototype(mass=mass), exact, {"mass": (0.1, 2.0)})
    assert found.parameters["mass"] == pytest.approx(0.5, rel=1e-6)
    without = [replace(each, wrench=(0.0,) * 6) for each in exact]
    found = identify(lambda mass: prototype(mass=mass), without, {"mass": (0.1, 2.0)})
    assert abs(found.parameters["mass"] - 0.5) > 0.1


# --- what cannot be known -------------------------------------------------------------------


def by_product(area: float, modulus: float, hole_radius: float = 0.03) -> cdsm.Manipulator:
    return prototype(hole_radius=hole_radius, rigidity=area * modulus)


def by_sum(tube: float, motor: float, drive: float = 4e4) -> cdsm.Manipulator:
    return prototype(lead=tube + motor, drive=drive)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model_of", "true", "free", "pair"),
    [
        (
            by_product,
            {"area": 1e-6, "modulus": 5e10, "hole_radius": 0.03},
            {"area": (5e-7, 2e-6), "modulus": (2e10, 2e11), "hole_radius": (0.02, 0.04)},
            ("area", "modulus"),
        ),
        (
            by_sum,
            {"tube": 0.2, "motor": 0.1, "drive": 4e4},
            {"tube": (0.05, 0.5), "motor": (0.0, 0.5), "drive": (1e4, 1e6)},
            ("tube", "motor"),
        ),
    ],
)
def test_parameters_that_only_act_together_are_named(
    model_of: Callable[..., cdsm.Manipulator],
    true: dict[str, float],
    free: dict[str, tuple[float, float]],
    pair: tuple[str, str],
) -> None:
    found = identify(model_of, measured(model_of(**true)), free)
    assert found.rank == 2
    sentence = next(each for each in found.warnings if "not identifiable (rank 2 of 3)" in each)
    assert all(name in sentence for name in pair)
    other = next(name for name in true if name not in pair)
    assert other not in sentence
    i, j, k = (found.names.index(name) for name in (*pair, other))
    assert np.isinf(found.std[[i, j]]).all()
    assert found.correlation[i, j] == pytest.approx(-1.0)
    # the third is known all the same, and what they make together
    assert math.isfinite(found.std[k])
    assert found.correlation[i, k] == 0.0
    assert found.parameters[other] == pytest.approx(true[other], rel=1e-5)
    assert found.confidence()[pair[0]] == (-math.inf, math.inf)
    assert not np.isnan(found.covariance).any()


def test_a_parameter_without_any_effect_is_named_alone() -> None:
    def model_of(hole_radius: float, colour: float) -> cdsm.Manipulator:
        return prototype(hole_radius)

    found = identify(
        model_of, measured(prototype(), 4), {"hole_radius": (0.02, 0.04), "colour": (0.0, 1.0)}
    )
    assert found.rank == 1
    (sentence,) = found.warnings
    assert "colour by +0.01," in sentence
    assert "hole_radius" not in sentence
    assert found.parameters["hole_radius"] == pytest.approx(0.03, rel=1e-6)
    assert found.freedom == 3


def test_nothing_identifiable_at_all_is_said() -> None:
    found = identify(lambda a: prototype(), measured(prototype(), 2), {"a": (1.0, 2.0)})
    assert found.rank == 0
    assert math.isinf(found.std[0])
    assert "no prediction changes with a by +0.01" in found.warnings[0]


def test_correlated_parameters_are_named_with_their_correlation() -> None:
    pairs = [each for each in NOISY.warnings if "are correlated at" in each]
    assert any(each.startswith("hole_radius and drive") for each in pairs)
    for i, j in zip(*np.triu_indices(3, 1), strict=True):
        r = NOISY.correlation[i, j]
        named = f"{NOISY.names[i]} and {NOISY.names[j]} are correlated at {r:+.4f}"
        assert any(each.startswith(named) for each in pairs) == (abs(r) > 0.95)


@pytest.mark.parametrize(("limits", "side"), [((0.033, 0.05), "lower"), ((0.02, 0.029), "upper")])
def test_a_bound_that_excludes_the_optimum_is_named(limits: tuple[float, float], side: str) -> None:
    free = {"hole_radius": limits, "drive": FREE["drive"]}
    exact = measured(prototype(hole_radius=0.031, drive=4e4))
    found = identify(prototype, exact, free)
    assert found.parameters["hole_radius"] == limits[0 if side == "lower" else 1]
    assert any(each.startswith(f"hole_radius is at its {side} bound") for each in found.warnings)
    assert not any(each.startswith("drive is at") for each in found.warnings)
    assert not any("no optimum" in each for each in found.warnings)


def test_a_model_that_ends_before_the_optimum_is_said() -> None:
    def model_of(lead: float) -> cdsm.Manipulator:
        if lead > 0.3:
            raise cdsm.InvalidInput("lead", "the tube is not that long.")
        return prototype(lead=lead)

    found = identify(
        model_of, measured(prototype(lead=0.4)), {"lead": (0.05, 1.0)}, start={"lead": 0.1}
    )
    assert 0.29 < found.parameters["lead"] <= 0.3
    sentence = next(each for each in found.warnings if "no optimum within the bounds" in each)
    assert "the tube is not that long" in sentence
    assert found.confidence()["lead"][1] == math.inf


def test_the_search_steps_back_from_where_tensions_leave_the_domain_or_the_arm_buckles() -> None:
    def tension_of(pose: cdsm.Posture, m: Measurement, factor: float) -> Array:
        return factor * np.array(m.tension)

    # the strand ends at 810 N, ten times below the upper bound
    found = identify(
        lambda **_: prototype(),
        measured(prototype(), 6),
        {"factor": (0.01, 100.0)},
        tension_of=tension_of,
    )
    assert found.parameters["factor"] == pytest.approx(1.0, rel=1e-6)
    assert found.warnings == ()
    # springs that soft let the arm buckle
    soft = prototype(drive=3e4)
    found = identify(prototype, measured(soft, 6), {"drive": (10.0, 1e6)}, start={"drive": 1e6})
    assert found.parameters["drive"] == pytest.approx(3e4, rel=1e-6)


def test_measurements_that_the_model_does_not_explain_are_named() -> None:
    wrong = [*EXACT[:4], replace(EXACT[4], value=2.0 * EXACT[4].value), *EXACT[5:]]
    found = identify(prototype, wrong, FREE)
    sentence = next(each for each in found.warnings if "does not explain" in each)
    assert "posture 5" in sentence


# --- the result -----------------------------------------------------------------------------


def test_figure_shows_the_residuals_and_both_stiffnesses() -> None:
    figure = NOISY.plot()
    assert isinstance(figure, Figure)
    left, right = figure.axes
    shown = right.get_lines()[0].get_xydata()
    np.testing.assert_allclose(np.asarray(shown)[:, 1], NOISY.residuals)
    assert "N/mm" in left.get_xlabel()
    assert "N/mm" in left.get_ylabel()
    assert right.get_xticklabels()[0].get_text() == "posture 1"
    figure.draw_without_rendering()
    nameless = replace(NOISY, measurements=tuple(replace(m, label="") for m in NOISY.measurements))
    assert nameless.plot().axes[1].get_xlabel() == "measurement"


ARRAYS = (
    *("values", "bounds", "predicted", "jacobian"),
    *("measured", "residuals", "covariance", "std", "correlation"),
)


def test_result_is_read_only_frozen_and_survives_pickling() -> None:
    assert NOISY.std.size
    for result in (NOISY, pickle.loads(pickle.dumps(NOISY))):
        assert isinstance(result, Identification)
        for name in ARRAYS:
            array = getattr(result, name)
            np.testing.assert_array_equal(array, getattr(NOISY, name))
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0.0
        with pytest.raises(FrozenInstanceError):
            result.values = np.zeros(3)  # type: ignore[misc]
        assert result.measurements == NOISY.measurements
    NOISY.parameters.clear()  # a copy
    assert set(NOISY.parameters) == set(TRUE)


def test_measurement_holds_plain_numbers_and_compares_by_value() -> None:
    first = EXACT[0]
    assert isinstance(first.angles, tuple)
    assert isinstance(first.direction[0], float)
    again = pickle.loads(pickle.dumps(first))
    assert again == first
    assert hash(again) == hash(first)
    assert replace(first, tension=None, minimum=np.full(6, 5.0)).minimum == (5.0,) * 6  # type: ignore[arg-type]


# --- bad input ------------------------------------------------------------------------------

ANY: Any = None
ONE = {"hole_radius": (0.02, 0.05)}


def fails(hole_radius: float) -> cdsm.Manipulator:
    raise KeyError("disk")


CASES: dict[str, tuple[Callable[[], object], type[cdsm.CdsmError], tuple[str, ...]]] = {
    "value negative": (
        lambda: replace(EXACT[0], value=-1.0),
        cdsm.InvalidInput,
        ("value: -1 N/m",),
    ),
    "std zero": (lambda: replace(EXACT[0], std=0.0), cdsm.InvalidInput, ("std: 0 N/m", "positive")),
    "tension and minimum": (
        lambda: replace(EXACT[0], minimum=5.0),
        cdsm.InvalidInput,
        ("one of tension=", "both given"),
    ),
    "angles a table": (
        lambda: replace(EXACT[0], angles=np.zeros((1, 3))),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("angles: shape (1, 3)", "rad"),
    ),
    "no measurements": (
        lambda: identify(prototype, [], FREE),
        cdsm.InvalidInput,
        (
            "measurements: 0 independent readings given for 3",
            "hole_radius, drive, lead",
            "free fewer",
        ),
    ),
    "measurements of another kind": (
        lambda: identify(prototype, [1.0, 2.0], ONE),  # type: ignore[list-item]
        cdsm.InvalidInput,
        ("measurements: ", "list or tuple of Measurement"),
    ),
    "nothing free": (lambda: identify(prototype, EXACT, {}), cdsm.InvalidInput, ("free: {}",)),
    "free a list": (
        lambda: identify(prototype, EXACT, ["lead"]),  # type: ignore[arg-type]
        cdsm.InvalidInput,
        ("free: ['lead']", "{name: (low, high)}"),
    ),
    "bounds swapped": (
        lambda: identify(prototype, EXACT, {"lead": (1.0, 0.1)}),
        cdsm.InvalidInput,
        ("free['lead']: low = 1, high = 0.1", "low must be below high"),
    ),
    "unknown parameter": (
        lambda: identify(prototype, EXACT, {"hole_radios": (0.02, 0.05)}),
        cdsm.InvalidInput,
        ("model_of: fails at hole_radios = 0.035", "unexpected keyword argument 'hole_radios'"),
    ),
    "parameter left out": (
        lambda: identify(by_product, EXACT, {"area": (1e-7, 1e-6)}),
        cdsm.InvalidInput,
        ("model_of: ", "'modulus'"),
    ),
    "model fails": (
        lambda: identify(fails, EXACT, ONE),
        cdsm.InvalidInput,
        ("model_of: fails at hole_radius = 0.035: KeyError('disk')", "Correct it"),
    ),
    "model without an arm": (
        lambda: identify(lambda hole_radius: 3, EXACT, ONE),  # type: ignore[arg-type, return-value]
        cdsm.InvalidInput,
        ("model_of: 3 given; a Manipulator is needed",),
    ),
    "tension_of fails": (
        lambda: identify(prototype, EXACT, ONE, tension_of=lambda pose, m, hole_radius: 1.0 / 0.0),
        cdsm.InvalidInput,
        ("tension_of: fails at hole_radius = 0.035: ZeroDivisionError",),
    ),
    "tensions of another arm": (
        lambda: identify(prototype, [replace(EXACT[0], tension=(5.0,) * 4)], ONE),
        cdsm.InvalidInput,
        (
            "start: the middle of the bounds does not give",
            "posture 1",
            "tension: shape (4,) given, (6,) needed",
        ),
    ),
    "angles in degrees": (
        lambda: identify(prototype, [replace(EXACT[0], angles=(10.0, 0.0, 0.0))], ONE),
        cdsm.InvalidInput,
        ("posture 1: q: joint1 = 57", "10 rad"),
    ),
    "tension out of the domain": (
        lambda: identify(prototype, [replace(EXACT[0], tension=(900.0,) * 6)], ONE),
        cdsm.InvalidInput,
        ("posture 1", "tension 900", "810 N"),
    ),
    "direction that does not move": (
        lambda: identify(
            prototype,
            [replace(EXACT[0], direction=(1.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0))],
            ONE,
        ),
        cdsm.InvalidInput,
        ("posture 1: the tip cannot move in its direction",),
    ),
    "arm that buckles": (
        lambda: identify(
            lambda drive: prototype(drive=drive),
            [replace(EXACT[0], tension=(700.0,) * 6)],
            {"drive": (1.0, 50.0)},
        ),
        cdsm.InvalidInput,
        ("posture 1: the arm buckles", "N m/rad"),
    ),
    "start of other names": (
        lambda: identify(prototype, EXACT, ONE, start={"lead": 0.3}),
        cdsm.InvalidInput,
        ("start: {'lead': 0.3}", "hole_radius"),
    ),
    "start beyond the bounds": (
        lambda: identify(prototype, EXACT, ONE, start={"hole_radius": 0.1}),
        cdsm.InvalidInput,
        ("start['hole_radius']: 0.1 is outside the bounds 0.02 to 0.05",),
    ),
    "start without stiffness": (
        lambda: identify(
            lambda drive: prototype(drive=drive),
            [replace(EXACT[0], tension=(700.0,) * 6)],
            {"drive": (1.0, 1e6)},
            start={"drive": 10.0},
        ),
        cdsm.InvalidInput,
        ("start: it does not give", "drive = 10", "buckles"),
    ),
    "level": (lambda: NOISY.confidence(95.0), cdsm.InvalidInput, ("level: 95", "0.95")),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_names_offender_and_remedy(case: str) -> None:
    attempt, kind, said = CASES[case]
    with pytest.raises(kind) as caught:
        attempt()
    assert type(caught.value) is kind
    for part in said:
        assert part in str(caught.value)

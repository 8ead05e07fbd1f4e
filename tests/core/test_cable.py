"""Hybrid cables: a wire and a spring or drive in series, and pairs with one motor of each kind."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support.arms import random_arm, random_posture, random_wrench

STRAND = presets.STRAND_1X19
SITES = (cdsm.Site("base_disk", (0.0, 0.02, 0.0)), cdsm.Site("link1", (0.01, 0.02, 0.0)))
LENGTH = 0.4


def hybrid(series: float, law: cdsm.Elasticity = STRAND) -> cdsm.Cable:
    return cdsm.Cable("hybrid", SITES, law, series_stiffness=series)


LAWS = {"linear": cdsm.LinearElasticity(48e3), "strand": STRAND}
SPRINGS = (1890.0, 50e3, math.inf)  # the paper's softest hybrid, a stiff drive, none
CASES = [(name, spring) for name in LAWS for spring in SPRINGS]


@pytest.mark.parametrize(("name", "spring"), CASES)
def test_tension_inverts_elongation(name: str, spring: float) -> None:
    cable, tension = hybrid(spring, LAWS[name]), np.array([[3.0, 30.0], [31.5, 700.0]])
    stretched = cable.elongation(tension, LENGTH)
    np.testing.assert_allclose(cable.tension(stretched, LENGTH), tension, rtol=1e-11)


@pytest.mark.parametrize(("name", "spring"), CASES)
def test_energy_by_elongation_is_tension_and_tension_by_elongation_is_stiffness(
    name: str, spring: float
) -> None:
    cable, tension = hybrid(spring, LAWS[name]), np.array([12.0, 60.0, 250.0, 700.0])
    at = cable.elongation(tension, LENGTH)
    errors = []
    for step in (4e-6, 2e-6):
        up, down = cable.tension(at + step, LENGTH), cable.tension(at - step, LENGTH)
        force = (cable.energy(up, LENGTH) - cable.energy(down, LENGTH)) / (2.0 * step)
        stiffness = (up - down) / (2.0 * step)
        errors.append(
            [force / tension - 1.0, stiffness / cable.tangent_stiffness(tension, LENGTH) - 1.0]
        )
    coarse, fine = (abs(np.array(error)).max(axis=1) for error in errors)
    assert np.all(coarse < 1e-2)
    assert np.all(fine < np.maximum(0.3 * coarse, 1e-8))  # second order, or rounding


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("series_stiffness", 1e13, r"to 1e\+12 N/m, or inf"),
        ("maximum", 1e-10, "or inf"),
        ("lead", 1e5, "to 10000 m"),
        ("minimum", -1.0, "-1 N given; cables only pull"),
        ("minimum", math.nan, "nan; finite numbers"),
    ],
)
def test_what_is_beyond_its_range_is_named(option: str, value: float, said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=f"{option}.*{said}"):
        cdsm.Cable("a", SITES, STRAND, **{option: value})  # type: ignore[arg-type]


def test_series_limits() -> None:
    tension = np.array([5.0, 100.0, 800.0])
    wire = STRAND.rigidity(tension) / LENGTH
    # k → ∞: the wire alone, to first order in 1/k
    rigid = hybrid(math.inf).tangent_stiffness(tension, LENGTH)
    np.testing.assert_allclose(rigid, wire, rtol=1e-15)
    np.testing.assert_allclose(hybrid(1e12).tangent_stiffness(tension, LENGTH), wire, rtol=1e-6)
    # k → 0: the spring alone
    np.testing.assert_allclose(hybrid(1e-3).tangent_stiffness(tension, LENGTH), 1e-3, rtol=1e-5)


def test_softest_hybrid_of_fig11_hardly_feels_the_tension() -> None:
    # Section V-D: 1.89 N/mm, constant "elastic" stiffness although the strand's EA grows 12-fold
    ends = hybrid(1890.0).tangent_stiffness([10.0, 86.0], LENGTH)
    assert STRAND.rigidity(86.0) / STRAND.rigidity(10.0) > 12.0
    assert 1.0 < ends[1] / ends[0] < 2.0


# --- controlled pairs ----------------------------------------------------------------------


def test_fixed_tensions_of_some_cables_leave_an_optimum_of_the_others() -> None:
    arm = presets.virtual_prototype()
    pose = random_posture(arm, 2, reach=0.2)
    W = random_wrench(2)
    free = cdsm.distribute_tension(pose, 20.0, wrench=W)
    same = cdsm.distribute_tension(pose, 20.0, wrench=W, fixed={"cable2_1": free.values[3]})
    np.testing.assert_allclose(same.values, free.values, atol=1e-9)
    more = cdsm.distribute_tension(pose, 20.0, wrench=W, fixed={"cable2_1": free.values[3] + 10})
    assert more.values[3] == free.values[3] + 10
    assert np.linalg.norm(more.values) > np.linalg.norm(free.values)


def test_bounds_of_a_cable_hold_as_if_they_had_been_asked_for() -> None:
    arm = random_arm(12, 3)
    low, high = np.full(len(arm.cables), 12.0), np.full(len(arm.cables), 300.0)
    pull = cdsm.distribute_tension(random_posture(arm, 0), low, high)
    least, strongest = int(pull.values.argmin()), int(pull.values.argmax())
    low[least], high[strongest] = 13.0, 0.98 * pull.values[strongest]
    cables = [
        dataclasses.replace(cable, minimum=low[c], maximum=high[c])
        for c, cable in enumerate(arm.cables)
    ]
    asked = cdsm.distribute_tension(random_posture(arm, 0), low, high)
    own = cdsm.distribute_tension(random_posture(arm.with_cables(cables), 0), 12.0)
    assert arm.cables[least].name in asked.at_minimum
    assert asked.at_maximum == (arm.cables[strongest].name,)
    for name in ("values", "minimum", "maximum"):
        np.testing.assert_array_equal(getattr(own, name), getattr(asked, name))


@pytest.mark.parametrize(
    ("bounds", "given"),
    [
        ((5.0, 30.0), {"cable1_2": 40.0, "cable2_2": 45.0, "cable3_2": 50.0}),
        ((60.0, 90.0), {"cable1_2": 70.0, "cable2_2": 2.5, "cable3_2": 65.0}),
        ((5.0, 90.0), {"cable1_2": 300.0, "cable2_2": 10.0, "cable3_2": 10.0}),
    ],
)
def test_advice_widens_the_bounds_of_cables_that_are_not_fixed(
    bounds: tuple[float, float], given: dict[str, float]
) -> None:
    low, high = bounds
    pose = presets.experimental_prototype().at(np.deg2rad([-12.0, -18.0, -20.0]))
    # one unknown per joint is left, so the widening it needs is known: solve it independently
    J = pose.length_jacobian
    load = -pose.gravity_torque - J[1::2].T @ np.array(list(given.values()))
    rest = np.linalg.solve(J[::2].T, load)
    assert rest.min() > 0.0
    needed = max(float((rest - high).max()), float((low - rest).max()))
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high, fixed=given)
    error = caught.value
    assert error.relaxation == pytest.approx(needed, rel=1e-9)
    assert not set(error.binding) & set(given)
    for widening, enough in ((needed * (1.0 + 1e-6), True), (0.9 * needed, False)):
        wider = (max(low - widening, 0.0), high + widening)
        if enough:
            pull = cdsm.distribute_tension(pose, *wider, fixed=given)
            np.testing.assert_array_equal(pull.values[1::2], list(given.values()))
        else:
            with pytest.raises(cdsm.InfeasibleTension):
                cdsm.distribute_tension(pose, *wider, fixed=given)


@pytest.mark.parametrize("others", [{}, {"cable1_1": 20.0, "cable1_2": 20.0}])
def test_no_widening_helps_where_the_fixed_tensions_alone_miss_the_balance(
    others: dict[str, float],
) -> None:
    pose = presets.experimental_prototype().at(np.zeros(3))
    # nothing but its own pair of cables reaches the last joint
    given = {"cable3_1": 20.0, "cable3_2": 60.0, **others}
    with pytest.raises(cdsm.InfeasibleTension, match="Beside the fixed tensions no") as caught:
        cdsm.distribute_tension(pose, 5.0, 800.0, fixed=given)
    assert caught.value.relaxation == math.inf
    assert set(caught.value.fixed) == set(given)
    cdsm.distribute_tension(pose, 5.0, 800.0)  # without them there are some
    np.testing.assert_allclose(
        caught.value.missing[2],
        (-pose.gravity_torque - pose.length_jacobian[4:].T @ [20.0, 60.0])[2],
        rtol=1e-9,
    )


@pytest.mark.parametrize(
    ("fixed", "kind", "said"),
    [
        ({"cable1_3": 5.0}, cdsm.InvalidInput, "did you mean"),
        ({"cable1_2": -0.5}, cdsm.InvalidInput, "-0.5 N given"),
        ([5.0, 5.0], cdsm.InvalidInput, "give a dict of tensions"),
        ({"cable1_2": 4000.0}, cdsm.InfeasibleTension, "joint1"),
    ],
)
def test_bad_fixed_tension_is_named(
    fixed: dict[str, float], kind: type[cdsm.CdsmError], said: str
) -> None:
    pose = presets.experimental_prototype().at(np.zeros(3))
    with pytest.raises(kind, match=said):
        cdsm.distribute_tension(pose, minimum=5.0, maximum=800.0, fixed=fixed)


STEEL = cdsm.LinearElasticity(5e4)
POINT = (0.0, 0.02, 0.0)


@pytest.mark.parametrize("keys", [{"friction": 0.1}, {"wrap": 0.1}])
def test_only_holes_have_friction(keys: dict[str, Any]) -> None:
    plain = cdsm.Site("base_disk", POINT), cdsm.Site("link1", POINT), cdsm.Site("link2", POINT)
    rough = tuple(dataclasses.replace(site, **keys) for site in plain)
    assert cdsm.Cable("a", (rough[0], plain[1]), STEEL, lead=0.1)
    assert cdsm.Cable("a", (plain[0], rough[1], plain[2]), STEEL)
    with pytest.raises(cdsm.InvalidInput, match=r"site 1 has friction or wrap.* Give a lead"):
        cdsm.Cable("a", (rough[0], plain[1]), STEEL)
    with pytest.raises(cdsm.InvalidInput, match=r"site 2 has friction or wrap.*cable ends there"):
        cdsm.Cable("a", (plain[0], rough[1]), STEEL, lead=0.1)

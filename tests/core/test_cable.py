"""Hybrid cables: a wire and a spring or drive in series, and pairs with one motor of each kind."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.support.validation import RANGES
from tests.support.arms import random_arm, random_posture, random_wrench
from tests.support.locked import original_length

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


def test_cable_is_straight_to_its_motor_rigid_and_unbounded_unless_told() -> None:
    cable = cdsm.Cable("plain", SITES, STRAND)
    bounds = (cable.minimum, cable.maximum)
    assert (cable.lead, cable.series_stiffness, cable.control) == (0.0, math.inf, "position")
    assert bounds == (0.0, math.inf)


@pytest.mark.parametrize(("name", "spring"), CASES)
def test_elongation_and_energy_begin_at_the_low_end(name: str, spring: float) -> None:
    cable = hybrid(spring, LAWS[name])
    first = LAWS[name].low
    # the next number above 2.2 N, and rounding of 2.2² N² over twice the spring
    assert float(cable.elongation(first, LENGTH)) == pytest.approx(0.0, abs=1e-15)
    assert float(cable.energy(first, LENGTH)) == pytest.approx(0.0, abs=1e-15)


def test_ends_of_ranges_are_allowed_and_what_is_beyond_them_is_named() -> None:
    low, high = RANGES["stiffness"].low, RANGES["tension"].high
    assert hybrid(low).series_stiffness == low
    assert cdsm.Cable("a", SITES, STRAND, maximum=high).maximum == high
    assert cdsm.Cable("a", SITES, STRAND, minimum=7.0, maximum=7.0).maximum == 7.0
    beyond: dict[str, tuple[float, str]] = {
        "series_stiffness": (1e13, r"to 1e\+12 N/m, or inf"),
        "minimum": (2e9, r"0, or 1e-09 to 1e\+09 N"),
        "maximum": (1e-10, "or inf"),
        "lead": (1e5, "to 10000 m"),
    }
    for option, (value, allowed) in beyond.items():
        with pytest.raises(cdsm.InvalidInput, match=f"{option}.*{allowed}"):
            cdsm.Cable("a", SITES, STRAND, **{option: value})  # type: ignore[arg-type]
    with pytest.raises(cdsm.InvalidInput, match="minimum: -1 N given; cables only pull"):
        cdsm.Cable("a", SITES, STRAND, minimum=-1.0)
    with pytest.raises(cdsm.InvalidInput, match="minimum <= maximum"):
        cdsm.Cable("a", SITES, STRAND, minimum=2.0, maximum=1.0)


@pytest.mark.parametrize("rigidity", RANGES["rigidity"][1:])
def test_smallest_and_largest_rigidity_of_ones_own_are_usable(rigidity: float) -> None:
    law, tension = cdsm.LinearElasticity(rigidity), np.array([1.0, 2.0])
    np.testing.assert_array_equal(law.rigidity(tension), rigidity)


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


def test_arm_uses_the_same_tangent() -> None:
    arm = presets.experimental_prototype(series_stiffness=1890.0)
    pose = random_posture(arm, 1)
    tension = np.linspace(20.0, 90.0, 6)
    K = cdsm.stiffness(pose, tension)
    for c, cable in enumerate(arm.cables):
        expected = 0.0
        if cable.control == "position":
            l0 = original_length(cable, tension[c], pose.cable_lengths[c])
            expected = float(cable.tangent_stiffness(tension[c], l0))
        np.testing.assert_allclose(K.cable_stiffness[c], expected, rtol=1e-13)


@pytest.mark.parametrize("length", [0.0, -1.0, math.nan, math.inf])
def test_free_length_must_be_positive(length: float) -> None:
    for call in (hybrid(1e3).elongation, hybrid(1e3).tangent_stiffness, hybrid(1e3).energy):
        with pytest.raises(cdsm.InvalidInput, match="free_length"):
            call(50.0, length)


# --- controlled pairs ----------------------------------------------------------------------


def test_experimental_prototype_is_that_of_section_v() -> None:
    arm = presets.experimental_prototype()
    assert (arm.nv, len(arm.cables)) == (3, 6)
    np.testing.assert_allclose(np.rad2deg(arm.upper), 30.0)
    axes = [joint.axes[0] for joint in arm.geometry.joints]
    turns = [math.degrees(math.atan2(axis[2], axis[1])) for axis in axes]
    np.testing.assert_allclose(turns, [0.0, 30.0, 60.0])
    assert [cable.control for cable in arm.cables] == ["position", "force"] * 3


def test_fixed_tensions_leave_the_rest_to_balance() -> None:
    arm = presets.experimental_prototype()
    pose = arm.at(np.deg2rad([-12.0, -18.0, -20.0]))
    given = {"cable1_2": 40.0, "cable2_2": 45.0, "cable3_2": 50.0}
    pull = cdsm.distribute_tension(pose, minimum=5.0, fixed=given)
    np.testing.assert_array_equal(pull.values[1::2], [40.0, 45.0, 50.0])
    # one unknown per joint is left: solve it independently
    J = pose.length_jacobian
    rest = np.linalg.solve(J[::2].T, -pose.gravity_torque - J[1::2].T @ pull.values[1::2])
    np.testing.assert_allclose(pull.values[::2], rest, rtol=1e-11)
    assert abs(pull.residual).max() < 1e-12


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


def test_fixed_tension_stands_in_place_of_the_bounds() -> None:
    pose = presets.experimental_prototype().at(np.zeros(3))
    pull = cdsm.distribute_tension(pose, minimum=5.0, fixed={"cable1_2": 2.5})
    assert pull.values[1] == 2.5
    assert np.delete(pull.values, 1).min() >= 5.0
    # a motor may as well let go
    assert cdsm.distribute_tension(pose, minimum=5.0, fixed={"cable1_2": 0.0}).values[1] == 0.0


def test_all_tensions_may_be_given() -> None:
    pose = presets.experimental_prototype().at(np.deg2rad([-12.0, -18.0, -20.0]))
    F = cdsm.distribute_tension(pose, minimum=5.0).values
    np.testing.assert_array_equal(cdsm.distribute_tension(pose, F, F).values, F)


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


def test_fixed_tensions_are_not_blamed_for_a_torque_that_no_cable_exerts() -> None:
    arm = presets.experimental_prototype()
    assert arm.geometry is not None
    pose = cdsm.Manipulator(arm.geometry, cables=arm.cables[:4]).at(np.zeros(3))
    with pytest.raises(cdsm.InfeasibleTension, match="cannot exert this torque") as caught:
        cdsm.distribute_tension(pose, fixed={arm.cables[0].name: 20.0})
    assert caught.value.fixed == ()


def test_summary_counts_the_cables_there_are() -> None:
    arm = presets.experimental_prototype()
    assert arm.geometry is not None
    assert str(arm) == str(arm.geometry)
    some = cdsm.Manipulator(arm.geometry, cables=arm.cables[:2])
    assert "3 joints (3 degrees of freedom), 2 cables" in str(some)


def test_force_controlled_pair_member_adds_no_passive_stiffness() -> None:
    arm = presets.experimental_prototype(cdsm.LinearElasticity(48e3))
    both = cdsm.Manipulator(
        arm.geometry,
        cables=[dataclasses.replace(cable, control="position") for cable in arm.cables],
        gravity=arm.gravity,
    )
    q = np.deg2rad([-12.0, -18.0, -20.0])
    tension = np.full(6, 60.0)
    one, two = (cdsm.stiffness(each.at(q), tension) for each in (arm, both))
    np.testing.assert_array_equal(one.cable_stiffness[1::2], 0.0)
    np.testing.assert_array_equal(one.active, two.active)
    assert np.linalg.eigvalsh(two.passive - one.passive).min() > 0.0


@pytest.mark.parametrize(
    ("fixed", "kind", "said"),
    [
        ({"cable1_3": 5.0}, cdsm.InvalidInput, "did you mean"),
        ({"cable1_2": -5.0}, cdsm.InvalidInput, "only pull"),
        ({"cable1_2": -0.5}, cdsm.InvalidInput, "-0.5 N given"),
        ({"cable1_2": math.nan}, cdsm.InvalidInput, "fixed"),
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


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"friction": -0.1}, r"friction: -0.1 given; 0, or 1e-06 to 2 is needed"),
        ({"friction": 2.1}, r"friction: 2.1 given; 0, or"),
        ({"friction": math.nan}, r"friction: nan; finite numbers"),
        ({"friction": "high"}, r"friction: .* real numbers are needed"),
        ({"wrap": -0.1}, r"wrap: -0.1 rad given; 0, or 1e-06 to 12.5664 rad is needed"),
        ({"wrap": 13.0}, r"wrap: 13 rad given"),
    ],
)
def test_bad_friction_of_a_site_is_named(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.Site("link1", POINT, **keys)


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


def test_spring_longer_than_its_cable_is_told() -> None:
    """Under 60 N a spring of 1 N/mm stretches by 60 mm, three times the 20 mm of cable1_1."""
    geometry = cdsm.Geometry.universal(
        joints=2, cables_per_joint=3, link_length=0.04, base_length=0.02, disk_offset=0.01,
        hole_radius=0.03, link_mass=0.05,
    )  # fmt: skip
    wire, F = cdsm.LinearElasticity(2e3), np.full(6, 60.0)
    for spring, lost in ((1e3, True), (3.1e3, False), (math.inf, False)):
        cables = cdsm.serpentine_cables(geometry, wire, series_stiffness=spring)
        arm = cdsm.Manipulator(geometry, cables=cables)
        K = cdsm.stiffness(arm.at(np.zeros(arm.nv)), F)
        assert ("longer lead" in str(K)) == lost
        assert any("longer lead" in line for line in K.report().notes) == lost

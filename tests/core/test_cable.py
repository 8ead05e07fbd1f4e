"""Hybrid cables: a wire and a spring or drive in series; bounds and friction of their own."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.status import Status
from tests.support import locked
from tests.support.arms import STEEL, random_arm, random_posture

STRAND = presets.STRAND_1X19
SITES = (cdsm.Site("base_disk", (0.0, 0.02, 0.0)), cdsm.Site("link1", (0.01, 0.02, 0.0)))
LENGTH = 0.4


def hybrid(series: float, law: cdsm.Elasticity = STRAND) -> cdsm.Cable:
    return cdsm.Cable("hybrid", SITES, law, series_stiffness=series)


@pytest.mark.parametrize("spring", [1890.0, 50e3, math.inf])  # the paper's softest, a drive, none
@pytest.mark.parametrize("law", [cdsm.LinearElasticity(48e3), STRAND])
def test_energy_by_elongation_is_tension_and_tension_by_elongation_is_stiffness(
    law: cdsm.Elasticity, spring: float
) -> None:
    cable, tension = hybrid(spring, law), np.array([12.0, 60.0, 250.0, 700.0])
    at = cable.elongation(tension, LENGTH)
    np.testing.assert_allclose(cable.tension(at, LENGTH), tension, rtol=1e-11)
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


def test_series_limits() -> None:
    tension = np.array([5.0, 100.0, 800.0])
    wire = STRAND.rigidity(tension) / LENGTH
    # k → ∞: the wire alone, to first order in 1/k; k → 0: the spring alone
    for spring, expected, near in ((math.inf, wire, 1e-15), (1e12, wire, 1e-6), (1e-3, 1e-3, 1e-5)):
        found = hybrid(spring).tangent_stiffness(tension, LENGTH)
        np.testing.assert_allclose(found, np.broadcast_to(expected, 3), rtol=near)


def test_softest_hybrid_of_fig11_hardly_feels_the_tension() -> None:
    # Section V-D: 1.89 N/mm, constant "elastic" stiffness although the strand's EA grows 12-fold
    ends = hybrid(1890.0).tangent_stiffness([10.0, 86.0], LENGTH)
    assert STRAND.rigidity(86.0) / STRAND.rigidity(10.0) > 12.0
    assert 1.0 < ends[1] / ends[0] < 2.0


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
    for name in ("values", "minimum_held", "maximum_held"):
        np.testing.assert_array_equal(getattr(own, name), getattr(asked, name))


@pytest.mark.parametrize("keys", [{"friction": 0.1}, {"wrap": 0.1}])
def test_only_holes_have_friction(keys: dict[str, Any]) -> None:
    links = ("base_disk", "link1", "link2")
    plain = [cdsm.Site(link, (0.0, 0.02, 0.0)) for link in links]
    rough = [dataclasses.replace(site, **keys) for site in plain]
    assert cdsm.Cable("a", (rough[0], plain[1]), STEEL, lead=0.1)
    assert cdsm.Cable("a", (plain[0], rough[1], plain[2]), STEEL)
    with pytest.raises(cdsm.InvalidInput, match=r"site 1 .* Give a lead"):
        cdsm.Cable("a", (rough[0], plain[1]), STEEL)
    with pytest.raises(cdsm.InvalidInput, match=r"site 2 .*ends there"):
        cdsm.Cable("a", (plain[0], rough[1]), STEEL, lead=0.1)


def test_spring_that_stretches_by_more_than_its_cable_is_refused() -> None:
    """k = 1/(l_0/EA + 1/k_series) would be above k_series: the cable stiffer than its spring."""
    k_series = 2e3
    arm = locked.hinge()
    soft = [dataclasses.replace(cable, series_stiffness=k_series) for cable in arm.cables]
    pose = arm.with_cables(soft).at([0.0])
    edge = k_series * pose.cable_lengths[1]  # tension at which no wire is left
    below = cdsm.stiffness(pose, [10.0, 0.999 * edge])
    assert 0.0 < below.cable_stiffness[1] < k_series
    for read in (cdsm.stiffness, cdsm.equilibrium, cdsm.load_cycle):
        more = (np.zeros((1, 6)),) if read is cdsm.load_cycle else ()
        with pytest.raises(cdsm.ElasticityRangeError, match=r"cable1_2.*no wire is left"):
            read(pose, [10.0, 1.001 * edge], *more)  # type: ignore[operator]
    batch = cdsm.evaluate(pose.arm, [[0.0], [0.0]], [[10.0, 0.999 * edge], [10.0, 1.001 * edge]])
    assert batch.ok.tolist() == [True, False]
    assert batch.status[1] == Status.OUTSIDE_ELASTICITY

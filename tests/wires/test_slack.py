"""Slack branch of a law: continued to zero tension, and the same within the law."""

import numpy as np
import pytest

import cdsm
from tests.support.arms import readme_geometry

STRAND = cdsm.presets.STRAND_1X19
TABLE = cdsm.TabulatedElasticity((4.0, 10.0, 40.0, 300.0), (0.0, 1e-3, 3e-3, 1e-2))
LAWS = (STRAND, TABLE)

GEOMETRY = readme_geometry()
BENT = np.deg2rad([10.0, 5.0, 10.0, 5.0, -8.0, 0.0, -8.0, 0.0])


def pulled(law: cdsm.Elasticity, least: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    pose = cdsm.Manipulator(GEOMETRY, law).at(BENT)
    return pose, cdsm.distribute_tension(pose, least)


@pytest.mark.parametrize("law", LAWS)
def test_rigidity_goes_on_below_the_law_and_all_is_the_same_within(law: cdsm.Elasticity) -> None:
    slack, low = law.slack_below(), law.low
    assert (slack.low, slack.high, slack.slack_below()) == (0.0, law.high, slack)
    around = slack.rigidity([0.0, low * (1.0 - 1e-12), low, low * (1.0 + 1e-9)])
    assert (around > 0.0).all()
    np.testing.assert_allclose(around, around[0], rtol=1e-6)
    assert (slack.rigidity_slope([0.0, 0.5 * low]) == 0.0).all()
    F = np.linspace(0.0, 5.0 * low, 41)
    np.testing.assert_allclose(slack.tension(slack.strain(F)), F, atol=1e-9)
    assert slack.scaled(1.5).rest == slack.rest == low
    F = np.linspace(low, law.high, 300)
    for ask in ("rigidity", "rigidity_slope", "strain", "energy"):
        np.testing.assert_array_equal(getattr(slack, ask)(F), getattr(law, ask)(F))
    K, K_slack = (cdsm.stiffness(*pulled(each, 8.0)).joint for each in (law, slack))
    np.testing.assert_array_equal(K_slack, K)


def test_slack_branch_of_a_constant_rigidity_is_the_linear_law() -> None:
    """l_0 at 5 N is l_0 (1 + 5/EA) at rest, so EA + 5 N from 5 N on is EA from 0 N on.

    At zero tension both cables are slack, in the same equilibrium.
    """
    linear = cdsm.LinearElasticity(2e3)
    from_five = cdsm.StrandElasticity(((2005.0,),), (), 5.0, 500.0).slack_below()
    slack: list[str] = []
    for least, force in ((8.0, -0.5), (8.0, -3.0), (3.0, -6.0)):
        rests = []
        for law in (linear, from_five):
            pose, pull = pulled(law, least)
            K = cdsm.stiffness(pose, pull)
            rests.append((K, cdsm.equilibrium(pose, pull, (0, 0, force, 0, 0, 0))))
        (K, rest), (K_five, rest_five) = rests
        np.testing.assert_allclose(K_five.joint, K.joint, atol=1e-12 * abs(K.joint).max())
        np.testing.assert_allclose(rest_five.pose.q, rest.pose.q, atol=1e-9)
        np.testing.assert_allclose(rest_five.tension, rest.tension, atol=1e-7)
        assert rest_five.slack == rest.slack
        slack += rest.slack
    assert slack


@pytest.mark.parametrize("least", [0.5, 1.5])
@pytest.mark.parametrize("spring", [np.inf, 2e3])
def test_stiffness_on_the_branch_is_that_of_the_potential(least: float, spring: float) -> None:
    cables = cdsm.serpentine_cables(GEOMETRY, TABLE.slack_below(), series_stiffness=spring)
    pose = cdsm.Manipulator(GEOMETRY, cables=cables).at(BENT)
    pull = cdsm.distribute_tension(pose, least)
    assert pull.values.min() < TABLE.low < pull.values.max()
    report = cdsm.stiffness(pose, pull).report()
    assert report.passed, report.faults


def test_wire_that_would_vanish_is_refused() -> None:
    soft = cdsm.StrandElasticity(((0.0, 1.5),), (), 10.0, 100.0)
    with pytest.raises(cdsm.InvalidInput, match=r"shortening by 66\.7 %"):
        soft.slack_below()

"""Elasticities of a user's own in an arm."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.arms import random_arm

ARM = random_arm(1, 3)
GEOMETRY = ARM.geometry
NAN, INF = math.nan, math.inf


class Own(cdsm.Elasticity):
    """An elasticity that answers with whatever it is told to."""

    def __init__(self, answer: Callable[[Array], Any]) -> None:
        self.answer = answer

    def __eq__(self, other: object) -> bool:  # so it cannot be hashed
        return self is other

    @property
    def domain(self) -> cdsm.Domain:
        return cdsm.Domain(0.0, INF)

    def rigidity(self, tension: Any) -> Array:
        return self.answer(tension)  # type: ignore[no-any-return]

    def strain(self, tension: Any) -> Array:
        return np.log1p(np.asarray(tension) / 1e3)

    def energy(self, tension: Any) -> Array:
        raise AssertionError("not needed for stiffness")


def test_own_elasticity_need_not_be_hashable() -> None:
    arm = cdsm.Manipulator(GEOMETRY, Own(lambda tension: 1e3 + tension))
    stiff = cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0))
    l0 = stiff.posture.cable_lengths / (1.0 + np.log(1.05))  # ε = ∫ dF/(1 kN + F)
    np.testing.assert_allclose(stiff.cable_stiffness, 1050.0 / l0)


def test_error_of_an_own_elasticity_names_it() -> None:
    def fails(tension: Any) -> Any:
        raise ValueError("boom")

    arm = cdsm.Manipulator(GEOMETRY, Own(fails))
    said = r"elasticity: <.*Own object.* fails at 50 N.*ValueError\('boom'\)"
    with pytest.raises(cdsm.InvalidInput, match=said) as caught:
        cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0))
    assert isinstance(caught.value.__cause__, ValueError)


@pytest.mark.parametrize(
    "answer",
    [
        lambda tension: tension * NAN,
        lambda tension: -tension,
        lambda tension: 0.0 * tension,
        lambda tension: tension + INF,
        lambda tension: np.array([1e3]),
        lambda tension: 1e3,
        lambda tension: "stiff",
        lambda tension: None,
    ],
    ids=["NaN", "negative", "zero", "infinite", "one for all", "a scalar", "a text", "nothing"],
)
def test_own_elasticity_without_a_positive_rigidity_is_refused(
    answer: Callable[[Array], Any],
) -> None:
    arm = cdsm.Manipulator(GEOMETRY, Own(answer))
    with pytest.raises(cdsm.InvalidInput, match=r"elasticity.*rigidity.*positive"):
        cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0))


class Paired(Own):
    domain = (0.0, 500.0)  # type: ignore[assignment]


def test_own_elasticity_without_a_domain_is_refused_where_it_enters_a_cable() -> None:
    law = Paired(np.ones_like)
    said = r"Paired object.*has the domain \(0\.0, 500\.0\); a Domain is needed"
    with pytest.raises(cdsm.InvalidInput, match=said):
        cdsm.Manipulator(GEOMETRY, law)
    with pytest.raises(cdsm.CableError, match=said):
        replace(ARM.cables[0], elasticity=law)


@pytest.mark.parametrize(
    "make",
    [
        lambda: cdsm.Domain(5.0, 1.0),
        lambda: cdsm.Domain(NAN, 1.0),
        lambda: cdsm.Domain(-1.0, 1.0),
        lambda: cdsm.LinearElasticity(5e-324),
    ],
)
def test_domain_and_rigidity_must_be_usable(make: Callable[[], object]) -> None:
    with pytest.raises(cdsm.InvalidInput):
        make()


@pytest.mark.parametrize("fails", ["rigidity", "strain", "energy", "rigidity_slope"])
def test_failure_of_an_own_elasticity_beyond_the_stiffness_is_told(
    fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A law may fail at the loaded arm alone: there it is asked in other places."""

    def broken(tension: Any) -> Any:
        raise ValueError("boom")

    class Exponential(Own):
        def energy(self, tension: Any) -> Array:  # ∫ F dε = F − 1 kN ln(1 + F/1 kN)
            return np.asarray(tension) - 1e3 * self.strain(tension)

    law = Exponential(lambda tension: 1e3 + tension)
    arm = cdsm.Manipulator(GEOMETRY, law).with_friction(0.05)
    pose, tension = arm.at(np.zeros(arm.nv)), np.full(len(arm.cables), 50.0)
    K, cable = cdsm.stiffness(pose.arm.with_friction(0.0).at(pose.q), tension), arm.cables[0]
    asked: dict[str, list[Callable[[], object]]] = {
        "rigidity": [
            lambda: cdsm.equilibrium(pose, tension),
            lambda: cdsm.breakaway(pose, tension, "z"),
            lambda: cable.tension(1e-3, 1.0),
        ],
        "strain": [
            lambda: cdsm.equilibrium(pose, tension),
            lambda: cdsm.breakaway(pose, tension, "z"),
            lambda: cdsm.rest_band(pose, tension, "z"),
            lambda: cable.elongation(50.0, 1.0),
        ],
        "energy": [
            lambda: cdsm.load_cycle(pose, tension, [(0.0, 0.0, -1e-3, 0.0, 0.0, 0.0)]),
            lambda: cable.energy(50.0, 1.0),
        ],
        "rigidity_slope": [lambda: cdsm.stiffness_gradient(K)],
    }
    monkeypatch.setattr(law, fails, broken)
    for ask in asked[fails]:
        with pytest.raises(
            cdsm.InvalidInput, match=r"elasticity: .*fails at.*ValueError\('boom'\)"
        ):
            ask()


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
        assert ("longer lead" in str(K.report())) == lost

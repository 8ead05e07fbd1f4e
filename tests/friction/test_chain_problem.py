"""The chain problem: tensions and slips of a cable in its holes, against KKT and other solvers."""

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import cdsm
from cdsm.friction.capstan import ChainProblem
from cdsm.friction.capstan_kernels import Wire, solve_chains
from cdsm.support.values import Array

ROUNDING = 8.0 * np.finfo(float).eps


class Chains(NamedTuple):
    """Chain problems side by side, as the kernel takes them."""

    start: NDArray[np.intp]
    forced: Array
    wire: Wire
    near: Array

    def solve(self) -> tuple[Array, Array, NDArray[np.bool_]]:
        return solve_chains(self.start, self.forced, self.wire, self.near)

    def lengths_left(self, T: Array) -> tuple[Array, Array]:
        """D' = a − A(T) [m] and its derivative by T [m/N]."""
        w = self.wire
        stretch = w.base + w.softness * T
        natural = (w.length - w.spring * (T - w.unloaded)) / stretch
        return w.rest_length - natural, (w.spring + natural * w.softness) / stretch


def random_chains(seed: int, count: int, most: int) -> Chains:
    """Chains near a state that friction allows: also without friction, slack, springs, forces."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, most + 1, count)
    start = np.concatenate([[0], np.cumsum(sizes)])
    of, total = np.repeat(np.arange(count), sizes), int(sizes.sum())
    length = rng.uniform(0.005, 0.1, total)
    softness = 10.0 ** -rng.uniform(3.0, 5.5, count)[of]
    first = start[:-1]
    spring, rest = np.zeros(total), np.zeros(total)
    spring[first] = np.where(rng.random(count) < 0.3, 10.0 ** rng.uniform(-6.0, -3.0, count), 0.0)
    length[first] += np.where(rng.random(count) < 0.5, rng.uniform(0.0, 0.5, count), 0.0)
    rest[first] = np.where(rng.random(count) < 0.3, 2.2, 0.0)
    mu = rng.choice([0.0, 0.02, 0.1, 0.3, 2.0], count)[of]
    grip = mu * rng.uniform(0.0, 0.4, total) * (rng.random(total) < 0.8)  # some without wrap
    T = 10.0 ** rng.uniform(-6.0, 3.0, count)[of]
    for c in range(count):
        for j in range(start[c] + 1, start[c + 1]):
            T[j] = T[j - 1] * math.exp(grip[j - 1] * rng.uniform(-1.0, 1.0))
    base = 1.0 - rng.choice([0.0, 1e-3], count)[of]
    natural = (length - spring * (T - rest)) / (base + softness * T)
    length *= 1.0 + 10.0 ** rng.uniform(-7.0, -2.0, count)[of] * rng.normal(size=total)
    forced = np.where(rng.random(count) < 0.3, T[first] * rng.uniform(0.0, 2.0, count), np.nan)
    wire = Wire(length, natural, base, softness, spring, rest, np.exp(grip))
    return Chains(start, forced, wire, T)


def check_optimality(chains: Chains) -> tuple[int, int]:
    """Check the KKT conditions, which make the answer the only one; count slack and sliding."""
    T, slip, slides = chains.solve()
    assert np.isfinite(T).all()
    assert np.isfinite(slip).all()
    left, rise = chains.lengths_left(T)
    slack = 0
    for c, forced in enumerate(chains.forced):
        a, b = chains.start[c], chains.start[c + 1]
        if not np.isnan(forced):
            assert T[a] == forced
        if T[a] == 0.0:
            assert not T[a:b].any()
            assert not slip[a:b].any()
            if np.isnan(forced):
                slack += 1
                assert left[a:b].sum() >= -ROUNDING * abs(chains.wire.rest_length[a:b]).sum()
            continue
        assert (T[a:b] > 0.0).all()
        step, grip = np.diff(np.log(T[a:b])), np.log(chains.wire.ratio[a : b - 1])
        own = slip[a : b - 1]
        assert slip[b - 1] == 0.0
        assert (abs(step) <= grip + 1e-14).all()
        np.testing.assert_allclose(step[own > 0.0], grip[own > 0.0], atol=1e-14)
        np.testing.assert_allclose(step[own < 0.0], -grip[own < 0.0], atol=1e-14)
        assert ((own == 0.0) | slides[a : b - 1]).all()
        # wire is conserved: what a block of sliding holes lacks, over its compliance, is tension
        lacking = left[a:b] - np.diff(np.concatenate([[0.0], own, [0.0]]))
        edges = [0, *(np.flatnonzero(~slides[a : b - 1]) + 1), b - a]
        for i, k in itertools.pairwise(edges):
            if i == 0 and not np.isnan(forced):
                lacking[0] = 0.0  # the motor supplies the wire of its segment
            share = T[a + i : a + k] / T[a + i : a + k].max()
            compliance = (share * rise[a + i : a + k]).sum()
            noise = abs(chains.wire.rest_length[a + i : a + k]).sum() * ROUNDING
            error = abs(lacking[i:k].sum()) - noise
            assert error <= 1e-9 * compliance * T[a + i : a + k].max()
    return slack, int(slides.sum())


@pytest.mark.parametrize(
    ("count", "most"), [(800, 16), pytest.param(20_000, 24, marks=pytest.mark.long)]
)
def test_random_chains_meet_the_optimality_conditions(count: int, most: int) -> None:
    slack, sliding = check_optimality(random_chains(0, count, most))
    assert slack > count / 32
    assert sliding > count


# --- one hole in closed form ----------------------------------------------------------------


def capstan(
    pulled: float, mu: float = 0.1, angle: float = 0.5
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Two equal segments of EA = 1 kN at 50 N; the second is pulled longer."""
    ones, zero = np.ones(2), np.zeros(2)
    length, softness = 0.1 * ones, ones / 1000.0
    natural = length / (1.0 + 50.0 * softness)
    rho = np.exp(mu * angle * ones)
    wire = Wire(np.array([0.1, 0.1 + pulled]), natural, ones, softness, zero, zero, rho)
    return Chains(np.array([0, 2]), np.array([np.nan]), wire, 50.0 * ones).solve()


def test_one_hole_in_closed_form() -> None:
    a = 0.1 / 1.05
    grip, stiff = math.exp(0.05), 1000.0 / a
    breakaway = 50.0 * (grip - 1.0) / stiff  # how far the second segment can be pulled
    T, slip, slides = capstan(0.999 * breakaway)
    np.testing.assert_allclose(T, [50.0, 50.0 + 0.999 * breakaway * stiff], rtol=1e-13)
    assert not slides.any()
    assert not slip.any()
    # sliding: T₂ = ρ T₁, and 0.1/(1 + T₁/EA) + (0.1 + x)/(1 + ρ T₁/EA) = 2 a, a quadratic
    x = 3.0 * breakaway
    T, slip, slides = capstan(x)
    b, c = 0.1, 0.1 + x
    p = np.polynomial.Polynomial([b + c - 2 * a, b * grip + c - 2 * a * (1 + grip), -2 * a * grip])
    root = 1000.0 * p.roots().max()
    np.testing.assert_allclose(T, [root, grip * root], rtol=1e-12)
    assert slides.tolist() == [True, False]
    assert slip[0] == pytest.approx(a - 0.1 / (1.0 + root / 1000.0), rel=1e-9)
    assert slip[0] > 0.0


def test_without_friction_the_tension_is_one_and_does_not_depend_on_the_holes() -> None:
    T, _, slides = capstan(1e-3, mu=0.0)
    assert T[0] == T[1]
    assert slides[0]
    assert T[0] == pytest.approx(1000.0 * (0.201 / (2 * 0.1 / 1.05) - 1.0), rel=1e-12)


# --- laws -----------------------------------------------------------------------------------

LAWS = (
    cdsm.LinearElasticity(48e3),
    cdsm.StrandElasticity.eq19_repaired(),
    cdsm.TabulatedElasticity((0.0, 10.0, 60.0, 400.0), (0.0, 1e-3, 3e-3, 1e-2)),
)


@pytest.mark.parametrize("law", LAWS, ids=["linear", "strand", "table"])
def test_laws_keep_their_tension_where_nothing_moves(law: cdsm.Elasticity) -> None:
    problem, lengths, F = one_cable(law)
    T = np.full(6, F)
    natural, ratio = problem.rest_lengths(lengths, T), np.full(6, 1.05)
    chain = problem.settle(lengths, natural, ratio, np.array([np.nan]), np.full(6, 3.0))
    np.testing.assert_allclose(chain.tension, F, rtol=1e-9)


@pytest.mark.parametrize("shorter", [0.9955, 0.99575, 0.996])
def test_steep_table_leads_newtons_method_out_of_its_cycle(shorter: float) -> None:
    """Halved steps stopped at 172 instead of 143 N for the second length."""
    law = cdsm.TabulatedElasticity(
        (0.0, 142.0, 144.0, 341.0, 345.0), (0.0, 6e-4, 1.8e-3, 7.6e-3, 10.2e-3)
    )
    site = cdsm.Site("link", (0.0, 0.0, 0.0))
    cable = cdsm.Cable("cable", (site, replace(site, position=(0.03, 0.0, 0.0))), law)
    F, length, one = np.array([277.0]), np.array([0.0307]), np.ones(1)
    problem = ChainProblem((cable,), np.array([0, 1]))
    natural = problem.rest_lengths(length, F)
    found = problem.settle(shorter * length, natural, one, np.array([np.nan]), F).tension
    stretch = 0.0307 * shorter / natural[0] - 1.0
    expected = brentq(lambda T: float(law.strain(T)) - stretch, 0.0, 345.0, xtol=1e-12)
    assert found[0] == pytest.approx(expected, rel=1e-9)


def test_slack_cable_forgets_and_is_tightened_again() -> None:
    problem, lengths, F = one_cable(LAWS[0], math.inf)
    natural, held = problem.rest_lengths(lengths, np.full(6, F)), np.array([np.nan])
    ratio = np.full(6, 1.05)
    slack = problem.settle(lengths * 0.99, natural, ratio, held, np.full(6, F))
    assert not slack.tension.any()
    assert slack.rest_length.sum() == pytest.approx(natural.sum(), rel=1e-15)
    back = problem.settle(lengths, slack.rest_length, ratio, held, slack.tension)
    np.testing.assert_allclose(back.tension, F, rtol=1e-9)


def one_cable(law: cdsm.Elasticity, spring: float = 2e5) -> tuple[ChainProblem, Array, float]:
    """A cable of six segments at 50 N, with a spring at its motor."""
    sites = tuple(cdsm.Site("link", (0.01 * i, 0.0, 0.0)) for i in range(7))
    cable = cdsm.Cable("cable", sites, law, series_stiffness=spring)
    lengths = np.array([0.2, 0.02, 0.03, 0.05, 0.02, 0.04])
    return ChainProblem((cable,), np.array([0, 6])), lengths, 50.0

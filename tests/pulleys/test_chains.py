"""Random rows of pulleys: which ones touch, where, and what the compiled solver finds."""

from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Site
from cdsm.pulleys.contacts import (
    BESIDE,
    TOUCHES,
    UNSETTLED,
    Contacts,
    Pulleys,
    settle_postures,
    settle_row,
)
from tests.support.pulleys import Link, arm_of

LINKS = [
    Link("l1", "base", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Link("l2", "l1", (0.03, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Link("l3", "l2", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Link("l4", "l3", (0.03, 0.0, 0.0), (0.0, 0.0, 1.0)),
]


def _random_path(rng: np.random.Generator, groove: bool) -> list[Any]:
    tilt = rng.choice([0.0, 0.1, 0.3])
    path: list[Any] = [Site("base", (0.0, rng.uniform(-0.004, 0.004), rng.uniform(-0.01, 0.01)))]
    for k in range(rng.integers(1, 5)):
        axis = np.array([0.0, rng.choice([-1.0, 1.0]), 0.0]) + tilt * rng.normal(size=3)
        centre = (0.03, rng.uniform(-0.002, 0.002), rng.uniform(-0.002, 0.002))
        radius = rng.uniform(0.003, 0.009)
        path.append(Pulley(f"l{k}" if k else "base", centre, tuple(axis), radius, groove=groove))
    path.append(Site("l4", (0.02, rng.uniform(-0.004, 0.004), rng.uniform(-0.01, 0.01))))
    return path


@pytest.mark.parametrize("groove", [True, False])
def test_the_gradient_of_the_length_is_right_wherever_contacts_are_found(groove: bool) -> None:
    rng = np.random.default_rng(5)
    refused = 0
    checked = 0
    patterns = set()
    for _ in range(200):
        arm = arm_of(LINKS, _random_path(rng, groove))
        q = rng.uniform(-0.5, 0.5, 4)
        try:
            pose = arm.at(q)
        except cdsm.InvalidInput:
            refused += 1
            continue
        step = 1e-6
        ends = [[arm.at(q + sign * e) for sign in (1.0, -1.0)] for e in step * np.eye(4)]
        touches = pose.wraps.touches
        if any((end.wraps.touches != touches).any() for pair in ends for end in pair):
            continue  # a lift-off in between
        patterns.add(tuple(touches.tolist()))
        J = [(up.cable_lengths - down.cable_lengths)[0] / (2.0 * step) for up, down in ends]
        np.testing.assert_allclose(pose.length_jacobian[0], J, rtol=0.0, atol=1e-9)
        checked += 1
    assert refused <= 6
    assert checked >= 185
    assert len(patterns) > 10


def _random_row(rng: np.random.Generator) -> tuple[Any, ...]:
    n = int(rng.integers(1, 5))
    x = np.linspace(0.0, 0.03 * (n + 1), n + 2)
    points = np.column_stack([x, *rng.uniform(-0.006, 0.006, (2, n + 2))])
    axis = np.array([0.0, 1.0, 0.0]) * rng.choice([-1.0, 1.0], (n, 1))
    axis = axis + rng.choice([0.0, 0.2]) * rng.normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    return (
        points[0],
        points[-1],
        Pulleys(
            points[1:-1],
            axis,
            rng.uniform(0.003, 0.009, n),
            rng.random(n) < 0.5,
            rng.integers(0, 2, n),
        ),
    )


def test_compiled_and_plain_contacts_agree_in_every_pattern() -> None:
    rng = np.random.default_rng(1)
    patterns = set()
    for _ in range(400):
        start, end, pulleys = _random_row(rng)
        n = len(pulleys.radius)
        plain = Contacts(
            np.zeros((n, 3)).tolist(), np.zeros((n, 3)).tolist(), [0.0] * n, [0.0] * n, [True] * n
        )
        lists = Pulleys(*(field.tolist() for field in pulleys))
        outcome, culprit = settle_row(start.tolist(), end.tolist(), 0, n, lists, plain)
        rows = pulleys._replace(centre=pulleys.centre[None], axis=pulleys.axis[None])
        found, outcomes, culprits = settle_postures(
            np.array([0, n]), start[None, None], end[None, None], rows
        )
        assert outcomes[0] == outcome
        if outcome != TOUCHES:
            assert outcome in (BESIDE, UNSETTLED)
            assert culprits[0] == culprit
            continue
        touches = np.array(plain.touches)
        patterns.add(tuple(touches.tolist()))
        np.testing.assert_array_equal(found.touches[0], touches)
        np.testing.assert_allclose(found.angle[0], plain.angle, rtol=0.0, atol=1e-12)
        for ours, theirs in ((found.arrival, plain.arrival), (found.departure, plain.departure)):
            difference = ours[0][touches] - np.array(theirs)[touches]
            assert abs(difference).max(initial=0.0) < 1e-12
    assert len(patterns) > 15


def test_a_tiny_groove_becomes_a_hole() -> None:
    """The differences to a hole fall with the radius: J off by 0.81 r, H_L by 0.12 r."""
    links = [
        Link("l1", "base", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Link("l2", "l1", (0.03, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ]
    ends = Site("base", (0.0, 0.002, 0.006)), Site("l2", (0.02, 0.001, 0.012))
    q = [0.1, 0.05]
    hole = arm_of(links, [ends[0], Site("l1", (0.005, 0.0, 0.0)), ends[1]]).at(q)
    for r in (1e-3, 1e-4, 1e-5, 1e-6):
        groove = Pulley("l1", (0.005, 0.0, 0.0), (0.0, -1.0, 0.0), r)
        pose = arm_of(links, [ends[0], groove, ends[1]]).at(q)
        J = abs(pose.length_jacobian - hole.length_jacobian).max() / r
        H = abs(pose.length_hessian - hole.length_hessian).max() / r
        assert pytest.approx(0.81, abs=0.01) == J
        assert pytest.approx(0.12, abs=0.015) == H


def test_groove_and_smooth_are_one_in_the_plane() -> None:
    link = [Link("l1", "base", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0))]
    first, second = (
        arm_of(
            link,
            [
                Site("base", (0.0, 0.0, 0.006)),
                Pulley("l1", (0.005, 0.0, 0.0), (0.0, -1.0, 0.0), 0.003, groove),
                Site("l1", (0.02, 0.0, 0.012)),
            ],
        ).at([0.3])
        for groove in (True, False)
    )
    np.testing.assert_array_equal(first.length_jacobian, second.length_jacobian)
    np.testing.assert_allclose(first.length_hessian, second.length_hessian, rtol=0.0, atol=1e-17)

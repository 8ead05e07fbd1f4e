"""J_L, H_L·F and wrap angles of mixed paths in space, against central differences."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import Pulley, Site
from cdsm.support.values import Array
from tests.support.pulleys import Link, arm_of

LINKS = [
    Link("l1", "base", (0.02, 0.0, 0.0), (0.0, 1.0, 0.0)),
    Link("l2", "l1", (0.03, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Link("l3", "l2", (0.03, 0.0, 0.0), (0.3, 1.0, 0.2)),
    Link("l4", "l3", (0.03, 0.0, 0.0), (1.0, 0.2, 0.1)),
    Link("slider", "l2", (0.0, 0.02, 0.0), (0.0, 1.0, 1.0), "prismatic"),
]
STEP = np.array([1.0, 1.0, 1.0, 1.0, 0.05])  # of a difference, in rad or m per rad
REACH = np.array([0.35, 0.35, 0.35, 0.35, 0.0035])


def _site(link: str, x: float, y: float, z: float) -> Site:
    return Site(link, (x, y, z))


def _pulley(
    link: str, x: float, y: float, z: float, axis: Any, radius: float, **more: Any
) -> Pulley:
    return Pulley(link, (x, y, z), axis, radius, **more)


FIRST = _pulley("l1", 0.0, 0.0, 0.0, (0.1, 1.0, 0.2), 0.008)
SECOND = _pulley("l2", 0.03, 0.0, -0.005, (0.2, -1.0, -0.1), 0.006)
THIRD = _pulley("l3", 0.03, 0.0, 0.005, (0.3, 1.0, 0.3), 0.004)
ABOVE = _site("base", 0.0, 0.012, 0.03)
PATHS = {
    "one": [
        _site("base", 0.0, 0.01, 0.004),
        _pulley("l1", 0.02, 0.0, 0.0, (0.1, 1.0, 0.2), 0.008),
        _site("l3", 0.01, 0.01, 0.002),
    ],
    "two, skew": [ABOVE, FIRST, SECOND, _site("l4", 0.02, 0.01, 0.012)],
    "three, crossed and skew": [ABOVE, FIRST, SECOND, THIRD, _site("l4", 0.02, 0.01, 0.02)],
    "fixed to the rim": [
        _site("base", 0.0, 0.0, 0.03),
        _pulley("l2", 0.0, 0.0, 0.0, (0.0, 1.0, 0.0), 0.008),
        _site("l2", 0.0, 0.003, -0.008),
    ],
    "fixed to the rim in the plane": [
        _site("base", 0.0, 0.0, 0.03),
        _pulley("l2", 0.0, 0.0, 0.0, (0.0, 1.0, 0.0), 0.008),
        _site("l2", 0.0, 0.0, -0.008),
    ],
    "over a sliding link": [
        _site("base", 0.0, 0.004, 0.008),
        _pulley("l1", 0.015, 0.0, 0.0, (0.1, -1.0, 0.2), 0.006),
        _pulley("slider", 0.012, -0.02, 0.0, (0.1, 1.0, 0.1), 0.005),
        _site("l3", 0.025, 0.003, -0.008),
    ],
    "a full turn more": [ABOVE, replace(FIRST, turns=1), _site("l4", 0.02, 0.01, 0.012)],
}


def _cases() -> list[Any]:
    cases = []
    for name, path in PATHS.items():
        count = sum(isinstance(element, Pulley) for element in path)
        for kinds in [(False,), (True,), (True, False), (False, True)]:
            beside = name == "fixed to the rim"  # the site is beside the plane of a groove
            if len(kinds) <= count and not (beside and kinds[0]):
                words = "-".join("groove" if groove else "smooth" for groove in kinds)
                cases.append(pytest.param(path, kinds, id=f"{name}-{words}"))
    return cases


CASES = _cases()


def _arm(path: Sequence[Any], kinds: Sequence[bool]) -> cdsm.Manipulator:
    """The arm with this path, whose pulleys have a groove or are smooth in turn."""
    elements = []
    count = 0
    for element in path:
        if isinstance(element, Pulley):
            element = replace(element, groove=kinds[count % len(kinds)])
            count += 1
        elements.append(element)
    return arm_of(LINKS, elements)


def _errors(value: Any, gradient: Array, q: Array, steps: Sequence[float]) -> list[float]:
    """Largest error of central differences of ``value`` at q, for each step."""
    errors = []
    for h in steps:
        columns = [
            (value(q + e) - value(q - e)) / (2.0 * h * size)
            for e, size in zip(h * np.diag(STEP), STEP, strict=True)
        ]
        errors.append(float(abs(np.stack(columns, axis=-1) - gradient).max()))
    return errors


def test_there_are_nineteen_paths() -> None:
    assert len(CASES) == 19


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("path", "kinds"), CASES)
def test_differences_converge_at_rate_two(path: Any, kinds: Any, seed: int) -> None:
    arm = _arm(path, kinds)
    q = np.random.default_rng(seed).uniform(-REACH, REACH)
    pose = arm.at(q)
    F = np.array([30.0])
    active = cdsm.stiffness(pose, F).active
    assert pose.wraps.touches.any()
    np.testing.assert_allclose(active, np.tensordot(F, pose.length_hessian, 1), atol=1e-12)
    np.testing.assert_allclose(active, active.T, rtol=0.0, atol=1e-12 * abs(active).max())
    quantities = (
        (lambda x: arm.at(x).cable_lengths, pose.length_jacobian),
        (lambda x: F @ arm.at(x).length_jacobian, active),
    )
    for value, gradient in quantities:
        first, second, last = _errors(value, gradient, q, (2e-3, 1e-3, 1e-4))
        assert 1.9 < np.log2(first / second) < 2.1
        assert last < 2e-7 * max(abs(gradient).max(), 1.0)


@pytest.mark.parametrize(("path", "kinds"), CASES)
def test_wrap_angles_have_the_derivative_of_their_differences(path: Any, kinds: Any) -> None:
    arm = _arm(path, kinds)
    q = np.random.default_rng(5).uniform(-REACH, REACH)
    gradient = arm.at(q).wrapping.shifts.wrap[1]
    (error,) = _errors(lambda x: arm.at(x).wrapping.shifts.wrap[0], gradient, q, (1e-5,))
    assert error < 1e-8 * abs(gradient).max()


@pytest.mark.parametrize("path", ["one", "two, skew", "three, crossed and skew"])
def test_held_contacts_alone_are_not_enough_beside_the_plane(path: str) -> None:
    """The shifts of the contacts are a part of H_L that differences see."""
    pose = _arm(PATHS[path], (False,)).at(np.zeros(5))
    wrapping = pose.wrapping
    held = pose.routing.hessian(wrapping.spans, np.ones(wrapping.spans.length.size))
    assert abs(held - pose.length_hessian[0]).max() > 0.1 * abs(held).max()

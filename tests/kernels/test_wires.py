"""Laws of wires in blocks: the bits of the law itself, at joins and ends too."""

import math
from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm.cable_laws import OriginalLength
from cdsm.presets import STRAND_1X19
from cdsm.support.values import Array
from tests.support.arms import random_arm

ARM = random_arm(2, 3)
SLACK = STRAND_1X19.slack_below()
COUNT = len(ARM.cables)


def tensions(law: cdsm.Elasticity) -> Array:
    """Everywhere, at the ends of panels, and beside them; beyond the domain too."""
    edges = STRAND_1X19.panels.edges
    some = np.random.default_rng(5).uniform(0.0, 850.0, 200)
    beside = [np.nextafter(edges, side) for side in (0.0, math.inf)]
    return np.concatenate([[0.0, law.domain.first, 810.0, 811.0], edges, *beside, some])


@pytest.mark.parametrize("original_length", ["unstrained", "stretched"])
@pytest.mark.parametrize("law", [STRAND_1X19, SLACK], ids=["strand", "slack"])
def test_rigidity_in_a_block_has_the_bits_of_the_law(
    law: cdsm.Elasticity, original_length: OriginalLength
) -> None:
    # the other cables have other laws: their panels stand beside those of this one
    laws = [(law, SLACK, cdsm.LinearElasticity(1e5))[c % 3] for c in range(COUNT)]
    cables = [replace(cable, elasticity=one) for cable, one in zip(ARM.cables, laws, strict=True)]
    arm = replace_cables(cables, original_length)
    assert not arm._model.laws.without_kernel
    F = tensions(law)
    given = np.full((F.size, COUNT), 50.0)
    given[:, 0] = F
    batch = cdsm.evaluate(arm, np.zeros((F.size, arm.nv)), given, outputs=("cable_stiffness",))
    pose = arm.at(np.zeros(arm.nv))
    for row, tension in enumerate(given):
        if F[row] in law.domain:
            one = cdsm.stiffness(pose, tension).cable_stiffness
            assert one.tobytes() == batch["cable_stiffness"][row].tobytes()
        else:
            assert batch.status[row] == cdsm.Status.OUTSIDE_ELASTICITY


def replace_cables(cables: list[cdsm.Cable], original_length: OriginalLength) -> cdsm.Manipulator:
    return cdsm.Manipulator(ARM.geometry, cables=cables, original_length=original_length)


def test_law_that_a_kernel_does_not_know_is_asked() -> None:
    table = cdsm.TabulatedElasticity((0.0, 20.0, 900.0), (0.0, 0.001, 0.004))
    arm = ARM.with_cables([replace(cable, elasticity=table) for cable in ARM.cables])
    assert arm._model.laws.without_kernel == [table]
    K = cdsm.evaluate(arm, np.zeros((2, arm.nv)), np.full(COUNT, 30.0), outputs=("joint",))["joint"]
    one = cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(COUNT, 30.0)).joint
    np.testing.assert_allclose(K[1], one, rtol=0.0, atol=1e-13 * abs(one).max())

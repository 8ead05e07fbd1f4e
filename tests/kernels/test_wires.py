"""Laws of wires in blocks: the bits of the law itself, at joins and ends too."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import cdsm
from cdsm.cable_laws import OriginalLength
from cdsm.kernels.wires import single_rigidity
from cdsm.presets import STRAND_1X19
from cdsm.support.values import Array
from tests.support.arms import random_arm

ARM = random_arm(2, 3)
SLACK = STRAND_1X19.slack_below()
POINTS = 2.3 * 1.5 ** np.arange(15)
TABLE = cdsm.TabulatedElasticity(tuple(POINTS), tuple(STRAND_1X19.strain(POINTS)))
COUNT = len(ARM.cables)


def tensions(law: cdsm.Elasticity) -> Array:
    """Everywhere, at the ends of pieces, and beside them; beyond the domain too."""
    edges = np.concatenate([STRAND_1X19.panels.edges, POINTS])
    some = np.random.default_rng(5).uniform(0.0, 850.0, 200)
    beside = [np.nextafter(edges, side) for side in (0.0, math.inf)]
    return np.concatenate([[0.0, law.domain.first, 810.0, 811.0], edges, *beside, some])


@pytest.mark.parametrize("original_length", ["unstrained", "stretched"])
@pytest.mark.parametrize(
    "law",
    [STRAND_1X19, SLACK, TABLE, TABLE.slack_below()],
    ids=["strand", "slack", "table", "slack table"],
)
def test_rigidity_in_a_block_has_the_bits_of_the_law(
    law: cdsm.Elasticity, original_length: OriginalLength
) -> None:
    # the other cables have other laws: their pieces stand beside those of this one
    others = (SLACK, TABLE, cdsm.LinearElasticity(1e5))
    laws = [law, *(others[c % 3] for c in range(1, COUNT))]
    cables = [replace(cable, elasticity=one) for cable, one in zip(ARM.cables, laws, strict=True)]
    arm = replace_cables(cables, original_length)
    assert not arm._model.laws.without_kernel
    F = tensions(law)
    given = np.full((F.size, COUNT), 50.0)
    given[:, 0] = F
    batch = cdsm.evaluate(arm, np.zeros((F.size, arm.nv)), given, outputs=("cable_stiffness",))
    pose, own = arm.at(np.zeros(arm.nv)), arm._model.laws
    for row, tension in enumerate(given):
        if F[row] not in law.domain:
            assert batch.status[row] == cdsm.Status.OUTSIDE_ELASTICITY
            with pytest.raises(cdsm.ElasticityRangeError, match=arm.cables[0].name):
                cdsm.stiffness(pose, tension)
            continue
        one = cdsm.stiffness(pose, tension).cable_stiffness
        assert one.tobytes() == batch["cable_stiffness"][row].tobytes()
        rigidity = own.stretched_rigidity(law, F[row : row + 1])
        arguments: tuple[Any, ...] = (own.constant, *own.wires[2:], tension)
        assert single_rigidity(*arguments)[0] == rigidity


def test_rigidity_that_no_wire_has_is_refused() -> None:
    steep = cdsm.TabulatedElasticity((0.0, 100.0), (0.0, 1e-11))  # EA is 1e13 N
    arm = ARM.with_cables([replace(cable, elasticity=steep) for cable in ARM.cables])
    q, F = np.zeros((1, arm.nv)), np.full(COUNT, 50.0)
    batch = cdsm.evaluate(arm, q, F, outputs=("joint",))
    assert batch.status.tolist() == [cdsm.Status.OUTSIDE_ELASTICITY]
    with pytest.raises(cdsm.InvalidInput, match="gives the rigidity"):
        cdsm.stiffness(arm.at(q[0]), F)


def replace_cables(cables: list[cdsm.Cable], original_length: OriginalLength) -> cdsm.Manipulator:
    return cdsm.Manipulator(ARM.geometry, cables=cables, original_length=original_length)


def test_law_that_a_kernel_does_not_know_is_asked() -> None:
    class Own(cdsm.Elasticity):
        """A law of a user's own."""

        domain = cdsm.Domain(0.0, 900.0)

        def rigidity(self, tension: ArrayLike) -> Array:
            return 2e4 + 30.0 * np.asarray(tension)

        def strain(self, tension: ArrayLike) -> Array:
            return np.log1p(30.0 * np.asarray(tension) / 2e4) / 30.0

        def energy(self, tension: ArrayLike) -> Array:
            return (np.asarray(tension) - 2e4 * self.strain(tension)) / 30.0

    law = Own()
    arm = ARM.with_cables([replace(cable, elasticity=law) for cable in ARM.cables])
    assert arm._model.laws.without_kernel == [law]
    K = cdsm.evaluate(arm, np.zeros((2, arm.nv)), np.full(COUNT, 30.0), outputs=("joint",))["joint"]
    one = cdsm.stiffness(arm.at(np.zeros(arm.nv)), np.full(COUNT, 30.0)).joint
    np.testing.assert_allclose(K[1], one, rtol=0.0, atol=1e-13 * abs(one).max())

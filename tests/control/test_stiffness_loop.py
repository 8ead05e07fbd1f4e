"""Arms whose wires are stiffer or softer than their laws say, and the loop that finds it out."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.control import with_rigidity
from tests.support.tracking import small_path


@pytest.mark.parametrize("factor", [0.5, 1.3])
def test_scaled_arm_is_the_arm_that_is_built_with_scaled_laws(factor: float) -> None:
    """No part that was reused belongs to the old laws, stuck segments included."""
    plan = small_path(0.1)
    first, *rest = plan.arm.cables
    linear = replace(first, elasticity=cdsm.LinearElasticity(4e4), series_stiffness=5e5)
    arm = plan.arm.with_cables([linear, *rest])
    arm.at(plan.angles[0]).segments  # noqa: B018  # is kept by the arm
    quick = with_rigidity(arm, factor)
    built = arm.with_cables(
        [replace(cable, elasticity=cable.elasticity.scaled(factor)) for cable in arm.cables]
    )
    assert quick == built
    one, other = quick.at(plan.angles[1]), built.at(plan.angles[1])
    F = plan.tensions[1]
    for stiffness in (cdsm.stiffness, cdsm.stuck_stiffness):
        K, wanted = (stiffness(pose, F) for pose in (one, other))
        np.testing.assert_array_equal(K.joint, wanted.joint)
        np.testing.assert_array_equal(K.cable_stiffness, wanted.cable_stiffness)
    assert quick.cables[1].elasticity == presets.STRAND_1X19.scaled(factor)

"""Arms whose wires are stiffer or softer than their laws say, and the loop that finds it out."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.control import with_rigidity
from cdsm.control.observer import Observer
from cdsm.control.sensors import Measurement
from cdsm.control.stiffness_loop import StiffnessLoop, reference_at
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


def test_an_estimate_that_is_no_rigidity_keeps_the_last_tensions() -> None:
    plan = small_path()
    F = plan.tensions[0]
    reference = reference_at(plan.arm, plan.angles[0], F)
    loop = StiffnessLoop(plan, np.full(6, 10.0), np.full(6, 250.0), np.full(6, 10.0))
    measured = Measurement(reference.paid_out, F)
    estimate = Observer(plan.arm, cdsm.Sensors()).initial(reference.angles, measured)
    target = plan.target[:1]
    loop.next(reference, target, estimate, reference)
    assert not loop.failed
    planned = loop.next(reference, target, estimate._replace(softness=-0.5), reference)
    assert loop.failed == {1: "rigidity: estimated as -2 times that of the wires' laws."}
    np.testing.assert_allclose(planned.reference.tension, F, rtol=1e-5)

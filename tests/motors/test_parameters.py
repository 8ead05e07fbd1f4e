"""The stiffness of motors as a number of the arm: free in models, with a tolerance."""

import numpy as np
import pytest

import cdsm
from tests.support.motors import BENT, spooled
from tests.support.pulleys import Link, arm_of

ARM = spooled(20.0, cdsm.LinearElasticity(2e4))


def test_stiffness_of_motors_is_a_parameter_of_the_arm() -> None:
    model = cdsm.ArmParameters(ARM, ("motor_stiffness", "link_mass"))
    assert model.present["motor_stiffness"] == 20.0
    arm = model(motor_stiffness=5.0, link_mass=0.2)
    assert {motor.stiffness for motor in arm.motors.given} == {5.0}
    assert arm.geometry.links[0].mass == 0.2
    one = cdsm.ArmParameters(ARM, ("motor_stiffness@m2",))(**{"motor_stiffness@m2": 7.0})
    assert [motor.stiffness for motor in one.motors.given] == [20.0, 20.0, 7.0, *[20.0] * 5]
    with pytest.raises(cdsm.InvalidInput, match="no motor is called 'm9'"):
        cdsm.ArmParameters(ARM, ("motor_stiffness@m9",))
    with pytest.raises(cdsm.InvalidInput, match="has no motor with a stiffness there; give cdsm"):
        cdsm.ArmParameters(spooled(), ("motor_stiffness",))


def test_stiffness_of_motors_is_found_from_a_weight() -> None:
    pose = ARM.at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    along = cdsm.stiffness(pose, pull).along("z")
    angles, tension = tuple(BENT.tolist()), tuple(pull.values.tolist())
    test = cdsm.Measurement(along, "z", angles=angles, tension=tension, std=1.0)
    start = cdsm.ArmParameters(ARM, ("motor_stiffness",))(motor_stiffness=60.0)
    model = cdsm.ArmParameters(start, ("motor_stiffness",))
    found = cdsm.identify(model, [test], {"motor_stiffness": (2.0, 200.0)}, progress=False)
    assert abs(found.values[0] - 20.0) < 1e-4


def test_stiffness_of_motors_has_a_tolerance() -> None:
    pose = ARM.at(BENT)
    pull = cdsm.distribute_tension(pose, 60.0)
    budget = cdsm.uncertainty(
        pose, pull.values, cdsm.Tolerances(motor_stiffness=0.1), direction="z"
    )
    model = cdsm.ArmParameters(ARM, ("motor_stiffness",))
    up, down = (
        cdsm.stiffness(model(motor_stiffness=20.0 * s).at(BENT), pull.values).along("z")
        for s in (1.01, 0.99)
    )
    expected = 0.1 * (up - down) / 0.02
    assert expected > 0.0
    np.testing.assert_allclose(budget.contributions["motor_stiffness"], expected, rtol=1e-3)


@pytest.mark.parametrize(
    ("k_m", "expected"), [(None, 0.0), (5.0, 6.486486), (1e3, 23.680316), (np.inf, 24.0)]
)
def test_a_pulley_joint_with_a_pair_on_a_spool(k_m: float | None, expected: float) -> None:
    """2 k R² k_m/(k_m + 2 k r²) of a robot: a joint of pulley radius R, two cables, one spool r."""
    R, r, k = 0.02, 0.015, 3e4
    links = [Link("finger", "base", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))]
    paths = [
        [
            cdsm.Site("base", (-0.05, 0.0, side * 0.01)),
            cdsm.JointPulley("to_finger", R, turn),
            cdsm.Site("finger", (0.05, 0.0, side * 0.01)),
        ]
        for side, turn in ((1.0, "+"), (-1.0, "-"))
    ]
    plain = arm_of(links, *paths, elasticity=cdsm.LinearElasticity(1e12), series_stiffness=k)
    pose = plain.at([0.1])
    np.testing.assert_allclose(abs(pose.length_jacobian), R, rtol=1e-12)
    control = {"control": "torque"} if k_m is None else {"stiffness": k_m}
    motor = cdsm.Motor("m", {"cable1": r, "cable2": -r}, **control)  # type: ignore[arg-type]
    K = cdsm.stiffness(plain.with_motors([motor]).at([0.1]), [10.0, 10.0])
    assert abs(K.passive[0, 0] - expected) < 6e-7

"""Arms whose motors move several cables."""

import numpy as np

import cdsm
from cdsm import presets
from tests.support.arms import readme_geometry

BENT = np.deg2rad([10.0, 5.0, 10.0, 5.0, -8.0, 0.0, -8.0, 0.0])
"""Posture of the arms here [rad]."""


def pairs(arm: cdsm.Manipulator, stiffness: float = np.inf) -> list[cdsm.Motor]:
    """Of the three cables of each joint two on one spool, against each other; the third alone."""
    motors = []
    for first, second, third in np.reshape(arm.cables.names, (-1, 3)).tolist():
        joint = first.partition("_")[0].removeprefix("cable")
        motors.append(cdsm.Motor(f"m{joint}", {first: 0.012, second: -0.012}, stiffness))
        motors.append(cdsm.Motor(f"m{joint}b", {third: 0.012}, stiffness))
    return motors


def spooled(
    stiffness: float = np.inf, elasticity: cdsm.Elasticity = presets.STRAND_1X19, **sizes: float
) -> cdsm.Manipulator:
    """README's arm, or one of other ``sizes``, with the eight motors of :func:`pairs`."""
    arm = cdsm.Manipulator(readme_geometry(**sizes), elasticity)
    return arm.with_motors(pairs(arm, stiffness))


def changed(arm: cdsm.Manipulator, changes: dict[str, dict[str, object]]) -> cdsm.Manipulator:
    """The arm, with other settings of some motors by name."""
    motors = []
    for motor in arm.motors.given:
        settings = {"stiffness": motor.stiffness, "control": motor.control}
        settings |= changes.get(motor.name, {})
        motors.append(cdsm.Motor(motor.name, motor.cables, **settings))  # type: ignore[arg-type]
    return arm.with_motors(motors)

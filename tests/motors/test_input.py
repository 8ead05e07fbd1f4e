"""What cannot be a motor is named, with what to do."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.motors import spooled

ARM = spooled().with_motors([])
PAIR = {"cable1_1": 0.012, "cable1_2": -0.012}


def test_a_drum_in_millimetres_is_doubted() -> None:
    with pytest.warns(cdsm.CdsmWarning, match=r"the drum of cable1_1 on motor 'm' is 12 m: it loo"):
        cdsm.Motor("m", {"cable1_1": 12.0, "cable1_2": -0.012})


ALONE: dict[str, tuple[dict[str, Any], str]] = {
    "no cables": ({"cables": {}}, "motor 'm': cables: none given; a motor moves one cable or more"),
    "a list": ({"cables": ["cable1_1"]}, r"give a dict of radii \[m\] by cable"),
    "zero": ({"cables": {"cable1_1": 0.0}}, "motor 'm': radius of cable1_1: 0 m takes in no wire"),
    "nan": ({"cables": {"cable1_1": np.nan}}, "radius of cable1_1"),
    "in mm": ({"cables": {"cable1_1": 12e3}}, "radius of cable1_1: 12000 m given"),
    "negative": ({"stiffness": -5.0}, "motor 'm': stiffness: -5 N m/rad given; 1e-09 to 1e"),
    "none": ({"stiffness": 0.0}, r"0 N m/rad holds no angle; give control='torque'\."),
    "no number": ({"stiffness": np.zeros(2)}, r"motor 'm': stiffness: shape \(2,\) given; one"),
    "both": ({"stiffness": 5.0, "control": "torque"}, "a motor with control='torque' has none"),
    "control": ({"control": "force"}, "no control is called 'force'.* Known: position, torque"),
    "name": ({"name": ""}, "name"),
}


@pytest.mark.parametrize("case", ALONE)
def test_a_faulty_motor_is_refused(case: str) -> None:
    changes, message = ALONE[case]
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.Motor(**({"name": "m", "cables": PAIR} | changes))


OTHER = cdsm.Motor("n", {"cable2_1": 0.01})
OF_ARM: dict[str, tuple[Any, str]] = {
    "None": (None, "motors: None given; a list or tuple of Motor is needed"),
    "no list": ({}, "motors: {} given; a list or tuple of Motor is needed"),
    "array": (np.zeros(2), "motors: .* given; a list or tuple of Motor is needed"),
    "unknown": (
        [cdsm.Motor("m", {"cable1_7": 0.01})],
        "no cable of motor 'm' is called 'cable1_7'; did you mean",
    ),
    "twice": (
        [cdsm.Motor("m", PAIR), cdsm.Motor("m", {"cable2_1": 0.01})],
        "motor 'm': the name is used twice",
    ),
    "a cable": (
        [cdsm.Motor("cable1_1", PAIR)],
        "motor 'cable1_1': is the name of a cable; give the motor another one",
    ),
    "the same": (
        [cdsm.Motor("m", PAIR), cdsm.Motor("o", {k: 2.0 * r for k, r in PAIR.items()}), OTHER],
        "motors: m, o do the same: turned together they move no cable",
    ),
    "two motors of one cable": (
        [cdsm.Motor("m", {"cable1_1": 0.01}), cdsm.Motor("o", {"cable1_1": 0.02}), OTHER],
        "motors: m, o do the same",
    ),
    "three of two": (
        [
            cdsm.Motor("m", PAIR),
            cdsm.Motor("o", {"cable1_1": 0.01}),
            cdsm.Motor("p", {"cable1_2": 0.01}),
        ],
        "motors: m, o, p do the same",
    ),
    "no motor": ([PAIR], "a list or tuple of Motor is needed"),
}


@pytest.mark.parametrize("case", OF_ARM)
def test_motors_that_do_not_fit_the_arm_are_refused(case: str) -> None:
    motors, message = OF_ARM[case]
    with pytest.raises(cdsm.InvalidInput, match=message):
        ARM.with_motors(motors)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"control": "force"}, "motor 'm': cable1_2 has control='force', which belongs to its"),
        ({"gain": 1.1}, "motor 'm': cable1_2 has gain = 1.1, which belongs to its motor"),
    ],
)
def test_what_belongs_to_the_motor_is_refused_at_its_cable(
    change: dict[str, Any], message: str
) -> None:
    cables = [replace(c, **change) if c.name == "cable1_2" else c for c in ARM.cables]
    with pytest.raises(cdsm.InvalidInput, match=message):
        ARM.with_cables(cables).with_motors([cdsm.Motor("m", PAIR)])
    with pytest.raises(cdsm.InvalidInput, match=message):
        ARM.with_motors([cdsm.Motor("m", PAIR)]).with_cables(cables)


def test_a_cable_may_hang_on_several_motors() -> None:
    arm = ARM.with_motors([cdsm.Motor("m", PAIR), cdsm.Motor("o", dict.fromkeys(PAIR, 0.01))])
    assert arm.motors.are_free
    assert arm.motors.names[:3] == ("m", "o", "cable1_3")
    np.testing.assert_array_equal(arm.motors.matrix[:2, :2], [[0.012, 0.01], [-0.012, 0.01]])
    assert "cable1_3 its own holds its length" in " ".join(str(arm.motors).split())


def test_a_torque_that_no_turn_gives_is_named_by_its_motor() -> None:
    """A drum of twins cannot push: its cables go slack, and none of them gives a torque below 0."""
    twins = cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": 0.012}, control="torque")
    arm = ARM.with_motors([twins])
    soft = arm.motors.yielding
    assert soft is not None

    def law(longer: Any) -> tuple[Any, Any]:
        F = 1e4 * longer
        return np.maximum(F, 0.0), np.where(F >= 0.0, 1e4, 0.0)

    turn, F, _ = soft.settle(law, np.array([0.24]), np.zeros(1))
    np.testing.assert_allclose(F[:2], 10.0, rtol=1e-12)
    assert abs(turn[0] - 10.0 / 1e4 / 0.012) < 1e-12
    with pytest.raises(
        cdsm.CdsmError, match=r"motor 'm1': no turn gives the torque of -0\.1 N m"
    ) as e:
        soft.settle(law, np.array([-0.1]), np.zeros(1))
    assert e.value.status is cdsm.Status.NO_EQUILIBRIUM


def test_forced_cables_leave_their_motors() -> None:
    forced = np.array([cable.startswith("cable1") for cable in ARM.cables.names])
    arm = spooled(20.0).with_forced(forced)
    assert [motor.name for motor in arm.motors.given] == ["m2", "m2b", "m3", "m3b", "m4", "m4b"]
    forced[0] = False
    with pytest.raises(cdsm.InvalidInput, match="motor 'm1': yields, and moves cable1_2, which"):
        spooled(20.0).with_forced(forced)
    assert not spooled().with_forced(forced).motors.given

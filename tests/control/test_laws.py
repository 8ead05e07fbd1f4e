"""Sensors, and motor laws: no command is slack or overload, and each pulls the right way."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import cdsm
from cdsm import control
from cdsm.control import MotorMeasurement
from cdsm.control.laws import INTEGRAL, LAWS, ControlInput, Reference
from cdsm.support.values import Array

CABLES = 4
tensions = arrays(np.float64, CABLES, elements=st.floats(-1e4, 1e4))
wires = arrays(np.float64, CABLES, elements=st.floats(-10.0, 10.0))
stiffnesses = arrays(np.float64, CABLES, elements=st.floats(1.0, 1e7) | st.just(0.0))
masks = arrays(np.bool_, CABLES)


@st.composite
def inputs(draw: Callable[..., Array]) -> ControlInput:
    """Anything that sensors and plans may say, nonsense included."""

    def reference() -> Reference:
        return Reference(np.zeros(2), draw(tensions), draw(wires), draw(stiffnesses))

    low = abs(draw(tensions))
    return ControlInput(
        reference=reference(),
        reference_before=reference(),
        measurement=MotorMeasurement(draw(wires), draw(tensions)),
        error_before=draw(tensions),
        paid_out=draw(wires),
        minimum=low,
        maximum=low + abs(draw(tensions)),
        tension_controlled=draw(masks),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("name", LAWS)
@given(given_input=inputs())
def test_no_law_commands_a_tension_outside_the_bounds(name: str, given_input: ControlInput) -> None:
    command = LAWS[name](given_input)
    assert (command.tension >= given_input.minimum).all()
    assert (command.tension <= given_input.maximum).all()
    assert (command.tension >= 0.0).all()
    assert np.isfinite(command.paid_out).all()


@pytest.mark.parametrize("name", ["tension", "mixed"])
@given(at=inputs())
def test_wire_and_tension_of_a_command_agree(name: str, at: ControlInput) -> None:
    """A cable that moves as planned has, with this wire, the commanded tension."""
    command, k = LAWS[name](at), at.reference.stiffness
    now, before, measured = at.reference, at.reference_before, at.measurement
    paid = (now.paid_out - before.paid_out) - (command.paid_out - measured.paid_out)
    there = measured.tension + (now.tension - before.tension) + k * paid
    lengths = abs(now.paid_out) + abs(before.paid_out) + abs(at.paid_out) + abs(measured.paid_out)
    forces = abs(there) + abs(measured.tension) + abs(now.tension) + abs(before.tension)
    rounding = 1e-13 * (1.0 + forces + abs(at.error_before) + k * lengths)
    assert (abs(there - command.tension) <= 10.0 * rounding)[k > 0.0].all()


def held(error: float, *, controlled: bool = True) -> ControlInput:
    """A cable that stands still, with ``error`` [N] missing to its wanted 50 N."""
    wanted = Reference(np.zeros(1), np.array([50.0]), np.array([0.4]), np.array([2e4]))
    measured = MotorMeasurement(np.array([0.41]), np.array([50.0 - error]))
    bounds = np.array([10.0]), np.array([200.0])
    missing, mask = np.array([error]), np.array([controlled])
    return ControlInput(wanted, wanted, measured, missing, measured.paid_out, *bounds, mask)


def changed(at: ControlInput, **reference: float) -> ControlInput:
    numbers = {name: np.array([value]) for name, value in reference.items()}
    return at._replace(reference=at.reference._replace(**numbers))


CALM, OFF, FREE = held(0.0), held(5.0), held(5.0, controlled=False)
MOVED = changed(CALM, tension=52.0, paid_out=0.399)._replace(maximum=np.array([60.0]))


@pytest.mark.parametrize(
    ("law", "at", "tension", "wire", "saturated"),
    [
        # the integral part of a constant error: I e/k of wire is taken in where tension is missing
        (control.tension_control, OFF, 45.0 + 5.0 * INTEGRAL, 0.41 - 5.0 * INTEGRAL / 2e4, False),
        (control.tension_control, held(-5.0), 55.0 - 5.0 * INTEGRAL, 0.41 + INTEGRAL / 4e3, False),
        (control.mixed, OFF, 45.0 + 5.0 * INTEGRAL, 0.41 - 5.0 * INTEGRAL / 2e4, False),
        # 10 mm of wire at 20 N/mm are 200 N above the 45 N measured: the clamp lets 155 N through
        (control.mixed, FREE, 200.0, 0.41 - (200.0 - 45.0) / 2e4, True),
        # the joint moves by 1 mm of cable, 20 N at constant posture; the plan wants 2 N more
        (control.tension_control, MOVED, 52.0, 0.409, False),
        (control.mixed, MOVED, 52.0, 0.409, False),
        # wire is paid out that is too tense
        (control.feedforward, changed(CALM, tension=240.0), 200.0, 0.4 + 40.0 / 2e4, True),
    ],
)
def test_wire_and_tension_of_one_cable_are_those_by_hand(
    law: control.Law, at: ControlInput, tension: float, wire: float, saturated: bool
) -> None:
    command = law(at)
    assert command.tension[0] == pytest.approx(tension)
    assert command.paid_out[0] == pytest.approx(wire)
    assert command.saturated.all() == command.saturated.any() == saturated


TRUTH = [MotorMeasurement(np.full(3, 0.1234567 * k), np.full(3, 50.0 + k)) for k in (1, 2, 3)]


def test_sensors_count_err_and_are_late_as_they_say() -> None:
    random = np.random.default_rng(0)
    wire = cdsm.Sensors(encoder=1e-4).measure(TRUTH, random).paid_out
    np.testing.assert_allclose(wire / 1e-4, np.round(wire / 1e-4), atol=1e-9)
    assert 0.0 < abs(wire - TRUTH[-1].paid_out).max() <= 0.5e-4
    noisy = cdsm.Sensors(tension_noise=0.5, tension_bias=-1.0)
    errors = np.array([noisy.measure(TRUTH, random).tension for _ in range(4000)]) - 53.0
    assert errors.mean() == pytest.approx(-1.0, abs=0.02)
    assert errors.std() == pytest.approx(0.5, rel=0.02)
    assert abs(errors).max() <= 3.0
    for delay, wanted in ((0, 53.0), (1, 52.0), (2, 51.0), (9, 51.0)):
        assert cdsm.Sensors(delay=delay).measure(TRUTH, random).tension[0] == wanted

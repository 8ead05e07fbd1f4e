"""Motor laws: no command is slack or overload, and each pulls the right way."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdsm import control
from cdsm.control.laws import INTEGRAL, LAWS, Moment, Reading, Reference
from cdsm.support.values import Array

CABLES = 4
tensions = arrays(np.float64, CABLES, elements=st.floats(-1e4, 1e4))
wires = arrays(np.float64, CABLES, elements=st.floats(-10.0, 10.0))
stiffnesses = arrays(np.float64, CABLES, elements=st.floats(1.0, 1e7) | st.just(0.0))
masks = arrays(np.bool_, CABLES)


@st.composite
def moments(draw: Callable[..., Array]) -> Moment:
    """Anything that sensors and plans may say, nonsense included."""

    def reference() -> Reference:
        return Reference(np.zeros(2), draw(tensions), draw(wires), draw(stiffnesses))

    def reading() -> Reading:
        return Reading(draw(wires), draw(tensions))

    low = abs(draw(tensions))
    return Moment(
        reference=reference(),
        reading=reading(),
        reference_before=reference(),
        reading_before=reading(),
        command=draw(wires),
        minimum=low,
        maximum=low + abs(draw(tensions)),
        forced=draw(masks),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("name", LAWS)
@given(moment=moments())
def test_no_law_commands_a_tension_outside_the_bounds(name: str, moment: Moment) -> None:
    command = LAWS[name](moment)
    assert (command.tension >= moment.minimum).all()
    assert (command.tension <= moment.maximum).all()
    assert (command.tension >= 0.0).all()
    assert np.isfinite(command.wire).all()


@pytest.mark.parametrize("name", ["tension", "mixed"])
@given(moment=moments())
def test_wire_and_tension_of_a_command_agree(name: str, moment: Moment) -> None:
    """The wire is that at which a cable that is held still has the commanded tension."""
    command, k = LAWS[name](moment), moment.reference.stiffness
    there = moment.reading.tension + k * (moment.reading.wire - command.wire)
    wanted, before = moment.reference.wire, moment.reference_before.wire
    lengths = abs(moment.reading.wire) + abs(moment.command) + abs(wanted) + abs(before)
    rounding = 1e-13 * (1.0 + abs(there) + abs(moment.reading.tension) + k * lengths)
    assert (abs(there - command.tension) <= 10.0 * rounding)[k > 0.0].all()


def moment(error: float, *, forced: bool = True) -> Moment:
    """A cable that stands still, with ``error`` [N] missing to its wanted 50 N."""
    wanted = Reference(np.zeros(1), np.array([50.0]), np.array([0.4]), np.array([2e4]))
    reading = Reading(np.array([0.41]), np.array([50.0 - error]))
    bounds = np.array([10.0]), np.array([200.0])
    return Moment(wanted, reading, wanted, reading, reading.wire, *bounds, np.array([forced]))


def test_tension_control_takes_wire_in_where_tension_is_missing() -> None:
    """The integral part of a constant error: I e/k of wire."""
    command = control.tension_control(moment(5.0))
    assert 0.41 - command.wire[0] == pytest.approx(INTEGRAL * 5.0 / 2e4)
    assert command.tension[0] == pytest.approx(45.0 + INTEGRAL * 5.0)
    assert control.tension_control(moment(-5.0)).wire[0] > 0.41
    assert not command.saturated.any()


def test_mixed_law_pays_out_the_wire_of_the_plan_where_it_controls_no_tension() -> None:
    free = control.mixed(moment(5.0, forced=False))
    # 10 mm of wire at 20 N/mm are 200 N above the 45 N measured: the clamp lets 155 N through
    assert free.saturated.all()
    assert free.tension[0] == 200.0
    assert free.wire[0] == pytest.approx(0.41 - (200.0 - 45.0) / 2e4)
    assert control.mixed(moment(5.0)) == control.tension_control(moment(5.0))


def test_feedforward_needs_no_sensor() -> None:
    one, other = control.feedforward(moment(5.0)), control.feedforward(moment(-300.0))
    assert one.wire[0] == other.wire[0] == 0.4
    assert one.tension[0] == 50.0


def test_feedforward_of_an_overload_pays_the_wire_out_that_is_too_tense() -> None:
    wanted = moment(0.0)
    wanted = wanted._replace(reference=wanted.reference._replace(tension=np.array([240.0])))
    command = control.feedforward(wanted)
    assert command.tension[0] == 200.0
    assert command.wire[0] == pytest.approx(0.4 + 40.0 / 2e4)
    assert command.saturated.all()

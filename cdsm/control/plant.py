"""Plants: the arms that a control loop moves. Protocol, and a quasi-static arm with friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar, final

import numpy as np

from cdsm.control.laws import Command, Reading
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.quasi_static import Load, QuasiStaticArm, QuasiStaticState
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen


class PlantState(Protocol):
    """Immutable state of a plant; each move of the plant returns a new state."""

    @property
    def pose(self) -> Posture:
        """The true posture."""

    @property
    def true(self) -> Reading:
        """True length of the wire paid out [m] and tension [N] at each motor, both (C,)."""


AnyState = TypeVar("AnyState", bound=PlantState)


class Plant(Protocol[AnyState]):
    """An arm whose motors :func:`~cdsm.track` commands."""

    @property
    def arm(self) -> Manipulator:
        """The true arm."""

    def begin(self, q: Array, tension: Array, wrench: Array) -> AnyState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""

    def move(self, state: AnyState, command: Command, wrench: Array) -> AnyState:
        """Return the state after ``state``, when the motors have executed ``command``.

        ``wrench`` (6,) is the load: force [N], then moment [N m].

        Raises:
            CdsmError: No equilibrium was found, or a tension leaves the domain of its law.
        """


class SlowState(NamedTuple):
    """State of a :class:`SlowPlant`; the wire in each segment depends on all earlier loads."""

    loading: QuasiStaticArm  # the arm
    reference_wire: Array  # l_0 (C,) [m] at the posture where the plant began
    state: QuasiStaticState  # posture, load and wire in each segment

    @property
    def pose(self) -> Posture:
        """The true posture."""
        return self.state.arm_state.pose

    @property
    def true(self) -> Reading:
        """True length of the wire paid out [m] and tension [N] at each motor, both (C,)."""
        wire = self.reference_wire - np.where(self.loading.forced, 0.0, self.state.load.motors)
        tension = self.state.arm_state.tension[self.loading.start[:-1]]
        return Reading(frozen(wire), frozen(tension))


@final
@dataclass(frozen=True)
class SlowPlant:
    """Quasi-static arm whose cables stick and slide in their holes, as in :func:`~cdsm.load_cycle`.

    Its motors follow each command exactly and slowly. Its wire, friction, dimensions and load may
    differ from those in the controller's model.

    Attributes:
        arm: The true arm.
        substeps: Number of equal sub-steps of a move, as in :func:`~cdsm.load_cycle`.

    Raises:
        InvalidInput: ``original_length`` of the arm is not ``"unstrained"``, or ``substeps`` is not
            a positive whole number.
    """

    arm: Manipulator
    substeps: int = 1

    def __post_init__(self) -> None:
        require_unstrained("arm", self.arm)
        whole_number("substeps", self.substeps, 1)

    def begin(self, q: Array, tension: Array, wrench: Array) -> SlowState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""
        pose = self.arm.at(q)
        loading = QuasiStaticArm(pose, tension)
        wire = self.arm._laws.original_lengths(pose.cable_lengths, tension)
        return SlowState(loading, wire, loading.initial(wrench))

    def move(self, state: SlowState, command: Command, wrench: Array) -> SlowState:
        """Return the state after ``state``, as :meth:`Plant.move` describes.

        Raises EquilibriumError if the arm buckles.
        """
        loading = state.loading
        taken_in = state.reference_wire - command.wire
        motors = np.where(loading.forced, command.tension, taken_in)
        load = Load(wrench, np.zeros(self.arm.nv), motors)
        return state._replace(
            state=loading.step_to(state.state, load, self.substeps, "the step")[0]
        )


def require_unstrained(name: str, arm: Manipulator) -> None:
    """Raise InvalidInput unless ``arm`` is a Manipulator with "unstrained" original lengths.

    ``name`` is the argument that the error names.
    """
    if instance(name, arm, Manipulator).original_length != "unstrained":
        raise InvalidInput(
            name, 'has original_length = "stretched"; motors pay out unstrained lengths.'
        )

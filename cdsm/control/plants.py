"""Plants: the arms that a control loop moves: quasi-static with friction, or simulated by MuJoCo.

Each cable of a model of MuJoCo is an actuator of constant stiffness, since MuJoCo has no other.
Here, ten times per step of control, each actuator gets the force and the tangent stiffness of its
cable. So the arm has the same equilibria as in cdsm. Cables slide freely in holes.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Protocol, TypeVar, final

import numpy as np

from cdsm.control.laws import Command
from cdsm.control.sensing import MotorMeasurement
from cdsm.errors import CdsmError, ElasticityRangeError, InvalidInput, need
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics import quasi_static
from cdsm.statics.equilibrium import equilibrium
from cdsm.statics.quasi_static import Action, QuasiStaticArm
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.validation import checked_quantity, instance, not_negative, whole_number
from cdsm.support.values import Array, frozen

_TANGENTS: Final = 10  # number of updates of the motors' tangents and of the load per step


class PlantState(Protocol):
    """Immutable state of a plant; each move of the plant returns a new state."""

    @property
    def pose(self) -> Posture:
        """The true posture."""

    @property
    def true_values(self) -> MotorMeasurement:
        """True length of the wire paid out [m] and tension [N] at each motor, both (C,)."""


AnyState = TypeVar("AnyState", bound=PlantState)


class Plant(Protocol[AnyState]):
    """An arm whose motors :func:`~cdsm.track` commands."""

    @property
    def arm(self) -> Manipulator:
        """The true arm."""

    def initial(self, q: Array, tension: Array, wrench: Array) -> AnyState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""

    def step_to(self, state: AnyState, command: Command, wrench: Array) -> AnyState:
        """Return the state after ``state``, when the motors have executed ``command``.

        ``wrench`` (6,) is the load: force [N], then moment [N m].

        Raises:
            CdsmError: No equilibrium was found, or a tension leaves the domain of its law.
        """


class QuasiStaticPlantState(NamedTuple):
    """State of a :class:`QuasiStaticPlant`: the wire in each segment depends on earlier loads."""

    loading: QuasiStaticArm
    initial_paid_out: Array  # l_0 (C,) [m] at the posture where the plant began
    state: quasi_static.QuasiStaticState  # posture, load and wire in each segment

    @property
    def pose(self) -> Posture:
        """The true posture."""
        return self.state.arm_state.pose

    @property
    def true_values(self) -> MotorMeasurement:
        """True length of the wire paid out [m] and tension [N] at each motor, both (C,)."""
        taken_in = np.where(self.loading.forced, 0.0, self.state.load.motors)
        tension = self.state.arm_state.tension[self.loading.start[:-1]]
        return MotorMeasurement(frozen(self.initial_paid_out - taken_in), frozen(tension))


@final
@dataclass(frozen=True)
class QuasiStaticPlant:
    """Quasi-static arm whose cables stick and slide in their holes, as in :func:`~cdsm.load_cycle`.

    Its motors follow each command exactly and slowly. Its wire, friction, dimensions and load may
    differ from those in the controller's model.

    Attributes:
        arm: The true arm.
        substeps: Number of equal sub-steps of a step, as in :func:`~cdsm.load_cycle`.

    Raises:
        InvalidInput: ``substeps`` is not a positive whole number.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> plant = cdsm.QuasiStaticPlant(arm, substeps=2)
        >>> plant.substeps
        2
    """

    arm: Manipulator
    substeps: int = 1

    def __post_init__(self) -> None:
        instance("arm", self.arm, Manipulator)
        whole_number("substeps", self.substeps, 1)

    def initial(self, q: Array, tension: Array, wrench: Array) -> QuasiStaticPlantState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""
        pose = self.arm.at(q)
        loading = QuasiStaticArm(pose, tension)
        paid_out = self.arm.laws.original_lengths(pose.cable_lengths, tension)
        return QuasiStaticPlantState(loading, paid_out, loading.initial(wrench))

    def step_to(
        self, state: QuasiStaticPlantState, command: Command, wrench: Array
    ) -> QuasiStaticPlantState:
        """Return the state after ``state``, as :meth:`Plant.step_to` describes.

        Raises EquilibriumError if the arm buckles.
        """
        loading = state.loading
        taken_in = state.initial_paid_out - command.paid_out
        motors = np.where(loading.forced, command.tension, taken_in)
        load = Action(wrench, np.zeros(self.arm.nv), motors)
        moved, *_ = loading.step_to(state.state, load, self.substeps, "the step")
        return state._replace(state=moved)


def frictionless_stiffness(state: PlantState, wrench: Array) -> Stiffness:
    """Return K_θ at the equilibrium that the arm of ``state`` would have without friction.

    With friction the measured stiffness depends on the size and on the history of the load: small
    weights measure the stuck arm, which is several times stiffer. Here the wire of ``state`` slides
    freely, and ``wrench`` (6,) is the load.

    Raises:
        EquilibriumError: There is no equilibrium: the arm buckles.
        ElasticityRangeError: A tension leaves the domain of its law.
    """
    pose = state.pose
    true = state.true_values
    F = true.tension
    if pose.arm.has_friction:
        F = _tensions_of(pose.arm, pose.cable_lengths, true.paid_out, F)
    return equilibrium(pose, F, wrench).stiffness


def _tensions_of(arm: Manipulator, lengths: Array, paid_out: Array, tension: Array) -> Array:
    """Compute F (C,) [N] from ``lengths`` and wire ``paid_out`` (C,) [m], without friction."""
    F = np.array(tension)
    for c, (cable, wire) in enumerate(zip(arm.cables, paid_out.tolist(), strict=True)):
        if cable.control == "position":
            elongation = float(lengths[c]) - wire
            slack = cable.elasticity.low == 0.0 and elongation <= cable.elongation(0.0, wire)
            try:
                F[c] = 0.0 if slack else cable.tension(elongation, wire)
            except ElasticityRangeError as error:
                raise ElasticityRangeError(error.problem, (), [c], [cable.name]) from None
    return F


class MuJoCoState(NamedTuple):
    """State of a :class:`MuJoCoPlant` after a step of control."""

    model: Any  # mujoco.MjModel, never changed
    pose: Posture  # true posture
    true_values: MotorMeasurement  # true wire and tension at the motors
    joints: Array  # coordinates of all joints [rad], and their velocities [rad/s] (2, n)


@final
@dataclass(frozen=True)
class MuJoCoPlant:
    """Arm with inertia and damping, moved by MuJoCo from one step of control to the next.

    The arm may still move when the next command comes.

    Attributes:
        arm: The true arm, without friction in its holes.
        period: Time of a step [s].
        damping_ratio: Damping ratio of the least damped mode [-]; see :func:`~cdsm.to_mjcf`.

    Raises:
        CdsmError: mujoco is not installed.
        InvalidInput: The arm has friction, or a number is not positive.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> cdsm.MuJoCoPlant(arm, period=0.05).period
        0.05
    """

    arm: Manipulator
    period: float = 0.05
    damping_ratio: float = 0.5

    def __post_init__(self) -> None:
        need("mujoco", "mujoco")
        instance("arm", self.arm, Manipulator)
        checked_quantity("period", self.period, "time")
        not_negative("damping_ratio", self.damping_ratio)
        if self.arm.has_friction:
            raise InvalidInput(
                "arm", "has friction, which MuJoCo's cables have not; give arm.with_friction(0.0)."
            )

    def initial(self, q: Array, tension: Array, wrench: Array) -> MuJoCoState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""
        import mujoco

        from cdsm.interchange.mjcf import to_mjcf  # slow to import

        pose = self.arm.at(q)
        text = to_mjcf(self.arm, pose, tension, damping_ratio=self.damping_ratio)
        paid_out = self.arm.laws.original_lengths(pose.cable_lengths, tension)
        model = mujoco.MjModel.from_xml_string(text)
        joints = frozen(np.array([model.qpos0, 0.0 * model.qpos0]))
        return MuJoCoState(model, pose, MotorMeasurement(paid_out, tension), joints)

    def step_to(self, state: MuJoCoState, command: Command, wrench: Array) -> MuJoCoState:
        """Return the state one period after ``state``, under a command and a wrench (6,).

        Raises:
            CdsmError: The simulation diverges.
            ElasticityRangeError: A tension leaves the domain of its law.
        """
        import mujoco

        model = copy.copy(state.model)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = state.joints
        body = model.body(self.arm.tip_link).id
        steps = max(round(self.period / _TANGENTS / model.opt.timestep), 1)
        for _ in range(_TANGENTS):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_tendon(model, data)
            self._set_motors(model, data.ten_length, command)
            data.qfrc_applied[:] = 0.0
            tip = data.site("tool0").xpos
            mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], tip, body, data.qfrc_applied)
            mujoco.mj_step(model, data, steps)
        if not np.isfinite(data.qpos).all() or data.warning.number.any():
            raise CdsmError(
                "the simulation diverges: the arm moves beyond all bounds", Status.DIVERGED
            )
        rows = [model.joint(name).qposadr[0] for name in self.arm.joint_names]
        pose = self.arm.at(data.qpos[rows], check_limits=False)
        F = _tensions_of(self.arm, pose.cable_lengths, command.paid_out, command.tension)
        true_values = MotorMeasurement(command.paid_out, frozen(F))
        joints = frozen(np.array([data.qpos, data.qvel]))
        return MuJoCoState(state.model, pose, true_values, joints)

    def _set_motors(self, model: Any, lengths: Array, command: Command) -> None:
        """Let actuators pull F + k (L′ − L) at L′; L (C,) [m] are ``lengths``, without leads."""
        cables = self.arm.cables
        L = lengths + [cable.lead for cable in cables]
        F = _tensions_of(self.arm, L, command.paid_out, command.tension)
        for c, cable in enumerate(cables):
            motor = model.actuator(cable.name).id
            taut = cable.control == "position" and F[c] > 0.0
            k = float(cable.tangent_stiffness(F[c], command.paid_out[c])) if taut else 0.0
            model.actuator_gainprm[motor, 0] = 0.0
            model.actuator_biasprm[motor, :3] = k * lengths[c] - F[c], -k, 0.0

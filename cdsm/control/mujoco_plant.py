"""Plant with inertia and damping: MuJoCo simulates the exported model of the arm.

Each cable of the exported model is an actuator of constant stiffness, since MuJoCo has no other.
Here, ten times per step of control, each actuator gets the force and the tangent stiffness of its
cable. So the arm has the same equilibria as in cdsm. Cables slide freely in holes.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, final

import numpy as np

from cdsm.control.laws import Command
from cdsm.control.plants import require_unstrained, tensions_of
from cdsm.control.sensors import Measurement
from cdsm.errors import InvalidInput, need, solver_failed
from cdsm.interchange.mjcf import to_mjcf
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.validation import quantity
from cdsm.support.values import Array, frozen

_TANGENTS: Final = 10  # number of updates of the motors' tangents and of the load per step


class MuJoCoState(NamedTuple):
    """State of a :class:`MuJoCoPlant` after a step of control."""

    model: Any  # mujoco.MjModel, never changed
    pose: Posture  # true posture
    true_values: Measurement  # true wire and tension at the motors
    velocity: Array  # of the joints (nv,) [rad/s], in MuJoCo's order


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
        InvalidInput: The arm has friction, ``original_length`` is not ``"unstrained"``, or a number
            is not positive.
    """

    arm: Manipulator
    period: float = 0.05
    damping_ratio: float = 0.5

    def __post_init__(self) -> None:
        need("mujoco", "mujoco")
        require_unstrained("arm", self.arm)
        quantity("period", self.period, "time")
        if self.arm.has_friction:
            raise InvalidInput(
                "arm", "has friction, which MuJoCo's cables have not; give arm.with_friction(0.0)."
            )

    def initial(self, q: Array, tension: Array, wrench: Array) -> MuJoCoState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""
        import mujoco

        pose = self.arm.at(q)
        text = to_mjcf(self.arm, pose, tension, damping_ratio=self.damping_ratio)
        paid_out = self.arm._laws.original_lengths(pose.cable_lengths, tension)
        model = mujoco.MjModel.from_xml_string(text)
        return MuJoCoState(model, pose, Measurement(paid_out, tension), frozen(np.zeros(q.size)))

    def step_to(self, state: MuJoCoState, command: Command, wrench: Array) -> MuJoCoState:
        """Return the state one period after ``state``, under a command and a wrench (6,).

        Raises:
            CdsmError: The simulation diverges.
            ElasticityRangeError: A tension leaves the domain of its law.
        """
        import mujoco

        model = copy.copy(state.model)
        data = mujoco.MjData(model)
        names = self.arm.joint_names
        address = np.array([model.joint(name).qposadr[0] for name in names])
        data.qpos[address], data.qvel[:] = state.pose.q, state.velocity
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
            raise solver_failed("mujoco", "diverges: the arm moves beyond all bounds")
        pose = self.arm.at(data.qpos[address].copy(), check_limits=False)
        F = tensions_of(self.arm, pose.cable_lengths, command.paid_out, command.tension)
        true_values = Measurement(command.paid_out, frozen(F))
        return MuJoCoState(state.model, pose, true_values, data.qvel.copy())

    def _set_motors(self, model: Any, lengths: Array, command: Command) -> None:
        """Set each actuator of ``model`` so that it has the force F + k (L' − L) at a length L'.

        L (C,) is ``lengths`` [m], without the leads. F is the tension at L with the commanded wire,
        and k is the tangent stiffness of the cable.
        """
        cables = self.arm.cables
        L = lengths + [cable.lead for cable in cables]
        F = tensions_of(self.arm, L, command.paid_out, command.tension)
        for c, cable in enumerate(cables):
            motor = model.actuator(cable.name).id
            taut = cable.control == "position" and F[c] > 0.0
            k = float(cable.tangent_stiffness(F[c], command.paid_out[c])) if taut else 0.0
            model.actuator_gainprm[motor, 0] = 0.0
            model.actuator_biasprm[motor, :3] = k * lengths[c] - F[c], -k, 0.0

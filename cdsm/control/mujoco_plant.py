"""Plant with inertia and damping: MuJoCo simulates the exported model of the arm.

Each cable of the exported model is an actuator of constant stiffness, since MuJoCo has no other.
Here, ten times per step of control, each actuator gets the force and the tangent stiffness of its
cable. So the arm has the same equilibria as in cdsm. Cables slide freely in holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple, final

import numpy as np

from cdsm.cable import Cable
from cdsm.control.laws import Command, Reading
from cdsm.control.plant import require_unstrained
from cdsm.errors import ElasticityRangeError, InvalidInput, SolverError
from cdsm.interchange.mjcf import to_mjcf
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.extras import need
from cdsm.support.validation import quantity
from cdsm.support.values import Array, frozen

_TANGENTS: Final = 10  # number of updates of the motors' tangents and of the load per step


class MuJoCoState(NamedTuple):
    """State of a :class:`MuJoCoPlant` after a step of control."""

    model: Any  # mujoco.MjModel
    pose: Posture  # true posture
    true: Reading  # true wire and tension at the motors
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
        MissingExtra: mujoco is not installed.
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

    def begin(self, q: Array, tension: Array, wrench: Array) -> MuJoCoState:
        """Return the state at rest at angles (nv,), with tensions (C,) [N] and a wrench (6,)."""
        import mujoco

        pose = self.arm.at(q)
        text = to_mjcf(self.arm, pose, tension, damping_ratio=self.damping_ratio)
        wire = self.arm._laws.original_lengths(pose.cable_lengths, tension)
        model = mujoco.MjModel.from_xml_string(text)
        return MuJoCoState(model, pose, Reading(wire, tension), frozen(np.zeros(q.size)))

    def move(self, state: MuJoCoState, command: Command, wrench: Array) -> MuJoCoState:
        """Return the state one period after ``state``, under a command and a wrench (6,).

        Raises:
            SolverError: The simulation diverges.
            ElasticityRangeError: A tension leaves the domain of its law.
        """
        import mujoco

        model, data = state.model, mujoco.MjData(state.model)
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
            raise SolverError("mujoco", "diverges: the arm moves beyond all bounds")
        pose = self.arm.at(data.qpos[address].copy(), check_limits=False)
        F = self._tensions(pose.cable_lengths, command)
        return MuJoCoState(model, pose, Reading(command.wire, frozen(F)), data.qvel.copy())

    def _set_motors(self, model: Any, lengths: Array, command: Command) -> None:
        """Set each actuator of ``model`` so that it has the force F + k (L' − L) at a length L'.

        L (C,) is ``lengths`` [m], without the leads. F is the tension at L with the commanded wire,
        and k is the tangent stiffness of the cable.
        """
        cables = self.arm.cables
        L = lengths + [cable.lead for cable in cables]
        F = self._tensions(L, command)
        for c, cable in enumerate(cables):
            motor = model.actuator(cable.name).id
            taut = cable.control == "position" and F[c] > 0.0
            k = float(cable.tangent_stiffness(F[c], command.wire[c])) if taut else 0.0
            model.actuator_gainprm[motor, 0] = 0.0
            model.actuator_biasprm[motor, :3] = k * lengths[c] - F[c], -k, 0.0

    def _tensions(self, lengths: Array, command: Command) -> Array:
        """Compute F (C,) [N] from cable lengths (C,) [m], leads included, and the command.

        A position-controlled cable has the commanded wire, a force-controlled one the commanded
        tension. Raises ElasticityRangeError as :meth:`move` does.
        """
        F = command.tension.copy()
        for c, cable in enumerate(self.arm.cables):
            if cable.control == "position":
                stretch, wire = float(lengths[c] - command.wire[c]), float(command.wire[c])
                try:
                    F[c] = _tension(cable, stretch, wire)
                except ElasticityRangeError as error:
                    raise ElasticityRangeError(error.problem, (), [c], [cable.name]) from None
        return F


def _tension(cable: Cable, elongation: float, wire: float) -> float:
    """Compute F [N] of a cable; 0 N if it is slack.

    A law that begins above 0 N is not defined for a slack cable: ElasticityRangeError is raised. A
    law with a slack branch is slack only below the elongation at 0 N, which is negative.
    """
    if cable.elasticity.low == 0.0 and elongation <= float(cable.elongation(0.0, wire)):
        return 0.0
    return float(cable.tension(elongation, wire))

"""Where an arm comes to rest, from what its motors do: they hold tensions, or take in wire."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import EquilibriumError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.continuation import Model, follow, stage_at
from cdsm.statics.equilibrium import Equilibrium, as_equilibrium, settled
from cdsm.statics.events import events_on, watched
from cdsm.statics.locked_arm import LockedArm
from cdsm.stiffness_matrix import checked_tension
from cdsm.support.format import place
from cdsm.support.validation import NO_WRENCH, instance, one_of, scalar, vector, wrench_vector
from cdsm.support.values import Array

_HELD = 1e-9  # least stiffness of a joint without load, over the largest

OfCables = ArrayLike | Mapping[str, float]
"""A number for each cable (C,), or numbers by the names of cables; the other cables are loose."""


def forward_statics(
    arm: Manipulator,
    *,
    tension: OfCables | None = None,
    rest_lengths: OfCables | None = None,
    pull: OfCables | None = None,
    wrench: ArrayLike = NO_WRENCH,
    start: ArrayLike | None = None,
) -> Equilibrium:
    """Compute where an arm comes to rest, from what its motors do.

    Solve J_Lᵀ F + g + k (q − q_0) = J_Xᵀ W for q, between the joint limits. Joints that no cable
    holds need springs. Exactly one of ``tension``, ``rest_lengths`` and ``pull`` is given: (C,), or
    a dict by the names of cables, the others being loose. With given tensions, cables add no
    stiffness of their own (k_c = 0); motors that hold lengths are locked, and k_c counts.
    :attr:`Equilibrium.motors` says which: the two stiffnesses of one posture can differ by a factor
    of ten.

    Args:
        arm: The arm.
        tension: F (C,) [N] that the motors hold.
        rest_lengths: Unstrained lengths l_0 (C,) [m] of the wires that the motors have left.
        pull: How much wire each motor reports to have taken in (C,) [m], from the lengths in which
            the cables are just straight at the angles q_0 of the springs: these lengths become
            shorter by ``gain`` · pull − ``slack`` of each :class:`~cdsm.Cable`. A cable is straight
            at zero strain, where a law that begins above 0 N has its lowest tension.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        start: Angles q (nv,) [rad] at which the search begins, under the whole load. None: load and
            pull grow from nothing, from the angles q_0; :attr:`Equilibrium.branch` says if the arm
            jumped on the way.

    Raises:
        InvalidInput: Not exactly one of the three is given, an argument has the wrong shape, or a
            cable does not exist; or motors hold lengths, but a cable has the control ``"force"``.
        ElasticityRangeError: Motors hold lengths, and a tension is outside the domain of its law.
        EquilibriumError: No stable equilibrium was found, or nothing holds a joint.
    """
    instance("arm", arm, Manipulator)
    commands = {"tension": tension, "rest_lengths": rest_lengths, "pull": pull}
    named = [name for name, value in commands.items() if value is not None]
    if len(named) != 1:
        problem = (
            f"give exactly one of {', '.join(commands)}; {' and '.join(named) or 'none'} given."
        )
        raise InvalidInput("forward_statics", problem)
    W = wrench_vector("wrench", wrench)
    home = arm.at(home_angles(arm))
    begin = home if start is None else arm.at(start)
    model = _model(arm, named[0], _of_all(arm, named[0], commands[named[0]]), home, begin, W)
    loaded = model(1.0)
    if start is not None:
        return as_equilibrium(loaded, settled(loaded, begin))
    _require_held(model(0.0), home)
    here = settled(model(0.0), home)
    branch = follow(model, stage_at(model, here.state.pose, here.stop_torque, 0.0), 1.0)
    force = float(np.linalg.norm(W[:3]))
    events = events_on(model, branch, watched(model(0.0)), force, 1.0)
    last = branch[-1]
    reached = 1.0
    here = last.point
    if last.share < 1.0:
        reached = events[-1].share
        here = settled(loaded, last.pose, reached)
    return as_equilibrium(loaded, here, reached, events)


def home_angles(arm: Manipulator) -> Array:
    """Return the angles q_0 of the springs (nv,), or the joint limits next to them."""
    return np.clip(arm.springs.rest, arm.lower, arm.upper)


def _of_all(arm: Manipulator, name: str, value: Any) -> ArrayLike:
    """Return what all motors do (C,); cables that a dict does not name are loose."""
    if not isinstance(value, Mapping):
        return value  # type: ignore[no-any-return]
    numbers = {
        "tension": np.zeros(len(arm.cables)),
        "rest_lengths": arm.at(home_angles(arm)).cable_lengths + arm.length,
        "pull": np.array([-arm.length / cable.gain for cable in arm.cables]),
    }[name]
    for cable, number in value.items():
        c = arm.cables.names.index(one_of("cable", cable, arm.cables.names))
        numbers[c] = scalar(f"{name}[{cable!r}]", number)
    return numbers


def _model(
    arm: Manipulator, name: str, value: ArrayLike, home: Posture, begin: Posture, wrench: Array
) -> Model:
    count = len(arm.cables)
    if name == "tension":
        F, _ = checked_tension(home, value, wrench)
        return lambda share: LockedArm(begin, share * F, share * wrench, tension_held=True)
    for cable in arm.cables:
        if cable.control == "force":
            problem = f"{cable.name} has control='force': its motor holds a tension, no length. "
            raise InvalidInput(name, f"{problem}Give tension, or this cable control='position'.")
    least = np.array([cable.elasticity.rest for cable in arm.cables])
    straight = arm.laws.original_lengths(home.cable_lengths, least)
    if name == "pull":
        taken = vector("pull", value, count, "the wire taken in [m] per cable", "length")
        slack, gain = np.array([(cable.slack, cable.gain) for cable in arm.cables]).T
        rest = straight - (gain * taken - slack)
    else:
        rest = vector("rest_lengths", value, count, "one length [m] per cable", "length")
    if not (rest > 0.0).all():
        c = int(rest.argmin())
        problem = (
            f"leaves {rest[c]:.4g} m of {arm.cables[c].name}, which is {straight[c]:.4g} m long."
        )
        raise InvalidInput(name, problem)

    def model(share: float) -> LockedArm:
        lengths = straight + share * (rest - straight)
        return LockedArm(begin, least, share * wrench, lengths)

    return model


def _require_held(arm: LockedArm, home: Posture) -> None:
    """Raise EquilibriumError if a joint has no stiffness without load and pull."""
    state = arm.at_pose(home)
    values, vectors = np.linalg.eigh((state.stiffness + state.stiffness.T) / 2.0)
    if values[0] > _HELD * abs(values).max():
        return
    motion = vectors[:, 0]
    worst = int(abs(motion).argmax())
    name = home.arm.joint_names[worst]
    spring = float(motion @ home.arm.springs.matrix @ motion)
    where = "springs.JOINT = 5 in ARM.toml or by --set, or joint_stiffness of the geometry, or, in "
    where += "Python, by with_springs()"
    if home.arm.springs.matrix[worst, worst]:
        angle = place(home.q[worst], home.arm.joint_units[worst])
        unit = home.arm.stiffness_unit(worst)
        problem = (
            f"at the free angles of the springs, {angle} of {name}, the arm is unstable under its "
            f"weight: it takes {spring - values[0]:.4g} {unit} from the {spring:.4g} {unit} of the "
            "springs, and the arm falls away from there"
        )
        remedy = f"Give start=, angles near where it comes to rest; or stiffer springs: {where}."
    else:
        problem = f"nothing holds {name} where the cables do not pull"
        remedy = "Give all such joints springs at once, which replace those they have: "
        remedy += f"{where}; or start= under load."
    raise EquilibriumError(problem, state.residual, 0.0, name, remedy)

"""Export the arm to MuJoCo (MJCF). Its cables become spatial tendons, pulled by motors or springs.

MuJoCo has springs and servos of constant stiffness, so the model is exact near one posture q. Each
cable has its tangent stiffness k at q, and the rest length L_rest with which its tension at q is F:

    tension at length L: k (L − L_rest),    L_rest = L(q) − F/k

Below L_rest the cable is slack. With constant EA, the model is exact at every posture. Otherwise k
of the real cable changes with its tension.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from lxml import etree
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.interchange.mjcf_bodies import add_bodies, row
from cdsm.interchange.mjcf_motion import Motion, choose_motion
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.report.checks import TOLERANCE, balance_error
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.instability import verdict
from cdsm.support.files import write_text
from cdsm.support.format import coordinates
from cdsm.support.validation import RANGES, instance, one_of, scalar
from cdsm.support.values import Array
from cdsm.support.warning import warn
from cdsm.tension import Tension

Actuators = Literal["length", "tension", "none"]

_CABLE = 5e-4  # radius [m] of a drawn cable
_MOST = RANGES["tension"].high  # tension of a motor [N]; MuJoCo's ranges have two ends

_CONTROLS = {
    "length": "a locked motor per cable; its ctrl is the wire it pays out [m], 0 at the posture",
    "tension": "a motor per cable pulls with ctrl [N] and adds no stiffness; the keyframe has the "
    "tensions of the posture",
    "none": "each cable is a spring with its tension at the posture",
}


@dataclass(frozen=True)
class MuJoCoModel:
    """MJCF text, and the settings that were chosen for it."""

    text: str
    motion: Motion
    actuators: str
    unstable: str | None  # the warning for an unstable arm
    remarks: tuple[str, ...]  # lines shown to the user on what was chosen


def to_mjcf(
    arm: Manipulator,
    pose: Posture | None = None,
    tension: Tension | ArrayLike | None = None,
    *,
    actuators: Actuators | None = None,
    damping_ratio: float | None = None,
    damping: float | None = None,
) -> str:
    """Write the arm as MJCF text, which MuJoCo loads unchanged.

    Bodies, joints, tendons and actuators have the names of links, joints and cables. The sites of a
    cable are ``name/1``, ``name/2``, …; the site at the tip is ``tool0``. Links without a drawable
    visual are sticks. The model has no leads (straight cables of constant length before the first
    site), no friction in the holes, and no wrench. Apply the wrench in MuJoCo at run time;
    ``xfrc_applied`` acts at the centre of mass of a link. Motors that keep lengths have the
    constant stiffness k of the posture, so a large load moves an arm with nonlinear wires by
    another amount than :func:`~cdsm.equilibrium` says.

    A new ``mjData`` and the keyframe ``pose`` have the joint coordinates of the posture, which are
    those of cdsm. ``actuators`` is one of

    - ``length``: one motor per cable keeps its original length, as in :func:`~cdsm.equilibrium`.
      Its force is k (u + L_rest − L), never a push. Its ``ctrl`` u is the length of wire that it
      pays out [m]. The motor of a force-controlled cable keeps F + u, with u in N.
    - ``tension``: one motor per cable pulls with the tension ``ctrl`` [N]: F in the keyframe, zero
      in a new ``mjData``. The cables add no passive stiffness: most arms are then unstable and need
      a controller.
    - ``none``: each cable is a spring of stiffness k and rest length L_rest. Force-controlled
      cables are motors without ``ctrl``; so are springs softer than F/L, whose rest length would
      be negative.

    Time step: 1, 2 or 5 times a power of ten [s], at most 0.2/ω and at most MuJoCo's 2 ms. ω is the
    highest natural frequency [rad/s], K_θ φ = ω² M φ, with the mass matrix M of the exported
    bodies. Moving bodies without mass get 1e-6 kg and 1e-9 kg m², so an arm of massless links needs
    steps of microseconds.

    Damping: each cable has the damping c = β k [N s/m]. A mode φ then has the damping ratio
    ζ = β (J_L φ)ᵀ k (J_L φ)/2ω, about β ω/2. β is chosen so that the least damped mode, usually the
    lowest, has the ``damping_ratio``. This choice ignores modes that get less than half of their ω²
    from the cables; they may be damped less.

    A comment at the top states time step, damping with the range of ζ, and actuators. If K_θ is not
    positive definite, the model leaves the posture by itself: the comment says UNSTABLE, and a
    warning is issued.

    Args:
        arm: The arm.
        pose: Posture of the tensions. If not given, the arm is straight and has no tensions.
        tension: F at this posture: a result of :func:`~cdsm.distribute_tension`, or (C,) [N].
        actuators: ``length``, ``tension`` or ``none``. Default: ``length``; without tensions
            ``none``.
        damping_ratio: ζ of the least damped mode [-]; 0.05 by default. It needs tensions.
        damping: Damping of every joint instead [N m s/rad], [N s/m] for prismatic joints. MuJoCo
            integrates damping implicitly, so strong damping needs no smaller time step.

    Raises:
        InvalidInput: Only one of ``pose`` and ``tension`` is given, the posture is of another arm,
            both dampings are given, or an argument is invalid.
        UnknownName: ``actuators`` is unknown.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
        SingularMass: A motion of the arm moves no link with mass.
    """
    model = mujoco_model(arm, pose, tension, actuators, damping_ratio, damping)
    if model.unstable is not None:
        warn(model.unstable)
    return model.text


def write_mjcf(
    arm: Manipulator,
    path: str | os.PathLike[str],
    pose: Posture | None = None,
    tension: Tension | ArrayLike | None = None,
    *,
    actuators: Actuators | None = None,
    damping_ratio: float | None = None,
    damping: float | None = None,
) -> Path:
    """Write the text of :func:`to_mjcf` to a file, completely or not at all. Return its path.

    An existing file is replaced. All other arguments and errors are those of :func:`to_mjcf`.

    Raises:
        FileError: The file cannot be written.
    """
    options = {"damping_ratio": damping_ratio, "damping": damping}
    return write_text(path, to_mjcf(arm, pose, tension, actuators=actuators, **options))


def mujoco_model(
    arm: Manipulator,
    pose: Posture | None = None,
    tension: Tension | ArrayLike | None = None,
    actuators: str | None = None,
    damping_ratio: float | None = None,
    damping: float | None = None,
) -> MuJoCoModel:
    """Build the MJCF text of :func:`to_mjcf`, with its settings; the arguments are the same."""
    instance("arm", arm, Manipulator)
    if (pose is None) != (tension is None):
        raise InvalidInput("tension", "give pose and tension, or neither.")
    if pose is not None and instance("pose", pose, Posture).arm != arm:
        raise InvalidInput("pose", "is of another arm; take arm.at(q).")
    K = None if pose is None or tension is None else stiffness(pose, tension)
    actuators = actuators or ("none" if K is None else "length")
    one_of("kind of actuators", actuators, _CONTROLS)
    if K is None and (actuators == "length" or damping_ratio is not None):
        name = "actuators" if damping_ratio is None else "damping_ratio"
        raise InvalidInput(name, "follows from the stiffness; give pose and tension too.")
    if damping is not None and damping_ratio is not None:
        raise InvalidInput("damping", "give it or damping_ratio, not both.")
    ratio, damping = _checked("damping_ratio", damping_ratio), _checked("damping", damping)

    root = etree.Element("mujoco", model=arm.name)
    compiler = etree.SubElement(root, "compiler", angle="radian", autolimits="true")
    compiler.set("inertiafromgeom", "false")
    # implicit in velocities only: integrators implicit in positions take energy from springs
    option = etree.SubElement(root, "option", gravity=row(arm.gravity), integrator="implicitfast")
    start = {} if pose is None else dict(zip(arm.joint_names, pose.q.tolist(), strict=True))
    masses = add_bodies(root, arm, start)
    motion = choose_motion(arm, K, masses, ratio, damping)
    option.set("timestep", repr(motion.time_step))
    joints = list(root.iter("joint"))  # in MuJoCo's order, depth first
    if motion.joints:
        for joint in joints:
            joint.set("damping", repr(motion.joints))
    tensions = _cables(root, arm, K, actuators, motion.wires) if arm.cables else []
    if K is not None:
        frame = etree.SubElement(etree.SubElement(root, "keyframe"), "key", name="pose")
        frame.set("qpos", row([start[joint.get("name")] for joint in joints]))
        if tensions:
            frame.set("ctrl", row(tensions))

    loaded = K if K is None or actuators != "tension" else _as_force_controlled(K)
    unstable = None if loaded is None or loaded.is_stable else verdict(loaded)
    remarks = (
        *motion.said,
        f"actuators  {actuators}: {_CONTROLS[actuators]}",
        "friction   of the cables in their holes is left out",
        *(() if K is None else _missing(K)),
    )
    said = [unstable] if unstable is not None else []
    for line in reversed(["Generated by cdsm. Units: m, rad, kg, N.", *said, *remarks]):
        root.insert(0, etree.Comment(f" {line.replace('--', '- -')} "))  # XML's rule
    etree.indent(root, space="  ")
    text: str = etree.tostring(root, encoding="unicode") + "\n"
    return MuJoCoModel(text, motion, actuators, unstable, remarks)


def _checked(name: str, value: float | None) -> float | None:
    """Return the argument ``name``, a damping, as a float; raise InvalidInput if it is negative."""
    if value is None:
        return None
    if (number := scalar(name, value)) < 0.0:
        raise InvalidInput(name, f"{number:g} given; it cannot be negative.")
    return number


def _missing(K: Stiffness) -> Iterator[str]:
    """Yield a remark if K has a wrench, which the model lacks, and one if K is out of balance."""
    if K.wrench.any():
        load = f"{coordinates(K.wrench[:3])} N, {coordinates(K.wrench[3:])} N m"
        yield f"load       {load} is not in the model: apply it to {K.posture.arm.tip_link}"
    left, joint, part = balance_error(K)
    if part > TOLERANCE:
        yield f"balance    {left:.4g} N m are missing, most at {joint}: the arm leaves the posture"


def _as_force_controlled(K: Stiffness) -> Stiffness:
    """Return K with the passive part removed, as if all motors controlled force."""
    arm = K.posture.arm
    free = arm.with_cables([replace(cable, control="force") for cable in arm.cables])
    return stiffness(free.at(K.posture.q, check_limits=False), K.tension, wrench=K.wrench)


# --- cables ---------------------------------------------------------------------------------


def _cables(
    root: etree._Element, arm: Manipulator, K: Stiffness | None, actuators: str, damping: Array
) -> list[float]:
    """Add tendons and their actuators to ``root``; return ``ctrl`` of each actuator at the posture.

    ``actuators`` is the kind of these; see :func:`to_mjcf`. ``damping`` (C,) [N s/m] is the damping
    coefficient of each tendon.
    """
    tendon, motors = etree.SubElement(root, "tendon"), etree.Element("actuator")
    at_start = []
    for c, cable in enumerate(arm.cables):
        spatial = etree.SubElement(tendon, "spatial", name=cable.name, width=repr(_CABLE))
        for i in range(1, len(cable.sites) + 1):
            etree.SubElement(spatial, "site", site=f"{cable.name}/{i}")
        if damping[c]:
            spatial.set("damping", repr(float(damping[c])))
        F, k, length = 0.0, 0.0, 0.0
        if K is not None:
            F, k = float(K.tension[c]), float(K.cable_stiffness[c])
            length = float(K.posture.cable_lengths[c]) - cable.lead
        rest = length - F / k if k > 0.0 else -1.0
        if actuators == "none" and (K is None or rest >= 0.0):
            if K is not None:
                spatial.set("stiffness", repr(k))
                spatial.set("springlength", f"0 {rest!r}")
            continue
        # force along the tendon, which pulls where it is negative: gain ctrl + bias
        gain, bias, control = k, [k * length - F, -k, 0.0], 0.0
        motor = etree.SubElement(motors, "general", name=cable.name, tendon=cable.name)
        if actuators == "tension":
            gain, bias, control = -1.0, [0.0, 0.0, 0.0], F
            motor.set("ctrlrange", f"0 {_MOST!r}")
        elif actuators == "none":
            gain = 0.0
        elif k == 0.0:
            gain = -1.0
            motor.set("ctrlrange", f"{-F!r} {_MOST!r}")
        motor.attrib.update({"biastype": "affine", "gainprm": repr(gain), "biasprm": row(bias)})
        if actuators == "length":
            motor.set("forcerange", f"{-_MOST!r} 0")
        at_start.append(control)
    if len(motors):
        root.append(motors)
    return at_start

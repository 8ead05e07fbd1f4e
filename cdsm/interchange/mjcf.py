"""Export the arm to MuJoCo (MJCF). Its cables become spatial tendons, pulled by motors or springs.

MuJoCo has springs and servos of constant stiffness, so the model is exact near one posture q. A
joint whose spring has a law has its tangent there, and the angle at which this has no torque. Each
cable has its tangent stiffness k at q, and the rest length L_rest with which its tension at q is F:

    tension at length L: k (L − L_rest),    L_rest = L(q) − F/k

Below L_rest the cable is slack. With constant EA, the model is exact at every posture. Otherwise k
of the real cable changes with its tension.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from lxml import etree
from numpy.typing import ArrayLike

from cdsm.definition import refuse_terms
from cdsm.errors import InvalidInput, listed, warn
from cdsm.interchange.mjcf_bodies import LEAST_INERTIA, add_bodies, add_loads, couple
from cdsm.interchange.mjcf_cables import add_path, pulley_remarks, row, side_sites
from cdsm.load_texts import texts
from cdsm.manipulator import Manipulator, require_own
from cdsm.motors import YIELDING_REMEDY, refuse_yielding
from cdsm.posture import Posture
from cdsm.report.checks import balance_error
from cdsm.statics.modes import vibrations
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.verdict import TOLERANCE, describe_buckling
from cdsm.support.files import write_text
from cdsm.support.format import JointUnits, coordinates
from cdsm.support.validation import RANGES, instance, not_negative, one_of
from cdsm.support.values import Array
from cdsm.tension import Tension

Actuators = Literal["length", "tension", "none"]

DAMPING_RATIO = 0.05
"""Default damping ratio of the least damped mode [-]."""

_CABLE = 5e-4  # radius [m] of a drawn cable
_MOST = RANGES["tension"].high  # tension of a motor [N]; MuJoCo's ranges have two ends
_SHARE = 0.5  # least share of ω² from the cables, for modes that count for the damping
_STEPS = [float(f"{digit}e-{n}") for n in range(3, 12) for digit in (2, 1, 0.5)]  # [s]
_PHASE = 0.2  # largest ω·dt [rad]: frequencies are right within 0.2 %; explicit springs bear 2

_CONTROLS = {
    "length": "a locked motor per cable; its ctrl is the wire it pays out [m], 0 at the posture",
    "tension": "a motor per cable pulls with ctrl [N] and adds no stiffness; the keyframe has the "
    "tensions of the posture",
    "none": "each cable is a spring with its tension at the posture",
}


class MuJoCoModel(NamedTuple):
    """MJCF text, and the settings that were chosen for it."""

    text: str
    time_step: float  # [s]
    cable_damping: Array  # (C,) [N s/m]
    joint_damping: float  # of every joint [N m s/rad], [N s/m] where it slides
    actuators: str
    unstable: str | None  # the warning for an unstable arm
    remarks: Sequence[str]  # lines shown to the user on what was chosen


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
    cable are ``name/1``, ``name/2``, …, its pulleys too, which are smooth cylinders there; the site
    at the tip is ``tool0``. A new ``mjData`` and the
    keyframe ``pose`` have the joint coordinates of the posture. The model has no leads (straight
    cables before the first site), no friction in the holes, and no wrench: apply it at run time.
    Loads that belong to the arm are actuators ``load/1``, …, which need no ``ctrl``.
    ``actuators`` is one of

    Of motors that move several cables, the comment at the top says which commands belong together,
    by how much per turn; motors that yield are refused.

    - ``length``: one motor per cable keeps its original length, as in :func:`~cdsm.equilibrium`.
      Its force is `k (u + L_rest − L)`, never a push. Its ``ctrl`` u is the length of wire that it
      pays out [m]. The motor of a force-controlled cable keeps F + u, with u in N.
    - ``tension``: one motor per cable pulls with the tension ``ctrl`` [N]: F in the keyframe, zero
      in a new ``mjData``. Most arms are then unstable and need a controller.
    - ``none``: each cable is a spring of stiffness k and rest length `L_rest`. Force-controlled
      cables, and springs softer than F/L, are motors without ``ctrl``.

    The time step is 1, 2 or 5 times a power of ten [s], at most 0.2/ω and MuJoCo's 2 ms, with the
    highest natural frequency ω [rad/s] of the arm. Bodies without mass get 1e-6 kg and 1e-9 kg m².
    Each cable has the damping `c = β k` [N s/m], with β such that the least damped mode that gets
    half of its `ω²` or more from the cables has the ``damping_ratio``. A comment at the top states
    all this. If `K_θ` is not positive definite, it says UNSTABLE, and a warning is issued.

    Args:
        arm: The arm.
        pose: Posture of the tensions. If not given, the arm is straight and has no tensions.
        tension: F at this posture: a result of :func:`~cdsm.distribute_tension`, or (C,) [N].
        actuators: ``length``, ``tension`` or ``none``. Default: ``length``; without tensions
            ``none``.
        damping_ratio: ζ of the least damped mode [-]; 0.05 by default. It needs tensions.
        damping: Damping of every joint instead [N m s/rad], [N s/m] for prismatic joints.

    Raises:
        InvalidInput: Only one of ``pose`` and ``tension`` is given, the posture is of another arm,
            both dampings are given, or an argument is invalid. ``actuators`` is unknown. A cable
            runs over two pulleys without a site between them, or around one more than once.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> pose = arm.at([0.1] * 10)
        >>> text = cdsm.to_mjcf(arm, pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> text.count("<spatial ")
        15
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
    further = instance("arm", arm, Manipulator).definition.terms
    refuse_terms(further, "a MuJoCo model has no element for its terms")
    why = "yields, and a model in MuJoCo has rigid motors only"
    refuse_yielding(arm.motors, "arm", why, YIELDING_REMEDY)
    if (pose is None) != (tension is None):
        raise InvalidInput("tension", "give pose and tension, or neither.")
    if pose is not None:
        require_own(arm, pose)
    K = None if pose is None or tension is None else stiffness(pose, tension)
    actuators = ("none" if K is None else "length") if actuators is None else actuators
    one_of("kind of actuators", actuators, _CONTROLS)
    if K is None and (actuators == "length" or damping_ratio is not None):
        name = "actuators" if damping_ratio is None else "damping_ratio"
        raise InvalidInput(name, "follows from the stiffness; give pose and tension too.")
    if damping is not None and damping_ratio is not None:
        raise InvalidInput("damping", "give it or damping_ratio, not both.")
    for name, value in (("damping_ratio", damping_ratio), ("damping", damping)):
        if value is not None:
            not_negative(name, value)

    root = etree.Element("mujoco", model=arm.name)
    compiler = etree.SubElement(root, "compiler", angle="radian", autolimits="true")
    compiler.set("inertiafromgeom", "false")
    # implicit in velocities only: integrators implicit in positions take energy from springs
    option = etree.SubElement(root, "option", gravity=row(arm.gravity), integrator="implicitfast")
    coupling = arm.body.coupling
    q = np.zeros(arm.nv) if pose is None else pose.q
    angles = coupling.angles(q) if coupling else q
    start = dict(zip(arm.body.all_joints, angles.tolist(), strict=True))
    sides = side_sites(arm, q)
    add_bodies(root, arm, start, sides, arm.springs.tangential(q))
    of_joints = 0.0 if damping is None else float(damping)
    step, of_cables, remarks = _motion(arm, K, damping_ratio, damping)
    option.set("timestep", repr(step))
    joints = list(root.iter("joint"))  # in MuJoCo's order, depth first
    for joint in joints:
        joint.set("damping", repr(of_joints))
    if coupling:
        couple(root, coupling, arm.body.all_joints, step)
    controls = _cables(root, arm, K, actuators, of_cables)
    controls += [0.0] * add_loads(root, arm)
    if K is not None:
        frame = etree.SubElement(etree.SubElement(root, "keyframe"), "key", name="pose")
        frame.set("qpos", row([start[joint.get("name")] for joint in joints]))
        if controls:
            frame.set("ctrl", row(controls))

    loaded = K if K is None or actuators != "tension" else _as_force_controlled(K)
    unstable = None if loaded is None or loaded.is_stable else describe_buckling(loaded)
    remarks += [f"actuators  {actuators}: {_CONTROLS[actuators]}"]
    remarks += [f"motors     {arm.motors.line}; turn them together"] * bool(arm.motors.given)
    remarks += ["friction   of the cables in their holes is left out"]
    remarks += _spring_remarks(arm)
    remarks += pulley_remarks(arm.at(q, check_limits=False), sides) if sides else []
    remarks += [] if K is None else _missing(K)
    top = ["Generated by cdsm. Units: m, rad, kg, N.", *([unstable] if unstable else []), *remarks]
    for line in reversed(top):
        root.insert(0, etree.Comment(f" {line.replace('--', '- -')} "))  # XML's rule
    etree.indent(root, space="  ")
    text: str = etree.tostring(root, encoding="unicode") + "\n"
    return MuJoCoModel(text, step, of_cables, of_joints, actuators, unstable, remarks)


def _spring_remarks(arm: Manipulator) -> list[str]:
    """Return what the model makes of springs with laws, of which it has the tangents."""
    if not (laws := arm.springs.laws):
        return []
    names = [arm.springs.joints[j] for j in laws]
    verb = "has a law" if len(names) == 1 else "have laws"
    tangent = "in the model, stiffness and springref are those of the tangent at the posture"
    return [f"springs    {listed(names)} {verb}: {tangent}, exact there to first order"]


def _motion(
    arm: Manipulator, K: Stiffness | None, ratio: float | None, damping: float | None
) -> tuple[float, Array, list[str]]:
    """Choose time step [s] and cable damping [N s/m]: joint dampers slow long arms down tenfold."""
    step = _STEPS[0]
    basis = "MuJoCo's own"
    wires = np.zeros(len(arm.cables))
    unit = JointUnits(arm.slides).joined("N m s/rad", "N s/m")
    damped = f"{damping or 0.0:.4g} {unit} at every joint"
    if K is not None:
        M = arm.body.mass_matrix(K.posture.q) + LEAST_INERTIA * np.eye(arm.nv)
        squares, shapes = vibrations(K, M)
        fastest = math.sqrt(abs(squares).max())
        step = next((dt for dt in _STEPS if dt * fastest <= _PHASE), _STEPS[-1])
        basis = f"for frequencies up to {fastest / math.tau:.4g} Hz"
        swings = squares > 0.0
        omega = np.sqrt(squares[swings])
        stretch = K.posture.length_jacobian @ shapes[:, swings]
        ratios = K.cable_stiffness @ stretch**2 / (2.0 * omega)  # for β = 1 s
        resisted = 2.0 * ratios >= _SHARE * omega
        if damping is None and resisted.any():
            beta = (DAMPING_RATIO if ratio is None else ratio) / ratios[resisted].min()
            wires = beta * K.cable_stiffness
            damped = f"ratio {beta * ratios.min():.2g} to {beta * ratios.max():.2g} of the modes, "
            damped += f"by the cables: {wires.min():.4g} to {wires.max():.4g} N s/m"
    return step, wires, [f"time step  {1e3 * step:g} ms, {basis}", f"damping    {damped}"]


def _missing(K: Stiffness) -> Iterator[str]:
    """Yield a remark if K has a wrench, which the model lacks, and one if K is out of balance."""
    for text in texts(K.posture.arm, K.applied):
        own = text.startswith("load of the arm")
        where = "an actuator without ctrl" if own else "not in the model, apply it there"
        yield f"load       {text}: {where}"
    if (W := K.tip_wrench).any():
        load = f"{coordinates(W[:3])} N, {coordinates(W[3:])} N m"
        yield f"load       {load} is not in the model: apply it to {K.posture.arm.tip_link}"
    left, joint, part = balance_error(K)
    if part > TOLERANCE:
        yield f"balance    {left:.4g} N m are missing, most at {joint}: the arm leaves the posture"


def _as_force_controlled(K: Stiffness) -> Stiffness:
    """Return K with the passive part removed, as if all motors controlled force."""
    arm = K.posture.arm
    free = arm.with_forced(np.ones(len(arm.cables), dtype=np.bool_))
    return stiffness(free.at(K.posture.q, check_limits=False), K.tension, wrench=K.applied)


def _cables(
    root: etree._Element, arm: Manipulator, K: Stiffness | None, actuators: str, damping: Array
) -> list[float]:
    """Add tendons and actuators of the kind; return ``ctrl`` of each actuator at the posture."""
    tendon = etree.SubElement(root, "tendon")
    motors = etree.SubElement(root, "actuator")
    at_start = []
    for c, cable in enumerate(arm.cables):
        spatial = etree.SubElement(tendon, "spatial", name=cable.name, width=repr(_CABLE))
        add_path(spatial, cable)
        spatial.set("damping", repr(float(damping[c])))
        F = 0.0
        k = 0.0
        length = 0.0
        if K is not None:
            F = float(K.tension[c])
            k = float(K.cable_stiffness[c])
            length = float(K.posture.cable_lengths[c]) - cable.guided
        rest = length - F / k if k > 0.0 else -1.0
        if actuators == "none" and (K is None or rest >= 0.0):
            spring = {"stiffness": repr(k), "springlength": f"0 {rest!r}"}
            spatial.attrib.update(spring if K is not None else {})
            continue
        # force along the tendon, which pulls where it is negative: gain ctrl + bias
        gain = k
        bias = [k * length - F, -k, 0.0]
        control = 0.0
        motor = etree.SubElement(motors, "general", name=cable.name, tendon=cable.name)
        if actuators == "tension":
            gain = -1.0
            bias = [0.0, 0.0, 0.0]
            control = F
            motor.set("ctrlrange", f"0 {_MOST!r}")
        elif actuators == "none":
            gain = 0.0
        else:
            motor.set("forcerange", f"{-_MOST!r} 0")
            if k == 0.0:
                gain = -1.0
                motor.set("ctrlrange", f"{-F!r} {_MOST!r}")
        motor.attrib.update({"biastype": "affine", "gainprm": repr(gain), "biasprm": row(bias)})
        at_start.append(control)
    return at_start

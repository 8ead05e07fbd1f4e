"""Where an arm comes to rest, from what its motors do: they hold tensions, or take in wire."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, acts, as_loads, scaled
from cdsm.assembly import Assembly, assemble
from cdsm.errors import EquilibriumError, InvalidInput
from cdsm.loads import LoadsLike, loads_of
from cdsm.manipulator import Manipulator
from cdsm.motors import refuse_rough, refuse_shared
from cdsm.posture import Posture
from cdsm.statics.continuation import follow
from cdsm.statics.equilibrium import Equilibrium, as_equilibrium, settled, with_forced
from cdsm.statics.load_cycle import Approach, approach
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.pieces import Model, stage_at
from cdsm.statics.quasi_static import QuasiStaticArm
from cdsm.statics.smooth_events import events_on, watched
from cdsm.stiffness_matrix import checked_tension
from cdsm.support.format import place, plural
from cdsm.support.validation import (
    NO_WRENCH,
    flag,
    instance,
    scalar,
    vector,
)
from cdsm.support.values import Array, frozen

_HELD = 1e-9  # least stiffness of a joint without load, over the largest
_FIRST = 1e-3  # share of the pull at which a path with friction begins: at 0 N no cable slides
_ABOVE = 1.0 + 1e-9  # rounding may put a tension below the low end of its law
_PULL_STEPS = 8  # of three unequal pulls, the tip is off by 0.5 µm of 270 mm
_LOAD_STEPS = 16  # of a load on cables that stick, by 0.03 mm

OfCables = ArrayLike | Mapping[str, float]
"""A number for each cable (C,), or numbers by the names of cables; the other cables are loose."""


def forward_statics(
    arm: Manipulator,
    *,
    tension: OfCables | None = None,
    rest_lengths: OfCables | None = None,
    pull: OfCables | None = None,
    motors: ArrayLike | Mapping[str, float] | None = None,
    assembly: Assembly | None = None,
    wrench: LoadsLike = NO_WRENCH,
    start: ArrayLike | None = None,
    friction: bool = True,
) -> Equilibrium:
    """Compute where an arm comes to rest, from what its motors do.

    Solve `J_Lᵀ F + g + k (q − q_0) = J_Xᵀ W` for q, between the joint limits. Joints that no cable
    holds need springs. Exactly one of ``tension``, ``rest_lengths`` and ``pull`` is given: (C,), or
    a dict by the names of cables, the others being loose; or ``motors``, what motors of several
    cables are told. With given tensions, cables add no
    stiffness of their own (`k_c = 0`); motors that hold lengths are locked, and `k_c` counts.
    :attr:`Equilibrium.motors` says which: the two stiffnesses of one posture can differ by a factor
    of ten.

    With friction in the holes the rest depends on what came before. Then this path is followed: all
    motors pull in proportion from nearly nothing, where the arm rests under its weight; then the
    wrench is hung on (:func:`~cdsm.load_cycle`). ``path`` of the result has both states, and
    ``history`` says it in words; its stiffness is the tangent while cables go on sliding.
    ``events`` says what happens on the pull, and under the load: cables that go slack or pass their
    maximum, stops, a loss of stability. While motors pull, cables slide in most holes, which is no
    event; under the load, the first slip of each hole in which the cable did not slide already is
    one. On the pull they are roots within its eight steps, as in a load cycle.

    Args:
        arm: The arm.
        tension: F (C,) [N] that the motors hold.
        rest_lengths: Unstrained lengths `l_0` (C,) [m] of the wires that the motors have left.
        pull: How much wire each motor reports to have taken in (C,) [m], from the lengths in which
            the cables are just straight at the angles `q_0` of the springs: these lengths become
            shorter by ``gain`` · pull − ``slack`` of each :class:`~cdsm.Cable`. A cable is straight
            at zero strain, where a law that begins above 0 N has its lowest tension.
        motors: What motors are told, by their names in ``arm.motors``, others as at the assembly;
            or (M,): how far they turn [rad] from there; of one that holds its torque the torque
            `Bᵀ F` [N m]; of a cable's own motor wire taken in [m], or its tension [N].
        assembly: Wires with the motors at 0, of :meth:`Manipulator.assemble`; with ``motors``.
            Pulls then grow from its posture. Default: the cables are just straight at the angles
            `q_0` of the springs, as for ``pull``.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; or loads on any
            links, as for :func:`~cdsm.stiffness`.
        start: Angles q (nv,) [rad] at which the search begins, under the whole load. None: load and
            pull grow from nothing, from the angles `q_0`; :attr:`Equilibrium.branch` says if the
            arm jumped on the way. A start has no history: not with friction.
        friction: Whether friction in the holes counts. False: where the arm rests without it.

    Raises:
        InvalidInput: Not exactly one of the four is given, an argument has the wrong shape, or a
            cable does not exist; or motors hold lengths, but a cable has the control ``"force"``;
            or ``start`` is given with friction.
        ElasticityRangeError: Motors hold lengths, and a tension is outside the domain of its law.
        EquilibriumError: No stable equilibrium was found, or nothing holds a joint.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.nitinol_segment()
        >>> rest = cdsm.forward_statics(arm, pull={"cable10_1": 0.005})
        >>> (1e3 * rest.pose.tip[:3, 3]).round(1).tolist()  # mm
        [222.8, 0.0, 97.1]
    """
    instance("arm", arm, Manipulator)
    commands = {"tension": tension, "rest_lengths": rest_lengths, "pull": pull, "motors": motors}
    named = [name for name, value in commands.items() if value is not None]
    if len(named) != 1:
        problem = (
            f"give exactly one of {', '.join(commands)}; {' and '.join(named) or 'none'} given."
        )
        raise InvalidInput("forward_statics", problem)
    rough = flag("friction", friction) and arm.has_friction
    if rough and start is not None:
        raise InvalidInput(
            "start",
            "has no history, on which it depends where an arm with friction rests. Leave it out, "
            "follow the loads by load_cycle, or give friction=False.",
        )
    if rough:
        refuse_rough(arm.motors, arm.has_friction, "friction")
    W = loads_of(arm, wrench)
    home = _home(arm, assembly, named[0])
    begin = home if start is None else arm.at(start)
    driven = dict[str, Any]()
    if motors is None:
        model = _model(arm, named[0], _of_all(arm, named[0], commands[named[0]]), home, begin, W)
    else:
        wires = assembly or _straight(home)
        goal = wires.commanded(motors)
        model = _driven_model(wires, goal, begin, W)
        driven = {"commands": goal, "reference_tension": wires.tension}
    loaded = model(1.0)
    if start is not None:
        return replace(as_equilibrium(loaded, settled(loaded, begin)), **driven)
    if assembly is None:
        _require_held(model(0.0), home)
    if rough:
        before = "pulled from slack" if assembly is None else "driven from even tensions"
        return replace(_with_friction(model, home, W, before), **driven)
    here = settled(model(0.0), home)
    branch = follow(model, stage_at(model, here.state.pose, here.stop_torque, 0.0), 1.0)
    force = sum(float(np.linalg.norm(load.wrench[:3])) for load in as_loads(W).loads)
    events = events_on(model, branch, watched(model(0.0)), force, 1.0)
    last = branch[-1]
    reached = min((event.share for event in events if event.kind == "buckling"), default=1.0)
    here = last.point
    if last.share < 1.0:
        here = settled(loaded, last.pose, reached)
    return replace(as_equilibrium(loaded, here, reached, events), **driven)


def _home(arm: Manipulator, assembly: Assembly | None, command: str) -> Posture:
    """Return the posture from which pulls grow: of the assembly, or at q_0 of the springs."""
    if assembly is None:
        return arm.at(home_angles(arm))
    if command != "motors":
        raise InvalidInput("assembly", f"belongs to motors=, and {command} is given.")
    home: Posture = instance("assembly", assembly, Assembly).posture
    assembly.require_arm(arm.at(home.q))
    return home


def _straight(home: Posture) -> Assembly:
    """Return the assembly whose cables are just straight at a posture."""
    return assemble(home, home.arm.laws.rest)


def _driven_model(assembly: Assembly, goal: Array, begin: Posture, wrench: Applied) -> Model:
    """Return the arm of an assembly whose motors go from its commands to ``goal``."""
    start = assembly.commands
    assembly.require_wire(goal)

    def model(share: float) -> LockedArm:
        wires = assembly.driven(start + share * (goal - start))
        load = scaled(wrench, share)
        return LockedArm(begin, wires.tension, load, wires.rest_length, torque=wires.torque)

    return model


def _with_friction(model: Model, home: Posture, wrench: Applied, before: str) -> Equilibrium:
    """Follow an arm with friction: its motors pull, then the ``wrench`` is hung on."""

    def pulled(share: float) -> LockedArm:
        return model(share).under(none)

    none = frozen(np.zeros(6))
    loaded = model(1.0)
    begin = _first_share(loaded)
    slack = settled(pulled(0.0), home)
    start = stage_at(pulled, slack.state.pose, slack.stop_torque, 0.0)
    branch = follow(pulled, start, begin)
    events = events_on(pulled, branch, watched(start.arm), 0.0, begin)
    stage = branch[-1]
    point = stage.point if stage.share == begin else settled(pulled(begin), stage.pose)
    F = frozen(point.state.tension)
    pose = with_forced(point.state.pose, np.full(F.size, loaded.tension_held))
    taken = loaded.tension
    more = np.zeros(F.size)
    if loaded.rest_length is not None:
        wire = np.asarray(pulled(begin).rest_length)
        taken = wire - loaded.rest_length
        straight = pose.arm.laws.original_lengths(pose.cable_lengths, F)
        more = np.where(F == 0.0, np.maximum(wire - straight, 0.0), 0.0)
    goals = [Approach(none, taken, _PULL_STEPS, "the pull", "pull")]
    goals += [Approach(wrench, taken, _LOAD_STEPS, "the load", "load")] if acts(wrench) else []
    arm = QuasiStaticArm(pose, F)
    path, _ = approach(arm, arm.initial(none, more), goals, begin=begin)
    rest = home.arm.at(path.angles[-1], check_limits=False)
    K = path.stiffness(-1)
    k = frozen(np.where(K.tension > 0.0, K.cable_stiffness, 0.0))
    wires = rest.cable_lengths if loaded.rest_length is None else loaded.rest_length
    slides = np.count_nonzero(path.sliding[-1])
    then = ", then loaded" if acts(wrench) else ""
    history = f"with friction: {before} in {_PULL_STEPS} steps{then}; {slides} of "
    history += f"{plural(len(path.holes), 'hole')} slide; another history ends elsewhere"
    return Equilibrium(
        reference=loaded.reference,
        reference_tension=loaded.tension,
        stiffness=replace(K, posture=rest, cable_stiffness=k, free_length=wires),
        stop_torque=frozen(path.stop_torque[-1].copy()),
        model=loaded,
        motors="tension" if loaded.tension_held else "locked",
        smooth_events=tuple(replace(event, part="pull") for event in events),
        path=path,
        history=history,
    )


def _first_share(loaded: LockedArm) -> float:
    """Return the share of the pull from which the path is followed.

    Motors that hold tensions begin within the laws of their wires, which segments between holes
    need.
    """
    if not loaded.tension_held:
        return _FIRST
    pairs = zip(loaded.reference.arm.cables, loaded.tension, strict=True)
    lows = [cable.elasticity.low / F for cable, F in pairs if F > 0.0 and any(cable.friction)]
    return float(min(1.0, max([_FIRST, *(low * _ABOVE for low in lows)])))


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
        numbers[arm.cables.number_of(cable)] = scalar(f"{name}[{cable!r}]", number)
    return numbers


def _model(
    arm: Manipulator, name: str, value: ArrayLike, home: Posture, begin: Posture, wrench: Applied
) -> Model:
    count = len(arm.cables)
    if name == "tension":
        remedy = "Give --motors, turns in degrees, or, in Python, motors=, turns [rad] or torques."
        refuse_shared(arm.motors, "tension", remedy)
        F, _ = checked_tension(home, value, None)
        return lambda share: LockedArm(begin, share * F, scaled(wrench, share), tension_held=True)
    for cable in arm.cables:
        if cable.control == "force":
            problem = f"{cable.name} has control='force': its motor holds a tension, no length. "
            raise InvalidInput(name, f"{problem}Give tension, or this cable control='position'.")
    for motor in arm.motors.given:
        if motor.control == "torque":
            problem = f"{motor.name} holds a torque, no length: give --motors with its torque, or, "
            problem += "in Python, motors=."
            raise InvalidInput(name, problem)
    if name == "pull":
        remedy = "A drum that takes in one cable moves all: give --motors, how far they turn, in "
        remedy += "degrees, or, in Python, motors=, in radians."
        refuse_shared(arm.motors, "pull", remedy, "lengths")
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
        return LockedArm(begin, least, scaled(wrench, share), lengths)

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
    of_springs = home.arm.springs.stiffness_at(home.q)
    spring = float(motion @ of_springs @ motion)
    where = "springs.JOINT = 5 in ARM.toml or by --set, or joint_stiffness of the geometry, or, in "
    where += "Python, by with_springs()"
    if of_springs[worst, worst]:
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

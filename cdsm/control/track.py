"""Follow a planned path in closed loop: sensors, estimate, motor law and plant at each step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdsm.control.assessment import Assessment, assess
from cdsm.control.estimates import Estimate, Observer
from cdsm.control.laws import LAWS, Command, Law, Moment, Reading, Reference, checked_command
from cdsm.control.plant import Plant, PlantState, SlowPlant, require_unstrained
from cdsm.control.run import Outcome, TrackingRun
from cdsm.control.schedule import Schedule, checked_plan
from cdsm.control.schedule import tension_controlled as choose_cables
from cdsm.control.sensors import Sensors
from cdsm.control.stiffness_loop import StiffnessLoop
from cdsm.errors import CdsmError, ElasticityRangeError, EquilibriumError, InvalidInput, listed
from cdsm.planning.path import checked_change
from cdsm.planning.path_plan import PathPlan
from cdsm.support import progress
from cdsm.support.validation import flag, instance, one_of, quantity, scalar, whole_number
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds

_MOST_STEPS: Final = 1000  # largest number of steps of control between two samples

_LOST: Final = 0.1
"""Tip error, divided by the length of the arm [-], above which the loop counts as unstable."""


def track(
    plan: PathPlan,
    law: str | Law = "stiffness",
    plant: Plant[Any] | None = None,
    sensors: Sensors | None = None,
    *,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    payload: float = 0.0,
    payload_from: float = 0.5,
    steps: int = 5,
    period: float = 0.05,
    rate: ArrayLike = 10.0,
    replan: bool | None = None,
    tension_controlled: Sequence[str] | None = None,
    seed: int = 0,
) -> TrackingRun:
    """Follow a planned path in closed loop, with a plant that may differ from the plan's arm.

    At each step the sensors are read, the posture and the rigidity of the wires are estimated, a
    motor law commands the motors, and the plant follows. ``"feedforward"`` pays out the wire of the
    plan. ``"tension"`` controls all tensions. ``"mixed"`` controls the tensions of some cables, and
    pays out the planned wire of the others. ``"stiffness"`` is the mixed law inside an outer loop,
    which plans the tensions again at the estimated posture. No law commands a tension outside the
    bounds.

    The plan's arm, with its friction, is the model of the controller. The loop starts at rest at
    the first sample with the planned tensions. An unstable loop, an arm that buckles and a target
    that cannot be planned or reached raise no error: ``outcome``, ``reason`` and ``warnings`` of
    the result report them.

    Args:
        plan: A complete plan along one or more directions.
        law: The motor law: a name, or a function from a :class:`Moment` to a :class:`Command`.
        plant: The true arm. Default: :class:`SlowPlant` of the plan's arm.
        sensors: The sensors; default: encoders of 10 µm, exact load cells.
        minimum: Lower bounds of the commanded tensions [N], for all cables or (C,).
        maximum: Upper bounds of the commanded tensions [N], for all cables or (C,).
        payload: Mass [kg] that the controller does not know of; it hangs at the tip.
        payload_from: Part of the path [-], from 0 to 1, after which the payload hangs at the tip.
        steps: Steps of control from one sample of the path to the next.
        period: Time between two steps [s].
        rate: Largest change of a tension per step that the outer loop plans [N], for all cables or
            (C,).
        replan: Whether the outer loop runs; default: for ``"stiffness"`` only.
        tension_controlled: Names of the cables whose tension a mixed law controls. Default: C − nv
            cables, chosen so that the lengths of the others determine the posture best.
        seed: Seed of the noise; the same seed gives the same run, bit for bit.

    Raises:
        InvalidInput: The plan is not complete; or another argument is invalid; or a law returns no
            :class:`Command` within the bounds.
        UnknownName: There is no such law or cable.
    """
    arm = checked_plan(instance("plan", plan, PathPlan))
    require_unstrained("plan", arm)
    low, high = checked_bounds(arm, minimum, maximum)
    name = law if isinstance(law, str) else getattr(law, "__name__", "custom")
    command_of = LAWS[one_of("law", law, LAWS)] if isinstance(law, str) else law
    sensors = Sensors() if sensors is None else instance("sensors", sensors, Sensors)
    plant = SlowPlant(arm) if plant is None else plant
    if not hasattr(plant, "begin"):  # an arm by itself, for example
        raise InvalidInput("plant", f"{plant!r} given; a plant is needed, such as SlowPlant(arm).")
    own, its = ((*each.joint_names, *each.cables.names) for each in (arm, plant.arm))
    if own != its:
        other = sorted({*own} ^ {*its}) or its
        raise InvalidInput(
            "plant", f"its arm and that of the plan differ in joints or cables: {listed(other)}."
        )
    schedule = Schedule.of(plan, whole_number("steps", steps, 1, _MOST_STEPS))
    size = len(schedule.references)
    from_step = math.ceil(_share("payload_from", payload_from) * (size - 1))
    wrenches = schedule.wrenches.copy()
    wrenches[from_step:, :3] += quantity("payload", payload, "mass", zero=True) * arm.gravity
    period = quantity("period", period, "time")
    limit, outer = checked_change("rate", arm, rate), None
    if flag("replan", name == "stiffness" if replan is None else replan):
        outer = StiffnessLoop(arm, schedule.directions, low, high, limit)
    forced = choose_cables(plan, tension_controlled)
    random = np.random.default_rng(whole_number("seed", seed, 0))
    observer = Observer(arm, sensors)

    reference = schedule.references[0]
    state = plant.begin(reference.angles, reference.tension, schedule.wrenches[0])
    truth = [state.true]
    last = sensors.read(truth, random)
    estimate = observer.begin(reference.angles, last)
    before, mean, wire = None, reference.tension, last.wire
    records: list[_Step] = []
    refused: dict[int, str] = {}
    refusal, short = "", False
    outcome: Outcome = "completed"
    reason = ""
    for k in progress.track(range(size), "following the path"):
        reading = sensors.read(truth, random)
        estimate = observer.update(estimate, reading)
        wanted = schedule.references[k]
        if outer is not None:
            planned = outer.next(wanted, schedule.targets[k], estimate, mean)
            wanted, mean = planned.reference, planned.mean
            refusal, short = planned.refused, planned.short
        moment = Moment(wanted, reading, before or wanted, last, wire, low, high, forced)
        command = checked_command(command_of(moment), moment, arm.cables.names)
        try:
            state = plant.move(state, command, wrenches[k])
        except CdsmError as error:
            outcome, reason = _stopped(error), str(error)
            break
        truth.append(state.true)
        judged = assess(state, wrenches[k], schedule.directions)
        records.append(_Step(wanted, short, reading, estimate, command, state, judged))
        if refusal:
            refused[k] = refusal
        before, last, wire = wanted, reading, command.wire
        off = float(np.linalg.norm(state.pose.tip[:3, 3] - schedule.tips[k]))
        if off > _LOST * arm.length:
            outcome, reason = "lost", f"the tip is {1e3 * off:.3g} mm off its path"
            break
    return TrackingRun(
        plan=plan,
        law=name,
        plant=plant,
        period=period,
        refused=refused,
        outcome=outcome,
        reason=reason,
        states=tuple(record.state for record in records),
        **_columns(schedule, wrenches, records),
    )


def _stopped(error: CdsmError) -> Outcome:
    if isinstance(error, EquilibriumError):
        return "no rest"
    return "wire" if isinstance(error, ElasticityRangeError) else "lost"


def _share(name: str, value: float) -> float:
    number = scalar(name, value)
    if not 0.0 <= number <= 1.0:
        raise InvalidInput(name, f"{number:g} given; a part of the path, from 0 to 1, is needed.")
    return number


class _Step(NamedTuple):
    wanted: Reference
    short: bool
    reading: Reading
    estimate: Estimate
    command: Command
    state: PlantState
    judged: Assessment


def _columns(schedule: Schedule, wrenches: Array, records: list[_Step]) -> dict[str, Any]:
    n, u = len(records), schedule.directions

    def rows(values: list[Any], *tail: int) -> Array:
        return frozen(np.array(values, dtype=np.float64).reshape(n, *tail))

    joints, cables = schedule.references[0].angles.size, schedule.references[0].wire.size
    tips = rows([record.state.pose.tip[:3, 3] for record in records], 3)
    rests = rows([record.judged.tip for record in records], 3)
    return {
        "goals": frozen(schedule.tips[:n].copy()),
        "target": frozen(schedule.targets[:n].copy()),
        "wrench": frozen(wrenches[:n].copy()),
        "tips": tips,
        "angles": rows([record.state.pose.q for record in records], joints),
        "estimated_angles": rows([record.estimate.pose.q for record in records], joints),
        "wanted_tension": rows([record.wanted.tension for record in records], cables),
        "commanded_tension": rows([record.command.tension for record in records], cables),
        "commanded_wire": rows([record.command.wire for record in records], cables),
        "measured_tension": rows([record.reading.tension for record in records], cables),
        "tension": rows([record.state.true.tension for record in records], cables),
        "saturated": frozen(
            np.array([record.command.saturated for record in records]).reshape(n, cables)
        ),
        "stiffness": rows([record.judged.stiffness for record in records], len(u)),
        "margin": rows([record.judged.margin for record in records]),
        "short": frozen(np.array([record.short for record in records], dtype=np.bool_)),
        "band": rows([record.judged.band for record in records]),
        "displacement": frozen((tips - rests) @ u[0]),
        "estimated_force": rows([record.estimate.force for record in records], 3),
        "rigidity": rows([1.0 / record.estimate.softness for record in records]),
    }

"""Follow a planned path in closed loop: sensors, estimate, motor law and plant at each step."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import fields
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import qr

from cdsm.applied import refuse_links, required_torque
from cdsm.control.laws import (
    LAWS,
    ControlInput,
    Law,
    Reference,
    Replanned,
    StiffnessLoop,
    checked_command,
    reference_at,
)
from cdsm.control.plants import (
    Plant,
    PlantState,
    QuasiStaticPlant,
    frictionless_stiffness,
)
from cdsm.control.run import TrackingRun
from cdsm.control.sensing import Observer, Sensors
from cdsm.errors import CdsmError, InvalidInput, listed
from cdsm.friction.stick import half_width
from cdsm.manipulator import Manipulator
from cdsm.motors import YIELDING_REMEDY, refuse_shared, refuse_yielding
from cdsm.planning.path import checked_change
from cdsm.planning.path_plan import PathPlan
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.progress import show_progress
from cdsm.support.validation import checked_quantity, instance, one_of, whole_number
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds
from cdsm.tension.least_tensions import nearest_balanced
from cdsm.tension.solvers import nondimensional

_MOST_STEPS: Final = 1000  # largest number of steps of control between two samples

_DIVERGED: Final = 0.1  # tip error over the length of the arm of a loop that is unstable


def track(
    plan: PathPlan,
    law: str | Law = "stiffness",
    plant: Plant[Any] | None = None,
    sensors: Sensors | None = None,
    *,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    payload: float = 0.0,
    steps: int = 5,
    period: float = 0.05,
    max_change_per_step: ArrayLike = 10.0,
) -> TrackingRun:
    """Follow a planned path in closed loop, with a plant that may differ from the plan's arm.

    At each step the sensors are read, the posture and the rigidity of the wires are estimated, a
    motor law commands the motors, and the plant follows. ``"feedforward"`` pays out the wire of the
    plan. ``"tension"`` controls all tensions. ``"mixed"`` controls the tensions of C − nv cables,
    and pays out the planned wire of the others, whose lengths determine the posture best.
    ``"stiffness"`` is the mixed law inside an outer loop, which plans the tensions again at the
    estimated posture. No law commands a tension outside the bounds, as predicted for the posture
    after the step.

    The plan's arm, with its friction, is the model of the controller. The loop starts at rest at
    the first sample with the planned tensions. Between two samples the joint angles change evenly,
    and the tensions balance the arm; where none within the domains of the laws do, ``warnings`` of
    the result says so. If plant and plan are the same arm and the sensors are exact, every law
    holds the plan at the samples; ``"stiffness"``, which takes all loads for forces at
    the tip, only if the plan has no moment. An unstable loop, an arm that buckles and a target that
    cannot be planned or reached raise no error: ``outcome``, ``reason`` and ``warnings`` of the
    result report them.

    Args:
        plan: A complete plan along one or more directions.
        law: The motor law: a name, or a function from a :class:`ControlInput` to a
            :class:`Command`.
        plant: The true arm. Default: :class:`QuasiStaticPlant` of the plan's arm.
        sensors: The sensors; default: encoders of 10 µm, exact load cells.
        minimum: Lower bounds of the commanded tensions [N], for all cables or (C,).
        maximum: Upper bounds of the commanded tensions [N], for all cables or (C,).
        payload: Mass [kg] that the controller does not know of; it hangs at the tip on the second
            half of the path.
        steps: Steps of control from one sample of the path to the next.
        period: Time between two steps [s]; that of a plant which has one.
        max_change_per_step: Largest change of a tension per step that the outer loop plans [N], for
            all cables or (C,). ``steps_needed`` of the result says how many steps that takes.

    Raises:
        InvalidInput: The plan is not complete; or another argument is invalid; or a law returns no
            :class:`Command` within the bounds. There is no such law.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> plan = cdsm.plan_path(arm, "z", 2500.0, 5.0, 200.0, angles=[[0.08] * 10, [0.1] * 10])
        >>> run = cdsm.track(plan, law="stiffness", minimum=5.0, maximum=200.0, steps=2)
        >>> run.outcome.word, f"the tip is at most {1e6 * run.tip_error.max():.0f} µm off"
        ('ok', 'the tip is at most 5 µm off')
    """
    arm = instance("plan", plan, PathPlan).arm
    refuse_shared(arm.motors, "plan")
    for K in plan.stiffness:
        why = "controllers know loads at the tip only. A load that stays belongs to the arm: "
        refuse_links(K.applied, "plan", f"{why}arm.with_loads(...), [[loads]] in ARM.toml.")
    if not plan.complete:
        first = plan.infeasible[0]
        lacking = f"{len(plan.infeasible)} of {len(plan.target)}"
        problem = f"{lacking} samples are not planned, the first of them sample {first.index}"
        raise InvalidInput("plan", f"{problem}: {first.reason}")
    low, high = checked_bounds(arm, minimum, maximum)
    name = law if isinstance(law, str) else getattr(law, "__name__", "custom")
    command_of = law if callable(law) else LAWS[one_of("law", law, LAWS)]
    sensors = Sensors() if sensors is None else instance("sensors", sensors, Sensors)
    plant = QuasiStaticPlant(arm) if plant is None else plant
    if isinstance(plant, type) or not hasattr(plant, "step_to"):  # an arm by itself, for example
        problem = f"{plant!r} given; a plant is needed, such as QuasiStaticPlant(arm)."
        raise InvalidInput("plant", problem)
    refuse_shared(plant.arm.motors, "plant")
    why = "yields, and controllers know rigid motors only"
    refuse_yielding(plant.arm.motors, "plant", why, YIELDING_REMEDY)
    planned_names = (*arm.joint_names, *arm.cables.names)
    plant_names = (*plant.arm.joint_names, *plant.arm.cables.names)
    if planned_names != plant_names:
        other = listed(sorted({*planned_names} ^ {*plant_names}) or plant_names)
        raise InvalidInput(
            "plant", f"its arm and that of the plan differ in joints or cables: {other}."
        )
    plant_period = getattr(plant, "period", period)
    if plant_period != period:
        step = f"a step of the plant takes {plant_period!r} s"
        raise InvalidInput("period", f"{period!r} s given, but {step}; give it here too.")
    count = whole_number("steps", steps, 1, _MOST_STEPS)
    change = checked_change("max_change_per_step", arm, max_change_per_step)
    outer = StiffnessLoop(plan, low, high, change) if name == "stiffness" else None
    hung = checked_quantity("payload", payload, "mass", zero=True) * arm.gravity
    schedule = _schedule(plan, count, hung)
    rows: list[dict[str, Any]] = []
    outcome, reason = _follow(plan, command_of, plant, sensors, schedule, outer, (low, high), rows)
    return TrackingRun(
        plan=plan,
        law=name,
        plant=plant,
        period=checked_quantity("period", period, "time"),
        steps=count,
        max_change_per_step=change,
        replan_failed=outer.failed if outer else {},
        outcome=outcome,
        reason=reason,
        states=tuple(row["states"] for row in rows),
        **_columns(rows, arm, len(schedule[0].target)),
    )


def _follow(
    plan: PathPlan,
    law: Law,
    plant: Plant[Any],
    sensors: Sensors,
    schedule: list[_Wanted],
    outer: StiffnessLoop | None,
    bounds: tuple[Array, Array],
    rows: list[dict[str, Any]],
) -> tuple[Status, str]:
    """Control step by step, with a row per step added to ``rows``; return how it ends, and why."""
    last = schedule[0].reference
    load = plan.stiffness[0].wrench
    state = plant.initial(last.angles, last.tension, load)
    random = np.random.default_rng(sensors.seed)
    true_values = [state.true_values]
    measured = sensors.measure(true_values, random)
    observer = Observer(plan.arm, sensors)
    estimate = observer.initial(last.angles, measured)
    paid_out = measured.paid_out
    error = 0.0 * last.tension
    forced = _tension_controlled(plan.stiffness[0].posture)
    for wanted in show_progress(schedule, "following the path"):
        measured = sensors.measure(true_values, random)
        estimate = observer.update(estimate, measured)
        reference = wanted.reference
        before = last
        replanned = Replanned(reference, last, np.zeros(error.size, dtype=np.bool_))
        if outer is not None:
            replanned = outer.next(reference, wanted.target, estimate, last)
        reference = replanned.reference
        before = replanned.reference_before
        control_input = ControlInput(reference, before, measured, error, paid_out, *bounds, forced)
        command = checked_command(law(control_input), control_input, plan.arm.cables.names)
        try:
            state = plant.step_to(state, command, wanted.wrench)
        except CdsmError as fault:
            return fault.status, str(fault)
        true_values.append(state.true_values)
        last = reference
        paid_out = command.paid_out
        error = control_input.error
        tip = state.pose.tip[:3, 3]
        rows.append(
            {
                "reference_tips": wanted.tip,
                "target": wanted.target,
                "reference_balanced": wanted.balanced,
                "wrench": wanted.wrench,
                "states": state,
                "angles": state.pose.q,
                "tips": tip,
                "tension": state.true_values.tension,
                "estimated_angles": estimate.pose.q,
                "estimated_force": estimate.tip_force.force,
                "estimated_force_band": estimate.tip_force.band,
                "rigidity": 1.0 / estimate.softness,
                "reference_tension": reference.tension,
                "measured_tension": measured.tension,
                "commanded_tension": command.tension,
                "paid_out": command.paid_out,
                "saturated": command.saturated | replanned.saturated,
                "target_unreachable": replanned.target_unreachable,
                "change_limited": replanned.change_limited,
                **_assessed(state, wanted.wrench, plan.direction.reshape(-1, 3)),
            }
        )
        off = float(np.linalg.norm(tip - wanted.tip))
        if off > _DIVERGED * plan.arm.length:
            return Status.DIVERGED, f"the tip is {1e3 * off:.3g} mm off its path"
    return Status.OK, ""


class _Wanted(NamedTuple):
    """What the plan wants at one step of control."""

    reference: Reference
    target: Array  # stiffness (D,) [N/m]
    tip: Array  # position (3,) [m]
    wrench: Array  # true load (6,): force [N], then moment [N m]
    balanced: bool  # whether the tensions of the reference balance the arm


def _schedule(plan: PathPlan, steps: int, hung: Array) -> list[_Wanted]:
    """Divide a plan into ``steps`` equal steps from each sample to the next, each in balance.

    The weight ``hung`` (3,) [N] acts on the second half.
    """
    arm = plan.arm
    size = len(plan.planned)
    at = np.linspace(0.0, size - 1.0, (size - 1) * steps + 1)

    def along(values: Any) -> Array:
        rows = np.reshape(values, (size, -1)).T
        return np.stack([np.interp(at, np.arange(size), row) for row in rows], axis=1)

    wanted: list[_Wanted] = []
    loads = [K.wrench for K in plan.stiffness]
    parts = plan.angles, plan.tensions, plan.target, loads
    for q, F, target, W in zip(*map(along, parts), strict=True):
        pose = arm.at(q)
        tension, balanced = _balanced_near(pose, F, W)
        reference = reference_at(arm, q, tension)
        late = 2 * len(wanted) >= len(at) - 1
        true_load = W + late * np.append(hung, np.zeros(3))
        wanted.append(_Wanted(reference, target, pose.tip[:3, 3], true_load, balanced))
    return wanted


def _balanced_near(pose: Posture, F: Array, wrench: Array) -> tuple[Array, bool]:
    """Return tensions (C,) [N] near F within the domains of the laws; do they balance the arm?

    They are the nearest in balance, or, if none within the domains are, the nearest within these.
    """
    torque = required_torque(pose, wrench)
    J = pose.length_jacobian
    near = F + np.linalg.lstsq(J.T, torque - F @ J)[0]
    low = pose.arm.laws.low
    high = pose.arm.laws.high
    inside = np.clip(near, low, high)
    if (inside == near).all():
        return inside, True
    problem = nondimensional(J, torque, low, high, pose.arm.length)
    solution = nearest_balanced(problem, near, low, high)
    return (solution.x, True) if solution.ok else (inside, False)


def _tension_controlled(pose: Posture) -> NDArray[np.bool_]:
    """Return the C − nv cables (C,) of which the lengths of the others determine the posture."""
    *_, order = qr(pose.length_jacobian.T, mode="economic", pivoting=True)
    forced = np.ones(len(pose.arm.cables), dtype=np.bool_)
    forced[order[: pose.arm.nv]] = False
    return forced


def _assessed(state: PlantState, wrench: Array, directions: Array) -> dict[str, Any]:
    """Return true stiffness, margin and band, and how far the tip is off its centre; or NaN."""
    assessment: dict[str, Any] = dict.fromkeys(("margin", "band", "displacement"), math.nan)
    assessment["stiffness"] = np.full(len(directions), math.nan)
    with suppress(CdsmError):
        K = frictionless_stiffness(state, wrench)
        assessment["margin"] = K.margin
        off = state.pose.tip[:3, 3] - K.posture.tip[:3, 3]
        assessment["displacement"] = off @ directions[0]
        assessment["stiffness"] = np.array([K.along(u) for u in directions])
        if K.posture.arm.has_friction and K.is_stable:
            assessment["band"] = half_width(K, directions[0])
    return assessment


def _columns(rows: list[dict[str, Any]], arm: Manipulator, directions: int) -> dict[str, Any]:
    """Stack the rows of a run, with the dimensions that the fields of TrackingRun tell."""
    sizes = {"cable": len(arm.cables), "joint": arm.nv, "axis": 3, "component": 6}
    sizes |= {"time": len(rows), "direction": directions}
    columns: dict[str, Any] = {}
    for column in fields(TrackingRun):
        dims = column.metadata.get("dims", ())
        if dims[:1] == ("time",):
            values = np.array([row[column.name] for row in rows])
            kind = np.bool_ if "bool" in str(column.type) else np.float64
            columns[column.name] = frozen(values.astype(kind).reshape([sizes[dim] for dim in dims]))
    return columns

"""``cdsm stiffness | weigh | buckle``: an arm at one posture under a load."""

from __future__ import annotations

import contextlib
import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cdsm
from cdsm.cli import options
from cdsm.cli.options import file_opt, opt
from cdsm.cli.output import Json, answer, header, misuse, write, write_picture

if TYPE_CHECKING:
    from cdsm.loads import LoadsLike
    from cdsm.measures.holding import Holding
    from cdsm.measures.payload import Payload
    from cdsm.statics.buckling import CriticalLoad, CriticalTension
    from cdsm.statics.equilibrium import Equilibrium
    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.statics.weight_test import WeightTest
    from cdsm.support.values import Array
    from cdsm.tolerancing.budget import Uncertainty


def show_stiffness(
    arm: options.ArmArgument,
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    minimum: options.MinimumOption = 0.0,
    maximum: options.MaximumOption = math.inf,
    tension: options.TensionOption = None,
    pull: options.PullOption = None,
    motors: options.MotorsOption = None,
    load: options.LoadOption = None,
    mass: options.MassOption = None,
    direction: Annotated[str | None, opt("One more direction for it.", "AXIS|X,Y,Z")] = None,
    check: Annotated[
        bool, opt("Print a report: right, in balance, stable?", None, "--check")
    ] = False,
    out: Annotated[
        Path | None, file_opt("Report to write, as a page or as text.", "FILE.html|txt", "--out")
    ] = None,
    as_json: options.JsonOption = False,
) -> int:
    """Compute the least tensions at a posture, and the stiffness.

    With --tension, --pull or --motors, the posture and the tensions follow from what motors do.
    With [tolerances] in ARM.toml it also says how sure the numbers are; with friction, which
    stiffness small loads measure.

    Exit code 0; 3 if the arm is unstable, or the report of --check fails.
    """
    from cdsm.cable import largest_share
    from cdsm.support.format import stiffness_text

    robot = options.load_arm(arm, changes)
    wrench = options.loads_on(robot, load, mass)
    K, rest = _balanced(robot, wrench, angles, minimum, maximum, tension, pull, motors)
    friction = "followed along the path" if rest and rest.path else "ignored"
    head, numbers = header(K.posture, [] if rest else [minimum], friction, K.distribution)
    axes = {axis: options.parse_direction(axis) for axis in ("x", "y", "z")}
    lines = list[str]()
    if direction is not None:
        axes[direction] = u = options.parse_direction(direction)
        k = (rest or K).along(u)
        numbers |= {"direction": u, "along_direction_N_per_m": k}
        lines.append(f"along {direction}: {stiffness_text(k)}")
    share = largest_share(K.posture.arm.cables, K.tension)
    numbers |= {"largest_share_of_breaking_force": share} if share else {}
    lines += [share] if share and K.distribution is None else []  # a Tension prints it itself
    sure, uncertainty = _uncertainty(K.distribution, axes)
    if check or out is not None:
        from cdsm.arm_file.source import ArmSource

        report = (rest or K).report()
        changed = " ".join(f"--set {shlex.quote(change)}" for change in changes or ())
        about = f"{arm} {changed}".rstrip() + f"\n{head}\ncdsm {cdsm.__version__}"
        source = ArmSource(str(arm), options.changes_of(changes)).python
        write(out, lambda file: report.write(file, about, direction and axes[direction], source))
        failed = () if report.passed else (f"{report.outcome}: the report says why.",)
        output = numbers | report.to_dict() | uncertainty
        return answer(as_json, output, head, report, *lines, *sure, warnings=failed)
    if rest and rest.at_limit:  # K knows no stops
        output = numbers | rest.to_dict()
        with contextlib.suppress(cdsm.SingularStiffness):
            output["along_N_per_m"] = [rest.along(u) for u in "xyz"]
        return answer(
            as_json,
            output,
            head,
            rest,
            *lines,
            warnings=rest.warnings,
            unmet=not rest.verdict.is_held,
        )
    stuck, sticking = _sticking(K.distribution, axes)
    parts = [head, rest or K.distribution, K, *lines, *stuck, *sure]
    output = numbers | K.to_dict() | (rest.to_dict() if rest else {}) | sticking | uncertainty
    verdict = (rest or K).verdict
    warnings = dict.fromkeys((*verdict.warnings, *K.warnings))
    return answer(as_json, output, *parts, warnings=warnings, unmet=not verdict.is_held)


def _balanced(
    arm: cdsm.Manipulator,
    wrench: LoadsLike,
    angles: str | None,
    minimum: float,
    maximum: float,
    tension: str | None,
    pull: str | None,
    motors: str | None,
) -> tuple[cdsm.Stiffness, Equilibrium | None]:
    """Return K at --angles, or K and the equilibrium where what the motors do lets the arm rest."""
    posture = angles, minimum, maximum
    if motors is not None:
        if (tension, pull) != (None, None):
            raise misuse("--motors, --tension, --pull", "each says what the motors do: give one.")
        assembly = None
        if posture != (None, 0.0, math.inf):
            pose = arm.at(options.joint_coordinates(angles, arm))
            assembly = arm.assemble(pose, cdsm.distribute_tension(pose, minimum, maximum))
        rest = cdsm.forward_statics(
            arm, motors=options.by_motor(motors, arm), assembly=assembly, wrench=wrench
        )
        return rest.stiffness, rest
    if tension is None and pull is None:
        pose = arm.at(options.joint_coordinates(angles, arm))
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum, maximum, wrench)), None
    if None not in (tension, pull) or posture != (None, 0.0, math.inf):
        remedy = "say what the motors do, and the posture follows: give one of them, without "
        raise misuse("--tension, --pull", f"{remedy}--angles, --minimum and --maximum.")
    option, text = ("--tension", tension) if pull is None else ("--pull", pull)
    values = options.by_cable(option, text or "", arm, 1.0 if pull is None else 1e-3)
    if pull is None:
        rest = cdsm.forward_statics(arm, tension=values, wrench=wrench)
    else:
        rest = cdsm.forward_statics(arm, pull=values, wrench=wrench)
    return rest.stiffness, rest


def _sticking(
    tension: cdsm.Tension | None, axes: dict[str, Sequence[float]]
) -> tuple[list[str], Json]:
    """Return the stuck stiffness and the load of the first slip, as text and for JSON, if any."""
    from cdsm.motors import refuse_rough
    from cdsm.support.format import stiffness_text

    lines = list[str]()
    numbers = Json()
    if tension is None or not tension.posture.arm.has_friction:
        return [], {}
    try:
        refuse_rough(tension.posture.arm.motors, True, "friction")
    except cdsm.InvalidInput as error:  # else the reader would think that nothing sticks
        return [f"what small loads measure is not told: {error}"], {"sticking": str(error)}
    for name, u in axes.items():
        with contextlib.suppress(cdsm.CdsmError):
            first = cdsm.breakaway(tension.posture, tension, u)
            if 0.0 < first.load < math.inf:
                k = first.stiffness.along(u)
                lines.append(f"along {name} {stiffness_text(k)} below {first.load:.4g} N")
                numbers[name] = {"stuck_N_per_m": k, "breakaway_N": first.load}
    if not lines:
        return [], {}
    head = "small loads measure (all cables stick in their holes, rigid links, tangent):"
    return ["\n".join([head, *lines])], {"sticking": numbers}


def _uncertainty(
    tension: cdsm.Tension | None, axes: dict[str, Sequence[float]]
) -> tuple[list[str], Json]:
    """Return the uncertainty along each axis in which the tip can move, as a table and for JSON."""
    from cdsm.support.format import aligned, stiffness_unit, with_uncertainty
    from cdsm.tolerancing.budget import known_tolerances

    budgets: dict[str, Uncertainty] = {}
    tolerances = None if tension is None else known_tolerances(tension.posture.arm)
    if tension is None or tolerances is None or not tolerances.given:
        return [], {}
    pose = tension.posture
    for name, u in axes.items():
        with contextlib.suppress(cdsm.SingularStiffness):
            budgets[name] = cdsm.uncertainty(pose, tension, tolerances, direction=u)
    if not budgets:
        return [], {}

    def percent(source: str) -> list[float]:
        return [
            100.0 * budget.contributions[source] / abs(budget.value) for budget in budgets.values()
        ]

    sources = {source for budget in budgets.values() for source in budget.contributions}
    unit, size = stiffness_unit(*(budget.value for budget in budgets.values()))
    shown = [with_uncertainty(x.value, x.standard_uncertainty, size) for x in budgets.values()]
    rows = [
        (f"uncertainty [{unit}]", *budgets),
        ("along", *shown),
        *(
            (f"  {source.replace('_', ' ')}", *(f"{part:.2g} %" for part in percent(source)))
            for source in sorted(sources, key=lambda source: -max(percent(source)))
        ),
    ]
    remarks = [
        f"along {name}: {warning}"
        for name, budget in budgets.items()
        for warning in budget.warnings
    ]
    numbers: Json = {name: budget.to_dict() for name, budget in budgets.items()}
    return ["\n".join([*aligned(rows), *remarks])], {"uncertainty": numbers}


def weigh(
    arm: options.ArmArgument,
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    minimum: options.MinimumOption = 0.0,
    maximum: options.MaximumOption = math.inf,
    tension: options.TensionOption = None,
    pull: options.PullOption = None,
    motors: options.MotorsOption = None,
    load: options.LoadOption = None,
    mass: options.MassOption = None,
    steps: Annotated[int | None, opt("Steps to the full load.", "N", min=1, max=1000)] = None,
    cycles: Annotated[int | None, opt("Load and unload N times.", "N", min=1, max=100)] = None,
    out: Annotated[
        Path | None, file_opt("Table of --cycles; .nc: all states.", "FILE.nc|csv", "--out")
    ] = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Hang a weight at the tip, or on a link: how far it moves, and how much more the arm holds.

    The motors are locked (Eq. 20), or go on as --tension, --pull or --motors say; --load and --mass
    are the weight, in 5 steps (12 in each quarter of --cycles); it is read where it hangs. With
    friction in the holes, small and large weights measure different stiffness, and --cycles, to the
    load and its opposite, show the hysteresis.

    Exit code 0; 3 if the arm does not stay at its posture without the weight, buckles under it, or
    snaps through.
    """
    if out is not None and cycles is None:
        raise misuse("--out", "is the table of --cycles; give both.")
    from cdsm.loads import link_point
    from cdsm.measures.holding import holding_locked
    from cdsm.support.format import coordinates, without_rounding

    robot = options.load_arm(arm, changes)
    weights = _weights(robot, load, mass)
    K, rest = _balanced(robot, [0.0] * 6, angles, minimum, maximum, tension, pull, motors)
    pose = K.posture
    start = rest or K.tension
    head, numbers = header(pose, [] if rest else [minimum], "included")
    held: Holding | None = None
    holds_tensions = rest is not None and rest.motors == "tension"
    hold = "hold the tensions" if holds_tensions else "locked: they hold the wire"
    head = f"motors {hold}\n{head}"
    numbers["motors"] = "tension" if holds_tensions else "locked"
    result: WeightTest | LoadHistory
    if cycles is not None:
        result, more, note = _cycles(pose, start, weights, cycles, steps or 12)
        write(out, result.write_loop if out and out.suffix.lower() == ".csv" else result.write)
    else:
        more = {}
        link, force = _one_force(weights)
        try:
            result = cdsm.weight_test(pose, start, force, steps=steps or 5, link=link)
        except cdsm.EquilibriumError as error:
            following = None
            if link == robot.tip_link and K.distribution is not None:
                following = cdsm.payload(pose, force, minimum, maximum).following
            if following is None:
                raise
            remedy = f"Reduce the load, or let the {following}."
            raise cdsm.EquilibriumError(
                error.problem, error.residual, error.load_factor, error.joint, remedy
            ) from None
        if (bounds := K.distribution) is not None:
            u = force / math.hypot(*force)
            case = pose, u, K.applied, K.tension, bounds.maximum_held
            held = holding_locked(*case, link_point(robot, link))
            more = {"holds": held}
        without = " without friction" if pose.arm.has_friction else ""
        note = f"at the full load{without}:\n{result.states[-1]}\n\n{held or ''}".rstrip()
        if pose.arm.has_friction:
            moved = coordinates(without_rounding(1e3 * result.displacement))
            note += f"\nwith friction, at the full load: tip moved by {moved} mm"
    write_picture(figure, result.plot)
    verdict = (rest or K).verdict
    warnings = (*verdict.warnings, *result.warnings)
    unmet = bool(result.warnings) or not verdict.is_held
    output = numbers | ({"rest": rest} if rest else {}) | result.to_dict() | more
    parts = [head, *([rest, K] if rest else []), result, note]
    return answer(as_json, output, *parts, warnings=dict.fromkeys(warnings), unmet=unmet)


def _weights(
    arm: cdsm.Manipulator, load: list[str] | None, mass: list[str] | None
) -> dict[str, Array]:
    """Return the wrenches (6,) by link of a load that must not be zero."""
    if load is None and mass is None:
        raise misuse("--load", "give it or --mass: the load.")
    wrenches = options.loads_on(arm, load, mass)
    weights = {link: W for link, W in wrenches.items() if W.any()}
    if not weights:
        name = "--load" if mass is None else "--mass"
        raise cdsm.InvalidInput(name, "is zero; nothing moves, and there is nothing to measure.")
    return weights


def _one_force(weights: dict[str, Array]) -> tuple[str, Array]:
    """Return the link and the force (3,) of one weight."""
    if len(weights) > 1:
        links = " and ".join(weights)
        raise misuse("--load, --mass", f"act on {links}; one weight hangs on one link. {_CYCLES}")
    ((link, wrench),) = weights.items()
    if wrench[3:].any():
        raise misuse("--load", f"has a moment, but a weight is a force: FX,FY,FZ. {_CYCLES}")
    return link, wrench[:3]


_CYCLES = "--cycles takes moments and several links."


def _cycles(
    pose: cdsm.Posture,
    start: Array | Equilibrium,
    weights: dict[str, Array],
    cycles: int,
    steps: int,
) -> tuple[LoadHistory, Json, str]:
    """Load and unload the arm; return the history, and what the last cycle loses."""
    import numpy as np

    from cdsm.support.format import without_rounding

    up = np.arange(1, steps + 1) / steps
    hump = np.concatenate([up, up[-2::-1] if steps > 1 else [], [0.0]])
    factors = np.concatenate([hump, -hump])
    tip = pose.arm.tip_link
    rows = np.tile(factors, cycles)
    wrenches = {link: np.outer(rows, W) + 0.0 for link, W in weights.items()}  # no -0
    history = cdsm.load_cycle(pose, start, wrenches[tip] if [*wrenches] == [tip] else wrenches)
    lost = float(history.dissipated[-len(factors) :].sum())
    far = np.linalg.norm(history.displacement, axis=1)
    left = 1e6 * without_rounding(far)[-1]
    note = f"the last cycle loses {1e3 * lost:.4g} mJ; residual displacement {left:.4g} µm"
    if not pose.arm.has_friction:
        note = "the holes have no friction, so there is no loop: --set friction=0.1, for example"
    return history, {"lost_in_last_cycle_J": lost, "left_over_m": float(far[-1])}, note


def buckle(
    arm: options.ArmArgument,
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    minimum: options.MinimumOption = 0.0,
    maximum: options.MaximumOption = math.inf,
    load: options.LoadOption = None,
    mass: options.MassOption = None,
    figure: options.FigureOption = None,
    as_json: options.JsonOption = False,
) -> int:
    """Find the tension and the load at which the arm buckles.

    The motors follow: they keep the posture with the least tensions. Of a load by --load and
    --mass it is the largest multiple, within --minimum and --maximum; beside it stands what the
    arm holds with locked motors.

    Exit code 0; 3 if the arm is unstable at every tension, or already without the load.
    """
    loaded = load is not None or mass is not None
    if not loaded and (minimum or maximum < math.inf):
        raise misuse("--minimum, --maximum", "bound the tensions under --load or --mass: give one.")
    pose = options.posture(arm, changes, angles)
    tension = cdsm.critical_tension(pose)
    results: dict[str, CriticalTension | CriticalLoad | Payload] = {"critical_tension": tension}
    if loaded:
        weights = _weights(pose.arm, load, mass)
        results["critical_load"] = cdsm.critical_load(pose, weights, minimum, maximum)
        if len(weights) == 1 and not any(W[3:].any() for W in weights.values()):
            link, force = _one_force(weights)
            results["payload"] = cdsm.payload(pose, force, minimum, maximum, link=link)
    write_picture(figure, tension.plot)
    head, numbers = header(pose, [minimum] if loaded else [])
    head = f"motors follow: they keep the posture with the least tensions\n{head}"
    numbers["motors"] = "follow"
    warnings = [warning for result in results.values() for warning in result.warnings]
    return answer(as_json, numbers | results, head, *results.values(), warnings=warnings)

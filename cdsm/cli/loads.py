"""``cdsm weigh | cycle | buckle``: displacement under loads, hysteresis, buckling."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.files import Picture, data_option
from cdsm.cli.options import (
    Angles,
    ArmOptions,
    AsJson,
    TensionOptions,
    WeightOptions,
    wrench_of,
)
from cdsm.cli.output import answer, write, write_picture
from cdsm.cli.values import misuse


def weigh(
    arm: ArmOptions,
    tensions: TensionOptions,
    weight: WeightOptions,
    wrench: options.Wrench = None,
    angles: Angles = "0",
    steps: Annotated[int, typer.Option(help="Equal steps of the weight.")] = 5,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Hang a weight at the tip with the motors locked; print the displacement (Eq. 20).

    --force or --mass is the weight; --wrench is a load that the arm carries already. With friction
    in the holes, the answer also says which stiffness small and large weights measure. Exit code 0;
    3 if the arm does not stay at its posture without the weight, or buckles under it.
    """
    if not weight.given:
        raise misuse("--force", "give it or --mass: the weight.")
    pose = arm.at(angles)
    tension = tensions.distribute(pose, wrench_of(wrench))
    force = weight.vector(pose.arm)
    if not force.any():
        said = "is zero; nothing moves, and there is nothing to measure."
        raise cdsm.InvalidInput(weight.option, said)
    test = cdsm.weight_test(pose, tension, force, steps=steps)
    write_picture(figure, test.plot)
    without = " without friction" if pose.arm.has_friction else ""
    loaded = f"at the full load{without}:\n{test.states[-1]}"
    warnings = (*cdsm.stiffness(pose, tension).warnings, *test.warnings)
    conditions = tensions.conditions(pose, friction=True)
    answer(as_json, test.to_dict, conditions, test, loaded, warnings=warnings)


def buckle(
    arm: ArmOptions,
    weight: WeightOptions,
    angles: Angles = "0",
    min_tension: Annotated[
        float | None,
        typer.Option(help="Lower bound of all tensions under the load [N]; default 10."),
    ] = None,
    max_tension: Annotated[
        float | None, typer.Option(help="Upper bound of all tensions under the load [N].")
    ] = None,
    wrench: options.Wrench = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find the tension at which the arm buckles, and the largest multiple of a load it can carry.

    --force or --mass is the load that is multiplied; --wrench is a constant load in addition. Exit
    code 0; 3 if the arm is unstable at every tension, or already without the load.
    """
    for option, value in (("--min-tension", min_tension), ("--max-tension", max_tension)):
        if value is not None and not weight.given:
            raise misuse(option, "bounds the tensions under --force or --mass only.")
    pose = arm.at(angles)
    carried = wrench_of(wrench)
    tension = cdsm.critical_tension(pose, carried)
    found: list[cdsm.CriticalTension | cdsm.CriticalLoad] = [tension]
    low: tuple[float, ...] = ()
    if weight.given:
        multiplied = [*weight.vector(pose.arm), 0.0, 0.0, 0.0]
        if not any(multiplied):
            said = "is zero, and so is any multiple of it; give a load."
            raise cdsm.InvalidInput(weight.option, said)
        least = 10.0 if min_tension is None else min_tension
        most = math.inf if max_tension is None else max_tension
        low = (least,)
        found.append(cdsm.critical_load(pose, multiplied, least, most, wrench=carried))
    write_picture(figure, tension.plot)
    answer(
        as_json,
        lambda: dict(
            zip(("critical_tension", "critical_load"), (x.to_dict() for x in found), strict=False)
        ),
        Conditions(pose, low),
        *found,
        warnings=[warning for each in found for warning in each.warnings],
    )


def cycle(
    arm: ArmOptions,
    tensions: TensionOptions,
    weight: WeightOptions,
    wrench: options.Wrench = None,
    angles: Angles = "0",
    cycles: Annotated[int, typer.Option(help="Number of cycles.", min=1, max=100)] = 2,
    steps: Annotated[
        int, typer.Option(help="Steps from zero load to the largest.", min=1, max=1000)
    ] = 12,
    one_sided: Annotated[
        bool, typer.Option("--one-sided", help="Unload to zero; do not reverse the load.")
    ] = False,
    out: Annotated[Path | None, data_option()] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Load and unload the tip slowly, and print the hysteresis due to friction in the holes.

    --force plus the weight of --mass is the largest load; --wrench is a constant load in addition.
    Exit code 0; 3 if the arm snaps through.
    """
    import numpy as np

    from cdsm.support.format import without_rounding

    if not weight.given:
        raise misuse("--force", "give it or --mass: the largest load.")
    pose = arm.at(angles)
    tension = tensions.distribute(pose, wrench_of(wrench))
    up = np.arange(1, steps + 1) / steps
    hump = np.concatenate([up, up[-2::-1] if steps > 1 else [], [0.0]])
    factors = hump if one_sided else np.concatenate([hump, -hump])
    added = np.append(weight.vector(pose.arm), np.zeros(3))
    wrenches = tension.wrench + np.tile(factors, cycles)[:, None] * added
    history = cdsm.load_cycle(pose, tension, wrenches)
    write(out, history.write)
    write_picture(figure, history.plot)
    lost = float(history.dissipated[-len(factors) :].sum())
    far = np.linalg.norm(history.displacement, axis=1)
    left = float(far[-1])
    note = (
        f"the last cycle loses {1000.0 * lost:.4g} mJ; without load the tip is left "
        f"{1e6 * without_rounding(far)[-1]:.4g} µm from where it was"
    )
    if not pose.arm.has_friction:
        note = "the holes have no friction, so there is no loop: give --friction, e.g. 0.1"
    answer(
        as_json,
        lambda: history.to_dict() | {"lost_in_last_cycle_J": lost, "left_over_m": left},
        tensions.conditions(pose, friction=True),
        history,
        note,
        warnings=history.warnings,
    )

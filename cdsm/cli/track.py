"""``cdsm track``: follow a path in closed loop, at a wanted stiffness."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.files import Picture, file_option, out_option
from cdsm.cli.options import ArmOptions, AsJson, MaxTension, MinTension
from cdsm.cli.output import answer, write, write_picture
from cdsm.cli.values import axis, misuse, numbers


def _laws() -> list[str]:
    from cdsm.control.laws import LAWS

    return list(LAWS)


@dataclass(frozen=True)
class TrueArmOptions:
    """Options that say how the true arm differs from the controller's model."""

    plant: Annotated[
        Literal["slow", "mujoco"],
        typer.Option(
            help="The true arm: quasi-static, with friction; or with inertia and damping (extra "
            "mujoco), without friction."
        ),
    ] = "slow"
    payload: Annotated[
        float, typer.Option(help="Mass [kg] that the controller does not know of.")
    ] = 0.0
    payload_from: Annotated[
        float, typer.Option(help="Fraction of the path [0 to 1] after which the payload hangs.")
    ] = 0.5
    true_rigidity: Annotated[
        float, typer.Option(help="True rigidity of the wires, divided by that of the model.")
    ] = 1.0
    true_friction: Annotated[
        float | None, typer.Option(help="True friction coefficient; default: that of the model.")
    ] = None

    def check(self) -> None:
        """Raise InvalidInput or BadParameter if an option is out of range."""
        from cdsm.support.validation import quantity

        quantity("--true-friction", self.true_friction or 0.0, "friction", zero=True)
        if not 0.0 < self.true_rigidity < math.inf:
            raise misuse(
                "--true-rigidity", f"{self.true_rigidity:g} given; a positive number is needed."
            )

    def made(self, model: cdsm.Manipulator, period: float) -> cdsm.SlowPlant | cdsm.MuJoCoPlant:
        """Build the plant, which simulates the true arm.

        ``model`` is the arm that the controller knows, ``period`` the time of a control step [s].
        """
        from cdsm.control import with_rigidity

        arm = with_rigidity(model, self.true_rigidity) if self.true_rigidity != 1.0 else model
        arm = arm if self.true_friction is None else arm.with_friction(self.true_friction)
        return cdsm.MuJoCoPlant(arm, period) if self.plant == "mujoco" else cdsm.SlowPlant(arm)


@dataclass(frozen=True)
class SensorOptions:
    """Options that describe the encoders and load cells."""

    encoder: Annotated[float, typer.Option(help="Resolution of the encoders [mm].")] = 0.01
    tension_noise: Annotated[
        float, typer.Option(help="Standard deviation of load cell noise [N].")
    ] = 0.0
    tension_bias: Annotated[float, typer.Option(help="Constant error of all load cells [N].")] = 0.0
    delay: Annotated[int, typer.Option(help="Delay of the sensors in steps.")] = 0

    def made(self) -> cdsm.Sensors:
        """Build the sensors."""
        return cdsm.Sensors(
            encoder=1e-3 * self.encoder,
            tension_noise=self.tension_noise,
            tension_bias=self.tension_bias,
            delay=self.delay,
        )


def track(
    arm: ArmOptions,
    path: Annotated[Path, typer.Argument(metavar="PATH.csv", help=options.PATH_COLUMNS)],
    stiffness: Annotated[
        str,
        typer.Option(
            help="Wanted stiffness [N/mm] along an axis or a vector; without a number if PATH.csv "
            "has targets.",
            metavar="AXIS=N/mm|X,Y,Z=N/mm",
        ),
    ],
    *,
    law: Annotated[
        str,
        typer.Option(
            help="Motor law: feedforward, tension, mixed, or stiffness, which plans tensions again "
            "at the estimated posture.",
            autocompletion=_laws,
        ),
    ] = "stiffness",
    true: TrueArmOptions,
    sensors: SensorOptions,
    steps: Annotated[int, typer.Option(help="Control steps from sample to sample.")] = 5,
    period: Annotated[float, typer.Option(help="Time between two control steps [s].")] = 0.05,
    rate: Annotated[
        float, typer.Option(help="Largest change of a tension per step by the stiffness loop [N].")
    ] = 10.0,
    bands: Annotated[
        int,
        typer.Option(
            help="Steps between two computations of the band in which friction lets the tip rest; "
            "0: none."
        ),
    ] = 1,
    felt: Annotated[
        int,
        typer.Option(help="Steps between measurements of the stiffness by the motors; 0: none."),
    ] = 0,
    min_tension: MinTension = 10.0,
    max_tension: MaxTension = math.inf,
    seed: Annotated[int, typer.Option(help="Seed of the noise.")] = 0,
    out: Annotated[
        Path | None,
        out_option(
            endings=(".nc", ".csv"),
            metavar="RUN.nc|RUN.csv",
            help="Results over time to write; .nc has all.",
        ),
    ] = None,
    animate: Annotated[
        Path | None,
        file_option(
            endings=(".gif", ".csv"),
            metavar="RUN.gif|RUN.csv",
            help="Motion of the true arm to write: a GIF, or a table over time that `cdsm view "
            "ARM.toml --path RUN.csv` plays.",
        ),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Simulate an arm that follows a path in closed loop at a wanted stiffness.

    The arm of the file is the controller's model; --true-rigidity, --true-friction and --payload
    say how the true arm differs. Exit code 0; 3 if the loop is unstable, the arm buckles,
    or a sample cannot be planned.
    """
    from cdsm.cli.path_file import one_target, read_path
    from cdsm.support.format import plural

    true.check()
    robot = arm.read()
    file = read_path(path, robot)
    u, wanted = _wanted(stiffness)
    target = one_target(wanted, file.target, "--stiffness")
    plan = cdsm.plan_path(
        robot, u, target, min_tension, max_tension, angles=file.angles, tips=file.tips
    )
    conditions = Conditions(robot, (min_tension,), friction=True)
    missed = len(plan.infeasible)
    if missed:
        warnings = [f"NOT REACHED at {missed} of {plural(len(plan.target), 'sample')}"]
        answer(as_json, plan.to_dict, conditions, plan, warnings=warnings)
    run = cdsm.track(
        plan,
        law,
        true.made(robot, period),
        sensors.made(),
        minimum=min_tension,
        maximum=max_tension,
        payload=true.payload,
        payload_from=true.payload_from,
        steps=steps,
        period=period,
        rate=rate,
        bands=bands,
        felt=felt,
        seed=seed,
    )
    write(out, run.write)
    write_picture(figure, run.plot)
    table = animate is not None and animate.suffix.lower() == ".csv"
    write(animate, run.write if table else run.animate)
    answer(as_json, run.to_dict, conditions, run, warnings=run.warnings)


def _wanted(text: str) -> tuple[Sequence[float], float | None]:
    """Return the direction (3,) in the text of --stiffness, and the stiffness [N/m] if given."""
    name, given, value = text.partition("=")
    u = axis(name) or numbers("--stiffness", name, 3, "AXIS=N/mm, or X,Y,Z=N/mm")
    if not given:
        return u, None
    (wanted,) = numbers("--stiffness", value, 1, "AXIS=N/mm")
    if not 0.0 < wanted < math.inf:
        raise misuse("--stiffness", f"{wanted:g} N/mm given; a positive number is needed.")
    return u, 1000.0 * wanted

"""Options of the commands, and the arm and the tensions that they describe."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

import cdsm
from cdsm.cli.conditions import Conditions
from cdsm.cli.output import reported

if TYPE_CHECKING:
    from cdsm.support.values import Array

DEFAULT_SOLVER: Final = "daqp"
"""As in :mod:`cdsm.tension`, which the help pages do not wait for."""

_arm_option = partial(typer.Option, rich_help_panel="The arm")
_tension_option = partial(typer.Option, rich_help_panel="Tensions and load")

ANGLES = typer.Option(
    help="Joint angles in degrees (mm where a joint slides), separated by commas, or one for all "
    "joints; 0 if left out.",
    metavar="DEG,DEG,...",
    show_default=False,
)
Angles = Annotated[str, ANGLES]
MinTension = Annotated[float, _tension_option(help="Lower bound of all tensions [N].")]
MaxTension = Annotated[float, _tension_option(help="Upper bound of all tensions [N].")]
Wrench = Annotated[
    str, _tension_option(help="At the tip: FX,FY,FZ,MX,MY,MZ [N, N m].", metavar="FX,...,MZ")
]
Solver = Annotated[str, _tension_option(help="Quadratic-programming solver.")]
Picture = Annotated[
    Path | None,
    typer.Option(metavar="FILE.pdf|svg|png", help="Figure to write; pdf and svg are vectors."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print SI numbers as JSON.")]

NO_WRENCH = "0,0,0,0,0,0"


@dataclass(frozen=True)
class ArmOptions:
    """Options that describe the arm of a command."""

    arm: Annotated[
        Path,
        typer.Argument(
            metavar="ARM",
            help="An ARM.toml, as `cdsm new` writes it; or a robot (.urdf), with --cables and "
            "--tip; or the folder of a CASPR model.",
        ),
    ]
    cables: Annotated[
        Path | None,
        _arm_option(metavar="CABLES.toml", help="Its cables, in the place of its own."),
    ] = None
    tip: Annotated[str | None, _arm_option(help="The link of a .urdf that is its tip.")] = None
    wire: Annotated[
        str | None,
        _arm_option(
            metavar="NAME|EA|WIRE.toml",
            help="Wire of all cables: a name such as 1x19-1.2mm, a constant rigidity in N, or a "
            "file that `cdsm fit` writes; default: what the files say.",
        ),
    ] = None
    rigidity: Annotated[float | None, _arm_option(help="Older name of --wire EA.", hidden=True)] = (
        None
    )
    spring: Annotated[
        float | None,
        _arm_option(help="Stiffness of a spring in series with every cable [N/mm]."),
    ] = None
    slack_below: Annotated[
        bool,
        _arm_option(
            "--slack-below",
            help="Continue the wires below their laws: constant rigidity down to 0 N, then slack.",
        ),
    ] = False
    gravity: Annotated[
        str | None,
        _arm_option(
            help="In m/s², base axes; default: what the file says, or 0,0,-9.81.",
            metavar="GX,GY,GZ",
        ),
    ] = None

    def read(self) -> cdsm.Manipulator:
        """Build the arm from its files and options."""
        try:
            arm = self._arm()
        except cdsm.MissingWire as error:
            raise typer.BadParameter(str(error), param_hint="--wire") from None
        if self.spring is not None:
            springs = [
                dataclasses.replace(cable, series_stiffness=1000.0 * self.spring)
                for cable in arm.cables
            ]
            arm = arm.with_cables(springs)
        if self.slack_below:
            continued = [
                dataclasses.replace(cable, elasticity=cable.elasticity.slack_below())
                for cable in arm.cables
            ]
            arm = arm.with_cables(continued)
        if self.gravity is not None:
            arm = arm.with_gravity(numbers("--gravity", self.gravity, 3))
        return arm

    def _arm(self) -> cdsm.Manipulator:
        """Read the arm, its wire included, from its files."""
        wire = self._wire()
        robot = self.arm.suffix.lower() == ".urdf"
        if robot and (self.cables is None or self.tip is None):
            missing = "--cables" if self.cables is None else "--tip"
            raise typer.BadParameter("a robot in a .urdf needs it.", param_hint=missing)
        if not robot:
            self._refuse("the tip of a .urdf is free, that of others is not", "tip")
        if self.arm.is_dir():
            self._refuse("a CASPR model has its own cables", "cables")
            arm = cdsm.read_caspr(self.arm, elasticity=wire or cdsm.LinearElasticity(1.0))
            if wire is None:  # only now, since the folder may hold no model
                raise cdsm.MissingWire(self.arm)
            return arm
        if self.cables is None:
            return cdsm.Manipulator.read(self.arm, wire)
        cables = cdsm.read_cables(self.cables, wire)
        if robot:
            return cdsm.Manipulator.from_urdf(self.arm, cables, tip=str(self.tip))
        # the cables of the arm are not asked for a wire
        return cdsm.Manipulator.read(self.arm, cables[0].elasticity).with_cables(cables)

    def at(self, angles: str) -> cdsm.Posture:
        """Return the posture at joint coordinates [degrees, or mm if a joint slides]."""
        arm, given = self.read(), numbers("--angles", angles)
        given = given * arm.nv if len(given) == 1 else given
        if len(given) != arm.nv:
            names = ", ".join(arm.joint_names)
            raise typer.BadParameter(
                f"{len(given)} given; give one angle, or one for each of {names}.",
                param_hint="--angles",
            )
        return arm.at(given * joint_scales(arm))

    def _refuse(self, why: str, *names: str) -> None:
        """Raise BadParameter for options that this kind of arm would ignore."""
        for field in fields(self):
            if field.name in names and getattr(self, field.name) != field.default:
                raise typer.BadParameter(f"{why}; leave it out.", param_hint=f"--{field.name}")

    def _wire(self) -> cdsm.Elasticity | None:
        """Return the wire of --wire, or of --rigidity, if one is given."""
        from cdsm.wires.catalogue import as_wire

        if self.wire is None:
            return None if self.rigidity is None else cdsm.LinearElasticity(self.rigidity)
        if self.rigidity is not None:
            raise typer.BadParameter("give it or --wire, not both.", param_hint="--rigidity")
        try:
            rigidity = float(self.wire)
        except ValueError:
            return as_wire(self.wire)
        return as_wire(rigidity)


@dataclass(frozen=True)
class TensionOptions:
    """Options of the tension distribution."""

    min_tension: MinTension = 10.0
    max_tension: MaxTension = math.inf
    wrench: Wrench = NO_WRENCH
    solver: Solver = DEFAULT_SOLVER

    def conditions(self, arm: cdsm.Manipulator) -> Conditions:
        """Return what an answer with these options is computed with."""
        return Conditions(arm, (self.min_tension,))

    def distribute(self, pose: cdsm.Posture) -> cdsm.Tension:
        """Compute the tensions at a posture."""
        load = numbers("--wrench", self.wrench, 6)
        return cdsm.distribute_tension(pose, self.min_tension, self.max_tension, load, self.solver)


def as_command(function: Callable[..., None]) -> Callable[..., None]:
    """Return a function as typer needs it: one parameter per option, and errors as messages.

    typer reads options only from the signature. Shared options are declared once, as fields of a
    dataclass; here they replace the parameter of the function that is annotated with it.
    """
    groups: dict[str, Any] = {}
    options: list[inspect.Parameter] = []
    for each in inspect.signature(function, eval_str=True).parameters.values():
        if is_dataclass(each.annotation):
            groups[each.name] = each.annotation
            options += inspect.signature(groups[each.name], eval_str=True).parameters.values()
        else:
            options.append(each)

    @wraps(function)
    def command(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        with reported():
            function(**given)

    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in options]
    )
    return command


def joint_scales(arm: cdsm.Manipulator) -> Array:
    """Return the command-line unit of each joint (nv,) in SI: one degree [rad] or one mm [m]."""
    import numpy as np

    from cdsm.support.format import JointUnits

    return np.array([scale for _, scale in JointUnits(arm.slides).shown])


def numbers(option: str, text: str, count: int | None = None) -> list[float]:
    """Read numbers separated by commas or spaces, and check their count."""
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise typer.BadParameter(
            f"{error}; separate numbers by commas.", param_hint=option
        ) from None
    if count is not None and len(values) != count:
        raise typer.BadParameter(f"{len(values)} given; give {count}.", param_hint=option)
    return values

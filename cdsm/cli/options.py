"""Shared by all commands: options, the arm that they describe, output and errors."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_type_hints

import numpy as np
import typer
from rich.console import Console

from cdsm.cable import serpentine_cables
from cdsm.cli.json_answers import Json, show_json
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.errors import CdsmError
from cdsm.geometry import Geometry
from cdsm.interchange.cable_file import read_cables
from cdsm.interchange.caspr import read_caspr
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.presets import STRAND_1X19
from cdsm.support.files import write_file
from cdsm.support.format import JointUnits
from cdsm.support.validation import Array
from cdsm.tension import DEFAULT_SOLVER, Tension, distribute_tension
from cdsm.wires.files import read_elasticity

_Value = TypeVar("_Value")

console = Console(stderr=True)
"""Console for progress and errors. Answers go to standard output."""

_ARM = "The arm"
_TENSIONS = "Tensions and load"

ANGLES = typer.Option(
    help="Joint angles in degrees (mm where a joint slides), separated by commas, or one for all "
    "joints; 0 if left out.",
    metavar="DEG,DEG,...",
    show_default=False,
)
Angles = Annotated[str, ANGLES]
MinTension = Annotated[
    float, typer.Option(help="Lower bound of all tensions [N].", rich_help_panel=_TENSIONS)
]
MaxTension = Annotated[
    float, typer.Option(help="Upper bound of all tensions [N].", rich_help_panel=_TENSIONS)
]
Wrench = Annotated[
    str,
    typer.Option(
        help="At the tip: FX,FY,FZ,MX,MY,MZ [N, N m].",
        metavar="FX,...,MZ",
        rich_help_panel=_TENSIONS,
    ),
]
Solver = Annotated[
    str, typer.Option(help="Quadratic-programming solver.", rich_help_panel=_TENSIONS)
]
Picture = Annotated[Path | None, typer.Option(metavar="FILE.png", help="Picture to write.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print SI numbers as JSON.")]

debug_wanted: ContextVar[bool] = ContextVar("debug_wanted", default=False)
"""Whether the running command shows tracebacks."""

NO_WRENCH = "0,0,0,0,0,0"


@dataclass(frozen=True)
class ArmOptions:
    """Options that describe the arm of a command."""

    arm: Annotated[
        Path,
        typer.Argument(
            metavar="ARM",
            help="Geometry (.toml); or a robot (.urdf), with --cables and --tip; or the folder of "
            "a CASPR model.",
        ),
    ]
    cables: Annotated[
        Path | None,
        typer.Option(
            metavar="CABLES.toml", help="Its cables, and their wires.", rich_help_panel=_ARM
        ),
    ] = None
    tip: Annotated[
        str | None,
        typer.Option(help="The link of a .urdf that is its tip.", rich_help_panel=_ARM),
    ] = None
    rigidity: Annotated[
        float | None,
        typer.Option(
            help="Constant EA of all cables [N]; default: the 1x19 strand of Eq. 19.",
            rich_help_panel=_ARM,
        ),
    ] = None
    wire: Annotated[
        Path | None,
        typer.Option(
            metavar="WIRE.toml",
            help="Elasticity of all cables, as `cdsm fit` writes it.",
            rich_help_panel=_ARM,
        ),
    ] = None
    spring: Annotated[
        float,
        typer.Option(
            help="Stiffness of a spring in series with every cable [N/mm].", rich_help_panel=_ARM
        ),
    ] = math.inf
    gravity: Annotated[
        str,
        typer.Option(
            help="In m/s², base axes: GX,GY,GZ.", metavar="GX,GY,GZ", rich_help_panel=_ARM
        ),
    ] = "0,0,-9.81"

    def read(self) -> Manipulator:
        """Build the arm from its files and options."""
        gravity = numbers("--gravity", self.gravity, 3)
        if self.arm.suffix.lower() == ".urdf":
            cables = read_cables(_needed("--cables", self.cables))
            tip = _needed("--tip", self.tip)
            self._refuse("the file of --cables has the wires", "rigidity", "wire", "spring")
            return Manipulator.from_urdf(self.arm, cables, tip=tip, gravity=gravity)
        self._refuse("the tip of a .urdf is free, that of others is not", "tip")
        if self.arm.is_dir():
            self._refuse("a CASPR model has its own cables", "cables", "spring")
            return read_caspr(self.arm, elasticity=self._elasticity(), gravity=gravity)
        geometry = Geometry.read(self.arm)
        if self.cables is not None:
            self._refuse("the file of --cables has the wires", "rigidity", "wire", "spring")
            return Manipulator(geometry, cables=read_cables(self.cables), gravity=gravity)
        routed = serpentine_cables(
            geometry, self._elasticity(), series_stiffness=1000.0 * self.spring
        )
        return Manipulator(geometry, cables=routed, gravity=gravity)

    def at(self, angles: str) -> Posture:
        """Return the posture at joint coordinates [degrees, or mm if a joint slides]."""
        return at_angles(self.read(), angles)

    def _refuse(self, why: str, *names: str) -> None:
        """Raise BadParameter for options that this kind of arm would ignore."""
        for field in fields(self):
            if field.name in names and getattr(self, field.name) != field.default:
                raise typer.BadParameter(f"{why}; leave it out.", param_hint=f"--{field.name}")

    def _elasticity(self) -> Elasticity:
        if self.rigidity is not None and self.wire is not None:
            raise typer.BadParameter("give it or --wire, not both.", param_hint="--rigidity")
        if self.wire is not None:
            return read_elasticity(self.wire)
        return STRAND_1X19 if self.rigidity is None else LinearElasticity(self.rigidity)


@dataclass(frozen=True)
class TensionOptions:
    """Options of the tension distribution."""

    min_tension: MinTension = 10.0
    max_tension: MaxTension = math.inf
    wrench: Wrench = NO_WRENCH
    solver: Solver = DEFAULT_SOLVER

    def distribute(self, pose: Posture) -> Tension:
        """Compute the tensions at a posture."""
        load = numbers("--wrench", self.wrench, 6)
        return distribute_tension(pose, self.min_tension, self.max_tension, load, self.solver)


def _needed(option: str, value: _Value | None) -> _Value:
    if value is None:
        raise typer.BadParameter("a robot in a .urdf needs it.", param_hint=option)
    return value


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Replace each dataclass parameter of a command by one option per field, for typer.

    typer reads options only from the signature. Shared options are declared once, as fields of a
    dataclass, and this function puts them into the signature.
    """
    hints = get_type_hints(command, include_extras=True)
    own = inspect.signature(command).parameters
    groups = {name: hints[name] for name in own if is_dataclass(hints[name])}
    shown: list[inspect.Parameter] = []
    for name, parameter in own.items():
        if name in groups:
            inner = get_type_hints(groups[name], include_extras=True)
            shown += [
                item.replace(annotation=inner[item.name], kind=inspect.Parameter.KEYWORD_ONLY)
                for item in inspect.signature(groups[name]).parameters.values()
            ]
        else:
            shown.append(
                parameter.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
            )

    @wraps(command)
    def flat(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        command(**given)

    flat.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
    flat.__annotations__ = {parameter.name: parameter.annotation for parameter in shown}
    return flat


def at_angles(arm: Manipulator, angles: str) -> Posture:
    """Return the posture of an arm at joint coordinates [degrees, or mm if a joint slides]."""
    given = numbers("--angles", angles)
    given = given * arm.nv if len(given) == 1 else given
    if len(given) != arm.nv:
        names = ", ".join(arm.joint_names)
        raise typer.BadParameter(
            f"{len(given)} given; give one angle, or one for each of {names}.",
            param_hint="--angles",
        )
    return arm.at(np.array(given) * joint_scales(arm))


def joint_scales(arm: Manipulator) -> Array:
    """Return the command-line unit of each joint (nv,) in SI: one degree [rad] or one mm [m]."""
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


def answer(as_json: bool, as_dict: Callable[[], Json], *parts: object) -> None:
    """Print an answer: its parts as text, or its numbers as JSON."""
    if as_json:
        show_json(as_dict())
    else:
        typer.echo("\n\n".join(map(str, parts)))


def write_picture(path: Path | None, draw: str, *results: object, err: bool = True) -> None:
    """Draw results with the function ``draw`` of :mod:`cdsm.plots`, if a path is given."""
    if path is not None:
        from cdsm import plots  # imports matplotlib, so on demand

        figure = getattr(plots, draw)(*results)
        typer.echo(f"written: {write_file(path, figure.savefig)}", err=err)


UNMET = 3
"""Exit code of a negative answer (unstable, untrusted, infeasible); 1: error, 2: wrong option."""


@contextmanager
def reported() -> Iterator[None]:
    """Turn an error into a message and exit code 1, Ctrl-C into 130; --debug changes nothing."""
    try:
        yield
    except KeyboardInterrupt:
        if debug_wanted.get():
            raise
        console.print("interrupted: no file is half-written, and what --resume keeps stays")
        raise typer.Exit(130) from None
    except (CdsmError, OSError) as error:  # OSError: of the terminal or pipe
        if debug_wanted.get():
            raise
        console.print(f"error: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        raise typer.Exit(1) from None

"""What the commands share: options, the arm they describe, and how failure is told."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from cdsm.cable import serpentine_cables
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.errors import CdsmError
from cdsm.geometry import Geometry
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.presets import STRAND_1X19
from cdsm.wire_file import read_elasticity

console = Console(stderr=True)
"""For progress and errors; answers go to the standard output."""

GeometryFile = Annotated[Path, typer.Argument(metavar="GEOMETRY.toml", help="Geometry to read.")]
Angles = Annotated[
    str,
    typer.Option(
        help="Joint angles in degrees, separated by commas; or one for all joints.",
        metavar="DEG,DEG,...",
    ),
]
MinTension = Annotated[float, typer.Option(help="Lower bound of all tensions [N].")]
MaxTension = Annotated[float, typer.Option(help="Upper bound of all tensions [N].")]
Rigidity = Annotated[
    float | None,
    typer.Option(help="Constant EA of all cables [N]; default: the 1x19 strand of Eq. 19."),
]
Wire = Annotated[
    Path | None,
    typer.Option(metavar="WIRE.toml", help="Elasticity of all cables, as `cdsm fit` writes it."),
]
Spring = Annotated[
    float, typer.Option(help="Stiffness of a spring in series with every cable [N/mm].")
]
Wrench = Annotated[
    str, typer.Option(help="At the tip: FX,FY,FZ,MX,MY,MZ [N, N m].", metavar="FX,...,MZ")
]
Gravity = Annotated[str, typer.Option(help="In m/s², base axes: GX,GY,GZ.", metavar="GX,GY,GZ")]
Solver = Annotated[str, typer.Option(help="Quadratic-programming solver.")]
Picture = Annotated[Path | None, typer.Option(metavar="FILE.png", help="Picture to write.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print SI numbers as JSON.")]

debug_wanted: ContextVar[bool] = ContextVar("debug_wanted", default=False)
"""Whether this call of the command line is to show tracebacks."""

NO_WRENCH = "0,0,0,0,0,0"
DOWN = "0,0,-9.81"


def manipulator(
    geometry: Path, *, rigidity: float | None, wire: Path | None, spring: float, gravity: str
) -> Manipulator:
    """The arm of the options.

    Raises:
        CdsmError: There is no such file or arm.
    """
    cables = serpentine_cables(
        described := Geometry.read(geometry),
        _elasticity(rigidity, wire),
        series_stiffness=1000.0 * spring,
    )
    return Manipulator(described, cables=cables, gravity=numbers("--gravity", gravity, 3))


def posture(
    geometry: Path,
    angles: str,
    *,
    rigidity: float | None,
    wire: Path | None,
    spring: float,
    gravity: str,
) -> Posture:
    """The arm of the options at the angles of the options.

    Raises:
        CdsmError: There is no such file, arm or posture.
    """
    arm = manipulator(geometry, rigidity=rigidity, wire=wire, spring=spring, gravity=gravity)
    return at_angles(arm, angles)


def at_angles(arm: Manipulator, angles: str) -> Posture:
    """An arm at the angles of the options.

    Raises:
        JointLimitError: An angle is beyond its limit.
    """
    degrees = numbers("--angles", angles)
    degrees = degrees * arm.nv if len(degrees) == 1 else degrees
    if len(degrees) != arm.nv:
        names = ", ".join(arm.joint_names)
        raise typer.BadParameter(
            f"{len(degrees)} given; give one angle, or one for each of {names}.",
            param_hint="--angles",
        )
    return arm.at(np.deg2rad(degrees))


def _elasticity(rigidity: float | None, wire: Path | None) -> Elasticity:
    if rigidity is not None and wire is not None:
        raise typer.BadParameter("give it or --wire, not both.", param_hint="--rigidity")
    if wire is not None:
        return read_elasticity(wire)
    return STRAND_1X19 if rigidity is None else LinearElasticity(rigidity)


def numbers(option: str, text: str, count: int | None = None) -> list[float]:
    """Numbers separated by commas or spaces, as many as are wanted."""
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise typer.BadParameter(
            f"{error}; separate numbers by commas.", param_hint=option
        ) from None
    if count is not None and len(values) != count:
        raise typer.BadParameter(f"{len(values)} given; give {count}.", param_hint=option)
    return values


def show_json(values: dict[str, object]) -> None:
    """Print SI numbers as strict JSON."""
    typer.echo(json.dumps(values, indent=1, allow_nan=False))


@contextmanager
def reported() -> Iterator[None]:
    """Turn a CdsmError into one message and exit code 1; with --debug leave it as it is."""
    try:
        yield
    except (CdsmError, OSError) as error:  # OSError: the terminal or pipe itself
        if debug_wanted.get():
            raise
        console.print(f"error: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        raise typer.Exit(1) from None

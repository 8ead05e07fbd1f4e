"""Declare options that commands share; build the arm, tensions and loads that they describe."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

import cdsm
from cdsm.cli.conditions import Conditions
from cdsm.cli.values import coordinates, gravity_of, joint_scales, misuse, numbers

if TYPE_CHECKING:
    from cdsm.support.values import Array

DEFAULT_SOLVER: Final = "daqp"
"""Default solver, as in :mod:`cdsm.tension`; to import that module would delay the help pages."""

_arm_option = partial(typer.Option, rich_help_panel="The arm")
_tension_option = partial(typer.Option, rich_help_panel="Tensions and load")


def _solvers() -> list[str]:
    from cdsm.tension import installed_solvers

    return installed_solvers()


def _wires() -> list[str]:
    from cdsm.wires.catalogue import WIRES

    return list(WIRES)


def directions() -> list[str]:
    """Return the names of directions, such as ``-z``, for completion in a shell."""
    from cdsm.support.directions import AXES

    return list(AXES)


ANGLES = typer.Option(
    help="Joint angles in degrees (mm where a joint slides): by name (others 0), in order, or "
    "one for all joints. Default: 0.",
    metavar="JOINT=DEG,...|DEG,DEG,...|DEG",
    show_default=False,
)
Angles = Annotated[str, ANGLES]
PATH_COLUMNS: Final = (
    "Columns, with the unit in brackets: joints in deg (mm where they slide; 0 if left out), or x, "
    "y, z of the tip in mm; and, if wanted, target in N/mm."
)
MinTension = Annotated[
    float,
    _tension_option(help="Lower bound of all tensions [N]; the default in Python is 0."),
]
MaxTension = Annotated[float, _tension_option(help="Upper bound of all tensions [N].")]
Wrench = Annotated[
    str | None,
    _tension_option(
        help="Force and moment at the tip, base axes: FX,FY,FZ,MX,MY,MZ [N, N m].",
        metavar="FX,...,MZ",
    ),
]
Solver = Annotated[
    str, _tension_option(help="Quadratic-programming solver.", autocompletion=_solvers)
]
AsJson = Annotated[bool, typer.Option("--json", help="Print answer (SI) and errors as JSON.")]


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
        _arm_option(metavar="CABLES.toml", help="Cables that replace those of the arm."),
    ] = None
    tip: Annotated[str | None, _arm_option(help="Link of a .urdf that is the tip.")] = None
    wire: Annotated[
        str | None,
        _arm_option(
            metavar="NAME|EA|WIRE.toml",
            autocompletion=_wires,
            help="Wire of all cables: a name such as 1x19-1.2mm, a constant EA in N, or a "
            "file that `cdsm fit` writes; default: those of the file.",
        ),
    ] = None
    spring: Annotated[
        float | None, _arm_option(help="Stiffness of a spring in series with every cable [N/mm].")
    ] = None
    slack_below: Annotated[
        bool,
        _arm_option(
            "--slack-below",
            help="Continue laws of wires below their range: constant EA down to 0 N, then slack.",
        ),
    ] = False
    friction: Annotated[
        float | None,
        _arm_option(help="Friction coefficient in all holes; default: that of the file, or 0."),
    ] = None
    gravity: Annotated[
        str | None,
        _arm_option(
            help="Gravity, base axes [m/s²], or an axis for 9.81 along it, such as -y; default: "
            "that of the file, or -z.",
            metavar="GX,GY,GZ|AXIS",
            autocompletion=directions,
        ),
    ] = None

    def read(self) -> cdsm.Manipulator:
        """Build the arm from its files and all other options that describe it."""
        from cdsm.support.validation import quantity

        try:
            arm = self._arm()
        except cdsm.MissingWire as error:
            raise misuse("--wire", str(error)) from None
        if self.spring is not None:
            k = quantity("--spring", 1000.0 * self.spring, "stiffness", infinite=True)
            arm = arm.with_cables([replace(cable, series_stiffness=k) for cable in arm.cables])
        if self.slack_below:
            slack = [replace(c, elasticity=c.elasticity.slack_below()) for c in arm.cables]
            arm = arm.with_cables(slack)
        if self.friction is not None:
            arm = arm.with_friction(quantity("--friction", self.friction, "friction", zero=True))
        if self.gravity is not None:
            arm = arm.with_gravity(gravity_of(self.gravity))
        return arm

    def _arm(self) -> cdsm.Manipulator:
        """Read the arm from its files, with the wire of the options if one is given."""
        if self.arm.suffix.lower() in (".nc", ".csv", ".zarr"):
            raise misuse(
                "ARM", f"{self.arm} is no arm; cdsm map reads sweeps, cdsm fit tensile tests."
            )
        wire = self._wire()
        robot = self.arm.suffix.lower() == ".urdf"
        if robot and (self.cables is None or self.tip is None):
            missing = "--cables" if self.cables is None else "--tip"
            raise misuse(missing, "a robot in a .urdf needs it.")
        if not robot:
            self._refuse("the tip of a .urdf is free, that of others is not", "tip")
        if self.arm.is_dir():
            self._refuse("a CASPR model has its own cables", "cables")
            if not any(self.arm.glob("*_bodies.xml")):
                raise misuse(
                    "ARM", f"{self.arm} is a folder without a CASPR model; give an ARM.toml."
                )
            arm = cdsm.read_caspr(self.arm, elasticity=wire or cdsm.presets.ELASTIC_STAGE)
            if wire is None:  # after reading, whose errors come first: the folder may hold no model
                raise cdsm.MissingWire(self.arm)
            return arm
        if self.cables is None:
            return cdsm.Manipulator.read(self.arm, wire)
        cables = cdsm.read_cables(self.cables, wire)
        if robot:
            return cdsm.Manipulator.from_urdf(self.arm, cables, tip=str(self.tip))
        # any law does for the arm's own cables, since they are replaced
        return cdsm.Manipulator.read(self.arm, cables[0].elasticity).with_cables(cables)

    def at(self, angles: str) -> cdsm.Posture:
        """Return the posture at joint coordinates ``angles`` [degrees, or mm if prismatic]."""
        arm = self.read()
        return arm.at(coordinates(angles, arm) * joint_scales(arm))

    def _refuse(self, why: str, *names: str) -> None:
        """Raise BadParameter if one of the options ``names`` is given; ``why`` is the message."""
        for field in fields(self):
            if field.name in names and getattr(self, field.name) != field.default:
                raise misuse(f"--{field.name}", f"{why}; leave it out.")

    def _wire(self) -> cdsm.Elasticity | None:
        """Return the law that --wire gives, if any."""
        from cdsm.support.validation import quantity
        from cdsm.wires.catalogue import as_wire

        if self.wire is None:
            return None
        try:
            rigidity = float(self.wire)
        except ValueError:
            return as_wire(self.wire)
        return as_wire(quantity("--wire", rigidity, "rigidity"))


@dataclass(frozen=True)
class TensionOptions:
    """Options of the tension distribution."""

    min_tension: MinTension = 10.0
    max_tension: MaxTension = math.inf
    solver: Solver = DEFAULT_SOLVER

    def conditions(
        self, of: cdsm.Manipulator | cdsm.Posture, *, friction: bool = False
    ) -> Conditions:
        """Return the assumptions to print above a result for an arm or a posture."""
        return Conditions(of, (self.min_tension,), friction)

    def distribute(self, pose: cdsm.Posture, wrench: Array) -> cdsm.Tension:
        """Compute the tensions at a posture under a wrench (6,): force [N], then moment [N m]."""
        return cdsm.distribute_tension(
            pose, self.min_tension, self.max_tension, wrench, self.solver
        )


@dataclass(frozen=True)
class WeightOptions:
    """Options ``--force`` and ``--mass``: a force at the tip, and a mass that hangs there."""

    force: Annotated[
        str | None,
        _tension_option(help="Force at the tip, base axes: FX,FY,FZ [N].", metavar="FX,FY,FZ"),
    ] = None
    mass: Annotated[
        float | None,
        _tension_option(help="Mass [kg] that hangs at the tip, along gravity.", min=0.0, max=1e6),
    ] = None

    @property
    def given(self) -> bool:
        """Whether a force or a mass is given."""
        return self.force is not None or self.mass is not None

    @property
    def option(self) -> str:
        """The option that a message about the load names: --mass if given, else --force."""
        return "--force" if self.mass is None else "--mass"

    def vector(self, arm: cdsm.Manipulator) -> Array:
        """Return --force plus the weight of --mass (3,) [N]."""
        import numpy as np

        from cdsm.support.validation import number_array

        force = np.zeros(3)
        if self.force is not None:
            given = numbers("--force", self.force, 3, "FX,FY,FZ")
            force += number_array("--force", given, "force")
        if self.mass is not None:
            if not arm.gravity.any():
                raise misuse("--mass", "has no weight without gravity.")
            force += self.mass * arm.gravity
        return force


@dataclass(frozen=True)
class LoadOptions(WeightOptions):
    """Options ``--force``, ``--mass``, ``--wrench``: loads at the tip, which add up."""

    wrench: Wrench = None

    def at_tip(self, arm: cdsm.Manipulator) -> Array:
        """Return the load W (6,) at ``tool0`` in base axes: force [N], then moment [N m]."""
        carried = wrench_of(self.wrench)
        carried[:3] += self.vector(arm)
        return carried


def wrench_of(text: str | None) -> Array:
    """Return the wrench (6,) of --wrench; zero if it is not given."""
    import numpy as np

    return np.array([0.0] * 6 if text is None else numbers("--wrench", text, 6, "FX,...,MZ"))

"""Options that commands share, and what their texts mean: the arm, its posture, its load."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

import cdsm
from cdsm.cli.output import misuse, note

if TYPE_CHECKING:
    from cdsm.support.values import Array


def opt(help: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """Declare an option, whose default the help states where it is worth it."""
    return typer.Option(*names, help=help, metavar=metavar, show_default=False, **more)


def file_opt(help: str, metavar: str, *names: str, declare: Any = typer.Option) -> Any:
    """Declare a file to write, which is checked before the command computes.

    ``metavar`` ends in the endings that are allowed: ``FILE.nc|csv``.
    """

    def checked(path: Path | None) -> Path | None:
        from cdsm.support.files import as_path, require_writable

        if path is not None:
            endings = [f".{ending}" for ending in metavar.rpartition(".")[2].split("|")]
            if path.suffix.lower() not in endings:
                raise typer.BadParameter(f"{path} does not end in {' or '.join(endings)}.")
            try:
                require_writable(as_path(path))
            except cdsm.CdsmError as error:
                raise typer.BadParameter(str(error)) from None
        return path

    return declare(*names, callback=checked, metavar=metavar, help=help)


_SET = "Change a key of ARM.toml for this run: minimum=50, wire=48e3, friction=0.1, gravity=-y, "
_SET += "universal.link_mass=0.06, cables.cable1_1.maximum=90. Repeat it."
_ANGLES = "Joint angles [deg, or mm where a joint slides]: one for all, one each, or by name "
_ANGLES += "(joint2_1=10,…; others 0). Default: 0."
OF_SWEEP = "Path, a line per sample. Columns such as joint1_1 [deg] (mm where they slide; others "
OF_SWEEP += "0), or x [mm], y [mm], z [mm] of the tip; as examples/data/PATH.csv, TIP_PATH.csv."
_PATH = "Path, a line per sample. Columns such as joint1_1 [deg] (mm where they slide; others 0), "
_PATH += "or x [mm], y [mm], z [mm] of the tip; for plans also target [N/mm]; as "
_PATH += "examples/data/PATH.csv, TIP_PATH.csv."

ArmArgument = Annotated[
    Path, typer.Argument(metavar="ARM.toml", help="The arm; `cdsm new` writes one.")
]
SetOption = Annotated[list[str] | None, opt(_SET, "KEY=VALUE", "--set")]
AnglesOption = Annotated[str | None, opt(_ANGLES, "DEG,...")]
PathOption = Annotated[Path | None, opt(_PATH, "PATH.csv", "--path")]
_PULL = "Wire [mm] that each motor takes in, from straight cables at the rest of the springs; one "
_PULL += "each, or by name (cable1_1=5,…; others are loose)."
_TENSION = "Tension [N] that each motor holds; the posture follows. One each, or by name "
_TENSION += "(cable1_1=20,…; others are loose)."
TensionOption = Annotated[str | None, opt(_TENSION, "N,...", "--tension")]
PullOption = Annotated[str | None, opt(_PULL, "MM,...")]
_MOTORS = "How far motors turn [deg] from their assembly, by name (m1=20,m2=-5; others 0); torque "
_MOTORS += "[N m] of those that hold one; mm or N of a cable's own. The posture follows. Assembled "
_MOTORS += "at --angles with the least tensions there; without --angles, cables are just straight."
MotorsOption = Annotated[str | None, opt(_MOTORS, "NAME=DEG,...", "--motors")]
MinimumOption = Annotated[
    float, opt("Lower bound of all tensions [N], besides those of ARM.toml.", "N")
]
MaximumOption = Annotated[
    float, opt("Upper bound of all tensions [N], besides those of ARM.toml.", "N")
]
_LOADS = "Force [N], moment [N m], base axes, at the tip or @LINK. Repeat for more links."
LoadOption = Annotated[list[str] | None, opt(_LOADS, "FX,FY,FZ[,MX,MY,MZ][@LINK]", "--load")]
_MASSES = "Mass that hangs at the tip or @LINK; adds to --load. Repeat for more links."
MassOption = Annotated[list[str] | None, opt(_MASSES, "KG[@LINK]", "--mass")]
FigureOption = Annotated[Path | None, file_opt("Figure to write.", "FILE.pdf|svg|png", "--figure")]
JsonOption = Annotated[bool, opt("Print answer (SI) and errors as JSON.", None, "--json")]


def changes_of(texts: Iterable[str] | None) -> dict[str, Any]:
    """Parse the texts of --set; what is no TOML is a number such as .5, or a string."""
    import tomllib  # slow to import

    from cdsm.support.records import laid_over

    changes: dict[str, Any] = {}
    for text in texts or ():
        key, _, value = text.partition("=")
        for form in (str, lambda x: str(float(x)), lambda x: json.dumps(x or None)):
            try:
                changes = laid_over(changes, tomllib.loads(f"{key} = {form(value.strip())}"))
                break
            except ValueError:
                continue
        else:
            raise misuse("--set", f"{text!r} given; give KEY=VALUE, such as minimum=5.")
    return changes


def load_arm(arm: Path, changes: Iterable[str] | None) -> cdsm.Manipulator:
    """Read an arm, with the changes of --set."""
    return cdsm.Manipulator.read(arm, changes=changes_of(changes))


def posture(arm: Path, changes: Iterable[str] | None, angles: str | None) -> cdsm.Posture:
    """Read an arm and return its posture at --angles."""
    robot = load_arm(arm, changes)
    return robot.at(joint_coordinates(angles, robot))


def loads_on(
    arm: cdsm.Manipulator, loads: Iterable[str] | None, masses: Iterable[str] | None = None
) -> dict[str, Array]:
    """Return the wrenches (6,) of --load and --mass by links, the tip among them; they add up."""
    import numpy as np

    from cdsm.support.validation import number_array

    wrenches = {arm.tip_link: np.zeros(6)}
    form = "FX,FY,FZ or FX,FY,FZ,MX,MY,MZ, and @LINK if not at the tip"
    for link, text in _by_link("--load", loads, arm).items():
        components = number_array("--load", parse_numbers("--load", text, (3, 6), form), "force")
        wrenches.setdefault(link, np.zeros(6))[: len(components)] += components
    for link, text in _by_link("--mass", masses, arm).items():
        (mass,) = parse_numbers("--mass", text, (1,), "KG or KG@LINK")
        if mass < 0.0:
            raise misuse("--mass", f"{mass:g} kg given; give a mass from 0 kg on.")
        if mass and not arm.gravity.any():
            raise misuse("--mass", "has no weight without gravity.")
        weight = number_array("--mass", mass, "mass") * arm.gravity
        wrenches.setdefault(link, np.zeros(6))[:3] += weight
    return wrenches


def _by_link(option: str, texts: Iterable[str] | None, arm: cdsm.Manipulator) -> dict[str, str]:
    """Return the text of each load by its link, which moves; the tip's is that without @LINK."""
    from cdsm.loads import link_point

    loads: dict[str, str] = {}
    for text in texts or ():
        value, at, name = text.partition("@")
        link = name.strip() if at else arm.tip_link
        try:
            link_point(arm, link)
        except cdsm.InvalidInput as error:
            raise misuse(option, str(error).removeprefix("link: ")) from None
        if link in loads:
            raise misuse(option, f"{link} is given twice; add them up.")
        loads[link] = value
    return loads


def joint_scales(arm: cdsm.Manipulator) -> Array:
    """Return the SI value (nv,) of the unit of each joint on the command line: 1° or 1 mm."""
    import numpy as np

    from cdsm.support.format import JointUnits

    return np.array([scale for _, scale in JointUnits(arm.slides).shown])


def joint_coordinates(text: str | None, arm: cdsm.Manipulator) -> Array:
    """Return the joint coordinates of --angles (nv,) in SI; 0 without this option."""
    import math

    from cdsm.joint_columns import TINY
    from cdsm.support.validation import scalar

    names = arm.joint_names
    form = "an angle"
    if text is not None and "=" in text:
        named = by_joint("--angles", text, arm, "JOINT=DEG,...")
        values_by_name = {
            name: parse_numbers("--angles", value, (1,), form)[0] for name, value in named.items()
        }
        values = [values_by_name.get(name, 0.0) for name in names]
    else:
        form = f"one angle, one for each of {', '.join(names)}, or some by name: {names[-1]}=10"
        values = parse_numbers("--angles", "0" if text is None else text, (1, arm.nv), form)
        if len(values) > 1 and arm.body.branches:
            note(f"--angles are those of {', '.join(names)}, in this order: the robot branches")
    turning = values if not arm.slides.any() else []
    tiny = math.degrees(TINY)
    if 0.0 < max(map(abs, turning), default=0.0) < tiny:
        note(f"all --angles are below {tiny:g}°: they are in degrees, not in radians")
    pairs = zip(names, values * arm.nv if len(values) == 1 else values, strict=True)
    return joint_scales(arm) * [scalar(f"--angles of {name}", value) for name, value in pairs]


def by_cable(
    option: str, text: str, arm: cdsm.Manipulator, scale: float
) -> list[float] | dict[str, float]:
    """Return the numbers of --tension or --pull in SI: one for each cable, or some by name."""
    names = arm.cables.names
    form = f"one for each of {', '.join(names)}, or some by name: {names[0]}=10"
    if "=" not in text:
        return [scale * value for value in parse_numbers(option, text, (len(names),), form)]
    entries = by_name(option, text, "cable", names, "CABLE=VALUE,...")
    return {
        name: scale * parse_numbers(option, value, (1,), form)[0] for name, value in entries.items()
    }


def by_motor(text: str, arm: cdsm.Manipulator) -> dict[str, float]:
    """Return the commands of --motors in SI, by the names of motors."""
    import math

    motors = arm.motors
    form = f"NAME=DEG,..., names of {', '.join(motors.names)}"
    entries = by_name("--motors", text, "motor", motors.names, form)
    commands = {}
    for name, value in entries.items():
        m = motors.names.index(name)
        scale = math.radians(1.0) if m < len(motors.given) else 1e-3
        scale = 1.0 if motors.holds_torque[m] else scale
        commands[name] = scale * parse_numbers("--motors", value, (1,), form)[0]
    return commands


def by_joint(option: str, text: str, arm: cdsm.Manipulator, form: str) -> dict[str, str]:
    """Split ``JOINT=VALUE,...`` into values by joint; the ``form`` is for the message."""
    return by_name(option, text, "joint", arm.joint_names, form)


def by_name(option: str, text: str, kind: str, names: Sequence[str], form: str) -> dict[str, str]:
    """Split ``NAME=VALUE,...`` into values by the name of a joint or cable (``kind``)."""
    from cdsm.support.validation import one_of

    values: dict[str, str] = {}
    for entry in text.split(","):
        name, equals, value = (part.strip() for part in entry.rpartition("="))
        if not equals:
            raise misuse(option, f"{entry!r} given; {form} is needed.")
        if one_of(kind, name, names) in values:
            raise misuse(option, f"{name} is given twice.")
        values[name] = value
    return values


def parse_direction(text: str) -> Sequence[float]:
    """Return the direction (3,) of --direction: an axis, or three numbers."""
    from cdsm.support.validation import AXES

    return AXES.get(text) or parse_numbers(
        "--direction", text, (3,), "an axis such as -y, or X,Y,Z"
    )


def parse_numbers(
    option: str, text: str, counts: Sequence[int] = (), form: str = "N,..."
) -> list[float]:
    """Return the numbers in the text of an option; ``form`` is for the message."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        raise misuse(option, f"{text!r} given; give {form}.") from None
    if counts and len(values) not in counts:
        raise misuse(option, f"{len(values)} given; give {form}.")
    return values


class Motion(NamedTuple):
    """A path of S samples, in SI."""

    angles: Array | None = None  # (S, nv) [rad], [m] where a joint slides; None if tips are given
    tips: Array | None = None  # (S, 3) [m]; None if angles are given
    target: Array | None = None  # wanted stiffness (S,) [N/m]; None without such a column


def read_path(path: Path, arm: cdsm.Manipulator, *, target: bool = True) -> Motion:
    """Read --path, a CSV file: a header of names with units, then one line per sample.

    Joints without a column stay at 0. Columns of joints that follow others are checked. Other
    columns are ignored, unless their names have a meaning that is not read here (``target`` says
    whether a wanted stiffness is), or look like typing errors: then FileError is raised, as for a
    wrong unit.
    """
    import numpy as np

    from cdsm.joint_columns import JointColumns
    from cdsm.support.tables import SLIDE, Columns

    joints = JointColumns(arm)
    units = joints.units | dict.fromkeys("xyz", SLIDE)
    if target:
        units |= {"target": {"N/mm": 1e3, "N/m": 1.0}}
    # a closed loop writes the displacement of its samples
    table = Columns(path, units, "samples", arm.cables.names, results=("displacement",))

    def column(name: str) -> Array:
        return np.array([table.number(row, name) for row in table.rows])

    has_tips = any(axis in table for axis in "xyz")
    for axis in "xyz" if has_tips else "":
        table.factor(axis)  # raises if it is missing
    if has_tips == any(name in table for name in arm.joint_names):
        which = "both" if has_tips else "neither"
        table.refuse(
            f"has columns for {which} of joint angles ({joints.first}, …) and tip positions "
            "(x [mm], y [mm], z [mm]); give one of them"
        )
    wanted = column("target") if "target" in table else None
    if has_tips:
        return Motion(tips=np.transpose([column(name) for name in "xyz"]), target=wanted)
    try:
        angles = joints.angles(table, table.rows)
    except cdsm.InvalidInput as error:
        raise cdsm.FileError(path, str(error)) from None
    return Motion(angles=angles, target=wanted)

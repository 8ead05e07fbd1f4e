"""``cdsm sweep`` and ``cdsm map``: write and plot the stiffness over many postures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.conditions import Conditions
from cdsm.cli.files import data_option, picture_option
from cdsm.cli.options import ArmOptions, AsJson, LoadOptions
from cdsm.cli.output import Json, answer
from cdsm.cli.values import by_joint, joint_scales, misuse, numbers
from cdsm.sweeps.quantities import DEFAULT, QUANTITIES

if TYPE_CHECKING:
    import xarray

    from cdsm.support.values import Array
    from cdsm.sweeps.poses import PoseSet


_POSES = "--grid, --path, --random"

_SOLVER_FAILED = (
    "solver_failed: tensions exist, but the solver finds none; `cdsm stiffness` says why at such a "
    "posture, and takes another --solver"
)


def _quantities() -> list[str]:
    return list(QUANTITIES)


@dataclass(frozen=True)
class PoseOptions:
    """Options for the postures of a sweep: a grid, a path or random postures."""

    grid: Annotated[
        str | None,
        typer.Option(
            help="Joints with first angle, last angle and number of angles, or one angle, in "
            "degrees (mm where they slide); joints that are not named stay at 0.",
            metavar="JOINT=LOW:HIGH:N,...",
        ),
    ] = None
    path: Annotated[
        Path | None,
        typer.Option(
            help="Straight lines in joint space between these waypoints: a column for each joint, "
            "headed by its name and unit, as in joint1_1 [deg]; joints without one stay at 0.",
            metavar="WAYPOINTS.csv",
        ),
    ] = None
    count: Annotated[
        int | None, typer.Option(help="Postures along --path; default: its waypoints.", min=2)
    ] = None
    random: Annotated[
        int | None, typer.Option(help="Number of Sobol points within the joint limits.", min=1)
    ] = None
    seed: Annotated[int | None, typer.Option(help="Seed of --random; default 0.")] = None

    def read(self, arm: cdsm.Manipulator) -> PoseSet:
        """Build the set of postures; BadParameter unless one of the three kinds is given."""
        if sum(given is not None for given in (self.grid, self.path, self.random)) != 1:
            raise misuse(_POSES, "give one of --grid, --path and --random.")
        for option, value, needed, of in (
            ("--count", self.count, "--path", self.path),
            ("--seed", self.seed, "--random", self.random),
        ):
            if value is not None and of is None:
                raise misuse(option, f"goes with {needed} only.")
        if self.grid is not None:
            return _grid(self.grid, arm)
        if self.path is not None:
            from cdsm.cli.path_file import read_path

            file = read_path(self.path, arm)
            if file.angles is None or file.target is not None:
                raise cdsm.FileError(self.path, "has tips or targets; a sweep needs joint angles.")
            return cdsm.PathPoses(file.angles, self.count)
        return cdsm.RandomPoses(self.random or 0, self.seed or 0)


@dataclass(frozen=True)
class MeasureOptions:
    """Options for the quantities payload and clearance of a sweep."""

    worst_friction: Annotated[
        bool,
        typer.Option(
            "--worst-friction",
            help="Keep the tension of each segment of each cable within the bounds, whatever loads "
            "came before.",
        ),
    ] = False
    diameter: Annotated[
        float, typer.Option(help="Diameter of the cables [mm], for clearances.")
    ] = 0.0


def sweep(
    arm: ArmOptions,
    out: Annotated[Path, data_option()],
    poses: PoseOptions,
    load: LoadOptions,
    measures: MeasureOptions,
    min_tension: Annotated[
        str, typer.Option(help="Lower bound of all tensions [N], or several.", metavar="N,N,...")
    ] = "10",
    max_tension: options.MaxTension = math.inf,
    quantities: Annotated[
        str,
        typer.Option(
            help=f"Quantities: {', '.join(QUANTITIES)}; default: {', '.join(DEFAULT)}.",
            metavar="NAME,NAME,...",
            show_default=False,
            autocompletion=_quantities,
        ),
    ] = ",".join(DEFAULT),
    resume: Annotated[
        str | None,  # a Path of "" would be the current folder
        typer.Option(
            metavar="FOLDER",
            help="Folder that keeps finished results; a stopped sweep resumes from it.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compute the stiffness over a grid, a path or random postures.

    The file has an entry with a status for each posture and each lower bound of the tensions. Exit
    code 0; 3 if no entry has the status ok.
    """
    robot = arm.read()
    wanted = poses.read(robot)
    low = numbers("--min-tension", min_tension)
    dataset = cdsm.sweep(
        robot,
        wanted,
        minimum=low[0] if len(low) == 1 else low,
        maximum=max_tension,
        wrench=load.at_tip(robot),
        outputs=[name.strip() for name in quantities.split(",")],
        worst_friction=measures.worst_friction,
        diameter=measures.diameter / 1000.0,
        store=resume,
    )
    conditions = Conditions(robot, tuple(low), friction=measures.worst_friction)
    _answer(as_json, dataset, cdsm.write_sweep(dataset, out), conditions)


def map_sweep(
    sweep: Annotated[
        Path, typer.Argument(metavar="SWEEP", help="Sweep to read: .nc, or a --resume folder.")
    ],
    out: Annotated[Path, picture_option("--out", "-o", help="Picture to write.")],
    quantity: Annotated[
        str,
        typer.Option(
            help="Quantity to show: softest, stiffest, isotropy, margin, along, or another.",
            autocompletion=_quantities,
        ),
    ] = "softest",
    section: Annotated[
        str | None,
        typer.Option(
            help="Show the tips within a slab: its normal (x, y or z), position, half thickness "
            "in mm, as in y=0:20.",
            metavar="AXIS=PLACE:HALF",
        ),
    ] = None,
    statistic: Annotated[
        Literal["median", "min", "max"] | None,
        typer.Option(
            help="Statistic of the postures in a cell; default for a cloud of tips: median."
        ),
    ] = None,
    bins: Annotated[int, typer.Option(help="Cells along the longest side of a map.")] = 40,
    as_json: AsJson = False,
) -> None:
    """Plot the reachable workspace, coloured by a quantity of a sweep.

    The map marks the postures at which the quantity does not exist, by status. Exit code 0; 3 if it
    exists at no posture.
    """
    dataset = cdsm.read_sweep(sweep)
    slab = None
    if section is not None:
        normal, _, rest = section.partition("=")
        slab_in_mm = rest.replace(":", " ")
        place, half = numbers("--section", slab_in_mm, 2, "AXIS=PLACE:HALF, in mm")
        slab = (normal.strip(), place / 1000.0, half / 1000.0)
    figure = cdsm.plots.plot_map(dataset, quantity, section=slab, statistic=statistic, bins=bins)
    _answer(as_json, dataset, cdsm.plots.save_figure(figure, out), mapped=quantity)


def _grid(text: str, arm: cdsm.Manipulator) -> cdsm.GridPoses:
    """Read --grid, such as ``joint1=-20:20:9,joint2=5``, in degrees (prismatic joints: mm)."""
    import numpy as np

    units = dict(zip(arm.joint_names, joint_scales(arm), strict=True))
    angles: dict[str, Array] = {}
    rest: dict[str, float] = {}
    form = "JOINT=LOW:HIGH:N or JOINT=ANGLE"
    for name, value in by_joint("--grid", text, arm, form).items():
        given, unit = numbers("--grid", value.replace(":", " "), form=form), units[name]
        if len(given) == 1:
            rest[name] = unit * given[0]
        elif len(given) == 3 and given[2] == 1.0 and given[0] != given[1]:
            raise misuse("--grid", f"{name}={value} asks for 1 angle; give more, or {name}=ANGLE.")
        elif len(given) == 3 and given[2] > 1.0 and given[0] == given[1]:
            raise misuse("--grid", f"{name}={value} asks for one angle; give {name}=ANGLE.")
        elif len(given) == 3 and given[2] >= 1.0 and given[2].is_integer():
            angles[name] = unit * np.linspace(given[0], given[1], int(given[2]))
        else:
            raise misuse("--grid", f"{name}={value} given; {form} is needed.")
    if not angles:
        raise misuse("--grid", "has no joint with several angles, JOINT=LOW:HIGH:N.")
    return cdsm.GridPoses(angles, rest)


def _answer(
    as_json: bool,
    dataset: xarray.Dataset,
    written: Path,
    conditions: Conditions | None = None,
    mapped: str | None = None,
) -> None:
    """Print which file was written, with warnings about the sweep ``dataset``.

    ``conditions`` are given for a new sweep: they are printed, with the number of entries of each
    status, and a warning if none is ok. ``mapped`` is given for a map: the quantity, with a warning
    if it exists at no entry.
    """
    from cdsm.support.tidy import status_names

    status = dataset["status"].values
    words = status_names(dataset)
    counts = {word: int((status == value).sum()) for value, word in words.items()}
    facts: Json = {"entries": counts, "written": [str(written)]}
    lines, warnings = [f"written: {written}"], []
    if conditions is not None:
        listed = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
        lines.insert(0, f"{dataset.attrs['title']}, {dataset.attrs['poses']}: {listed}")
        lines += [_SOLVER_FAILED] if counts.get("solver_failed") else []
        if not counts["ok"]:
            warnings.append(f"NONE of {status.size} entries is ok: {listed}")
    if mapped is not None and bool(dataset[mapped].isnull().all()):
        warnings.append(f"{mapped} exists at none of {status.size} entries")
    first = () if conditions is None else (conditions,)
    answer(as_json, lambda: facts, *first, "\n".join(lines), warnings=warnings)

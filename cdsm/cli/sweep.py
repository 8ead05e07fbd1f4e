"""``cdsm sweep``: write and map the stiffness over many postures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cdsm
from cdsm.cli import options
from cdsm.cli.options import file_opt, opt
from cdsm.cli.output import Json, answer, header, misuse, write_picture

if TYPE_CHECKING:
    from cdsm.support.values import Array
    from cdsm.sweeps.poses import PoseSet

_GRID = "Grid of joint angles [deg, or mm where they slide]: first, last and number, or one angle; "
_GRID += "other joints stay at 0."
_OUTPUTS = "Quantities of the table, such as along, tension, margin, softest, stiffest, isotropy, "
_OUTPUTS += "tip_position, cable_lengths, payload, force_radius, tension_factor, disk_clearance."


def sweep(
    arm: options.Arm,
    out: Annotated[Path | None, file_opt("Table to write, SI.", "FILE.nc|csv", "--out")] = None,
    changes: options.Changes = None,
    grid: Annotated[str | None, opt(_GRID, "JOINT=LOW:HIGH:N,...")] = None,
    path: options.PathFile = None,
    random: Annotated[int | None, opt("Sobol points within the joint limits.", "N", min=1)] = None,
    minimum: Annotated[str, opt("Lower bounds of all tensions [N], a case each.", "N,...")] = "0",
    maximum: options.Maximum = math.inf,
    load: options.Load = None,
    outputs: Annotated[str | None, opt(_OUTPUTS, "NAME,...")] = None,
    store: Annotated[
        Path | None, opt("Keeps what is done; a stopped sweep resumes.", "FOLDER")
    ] = None,
    figure: options.Figure = None,
    quantity: Annotated[str, opt("Colour of the workspace in --figure.", "NAME")] = "softest",
    as_json: options.AsJson = False,
) -> int:
    """Compute the stiffness over many postures; write a table, a map.

    The table has an entry with a status for each posture and each lower bound of the tensions.

    Exit code 0; 3 if no entry has the status ok, or the map is empty.
    """
    if out is None and figure is None and store is None:
        raise misuse("--out", "give --out, --figure or --store: where the answer goes.")
    from cdsm.support.status import status_names
    from cdsm.sweeps.files import write_sweep
    from cdsm.sweeps.quantities import DEFAULT

    robot = options.read(arm, changes)
    low = options.numbers("--minimum", minimum)
    names = [*DEFAULT] if outputs is None else [name.strip() for name in outputs.split(",")]
    if figure is not None:
        names = [*dict.fromkeys([*names, "tip_position", quantity])]
    dataset = cdsm.sweep(
        robot,
        _postures(robot, grid, path, random),
        minimum=low[0] if len(low) == 1 else low,
        maximum=maximum,
        wrench=options.load_at_tip(robot, load),
        outputs=names,
        store=store,
    )
    head, numbers = header(robot, low)
    written = [] if out is None else [str(write_sweep(dataset, out))]
    status = dataset["status"].values
    counts = {word: int((status == value).sum()) for value, word in status_names(dataset).items()}
    listed = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    lines = [f"{dataset.attrs['title']}, {dataset.attrs['poses']}: {listed}"]
    warnings, entries = [], sum(counts.values())
    if not counts.get("ok"):
        warnings.append(f"no posture could be evaluated: {listed}")
    if figure is not None:
        write_picture(figure, lambda: cdsm.plots.plot_map(dataset, quantity))
        if bool(dataset[quantity].isnull().all()):
            warnings.append(f"{quantity} exists at none of {entries} entries")
    lines += [f"written: {each}" for each in written]
    told: Json = {"entries": counts, "written": written}
    return answer(as_json, numbers | told, head, "\n".join(lines), warnings=warnings)


def _postures(
    arm: cdsm.Manipulator, grid: str | None, path: Path | None, random: int | None
) -> PoseSet | Array:
    """Build the set of postures from the one option that is given."""
    if sum(given is not None for given in (grid, path, random)) != 1:
        raise misuse("--grid, --path, --random", "give one of them.")
    if grid is not None:
        return _grid(grid, arm)
    if path is not None:
        from cdsm.cli.path_file import read_path

        file = read_path(path, arm)
        if file.angles is None or file.target is not None:
            raise cdsm.FileError(path, "has tips or targets; a sweep needs joint angles.")
        return cdsm.PathPoses(file.angles)
    return cdsm.RandomPoses(random or 0)


def _grid(text: str, arm: cdsm.Manipulator) -> cdsm.GridPoses:
    """Read --grid, such as ``joint1=-20:20:9,joint2=5``, in degrees (prismatic joints: mm)."""
    import numpy as np

    units = dict(zip(arm.joint_names, options.joint_scales(arm).tolist(), strict=True))
    angles: dict[str, Array] = {}
    rest: dict[str, float] = {}
    form = "JOINT=LOW:HIGH:N or JOINT=ANGLE"
    for name, value in options.by_joint("--grid", text, arm, form).items():
        given = options.numbers("--grid", value.replace(":", ","), (1, 3), form)
        if len(given) == 1:
            rest[name] = units[name] * given[0]
            continue
        low, high, count = given
        if not (count >= 2.0 and count.is_integer() and low != high):
            raise misuse("--grid", f"{name}={value}: give LOW:HIGH:N with 2 or more angles.")
        angles[name] = units[name] * np.linspace(low, high, int(count))
    if not angles:
        raise misuse("--grid", "has no joint with several angles, JOINT=LOW:HIGH:N.")
    return cdsm.GridPoses(angles, rest)

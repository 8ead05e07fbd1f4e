"""``cdsm sweep``: the stiffness over many postures, or over the tension at one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import cdsm
from cdsm.cli import options
from cdsm.cli.options import file_opt, opt
from cdsm.cli.output import Json, answer, header, misuse, write_picture

if TYPE_CHECKING:
    import xarray

    from cdsm.support.values import Array
    from cdsm.sweeps.entries import Entries
    from cdsm.sweeps.poses import PoseSet


_MINIMA = "Lower bounds of all tensions [N], a case each; with --angles, points of the curve."
_COLOUR = "Colour of the workspace in --figure, default softest; with --angles, the curve: along."
_GRID = "Grid of joint angles [deg, or mm where they slide]: first, last and number, or one angle; "
_GRID += "other joints stay at 0."
_PLANE = "Tips that fill a plane, for a map of the workspace: axis, place and distance of tips "
_PLANE += "[mm]; without one, a twentieth of the arm's length."
_ALONG = "Direction of along and payload, such as -y; default: x, y and z."
_WORST = "Keep all segments within the bounds, whatever loads came before."
_DIAMETER = "Of all cables, for clearances; default: that of a wire of the catalogue."


def _outputs() -> str:
    """Return the help of --outputs, when it is asked for."""
    from cdsm.quantities import names_of  # slow to import

    return f"Quantities of the table: {', '.join(names_of('sweep'))}."


def sweep_postures(
    arm: options.ArmArgument,
    out: Annotated[Path | None, file_opt("Table to write, SI.", "FILE.nc|csv", "--out")] = None,
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    grid: Annotated[str | None, opt(_GRID, "JOINT=LOW:HIGH:N,...")] = None,
    path: Annotated[Path | None, opt(options.OF_SWEEP, "PATH.csv")] = None,
    plane: Annotated[str | None, opt(_PLANE, "AXIS=PLACE[:STEP]")] = None,
    random: Annotated[int | None, opt("Sobol points within the joint limits.", "N", min=1)] = None,
    minimum: Annotated[str, opt(_MINIMA, "N,...")] = "0",
    maximum: options.MaximumOption = math.inf,
    load: options.LoadOption = None,
    direction: Annotated[str | None, opt(_ALONG, "AXIS|X,Y,Z")] = None,
    worst_friction: Annotated[bool, opt(_WORST, None, "--worst-friction")] = False,
    diameter: Annotated[float | None, opt(_DIAMETER, "MM", min=0.0)] = None,
    outputs: Annotated[str | None, opt(_outputs(), "NAME,...")] = None,
    store: Annotated[
        Path | None, opt("Keeps what is done; a stopped sweep resumes.", "FOLDER")
    ] = None,
    figure: options.FigureOption = None,
    quantity: Annotated[str | None, opt(_COLOUR, "NAME")] = None,
    as_json: options.JsonOption = False,
) -> int:
    """Compute the stiffness over many postures, or over the tension at one; write a table, a map.

    The table has an entry with a status for each posture and each lower bound of the tensions. The
    text has quantiles, and says why postures have no stiffness. With --angles and several lower
    bounds, it is the stiffness over the tension, and --figure draws the curve.

    Exit code 0; 3 if no entry has the status ok, or the map is empty.
    """
    from cdsm.cable import largest_share
    from cdsm.loads import loads_of
    from cdsm.support.status import status_names
    from cdsm.support.validation import XYZ
    from cdsm.sweeps.cases import DEFAULT
    from cdsm.sweeps.entries import Entries
    from cdsm.sweeps.files import write_sweep
    from cdsm.sweeps.poses import joint_angles
    from cdsm.sweeps.store import read_into_memory

    low = options.parse_numbers("--minimum", minimum)
    at_one = angles is not None
    if out is None and figure is None and store is None and not at_one:
        raise misuse("--out", "give --out, --figure or --store: where the answer goes.")
    if figure is None and quantity is not None:
        raise misuse("--quantity", "is of --figure; give both.")
    if at_one and figure is not None and len(low) < 2:
        raise misuse("--minimum", "a curve over the tension needs several, such as 5,10,20,40.")
    shown = quantity or ("along" if at_one else "softest")
    robot = options.load_arm(arm, changes)
    names = [*DEFAULT] if outputs is None else [name.strip() for name in outputs.split(",")]
    if figure is not None:
        names = [*dict.fromkeys([*names, *(() if at_one else ("tip_position",)), shown])]
    postures = _postures(robot, angles, grid, path, plane, random)
    wrench = loads_of(robot, options.loads_on(robot, load))
    dataset = cdsm.sweep(
        robot,
        postures,
        minimum=low[0] if len(low) == 1 and not at_one else low,
        maximum=maximum,
        wrench=wrench,
        direction=XYZ if direction is None else options.parse_direction(direction),
        outputs=names,
        worst_friction=worst_friction,
        diameter=_diameter(robot, diameter, names),
        store=store,
    )
    if store is not None and (out or figure):
        read_into_memory(dataset, store)
    head, numbers = header(robot, low)
    written = [] if out is None else [str(write_sweep(dataset, out))]
    status = dataset["status"].values
    counts = {word: int((status == value).sum()) for value, word in status_names(dataset).items()}
    listed = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    lines = [f"{dataset.attrs['title']}, {dataset.attrs['poses']}: {listed}"]
    warnings = []
    entries = sum(counts.values())
    if not counts.get("ok"):
        warnings.append(f"no posture could be evaluated: {listed}")
    if "tension" in dataset and (share := largest_share(robot.cables, dataset["tension"].values)):
        lines.append(share)
        numbers |= {"largest_share_of_breaking_force": share}
    statistics, told = _statistics(dataset, at_one)
    numbers |= statistics
    lines += told
    causes: Json = {}
    status = status.reshape(-1, len(low))
    if len(status) <= _EXPLAINED:
        q = dataset["q"].values if plane is not None else joint_angles(robot, postures)
        of_all = robot, q.reshape(-1, robot.nv)
        bounds = zip(status.T, low, strict=True)
        causes, told = _causes(
            [Entries(*of_all, at, least, maximum, wrench, worst_friction) for at, least in bounds]
        )
        lines += told
    if figure is not None:
        draw = cdsm.plots.plot_tension_curve if at_one else cdsm.plots.plot_map
        write_picture(figure, lambda: draw(dataset, shown))
        if bool(dataset[shown].isnull().all()):
            warnings.append(f"{shown} exists at none of {entries} entries")
    lines += [f"written: {file}" for file in written]
    results: Json = {"entries": counts, "written": written} | causes
    return answer(as_json, numbers | results, head, "\n".join(lines), warnings=warnings)


def _statistics(dataset: xarray.Dataset, at_one: bool) -> tuple[Json, list[str]]:
    """Return numbers and lines: the curve at one posture, or quantiles over many."""
    from cdsm.sweeps.summary import curve, curve_lines, quantile_lines, quantiles

    if at_one:
        at_posture = dataset.isel(pose=0)
        return {"curve": curve(at_posture)}, curve_lines(at_posture)
    return {"quantiles": quantiles(dataset)}, quantile_lines(dataset)


def _causes(entries: Sequence[Entries]) -> tuple[Json, list[str]]:
    """Explain why entries have no stiffness, in numbers and lines; ``entries``: of each bound."""
    from cdsm.sweeps.failing import explain_outside, explain_unstable
    from cdsm.sweeps.infeasible import explain_infeasible

    explanations = {
        cdsm.Status.INFEASIBLE: explain_infeasible,
        cdsm.Status.OUTSIDE_ELASTICITY: explain_outside,
        cdsm.Status.UNSTABLE: explain_unstable,
    }
    causes: Json = {}
    lines = []
    for cause, explain in explanations.items():
        if cause == cdsm.Status.INFEASIBLE:
            chosen = min(entries, key=lambda at: at.minimum)
        else:  # where there are most of such postures
            chosen = max(entries, key=lambda at: at.count(cause))
        kind = explain(chosen)
        if kind is not None:
            causes[f"{cause.word}_postures"] = kind.to_dict()
            lines.append(f"{kind}" + f" (least tension {chosen.minimum:g} N)" * (len(entries) > 1))
    return causes, lines


def _diameter(arm: cdsm.Manipulator, diameter: float | None, outputs: list[str]) -> float:
    """Return the diameter of the cables [m]: that of --diameter, or of their wire."""
    from cdsm.measures.clearance import KINDS
    from cdsm.wires.catalogue import diameter_of

    if diameter is not None:
        return 1e-3 * diameter
    if not {*KINDS} & {*outputs}:
        return 0.0
    diameters = {diameter_of(cable.elasticity) for cable in arm.cables}
    (known,) = diameters if len(diameters) == 1 else (None,)
    if known is None:
        problem = "clearances need it, since the wires of the cables have no common one that is"
        raise misuse("--diameter", f"{problem} known; give the diameter of the cables [mm].")
    return known


_EXPLAINED = 2**20  # most postures whose status is explained


def _postures(
    arm: cdsm.Manipulator,
    angles: str | None,
    grid: str | None,
    path: Path | None,
    plane: str | None,
    random: int | None,
) -> PoseSet | Array:
    """Build the set of postures from the one option that is given."""
    if sum(option is not None for option in (angles, grid, path, plane, random)) != 1:
        remedy = "give one of them; --plane x=200 is a map of the workspace."
        raise misuse("--angles, --grid, --path, --plane, --random", remedy)
    if plane is not None:
        return _plane(plane)
    if angles is not None:
        return options.joint_coordinates(angles, arm)[None]
    if grid is not None:
        return _grid(grid, arm)
    if path is not None:
        motion = options.read_path(path, arm, target=False)
        q = motion.angles
        if q is None:
            q = _angles_of_tips(arm, motion.tips, path)
        return cdsm.PathPoses(q) if len(q) > 1 else q
    return cdsm.RandomPoses(random or 0)


def _angles_of_tips(arm: cdsm.Manipulator, tips: Array | None, path: Path) -> Array:
    """Return joint angles (S, nv) at tip positions (S, 3) [m], each nearest to those before."""
    import numpy as np

    angles: list[Array] = []
    for k, tip in enumerate(() if tips is None else tips):
        solution = cdsm.inverse_kinematics(arm, tip, angles[-1] if angles else None)
        if not solution.reachable:
            place = ", ".join(f"{1e3 * value:.4g}" for value in tip)
            nearest = f"the tip comes no nearer than {1e3 * solution.position_error:.3g} mm"
            stops = f" ({', '.join(solution.at_limit)} at limit)" if solution.at_limit else ""
            problem = f"sample {k + 1}: ({place}) mm is out of reach, {nearest}{stops}."
            raise cdsm.FileError(path, problem)
        angles.append(solution.angles)
    return np.array(angles)


def _plane(text: str) -> cdsm.PlanePoses:
    """Read --plane, such as ``x=200`` or ``x=200:5``, in mm."""
    axis, _, places = text.partition("=")
    try:
        position, *step = (1e-3 * float(number) for number in places.split(":"))
    except ValueError:
        position, step = math.nan, []
    if axis.strip() not in ("x", "y", "z") or not math.isfinite(position) or len(step) > 1:
        problem = f"{text!r} given; an axis and its place in mm are needed, such as x=200, and the "
        raise misuse("--plane", f"{problem}distance of tips after a colon, such as x=200:5.")
    return cdsm.PlanePoses(axis.strip(), position, *step)


def _grid(text: str, arm: cdsm.Manipulator) -> cdsm.GridPoses:
    """Read --grid, such as ``joint1=-20:20:9,joint2=5``, in degrees (prismatic joints: mm)."""
    import numpy as np

    units = dict(zip(arm.joint_names, options.joint_scales(arm).tolist(), strict=True))
    angles: dict[str, Array] = {}
    rest: dict[str, float] = {}
    form = "JOINT=LOW:HIGH:N or JOINT=ANGLE"
    for name, value in options.by_joint("--grid", text, arm, form).items():
        numbers = options.parse_numbers("--grid", value.replace(":", ","), (1, 3), form)
        if len(numbers) == 1:
            rest[name] = units[name] * numbers[0]
            continue
        low, high, count = numbers
        if not (2.0 <= count <= 1e6 and count.is_integer() and low != high):
            raise misuse("--grid", f"{name}={value}: give LOW:HIGH:N with 2 to 10^6 angles.")
        angles[name] = units[name] * np.linspace(low, high, int(count))
    if not angles:
        raise misuse("--grid", "has no joint with several angles, JOINT=LOW:HIGH:N.")
    return cdsm.GridPoses(angles, rest)

"""``cdsm urdf | stiffness | check | export``: compute the stiffness of an arm; write its files."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import cdsm
from cdsm.cli.files import file_option, out_option
from cdsm.cli.options import (
    Angles,
    ArmOptions,
    AsJson,
    LoadOptions,
    TensionOptions,
    directions,
)
from cdsm.cli.output import Json, answer, by_cable, write
from cdsm.cli.values import direction_of, misuse

if TYPE_CHECKING:
    from cdsm.support.directions import Direction

_Given = Annotated[
    Path | None,
    typer.Option(
        "--tolerances",
        metavar="T.toml",
        help="Tolerances for the uncertainty of the stiffness; all those in ARM.toml are replaced.",
    ),
]

_ALONG: dict[str, Direction] = {"x": "x", "y": "y", "z": "z"}
"""Directions by name; every answer has the stiffness along them."""


def urdf(
    geometry: Annotated[
        Path, typer.Argument(metavar="ARM.toml", help="File with the geometry of the arm.")
    ],
    out: Annotated[
        Path, out_option(endings=(".urdf",), metavar="FILE.urdf", help="URDF file to write.")
    ],
    as_json: AsJson = False,
) -> None:
    """Write the URDF of an arm, checked by reading it back with two parsers."""
    if geometry.suffix.lower() == ".urdf":
        raise misuse("ARM.toml", f"{geometry} is a URDF already.")
    arm = cdsm.Geometry.read(geometry)
    path = cdsm.write_urdf(arm, out)
    numbers: Json = {"name": arm.name, "length_m": arm.length, "written": [str(path)]}
    answer(as_json, lambda: numbers, f"{arm}\nwritten: {path}")


def stiffness(
    arm: ArmOptions,
    tensions: TensionOptions,
    load: LoadOptions,
    angles: Angles = "0",
    direction: Annotated[
        str | None,
        typer.Option(
            help="One more direction for the stiffness: an axis such as -y, or a vector.",
            metavar="AXIS|X,Y,Z",
            autocompletion=directions,
        ),
    ] = None,
    tolerances: _Given = None,
    as_json: AsJson = False,
) -> None:
    """Compute the least tensions that balance the arm at a posture, and the stiffness under them.

    Exit code 0; 3 if the arm is unstable.
    """
    pose = arm.at(angles)
    tension = tensions.distribute(pose, load.at_tip(pose.arm))
    K = cdsm.stiffness(pose, tension)
    parts: list[object] = [tensions.conditions(pose), tension, K]
    more: Json = {}
    along = _ALONG
    if direction is not None:
        along = along | {direction: (u := direction_of(direction))}
        more = {"direction": u, "along_direction_N_per_m": K.along(u)}
        parts += [f"along {direction}: {K.along(u) / 1000.0:.4g} N/mm"]
    lines, stuck = _sticking(_breakaways(tension, along), along)
    tables, sure = _uncertainty(tension, tolerances, along)
    numbers = more | stuck | sure
    parts += [*lines, *tables]
    answer(as_json, lambda: K.to_dict() | numbers, *parts, warnings=K.warnings[:1])


def _breakaways(tension: cdsm.Tension, along: Mapping[str, Direction]) -> dict[str, cdsm.Breakaway]:
    """Compute the load in each direction of ``along`` at which a cable begins to slide in a hole.

    The result is by name of the direction, and empty if the arm has no friction. A direction has
    no entry in these cases: a cable slides already without a load; none slides at any load; the
    stuck arm is about to buckle; or a tension is outside the domain of its law.
    """
    found = {}
    if tension.posture.arm.has_friction:
        for name, u in along.items():
            with contextlib.suppress(cdsm.CdsmError):
                first = cdsm.breakaway(tension.posture, tension, u)
                if 0.0 < first.load < math.inf:
                    found[name] = first
    return found


def _sticking(
    breakaways: dict[str, cdsm.Breakaway], along: Mapping[str, Direction]
) -> tuple[list[str], Json]:
    """Return the stiffness under small loads, while all cables stick, and the breakaway loads.

    The result is a text, in a list, and the JSON, with both numbers for each direction.
    ``breakaways`` is the result of :func:`_breakaways`; if it is empty, so are text and JSON.
    """
    from cdsm.stiffness_matrix.prints import model_of

    if not breakaways:
        return [], {}
    stuck = {name: each.stiffness.along(along[name]) for name, each in breakaways.items()}
    lines = [
        f"along {name} {stuck[name] / 1000.0:.4g} N/mm below {each.load:.4g} N"
        for name, each in breakaways.items()
    ]
    numbers = {
        name: {"stuck_N_per_m": stuck[name], "breakaway_N": each.load}
        for name, each in breakaways.items()
    }
    K = next(iter(breakaways.values())).stiffness
    head = f"small loads measure ({model_of(K)}):"
    return ["\n".join([head, *lines])], {"sticking": numbers}


def _uncertainty(
    tension: cdsm.Tension, tolerances: Path | None, along: Mapping[str, Direction] = _ALONG
) -> tuple[list[str], Json]:
    """Compute the uncertainty of the stiffness in each direction of ``along``.

    Return a table, as a list of one text, and the JSON. The tolerances are those in the file
    ``tolerances``, or else those of the arm; without any, table and JSON are empty. A direction in
    which the tip cannot move is left out.
    """
    pose, found = tension.posture, {}
    given = pose.arm.tolerances if tolerances is None else cdsm.Tolerances.read(tolerances)
    for name, u in along.items() if given.given else ():
        with contextlib.suppress(cdsm.SingularStiffness):
            found[name] = cdsm.uncertainty(pose, tension, given, direction=u)
    if not found:
        return [], {}
    return [_table(found)], {"uncertainty": {name: each.to_dict() for name, each in found.items()}}


def _table(budgets: dict[str, cdsm.Uncertainty]) -> str:
    """Format budgets as a table with a column for each direction.

    The rows are the stiffness ± its uncertainty, then the share of each source in it [%].
    """
    from cdsm.support.format import aligned

    def percent(source: str) -> list[float]:
        return [100.0 * b.contributions[source] / abs(b.value) for b in budgets.values()]

    sources = {source for budget in budgets.values() for source in budget.contributions}
    ranked = sorted(sources, key=lambda source: -max(percent(source)))
    rows = [
        ("uncertainty [N/mm]", *budgets),
        ("along", *(budget.shown for budget in budgets.values())),
        *(
            (f"  of it {source.replace('_', ' ')}", *(f"{part:.2g} %" for part in percent(source)))
            for source in ranked
        ),
    ]
    remarks = (f"along {axis}: {each}" for axis, b in budgets.items() for each in b.warnings)
    return "\n".join([*aligned(rows), *remarks])


def check(
    arm: ArmOptions,
    tensions: TensionOptions,
    load: LoadOptions,
    angles: Angles = "0",
    out: Annotated[
        Path | None,
        out_option(
            endings=(".html", ".htm"), metavar="FILE.html", help="Also write the report as a page."
        ),
    ] = None,
    tolerances: _Given = None,
    as_json: AsJson = False,
) -> None:
    """Check a stiffness: is it right, balanced and stable, and how to read it.

    Exit code 0: it passes; 3: it fails, and the report says why.
    """
    from cdsm.support.files import write_text

    pose = arm.at(angles)
    tension = tensions.distribute(pose, load.at_tip(pose.arm))
    report = cdsm.stiffness(pose, tension).report()
    conditions = tensions.conditions(pose)
    about = f"{arm.arm}\n{conditions}\ncdsm {cdsm.__version__}"
    write(out, lambda file: write_text(file, report.to_html(about)))
    warnings = () if report.passed else ("FAIL: the report says why.",)
    tables, sure = _uncertainty(tension, tolerances)
    parts = [conditions, report, *tables]
    answer(as_json, lambda: report.to_dict() | sure, *parts, warnings=warnings)


def export(
    arm: ArmOptions,
    tensions: TensionOptions,
    load: LoadOptions,
    out: Annotated[
        Path | None,
        out_option(
            endings=(".xml",),
            metavar="FILE.xml",
            help="MuJoCo model to write, its cables under tension.",
        ),
    ] = None,
    cables_out: Annotated[
        Path | None,
        file_option(endings=(".toml",), metavar="FILE.toml", help="File to write the cables to."),
    ] = None,
    angles: Angles = "0",
    actuators: Annotated[
        Literal["length", "tension", "none"],
        typer.Option(help="What the motors of the MuJoCo model control; none: no motors."),
    ] = "length",
    damping_ratio: Annotated[
        float | None,
        typer.Option(help="Cables damp; damping ratio of the least damped mode. Default 0.05."),
    ] = None,
    damping: Annotated[
        float | None,
        typer.Option(help="Damping of each joint [N m s/rad], instead of damping by the cables."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write an arm for other programs: a MuJoCo model at a posture, or a file of its cables.

    The answer states the time step, the damping and the actuators of the model.

    Exit code 0; 3 if the arm of the MuJoCo model is unstable: it is written all the same.
    """
    if out is None and cables_out is None:
        raise misuse("--out", "give --out, --cables-out or both.")
    pose = arm.at(angles)
    numbers: Json = {"name": pose.arm.name}
    conditions = tensions.conditions(pose)
    lines, files = [str(conditions)], []
    warnings: list[str] = []
    if out is not None:
        from cdsm.interchange.mjcf import mujoco_model
        from cdsm.support.files import write_text
        from cdsm.support.format import JointUnits, key

        tension = tensions.distribute(pose, load.at_tip(pose.arm))
        model = mujoco_model(pose.arm, pose, tension, actuators, damping_ratio, damping)
        unit = JointUnits(pose.arm.slides).joined("N m s/rad", "N s/m")
        numbers |= {
            "stable": model.unstable is None,
            "time_step_s": model.time_step,
            "cable_damping_N_s_per_m": by_cable(pose.arm, model.cable_damping),
            key("joint_damping", unit): model.joint_damping,
            "actuators": model.actuators,
        }
        warnings += filter(None, [model.unstable])
        lines += model.remarks
        files.append(str(write_text(out, model.text)))
    if cables_out is not None:
        files.append(str(cdsm.write_cables(pose.arm.cables, cables_out)))
    lines += [f"written: {path}" for path in files]
    numbers |= conditions.to_dict() | {"written": files}
    answer(as_json, lambda: numbers, "\n".join(lines), warnings=warnings)

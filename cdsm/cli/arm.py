"""``cdsm new | export | view``: a first ARM.toml; an arm for other programs; an arm on screen."""

from __future__ import annotations

import contextlib
import math
import os
from pathlib import Path
from typing import Annotated, Literal

import typer

import cdsm
from cdsm.cli import options
from cdsm.cli.options import file_opt, opt
from cdsm.cli.output import Json, answer, header, misuse

JointType = Literal["universal", "hinged", "rolling"]

_JOINTS = (
    "Number of joints, default 4; several: of sections, each a quarter narrower than the last."
)
_TYPE = "Joints: universal; hinges 90 degrees apart; or links whose round ends roll on each other."
_WIRE = "Wire of all cables: a name, a rope such as 7x7-0.8mm (1x7, 1x19, 7x7, 7x19, uhmwpe), a "
_WIRE += "constant EA in N, or a file of `cdsm fit`. Default: "
_WIRE += "1x19-1.2mm; with --from, that of the cables."
_FROM = "A robot, with --cables and --tip; or the folder of a CASPR model, with --wire."
_INERTIA = "Accept moments of inertia that no body can have."


def new(
    arm: Annotated[Path, file_opt("File to write.", "ARM.toml", declare=typer.Argument)],
    joints: Annotated[str | None, opt(_JOINTS, "N[,N,...]")] = None,
    kind: Annotated[JointType, opt(_TYPE, None, "--type")] = "universal",
    wire: Annotated[str | None, opt(_WIRE, "NAME|EA|WIRE.toml")] = None,
    source: Annotated[Path | None, opt(_FROM, "ROBOT.urdf|FOLDER", "--from")] = None,
    cables: Annotated[Path | None, opt("Cables of the robot.", "CABLES.toml")] = None,
    tip: Annotated[str | None, opt("Link of the robot that is the tip.", "LINK")] = None,
    no_check_inertia: Annotated[bool, opt(_INERTIA, None, "--no-check-inertia")] = False,
    overwrite: Annotated[bool, opt("Replace the file.", None, "--overwrite")] = False,
    as_json: options.JsonOption = False,
) -> int:
    """Write a first ARM.toml, with comments.

    Every command reads it; sizes, wire and all else are edited in it. --from makes one of a robot.
    """
    from cdsm.arm_file.arm import template
    from cdsm.support.files import write_text
    from cdsm.wires.catalogue import is_file
    from cdsm.wires.ropes import describe

    if arm.exists() and not overwrite:
        raise misuse("ARM.toml", f"{arm} exists; add --overwrite.")
    if source is not None:
        if joints is not None:
            raise misuse("--joints", "are those of the robot; leave it out.")
        made = _of_robot(source, cables, tip, wire, not no_check_inertia)
        made.write(arm)
    else:
        only = {"--cables": cables, "--tip": tip, "--no-check-inertia": no_check_inertia or None}
        for option, value in only.items():
            if value is not None:
                raise misuse(option, "goes with --from only.")
        counts = _counts("4" if joints is None else joints)
        law = "1x19-1.2mm" if wire is None else wire
        made, parts = _serpentine(kind, counts, _law(law))
        if is_file(law):  # an ARM.toml names files from its own folder
            law = os.path.relpath(law, arm.parent)
        first = max(cable.elasticity.low for cable in made.cables)  # where the law begins
        least = max(10.0, float(f"{1.05 * first:.4g}"))
        write_text(arm, template(arm.name, _number(law), least, parts))
        made = cdsm.Manipulator.read(arm)  # which has the name of its file
    units = options.joint_scales(made)
    low = made.lower / units
    high = made.upper / units
    bent = min([10.0, *(high[~made.slides] / 2.0).tolist()])
    inside = [bent if a <= bent <= b else (a + b) / 2.0 for a, b in zip(low, high, strict=True)]
    asked = ",".join(f"{each:.3g}" for each in (inside[:1] if {*inside} == {bent} else inside))
    about = dict.fromkeys(filter(None, (describe(cable.elasticity) for cable in made.cables)))
    tried = "\n".join([*about, ""]) if about else ""
    tried += f"written: {arm}; try cdsm stiffness {arm} --angles {asked} --check"
    return answer(as_json, _facts(made, arm), made, tried)


def _facts(arm: cdsm.Manipulator, written: Path) -> Json:
    return {"name": arm.name, "length_m": arm.length, "written": [str(written)]}


def _number(wire: str) -> str | float:
    try:
        return float(wire)
    except ValueError:
        return wire


def _law(wire: str) -> cdsm.Elasticity:
    from cdsm.wires.catalogue import as_wire

    return as_wire(_number(wire))


def _counts(text: str) -> list[int]:
    try:
        counts = [int(word) for word in text.split(",")]
    except ValueError:
        counts = []
    if not counts or min(counts) < 1:
        raise misuse("--joints", f"{text!r} given; give a whole number, or several: 4 or 3,3.")
    return counts


def _of_robot(
    source: Path, cables: Path | None, tip: str | None, wire: str | None, check_inertia: bool
) -> cdsm.Manipulator:
    """Read the arm of a URDF, or of the folder of a CASPR model."""
    law = None if wire is None else _law(wire)
    if source.is_dir():
        if cables is not None or tip is not None:
            raise misuse("--cables, --tip", "are those of the CASPR model; leave them out.")
        usual = cdsm.presets.ELASTIC_STAGE
        robot = cdsm.read_caspr(source, elasticity=law or usual, check_inertia=check_inertia)
        if law is None:  # after reading: the folder may hold no model
            raise misuse("--wire", "give it: the cables of CASPR do not stretch.")
        return robot
    if source.suffix.lower() == ".toml":
        raise misuse("--from", f"{source} is no robot; an ARM.toml can be copied.")
    if cables is None or tip is None:
        raise misuse("--cables, --tip", f"give both: {source} does not say what they are.")
    routed = cdsm.read_cables(cables, law)
    return cdsm.Manipulator.from_urdf(source, routed, tip=tip, check_inertia=check_inertia)


def _serpentine(
    kind: str, counts: list[int], law: cdsm.Elasticity
) -> tuple[cdsm.Manipulator, list[tuple[str, dict[str, float]]]]:
    """Build an arm of sections with these numbers of joints; return it with the sizes of each."""
    from cdsm.arm_file.arm import HELD

    hinged = kind != "universal"
    parts = []
    for i, count in enumerate(counts):
        each = 2 if hinged else 3
        sizes = {"joints": count} | ({"twist": math.pi / 2.0} if hinged else {})
        sizes |= {"cables_per_joint": each, "link_length": 0.06, "base_length": 0.0 if i else 0.03}
        radius = round(0.025 * 0.75**i, 6)
        sizes |= {"disk_offset": 0.012, "hole_radius": radius, "link_mass": 0.12, "lead": 0.3}
        if kind == "rolling":  # holes on the rim, 53 degrees from the line of centres
            round_end = round(0.025 * 0.75**i, 6)
            sizes |= {"radius": round_end, "hole_radius": round(0.8 * round_end, 6)}
            sizes |= {"disk_offset": round(0.4 * round_end, 6)}
        if hinged:  # 10 degrees, or less: holes of one plane must not reach those of the next
            sizes["spread"] = min(math.radians(10.0), math.tau / (count * each))
        if i:  # between the holes of all sections, wherever those are
            sizes["phase"] = math.tau / math.lcm(*counts) / each * i / len(counts)
        build = getattr(cdsm.Geometry, kind)
        touching = math.floor(1e3 * min(build(**sizes).joint_limits)) / 1e3
        sizes["joint_limit"] = touching if hinged else min(HELD, touching)
        parts.append((kind, sizes))
    built = [getattr(cdsm.Geometry, kind)(**sizes) for _, sizes in parts]
    return cdsm.Manipulator(cdsm.Geometry.sections(built), law), parts


def export(
    arm: options.ArmArgument,
    out: Annotated[
        Path,
        file_opt("URDF, or MuJoCo model under tension.", "OUT.urdf|xml", declare=typer.Argument),
    ],
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    minimum: options.MinimumOption = 0.0,
    actuators: Annotated[
        Literal["length", "tension", "none"], opt("What motors of a MuJoCo model control.")
    ] = "length",
    as_json: options.JsonOption = False,
) -> int:
    """Write the URDF of an arm, or a MuJoCo model at a posture.

    The answer states the time step, the damping and the actuators of the MuJoCo model.

    Exit code 0; 3 if the arm of the MuJoCo model is unstable: it is written all the same.
    """
    from cdsm.support.files import write_text

    if out.suffix.lower() == ".urdf":  # it has no cables: any wire does
        if (angles, minimum, actuators) != (None, 0.0, "length"):
            raise misuse("--angles, --minimum, --actuators", "are those of a MuJoCo model (.xml).")
        robot = cdsm.Manipulator.read(arm, 1e5, changes=options.changes_of(changes))
        write_text(out, robot.urdf)
        return answer(as_json, _facts(robot, out), robot, f"written: {out}")
    from cdsm.interchange.mjcf import mujoco_model
    from cdsm.support.format import JointUnits, key

    pose = options.posture(arm, changes, angles)
    robot = pose.arm
    model = mujoco_model(robot, pose, cdsm.distribute_tension(pose, minimum), actuators)
    write_text(out, model.text)
    unit = JointUnits(robot.slides).joined("N m s/rad", "N s/m")
    wires = dict(zip(robot.cables.names, model.cable_damping.tolist(), strict=True))
    head, numbers = header(pose, [minimum])
    numbers |= {"stable": model.unstable is None, "time_step_s": model.time_step}
    numbers |= {"cable_damping_N_s_per_m": wires, key("joint_damping", unit): model.joint_damping}
    numbers |= {"actuators": model.actuators}
    warnings = [] if model.unstable is None else [model.unstable]
    lines = "\n".join([*model.remarks, f"written: {out}"])
    return answer(as_json, numbers | _facts(robot, out), head, lines, warnings=warnings)


def view(
    arm: options.ArmArgument,
    changes: options.SetOption = None,
    angles: options.AnglesOption = None,
    path: options.PathOption = None,
    minimum: options.MinimumOption = 0.0,
    load: options.LoadOption = None,
    port: Annotated[int, opt("Port to listen at, default 8080; 0 for any.", "N")] = 8080,
    as_json: options.JsonOption = False,
) -> int:
    """Show an arm in the browser, with sliders, and its stiffness."""
    import numpy as np

    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C ends the view, also while it starts
        robot = options.load_arm(arm, changes)
        start = None if angles is None else options.joint_coordinates(angles, robot)
        loads = {link: W for link, W in options.loads_on(robot, load).items() if W.any()}
        if len(loads) > 1:
            raise misuse("--load", f"acts on {' and '.join(loads)}, but the view has one force.")
        link, force = next(iter(loads.items()), (robot.tip_link, np.zeros(6)))
        if force[3:].any():
            raise misuse("--load", "has a moment, but the view has forces only: FX,FY,FZ.")
        motion = options.Motion() if path is None else options.read_path(path, robot)
        with cdsm.view.serve(
            robot,
            port=port,
            q=start,
            minimum=minimum,
            maximum=math.inf,
            force=force[:3],
            link=None if link == robot.tip_link else link,
            angles=motion.angles,
            tips=motion.tips,
            file=arm,
            changes=options.changes_of(changes),
        ) as page:
            head, numbers = header(robot, [minimum], "included")
            facts: Json = {"name": robot.name, "url": page.url}
            answer(as_json, numbers | facts, head, f"shown at {page.url}; Ctrl-C ends it")
            page.wait()
    return 0

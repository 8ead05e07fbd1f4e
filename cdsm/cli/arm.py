"""``cdsm urdf | stiffness | check | export``: stiffness of an arm, and files of an arm."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import cdsm
from cdsm.cli.options import Angles, ArmOptions, AsJson, TensionOptions
from cdsm.cli.output import UNMET, Json, answer, by_cable, joints

if TYPE_CHECKING:
    from cdsm.support.values import Array


def urdf(
    geometry: Annotated[Path, typer.Argument(metavar="ARM.toml", help="Geometry to read.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="URDF file to write.")],
    as_json: AsJson = False,
) -> None:
    """Write the URDF of an arm, checked by reading it back with two parsers."""
    arm = cdsm.Geometry.read(geometry)
    path = cdsm.write_urdf(arm, output)
    numbers: Json = {"name": arm.name, "length_m": arm.length, "written": [str(path)]}
    answer(as_json, lambda: numbers, f"{arm}\nwritten: {path}")


def stiffness(
    arm: ArmOptions, tensions: TensionOptions, angles: Angles = "0", as_json: AsJson = False
) -> None:
    """Distribute the tensions at a posture, and print them and the stiffness."""
    pose = arm.at(angles)
    tension = tensions.distribute(pose)
    K = cdsm.stiffness(pose, tension)
    answer(as_json, lambda: _numbers(tension, K), tensions.conditions(pose.arm), tension, K)


def _numbers(tension: cdsm.Tension, K: cdsm.Stiffness) -> Json:
    from cdsm.support.format import MODEL, key

    def matrix(read: Callable[[], Array]) -> Array | None:
        try:
            return read()
        except cdsm.SingularStiffness:
            return None

    pose, arm = tension.posture, tension.posture.arm
    return {
        **joints(arm, pose.q),
        "tip_position_m": pose.tip[:3, 3],
        "tension_N": by_cable(arm, tension.values),
        "cable_length_m": pose.cable_lengths,
        key("static_residual", arm.torque_unit()): K.residual,
        "model": MODEL,
        "along_N_per_m": [K.along(axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))],
        "cartesian_N_per_m": matrix(lambda: K.cartesian),
        "pseudoinverse_N_per_m": matrix(K.pseudoinverse),
        "compliance": matrix(lambda: K.compliance),
        key("joint_stiffness", arm.stiffness_unit()): K.joint,
        key("margin", arm.stiffness_unit()): K.margin,
        "stable": K.is_stable,
    }


def check(
    arm: ArmOptions,
    tensions: TensionOptions,
    angles: Angles = "0",
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE.html", help="Write it as a page too.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check a stiffness: derive it anew by differences, and report all that speaks against it.

    The options are those of `cdsm stiffness`.
    Exit code 0: it can be trusted; 3: it cannot, and the report says why.
    """
    pose = arm.at(angles)
    report = cdsm.stiffness(pose, tensions.distribute(pose)).report()
    if html is not None:
        from cdsm.support.files import write_text

        typer.echo(f"written: {write_text(html, report.to_html())}", err=True)
    answer(as_json, report.to_dict, tensions.conditions(pose.arm), report)
    if not report.trustworthy:
        raise typer.Exit(UNMET)


def export(
    arm: ArmOptions,
    tensions: TensionOptions,
    mjcf: Annotated[
        Path | None, typer.Option(metavar="FILE.xml", help="MuJoCo model, its cables pulled.")
    ] = None,
    cables_out: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="File of its cables to write.")
    ] = None,
    angles: Angles = "0",
    actuators: Annotated[
        str,
        typer.Option(help="Of the MuJoCo model: length (locked motors), tension, or none."),
    ] = "length",
    damping_ratio: Annotated[
        float | None,
        typer.Option(help="Of its least damped mode, by its cables; 0.05 if left out."),
    ] = None,
    damping: Annotated[
        float | None, typer.Option(help="Of each of its joints instead [N m s/rad].")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write an arm for other programs: a MuJoCo model at a posture, or a file of its cables.

    The answer states the time step, the damping and the actuators of the model.

    Exit code 0; 3 if the arm of the MuJoCo model is unstable: it is written all the same.
    """
    if mjcf is None and cables_out is None:
        raise typer.BadParameter("give --mjcf, --cables-out or both.", param_hint="--mjcf")
    pose = arm.at(angles)
    numbers: Json = {"name": pose.arm.name}
    conditions = tensions.conditions(pose.arm)
    lines, written = [str(conditions)], []
    if mjcf is not None:
        from cdsm.interchange.mjcf import mujoco_model
        from cdsm.support.files import write_text
        from cdsm.support.format import JointUnits, key

        tension = tensions.distribute(pose)
        model = mujoco_model(pose.arm, pose, tension, actuators, damping_ratio, damping)
        motion, unit = model.motion, JointUnits(pose.arm.slides).joined("N m s/rad", "N s/m")
        numbers |= {
            "stable": model.unstable is None,
            "time_step_s": motion.time_step,
            "cable_damping_N_s_per_m": by_cable(pose.arm, motion.wires),
            key("joint_damping", unit): motion.joints,
            "actuators": model.actuators,
        }
        lines = [*filter(None, [model.unstable]), *lines, *model.remarks]
        written.append(str(write_text(mjcf, model.text)))
    if cables_out is not None:
        written.append(str(cdsm.write_cables(pose.arm.cables, cables_out)))
    lines += [f"written: {path}" for path in written]
    numbers |= conditions.to_dict() | {"written": written}
    answer(as_json, lambda: numbers, "\n".join(lines))
    if numbers.get("stable") is False:
        raise typer.Exit(UNMET)

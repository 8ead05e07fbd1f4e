"""``cdsm urdf`` and ``cdsm stiffness``: an arm, and how stiff it is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from cdsm.cli.options import (
    Angles,
    ArmOptions,
    AsJson,
    TensionOptions,
    reported,
    show_json,
)
from cdsm.errors import SingularStiffness
from cdsm.geometry import Geometry
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix import stiffness as evaluate
from cdsm.support.units import MODEL, joints_to_dict, key
from cdsm.support.validation import Array
from cdsm.tension import Tension
from cdsm.urdf import write_urdf


def urdf(
    geometry: Annotated[Path, typer.Argument(metavar="ARM.toml", help="Geometry to read.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="URDF file to write.")],
    as_json: AsJson = False,
) -> None:
    """Write the URDF of an arm, checked by reading it back with two parsers."""
    with reported():
        arm = Geometry.read(geometry)
        path = write_urdf(arm, output)
        if as_json:
            show_json({"name": arm.name, "length_m": arm.length, "written": [str(path)]})
        else:
            typer.echo(f"{arm}\nwritten: {path}")


def stiffness(
    arm: ArmOptions,
    tensions: TensionOptions,
    angles: Angles = "0",
    as_json: AsJson = False,
) -> None:
    """Distribute the tensions at a posture, and print them and the stiffness."""
    with reported():
        pose = arm.at(angles)
        pull = tensions.distribute(pose)
        K = evaluate(pose, pull)
        if as_json:
            show_json(_to_dict(pull, K))
        else:
            typer.echo(f"{pose.arm}\n\n{pull}\n\n{K}")


def _to_dict(pull: Tension, K: Stiffness) -> dict[str, object]:
    """Everything the table shows, in SI units; null where a stiffness is infinite."""

    def matrix(read: Callable[[], Array]) -> list[list[float]] | None:
        try:
            values: list[list[float]] = read().tolist()
        except SingularStiffness:
            return None
        return values

    pose = pull.posture
    unit = pose.arm.stiffness_unit()
    along = [K.along(axis) for axis in np.eye(3)]
    return {
        **joints_to_dict(pose.arm.joint_names, pose.arm.slides, pose.q),
        "tip_position_m": pose.tip[:3, 3].tolist(),
        "tension_N": {
            cable.name: value
            for cable, value in zip(pose.arm.cables, pull.values.tolist(), strict=True)
        },
        "cable_length_m": pose.cable_lengths.tolist(),
        key("static_residual", pose.arm.torque_unit()): K.residual.tolist(),
        "model": MODEL,
        "along_N_per_m": [value if np.isfinite(value) else None for value in along],
        "cartesian_N_per_m": matrix(lambda: K.cartesian),
        "pseudoinverse_N_per_m": matrix(K.pseudoinverse),
        "compliance": matrix(lambda: K.compliance),
        key("joint_stiffness", unit): K.joint.tolist(),
        key("margin", unit): K.margin,
        "stable": K.is_stable,
    }

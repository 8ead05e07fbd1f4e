"""Save what is shown: the picture as SVG, and lines that compute the same again."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from cdsm.arm_file.source import ArmSource
from cdsm.manipulator import Manipulator
from cdsm.plots.arm import plot_arm
from cdsm.plots.projection import VIEW
from cdsm.plots.style import MM, save_figure
from cdsm.status import Status
from cdsm.support.format import JointUnits
from cdsm.view.state import Setting, Shown

if TYPE_CHECKING:
    import viser


def draw_picture(shown: Shown, view: tuple[float, float] = VIEW) -> bytes | None:
    """Draw the arm as SVG, seen from an elevation and azimuth [deg]; None without a posture."""
    pose = shown.posture
    if pose is None:
        return None
    setting = shown.setting
    force = setting.wrench if setting.link else setting.force
    if shown.rest is not None:
        panel = plot_arm(shown.rest, view=view)
    elif (K := shown.stiffness) is not None:
        panel = plot_arm(pose, shown.tension, K, view=view)
    else:  # an invalid force has no arrow
        none = shown.status is Status.INVALID_INPUT
        panel = plot_arm(pose, shown.tension, view=view, force=None if none else force)
    with TemporaryDirectory() as folder:
        return save_figure(panel, Path(folder) / "arm.svg").read_bytes()


def view_of(camera: viser.CameraHandle) -> tuple[float, float]:
    """Return the elevation and azimuth [deg] from which a browser looks at the arm."""
    x, y, z = np.asarray(camera.position) - camera.look_at
    across = math.hypot(x, y)
    if not 0.0 < math.hypot(across, z) < math.inf:
        return VIEW
    return math.degrees(math.atan2(z, across)), math.degrees(math.atan2(y, x))


def file_name(arm: Manipulator, ending: str) -> str:
    """Return a name of a file for an arm, without signs that a file system refuses."""
    return re.sub(r"[^\w.-]+", "_", arm.name) + ending


def posture_text(
    arm: Manipulator, shown: Shown, source: ArmSource, numbers: Iterable[str] = ()
) -> str:
    """Write a program that computes what is shown; its first lines have the command for it.

    ``numbers`` are the lines that it has to give again.
    """
    head = [f"{arm.name} as it stood in `cdsm view`; {source.remark}"]
    head += [command_text(arm, shown.setting, source), *numbers]
    return "\n".join(
        [
            *(f"# {line}" for text in head for line in text.splitlines()),
            "",
            "import cdsm",
            "",
            f"arm = {source.python}",
            python_text(arm, shown.setting),
            "",
        ]
    )


def command_text(arm: Manipulator, setting: Setting, source: ArmSource) -> str:
    """Write the command that computes the numbers."""
    command = "stiffness"
    parts = list[str]()
    force = setting.force.any()
    if setting.pull is not None:
        parts.append(f"--pull={_joined(MM * setting.pull, ',')}")
    else:
        scales = np.array([size for _, size in JointUnits(arm.slides).shown])
        parts.append(f"--angles={_joined(setting.q / scales, ',')}")
        parts.append(f"--minimum={setting.minimum:.12g}")
        if math.isfinite(setting.maximum):
            parts.append(f"--maximum={setting.maximum:.12g}")
        if setting.sag and force:
            command = "weigh"
    if force:
        at = f"@{setting.link}" if setting.link else ""
        parts.append(shlex.quote(f"--load={_joined(setting.force, ',')}{at}"))
    return " ".join([f"cdsm {command} {source.arguments}", *parts])


def python_text(arm: Manipulator, setting: Setting) -> str:
    """Write the lines of Python that compute the numbers, if the arm has the name ``arm``."""
    wrench = f"[{_joined(setting.force)}, 0, 0, 0]"
    row = f"[{wrench}]"
    if setting.link:
        wrench = f"{{{setting.link!r}: {wrench}}}"
        row = f"{{{setting.link!r}: {row}}}"
    if setting.pull is not None:
        return (
            f"pull = [{_joined(setting.pull)}]\n"
            f"rest = cdsm.forward_statics(arm, pull=pull, wrench={wrench})\nprint(rest)"
        )
    arguments = [f"{setting.minimum:.12g}"]
    arguments += [f"{setting.maximum:.12g}"] if math.isfinite(setting.maximum) else []
    arguments += [f"wrench={wrench}"] if setting.force.any() and not setting.sag else []
    last = "K = cdsm.stiffness(pose, tension)\nprint(K)"
    if setting.sag and arm.has_friction:
        last = f"K = cdsm.load_cycle(pose, tension, {row}).stiffness(-1)\nprint(K)"
    elif setting.sag:
        last = f"rest = cdsm.equilibrium(pose, tension, {wrench})\nprint(rest)"
    return (
        f"pose = arm.at([{_joined(setting.q)}])\n"
        f"tension = cdsm.distribute_tension(pose, {', '.join(arguments)})\n{last}"
    )


def _joined(values: Iterable[float], sign: str = ", ") -> str:
    return sign.join(format(value, "z.12g") for value in values)

"""Write the ``cdsm`` command, or the lines of Python, that compute the numbers on the page."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Sequence
from typing import Final

from cdsm.manipulator import Manipulator
from cdsm.support.format import JointUnits
from cdsm.support.markup import element
from cdsm.tension import DEFAULT_SOLVER
from cdsm.view.state import Setting

_COPY: Final = (
    "getSelection().selectAllChildren(this.parentNode.querySelector('code'));"
    "document.execCommand('copy')"
)
"""JavaScript that copies the command; ``navigator.clipboard`` works only here or with https."""

_SAVE: Final = (
    "const size=one=>one.width*one.height;"
    "const picture=[...document.querySelectorAll('canvas')].sort((a,b)=>size(b)-size(a))[0];"
    "picture.toBlob(blob=>{const link=document.createElement('a');"
    "link.href=window.URL.createObjectURL(blob);"
    "link.download=document.title.split(':')[0]+'.png';"
    "link.click();window.URL.revokeObjectURL(link.href)})"
)
"""JavaScript that saves the scene, which is the largest canvas, as a picture.

It uses ``window.URL``, since in a handler ``URL`` is the address of the page.
"""

_BUTTON: Final = "padding:0.3em 0.8em;margin-right:0.6em;cursor:pointer"
_CODE: Final = "display:block;white-space:pre-wrap;overflow-wrap:anywhere;margin-bottom:0.6em"


def command_line(arm: Manipulator, setting: Setting, arm_arguments: Sequence[str]) -> str:
    """Write the command that computes the numbers: ``cdsm stiffness`` or ``cdsm weigh``.

    ``arm_arguments`` are the arguments of this command that describe the arm.
    """
    weighs, units = setting.sag and bool(setting.force.any()), JointUnits(arm.slides).shown
    options = {
        "angles": _joined(x / unit for x, (_, unit) in zip(setting.q.tolist(), units, strict=True)),
        "minimum": f"{setting.minimum:.12g}",
        "maximum": f"{setting.maximum:.12g}" if math.isfinite(setting.maximum) else "",
        "load": _joined(setting.force.tolist()) if setting.force.any() else "",
    }
    given = [f"--{name}={value}" for name, value in options.items() if value]
    return shlex.join(["cdsm", "weigh" if weighs else "stiffness", *arm_arguments, *given])


def python_lines(arm: Manipulator, setting: Setting) -> str:
    """Write the lines of Python that compute the numbers, if the arm has the name ``arm``."""
    wrench = f"[{_joined(_wrench(setting), ', ')}]"
    bounds = [f"{setting.minimum:.12g}"]
    bounds += [f"{setting.maximum:.12g}"] if math.isfinite(setting.maximum) else []
    load = [] if setting.sag or not setting.force.any() else [f"wrench={wrench}"]
    solver = [] if setting.solver == DEFAULT_SOLVER else [f"solver={setting.solver!r}"]
    if not setting.sag:
        last = "K = cdsm.stiffness(pose, tension)"
    elif arm.has_friction:
        last = f"K = cdsm.load_cycle(pose, tension, [{wrench}]).stiffness(-1)"
    else:
        last = f"rest = cdsm.equilibrium(pose, tension, {wrench})"
    return "\n".join(
        [
            f"pose = arm.at([{_joined(setting.q.tolist(), ', ')}])",
            f"tension = cdsm.distribute_tension({', '.join(['pose', *bounds, *load, *solver])})",
            last,
        ]
    )


def command_text(arm: Manipulator, setting: Setting, arm_arguments: Sequence[str] | None) -> str:
    """Return HTML: the command that computes the numbers of the page, and two buttons.

    Without ``arm_arguments`` it shows lines of Python instead of the command. The buttons copy this
    text and save a picture of the scene.
    """
    if arm_arguments is None:
        where, command = "in Python", python_lines(arm, setting)
    else:
        where, command = "in a shell", command_line(arm, setting, arm_arguments)
    return str(
        element(
            "div",
            element("div", f"The same {where}:", style="color:gray"),
            element("code", command, style=_CODE, data_cdsm="command"),
            element("button", "Copy", style=_BUTTON, onclick=_COPY),
            element("button", "Save picture", style=_BUTTON, onclick=_SAVE),
            style="padding:0 0.8em 0.8em;font-size:0.85em",
        )
    )


def _wrench(setting: Setting) -> list[float]:
    return [*setting.force.tolist(), 0.0, 0.0, 0.0]


def _joined(values: Iterable[float], separator: str = ",") -> str:
    return separator.join(f"{value:z.12g}" for value in values)

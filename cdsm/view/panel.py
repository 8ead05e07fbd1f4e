"""Build the panel of the page: controls that set the arm, and text in mm and N/mm."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, final

import numpy as np

import cdsm
from cdsm.cable import wires_text
from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.measures.indices import principal_stiffness
from cdsm.plots.style import MM, N_PER_MM
from cdsm.status import Status
from cdsm.stiffness_matrix.prints import model_of
from cdsm.support.format import JointUnits, coordinates
from cdsm.support.values import Array
from cdsm.view.scene import ELLIPSOID, FORCE, SLIDES, STICKS, Scene
from cdsm.view.state import Color, Setting, Shown
from cdsm.wires.ropes import breaking_force

if TYPE_CHECKING:
    import viser

_STEPS = 500  # least number of steps of a slider, which is a few hundred pixels long
_TENSION = 200.0  # ends of sliders [N], unless the start is beyond
_FORCE = 20.0
_SAG_SHOWN = 0.05  # displacement at the end of a slider of the force, over the arm's length
_PULLED = 0.1  # most wire that a motor takes in or pays out, over the arm's length
_LENGTHS = 10.0  # largest coordinate of a prismatic joint on its slider, over the arm's length
_ROUND = 1e-9  # largest difference of an end of a slider from a round number, over a step

_SAG: Final = (
    "Tension the cables without the force, lock the motors, then apply the force: the arm moves to "
    "its equilibrium. Otherwise the tensions hold the posture under the force."
)
_GREEN = "#2f855a"
_RED = "#c53030"
_AMBER = "#b7791f"
_GREY = "#718096"
_COLORS: Final = {
    Status.OK: _GREEN,
    Status.UNSTABLE: _RED,
    Status.SINGULAR: _RED,
    Status.UNSTABLE_TO_ONE_SIDE: _RED,
    Status.MOVED: _RED,
    Status.NEUTRAL: _AMBER,
    Status.AT_STOP: _AMBER,
    Status.UNBALANCED: _AMBER,
    Status.ABOVE_MAXIMUM: _AMBER,
}
_DOUBTFUL: Final = (Status.SELF_CONTACT, Status.SLACK)  # of an arm that is held
_BOX: Final = '<div style="height:{};overflow-y:auto;font-size:0.8em">\n\n{}\n\n</div>'
"""Box of fixed height, so that sliders do not move while they are dragged."""


@final
class Panel:
    """Panel of the page: controls that set the arm, and text about the arm.

    The sliders of the force end at ± ``largest_force`` [N]. ``changed`` is called, in any thread,
    when a control has changed.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        arm: Manipulator,
        start: Setting,
        changed: Callable[[], None],
    ) -> None:
        self._gui = gui
        self._arm = arm
        self._start = start
        self._changed = changed
        friction = "friction in its holes where motors are locked" if arm.has_friction else ""
        basis = f"wire {wires_text(arm.cables)}; gravity {coordinates(arm.gravity)} m/s²"
        gui.add_markdown(escaped(f"{arm}; {basis}; {friction or 'frictionless'}"), order=-2.0)
        self._text = gui.add_markdown("", order=-1.0)  # above the path, which has 0
        least = min((cable.minimum for cable in arm.cables), default=0.0)
        most = min([*(cable.maximum for cable in arm.cables), start.maximum])
        most = most if math.isfinite(most) else _TENSION
        applied = max(start.minimum, least)
        push = max(_force_range(arm, start), float(abs(start.force).max()))
        self.largest_force = push
        with gui.add_folder("Load"):
            self._load = [self.add_slider("least tension [N]", least, max(most, applied), applied)]
            for axis, value in zip("xyz", start.force.tolist(), strict=True):
                self._load.append(self.add_slider(f"force {axis} [N]", -push, push, value))
            self._sag = self._add_switch("motors locked", start.sag, _SAG)
        shown = JointUnits(arm.slides).shown
        self._unit = np.array([unit for _, unit in shown])
        self.joints: list[viser.GuiSliderHandle[float]] = []
        self.pulls: list[viser.GuiSliderHandle[float]] = []
        if start.pull is not None:
            self._load[0].visible = self._sag.visible = False
            most = _PULLED * MM * arm.length
            with gui.add_folder("Motors take in"):
                self.pulls = [
                    self.add_slider(f"{name} [mm]", -most, most, MM * taken)
                    for name, taken in zip(arm.cables.names, start.pull.tolist(), strict=True)
                ]
        else:
            self._add_joints(gui, arm, start, shown)
        buttons = gui.add_button_group("all", ("Straight", "Reset"))
        buttons.on_click(self._press)
        with gui.add_folder("Cable tensions"):
            self.names = self._add_switch("show names", False, "Name the cables in the picture.")
            self._tensions = gui.add_markdown("")
        self._python = gui.add_markdown("")

    def _add_joints(
        self, gui: viser.GuiApi, arm: Manipulator, start: Setting, shown: Iterable[tuple[str, Any]]
    ) -> None:
        most = np.where(arm.slides, _LENGTHS * arm.length, 2.0 * math.pi)
        low = np.maximum(arm.lower, -most)
        high = np.minimum(arm.upper, most)
        ends = np.transpose([low, high, start.q] / self._unit).tolist()
        with gui.add_folder("Joints"):
            self.joints = [
                self.add_slider(f"{name} [{unit.replace('deg', '°')}]", *numbers)
                for name, (unit, _), numbers in zip(arm.joint_names, shown, ends, strict=True)
            ]

    @property
    def setting(self) -> Setting:
        """Current values of all controls."""
        if self.pulls:
            pull = np.array([slider.value / MM for slider in self.pulls])
            pushed = np.array([slider.value for slider in self._load[1:]])
            return replace(self._start, pull=pull, force=pushed)
        q = self._unit * [joint.value for joint in self.joints]
        minimum, *force = [slider.value for slider in self._load]
        F = np.array(force)
        sag = self._sag.value
        return replace(self._start, q=q, minimum=minimum, force=F, sag=sag)

    def update(self, shown: Shown, scene: Scene, remark: str) -> None:
        """Write the text about the results ``shown``, and above it ``remark``, unless empty."""
        self._text.content = results_text(shown, scene, remark)
        self._tensions.content = tensions_text(shown)
        self._python.content = python_text(self._arm, shown.setting)

    def move(self, q: Array) -> None:
        """Move the sliders of the joints to q (nv,) [rad] or [m], as far as their ends allow.

        Sliders of motors go back to where they started.
        """
        if self._start.pull is not None:
            for slider, taken in zip(self.pulls, self._start.pull.tolist(), strict=True):
                slider.value = MM * taken  # type: ignore[misc]
            return
        for joint, value in zip(self.joints, q / self._unit, strict=True):
            near = min(max(float(value), joint.min), joint.max)
            joint.value = round(near, 9) + 0.0  # type: ignore[misc]

    def add_slider(
        self, label: str, low: float, high: float, initial: float, step: float = 0.0
    ) -> viser.GuiSliderHandle[float]:
        """Add a slider; its ends are rounded inwards to steps, since no limit may be passed."""
        if step == 0.0:
            step = 10.0 ** math.floor(math.log10((high - low) / _STEPS)) if high > low else 1.0
        digits = max(0, round(-math.log10(step)))
        low = min(round(math.ceil(low / step - _ROUND) * step, digits), initial)
        high = max(round(math.floor(high / step + _ROUND) * step, digits), initial)
        slider = self._gui.add_slider(label, low, high, round(step, digits), initial)
        slider.precision = digits  # the box beside the slider has room for no more
        slider.on_update(lambda _: self._changed())
        return slider

    def _add_switch(self, label: str, on: bool, hint: str) -> viser.GuiCheckboxHandle:
        switch = self._gui.add_checkbox(label, on, hint=hint)
        switch.on_update(lambda _: self._changed())
        return switch

    def _press(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        if event.target.value == "Straight":
            self.move(np.zeros(self._arm.nv))
            return
        self.move(self._start.q)
        load = [self._start.minimum, *self._start.force.tolist()]
        for slider, value in zip(self._load, load, strict=True):
            slider.value = value  # type: ignore[misc]
        self._sag.value = self._start.sag  # type: ignore[misc]


def _force_range(arm: Manipulator, start: Setting) -> float:
    """Return the end [N] of the sliders of the force: twice what the arm holds along y or z.

    Where nothing bounds that, it is the force that moves the tip by 5 % of the arm's length.
    """
    sides = "y", "-y", "z", "-z"
    try:
        if start.pull is not None:
            source: Any = cdsm.forward_statics(arm, pull=start.pull)
            forces = []
        else:
            pose = arm.at(start.q)
            held = [cdsm.payload(pose, u, start.minimum, start.maximum) for u in sides]
            forces = [2.0 * case.limits["tension"] for case in held]
            forces = [force for force in forces if 0.0 < force < math.inf]
            source = cdsm.stiffness(pose, cdsm.distribute_tension(pose, start.minimum))
        sag = [_SAG_SHOWN * arm.length * source.along(u) for u in "yz"] if not forces else []
    except CdsmError:
        return _FORCE
    largest = max([*forces, *(force for force in sag if 0.0 < force < math.inf)], default=_FORCE)
    step = 10.0 ** math.floor(math.log10(largest))
    return math.ceil(largest / step - _ROUND) * step


def results_text(shown: Shown, scene: Scene, remark: str = "") -> str:
    """Write the results ``shown``: status, remarks, table of numbers, legend of the scene."""
    color = _COLORS.get(shown.status, _GREY)
    if shown.verdict is not None and shown.verdict.status in _DOUBTFUL:
        color = _AMBER
    style = f"background:{color};color:white;text-align:center"
    parts = [f'<div style="{style}"><b>{escaped(shown.heading)}</b></div>']
    parts += [] if shown.status is Status.OK else [f"{shown.status.message}."]
    parts += [escaped(line) for line in (remark, shown.problem) if line]
    parts.append(_table(_numbers(shown)))
    if shown.stiffness is not None:
        parts.append(escaped(model_of(shown.stiffness)))
    legend = [f"grid: {MM * scene.cell:g} mm"]
    if shown.ellipsoid is not None:
        legend.append(f"{_swatch(ELLIPSOID)} {shown.ellipsoid}")
    if shown.posture is not None and shown.setting.force.any():
        legend.append(f"{_swatch(FORCE)} force at the tip, {MM * scene.force_scale:.3g} mm per N")
    sticking, sliding = map(len, shown.holes)
    if sticking or sliding:
        marks = _swatch(STICKS), _swatch(SLIDES)
        legend.append(f"{marks[0]} {sticking} holes stick, {marks[1]} {sliding} slide")
    parts.append("<br>".join(legend))
    return _BOX.format("31em", "\n\n".join(parts))


def tensions_text(shown: Shown) -> str:
    """Write the tensions of all cables; mark slack cables and tensions at a bound."""
    if shown.tensions is None or shown.posture is None:
        return "unknown"
    marks: dict[str, str] = {}
    if shown.rest is not None:
        marks = dict.fromkeys(shown.rest.slack, "slack")
    elif shown.tension is not None:
        marks = dict.fromkeys(shown.tension.at_minimum, "at lower bound")
        marks |= dict.fromkeys(shown.tension.at_maximum, "at upper bound")
    names = shown.posture.arm.cables.names
    rows = (
        (f"{_swatch(color)} {escaped(name)}", f"{F:.4g}", f"N {marks.get(name, '')}")
        for name, F, color in zip(names, shown.tensions, shown.cable_colors, strict=True)
    )
    return _BOX.format("16em", _table(rows))


def python_text(arm: Manipulator, setting: Setting) -> str:
    """Write the lines of Python that compute the numbers, if the arm has the name ``arm``."""
    wrench = f"[{_joined(setting.force)}, 0, 0, 0]"
    if setting.pull is not None:
        return (
            "The same in Python:\n```\n"
            f"pull = [{_joined(setting.pull)}]\n"
            f"rest = cdsm.forward_statics(arm, pull=pull, wrench={wrench})\n```"
        )
    arguments = [f"{setting.minimum:.12g}"]
    arguments += [f"{setting.maximum:.12g}"] if math.isfinite(setting.maximum) else []
    arguments += [f"wrench={wrench}"] if setting.force.any() and not setting.sag else []
    last = "K = cdsm.stiffness(pose, tension)"
    if setting.sag and arm.has_friction:
        last = f"K = cdsm.load_cycle(pose, tension, [{wrench}]).stiffness(-1)"
    elif setting.sag:
        last = f"rest = cdsm.equilibrium(pose, tension, {wrench})"
    return (
        f"The same in Python:\n```\npose = arm.at([{_joined(setting.q)}])\n"
        f"tension = cdsm.distribute_tension(pose, {', '.join(arguments)})\n{last}\n```"
    )


def escaped(text: str) -> str:
    """Return text in which no character means anything to Markdown or HTML."""
    marked = re.sub(r"[^\w\s.,]|_", lambda match: f"&#{ord(match[0])};", text)
    return marked.replace("\n", "<br>")


def _numbers(shown: Shown) -> Iterator[tuple[str, str, str]]:
    """Yield what each number is, the number, and its unit."""
    K = shown.stiffness
    source = shown.source
    tensions = shown.tensions
    pose = shown.posture
    if source is not None:
        along = ", ".join(f"{N_PER_MM * source.along(u):.4g}" for u in np.eye(3))
        yield "stiffness along x, y, z", along, "N/mm"
        principal = principal_stiffness(source.compliance[:3, :3])
        for name in ("softest", "stiffest"):
            direction = coordinates(principal[f"{name}_direction"], "z.2f")
            yield f"{name}: {direction}", f"{N_PER_MM * principal[name]:.4g}", "N/mm"
        yield "largest compliance", f"{MM / principal['softest']:.3g}", "mm/N"
    if K is not None and shown.status is not Status.SINGULAR:
        yield "smallest joint stiffness", f"{K.margin:.4g}", K.posture.arm.stiffness_unit()
    if pose is not None:
        yield "tip", _joined(MM * pose.tip[:3, 3], "z.1f"), "mm"
    if shown.rest is not None:
        yield "displacement", _joined(MM * shown.rest.displacement, "z.1f"), "mm"
        if shown.rest.at_limit:
            yield "joint limit reached", escaped(", ".join(shown.rest.at_limit)), ""
    if tensions is not None and pose is not None:
        for name, c in (("smallest", tensions.argmin()), ("largest", tensions.argmax())):
            cable = escaped(pose.arm.cables[c].name)
            swatch = _swatch(shown.cable_colors[c])
            force = breaking_force(pose.arm.cables[c].elasticity)
            share = (
                "" if math.isnan(force) else f" ({100.0 * tensions[c] / force:.3g} % of breaking)"
            )
            yield f"{name} tension, {swatch} {cable}", f"{tensions[c]:.4g}", f"N{share}"


def _table(rows: Iterable[tuple[str, str, str]]) -> str:
    lines = [f"| {what} | {value} | &nbsp;{unit} |" for what, value, unit in rows]
    return "\n".join(["| | | |", "|:--|--:|:--|", *lines]) if lines else ""


def _swatch(color: Color) -> str:
    return f'<span style="background:rgb{color};border-radius:0.2em">&emsp;</span>'


def _joined(values: Iterable[float], form: str = "z.12g") -> str:
    return ", ".join(format(value, form) for value in values)

"""Build the panel of the page: the verdict on top, below it tabs with controls and answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, final

import numpy as np

from cdsm.dead_loads import point_on
from cdsm.manipulator import Manipulator
from cdsm.plots.style import MM
from cdsm.support.format import JointUnits
from cdsm.support.values import Array
from cdsm.view import texts
from cdsm.view.curve import CurveChart
from cdsm.view.ranges import ROUND, force_range, tension_range
from cdsm.view.scene import Scene
from cdsm.view.state import Setting, Shown

if TYPE_CHECKING:
    import viser

_STEPS = 500  # least number of steps of a slider, which is a few hundred pixels long
_PULLED = 0.1  # most wire that a motor takes in or pays out, over the arm's length
_LENGTHS = 10.0  # largest coordinate of a prismatic joint on its slider, over the arm's length
_AT_TIP: Final = "the tip"

_SAG: Final = (
    "Tension the cables without the force, lock the motors, then apply the force: the arm moves to "
    "its equilibrium. Otherwise the tensions hold the posture under the force."
)
_LINK: Final = "The link on which the force acts: at the centre of its disk, or at its frame."
_LEAST: Final = "Lower bound of all tensions; where the arm asks for more, that holds."


@final
class Panel:
    """Panel of the page: controls that set the arm, and text about the arm.

    The sliders of the force end at ± ``largest_force`` [N], which :meth:`fit_forces` sets.
    ``changed`` is called, in any thread, when a control has changed.
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
        self._ranges = {start.link: force_range(arm, start)}  # by link
        self._fitted = start.link
        self.largest_force = max(self._ranges[start.link], float(abs(start.force).max()))
        low, high, applied = tension_range(arm, start)
        self.tension_ends = (low, high)
        self._head = gui.add_html("")
        self.steps = gui.add_button_group("all", ("Straight", "Undo", "Reset"))
        self.save = gui.add_button_group("save", ("Picture", "Posture"))
        tabs = gui.add_tab_group()
        with tabs.add_tab("Answer"):
            self._answer = gui.add_html("")
            with gui.add_folder("Matrix K", expand_by_default=False):
                self._matrix = gui.add_html("")
            with gui.add_folder("The same in Python", expand_by_default=False):
                self._python = gui.add_html("")
            gui.add_html(texts.about_text(arm))
        self.posture_tab = tabs.add_tab("Posture")
        with self.posture_tab:
            self.joints, self.pulls, self._unit = self._add_inputs(arm, start)
        with tabs.add_tab("Tensions"):
            self._load = [self.add_slider("least tension [N]", low, high, applied, hint=_LEAST)]
            self._tensions = gui.add_html("")
            self.names = self._add_switch("show names", False, "Name the cables in the picture.")
            self.curve = CurveChart(gui, changed)
        with tabs.add_tab("Load"):
            self._link = self._add_links(arm, start.link)
            for axis, value in zip("xyz", start.force.tolist(), strict=True):
                ends = (-self.largest_force, self.largest_force)
                self._load.append(self.add_slider(f"force {axis} [N]", *ends, value))
            self._sag = self._add_switch("motors locked", start.sag, _SAG)
        if start.pull is not None:
            self._load[0].visible = self._sag.visible = self.curve.axis.visible = False
        inputs = [*self.joints, *self.pulls, *self._load, self._sag, self._link]
        self._inputs: list[Any] = [each for each in inputs if each is not None]
        self._reset = self.values

    def _add_inputs(self, arm: Manipulator, start: Setting) -> tuple[list[Any], list[Any], Array]:
        """Add sliders of the joints, or of the motors; return them, and the units of joints."""
        shown = JointUnits(arm.slides).shown
        unit = np.array([size for _, size in shown])
        if start.pull is not None:
            far = _PULLED * MM * arm.length
            names = [f"{name} [mm]" for name in arm.cables.names]
            rows = zip(names, (MM * start.pull).tolist(), strict=True)
            with self._gui.add_folder("Motors take in"):
                return [], [self.add_slider(name, -far, far, taken) for name, taken in rows], unit
        most = np.where(arm.slides, _LENGTHS * arm.length, 2.0 * math.pi)
        low = np.maximum(arm.lower, -most)
        high = np.minimum(arm.upper, most)
        ends = np.transpose([low, high, start.q] / unit).tolist()
        joints = [
            self.add_slider(f"{name} [{word.replace('deg', '°')}]", *numbers)
            for name, (word, _), numbers in zip(arm.joint_names, shown, ends, strict=True)
        ]
        return joints, [], unit

    def _add_links(self, arm: Manipulator, start: str) -> viser.GuiDropdownHandle[str] | None:
        """Add the choice of the link on which the force acts, if there are several."""
        names = [_AT_TIP, *loadable_links(arm)]
        if len(names) == 1:
            return None
        first = start or _AT_TIP
        chosen = self._gui.add_dropdown("force at", names, initial_value=first, hint=_LINK)
        chosen.on_update(lambda _: self._changed())
        return chosen

    @property
    def values(self) -> tuple[Any, ...]:
        """Values of all controls that set the arm."""
        return tuple(each.value for each in self._inputs)

    def put(self, values: Iterable[Any]) -> None:
        """Set the controls to :attr:`values` that they had."""
        for each, value in zip(self._inputs, values, strict=True):
            each.value = value

    def reset(self) -> None:
        """Set the controls to where they started."""
        self.put(self._reset)

    @property
    def setting(self) -> Setting:
        """What the controls say."""
        minimum, *force = [slider.value for slider in self._load]
        link = "" if self._link is None or self._link.value == _AT_TIP else self._link.value
        pushed = replace(self._start, force=np.array(force), link=link)
        if self.pulls:
            return replace(pushed, pull=np.array([slider.value / MM for slider in self.pulls]))
        q = self._unit * [joint.value for joint in self.joints]
        return replace(pushed, q=q, minimum=minimum, sag=self._sag.value)

    def fit_forces(self) -> None:
        """Let the sliders of the force end at what the arm holds at the chosen link, or later."""
        setting = self.setting
        link = setting.link
        if link == self._fitted:
            return
        self._fitted = link
        if link not in self._ranges:
            self._ranges[link] = force_range(self._arm, replace(self._start, link=link))
        self.largest_force = max(self._ranges[link], float(abs(setting.force).max()))
        step, digits = _step(2.0 * self.largest_force)
        for slider in self._load[1:]:
            slider.min, slider.max = -self.largest_force, self.largest_force
            slider.step, slider.precision = step, digits

    def update(self, shown: Shown, scene: Scene, remark: str) -> None:
        """Write about the results ``shown``, with a ``remark``; take away what comes later."""
        self._head.content = texts.head_text(shown, remark)
        self._answer.content = texts.answer_text(shown, scene)
        self._tensions.content = texts.tensions_text(shown)
        if self._matrix.content:
            self._matrix.content = self._python.content = ""
        self.curve.fade()

    def complete(self, shown: Shown, code: str) -> None:
        """Write what is not needed while a slider moves: the matrix, and lines of ``code``."""
        self._matrix.content = texts.matrix_text(shown)
        self._python.content = texts.code_text(code)

    def move(self, q: Array) -> None:
        """Move the sliders of the joints to q (nv,) [rad] or [m], as far as their ends allow.

        Sliders of motors go back to where they started.
        """
        if self._start.pull is not None:
            for slider, taken in zip(self.pulls, self._start.pull.tolist(), strict=True):
                slider.value = MM * taken
            return
        for joint, value in zip(self.joints, q / self._unit, strict=True):
            near = min(max(float(value), joint.min), joint.max)
            joint.value = round(near, 9) + 0.0

    def add_slider(
        self,
        label: str,
        low: float,
        high: float,
        initial: float,
        step: float = 0.0,
        hint: str | None = None,
    ) -> viser.GuiSliderHandle[float]:
        """Add a slider; its ends are rounded inwards to steps, since no limit may be passed."""
        step, digits = _step(high - low, step)
        low = min(round(math.ceil(low / step - ROUND) * step, digits), initial)
        high = max(round(math.floor(high / step + ROUND) * step, digits), initial)
        slider = self._gui.add_slider(label, low, high, step, initial, hint=hint)
        slider.precision = digits  # the box beside the slider has room for no more
        slider.on_update(lambda _: self._changed())
        return slider

    def _add_switch(self, label: str, on: bool, hint: str) -> viser.GuiCheckboxHandle:
        switch = self._gui.add_checkbox(label, on, hint=hint)
        switch.on_update(lambda _: self._changed())
        return switch


def _step(width: float, step: float = 0.0) -> tuple[float, int]:
    """Return the step of a slider of a ``width``, unless one is given, and its decimal digits."""
    if step == 0.0:
        step = 10.0 ** math.floor(math.log10(width / _STEPS)) if width > 0.0 else 1.0
    digits = max(0, round(-math.log10(step)))
    return round(step, digits), digits


def loadable_links(arm: Manipulator) -> list[str]:
    """Return the names of the links, but the tip's, on which a force may act.

    Of a generated arm they are the links with disks. A force on a point that no joint moves, such
    as the centre of the first joint, would do nothing.
    """
    body = arm.body
    disks = {disk.link for disk in arm.geometry.disks} if arm.is_serpentine else None
    return [
        name
        for name in body.link_names
        if name != arm.tip_link
        and body.joints_to(body.locate(name)[0])
        and (disks is None or name in disks)
        and not point_on(body, arm.definition.geometry, name, None).still
    ]

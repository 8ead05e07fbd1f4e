"""Build the panel of the page: controls that set the arm, and text about the arm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.directions import XYZ
from cdsm.support.values import Array
from cdsm.view.command import command_text
from cdsm.view.panel import basis_text, page_text, tensions_text
from cdsm.view.sliders import Range, Slider, joint_ranges, slider_range
from cdsm.view.state import Setting, Shown

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Control

_IN_FOLDER: Final = 10
"""Number of joints in one folder. Only the first folder is open."""

_STRAIGHT, _RESET, _FIT = "Straight", "Reset", "Fit camera"
_HINT: Final = (
    "All joints as near zero as they go; all controls as they were at the beginning; the whole arm "
    "into the picture."
)
_SAG: Final = (
    "Tension the cables without the force, lock the motors, then apply the force: the arm moves to "
    "its equilibrium. Otherwise the tensions hold the posture under the force."
)


class Controls:
    """Panel of the page: controls that set the arm, and text about the arm.

    ``arm_arguments`` are the arguments of the command ``cdsm`` that describe the arm. ``limits``
    [N] are the right ends of two sliders: of the lower bound of all tensions, and of each force
    component, whose left end is the negative. ``force_scale`` [m/N] is the length of the force
    arrow per newton. ``changed`` is called, in any thread, when a control has changed. ``fit`` fits
    the camera of a browser. ``admit`` is called with every control that browsers may use.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        arm: Manipulator,
        start: Setting,
        arm_arguments: Sequence[str] | None,
        limits: tuple[float, float],
        force_scale: float,
        changed: Callable[[], None],
        fit: Callable[[viser.ClientHandle], None],
        admit: Callable[[Control], None],
    ) -> None:
        self._gui, self._start = server.gui, start
        self._changed, self._fit, self._admit = changed, fit, admit
        self._arm, self._arm_arguments, self._force_scale = arm, arm_arguments, force_scale
        self._gui.add_html(basis_text(arm), order=-2.0)
        self._text = self._gui.add_html("", order=-1.0)  # above the path, which has 0
        with self._gui.add_folder("Load"):
            tension, force = limits
            high = max(tension, start.minimum)
            self._minimum = self._add(slider_range("least tension [N]", 0.0, high, start.minimum))
            self._force = [
                self._add(slider_range(f"force {axis} [N]", -force, force, f))
                for axis, f in zip(XYZ, start.force.tolist(), strict=True)
            ]
            self._sag = self.add_switch("let it sag", _SAG, start.sag)
        ranges = joint_ranges(arm, start.q)
        self._joints: list[Slider] = []
        for first in range(0, len(ranges), _IN_FOLDER):
            group = ranges[first : first + _IN_FOLDER]
            name = f"Joints {first + 1} to {first + len(group)}" if len(ranges) > 1 else "Joint"
            with self._gui.add_folder(name, expand_by_default=first == 0):
                self._joints += [self._add(joint) for joint in group]
        buttons = self._gui.add_button_group("all", (_STRAIGHT, _RESET, _FIT), hint=_HINT)
        buttons.on_click(self._press)
        admit(buttons)
        with self._gui.add_folder("Cable tensions"):
            self.names = self.add_switch(
                "show names", "A click on a cable in the picture names this cable alone.", False
            )
            self._tensions = self._gui.add_html("")
        self._command = self._gui.add_html("")

    @property
    def setting(self) -> Setting:
        """Current values of all controls."""
        return replace(
            self._start,
            q=np.array([joint.value for joint in self._joints]),
            minimum=self._minimum.value,
            force=np.array([component.value for component in self._force]),
            sag=self._sag.value,
        )

    def update(self, shown: Shown, remark: str) -> None:
        """Write the text about the results ``shown``, and above it ``remark``, unless empty."""
        self._text.content = page_text(shown, self._force_scale, remark)
        self._tensions.content = tensions_text(shown)
        self._command.content = command_text(self._arm, shown.setting, self._arm_arguments)

    def move(self, q: Array) -> None:
        """Move the sliders of the joints to q (nv,) [rad], or [m] for prismatic joints."""
        for joint, angle in zip(self._joints, q.tolist(), strict=True):
            joint.move(angle)

    def add_switch(self, label: str, hint: str, on: bool) -> viser.GuiCheckboxHandle:
        """Add a checkbox, at first checked if ``on``; a click calls the function ``changed``."""
        switch = self._gui.add_checkbox(label, on, hint=hint)
        switch.on_update(lambda _: self._changed())
        self._admit(switch)
        return switch

    def _add(self, ends: Range) -> Slider:
        handle = self._gui.add_slider(ends.label, ends.low, ends.high, ends.step, ends.initial)
        handle.precision = ends.digits  # the box beside the slider has room for no more
        handle.on_update(lambda _: self._changed())
        self._admit(handle)
        return Slider(handle, ends)

    def _press(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        if event.target.value == _STRAIGHT:
            for joint in self._joints:
                joint.straighten()
        elif event.target.value == _RESET:
            for slider in (*self._joints, *self._force, self._minimum):
                slider.reset()
            self._sag.value = self._start.sag  # type: ignore[misc]
        elif event.client is not None:
            self._fit(event.client)

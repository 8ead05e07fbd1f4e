"""Handle at the tip that users drag: the joints follow by inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.kinematics import inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.plots.style import MM
from cdsm.support.values import Array
from cdsm.view.panel import Panel
from cdsm.view.scene import HANDLE
from cdsm.view.state import Shown

if TYPE_CHECKING:
    import viser

_SIZE = 0.2  # size of the handle at the tip, over the arm's length


@final
class TipHandle:
    """Handle at the tip, which users drag. Each drag calls ``changed``, in any thread."""

    def __init__(
        self, scene: viser.SceneApi, arm: Manipulator, changed: Callable[[], None]
    ) -> None:
        self._arm = arm
        self._changed = changed
        self._target: Array | None = None
        self._dragged = False
        self._remark = ""
        self._q = np.full(arm.nv, np.nan)
        self._node = scene.add_transform_controls(
            HANDLE, _SIZE * arm.length, disable_rotations=True, depth_test=False, opacity=0.7
        )
        self._node.on_update(self._on_drag)

    async def _on_drag(self, event: viser.TransformControlsEvent) -> None:
        # viser keeps the order of these calls only if the function is asynchronous
        self._dragged = event.phase != "end"
        if event.phase == "update":
            self.aim(np.array(event.target.position))
        else:
            self._changed()

    def aim(self, target: Array) -> None:
        """Set a new target of the tip (3,) [m], and call ``changed``."""
        self._target = target
        self._changed()

    def follow(self, panel: Panel) -> None:
        """Move the joints of ``panel`` so that the tip is at, or nearest to, a new target."""
        target = self._target
        self._target = None
        if target is None or panel.pulls:
            return
        solution = inverse_kinematics(self._arm, target, panel.setting.q)
        panel.move(solution.angles)
        self._q = panel.setting.q
        self._remark = ""
        if not solution.reachable:
            stops = f" ({', '.join(solution.at_limit)} at a limit)" if solution.at_limit else ""
            missed = f"{MM * solution.position_error:.3g} mm"
            self._remark = f"The tip stays {missed} away from the handle{stops}."

    def update(self, shown: Shown) -> str:
        """Move the handle to the tip, unless it is dragged; return why the tip did not reach it.

        The reason is empty if the tip did, or if the arm has been moved since.
        """
        self._node.visible = shown.reference is not None and shown.setting.pull is None
        if shown.reference is not None and not self._dragged:
            self._node.position = shown.reference.tip[:3, 3]
        return self._remark if np.array_equal(shown.setting.q, self._q) else ""

"""Drag the tip of the arm by a handle: inverse kinematics moves the joints to follow it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.errors import CdsmError
from cdsm.kinematics import inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.plots.style import MM
from cdsm.support.values import Array
from cdsm.view.messages import HANDLE
from cdsm.view.state import Shown

if TYPE_CHECKING:
    from collections.abc import Callable

    import viser

_SIZE = 0.2  # size of the handle, as a fraction of the arm's length


class TipHandle:
    """Handle at the tip, which users drag. Each drag calls ``changed``, in any thread."""

    def __init__(
        self, server: viser.ViserServer, arm: Manipulator, changed: Callable[[], None]
    ) -> None:
        self._arm, self._changed = arm, changed
        self._target: Array | None = None
        self.dragged = False
        self._remark, self._q = "", np.full(arm.nv, np.nan)
        self._node = server.scene.add_transform_controls(
            HANDLE, _SIZE * arm.length, disable_rotations=True, depth_test=False, opacity=0.7
        )
        self._node.on_update(self._on_drag)

    async def _on_drag(self, event: viser.TransformControlsEvent) -> None:
        # viser keeps the order of these calls only if the function is asynchronous
        self.dragged = event.phase != "end"
        if event.phase == "update":
            self.aim(np.array(event.target.position))
        else:
            self._changed()

    def aim(self, target: Array) -> None:
        """Set a new target of the tip (3,) [m], and call ``changed``, which requests a search."""
        self._target = target
        self._changed()

    def solve(self, q: Array) -> Array | None:
        """Return joint angles (nv,) near ``q`` with the tip at, or nearest to, a new target.

        None if there has been no new target since the last call, or if the inverse kinematics
        raises an error.
        """
        target, self._target = self._target, None
        if target is None:
            return None
        try:
            found = inverse_kinematics(self._arm, target, q)
        except CdsmError as error:
            self._remark, self._q = str(error), q
            return None
        self._remark = ""
        if not found.reachable:
            stops = f"; at a limit: {', '.join(found.at_limit)}" if found.at_limit else ""
            self._remark = (
                f"The tip cannot reach the handle; it is {MM * found.position_error:.3g} mm away, "
                f"as near as was found{stops}."
            )
        return found.angles

    def moved_to(self, q: Array) -> None:
        """Store the angles (nv,) of the sliders, after the result of :meth:`solve` moved them."""
        self._q = q

    def remark(self, q: Array) -> str:
        """Return why the tip did not reach the handle.

        Empty if it did, or if the arm has been moved since: ``q`` (nv,) is not the stored angles.
        """
        return self._remark if np.array_equal(q, self._q) else ""

    def update(self, shown: Shown) -> None:
        """Move the handle to the tip of ``shown``, unless it is being dragged."""
        self._node.visible = shown.reference is not None
        if shown.reference is not None and not self.dragged:
            self._node.position = shown.reference.tip[:3, 3]

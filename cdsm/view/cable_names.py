"""Label cables in the 3D scene: all cables, or the one that was clicked."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.support.values import Array
from cdsm.view.state import Shown

if TYPE_CHECKING:
    import viser

_NEAR: Final = 0.012
"""Largest angle [rad] between a clicked ray and a cable that it hits: about 12 pixels."""


def clicked_cable(paths: Sequence[Array], origin: Array, direction: Array) -> int | None:
    """Return the index of the cable nearest to a ray from a camera; None if none is near.

    ``paths`` has the points (n, 3) [m] of each cable. The ray begins at ``origin`` (3,) [m].
    """
    u = direction / np.linalg.norm(direction)
    angles = [
        min(_angle(start - origin, end - start, u) for start, end in pairwise(path))
        for path in paths
    ]
    nearest = int(np.argmin(angles))
    return nearest if angles[nearest] < _NEAR else None


def _angle(start: Array, span: Array, u: Array) -> float:
    """Return the least angle [rad], seen from the origin, between u and a segment of a cable.

    u is a unit vector; the segment is ``start`` + t·``span``, t = 0 to 1.
    """
    across, off = span - (span @ u) * u, start - (start @ u) * u
    part = float(np.clip(-(off @ across) / max(float(across @ across), 1e-300), 0.0, 1.0))
    point = start + part * span
    return float(np.arctan2(np.linalg.norm(np.cross(u, point)), u @ point))


class CableNames:
    """Labels with name and tension, at the ends of all cables or of the clicked one."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._labels: dict[int, viser.LabelHandle] = {}
        self.all = False
        self.chosen: int | None = None

    def choose(self, shown: Shown, origin: Array, direction: Array) -> None:
        """Choose the cable of ``shown`` that a clicked ray hits; if it hits none, choose none.

        The ray begins at ``origin`` (3,) [m].
        """
        if shown.posture is not None:
            self.chosen = clicked_cable(shown.posture.cable_paths, origin, direction)

    def update(self, shown: Shown) -> None:
        """Update the labels to ``shown``: of all cables, or of the chosen one; hide the others."""
        pose, tensions = shown.posture, shown.tensions
        wanted: set[int] = set()
        if pose is not None:
            chosen = set() if self.chosen is None else {self.chosen}
            wanted = set(range(len(pose.cable_paths))) if self.all else chosen
            for c in wanted:
                if c not in self._labels:
                    self._labels[c] = self._scene.add_label(f"/names/{c}", "")
                name = pose.arm.cables[c].name
                label = self._labels[c]
                label.text = name if tensions is None else f"{name}: {tensions[c]:.4g} N"
                label.position = pose.cable_paths[c][-1]
        for c, label in self._labels.items():
            label.visible = c in wanted

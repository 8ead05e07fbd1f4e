"""Draw the surroundings of the arm: light, the base axes, and a grid with lengths."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.plots.style import MM

if TYPE_CHECKING:
    import viser

_LINE, _SECTION = (222, 222, 226), (180, 180, 188)
_CELLS: Final = 5  # number of grid cells between two labelled lines
_ROUNDING = 1e-9  # rounding of a logarithm


def draw_surroundings(server: viser.ViserServer, length: float) -> None:
    """Add light, the base axes, and a grid below the base, sized for an arm of ``length`` [m]."""
    scene = server.scene
    # an environment map and shadows take seconds without a GPU
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(cast_shadow=False)
    scene.add_light_ambient("/light", intensity=2.0)
    scene.add_frame("/base", axes_length=0.15 * length, axes_radius=0.004 * length)
    for axis, name in zip(0.17 * length * np.eye(3), "xyz", strict=True):
        scene.add_label(f"/base/{name}", name, position=axis)
    step = section(length)
    far, side = math.ceil(1.2 * length / step) * step, math.ceil(0.8 * length / step) * step
    near, floor = -step, -math.ceil(0.3 * length / step) * step
    scene.add_grid(
        "/grid",
        far,
        side - near,
        position=(far / 2.0, (side + near) / 2.0, floor),
        cell_size=step / _CELLS,
        section_size=step,
        cell_color=_LINE,
        section_color=_SECTION,
        fade_distance=100.0 * length,
    )
    labels = {f"{MM * x:.4g} mm": (x, near, floor) for x in np.arange(step, far - step / 2, step)}
    labels |= {f"x = {MM * far:.4g} mm": (far, near, floor)}
    labels |= {f"x = 0, z = {MM * floor:.4g} mm": (0.0, near, floor)}
    labels |= {f"y = {MM * y:.4g} mm": (far, y, floor) for y in (0.0, side)}
    for i, (text, place) in enumerate(labels.items()):
        scene.add_label(
            f"/lengths/{i}", text, position=place, font_screen_scale=0.8, anchor="top-center"
        )


def section(length: float) -> float:
    """Compute the spacing [m] of the labelled grid lines: 1, 2 or 5 times 10ⁿ, up to length/3."""
    power = math.log10(length / 3.0)
    decade = math.floor(power + _ROUNDING)
    part = max(part for part in (1.0, 2.0, 5.0) if math.log10(part) <= power - decade + _ROUNDING)
    return part * 10.0**decade

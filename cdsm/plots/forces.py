"""Plot the tip forces that the cables can balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from cdsm.errors import InvalidInput
from cdsm.plots.arm import frame_arms
from cdsm.plots.style import BLACK, SKY, VERMILLION, expect, finish_picture, picture_axes

if TYPE_CHECKING:
    from cdsm.measures.polytope import ForcePolytope


def plot_force_polytope(polytope: ForcePolytope) -> Figure:
    """Plot the tip forces [N] that the cables can balance, and the worst direction.

    Raises InvalidInput if ``polytope`` is not a result of :func:`~cdsm.force_polytope`, or has no
    surface: the tip cannot move in some direction, or the cables balance forces in one plane only.
    """
    expect("polytope", polytope, "ForcePolytope")
    if not len(polytope.faces):
        raise InvalidInput(
            "polytope", "has no surface in three dimensions to draw; bend the arm, or add cables."
        )
    figure, axes = picture_axes()
    axes.computed_zorder = False  # lines in front of the surface
    triangles = polytope.vertices[polytope.faces]
    axes.add_collection3d(
        Poly3DCollection(triangles, facecolor=SKY, edgecolor="0.4", linewidth=0.15, alpha=0.35)
    )
    nearest = polytope.radius * polytope.worst_direction
    axes.plot([0.0], [0.0], [0.0], "+", color=BLACK, markersize=7, label="no load")
    axes.plot(
        *np.transpose([np.zeros(3), nearest]),
        color=VERMILLION,
        linewidth=1.4,
        label=f"worst direction: {polytope.radius:.4g} N",
    )
    box = np.array([polytope.vertices.min(axis=0), polytope.vertices.max(axis=0)])
    frame_arms(axes, box.T, "force {} [N]")
    finish_picture(figure, axes, "loads at the tip that the cables hold")
    return figure

"""Figure of the tip forces that the cables can balance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from cdsm.errors import InvalidInput
from cdsm.plots.style import (
    AXES,
    BLACK,
    ONE_COLUMN,
    SCREEN,
    SKY,
    SMALL,
    TEXT,
    VERMILLION,
    equal_axes,
    expect,
    fill_canvas,
    heading,
)

if TYPE_CHECKING:
    from cdsm.measures.forces import ForcePolytope


def plot_force_polytope(polytope: ForcePolytope) -> Figure:
    """Plot the tip forces [N] that the cables can balance, and the worst direction.

    Args:
        polytope: The result of :func:`cdsm.force_polytope`.

    Raises:
        InvalidInput: ``polytope`` is not a force polytope, or has no surface: the tip cannot move
            in some direction, or the cables balance forces in one plane only.
    """
    expect("polytope", polytope, "ForcePolytope")
    if not len(polytope.faces):
        raise InvalidInput(
            "polytope", "has no surface in three dimensions to draw; bend the arm, or add cables."
        )
    figure = Figure(figsize=(ONE_COLUMN, ONE_COLUMN), dpi=SCREEN)
    axes = figure.add_subplot(projection="3d")
    triangles = polytope.vertices[polytope.faces]
    axes.add_collection3d(
        Poly3DCollection(triangles, facecolor=SKY, edgecolor="0.4", linewidth=0.15, alpha=0.35)
    )
    nearest = polytope.margin() * polytope.worst_direction
    axes.plot([0.0], [0.0], [0.0], "+", color=BLACK, markersize=7, label="no load")
    axes.plot(
        *np.transpose([np.zeros(3), nearest]),
        color=VERMILLION,
        linewidth=1.4,
        label=f"worst direction: {polytope.margin():.4g} N",
    )
    for name, low, high in zip(
        AXES, polytope.vertices.min(axis=0), polytope.vertices.max(axis=0), strict=True
    ):
        getattr(axes, f"set_{name}lim")(low, high)
        getattr(axes, f"set_{name}label")(f"force {name} [N]", fontsize=TEXT)
    axes.tick_params(labelsize=SMALL, pad=1)
    equal_axes(axes, 0.8)
    heading(figure, "loads at the tip that the cables hold")
    figure.legend(loc="lower center", ncols=2, fontsize=SMALL, frameon=False)
    fill_canvas(axes)
    return figure
